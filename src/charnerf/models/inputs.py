"""What a field sees of its points: the seam between lookup, f1, combinator, density and head."""

from dataclasses import dataclass

from torch import Tensor

from charnerf.types import TensorRecord


@dataclass(frozen=True)
class PointInputs(TensorRecord):
    """Points as the source views see them.

    Attributes:
        latents: (P, V, L), encoder features at the projections, already through the field's linear layer.
        point_features: (P, V, E), further inputs per view (see models/features); E may be 0.
        source_rgb: (P, V, 3) in [0, 1], colour of the drawings at the projections.
        uv: (P, V, 2), the projections, by the drawings' sides.
        visibility: (P, V) in [0, 1], 1 on the side of the hull that faces the view, falling with depth behind it.
        valid: (P, V), bool: in front of the camera and inside the picture.
        encoded_points: (P, C) or (P, V, C), where the points lie, as f1 encodes it.
        view_dirs: (P, 3), unit query directions, or zero for "no direction".
        source_dirs: (P, V, 3), unit, from each source camera to the point.
        kept: (P,) in [0, 1], factor on the density: 0 where a drawing shows that nothing is there; 1 without a hull and in
            training.
    """

    latents: Tensor
    point_features: Tensor
    source_rgb: Tensor
    uv: Tensor
    visibility: Tensor
    valid: Tensor
    encoded_points: Tensor
    view_dirs: Tensor
    source_dirs: Tensor
    kept: Tensor
