"""f1: in the world's axes, and in each camera's as pixelNeRF."""

from dataclasses import replace

import pytest
import torch

from charnerf.geometry.safe import safe_normalize
from charnerf.models.inputs import FieldInputs
from charnerf.models.single_view.camera import CameraSingleView
from support import tiny_models
from support.random_inputs import field_inputs

WIDTH = tiny_models.WIDTH


def inputs_of(f1, points: torch.Tensor, rotations: torch.Tensor) -> FieldInputs:
    """Points as views with these axes see them, the same features whatever the axes are."""
    views = len(rotations)
    latents = torch.randn(
        len(points), views, f1.latent_size, dtype=torch.float64, generator=torch.Generator().manual_seed(5)
    )
    return replace(field_inputs(len(points), views), latents=latents, box_points=points, rotations=rotations)


def axes(count: int) -> torch.Tensor:
    """Rotations (count, 3, 3)."""
    turned = torch.linalg.qr(torch.randn(count, 3, 3, dtype=torch.float64))[0]
    return turned * torch.linalg.det(turned).sign()[:, None, None]


def test_pixelnerfs_code_by_hand():
    """x itself, then for each octave sin and cos of 1.5 2^k x, all in the camera's axes."""
    f1 = CameraSingleView(width=4, num_point_features=0, num_blocks=3, octaves=6, factor=1.5)
    rotation = axes(2)
    points = torch.rand(5, 3, dtype=torch.float64) - 0.5
    found = f1.encode(points, rotation)
    assert found.shape == (5, 2, 3 + 36) and f1.latent_size == 12
    in_camera = torch.einsum("vji,pj->pvi", rotation, points)
    phases = 1.5 * 2.0 ** torch.arange(6, dtype=torch.float64)[:, None] * in_camera[:, :, None]
    expected = torch.cat((torch.sin(phases), torch.cos(phases)), dim=-1).flatten(-2)
    torch.testing.assert_close(found[..., :3], in_camera)
    torch.testing.assert_close(found[..., 3:], expected)
    assert f1.from_points.in_features == 39 + 3


@pytest.mark.parametrize("num_blocks", [0, 1, 3])
@pytest.mark.parametrize("name", ["world", "camera"])
def test_whether_turning_the_world_changes_anything(name, num_blocks):
    """Points, directions and cameras turned together: the same to the cameras' f1, not to the world's."""
    f1 = tiny_models.shake(tiny_models.f1(name, num_point_features=2, num_blocks=num_blocks).double())
    points, turn, rotations = torch.rand(6, 3, dtype=torch.float64) - 0.5, axes(1)[0], axes(3)
    dirs = safe_normalize(torch.randn(6, 3, dtype=torch.float64))
    features = torch.randn(6, 3, 2, dtype=torch.float64)
    before, after = inputs_of(f1, points, rotations), inputs_of(f1, points @ turn.T, turn @ rotations)
    difference = (f1(before, features, dirs) - f1(after, features, dirs @ turn.T)).abs().amax()
    assert (difference < 1e-9) == (name == "camera")
    other = f1(before, features, -dirs)
    assert other.shape == (6, 3, WIDTH) and (other - f1(before, features, dirs)).abs().amax() > 1e-3


@pytest.mark.parametrize("name", ["world", "camera"])
def test_no_direction_is_one_row_for_all(name):
    f1 = tiny_models.shake(tiny_models.f1(name).double())
    inputs = inputs_of(f1, torch.rand(4, 3, dtype=torch.float64), axes(2))
    no_dirs, no_features = torch.zeros(4, 3).double(), torch.zeros(4, 2, 0).double()
    torch.testing.assert_close(f1(inputs, no_features, no_dirs), f1(inputs, no_features, no_dirs[:1]))


def test_features_enter_before_every_block():
    """Changing only what the last block reads changes the answer."""
    f1 = tiny_models.shake(tiny_models.f1("camera", num_blocks=3).double())
    inputs = inputs_of(f1, torch.rand(4, 3, dtype=torch.float64), axes(2))
    no_dirs, no_features = torch.zeros(4, 3).double(), torch.zeros(4, 2, 0).double()
    for block in range(3):
        changed = inputs.latents.clone()
        changed[..., block * WIDTH : (block + 1) * WIDTH] += 1.0
        answer = f1(replace(inputs, latents=changed), no_features, no_dirs)
        assert (answer - f1(inputs, no_features, no_dirs)).abs().amax() > 1e-2


@pytest.mark.parametrize("density", tiny_models.DENSITIES)
def test_a_model_with_camera_inputs_answers_and_learns(density, person_views):
    model = tiny_models.tiny_model(
        single_view="camera", density=density, combining="mean", head="radiance", features="image"
    )
    scene = model.scene(model.encode(person_views), 0)
    points = torch.rand(7, 3) - torch.tensor([0.5, 0.5, -0.5])
    answer = scene.field(points, safe_normalize(torch.randn(7, 3)))
    assert answer.rgb.shape == (7, 3) and (answer.densities >= 0).all()
    (answer.rgb.sum() + answer.densities.sum()).backward()
    assert model.coarse.single_view.from_points.weight.grad.abs().sum() > 0
    assert model.coarse.from_latents.weight.grad.abs().sum() > 0
