"""What a run shows."""

import torch

from charnerf.training.monitor import _nearness
from charnerf.types import RenderOutput


def test_depth_is_drawn_of_what_is_seen():
    """White is nearest; rays that show nothing are black, whatever depth they carry."""
    depth = torch.tensor(((0.0, 3.0), (4.0, 9.0)))
    opacity = torch.tensor(((0.0, 1.0), (0.9, 0.2)))
    output = RenderOutput(torch.zeros(2, 2, 3), opacity, depth)
    assert _nearness(output).tolist() == [[0.0, 1.0], [0.25, 0.0]]
    assert _nearness(RenderOutput(output.rgb, 0.0 * opacity, depth)).eq(0).all()
