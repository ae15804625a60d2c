"""Small surfaces: plain triangles and a textured square."""

import numpy as np
import trimesh
from PIL import Image

from charnerf.surfaces.surface_mesh import SurfaceMaterial, SurfaceMesh


def plain_mesh(triangles, factor=(1.0, 1.0, 1.0, 1.0), cutoff=None):
    triangles = np.asarray(triangles, np.float32)
    return SurfaceMesh(
        triangles=triangles,
        uvs=np.zeros((len(triangles), 3, 2), np.float32),
        colors=np.ones((len(triangles), 3, 4), np.float32),
        material_ids=np.zeros(len(triangles), np.int32),
        materials=(SurfaceMaterial(np.array(factor, np.float32), cutoff=cutoff),),
    )


def textured_quad(pixels, **material):
    quad = trimesh.Trimesh(
        vertices=[[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], faces=[[0, 1, 2], [0, 2, 3]], process=False
    )
    pbr = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(pixels), **material)
    quad.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=pbr)
    return quad


def boxes_surface(boxes: list[tuple[tuple[float, ...], tuple[float, ...]]], *, cuts: int = 4) -> SurfaceMesh:
    """Boxes by their lower and upper corners, m, each face cut into finer triangles."""
    meshes = []
    for low, high in boxes:
        box = trimesh.creation.box(bounds=np.array((low, high)))
        for _ in range(cuts):
            box = box.subdivide()
        meshes.append(np.asarray(box.triangles))
    return plain_mesh(np.concatenate(meshes))
