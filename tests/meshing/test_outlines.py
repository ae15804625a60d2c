"""Surfaces that would miss parts of the drawings' outlines are completed there, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from charnerf.meshing.build import build_mesh
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.optical_depth import SURFACE
from charnerf.meshing.options import MeshOptions
from charnerf.meshing.outlines import ABOVE, covering, gain_at, raised_rays
from charnerf.scene import Scene
from charnerf.surfaces.render import render_mesh
from charnerf.types import FieldOutput, SourceViews
from support import helpers
from support.analytic_scenes import capsule, figure, scene_of, with_field

HAZE = 1.5  # 1/m


def scene(hazy: float | None = None) -> Scene:
    """The figure, its left forearm (x > 0.4) replaced by haze 40 cm deep of so many 1/m, densest in its middle."""
    whole = scene_of(figure)

    def field(points: torch.Tensor, view_dirs: torch.Tensor) -> FieldOutput:
        found = whole.field(points, view_dirs)
        if hazy is None:
            return found
        spread = points * points.new_tensor((1.0, 0.25, 1.0))
        haze = capsule(spread, (0.3, 0, 1.45), (0.75, 0, 1.45), 0.09) > 0
        depth = hazy * (1.0 - points[:, 1].abs())
        return replace(found, densities=torch.where(points[:, 0] > 0.4, haze * depth, found.densities))

    return with_field(whole, field)


@pytest.fixture(scope="module")
def drawings() -> SourceViews:
    """The whole figure as front, side and back drawing, from its own mesh."""
    cameras = helpers.source_cameras(size=128)
    mesh = build_mesh(scene(), None, MeshOptions(resolution=96, height=None)).mesh
    pictures = torch.from_numpy(render_mesh(mesh, cameras)).movedim(-1, 1)[None].float()
    flags = torch.zeros(1, len(pictures[0]), dtype=torch.bool)
    return SourceViews(images=pictures, cameras=cameras[None], present=~flags, mirrored=flags)


def covered(mesh, drawings: SourceViews) -> float:
    """Share of the front drawing's figure that the mesh covers."""
    found = torch.from_numpy(render_mesh(mesh, drawings.cameras[0])[0][..., 3]) > 0.5
    mask = drawings.images[0, 0, 3] > 0.5
    return float((found & mask).sum() / mask.sum())


def test_a_hazy_arm_is_part_of_the_mesh_and_lies_where_it_is_densest(drawings):
    hazy = scene(hazy=HAZE)
    without = build_mesh(hazy, None, MeshOptions(resolution=96, height=None))
    built = build_mesh(hazy, drawings, MeshOptions(resolution=96, height=None))
    assert covered(without.mesh, drawings) < 0.92
    assert covered(built.mesh, drawings) > 0.96
    assert 0.04 < built.missed < 0.2 and without.missed == 0.0
    forearm = built.mesh.vertices[built.mesh.vertices[:, 0] > 0.5]
    assert len(forearm) > 100
    assert abs(forearm[:, 1].mean()) < 0.03 and abs(forearm[:, 1]).max() < 0.33  # not all of the haze


def test_only_missed_rays_are_raised_to_just_above_the_surface(drawings):
    grid = GridSampler(scene(hazy=HAZE), resolution=96, num_cameras=1).evaluate_surface(SURFACE)
    raised = raised_rays(grid, drawings, SURFACE)
    missed = [one.num_missed / one.num_pixels for one in raised]
    assert min(missed[0], missed[2]) > 0.05 > 2.0 * missed[1]  # from the side the body lies behind
    arm, elsewhere = (
        torch.tensor(((0.6, 0.0, 1.45),)),
        torch.tensor(((-0.6, 0.0, 1.45), (0.0, 0.0, 1.2), (1.2, 0.0, 1.9))),
    )
    deepest = float(grid.interpolator(SURFACE)(arm))
    needed = ABOVE * SURFACE / deepest
    assert needed <= float(gain_at(raised, arm)) < 1.5 * needed  # as the largest around needs
    assert torch.equal(gain_at(raised, elsewhere), torch.ones(3))
    at = np.argwhere(grid.values > 0.0)
    points = torch.from_numpy(grid.origin + at * grid.spacing).float()
    gains, here = gain_at(raised, points).numpy(), tuple(at.T)
    after, share = covering(grid, drawings, SURFACE)
    np.testing.assert_allclose(after.values[here], grid.values[here] * gains, rtol=1e-5)
    np.testing.assert_array_equal(after.values == 0.0, grid.values == 0.0)
    assert share == sum(one.num_missed for one in raised) / sum(one.num_pixels for one in raised)


def test_a_surface_that_covers_its_drawings_stays_as_it_is(drawings):
    """But for the rim, where a pixel's middle may pass the surface by a hair."""
    whole = scene()
    with_drawings = build_mesh(whole, drawings, MeshOptions(resolution=64, height=None))
    without = build_mesh(whole, None, MeshOptions(resolution=64, height=None))
    assert with_drawings.missed < 0.03
    assert abs(with_drawings.mesh.volume / without.mesh.volume - 1.0) < 0.02


def test_what_the_field_does_not_know_of_is_not_made_up(drawings):
    """A drawing of two arms over a field with one: where there is no density, none is multiplied into a surface."""
    empty = scene(hazy=0.0)
    built = build_mesh(empty, drawings, MeshOptions(resolution=64, height=None))
    assert built.mesh.bounds[1, 0] < 0.45
    nothing = replace(drawings, images=torch.zeros_like(drawings.images))
    assert build_mesh(empty, nothing, MeshOptions(resolution=64, height=None)).missed == 0.0
