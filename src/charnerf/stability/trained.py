"""What can go wrong in a trained field: stiffness, lost light, precision, order, place."""

from collections.abc import Iterator
from copy import copy, deepcopy
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.models.charnerf import CharNeRF, EncodedViews
from charnerf.models.views.turnaround import Turnaround
from charnerf.stability.measure import Bounds, Errors, Target, count_non_finite, doubled, largest
from charnerf.stability.report import CheckRow
from charnerf.stability.transforms import Motion
from charnerf.types import Cameras, SourceViews
from charnerf.volume.quadrature.base import AbstractQuadrature
from charnerf.volume.renderers.base import AbstractRenderer

SATURATED = 17.0  # optical depth of one interval from which 1 - alpha is below the rounding of 1 in float32
VISIBLE = 0.5 / 255.0  # half a step of an 8-bit picture
REPORTED = Bounds(None, None)
ROUNDING = Bounds(5e-6, 1e-13)
PICTURE = Bounds(0.05, 0.05)
MOVES = (Motion("moved by 1 m", offset=1.0), Motion("moved by 100 m", offset=100.0))
TURNS = (Motion("quarter turn", quarter_turns=1), Motion("half turn", quarter_turns=2))


@dataclass(frozen=True)
class TrainedField:
    """A model with a renderer, the drawings of one character (B = 1) and a camera () that looks at it.

    A small picture is enough: every pixel is a ray of its own.
    """

    network: CharNeRF
    renderer: AbstractRenderer
    views: SourceViews
    camera: Cameras


@dataclass
class _Recorder(AbstractQuadrature):
    """A quadrature that keeps what it was given and answered."""

    inner: AbstractQuadrature
    depths: list[Tensor] = field(default_factory=list)
    lost: list[Tensor] = field(default_factory=list)
    non_finite: int = 0

    def weights(self, densities: Tensor, t_vals: Tensor, t_edges: Tensor) -> tuple[Tensor, Tensor]:
        """The inner quadrature's answer."""
        weights, final = self.inner.weights(densities, t_vals, t_edges)
        self.depths.append((densities * torch.diff(t_edges, dim=-1)).detach().flatten())
        self.lost.append((weights.sum(-1) + final - 1.0).detach())
        self.non_finite += count_non_finite(densities, weights, final)
        return weights, final

    def importance_t_vals(
        self,
        densities: Tensor,
        t_vals: Tensor,
        t_edges: Tensor,
        num_samples: int,
        generator: torch.Generator | None = None,
    ) -> Tensor:
        """The inner quadrature's draws."""
        return self.inner.importance_t_vals(densities, t_vals, t_edges, num_samples, generator)


def check_trained(trained: TrainedField) -> Iterator[CheckRow]:
    """Rows of a trained field; its weights stay as they are."""
    target = Target(trained.camera.focal.device, trained.camera.focal.dtype)
    with torch.no_grad():
        encoded = trained.network.encode(trained.views)
        rest = _picture(trained, encoded)
        yield from _stiffness(trained, encoded, target)
        yield from _repeats(trained, encoded, rest, target)
        yield _differs("the same in float64", _in_float64(trained, encoded), rest, target, PICTURE)
        for motion in MOVES:
            yield _differs(motion.name, _moved(trained, encoded, motion), rest, target, PICTURE)
        for (
            motion
        ) in TURNS:  # the network sees the world's axes: a turned character is another input, no error
            yield _differs(motion.name, _moved(trained, encoded, motion), rest, target, REPORTED)


def _picture(trained: TrainedField, encoded: EncodedViews) -> Tensor:
    """Picture of the trained field, (H, W, 4): colour and opacity."""
    output = trained.renderer.render_camera(trained.network.scene(encoded, 0), trained.camera).finest
    return torch.cat((output.rgb, output.opacity[..., None]), dim=-1)


def _differs(case: str, picture: Tensor, rest: Tensor, target: Target, bounds: Bounds) -> CheckRow:
    """Share of pixels that differ visibly: a sample on the hull's border may fall on either side of it."""
    off = (doubled(picture) - doubled(rest)).abs().amax(-1) > VISIBLE
    errors = Errors(float(off.double().mean()), None, count_non_finite(picture, rest))
    return target.row("trained field", f"{case}: share of pixels that differ", errors, bounds)


