"""What an installed package carries."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import charnerf
from charnerf.config.options import conf_folder

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
WORKFLOW = (ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8")


def test_every_public_name_is_there_and_imported_late() -> None:
    code = "import sys, charnerf; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
    assert all(getattr(charnerf, name) is not None for name in charnerf.__all__)
    with pytest.raises(AttributeError, match="nothing"):
        charnerf.nothing  # noqa: B018
    assert set(charnerf.__all__) <= set(dir(charnerf))


def test_the_version_is_the_projects() -> None:
    assert charnerf.__version__ == PROJECT["project"]["version"]


def test_config_files_are_found_and_shipped() -> None:
    assert (conf_folder() / "train.yaml").is_file()
    assert PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]["conf"] == "charnerf/conf"


def test_an_installed_package_trains_by_its_own_config_files(tmp_path: Path) -> None:
    """The files laid out as the wheel has them, beside no checkout; what Hydra prints comes through."""
    package = tmp_path / "site" / "charnerf"
    shutil.copytree(
        ROOT / "src" / "charnerf", package, ignore=shutil.ignore_patterns("weights", "__pycache__")
    )
    shutil.copytree(ROOT / "conf", package / "conf")
    empty = tmp_path / "empty"
    empty.mkdir()

    composed, described = ["scale=smoke", "--cfg", "job", "--package", "scale"], ["--help"]
    code = f"from charnerf.cli import run; run(['train', *{composed}]); run(['train', *{described}])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=empty,
        env={**os.environ, "PYTHONPATH": str(package.parent)},
    )
    assert "image_size: 32" in done.stdout
    assert "combinator: learned, mean, sa, view_mha" in done.stdout
    assert not list(empty.iterdir())


def test_the_command_is_declared() -> None:
    assert PROJECT["project"]["scripts"] == {"charnerf": "charnerf.cli:main"}


def test_ci_runs_what_the_readme_says() -> None:
    """The README's test command and the linters; the workflow runs the same."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    test = re.search(r"^ {4}(python -m pip install .* && python -m pytest -n auto)$", readme, re.MULTILINE)
    assert test is not None
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8").replace(" --quiet", "")
    assert "set -euo pipefail" in script
    for step in (*test[1].split(" && "), "ruff check .", "ruff format --check .", "mypy"):
        assert f"\n{step}\n" in script
        assert step in WORKFLOW
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111


def locked() -> dict[str, list[str]]:
    """Versions in the lock file by package; one that differs between Pythons stands there more than once."""
    found: dict[str, list[str]] = {}
    for name, version in re.findall(
        r"^([a-z0-9][a-z0-9.-]*)==([^\s;]+)(?: ;.*)? \\\n {4}--hash=sha256:", LOCK, re.MULTILINE
    ):
        found.setdefault(name, []).append(version)
    return found


def needed(extra: str) -> list[Requirement]:
    """What the package and an extra need, those extras that it names with it."""
    optional, waiting, found = PROJECT["project"]["optional-dependencies"], [extra], []
    while waiting:
        for text in optional[waiting.pop()]:
            one = Requirement(text)
            waiting += one.extras if one.name == "charnerf" else ()
            found += [] if one.name == "charnerf" else [one]
    return [*map(Requirement, PROJECT["project"]["dependencies"]), *found]


def test_the_lock_file_holds_all_that_the_tests_need() -> None:
    versions = locked()
    for one in needed("test"):
        assert all(one.specifier.contains(version) for version in versions[one.name]), one


def test_the_lock_file_has_a_hash_for_every_package_and_names_no_host() -> None:
    packages = [line for line in LOCK.splitlines() if line and line[0] not in "# "]
    assert len(packages) == sum(map(len, locked().values())) > 100
    assert "://" not in LOCK


def test_the_oldest_and_the_newest_versions_are_tested_too() -> None:
    matrix = yaml.safe_load(WORKFLOW)["jobs"]["test"]["strategy"]["matrix"]
    tested = {(one, "newest") for one in matrix["python-version"]}
    tested |= {(one["python-version"], one["versions"]) for one in matrix["include"]}
    allowed = SpecifierSet(PROJECT["project"]["requires-python"])
    pythons = [one for one in ("3.10", "3.11", "3.12", "3.13", "3.14") if allowed.contains(one)]
    assert tested == {(one, "newest") for one in pythons} | {(pythons[0], "oldest"), ("3.12", "locked")}
    for one in map(Requirement, PROJECT["project"]["dependencies"]):  # what `oldest` and `newest` mean
        assert any(bound.operator == ">=" for bound in one.specifier), one
