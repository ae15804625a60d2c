"""Which room may import which, checked on the source text; the list of floors is the rule."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "charnerf"
FILES = sorted(PACKAGE.rglob("*.py"))
MAX_LINES = 400
MAX_FUNCTION_LINES = 50

FLOORS = (  # from the ground up; a room may import rooms on floors below its own, and no other
    ("errors",),
    ("types", "checks", "schedule", "files", "markdown"),
    ("pictures",),
    ("process",),
    ("geometry",),
    ("scene",),
    ("config", "models", "reconciling", "surfaces", "volume"),
    ("losses",),
    ("data", "meshing", "procedural"),
    ("capture", "evaluation"),
    ("drawings",),
    ("inference",),
    ("finetuning", "reporting"),
    ("reconstruction", "training"),
    ("bench", "stability"),
    ("cli", "__init__"),
    ("__main__",),
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
ONLY_IN = {  # foreign package: where it may be imported
    "hydra": ("config", "inference", "cli/train"),
    "omegaconf": (
        "cli/model",
        "cli/evaluate",
        "cli/train",
        "config",
        "inference",
        "training/run",
        "training/data",
        "training/trainer",
        "training/start",
        "training/finish",
        "training/cells",
    ),
    "lightning": ("training", "data/datamodule"),
    "typer": ("cli",),
}
DOORS = {"cli"}  # and train.py: they alone change settings of the process

GLOBAL_SETTERS = {
    "seed",
    "manual_seed",
    "seed_everything",
    "set_num_threads",
    "set_float32_matmul_precision",
    "set_default_dtype",
    "setdefault",
    "use",
    "mallopt",
}


def imports_of(file: Path) -> Iterator[tuple[int, str]]:
    """Line and full name of everything that a file imports, in functions too; type checking aside."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    skipped = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
        for statement in node.body
        for inner in ast.walk(statement)
    }
    for node in ast.walk(tree):
        if node in skipped:
            continue
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: relative import, expected a full name"
            if node.module == "charnerf":
                yield from ((node.lineno, f"charnerf.{alias.name}") for alias in node.names)
            elif node.module is not None:
                yield node.lineno, node.module


def room_of(file: Path) -> str:
    """First folder below the package, or the module."""
    return file.relative_to(PACKAGE).with_suffix("").parts[0]


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_rooms_import_downward_only(file: Path) -> None:
    room = room_of(file)
    assert room in FLOOR_OF, f"{file}: room '{room}' is on no floor; put it into the list"
    for line, name in imports_of(file):
        if not name.startswith("charnerf."):
            continue
        other = name.split(".")[1]
        if other != room and other in FLOOR_OF:
            assert FLOOR_OF[other] < FLOOR_OF[room], (
                f"{file}:{line}: {room} imports {other}, which is not below it"
            )


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_the_generator_has_one_face(file: Path) -> None:
    """Other rooms import what `charnerf.procedural` itself names, nothing inside."""
    inside = [name for _, name in imports_of(file) if name.startswith("charnerf.procedural.")]
    assert room_of(file) == "procedural" or not inside, (
        f"{file}: imports {inside}, expected charnerf.procedural"
    )


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_frameworks_stay_in_their_rooms(file: Path) -> None:
    module = file.relative_to(PACKAGE).with_suffix("").as_posix()
    for line, name in imports_of(file):
        places = ONLY_IN.get(name.split(".")[0])
        if places is not None:
            fine = any(module == place or module.startswith(f"{place}/") for place in places)
            assert fine, f"{file}:{line}: imports {name}, which belongs to {', '.join(places)}"


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_settings_of_the_process_belong_to_doors(file: Path) -> None:
    if room_of(file) not in DOORS:
        for line, name in imports_of(file):
            assert not name.startswith("charnerf.process"), f"{file}:{line}: only doors set the process"


@pytest.mark.parametrize(
    ("title", "most", "by_disk"),
    [("From three PNGs to mesh.glb", 20, []), ("From a mesh file to a batch", 12, ["training/data.py"])],
)
def test_a_reader_gets_from_end_to_end(title: str, most: int, by_disk: list[str]) -> None:
    """CONTRIBUTING's path is short, one before it imports each file, and no two things on it have one name.

    A file that is met by what lies on disk imports what wrote it instead.
    """
    text = (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = text.split(f"### {title}\n")[1].split("\n#")[0]
    numbers, names = zip(*re.findall(r"^(\d+)\. `([\w/]+\.py)`: ", section, re.MULTILINE), strict=True)
    assert list(map(int, numbers)) == list(range(1, len(names) + 1))
    assert len(names) <= most
    files = [PACKAGE / name for name in names]
    unmet = [
        name
        for index, name in enumerate(names[1:], start=1)
        if not any(is_imported(files[index], by=before) for before in files[:index])
    ]
    assert unmet == by_disk
    for name in by_disk:
        index = names.index(name)
        assert any(is_imported(before, by=files[index]) for before in files[:index])
    public = [name for file in files for name in public_names(file)]
    assert sorted(name for name in set(public) if public.count(name) > 1) == []


def is_imported(file: Path, *, by: Path) -> bool:
    """Whether a file imports another one, or a name of its room that has the other one's name."""
    module = "charnerf." + ".".join(file.relative_to(PACKAGE).with_suffix("").parts)
    tree = ast.parse(by.read_text(encoding="utf-8"))
    froms = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return any(
        module in (node.module, f"{node.module}.{alias.name}") for node in froms for alias in node.names
    )


def public_names(file: Path) -> list[str]:
    """Functions and classes of a file that others may use."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return [
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
    ]


def test_no_drawer_for_leftovers() -> None:
    names = {part for file in FILES for part in file.relative_to(PACKAGE).with_suffix("").parts}
    assert not names & {"utils", "util", "helpers", "misc", "common"}


@pytest.mark.parametrize("file", [*FILES, ROOT / "train.py"], ids=lambda file: file.name)
def test_files_stay_short(file: Path) -> None:
    count = len(file.read_text(encoding="utf-8").splitlines())
    assert count <= MAX_LINES, f"{file}: {count} lines, expected at most {MAX_LINES}; split it by idea"


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_functions_stay_short(file: Path) -> None:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            count = (node.end_lineno or 0) - node.lineno + 1
            assert count <= MAX_FUNCTION_LINES, (
                f"{file}:{node.lineno}: {node.name} has {count} lines, expected at most {MAX_FUNCTION_LINES}; name a step of it"
            )


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_importing_changes_no_global_state(file: Path) -> None:
    """No module seeds, sets threads or flags when it is imported."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            continue
        for node in ast.walk(statement):
            called = getattr(getattr(node, "func", None), "attr", "")
            assert called not in GLOBAL_SETTERS, f"{file}:{node.lineno}: {called} at import"  # type: ignore[attr-defined]


def test_the_rules_bite(tmp_path: Path) -> None:
    """An import inside a function, and one by `from charnerf import`, are both seen."""
    file = tmp_path / "x.py"
    file.write_text("def f():\n    from charnerf import cli\n    import lightning.pytorch\n")
    assert list(imports_of(file)) == [(2, "charnerf.cli"), (3, "lightning.pytorch")]
