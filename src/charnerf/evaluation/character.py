"""One character measured: a model's pictures and mesh, beside those that a user has without learning."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
import trimesh

from charnerf.data.characters import Character
from charnerf.errors import CharNeRFError
from charnerf.evaluation.angles import view_angles
from charnerf.evaluation.baselines import VisualHullBaseline, white_prediction
from charnerf.evaluation.drawing_scores import score_drawings
from charnerf.evaluation.lpips import Lpips
from charnerf.evaluation.nearest import (
    NO_MATCH,
    NO_TRAINING_SET,
    Nearest,
    NearestBaseline,
    TrainingCharacters,
)
from charnerf.evaluation.scores import (
    MethodScores,
    missing_reasons,
    missing_scores,
    score_views,
    to_cpu,
)
from charnerf.evaluation.surface_error import missing_surface, surface_scores, true_points
from charnerf.evaluation.timing import Stopwatch
from charnerf.meshing.build import FoundSurface
from charnerf.models.charnerf import CharNeRF
from charnerf.scene import Scene
from charnerf.types import LeftOut, RenderOutput, SourceViews
from charnerf.volume.renderers.base import AbstractRenderer

OURS = "ours"
FindSurface = Callable[[Scene, SourceViews], FoundSurface]
"""From a scene and its drawings (B = 1) to its surface; distances to the true one know no colours."""


@dataclass(frozen=True)
class CharacterResult:
    """What was measured on one character.

    Attributes:
        name: Of the character.
        frames: Names of the pictures that were measured (n), as in the data set.
        scores: By method, "ours" and the baselines.
        pictures: Predictions (n), fields (H, W) on the CPU, of every method that draws.
        left_out: Work that was not done for ours.
        nearest: The training character that the baseline `nearest` took; None where it took none.
        drawings: Of the drawings themselves, from where they were drawn; None where the source views are the captured ones.
        seconds: Of every execution of a stage: encode, render, mesh (its surface); hull_encode, hull_render; metrics, of all
            methods.
        peaks_mib: Most memory that was held while a stage ran.
    """

    name: str
    frames: Sequence[str]
    scores: Mapping[str, MethodScores]
    pictures: Mapping[str, Sequence[RenderOutput]]
    left_out: LeftOut
    nearest: Nearest | None
    drawings: MethodScores | None
    seconds: Mapping[str, Sequence[float]]
    peaks_mib: Mapping[str, float]


@dataclass(frozen=True)
class _Answer:
    """What a method makes of a character's drawings: a picture a frame, and a mesh or why there is none."""

    pictures: Sequence[RenderOutput]
    surface: trimesh.Trimesh | str | None
    left_out: LeftOut = field(default_factory=LeftOut)


def measure_character(
    network: CharNeRF,
    renderer: AbstractRenderer,
    character: Character,
    frames: Sequence[int],
    *,
    lpips: Lpips,
    mesh: FindSurface | None = None,
    baselines: bool = True,
    training: TrainingCharacters | None = None,
    captured: Character | None = None,
    on_picture: Callable[[], object] = lambda: None,
) -> CharacterResult:
    """Measure a model on a character: every metric of every frame, of the surface, seconds and memory.

    Args:
        network: In eval mode.
        renderer: Draws its scenes.
        character: With its drawings and true pictures.
        frames: Indices of the pictures to measure, as from `fixed_views`.
        lpips: As of `score_views`.
        mesh: Finds a scene's surface, for Chamfer and F-score; None leaves them out.
        baselines: Whether to measure `white`, `visual_hull` and `nearest` too.
        training: Characters that the model was trained on, for the baseline `nearest`; None leaves it out.
        captured: The character before its source views were drawn, to measure the drawings themselves; None leaves that out.
        on_picture: Called after every picture of ours.

    Raises:
        NumericalError: If a prediction is not finite; the message names the picture.
    """
    nearest = training.nearest(character) if baselines and training is not None else None
    with Stopwatch(network.device) as watch:
        answers = _without_learning(character, frames, nearest, watch) if baselines else {}
        answers = {OURS: _ours(network, renderer, character, frames, mesh, watch, on_picture)} | answers
        with watch.stage("metrics"):
            scores = _scores(answers, character, frames, lpips)
            drawings = None if captured is None else score_drawings(character, captured, lpips)
    if baselines and nearest is None:
        scores["nearest"] = missing_scores(NO_TRAINING_SET if training is None else NO_MATCH)
    return CharacterResult(
        name=character.name,
        frames=[character.image_files[index].stem for index in frames],
        scores=scores,
        pictures={method: answer.pictures for method, answer in answers.items()},
        left_out=answers[OURS].left_out,
        nearest=nearest,
        drawings=drawings,
        seconds=watch.seconds(),
        peaks_mib=watch.peaks_mib(),
    )


