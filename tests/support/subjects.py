"""A small subject of the benchmarks, and settings of its renderers."""

import torch

from charnerf.bench.subjects import Pictured, Subject, subject
from charnerf.volume.quadrature import PiecewiseConstant
from support import helpers, tiny_models

LIKE = {
    "quadrature": PiecewiseConstant(),
    "num_coarse": 16,
    "num_fine": 8,
    "hull_steps": 128,
    "memory_mib": 64,
}


def pictured_person(size: int = 24) -> Pictured:
    """Drawings of a person and a picture from aside."""
    person = helpers.person(symmetric=False)
    cameras = helpers.target_cameras(4, size=size)
    picture = helpers.photograph(person, cameras[1:2])[0]
    return Pictured("person", helpers.source_views(person), cameras[1], picture)


def tiny_subject(*, fine: bool = False, features: str = "image_hull") -> Subject:
    """A shaken model of a person, 48 pixels of a picture."""
    torch.manual_seed(1)
    model = tiny_models.tiny_model(fine=fine, features=features)
    network = tiny_models.shake(model, scale=0.15).requires_grad_(False).eval()
    return subject(pictured_person(), network, num_pixels=48)
