"""A model on a split of a data set, beside what a user has without learning: every number of metrics.json."""

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any, Literal, Protocol

import torch
import trimesh
from tqdm import tqdm

from charnerf.data.characters import Character, load_character
from charnerf.data.layout import TRANSFORMS_FILE, names_of, read_dataset
from charnerf.errors import CharNeRFError, DataError
from charnerf.evaluation import surface_error
from charnerf.evaluation.angles import view_angles
from charnerf.evaluation.baselines import VisualHullBaseline, white_prediction
from charnerf.evaluation.metrics_file import (
    VIEWS_FILE,
    Collected,
    collected_metrics,
    write_metrics,
    write_views,
)
from charnerf.evaluation.nearest import (
    NO_MATCH,
    NO_TRAINING_SET,
    Nearest,
    NearestBaseline,
    TrainingCharacters,
)
from charnerf.evaluation.pictures import save_prediction, save_sheet
from charnerf.evaluation.scores import METRIC_KEYS, CharacterScores, score_view, to_cpu
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.types import Cameras, LeftOut, RenderOutput, SourceViews

__all__ = [
    "CameraRendering",
    "EvaluatedModel",
    "EvaluatedRenderer",
    "MadeMesh",
    "MakeMesh",
    "evaluate",
    "fixed_views",
    "write_metrics",
]


class MadeMesh(Protocol):
    """A mesh, world frame, m, and what was left out; `meshing.build.build_mesh` answers such a one."""

    @property
    def mesh(self) -> trimesh.Trimesh:
        """The surface."""

    @property
    def left_out(self) -> LeftOut:
        """Work that was not done."""


BASELINES = ("white", "visual_hull", "nearest")
MakeMesh = Callable[[Any, SourceViews], MadeMesh]
"""From a scene and its drawings (B = 1) to its mesh."""


class EvaluatedModel(Protocol):
    """What evaluation asks of a model: `encode` one character (B = 1), then `scene` of it."""

    def encode(self, views: SourceViews) -> Any:
        """Encode source views, B = 1."""

    def scene(self, encoded: Any, index: int) -> Any:
        """The scene of one encoded character."""


class CameraRendering(Protocol):
    """A rendering of a camera: fields (H, W) and what was left out."""

    @property
    def finest(self) -> RenderOutput:
        """The finest picture."""

    @property
    def left_out(self) -> LeftOut:
        """Work that was not done."""


class EvaluatedRenderer(Protocol):
    """What evaluation asks of a renderer."""

    def render_camera(self, scene: Any, camera: Cameras) -> CameraRendering:
        """Picture of a camera of shape ()."""


def fixed_views(character: Character, views: int | Literal["all"]) -> list[int]:
    """Indices of the frames to evaluate: evenly chosen, the same every time, none of them a source view.

    Each of `views` even directions of the hemisphere takes the nearest frame that is still free: every n-th
    frame of a capture's spiral would leave whole azimuths out.

    Raises:
        DataError: If the character has no such frame.
    """
    poses = character.cameras.world_from_camera
    there = character.sources.present[0]
    sources = character.sources.cameras.world_from_camera[0][there]
    parallel = character.sources.cameras.orthographic[0][there]
    same = (poses[:, None] - sources[None]).abs().amax(dim=(-1, -2)) < 1e-5
    same &= character.cameras.orthographic[:, None] == parallel[None]
    frames = torch.arange(len(poses))[~same.any(dim=1)].tolist()
    if not frames:
        raise DataError(
            f"{character.folder}: found no picture beside the source views, expected some to evaluate; "
            "capture it with more views."
        )
    if views == "all" or views >= len(frames):
        return frames
    if views < 1:
        raise DataError(f"views: found {views}, expected at least 1, or 'all'.")
    towards = poses[frames][:, :3, 2].double()
    free = torch.ones(len(frames), dtype=torch.bool)
    chosen = []
    for ideal in fibonacci_hemisphere(views):
        nearest = int(torch.where(free, towards @ ideal, -torch.inf).argmax())
        free[nearest] = False
        chosen.append(frames[nearest])
    return sorted(chosen)


