"""The convergence report: exact without directions, falling distances with them, a warning where it matters."""

import dataclasses

import numpy as np
import pytest
import torch

from charnerf.geometry.cameras import cameras_towards
from charnerf.inference.hero import Hero
from charnerf.meshing.convergence import (
    convergence_lines,
    direction_spread,
    measure_convergence,
)
from charnerf.meshing.options import MeshOptions
from charnerf.reconstruction.meshes import write_convergence, write_mesh
from charnerf.types import SourceViews
from support.analytic_scenes import figure, scene_of, sphere, with_field


def _directed(strength: float):
    """A sphere whose density swells towards one side of the viewer, by a share of itself."""
    plain = scene_of(sphere, width=0.4)

    def field(points, view_dirs):
        answer = plain.field(points, view_dirs)
        return dataclasses.replace(answer, densities=answer.densities * (1.0 + strength * view_dirs[:, 0]))

    return with_field(plain, field, sees_directions=True)


def test_without_directions_one_evaluation_is_exact():
    result = measure_convergence(scene_of(sphere, width=0.1), resolution=32)
    assert result.exact and result.rows == () and result.spread == pytest.approx(0.0, abs=1e-9)
    assert result.warning is None and result.enough == 1
    assert "one evaluation is exact" in "\n".join(convergence_lines(result))


def test_distances_fall_with_cameras_and_a_strong_dependence_warns():
    result = measure_convergence(_directed(0.9), resolution=32, counts=(1, 4, 16))
    assert [row.num_cameras for row in result.rows] == [0, 1, 4, 16]
    by_count = {row.num_cameras: row.distance_mm for row in result.rows}
    assert by_count[1] > by_count[4] > by_count[16]
    assert by_count[16] == pytest.approx(0.0, abs=0.1)  # of samples of equal surfaces
    assert result.spread > 0.25 and result.warning is not None and "strongly" in result.warning
    text = "\n".join(convergence_lines(result))
    assert "| none (zero direction) |" in text and "**warning**" in text


def test_a_weak_dependence_does_not_warn():
    result = measure_convergence(_directed(0.005), resolution=32, counts=(1, 4))
    assert result.warning is None and result.enough == 1


def test_spread_is_the_relative_deviation_over_directions():
    scene = _directed(0.5)
    near = np.array([[0.9, 0.0, 1.0], [0.0, 0.8, 1.3]])
    points = torch.from_numpy(near).float()
    from charnerf.meshing.density import camera_positions

    offset = points[:, None] - camera_positions(scene, 16)
    factor = 1.0 + 0.5 * (offset / offset.norm(dim=-1, keepdim=True))[..., 0]
    expected = (factor.std(1, correction=0) / factor.mean(1)).mean()
    assert direction_spread(scene, near) == pytest.approx(float(expected), rel=1e-4)


def test_meshes_come_with_cameras_where_asked(tmp_path):
    scene = scene_of(figure, width=0.1)
    camera = cameras_towards(
        torch.tensor([[0.0, -1.0, 0.0]]),
        target=torch.tensor([0.0, 0.0, 1.0]),
        distance=4.0,
        half_extent=1.2,
        size=32,
        orthographic=True,
    )
    flags = torch.zeros(1, 1, dtype=torch.bool)
    views = SourceViews(torch.full((1, 1, 4, 32, 32), 0.5), camera[None], ~flags, flags)
    hero = Hero(scene, views, None).symmetric()
    done = write_mesh(hero, "figure", tmp_path, MeshOptions(resolution=32, faces=400, smooth=3))
    lines = write_convergence(hero, "figure", tmp_path)
    text = (tmp_path / "figure_cameras.md").read_text()
    assert "one evaluation is exact" in text
    assert any("one evaluation is exact" in one for one in lines)
    assert done.meshes[0].is_file()
