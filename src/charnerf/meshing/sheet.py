"""The contact sheet: the drawings, and the mesh from all sides in its colours and as clay."""

import numpy as np
import torch
import trimesh
from PIL import Image, ImageDraw, ImageFont

from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.pictures import on_white, to_bytes
from charnerf.surfaces.render import render_clay, render_mesh
from charnerf.types import Cameras, SourceViews

SIDES = 8
PANEL = 160  # pixels a side
CAPTION = 18
ELEVATION_DEG = 10.0
INK = (60, 60, 60)


def contact_sheet(mesh: trimesh.Trimesh, views: SourceViews) -> Image.Image:
    """Draw a mesh beside its drawings.

    Args:
        mesh: World frame, coloured.
        views: The drawings, B = 1; absent and mirrored ones are left out.
    """
    cameras = around(mesh)
    used = (views.present & ~views.mirrored)[0]
    drawings = views.images[0][used].cpu().movedim(1, -1).numpy()
    azimuths = [f"{360.0 * k / SIDES:.0f}°" for k in range(SIDES)]
    rows = [
        (["drawings", *[""] * (len(drawings) - 1)], drawings),
        (azimuths, render_mesh(mesh, cameras)),
        (azimuths, render_clay(mesh, cameras)),
    ]
    sheet = Image.new("RGB", (SIDES * PANEL, len(rows) * (PANEL + CAPTION)), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(12)
    for row, (labels, pictures) in enumerate(rows):
        top = row * (PANEL + CAPTION)
        for column, (label, picture) in enumerate(zip(labels, pictures, strict=True)):
            pen.text((column * PANEL + 4, top + 2), label, INK, font)
            panel = Image.fromarray(to_bytes(on_white(picture))).resize(
                (PANEL, PANEL), Image.Resampling.LANCZOS
            )
            sheet.paste(panel, (column * PANEL, top + CAPTION))
    return sheet


def around(mesh: trimesh.Trimesh, size: int = PANEL) -> Cameras:
    """Pinhole cameras (SIDES,) that frame a standing mesh, the first one before it."""
    low, high = np.asarray(mesh.bounds)
    target = np.array((0.0, 0.0, 0.5 * (low[2] + high[2])))
    radius = 1.03 * float(np.linalg.norm(np.asarray(mesh.vertices) - target, axis=1).max())
    azimuths = torch.arange(SIDES, dtype=torch.float64) * (360.0 / SIDES)
    return cameras_towards(
        direction_from_angles(azimuths, torch.full_like(azimuths, ELEVATION_DEG)),
        target=torch.from_numpy(target),
        distance=4.0 * radius,
        half_extent=radius,
        size=size,
        orthographic=False,
    )
