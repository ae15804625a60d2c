"""A training of a few steps without files, for the stiff cases; run as a script it prints their table."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import torch
from omegaconf import DictConfig
from torch import Tensor, nn

from charnerf.config.composition import compose_config
from charnerf.errors import CharNeRFError
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.inference.build import build_model
from charnerf.losses.total import Pass
from charnerf.models.charnerf import CharNeRF
from charnerf.stability.transforms import Motion
from charnerf.training.run import build_losses, training_renderer
from charnerf.types import Cameras, Hull, RayBundle, SourceViews, TrainBatch
from support.helpers import dumbbell, person, photograph, source_views, target_cameras

RAYS = 64


@dataclass(frozen=True)
class Character:
    """Drawings (B = 1), pictures (N, H, W, 4) and their cameras (N,)."""

    views: SourceViews
    pictures: Tensor
    cameras: Cameras


@dataclass(frozen=True)
class Fit:
    """Losses of every step, and the opacity on the character's pixels after the last."""

    losses: tuple[float, ...]
    opacity: float
    model: CharNeRF

    @property
    def finite(self) -> bool:
        """Whether every loss and every weight is."""
        weights = all(bool(p.isfinite().all()) for p in self.model.parameters())
        return all(math.isfinite(loss) for loss in self.losses) and weights


@cache
def ordinary() -> Character:
    """The person of closed form."""
    figure, cameras = person(), target_cameras(4)
    return Character(source_views(figure), photograph(figure, cameras), cameras)


@cache
def thin() -> Character:
    """Two balls and a thin rod."""
    figure, cameras = dumbbell(), target_cameras(4)
    return Character(source_views(figure), photograph(figure, cameras), cameras)


def moved(character: Character, motion: Motion) -> Character:
    """The same character and cameras elsewhere, or in another unit of length."""
    views = replace(character.views, cameras=motion.cameras(character.views.cameras))
    return replace(character, views=views, cameras=motion.cameras(character.cameras))


def batch_of(
    character: Character, hull: Hull | None, step: int, change: Callable[[TrainBatch], TrainBatch] | None
) -> TrainBatch:
    """Random rays of all pictures."""
    generator = torch.Generator().manual_seed(step)
    count, height, width, _ = character.pictures.shape
    flat = torch.randint(count * height * width, (RAYS,), generator=generator)
    pixels = pixel_centres(width, height).reshape(-1, 2)
    rays = [pixel_rays(character.cameras[i], pixels) for i in range(count)]
    every = RayBundle(torch.cat([r.origins for r in rays]), torch.cat([r.directions for r in rays]))
    rgba = character.pictures.reshape(-1, 4)[flat]
    batch = TrainBatch(
        names=("figure",),
        views=character.views,
        hull=hull,
        rays=every[flat][None],
        rgb=(rgba[:, :3] * rgba[:, 3:] + 1.0 - rgba[:, 3:])[None],
        alpha=rgba[:, 3][None],
        square=0,
        depth=None,
        surface=None,
        space=None,
        phase=0,
        loss_weights={},
        step=step,
        seeds=(step,),
    )
    return batch if change is None else change(batch)


def fit(
    character: Character,
    *,
    overrides: Sequence[str] = (),
    steps: int = 10,
    rate: float = 2e-3,
    length: float = 1.0,
    density_length: float | None = None,
    autocast: torch.dtype | None = None,
    change: Callable[[TrainBatch], TrainBatch] | None = None,
) -> Fit:
    """Train the smallest model as the training module does: Adam, clipped gradients, rays and their opacity.

    Args:
        character: What of.
        overrides: Of the config.
        steps: How many.
        rate: Learning rate.
        length: Units of length a metre: the box grows with it.
        density_length: The same for the density at the start, which shrinks with it; `length` if None.
        autocast: Precision of the networks.
        change: Applied to every batch.
    """
    cfg = _composed(*overrides).copy()
    cfg.model.box_half_extent *= length
    cfg.model.box_centre = [length * x for x in cfg.model.box_centre]
    if "scale" in cfg.model.activation:
        cfg.model.activation.scale /= density_length or length
    torch.manual_seed(0)
    model, renderer = build_model(cfg), training_renderer(cfg)
    losses, _ = build_losses(cfg)
    hull = model.carve(character.views)
    optimizer = torch.optim.Adam(model.parameters(), lr=rate)
    history = []
    for step in range(steps):
        batch = batch_of(character, hull, step, change)
        with torch.autocast("cpu", dtype=autocast or torch.bfloat16, enabled=autocast is not None):
            scene = model.scene(model.encode(batch.views, batch.hull), 0)
            generator = torch.Generator().manual_seed(step)
            output = renderer.render(scene, batch.rays[0], generator).finest
            total, _ = losses([Pass(output[None], [scene.field])], batch, generator)
        optimizer.zero_grad()
        if total.requires_grad:
            total.backward()
            nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimizer.step()
        history.append(float(total.detach()))
    seen = batch_of(character, hull, steps, None)
    with torch.no_grad():
        output = renderer.render(model.scene(model.encode(seen.views, seen.hull), 0), seen.rays[0]).finest
    shown = seen.alpha[0] > 0.5
    return Fit(tuple(history), float(output.opacity[shown].mean()) if bool(shown.any()) else math.nan, model)


