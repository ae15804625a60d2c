"""Base-colour textures: a UV atlas whose texels are coloured by the drawings or by the field.

Letters: K texels that show surface, P vertices, S texels a side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image
from scipy import ndimage
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import spsolve

from charnerf.meshing.atlas import Atlas, Texels, rasterise, unwrap
from charnerf.meshing.field_colors import field_colors
from charnerf.meshing.projection import Projector
from charnerf.scene import Scene
from charnerf.types import SourceViews

ENOUGH = 0.1  # trust from which the drawings decide alone
FADE = 0.08  # metres over which the field's colours are matched to the drawings' beside them
MATERIAL = "character"


@dataclass(frozen=True)
class Textured:
    """A textured mesh, and how it came about.

    Attributes:
        mesh: The same surface, its vertices split at seams, normals those of the surface before.
        size: S.
        num_texels: K.
        num_from_field: Texels that the field was evaluated for; the others were left out.
    """

    mesh: trimesh.Trimesh
    size: int
    num_texels: int
    num_from_field: int


def texture_mesh(scene: Scene, mesh: trimesh.Trimesh, drawings: SourceViews | None, *, size: int) -> Textured:
    """Give a mesh a base-colour texture; neither its surface nor its normals change.

    Args:
        scene: One character's field.
        mesh: Its surface, in the field's frame, normals outward.
        drawings: B = 1, of any resolution: a texel has their color, or the field's where none sees it; None: the field's.
        size: S.

    Raises:
        DataError: If the size is out of range or there are too many faces to unwrap.
        NumericalError: If the field answers NaN or infinity.
    """
    atlas = unwrap(mesh, size)
    texels = rasterise(atlas, size)
    points, normals = _spread(mesh.vertices, mesh, texels), _spread(mesh.vertex_normals, mesh, texels)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    if drawings is None:
        rgb, num_from_field = field_colors(scene, points, normals), len(points)
    else:
        rgb, num_from_field = _drawn_colors(scene, mesh, drawings, points, normals, texels)
    picture = Image.fromarray(padded_picture(rgb, texels, size))
    return Textured(textured_copy(mesh, atlas, picture), size, len(points), num_from_field)


def _spread(values: np.ndarray, mesh: trimesh.Trimesh, texels: Texels) -> np.ndarray:
    """Values of vertices (P, 3) interpolated to texels (K, 3)."""
    corners = np.asarray(mesh.faces)[texels.face]
    values = np.asarray(values)
    return sum(texels.weights[:, k, None] * values[corners[:, k]] for k in range(3))


def _drawn_colors(
    scene: Scene,
    mesh: trimesh.Trimesh,
    views: SourceViews,
    points: np.ndarray,
    normals: np.ndarray,
    texels: Texels,
) -> tuple[np.ndarray, int]:
    """Colours (K, 3) by the drawings, by the field where these do not decide, and how often that was."""
    projector = Projector(views, mesh)
    drawn = projector.at(points, normals, texels.face)
    unsure = np.flatnonzero(drawn.trust < ENOUGH)
    rgb = drawn.rgb
    if len(unsure):
        offsets = _spread(_matching_offsets(scene, mesh, projector), mesh, texels)
        guessed = field_colors(scene, points[unsure], normals[unsure]) + offsets[unsure]
        share = (drawn.trust[unsure] / ENOUGH)[:, None]
        rgb[unsure] = share * rgb[unsure] + (1.0 - share) * guessed.clip(0.0, 1.0)
    return rgb, len(unsure)


def _matching_offsets(scene: Scene, mesh: trimesh.Trimesh, projector: Projector) -> np.ndarray:
    """What is added to the field's colours at vertices, (P, 3), so that they meet the drawings' at seams.

    Where the drawings decide it is the difference of the two; from there it fades over FADE along the
    surface, as the solution of a screened Laplace equation.
    """
    vertices, normals = np.asarray(mesh.vertices), np.asarray(mesh.vertex_normals)
    some_face = np.zeros(len(vertices), np.int64)
    some_face[np.asarray(mesh.faces)] = np.arange(len(mesh.faces))[:, None]
    drawn = projector.at(vertices, normals, some_face)
    decided = drawn.trust >= ENOUGH
    offsets = np.zeros((len(vertices), 3))
    if not decided.any() or decided.all():
        return offsets
    offsets[decided] = drawn.smooth[decided] - field_colors(scene, vertices[decided], normals[decided])
    return _faded(mesh, offsets, decided)


def _faded(mesh: trimesh.Trimesh, values: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Values (P, 3) continued from fixed vertices to the others, fading over FADE."""
    edges = np.asarray(mesh.edges_unique)
    lengths = np.asarray(mesh.edges_unique_length)
    shortest = 0.05 * lengths.mean()
    weights = 1.0 / np.maximum(lengths, shortest)
    ends = np.concatenate((edges, edges[:, ::-1]))
    count = len(mesh.vertices)
    links = coo_array((np.concatenate((weights, weights)), (ends[:, 0], ends[:, 1])), (count, count)).tocsr()
    degree = np.asarray(links.sum(axis=1)).ravel()
    # in one dimension: value'' = value / FADE^2, each edge standing for a piece as long as itself
    spread = np.zeros(count)
    np.add.at(spread, ends[:, 0], np.concatenate((lengths, lengths)) / 2.0)
    spread = np.maximum(spread, shortest)  # a loose part of no size would make the system singular
    system = diags_array(degree + spread / FADE**2) - links
    free = np.flatnonzero(~fixed)
    matrix = system.tocsr()[free]
    right = -matrix[:, np.flatnonzero(fixed)] @ values[fixed]
    result = values.copy()
    result[free] = spsolve(matrix[:, free].tocsc(), right).reshape(-1, 3)
    return result


def padded_picture(rgb: np.ndarray, texels: Texels, size: int) -> np.ndarray:
    """Texture (S, S, 3) uint8 of colours (K, 3): texels between the charts take the nearest chart's colour."""
    picture, filled = np.zeros((size * size, 3), np.uint8), np.zeros(size * size, bool)
    picture[texels.index] = np.round(255.0 * rgb.clip(0.0, 1.0))
    filled[texels.index] = True
    if not filled.any():
        return picture.reshape(size, size, 3)
    nearest = ndimage.distance_transform_edt(
        ~filled.reshape(size, size), return_distances=False, return_indices=True
    )
    return picture.reshape(size, size, 3)[tuple(nearest)]


def textured_copy(mesh: trimesh.Trimesh, atlas: Atlas, picture: Image.Image) -> trimesh.Trimesh:
    """The mesh with split vertices, its own normals, and a rough, non-metallic material of the picture."""
    material = trimesh.visual.material.PBRMaterial(
        name=MATERIAL, baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=1.0
    )
    return trimesh.Trimesh(
        vertices=np.asarray(mesh.vertices)[atlas.vertex_of],
        faces=atlas.faces,
        vertex_normals=np.asarray(mesh.vertex_normals)[atlas.vertex_of],
        visual=trimesh.visual.TextureVisuals(uv=atlas.uv, material=material),
        process=False,
    )
