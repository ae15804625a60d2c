"""Which room may import which, checked on the source text; the list of floors is the rule."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "charnerf"
FILES = sorted(PACKAGE.rglob("*.py"))
MAX_LINES = 400
MAX_FUNCTION_LINES = 50

FLOORS = (  # from the ground up; a room may import rooms on floors below its own, and no other
    ("errors", "interruption", "wording"),
    (
        "types",
        "checks",
        "distributed",
        "schedule",
        "files",
        "hosts",
        "markdown",
        "pools",
        "progress",
        "thread_count",
    ),
    ("parallel", "pictures", "viewer"),
    ("process",),
    ("geometry",),
    ("scene",),
    ("config", "models", "reconciling", "surfaces", "volume"),
    ("losses",),
    ("blender", "data", "meshing", "procedural"),
    ("people",),
    ("capture", "evaluation"),
    ("drawings", "foreign"),
    ("inference",),
    ("reporting",),
    ("finetuning",),
    ("reconstruction", "training"),
    ("app", "bench", "doctor", "stability", "watching"),
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
        "training/processes",
        "training/data",
        "training/trainer",
        "training/start",
        "training/finish",
        "training/cells",
        "training/identity",
        "training/search",
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


@cache
def every_import() -> tuple[tuple[Path, int, str], ...]:
    """File, line and full name of what the package imports."""
    return tuple((file, line, name) for file in FILES for line, name in imports_of(file))


def test_rooms_import_downward_only() -> None:
    homeless = {room_of(file) for file in FILES} - FLOOR_OF.keys()
    assert not homeless, f"{homeless}: on no floor; put them into the list"
    wrong = [
        f"{file}:{line}: {room_of(file)} imports {other}, which is not below it"
        for file, line, name in every_import()
        for other in name.split(".")[1:2]
        if name.startswith("charnerf.") and other != room_of(file) and other in FLOOR_OF
        if FLOOR_OF[other] >= FLOOR_OF[room_of(file)]
    ]
    assert not wrong, "\n".join(wrong)


def test_the_generator_has_one_face() -> None:
    """Other rooms import what `charnerf.procedural` itself names, nothing inside."""
    wrong = [
        f"{file}:{line}: imports {name}, expected charnerf.procedural"
        for file, line, name in every_import()
        if name.startswith("charnerf.procedural.") and room_of(file) != "procedural"
    ]
    assert not wrong, "\n".join(wrong)


def test_frameworks_stay_in_their_rooms() -> None:
    wrong = []
    for file, line, name in every_import():
        module = file.relative_to(PACKAGE).with_suffix("").as_posix()
        places = ONLY_IN.get(name.split(".")[0])
        if places is not None and not any(
            module == place or module.startswith(f"{place}/") for place in places
        ):
            wrong.append(f"{file}:{line}: imports {name}, which belongs to {', '.join(places)}")
    assert not wrong, "\n".join(wrong)


def test_settings_of_the_process_belong_to_doors() -> None:
    wrong = [
        f"{file}:{line}: only doors set the process"
        for file, line, name in every_import()
        if name.startswith("charnerf.process") and room_of(file) not in DOORS
    ]
    assert not wrong, "\n".join(wrong)


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


def test_files_stay_short() -> None:
    lines = {file: len(file.read_text(encoding="utf-8").splitlines()) for file in [*FILES, ROOT / "train.py"]}
    wrong = {str(file): count for file, count in lines.items() if count > MAX_LINES}
    assert not wrong, f"{wrong}: expected at most {MAX_LINES} lines; split by idea"


def test_functions_stay_short() -> None:
    wrong = []
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                count = (node.end_lineno or 0) - node.lineno + 1
                if count > MAX_FUNCTION_LINES:
                    wrong.append(f"{file}:{node.lineno}: {node.name} has {count} lines")
    assert not wrong, "\n".join([*wrong, f"expected at most {MAX_FUNCTION_LINES}; name a step of each"])


def test_importing_changes_no_global_state() -> None:
    """No module seeds, sets threads or flags when it is imported."""
    wrong = []
    for file in FILES:
        for statement in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(statement, ast.FunctionDef | ast.ClassDef):
                continue
            for node in ast.walk(statement):
                called = getattr(getattr(node, "func", None), "attr", "")
                if called in GLOBAL_SETTERS:
                    wrong.append(f"{file}:{node.lineno}: {called} at import")  # type: ignore[attr-defined]
    assert not wrong, "\n".join(wrong)


def test_the_rules_bite(tmp_path: Path) -> None:
    """An import inside a function, and one by `from charnerf import`, are both seen."""
    file = tmp_path / "x.py"
    file.write_text("def f():\n    from charnerf import cli\n    import lightning.pytorch\n")
    assert list(imports_of(file)) == [(2, "charnerf.cli"), (3, "lightning.pytorch")]


def test_no_two_test_files_share_a_name() -> None:
    """pytest imports them by their names alone."""
    names = [file.name for file in (ROOT / "tests").rglob("test_*.py")]
    assert len(names) == len(set(names)), sorted(name for name in names if names.count(name) > 1)