@cache
def _composed(*overrides: str) -> DictConfig:
    return compose_config(["scale=smoke", *overrides])


def drawn(character: Character, picture: Callable[[Tensor], Tensor]) -> Character:
    """The character with its drawings (1, V, 4, H, W) changed."""
    return replace(character, views=replace(character.views, images=picture(character.views.images.clone())))


def _painted(value: float) -> Callable[[Tensor], Tensor]:
    def paint(images: Tensor) -> Tensor:
        images[:, :, :3] = value
        return images

    return paint


def _silhouette(
    keep: Callable[[Tensor, Tensor], Tensor], views: slice = slice(None)
) -> Callable[[Tensor], Tensor]:
    def cut(images: Tensor) -> Tensor:
        side = images.shape[-1]
        y, x = torch.meshgrid(torch.arange(side), torch.arange(side), indexing="ij")
        images[:, views, 3] = keep(x, y).float()
        return images

    return cut


def _duplicated(character: Character) -> Character:
    views = character.views
    return replace(character, views=views[:, torch.tensor([0, 0, 0])])


def _one_view(character: Character) -> Character:
    return replace(character, views=character.views[:, torch.tensor([0])])


def _shifted(character: Character) -> Character:
    """Half of the figure beyond the picture's left edge, in every drawing."""

    def shift(images: Tensor) -> Tensor:
        half = images.shape[-1] // 2
        return torch.cat((images[..., half:], torch.zeros_like(images[..., :half])), dim=-1)

    return drawn(character, shift)


def _spike(batch: TrainBatch) -> TrainBatch:
    """One batch of colours a million times too bright."""
    return replace(batch, rgb=batch.rgb * 1e6) if batch.step == 3 else batch


def _half_of_the_rays(batch: TrainBatch) -> TrainBatch:
    """A phase of other counts and weights from step 6 on."""
    if batch.step < 6:
        return batch
    return replace(batch, loss_weights={"opacity": 0.0, "reconstruction": 2.0}, phase=1)


def cases() -> dict[str, Callable[[], Fit]]:
    """Every stiff training by name."""
    base = ordinary()
    paper = ("experiment=charnerf", "loss=opacity")
    return {
        "ordinary": lambda: fit(base),
        "thin rod between balls": lambda: fit(thin()),
        "learning rate x 100": lambda: fit(base, rate=0.2, steps=20),
        "learning rate x 100, paper's model": lambda: fit(base, rate=0.2, steps=20, overrides=paper),
        "all-black drawings": lambda: fit(drawn(base, _painted(0.0))),
        "all-white drawings": lambda: fit(drawn(base, _painted(1.0))),
        "one-pixel silhouettes": lambda: fit(
            drawn(base, _silhouette(lambda x, y: (x == 16) & (y == 16))), overrides=["model.hull=true"]
        ),
        "character fills the frame": lambda: fit(drawn(base, _silhouette(lambda x, y: x >= 0))),
        "character leaves the frame": lambda: fit(_shifted(base)),
        "duplicated views": lambda: fit(_duplicated(base)),
        "one view": lambda: fit(_one_view(base)),
        "one empty view": lambda: fit(drawn(base, _silhouette(lambda x, y: x < 0, slice(1, 2)))),
        "all views empty, without a hull": lambda: fit(
            drawn(base, _silhouette(lambda x, y: x < 0)), overrides=["model.hull=false"]
        ),
        "loss spike of 1e12": lambda: fit(base, change=_spike, steps=20),
        "phase switch": lambda: fit(base, change=_half_of_the_rays),
        "bfloat16 autocast": lambda: fit(base, autocast=torch.bfloat16),
        "ReLU density": lambda: fit(
            base,
            overrides=[
                "model.activation._target_=charnerf.models.activations.ReLU",
                "~model.activation.shift",
            ],
        ),
        "piecewise linear quadrature": lambda: fit(base, overrides=["quadrature=piecewise_linear"]),
        "in millimetres": lambda: fit(moved(base, Motion("", scale=1e3)), length=1e3),
        "in kilometres": lambda: fit(moved(base, Motion("", scale=1e-3)), length=1e-3),
    }


def table() -> str:
    """The cases as a table in Markdown."""
    lines = ["| case | loss, first -> last | opacity on the character | ends in |", "|---|---|---|---|"]
    for name, run in cases().items():
        try:
            done = run()
        except CharNeRFError as error:
            lines.append(f"| {name} | - | - | {type(error).__name__}: {error} |")
            continue
        ends = "finite" if done.finite else "NOT FINITE"
        lines.append(
            f"| {name} | {done.losses[0]:.3g} -> {done.losses[-1]:.3g} | {done.opacity:.2f} | {ends} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())  # noqa: T201
