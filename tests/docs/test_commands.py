"""Every command, key, option and path that README and docs print: run where that takes seconds, parsed or composed elsewhere."""

import ast
import json
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import trimesh
import typer
import yaml
from omegaconf import OmegaConf
from PIL import Image

from charnerf.cli import commands
from charnerf.cli.commands import door, run
from charnerf.config import command_line
from charnerf.config.composition import compose_config
from docs.__main__ import pages
from support import helpers

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*pages(), ROOT / ".github" / "CONTRIBUTING.md"]
DOOR = typer.main.get_command(door)
COMMANDS = DOOR.commands  # type: ignore[attr-defined]
ELSEWHERE = (
    "pip",
    "venv",
    "pytest",
    "ruff",
    "mypy",
    "tensorboard",
    ".",
    "git",
    ".ci/run",
)  # not ours, or run by CI
FENCED = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
MARKED = re.compile(r"<!--.*?-->", re.DOTALL)


def lines_of(page: Path) -> list[str]:
    """The shell lines of a page: continued ones joined, variables put in, comments and chains taken apart."""
    text = FENCED.sub("", page.read_text(encoding="utf-8")).replace("\\\n", " ")
    lines, variables = [], {}
    for found in re.findall(r"^ {4}(.*)$", text, re.MULTILINE):
        for part in re.split(r" && |; ", re.sub(r"(^|\s)#.*", "", found)):
            line = re.sub(r"\$(\w+)", lambda name: variables[name[1]], part.strip())
            assigned = re.fullmatch(r'(\w+)="(.*)"', line)
            if assigned:
                variables[assigned[1]] = assigned[2]
            elif line and not line.startswith("DATASET/"):
                lines.append(line)
    return lines


EXAMPLES = [
    (f"help of {name}", example)
    for name in COMMANDS
    for example in getattr(getattr(commands, name), "EXAMPLES", ())
]
EXAMPLES += [
    ("help of train", line.split("#")[0].strip())
    for line in (ROOT / "conf" / "train.yaml").read_text(encoding="utf-8").splitlines()
    if line.strip().startswith("python train.py")
]
EVERY = [*((page.name, line) for page in PAGES for line in lines_of(page)), *EXAMPLES]
TRAINING = [line for _, line in EVERY if re.match(r"python train\.py|charnerf train", line)]
SWEEPS = re.findall(
    r"`((?:experiment=|\S+=)[^`]*,[^`]*)`", (ROOT / "docs/results.md").read_text(encoding="utf-8")
)
QUICK = ("charnerf capture meshes/", "charnerf generate -o few", "charnerf draw ")


def test_every_line_is_of_a_known_program() -> None:
    for page, line in EVERY:
        words = shlex.split(line)
        program = (
            words[2] if words[:2] == ["python", "-m"] else words[1] if words[0] == "python" else words[0]
        )
        ours = (
            program
            in (
                "charnerf",
                "train.py",
                "benchmarks",
                "benchmarks.soak",
                "benchmarks.plan",
                "docs",
                "docs.pictures",
                "docs.take",
            )
            or (ROOT / program).is_file()
        )
        assert ours or program in ELSEWHERE, f"{page}: {line}"


