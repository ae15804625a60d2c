"""Meshes to characters of a data set, in parallel processes; each is written aside and renamed."""

import time
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from charnerf.capture import unfinished
from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.dressing import dress
from charnerf.capture.meshes import check_axes
from charnerf.capture.part_swaps import swap_parts
from charnerf.capture.renderers.base import AbstractRenderer
from charnerf.capture.variants import SEPARATOR, variant
from charnerf.data.characters import CharacterPictures, write_character
from charnerf.data.layout import add_to_split, check_name
from charnerf.errors import CharNeRFError, DataError
from charnerf.files import check_folder
from charnerf.parallel import in_processes
from charnerf.progress import Progress
from charnerf.surfaces.mesh_files import write_surface_mesh
from charnerf.surfaces.surface_mesh import SurfaceMesh

VARIED_SHARE = 0.7  # of drawn copies: seven of ten variants hold their arms down, half of turnarounds do
_STREAMS = {"": (), "s": (1,), "d": (2,), "w": (3,)}  # further seeds of what each kind is drawn from

DrawSources = Callable[..., CharacterPictures]
"""Called with pictures, surface and rng, returns the pictures with drawings for source views."""


@dataclass(frozen=True)
class CaptureReport:
    """What a capture did.

    Attributes:
        captured: Names of the characters that were put into the data set, in the order given.
        failed: One message for each mesh that could not be captured.
        skipped: Names that were there already: the same capture was interrupted before.
        notes: What was simplified or left out of which character.
        seconds: That all of it took.
    """

    captured: tuple[str, ...]
    failed: tuple[str, ...]
    skipped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def characters_a_second(self) -> float:
        """How many were captured a second."""
        return len(self.captured) / self.seconds if self.seconds > 0.0 else 0.0


def capture_dataset(
    mesh_paths: Sequence[str | Path],
    root: str | Path,
    split: str,
    *,
    options: CaptureOptions | None = None,
    up: str | None = None,
    facing: str | None = None,
    variants: int = 0,
    swaps: int = 0,
    dressed: int = 0,
    drawn: int = 0,
    draw: DrawSources | None = None,
    seed: int = 0,
    processes: int | None = None,
) -> CaptureReport:
    """Capture meshes into one split of a data set, new or there; bad ones stop no other, the same call goes on when interrupted.

    Args:
        mesh_paths: Mesh files, and folders of them (not deeper); a character's name is its file's stem.
        root: Folder of the data set.
        split: Split that gets the characters.
        options: How they are captured.
        up: Axis that points up in all files; None for each format's own.
        facing: Signed axis that the characters face; None for each format's own.
        variants: Of each mesh, captured instead of it (capture/variants.py): NAME+1, NAME+2, ...
        swaps: Of each mesh's body with other meshes' heads and legs, instead of it (capture/part_swaps.py): NAME+s1, ...
        dressed: Variants of each mesh that wear solids, instead of it (capture/dressing.py): NAME+w1, ...
        drawn: Copies of each mesh, seven of ten varied, whose source views are drawings, instead of it: NAME+d1, ...
        draw: Makes their drawings.
        seed: What variants, swaps, clothes and drawings are drawn from; the same seed gives the same ones, however many.
        processes: Worker processes; None for one a core.

    Raises:
        DataError: Before any work, if there is no mesh, a name is taken, or the folder is no data set or can not be written to.
        ConfigError, DependencyError: Before any work, if up and facing are no axes, or the renderer is not here.
    """
    options, root = options or CaptureOptions(), Path(root)
    files = expand_mesh_paths(mesh_paths, options.renderer.suffixes)
    _check_call(files, root, split, options.renderer, up, facing)
    items = _items(files, options.renderer, {"": variants, "s": swaps, "w": dressed, "d": drawn})
    note = unfinished.note_of(root, files, split, made_by(options), up, facing, items, seed)
    skipped = _make_room(root, split, items, note)
    work = partial(
        _capture_item, root=root, options=options, donors=files, draw=draw, up=up, facing=facing, seed=seed
    )
    add = partial(add_to_split, root, split, made_by=made_by(options))
    with unfinished.noted(note, [item.name for item in items]):
        return _capture_items(items, work, add, root=root, processes=processes, skipped=skipped)


def capture_scene_to(
    root: str | Path,
    name: str,
    scene: trimesh.Scene | trimesh.Trimesh | SurfaceMesh,
    options: CaptureOptions,
    *,
    draw: Callable[[CharacterPictures, SurfaceMesh], CharacterPictures] | None = None,
) -> Path:
    """Capture one scene that stands in the world frame; dataset.json is left to `layout.add_to_split`.

    Args:
        root: Folder of the data set; made if missing.
        name: The character's name.
        scene: World frame.
        options: How.
        draw: Puts drawings in the place of the captured source views.

    Returns:
        The character's folder.

    Raises:
        DataError: If the name is taken or the scene has no triangles.
    """
    captured = capture_character(scene, options)
    pictures = captured.pictures if draw is None else draw(captured.pictures, captured.surface)
    return write_character(
        root, name, pictures, write_mesh=partial(write_surface_mesh, mesh=captured.surface)
    )


def made_by(options: CaptureOptions) -> dict[str, Any]:
    """Facts for dataset.json about how characters were captured."""
    return {
        "program": f"charnerf {version('charnerf')}",
        "views": options.views,
        "size": options.size,
        "sources": options.sources,
        "light": type(options.light).__name__,
        "depth": options.depth,
        **options.renderer.facts(),
    }


