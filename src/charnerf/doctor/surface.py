"""The mesh against the silhouettes: what is sampled for surface points has to be what the pictures show."""

from collections.abc import Iterator

import numpy as np
import torch
from scipy import ndimage

from charnerf.doctor.finding import Finding
from charnerf.doctor.views import Patient, Seen
from charnerf.errors import DataError
from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.carving import INSIDE
from charnerf.surfaces.mesh_files import load_surface_mesh

POINTS = 4000
INSIDE_SHARE = 0.97  # of points that lie in silhouettes widened by WIDER pixels, in every view
WIDER = 3
AGAIN = "charnerf capture MESH -o DATASET --split SPLIT"


def mesh_findings(patient: Patient, sight: Seen | None) -> Iterator[Finding]:
    """What is wrong with a character's mesh."""
    if patient.mesh_file is None:
        return
    try:
        triangles = load_surface_mesh(patient.mesh_file).triangles
    except DataError as error:
        yield Finding(
            "broken mesh", str(patient.mesh_file), str(error), "a mesh that opens", "Capture it again.", AGAIN
        )
        return
    if sight is None:
        return
    points = torch.from_numpy(_points(np.asarray(triangles, dtype=np.float64)))
    if len(points) == 0:
        yield Finding(
            "broken mesh",
            str(patient.mesh_file),
            "triangles of no area",
            "a surface",
            "Capture it again.",
            AGAIN,
        )
        return
    share = _shares(points, sight)
    view = int(share.argmin())
    if float(share[view]) >= INSIDE_SHARE:
        return
    turned = points[:, [0, 2, 1]] * points.new_tensor((1.0, -1.0, 1.0))
    hint = ""
    if float(_shares(turned, sight).min()) >= INSIDE_SHARE:
        hint = ", and all of it turned from +Y up to +Z up"
    yield Finding(
        "misaligned mesh", str(patient.mesh_file),
        f"{100 * float(share[view]):.0f} % of its surface within the silhouette of {sight.views[view].name}{hint}",
        f"{100 * INSIDE_SHARE:.0f} % or more in every view", "Bring mesh and cameras into one frame.", AGAIN,
        picture=_drawn(points, sight, view),
    )  # fmt: skip


def _points(triangles: np.ndarray) -> np.ndarray:
    """Points (P, 3) spread over triangles (F, 3, 3) by area, the same each time; none where there is no area."""
    rng = np.random.default_rng(0)
    edges = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
    if not areas.sum() > 0.0:
        return np.zeros((0, 3))
    chosen = rng.choice(len(triangles), POINTS, p=areas / areas.sum())
    u, v = rng.random((2, POINTS, 1))
    outside = u + v > 1.0
    u, v = np.where(outside, 1.0 - u, u), np.where(outside, 1.0 - v, v)
    return triangles[chosen, 0] + u * edges[chosen, 0] + v * edges[chosen, 1]


def _shares(points: torch.Tensor, sight: Seen) -> torch.Tensor:
    """Share of points (P, 3) that each silhouette, widened, covers, (N,)."""
    pixels, _, in_front = project_into_all(sight.cameras, points)
    shares = []
    for view, alpha in enumerate(sight.alphas):
        wide = torch.from_numpy(ndimage.binary_dilation((alpha > INSIDE).numpy(), iterations=WIDER))
        height, width = wide.shape
        x, y = pixels[:, view].floor().long().unbind(-1)
        framed = in_front[:, view] & (x >= 0) & (x < width) & (y >= 0) & (y < height)
        shares.append((framed & wide[y.clamp(0, height - 1), x.clamp(0, width - 1)]).double().mean())
    return torch.stack(shares)


def _drawn(points: torch.Tensor, sight: Seen, view: int) -> np.ndarray:
    """A picture with the mesh's points in red."""
    rgb = sight.rgb[view].copy()
    pixels = project_into_all(sight.cameras[view : view + 1], points)[0][:, 0].floor().long().numpy()
    held = ((pixels >= 0) & (pixels < rgb.shape[0])).all(-1)
    rgb[pixels[held, 1], pixels[held, 0]] = (220, 30, 30)
    return rgb
