"""What view attention looks at: its scaled dot products split into feature and view part, around the character.

Source: paper, Analysis of multi-view feature vector combination. What the paper leaves open is chosen here: the points are
those that a camera sees, one a pixel, at the expected depth of its ray, where the picture is more opaque than not.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.errors import ConfigError, DataError
from charnerf.geometry.cameras import direction_from_angles, pixel_centres, pixel_rays
from charnerf.geometry.framing import framing_camera
from charnerf.models.charnerf import CharNeRF
from charnerf.models.combinators.base import AbstractCombinator, AbstractWeighing, masked_logits, view_weights
from charnerf.models.combinators.view_attention import AttentionLogits, ViewAttention
from charnerf.scene import Scene
from charnerf.types import Cameras, RenderOutput, SourceViews
from charnerf.volume.renderers.base import AbstractRenderer

ATTENTION_FILE = "attention.json"
AZIMUTH_STEP_DEG = 5
SIZE = 48  # pixels
RADIUS = 1.4  # metres, that the cameras frame


@dataclass(frozen=True)
class AttentionProfile:
    """Means over points, views' rows and characters, by azimuth (A), head (K) and source view (V).

    Attributes:
        characters: Names.
        sources: Names of the V source views.
        azimuth_deg: (A).
        features: Feature part of the scaled dot product, (A, K).
        view: View part, (A, K).
        weights: Attention weight of each source view, (A, K, V).
        curve: View part by theory: the factor of view_factor times the sum over the sources of the cosine to them, (A).
        view_factor: s^2 / sqrt(d_k) / V, of the trained model.
        num_points: Points in all.
    """

    characters: list[str]
    sources: list[str]
    azimuth_deg: list[float]
    features: list[list[float]]
    view: list[list[float]]
    weights: list[list[list[float]]]
    curve: list[float]
    view_factor: float
    num_points: int


@dataclass(frozen=True)
class _Inputs:
    """What the combinator sees of points (P)."""

    view_features: Tensor
    view_dirs: Tensor
    source_dirs: Tensor
    valid: Tensor

    def mean_parts(self, combinator: ViewAttention) -> tuple[Tensor, Tensor, Tensor]:
        """What the combinator does at them, see `mean_parts`."""
        return mean_parts(combinator.logits(self.view_features, self.view_dirs, self.source_dirs), self.valid)


def mean_parts(logits: AttentionLogits, valid: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Means over points (P), rows and keys of both parts, (K,) each, and of the weights over points and rows, (K, V)."""
    weights = torch.softmax(masked_logits(logits.features + logits.view, valid), dim=-1)
    rows = view_weights(valid, weights.dtype)[:, None, :, None]
    return logits.features.mean((0, 2, 3)), logits.view.mean((0, 2, 3)), (weights * rows).sum(2).mean(0)


def view_attention_of(network: CharNeRF) -> ViewAttention:
    """The combinator of the finest field.

    Raises:
        ConfigError: If it is another one.
    """
    combinator = network.finest.combinator
    if not isinstance(combinator, ViewAttention):
        raise ConfigError(
            f"combinator: found {type(combinator).__name__}, expected view_mha: only its dot products have a view part."
        )
    return combinator