def expand_mesh_paths(mesh_paths: Iterable[str | Path], suffixes: Sequence[str]) -> list[Path]:
    """Mesh files, folders replaced by the files of some suffixes in them, sorted.

    Raises:
        DataError: If a path is missing, a folder holds no mesh, or nothing was given.
    """
    files: list[Path] = []
    for path in map(Path, mesh_paths):
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if file.suffix.lower() in suffixes)
            if not inside:
                raise DataError(
                    f"{path}: found no mesh in this folder, expected {', '.join(suffixes)} files."
                )
            files += inside
        elif path.exists():
            files.append(path)
        else:
            raise DataError(f"{path}: no such file or folder, expected a mesh or a folder of them.")
    if not files:
        raise DataError("meshes: found none, expected at least one file or folder.")
    return files


@dataclass(frozen=True)
class _Item:
    """A mesh file, as it is (0), one of its variants (""), exchanges of parts ("s"), dressed ("w") or drawn copies ("d")."""

    file: Path
    character: str
    number: int = 0
    kind: str = ""

    @property
    def name(self) -> str:
        return f"{self.character}{SEPARATOR}{self.kind}{self.number}" if self.number else self.character


@dataclass(frozen=True)
class _Outcome:
    """What is wrong with an item, if it is, and what is to be said about it."""

    failure: str | None = None
    notes: tuple[str, ...] = ()


def _items(files: Sequence[Path], renderer: AbstractRenderer, counts: Mapping[str, int]) -> list[_Item]:
    """What is captured: the files, or so many of each kind that is made of each."""
    items = []
    for file in files:
        name = renderer.name_of(file)
        for kind, count in counts.items():
            items += [_Item(file, name, number, kind) for number in range(1, count + 1)]
    return items or [_Item(file, renderer.name_of(file)) for file in files]


def _check_call(
    files: Sequence[Path],
    root: Path,
    split: str,
    renderer: AbstractRenderer,
    up: str | None,
    facing: str | None,
) -> None:
    check_name("split", split)
    check_folder(root)
    for suffix in {file.suffix.lower() for file in files} & set(renderer.suffixes):
        check_axes(suffix, up, facing)
    renderer.check()


def _make_room(root: Path, split: str, items: Sequence[_Item], note: Path) -> frozenset[str]:
    """Make the data set's folder; names that are taken are refused.

    Returns:
        Names that are there from the same capture, which was interrupted.
    """
    names = [item.name for item in items]
    done = unfinished.there_already(root, split, names, note)
    root.mkdir(parents=True, exist_ok=True)
    return done


def _capture_items(
    items: Sequence[_Item],
    work: Callable[[_Item], _Outcome],
    add: Callable[[list[str]], object],
    *,
    root: Path,
    processes: int | None,
    skipped: frozenset[str],
) -> CaptureReport:
    """Capture in parallel; `work` gives what is wrong with an item, `add` puts the others into the data set."""
    items = [item for item in items if item.name not in skipped]
    outcomes: dict[_Item, _Outcome] = {}
    began = time.perf_counter()
    with (
        unfinished.listed_as_made(root, [item.name for item in items], add) as ended,
        Progress("capture") as progress,
        in_processes(work, items, processes) as results,
    ):
        for item, outcome in results:
            for note in outcome.notes:
                progress.say(f"{item.name}: {note}")
            if outcome.failure is not None:
                progress.say(f"not captured: {outcome.failure}")
            ended(item.name, outcome.failure is None)
            outcomes[item] = outcome
            pace = len(outcomes) / (time.perf_counter() - began)
            progress.update(len(outcomes) / len(items), f"{pace:.3g} characters a second")
    return CaptureReport(
        captured=tuple(item.name for item in items if outcomes[item].failure is None),
        failed=tuple(failure for item in items if (failure := outcomes[item].failure) is not None),
        skipped=tuple(sorted(skipped)),
        notes=tuple(f"{item.name}: {note}" for item in items for note in outcomes[item].notes),
        seconds=time.perf_counter() - began,
    )


def _capture_item(
    item: _Item,
    *,
    root: Path,
    options: CaptureOptions,
    donors: Sequence[Path],
    draw: DrawSources | None,
    up: str | None,
    facing: str | None,
    seed: int,
) -> _Outcome:
    """Capture a file or what is made of it and of donors."""
    try:
        read = partial(options.renderer.read, up=up, facing=facing)
        character = read(item.file)
        surface = character.surface
        drawn_from = [seed, zlib.crc32(item.file.stem.encode()), item.number]
        rng = np.random.default_rng([*drawn_from, *_STREAMS[item.kind]])
        if item.kind == "s":
            others = [sorted(donors)[index] for index in rng.integers(len(donors), size=2)]
            parts = [read(other).surface for other in others]
            surface = swap_parts([surface, *parts], rng)
        elif item.number and (item.kind != "d" or rng.random() < VARIED_SHARE):
            surface = variant(surface, rng)
        if item.kind == "w":
            surface = dress(surface, rng)
        capture_scene_to(
            root,
            item.name,
            surface,
            options,
            draw=partial(draw, rng=rng) if draw and item.kind == "d" else None,
        )
    except CharNeRFError as err:
        said = str(err)
        return _Outcome(failure=said if said.startswith(f"{item.file}:") else f"{item.file}: {said}")
    except OSError:  # of the data set's own disk, which all share: readers make DataErrors of theirs
        raise
    except Exception as err:  # whatever one mesh makes fail stops no other
        return _Outcome(
            failure=f"{item.file}: can not be captured ({type(err).__name__}: {err}); export it again."
        )
    return _Outcome(notes=character.notes)
