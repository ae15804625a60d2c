"""Every combinator learns: on one small batch the loss falls to a tenth."""

import pytest
import torch

from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.losses.terms import squared_color_error
from charnerf.types import Hull, RayBundle
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

STEPS = 150


@pytest.fixture(scope="module")
def picture() -> tuple[RayBundle, torch.Tensor]:
    """A person from a camera that is no source: rays and colours on white."""
    camera = helpers.target_cameras(8)[5:6]
    rgba = helpers.photograph(helpers.person(symmetric=False), camera)[0].reshape(-1, 4)
    rays = pixel_rays(camera[0], pixel_centres(helpers.SIZE, helpers.SIZE).reshape(-1, 2))
    rgb = rgba[:, :3] * rgba[:, 3:] + 1.0 - rgba[:, 3:]
    chosen = torch.cat(((rgba[:, 3] > 0).nonzero()[:, 0], torch.arange(0, len(rgb), 9)))
    return rays[chosen], rgb[chosen]


@pytest.fixture(scope="module")
def carved(person_views) -> Hull:
    return tiny_models.tiny_model().carve(person_views)


@pytest.mark.parametrize("combining", tiny_models.COMBINATORS)
def test_overfitting_one_character_lowers_the_loss_tenfold(combining, picture, carved, person_views):
    model = tiny_models.tiny_model(
        combining=combining, head="radiance", density="view_dependent", features="image"
    )
    renderer = CulledRenderer(
        quadrature=PiecewiseConstant(), num_coarse=12, num_fine=0, hull_steps=64, memory_mib=256
    )
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-2)
    rays, rgb = picture
    losses = []
    for _ in range(STEPS):
        scene = model.scene(model.encode(person_views, carved), 0)
        loss = squared_color_error(renderer.render(scene, rays).finest.rgb, rgb)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
        if loss < 0.1 * losses[0]:
            break
    assert losses[-1] < 0.1 * losses[0], (losses[0], losses[-1])