def _stiffness(trained: TrainedField, encoded: EncodedViews, target: Target) -> Iterator[CheckRow]:
    """Largest optical depth of an interval, saturated samples, lost light, and what is not finite."""
    recorder = _Recorder(trained.renderer.quadrature)
    renderer = copy(trained.renderer)
    renderer.quadrature = recorder
    picture = _picture(replace(trained, renderer=renderer), encoded)
    depths = torch.cat(recorder.depths)
    bad = recorder.non_finite + count_non_finite(picture)
    yield target.row("trained field", "largest sigma * delta", Errors(largest(depths), None, bad), REPORTED)
    saturated = float((depths > SATURATED).double().mean()) if depths.numel() else 0.0
    yield target.row("trained field", "share of samples saturated", Errors(saturated), REPORTED)
    lost = Errors(largest(torch.cat(recorder.lost)), None, bad)
    yield target.row("trained field", "weights + transmittance - 1", lost, ROUNDING)


def _repeats(
    trained: TrainedField, encoded: EncodedViews, rest: Tensor, target: Target
) -> Iterator[CheckRow]:
    """Permuted views, one ray twice in a batch, and the same rays in other chunks."""
    yield _differs("views reversed", _picture(trained, _reversed(encoded)), rest, target, PICTURE)
    camera = trained.camera
    pixels = pixel_centres(camera.width, camera.height, device=camera.focal.device).to(camera.focal.dtype)
    rays = pixel_rays(camera, pixels.reshape(-1, 2))
    scene = trained.network.scene(encoded, 0)
    count = len(rays.origins)
    twice = trained.renderer.render(scene, rays[torch.arange(count).repeat(2)]).finest.rgb
    errors = Errors(largest(twice[:count] - twice[count:]), None, count_non_finite(twice))
    yield target.row("trained field", "one ray twice", errors, Bounds(1e-5, 1e-12))
    renderer = copy(trained.renderer)
    renderer.memory_mib = 1.0
    other = renderer.render(scene, rays).finest.rgb
    errors = Errors(largest(other - twice[:count]), None, count_non_finite(other))
    yield target.row("trained field", "small chunks", errors, Bounds(1e-4, 1e-11))


def _reversed(encoded: EncodedViews) -> EncodedViews:
    """The same views in reversed order, with their feature maps and hull maps."""
    order = torch.arange(encoded.feature_maps.shape[1] - 1, -1, -1, device=encoded.feature_maps.device)
    hull = encoded.hull
    if hull is not None:
        hull = replace(
            hull,
            front_depths=hull.front_depths[:, order],
            edge_distances=hull.edge_distances[:, order],
            dilations=hull.dilations[:, order],
        )
    return replace(
        encoded,
        views=encoded.views[:, order],
        feature_maps=encoded.feature_maps[:, order],
        hull=hull,
        detailed=None if encoded.detailed is None else encoded.detailed[:, order],
    )


def _in_float64(trained: TrainedField, encoded: EncodedViews) -> Tensor:
    """The same picture in float64 inside the same hull."""
    wide = replace(
        trained,
        network=deepcopy(trained.network).double(),
        views=trained.views.to(torch.float64),
        camera=trained.camera.to(torch.float64),
    )
    hull = None if encoded.hull is None else encoded.hull.to(torch.float64)
    return _picture(wide, wide.network.encode(wide.views, hull))


def _moved(trained: TrainedField, encoded: EncodedViews, motion: Motion) -> Tensor:
    """The picture of the whole character, its cameras and the model's box, moved together.

    Views are mirrored before the move: their mirror is the plane x = 0 of a character that stands at the
    origin. A hull is shifted along, and carved again where it is turned: whether carving notices a move is a
    case of the catalogue, and cells that touch a silhouette by rounding alone may fall either way.
    """
    network = deepcopy(trained.network)
    low, high = trained.network.box
    network.box_centre = motion.points(0.5 * (low + high))
    used = network.views(trained.views)
    network.views = Turnaround()
    views = replace(used, cameras=motion.cameras(used.cameras))
    hull = encoded.hull
    if hull is not None:
        box_min, box_max = motion.box(hull.box_min, hull.box_max)
        hull = None if motion.quarter_turns else replace(hull, box_min=box_min, box_max=box_max)
    moved = replace(trained, network=network, views=views, camera=motion.cameras(trained.camera))
    return _picture(moved, network.encode(views, hull))
