"""Random points as views see them, without any view."""

import torch

from charnerf.geometry.safe import safe_normalize
from charnerf.models.inputs import FieldInputs, PointViews
from support import tiny_models


def random_dirs(num_points: int = 9) -> torch.Tensor:
    """Unit directions (P, 3), float64."""
    return safe_normalize(torch.randn(num_points, 3, dtype=torch.float64))


def point_views(num_points: int = 9, num_views: int = 3) -> PointViews:
    """What V views show of P points, float64."""
    random = lambda *shape: torch.rand(num_points, num_views, *shape, dtype=torch.float64)  # noqa: E731
    return PointViews(
        rgb=random(3),
        uv=random(2),
        dirs=safe_normalize(random(3) - 0.5),
        behind=0.1 * random(),
        valid=random() < 0.6,
    )


def field_inputs(num_points: int = 9, num_views: int = 3) -> FieldInputs:
    """What a tiny field reads at P points, float64."""
    random = lambda *shape: torch.randn(*shape, dtype=torch.float64)  # noqa: E731
    return FieldInputs(
        views=point_views(num_points, num_views),
        latents=random(num_points, num_views, tiny_models.WIDTH),
        edge=0.1 * random(num_points, num_views),
        mirrored=torch.zeros(num_views, dtype=torch.float64),
        section_places=random(num_points, 3),
        section_lengths=random(num_points, 3).abs(),
        box_points=random(num_points, 3).tanh(),
        rotations=torch.eye(3, dtype=torch.float64).expand(num_views, 3, 3),
        kept=torch.ones(num_points, dtype=torch.float64),
    )
