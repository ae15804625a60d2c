"""Vertex colours from the field, each seen straight on."""

from __future__ import annotations

import numpy as np
import torch
import trimesh

from charnerf.errors import NumericalError
from charnerf.meshing.density_grid import CHUNK
from charnerf.types import Scene


@torch.no_grad()
def colour_vertices(scene: Scene, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Colour the vertices of a mesh by the field, looking at each along minus its normal.

    Args:
        scene: One character's field.
        mesh: Surface in the world frame, normals outward.

    Returns:
        A copy with vertex colours: uint8 RGBA, sRGB-encoded as the images are. (`save_mesh` makes them
        linear where the format wants that.)

    Raises:
        NumericalError: If the field answers NaN or infinity.
    """
    device = scene.box_min.device
    points = torch.tensor(np.asarray(mesh.vertices), dtype=torch.float32, device=device)
    normals = torch.tensor(np.asarray(mesh.vertex_normals), dtype=torch.float32, device=device)
    parts = zip(points.split(CHUNK), normals.split(CHUNK), strict=True)
    rgb = torch.cat([scene.field(here, -normal).rgb for here, normal in parts]).double().cpu().numpy()
    if not np.isfinite(rgb).all():
        raise NumericalError(
            f"vertex colours: found {int((~np.isfinite(rgb)).sum())} of {rgb.size} values not finite, "
            "expected colours in [0, 1]. "
            "The weights are broken: load another checkpoint."
        )
    rgba = np.full((len(rgb), 4), 255, np.uint8)
    rgba[:, :3] = np.round(255.0 * rgb.clip(0.0, 1.0))
    coloured = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    coloured.visual = trimesh.visual.ColorVisuals(coloured, vertex_colors=rgba)
    return coloured