@torch.no_grad()
def attention_profile(
    network: CharNeRF,
    renderer: AbstractRenderer,
    characters: Sequence[Character],
    *,
    step_deg: int = AZIMUTH_STEP_DEG,
    size: int = SIZE,
) -> AttentionProfile:
    """Look at characters from all around, at their own height, and average what attention does at the points seen.

    Args:
        network: With `view_mha`, in eval mode.
        renderer: Its renderer.
        characters: With the same source views.
        step_deg: Between azimuths.
        size: Side of the pictures whose pixels give the points.

    Raises:
        ConfigError: If the combinator is another one.
        DataError: If a camera sees nothing of a character.
    """
    combinator = view_attention_of(network)
    azimuths = [float(azimuth) for azimuth in range(0, 360, step_deg)]
    scenes = [network.scene(network.encode(one.sources.to(network.device)), 0) for one in characters]
    means, num_points = [], 0
    for azimuth in azimuths:
        camera = framing_camera(azimuth, 0.0, radius=RADIUS, size=size).to(network.device)
        inputs = [
            _seen(combinator, scene, renderer, camera, one.name)
            for scene, one in zip(scenes, characters, strict=True)
        ]
        parts = zip(*(one.mean_parts(combinator) for one in inputs), strict=True)
        means.append([torch.stack(part).mean(0).cpu() for part in parts])
        num_points += sum(len(one.valid) for one in inputs)
    num_views = means[0][2].shape[-1]
    factor = float(combinator.scale * combinator.view_scale.square() / num_views)
    return AttentionProfile(
        characters=[one.name for one in characters],
        sources=view_labels(characters[0], num_views),
        azimuth_deg=azimuths,
        features=[features.tolist() for features, _, _ in means],
        view=[view.tolist() for _, view, _ in means],
        weights=[weights.tolist() for _, _, weights in means],
        curve=_curve(azimuths, network.views(characters[0].sources), factor),
        view_factor=factor,
        num_points=num_points,
    )


def _curve(azimuths_deg: Sequence[float], sources: SourceViews, factor: float) -> list[float]:
    """The view part by theory: factor times the sum over the sources of the cosine to them."""
    azimuths = torch.tensor(azimuths_deg, dtype=torch.float64)
    towards = sources.cameras.world_from_camera[0, :, :3, 2].double()
    around = direction_from_angles(azimuths, torch.zeros_like(azimuths))
    return (factor * (around @ towards.T).sum(-1)).tolist()


def view_labels(character: Character, num_views: int) -> list[str]:
    """Names of the views that a model uses of a character: its drawings, then mirrored ones."""
    names = list(character.source_names)
    return names + [f"mirrored {number}" for number in range(1, num_views - len(names) + 1)]


@torch.no_grad()
def mean_shares(
    combinator: AbstractWeighing, scene: Scene, picture: RenderOutput, camera: Cameras
) -> Tensor | None:
    """Shares (V) of the views, means over the points that a picture of a scene shows; None where it shows nothing."""
    given = _given(combinator, scene, picture, camera)
    if given is None:
        return None
    return combinator.view_shares(given.view_features, given.view_dirs, given.source_dirs, given.valid).mean(
        0
    )


def _seen(
    combinator: ViewAttention, scene: Scene, renderer: AbstractRenderer, camera: Cameras, name: str
) -> _Inputs:
    """What the combinator sees of the points that a camera sees, one a pixel."""
    given = _given(combinator, scene, renderer.render_camera(scene, camera).finest, camera)
    if given is None:
        raise DataError(
            f"{name}: the model shows nothing of it, expected points to look at; was it trained long enough?"
        )
    return given


def _given(
    combinator: AbstractCombinator, scene: Scene, picture: RenderOutput, camera: Cameras
) -> _Inputs | None:
    """What the combinator sees of the points that a picture shows, one a pixel; None where it shows nothing."""
    rays = pixel_rays(camera, pixel_centres(camera.width, camera.height, device=picture.depth.device))
    seen = picture.opacity > 0.5
    if not bool(seen.any()):
        return None
    directions = rays.directions[seen]
    points = rays.origins[seen] + picture.depth[seen][:, None] * directions
    with _recorded(combinator) as calls:
        scene.field(points, directions)
    seeing = [call for call in calls if bool(call.view_dirs.any())]  # densities may see no direction
    return (seeing or calls)[-1]


@contextmanager
def _recorded(combinator: AbstractCombinator) -> Iterator[list[_Inputs]]:
    """Collect a combinator's inputs while the context lasts."""
    calls: list[_Inputs] = []
    answer = combinator.answer

    def recorded(
        view_features: Tensor, projected: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        calls.append(_Inputs(view_features, view_dirs, source_dirs, valid))
        return answer(view_features, projected, view_dirs, source_dirs, valid)

    combinator.answer = recorded  # type: ignore[method-assign]
    try:
        yield calls
    finally:
        del combinator.answer
