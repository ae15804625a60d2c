"""Along which directions surface points are looked at."""

import torch

from charnerf.losses.directions import CameraDirections, NoDirections, RandomDirections


def test_directions():
    points = torch.rand(4000, 3, dtype=torch.float64)
    origins = torch.tensor([[4.0, 0.0, 1.0], [0.0, -4.0, 1.0]], dtype=torch.float64)
    drawn = [
        rule()(points, origins, torch.Generator().manual_seed(0)) for rule in (NoDirections, RandomDirections)
    ]
    assert torch.equal(drawn[0], torch.zeros_like(points))
    assert (drawn[1].norm(dim=-1) - 1).abs().amax() < 1e-6 and drawn[1].mean(0).abs().amax() < 0.05
    seen = CameraDirections()(points, origins, torch.Generator().manual_seed(0))
    towards = [torch.nn.functional.cosine_similarity(points - origin, seen) > 1 - 1e-9 for origin in origins]
    assert (towards[0] ^ towards[1]).all() and 1800 < int(towards[0].sum()) < 2200
    again = CameraDirections()(points, origins, torch.Generator().manual_seed(0))
    assert torch.equal(seen, again)