@torch.no_grad()
def _ours(
    network: CharNeRF,
    renderer: AbstractRenderer,
    character: Character,
    frames: Sequence[int],
    mesh: FindSurface | None,
    watch: Stopwatch,
    on_picture: Callable[[], object],
) -> _Answer:
    """The model's pictures and mesh."""
    sources = character.sources.to(watch.device)
    with watch.stage("encode"):
        scene = network.scene(network.encode(sources), 0)
        looked_at = renderer.prepared(scene)
    pictures, left_out = [], LeftOut()
    for index in frames:
        camera = character.cameras[index].to(watch.device)
        with watch.stage("render"):
            rendering = renderer.render_camera(looked_at, camera)
        pictures.append(to_cpu(rendering.finest, name=f"{character.name}, view {index}"))
        left_out += rendering.left_out
        on_picture()
    if mesh is None:
        return _Answer(pictures, "no mesh was made", left_out)
    try:
        with watch.stage("mesh"):
            found = mesh(scene, sources)
    except CharNeRFError as error:
        return _Answer(pictures, str(error), left_out)
    return _Answer(pictures, found.extraction.mesh, left_out + found.left_out)


def _without_learning(
    character: Character, frames: Sequence[int], nearest: Nearest | None, watch: Stopwatch
) -> dict[str, _Answer]:
    """What a user has without a model, the nearest training character where there is one."""
    answers = {"white": _white(character, frames), "visual_hull": _visual_hull(character, frames, watch)}
    if nearest is not None:
        answers["nearest"] = _nearest(nearest, character, frames)
    return answers


def _white(character: Character, frames: Sequence[int]) -> _Answer:
    pictures = [white_prediction(character.cameras[index]) for index in frames]
    return _Answer(pictures, "the white picture has no surface")


def _visual_hull(character: Character, frames: Sequence[int], watch: Stopwatch) -> _Answer:
    with watch.stage("hull_encode"):
        hull = VisualHullBaseline(character.sources)
    pictures = []
    for index in frames:
        with watch.stage("hull_render"):
            pictures.append(hull.render(character.cameras[index]))
    return _Answer(pictures, hull.mesh)


def _nearest(nearest: Nearest, character: Character, frames: Sequence[int]) -> _Answer:
    drawn = NearestBaseline(nearest, character.sources)
    return _Answer([drawn.render(character.cameras[index]) for index in frames], nearest.mesh)


def _scores(
    answers: Mapping[str, _Answer], character: Character, frames: Sequence[int], lpips: Lpips
) -> dict[str, MethodScores]:
    """Every metric of every method."""
    truth = None if character.mesh_file is None else true_points(character.mesh_file)
    images = character.images(frames)
    angles = view_angles(character.cameras[list(frames)], character.sources).records()
    by_method = score_views({method: answer.pictures for method, answer in answers.items()}, images, lpips)
    scores = {}
    for method, views in by_method.items():
        surface, missing = _surface_scores(answers[method].surface, truth, character)
        scores[method] = MethodScores(
            [{**metrics, **angle} for metrics, angle in zip(views, angles, strict=True)],
            surface,
            {**missing_reasons(views, lpips), **missing},
        )
    return scores


def _surface_scores(
    surface: trimesh.Trimesh | str | None, truth: np.ndarray | None, character: Character
) -> tuple[dict[str, float | None], dict[str, str]]:
    """Chamfer and F-score, or None with the reasons."""
    if truth is None:
        return missing_surface("the data set has no mesh of the character")
    if isinstance(surface, str):
        return missing_surface(surface)
    return surface_scores(surface, truth, character.cameras)
