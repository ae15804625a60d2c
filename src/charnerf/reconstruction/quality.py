"""How good a reconstruction is, told by what is there without a truth: its drawings, its haze, its surface."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

import numpy as np
import torch

from charnerf.drawings.turnaround import Turnaround
from charnerf.evaluation.metrics import haze, silhouette_iou
from charnerf.geometry.world import HEIGHT
from charnerf.meshing.build import BuiltMesh
from charnerf.meshing.extract import fit_height
from charnerf.meshing.lod import num_parts
from charnerf.reconstruction.options import ReconstructionOptions
from charnerf.surfaces.render import render_clay
from charnerf.wording import counted, typed_or_clicked

# Beyond one of these a surface looks frayed; measured on drawings by artists: docs/drawings.md
MOST_HAZE = 0.1
MOST_DROPPED = 20
MOST_HANDLES = 10
LEAST_IOU = 0.85
FEW_VIEWS = 3


@dataclass(frozen=True)
class Silhouette:
    """How well the mesh's outline fits a drawing's.

    Attributes:
        view: What the drawing shows.
        given: IoU with the drawing as it was given, brought to the common height.
        reconciled: IoU with it as the model took it.
    """

    view: str
    given: float
    reconciled: float


@dataclass(frozen=True)
class Quality:
    """Figures of a reconstruction.

    Attributes:
        silhouettes: One a drawing.
        haze: Share of the pictures' figure that is neither clear nor opaque, mean over the turntable; None of empty pictures.
        dropped: Loose parts that were dropped.
        parts: Parts that are left.
        is_closed: Whether the surface has no border.
        handles: Genus of a closed surface, over all parts: holes that go through; None of one that is not closed.
    """

    silhouettes: tuple[Silhouette, ...]
    haze: float | None
    dropped: int
    parts: int
    is_closed: bool
    handles: int | None

    @property
    def is_frayed(self) -> bool:
        """Whether the surface looks torn, closed or not."""
        return (
            self.dropped > MOST_DROPPED
            or (self.handles or 0) > MOST_HANDLES
            or (self.haze or 0.0) > MOST_HAZE
        )

    def facts(self) -> dict[str, Any]:
        """The same for JSON."""
        return {**asdict(self), "is_frayed": self.is_frayed}


def measure(
    built: BuiltMesh, drawings: Turnaround, pictures: Sequence[np.ndarray], *, height: float | None
) -> Quality:
    """Measure what was made.

    Args:
        built: The mesh.
        drawings: What it was made of.
        pictures: Turntable, RGBA uint8 (S, S, 4) each.
        height: That the mesh was scaled to, m; None where it was not.
    """
    surface = built.surface
    standing = surface if height is None else fit_height(surface, HEIGHT)  # as tall as the drawings say
    seen = torch.from_numpy(render_clay(standing, drawings.views.cameras[0])[..., 3])
    silhouettes = tuple(
        Silhouette(name, silhouette_iou(alpha, torch.from_numpy(given)), silhouette_iou(alpha, image[3]))
        for name, alpha, given, image in zip(
            drawings.names, seen, drawings.given_alphas, drawings.views.images[0], strict=True
        )
    )
    hazes = [haze(torch.from_numpy(picture[..., 3] / 255.0)) for picture in pictures]
    there = [one for one in hazes if one is not None]
    parts, is_closed = num_parts(surface), bool(surface.is_watertight)
    return Quality(
        silhouettes=silhouettes,
        haze=fmean(there) if there else None,
        dropped=built.num_floaters,
        parts=parts,
        is_closed=is_closed,
        handles=parts - int(surface.euler_number) // 2 if is_closed else None,
    )


def surface_words(quality: Quality) -> str:
    """What kind of surface it is: closed is not all."""
    kind = "closed" if quality.is_closed else "not closed"
    through = f", {counted(quality.handles, 'hole')} through it" if quality.handles else ""
    dropped = f"; {counted(quality.dropped, 'loose part')} dropped" if quality.dropped else ""
    return (
        f"{'frayed: ' if quality.is_frayed else ''}{kind}, {counted(quality.parts, 'part')}{through}{dropped}"
    )


def quality_words(quality: Quality) -> str:
    """The result in one sentence."""
    worst = min(quality.silhouettes, key=lambda one: one.given)
    hazy = "" if quality.haze is None else f", haze {100 * quality.haze:.0f} %"
    mean = fmean(one.given for one in quality.silhouettes)
    return (
        f"Outlines fit the drawings with IoU {mean:.2f} (worst: {worst.view}, {worst.given:.2f}){hazy}; the surface is"
        f" {surface_words(quality)}."
    )


def suggestions(quality: Quality, options: ReconstructionOptions, *, num_drawings: int) -> list[str]:
    """What may make it better, the options' names first; nothing where it looks right."""
    fits = all(one.given >= LEAST_IOU for one in quality.silhouettes)
    if fits and not quality.is_frayed:
        return []
    lines = []
    if not fits:
        worst = min(quality.silhouettes, key=lambda one: one.given)
        lines.append(
            f"Look at the {worst.view} drawing: the mesh's outline shares {100 * worst.given:.0f} % with it. Views of one pose"
            " and one size fit better; is each file seen from where it was given?"
        )
    if options.refine_seconds is None:
        named = typed_or_clicked("--refine 30", "Refine (30 seconds)")
        lines.append(f"{named} adapts the model to these drawings; it is kept only where it helps.")
    if quality.is_frayed and not options.symmetric:
        named = typed_or_clicked("--symmetric", "Symmetric")
        lines.append(f"{named}, if the character's left and right are alike, averages torn places out.")
    if quality.is_frayed and options.mesh.smooth == 0:
        named = typed_or_clicked("--smooth 10", "Smoothing (10)")
        lines.append(f"{named} evens the surface out.")
    if quality.is_frayed and num_drawings <= FEW_VIEWS:
        named = typed_or_clicked("--view back=FILE, or right=FILE for", "A drawing of the back, or of")
        lines.append(
            f"{named} the other side: where front, sides or back lack one, it says most about what is torn."
        )
    return lines
