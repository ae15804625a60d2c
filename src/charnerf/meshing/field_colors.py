"""Colours from the field, each seen straight on."""

from __future__ import annotations

import numpy as np
import torch
import trimesh

from charnerf.errors import NumericalError
from charnerf.scene import Scene
from charnerf.volume.marching import in_chunks, points_at_once


@torch.no_grad()
def field_colors(scene: Scene, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The field's colours of surface points, each seen straight on, along minus its normal.

    Args:
        scene: One character's field.
        points: (P, 3), m.
        normals: Outward, unit, (P, 3).

    Returns:
        (P, 3), float64 in [0, 1], sRGB-encoded as the images are.

    Raises:
        NumericalError: If the field answers NaN or infinity.
    """
    device = scene.bounds.box_min.device
    where = torch.tensor(np.asarray(points), dtype=torch.float32, device=device)
    outward = torch.tensor(np.asarray(normals), dtype=torch.float32, device=device)
    answer = in_chunks(scene.field, where, -outward, points_at_once(scene.field))
    rgb = answer.rgb.double().cpu().numpy()
    if not np.isfinite(rgb).all():
        raise NumericalError(
            f"colours: found {int((~np.isfinite(rgb)).sum())} of {rgb.size} values not finite, "
            "expected colours in [0, 1]. "
            "The weights are broken: load another checkpoint."
        )
    return rgb.clip(0.0, 1.0)


def color_vertices(scene: Scene, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
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
    rgba = np.full((len(mesh.vertices), 4), 255, np.uint8)
    rgba[:, :3] = np.round(255.0 * field_colors(scene, mesh.vertices, mesh.vertex_normals))
    colored = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    colored.visual = trimesh.visual.ColorVisuals(colored, vertex_colors=rgba)
    return colored
