"""No encoder's gradient vanishes or explodes on its way to the first layer at the start of training."""

import pytest

from support import encoder_gradients


@pytest.mark.parametrize("build", [encoder_gradients.single, encoder_gradients.double])
@pytest.mark.parametrize("stacks", [1, 4])
def test_the_first_layer_gets_gradient(build, stacks):
    ratio, _ = encoder_gradients.gradient_ratio(build, stacks, seed=0)
    assert 0.01 < ratio < 100.0


def test_an_mlp_in_between_takes_gradient_away():
    """Why the maps are concatenated: PIFuHD's way costs the coarse stack most of its gradient."""
    _, beside = encoder_gradients.gradient_ratio(encoder_gradients.double, 1, seed=0)
    _, through = encoder_gradients.gradient_ratio(encoder_gradients.ThroughMLP, 1, seed=0)
    assert through < beside
