import json
import math
from types import SimpleNamespace

import pytest
import torch

from charnerf.data.characters import load_character
from charnerf.errors import DataError
from charnerf.evaluation.ray_weights import (
    RayWeights,
    normalised_entropy,
    ray_weights,
)
from charnerf.evaluation.records import read_record, write_record
from charnerf.geometry.bounds import Bounds
from charnerf.scene import FunctionField, Scene
from charnerf.types import FieldOutput
from charnerf.volume.quadrature.constant import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer

BOX = (torch.tensor([-1.8, -1.8, -0.8]), torch.tensor([1.8, 1.8, 2.8]))
SPACING = 3.6 / 64  # m at least, of samples through the box


def ball_model(density, *, radius=0.6):
    """A model whose every scene is the test figure `ball`, of one density inside."""

    def field(points, view_dirs):
        inside = (points - torch.tensor([0.0, 0.0, 0.6])).norm(dim=-1) < radius
        return FieldOutput(rgb=torch.zeros_like(points), densities=density * inside.float())

    scene = Scene(FunctionField(field), None, Bounds(*BOX))
    return SimpleNamespace(
        device=torch.device("cpu"), encode=lambda views: views, scene=lambda encoded, index: scene
    )


@pytest.fixture(scope="module")
def ball(figure_dataset):
    return load_character(figure_dataset, "ball")


def measured(character, density, **more):
    renderer = CulledRenderer(
        quadrature=PiecewiseConstant(), num_coarse=8, num_fine=0, hull_steps=32, memory_mib=128.0
    )
    return ray_weights(ball_model(density, **more), renderer, [character], views=2, size=24)


def test_entropy_is_that_of_the_normalised_weights():
    weights = torch.tensor([[0.0, 0.7, 0.0, 0.0], [0.2, 0.2, 0.2, 0.2], [0.3, 0.0, 0.3, 0.0]]).double()
    expected = torch.tensor([0.0, 1.0, math.log(2.0) / math.log(4.0)]).double()
    torch.testing.assert_close(normalised_entropy(weights), expected)
    assert normalised_entropy(torch.zeros(4)) == 1.0
    torch.testing.assert_close(normalised_entropy(1e-30 * weights), expected)


def test_a_hard_surface_in_its_place_has_no_entropy_and_the_true_depth(ball):
    found = measured(ball, 1e4)
    assert found.entropy < 1e-3
    assert found.depth_error_m < SPACING
    assert found.opaque_share > 0.95  # a ray at the rim may pass between two samples
    assert found.hull_depth_error_m is None
    assert sum(found.weight_at) == pytest.approx(1.0, abs=1e-3)
    middle = [
        weight for x, weight in zip(found.distances_m, found.weight_at, strict=True) if abs(x) < SPACING
    ]
    assert sum(middle) > 0.99
    assert found.num_rays > 100


def test_fog_has_entropy_and_lies_behind_the_surface(ball):
    hard, fog = measured(ball, 1e4), measured(ball, 2.0)
    assert fog.entropy > hard.entropy + 0.3
    assert fog.depth_offset_m > 0.1  # light enters it
    assert fog.entropy_at == sorted(fog.entropy_at) and fog.error_at == sorted(fog.error_at)


def test_a_surface_too_far_out_lies_in_front(ball):
    found = measured(ball, 1e4, radius=0.75)
    assert found.depth_offset_m == pytest.approx(-0.15, abs=SPACING)


def test_without_a_mesh_or_an_opaque_ray_it_says_so(ball):
    with pytest.raises(DataError, match="shows nothing of ball"):
        measured(ball, 0.0)
    bare = SimpleNamespace(name="ball", mesh_file=None)
    with pytest.raises(DataError, match="no meshes"):
        ray_weights(ball_model(1.0), None, [bare])


def test_figures_are_read_as_they_were_written(ball, tmp_path):
    found = measured(ball, 50.0)
    write_record(tmp_path / "ray_weights.json", found)
    assert read_record(tmp_path / "ray_weights.json", RayWeights, what="figures of ray weights") == found
    (tmp_path / "ray_weights.json").write_text(json.dumps({"entropy": 1}))
    with pytest.raises(DataError, match="expected figures of ray weights"):
        read_record(tmp_path / "ray_weights.json", RayWeights, what="figures of ray weights")
