"""Hydra's private modules are behind one wall, and the installed Hydra is one that the wall knows."""

import ast
from importlib.metadata import version
from pathlib import Path

import pytest

from charnerf.config.hydra_internals import looks_only, options_first, read_arguments, split_sweep
from charnerf.config.overrides import parse_overrides

ROOT = Path(__file__).resolve().parents[2]
WALL = ROOT / "src/charnerf/config/hydra_internals.py"
FILES = [ROOT / "train.py", *(file for room in ("src", "tests") for file in (ROOT / room).rglob("*.py"))]


def test_nothing_else_imports_a_private_module_of_hydra() -> None:
    importing = {file for file in FILES if any("._" in f".{name}" for name in hydra_modules(file))}
    assert importing == {WALL}


def hydra_modules(file: Path) -> list[str]:
    """Full names of what a file imports of hydra."""
    names = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return [name for name in names if name.split(".")[0] == "hydra"]


def test_this_hydra_is_known_to_work() -> None:
    major, minor, patch = (int(number) for number in version("hydra-core").split(".")[:3])
    assert (major, minor) == (1, 3)
    assert patch >= 4


def test_a_command_line_is_read_as_hydra_reads_it() -> None:
    read = read_arguments(["-m", "seed=0,1", "-cn", "other"])
    assert read.multirun
    assert (read.overrides, read.config_name) == (["seed=0,1"], "other")
    assert not looks_only(read)


def test_overrides_may_stand_on_both_sides_of_options() -> None:
    typed = ["combinator=mean", "-m", "seed=0,1", "-cn", "train", "scale=smoke"]
    assert read_arguments(typed).overrides == ["combinator=mean", "seed=0,1", "scale=smoke"]
    assert options_first(typed) == ["-m", "-cn", "train", "combinator=mean", "seed=0,1", "scale=smoke"]
    for looks in (["seed=1", "--info"], ["seed=1", "--cfg", "job"]):
        assert options_first(looks) == looks, "--info would take an override behind it"


@pytest.mark.parametrize("flag", ["--help", "--cfg=job", "--hydra-help", "--info"])
def test_what_only_looks(flag: str) -> None:
    assert looks_only(read_arguments([flag]))


def test_a_sweep_is_split_into_jobs() -> None:
    swept = parse_overrides(["seed=0,1", "scale.width=16", "budget.steps=2,4"])
    assert split_sweep(swept) == [
        ["seed=0", "scale.width=16", "budget.steps=2"],
        ["seed=0", "scale.width=16", "budget.steps=4"],
        ["seed=1", "scale.width=16", "budget.steps=2"],
        ["seed=1", "scale.width=16", "budget.steps=4"],
    ]