@pytest.mark.parametrize("line", dict.fromkeys([*TRAINING, *SWEEPS]))
def test_a_training_composes(line: str, conf: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Of a grid the last cell, which has all that is swept."""
    every = command_line.jobs_of
    monkeypatch.setattr(command_line, "jobs_of", lambda overrides: every(overrides)[-1:])
    monkeypatch.setattr(command_line, "check_files", lambda cfg: None)  # a data set that is not here
    words = [
        word for word in shlex.split(line) if word not in ("python", "train.py", "charnerf", "train", "-m")
    ]
    command_line.check_command_line(["-m", *words] if line in SWEEPS or " -m " in line else words, conf=conf)


def test_there_are_sweeps() -> None:
    assert len(SWEEPS) > 20


@pytest.mark.parametrize("line", dict.fromkeys(line for _, line in EVERY if line.startswith("charnerf ")))
def test_a_command_line_parses(line: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Files and folders that a page speaks of are made as they are missed."""
    monkeypatch.chdir(tmp_path)
    name, *words = shlex.split(line)[1:]
    for _ in range(len(words) + 1):
        try:
            COMMANDS[name].make_context(name, list(words))
            return
        except typer.BadParameter as error:
            missed = re.search(r"(file|dir|path)\w* '(.+)' does not exist", str(error), re.IGNORECASE)
            if missed is None:
                raise
            place = tmp_path / missed[2]
            place.parent.mkdir(parents=True, exist_ok=True)
            place.touch() if missed[1].lower() == "file" else place.mkdir()
    raise AssertionError(line)


MACHINES = [line for page, line in EVERY if page == "machines.md"]
BRIEFLY = ["trainer=cpu", "scale.steps=2", "validation.times=1", "scale.eval_views=1", "data=folder"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "line", [line for line in MACHINES if re.search("=joblib|_local|charnerf search", line)]
)
def test_more_machines_work_as_typed(line: str, figure_dataset: Path, tmp_path: Path) -> None:
    """At the smallest scale, for two steps."""
    shorter = line.replace("scale=small budget.seconds=120", "").replace("--trials 40", "--trials 2")
    words = [sys.executable if word == "python" else word for word in shlex.split(shorter)]
    words = [str(ROOT / word) if word == "train.py" else word for word in words]
    command = [*words, *BRIEFLY, "scale=smoke", f"data.root={figure_dataset}"]
    if command[0] == "charnerf":
        command = [sys.executable, "-m", *command]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    cells = sorted(tmp_path.glob("outputs/**/cell.json"))
    assert len(cells) >= 2 and {json.loads(file.read_text())["state"] for file in cells} == {"done"}
    (grid,) = {file.parent.parent for file in cells}
    assert (grid / "report.md").is_file() and (grid / "front.csv").is_file() == ("search" in line)


@pytest.mark.slow
def test_the_tutorial_works_as_typed(tmp_path: Path) -> None:
    """Line by line, in one folder."""
    for line in lines_of(ROOT / "docs" / "tutorial.md"):
        words = [sys.executable, "-m", *shlex.split(line)]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
    mesh = trimesh.load_mesh(tmp_path / "hero/mesh.glb")
    assert mesh.extents.max() == pytest.approx(2.0, rel=0.01) and (tmp_path / "hero/report.html").is_file()
    assert len(list((tmp_path / "levels").glob("*_LOD[0-9].glb"))) >= 3
    grid = tmp_path / "outputs" / "first"
    states = [json.loads(file.read_text())["state"] for file in grid.glob("*/cell.json")]
    assert states == 4 * ["done"] and (grid / "report.html").is_file()


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as the pages have it: drawings, and a mesh that is called anna."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "meshes").mkdir()
    body = trimesh.creation.box((0.8, 1.6, 0.4))
    body.visual.face_colors = (200, 30, 30, 255)
    trimesh.Scene([body]).export(folder / "meshes" / "anna.glb")
    views = helpers.source_views(helpers.person(symmetric=False))
    for name, image in zip(("front", "side", "back"), views.images[0].movedim(1, -1), strict=True):
        Image.fromarray(helpers.as_bytes(image)).save(folder / f"{name}.png")
    return folder


def test_what_ends_within_seconds_runs(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(desk)
    for start in QUICK:
        line = next(line for _, line in EVERY if line.startswith(start))
        fewer = ["--views", "2"] if start.startswith("charnerf capture") else []
        assert run([*shlex.split(line)[1:], *fewer]) == 0, line


def test_the_library_is_as_the_readme_says(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(desk)
    (code,) = [
        code for kind, code in FENCED.findall((ROOT / "README.md").read_text(encoding="utf-8")) if kind
    ]
    for typed, quicker in {
        "size=256": "size=64",
        "resolution=128, faces=8000": "resolution=48, faces=800",
    }.items():
        assert typed in code
        code = code.replace(typed, quicker)
    (desk / "readme.py").write_text(code)
    found = runpy.run_path(str(desk / "readme.py"))
    assert found["image"].shape == (64, 64, 4)
    assert (desk / "hero.glb").is_file()


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_python_of_the_pages_imports_what_is_there(page: Path) -> None:
    for kind, code in FENCED.findall(page.read_text(encoding="utf-8")):
        if kind == "python":
            compile(code, page.name, "exec")
            for line in re.findall(r"^(?:from charnerf|import charnerf).*$", code, re.MULTILINE):
                exec(line, {})


def inline(page: Path) -> Iterator[str]:
    """What stands between backquotes in a page's words."""
    text = MARKED.sub("", FENCED.sub("", page.read_text(encoding="utf-8")))
    yield from re.findall(r"`([^`\n]+)`", re.sub(r"^ {4}.*$", "", text, flags=re.MULTILINE))


@pytest.fixture(scope="module")
def keys() -> set[str]:
    """Every key of the default config, and of each option of every group."""
    configs = [compose_config(more) for more in ([], ["experiment=charnerf"])]
    found = {key for cfg in configs for key in _flat(OmegaConf.to_container(cfg))}
    for file in (ROOT / "conf").glob("*/*.yaml"):
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
        found |= {f"{file.parent.name}.{key}" for key in _flat(content)}
    return found


def _flat(content: object, before: str = "") -> Iterator[str]:
    if isinstance(content, dict):
        for name, item in content.items():
            yield f"{before}{name}"
            yield from _flat(item, f"{before}{name}.")


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_every_key_option_and_path_is_there(page: Path, keys: set[str]) -> None:
    options = {name for command in (DOOR, *COMMANDS.values()) for one in command.params for name in one.opts}
    options |= {"--help", "--config-dir", "--config-path"}  # the last two are Hydra's
    for text in inline(page):
        for word in text.split():
            key, is_value, value = word.lstrip("+'").partition("=")
            if word.startswith("--") and text.split()[0] in ("charnerf", word):
                assert word in options, text
            elif is_value and (ROOT / "conf" / key).is_dir():
                for option in value.strip("[]'").split(","):
                    assert (ROOT / "conf" / key / f"{option}.yaml").is_file() or not option.isidentifier(), (
                        text
                    )
            elif is_value and re.fullmatch(r"[a-z_]+(\.[a-z_]+)+", key) and not key.startswith("hydra."):
                assert key in keys or key.rpartition(".")[0] in keys, text
            elif re.match(r"(src|conf|docs|tests|benchmarks)/[a-z_0-9/.]+$", word):
                assert (ROOT / word).exists(), text


def fault_rows() -> list[tuple[str, str]]:
    """Each fault of the table of what is promised, and the cell that names its tests."""
    text = (ROOT / "docs/reliability.md").read_text(encoding="utf-8")
    lines = text.partition("## Faults")[2].partition("\n## ")[0].splitlines()
    rows = [line.strip("| ").split(" | ") for line in lines if line.startswith("| ")]
    table = rows[2 : next(number for number, row in enumerate(rows) if row[0] == "again and again")]
    assert all(len(row) == 3 for row in table) and len(table) > 40
    return [(row[0], row[2]) for row in table]


@pytest.mark.parametrize("fault,cell", fault_rows())
def test_every_fault_names_tests_that_are_there(fault: str, cell: str) -> None:
    """A file said to be slow has slow tests; one of another has tests that always run."""
    named = re.findall(r"`(tests/[a-z_0-9/]+\.py)`( \(slow\))?", cell)
    assert named, fault
    for file, slow in named:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        marked = [
            any("mark.slow" in ast.unparse(mark) for mark in test.decorator_list)
            for test in tree.body
            if isinstance(test, ast.FunctionDef) and test.name.startswith("test_")
        ]
        whole = any(
            isinstance(line, ast.Assign) and "pytestmark" in (text := ast.unparse(line)) and "slow" in text
            for line in tree.body
        )
        assert marked and (whole or any(marked) if slow else not whole and not all(marked)), file


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            file, _, heading = target.partition("#")
            found = (page.parent / file) if file else page
            assert found.exists(), f"{page.name}: {target}"
            titles = (
                re.findall(r"^#+ (.*)$", found.read_text(encoding="utf-8"), re.MULTILINE) if heading else []
            )
            assert not heading or heading in {
                re.sub(r"[^\w -]", "", one.lower()).replace(" ", "-") for one in titles
            }


@pytest.mark.parametrize("folder", ["docs"])
def test_every_picture_is_shown(folder: str) -> None:
    texts = [page.read_text(encoding="utf-8") for page in [*PAGES, *(ROOT / folder).glob("*/*.md")]]
    for picture in [*(ROOT / folder).rglob("*.png"), *(ROOT / folder).rglob("*.jpg")]:
        assert any(picture.name in text for text in texts), f"{picture}: no page shows it"