def evaluate(
    model: EvaluatedModel,
    renderer: EvaluatedRenderer,
    root: str | Path,
    split: str,
    *,
    views: int | Literal["all"],
    output: Path | None = None,
    mesh: MakeMesh | None = None,
    device: torch.device | str = "cpu",
    baselines: bool = True,
    nearest: TrainingCharacters | None = None,
    train_seconds: float | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Measure a model on a split.

    Args:
        model: Encodes a character's source views and gives its scene.
        renderer: Draws a scene from a camera.
        root: Folder of the data set.
        split: Which of its splits.
        views: Fixed views a character, evenly chosen among its frames, or "all".
        output: Folder for the predictions, `images/NAME/000.png` (RGBA, named like the data set's), one contact
            sheet a character, `images/NAME/sheet.png`, and every view's metrics, `views.csv`; None keeps none.
        mesh: Makes a scene's mesh from it and its drawings, for Chamfer and F-score; None leaves them null.
        device: Where the model is.
        baselines: Whether to measure `white`, `visual_hull` and `nearest` too.
        nearest: Characters that the model was trained on, for the baseline `nearest`; None leaves it null.
        train_seconds: Training time to report; None where it is unknown.
        progress: Whether to draw a progress bar with the time left.

    Returns:
        The content of metrics.json.

    Raises:
        DataError: If the split is unknown or empty, or a file is missing or wrong.
        NumericalError: If a prediction is not finite; the message names the picture.
    """
    device = torch.device(device)
    names = names_of(read_dataset(root), split)
    state = Collected(device, ("ours", *BASELINES) if baselines else ("ours",))
    with (
        state.watch,
        tqdm(total=0, desc=f"evaluate {split}", unit="view", disable=not progress) as bar,
    ):
        for place, name in enumerate(names):
            character = load_character(root, name)
            indices = fixed_views(character, views)
            bar.total = bar.n + len(indices) * (len(names) - place)  # the others are taken to have as many
            close = None if nearest is None or not baselines else nearest.nearest(character)
            _evaluate_character(
                state, model, renderer, character, indices, output=output, mesh=mesh, close=close, bar=bar
            )
            if baselines and close is None:
                why = NO_TRAINING_SET if nearest is None else NO_MATCH
                state.scores["nearest"][name] = CharacterScores(reasons=dict.fromkeys(METRIC_KEYS, why))
    if output is not None:
        write_views(output / VIEWS_FILE, state)
    found = collected_metrics(state, names, split=split, train_seconds=train_seconds)
    return {**found, "data_root": str(Path(root).resolve())}


def _evaluate_character(
    state: Collected,
    model: EvaluatedModel,
    renderer: EvaluatedRenderer,
    character: Character,
    indices: list[int],
    *,
    output: Path | None,
    mesh: MakeMesh | None,
    close: Nearest | None,
    bar: "tqdm[Any]",
) -> None:
    """Add one character to what is collected."""
    watch, name = state.watch, character.name
    sources = character.sources.to(watch.device)
    with torch.no_grad():
        with watch.stage("encode"):
            scene = model.scene(model.encode(sources), 0)
        methods = [method for method in state.scores if method != "nearest" or close is not None]
        drawn: dict[str, list[RenderOutput]] = {method: [] for method in methods}
        for index in indices:
            with watch.stage("render"):
                rendering = renderer.render_camera(scene, character.cameras[index].to(watch.device))
            state.left_out += rendering.left_out
            drawn["ours"].append(to_cpu(rendering.finest, name=f"{name}, view {index}"))
            bar.update()
        surface = "no mesh was made" if mesh is None else _make_mesh(state, mesh, scene, sources)
    truth = None if character.mesh_file is None else surface_error.true_points(character.mesh_file)
    hull_mesh = _draw_baselines(state, drawn, character, indices, close)
    images = character.images(indices)
    known = _KNOWN.of(character, indices, close)
    _score(state, character, indices, images, {key: each for key, each in drawn.items() if key not in known})
    for method, found in (
        ("ours", surface),
        ("white", "the white picture has no surface"),
        ("visual_hull", hull_mesh),
        ("nearest", None if close is None else close.mesh),
    ):
        if method not in drawn:
            continue
        if method in known:
            state.scores[method][name] = deepcopy(known[method])
        else:
            _score_surface(state.scores[method][name], found, truth, character.cameras)
            if method != "ours":
                known[method] = deepcopy(state.scores[method][name])
    if output is not None:
        stems = [character.image_files[index].stem for index in indices]
        for stem, picture in zip(stems, drawn["ours"], strict=True):
            save_prediction(output / "images" / name / f"{stem}.png", picture)
        save_sheet(output / "images" / name / "sheet.png", character, indices, images, drawn)


class _KnownBaselines:
    """Scores of baselines that this process has measured: a grid's cells share their characters, and no model is in them."""

    def __init__(self, most: int = 256) -> None:
        self._scores: dict[tuple[Any, ...], dict[str, CharacterScores]] = {}
        self._most = most

    def of(
        self, character: Character, indices: list[int], close: Nearest | None
    ) -> dict[str, CharacterScores]:
        """By baseline, what is known of a character as it lies on the disk; what is put there is known from then on."""
        written = (character.folder / TRANSFORMS_FILE).stat().st_mtime_ns
        near = None if close is None else (close.name, close.iou)
        key = (character.folder.resolve(), written, tuple(indices), near)
        while len(self._scores) >= self._most and key not in self._scores:
            del self._scores[next(iter(self._scores))]
        return self._scores.setdefault(key, {})


_KNOWN = _KnownBaselines()


def _make_mesh(state: Collected, mesh: MakeMesh, scene: Any, sources: SourceViews) -> trimesh.Trimesh | str:
    """The scene's mesh, or why it has none."""
    try:
        with state.watch.stage("mesh"):
            made = mesh(scene, sources)
    except CharNeRFError as error:
        return str(error)
    state.left_out += made.left_out
    return made.mesh


def _draw_baselines(
    state: Collected,
    drawn: dict[str, list[RenderOutput]],
    character: Character,
    indices: list[int],
    close: Nearest | None,
) -> trimesh.Trimesh | None:
    """Draw the baselines of one character; returns the hull's mesh."""
    if "visual_hull" not in drawn:
        return None
    if close is not None:
        state.nearest[character.name] = {"character": close.name, "silhouette_iou_of_sources": close.iou}
        remembered = NearestBaseline(close, character.sources)
        drawn["nearest"] = [remembered.render(character.cameras[index]) for index in indices]
    with state.watch.stage("hull_encode"):
        hull = VisualHullBaseline(character.sources)
    for index in indices:
        camera = character.cameras[index]
        drawn["white"].append(white_prediction(camera))
        with state.watch.stage("hull_render"):
            drawn["visual_hull"].append(hull.render(camera))
    return hull.mesh


def _score(
    state: Collected,
    character: Character,
    indices: list[int],
    images: torch.Tensor,
    drawn: dict[str, list[RenderOutput]],
) -> None:
    """Measure every picture of one character."""
    angles = view_angles(character.cameras[indices], character.sources)
    for method, pictures in drawn.items():
        frames = [character.image_files[index].stem for index in indices]
        scores = state.scores[method][character.name] = CharacterScores(frames=frames)
        for place, picture in enumerate(pictures):
            record = {
                "azimuth_deg": float(angles.azimuth_deg[place]),
                "elevation_deg": float(angles.elevation_deg[place]),
                "source_angle_deg": float(angles.source_deg[place]),
            }
            scores.views.append(score_view(picture, images[place], record, reasons=scores.reasons))


def _score_surface(
    scores: CharacterScores, found: trimesh.Trimesh | str | None, truth: Any, cameras: Cameras
) -> None:
    """Measure a mesh against the captured one, or note why there is nothing to measure."""
    if truth is None:
        scores.surface, reasons = surface_error.missing_surface("the data set has no mesh of the character")
    elif isinstance(found, str):
        scores.surface, reasons = surface_error.missing_surface(found)
    else:
        scores.surface, reasons = surface_error.surface_scores(found, truth, cameras)
    scores.reasons |= reasons
