"""Loose parts are joined where the field has matter between, left out where no drawing needs them, and else stay."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from charnerf.meshing.build import build_mesh, find_surface
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.lod import num_parts
from charnerf.meshing.loose import find_parts, join, without
from charnerf.meshing.optical_depth import SURFACE
from charnerf.meshing.options import MeshOptions
from charnerf.scene import Scene
from charnerf.surfaces.render import render_mesh
from charnerf.types import FieldOutput, SourceViews
from support import helpers
from support.analytic_scenes import capsule, figure, scene_of, with_field

OPTIONS = MeshOptions(resolution=64, height=None)
WRIST = ((0.42, 0.0, 1.45), (0.5, 0.0, 1.45))  # between them the left arm is thin


def scene(*, wrist: float = 1.0, ghost: bool = False) -> Scene:
    """The figure with so much of its density between its left arm and hand; and a blob before its chest that nobody drew."""
    whole = scene_of(figure)

    def field(points: torch.Tensor, view_dirs: torch.Tensor) -> FieldOutput:
        found = whole.field(points, view_dirs)
        between = (points[:, 0] > WRIST[0][0]) & (points[:, 0] < WRIST[1][0])
        densities = torch.where(between, wrist * found.densities, found.densities)
        if ghost:
            blob = capsule(points, (0.0, -0.6, 1.24), (0.0, -0.6, 1.26), 0.06) > 0
            densities = torch.where(blob, densities.amax(), densities)
        return replace(found, densities=densities)

    return with_field(whole, field)


@pytest.fixture(scope="module")
def drawings() -> SourceViews:
    """The whole figure as front, side and back drawing, from its own mesh."""
    cameras = helpers.source_cameras(size=128)
    mesh = build_mesh(scene(), None, OPTIONS).mesh
    pictures = torch.from_numpy(render_mesh(mesh, cameras)).movedim(-1, 1)[None].float()
    flags = torch.zeros(1, len(pictures[0]), dtype=torch.bool)
    return SourceViews(images=pictures, cameras=cameras[None], present=~flags, mirrored=flags)


def test_a_hand_is_joined_through_the_thin_wrist_and_nothing_else_changes(drawings):
    grid = GridSampler(scene(wrist=0.01), resolution=OPTIONS.resolution, num_cameras=1).evaluate_surface(
        SURFACE
    )
    parts = find_parts(grid, SURFACE, drawings)
    assert len(parts.needed) == 1 and not parts.unneeded
    after, joined = join(grid, parts, SURFACE)
    assert joined == 1 and num_labels(after, drawings) == 1
    x = grid.origin[0] + grid.spacing * np.argwhere(after.values != grid.values)[:, 0]
    assert len(x) > 0 and x.min() > WRIST[0][0] - 0.1 and x.max() < WRIST[1][0] + 0.1


def test_a_hand_drawn_apart_stays_apart(drawings):
    grid = GridSampler(scene(wrist=0.0), resolution=OPTIONS.resolution, num_cameras=1).evaluate_surface(
        SURFACE
    )
    parts = find_parts(grid, SURFACE, drawings)
    assert len(parts.needed) == 1 and join(grid, parts, SURFACE)[1] == 0
    assert without(grid, parts) is grid


def test_a_blob_that_no_drawing_shows_is_left_out_and_counted(drawings):
    """It lies before the chest, as seen from the front, and outside of what the side shows."""
    clean, haunted = (
        GridSampler(scene(ghost=one), resolution=OPTIONS.resolution, num_cameras=1).evaluate_surface(SURFACE)
        for one in (False, True)
    )
    parts = find_parts(haunted, SURFACE, drawings)
    assert not parts.needed and len(parts.unneeded) == 1
    meshes = [extract_surface(one, SURFACE).mesh for one in (clean, haunted, without(haunted, parts))]
    assert [num_parts(one) for one in meshes] == [1, 2, 1]
    np.testing.assert_allclose(
        meshes[2].vertices, meshes[0].vertices, atol=2e-3
    )  # the blob shades the chest behind it
    found = find_surface(scene(ghost=True), drawings, OPTIONS)
    assert found.num_unneeded == num_parts(found.extraction.mesh) == 1


def num_labels(grid, drawings: SourceViews) -> int:
    parts = find_parts(grid, SURFACE, drawings)
    return 1 + len(parts.needed) + len(parts.unneeded)
