"""What a field reads at points: the seam between the maps of the views and f1, H and the colour head.

Letters: P points, V views, L latents.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.types import TensorRecord

DEPTH_FADE = 20.0  # per half-extent: a point this share behind the hull's front counts as hidden by 1/e


@dataclass(frozen=True)
class PointViews(TensorRecord):
    """Points as the source views see them: what H and the colour head read.

    Attributes:
        rgb: (P, V, 3) in [0, 1], colour of the drawings at the projections.
        uv: (P, V, 2), the projections, by the drawings' sides.
        dirs: d^(i), (P, V, 3), unit, from each source camera to the point.
        behind: (P, V), distance behind the hull's front, in half-extents of the box; negative in front; 0 without a hull.
        valid: (P, V), bool: in front of the camera and inside the picture.
    """

    rgb: Tensor
    uv: Tensor
    dirs: Tensor
    behind: Tensor
    valid: Tensor

    @property
    def visibility(self) -> Tensor:
        """(P, V) in [0, 1], 1 on the side of the hull that faces the view, falling with depth behind it."""
        return torch.exp(-DEPTH_FADE * self.behind.clamp_min(0.0))


@dataclass(frozen=True)
class FieldInputs:
    """All that a field reads at points, whatever the direction that they are looked at along.

    Attributes:
        views: What the views show of them.
        latents: W^i(x), (P, V, L), already through the field's linear layer; 0 where not valid.
        edge: (P, V), distance from the mask's edge by the picture's side; positive inside; 0 without a hull.
        mirrored: (V,), 1 where the view is a mirrored one.
        section_places: (P, 3), where the points lie in the hull's runs along the world's axes, ends at -1 and 1; 0 if not read.
        section_lengths: (P, 3), half of the lengths of those runs, in half-extents of the box; 0 if not read.
        box_points: (P, 3), the points in coordinates of the box, (-1, 1).
        rotations: (V, 3, 3), axes of the source cameras in the world: camera-to-world.
        kept: (P,), factor on the density: 0 where a drawing shows that nothing is there, all from 1 on, where it runs on so that it
            is straight across outlines; 1 without a hull and in training.
    """

    views: PointViews
    latents: Tensor
    edge: Tensor
    mirrored: Tensor
    section_places: Tensor
    section_lengths: Tensor
    box_points: Tensor
    rotations: Tensor
    kept: Tensor
