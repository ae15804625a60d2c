"""The contact sheet of a mesh."""

import torch
import trimesh
from PIL import Image

from charnerf.geometry.framing import source_cameras
from charnerf.meshing.sheet import around, contact_sheet
from charnerf.surfaces.render import render_mesh
from charnerf.types import SourceViews


def test_the_sheet_frames_the_mesh_from_eight_sides():
    flags = torch.zeros(1, 3, dtype=torch.bool)
    views = SourceViews(torch.ones(1, 3, 4, 32, 32), source_cameras(radius=2.0, size=32)[None], ~flags, flags)
    mesh = trimesh.creation.box(bounds=[(-0.5, -0.5, 0.0), (0.5, 0.5, 2.0)])
    assert isinstance(contact_sheet(mesh, views), Image.Image)
    alphas = render_mesh(mesh, around(mesh, 48))[..., 3]
    assert len(alphas) == 8
    assert not alphas[:, [0, -1]].any() and not alphas[:, :, [0, -1]].any()
    assert alphas.mean() > 0.1
