"""What remembering alone would give: the training character whose silhouettes fit best, in the drawings' colours.

A model that only looked up its training set could not do better; what lies between this and the model is
reconstructed. Letters: T training characters, V views.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
import torch
import trimesh
from scipy.ndimage import distance_transform_edt
from torch import Tensor

from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.evaluation.baselines import used_drawings
from charnerf.evaluation.projected import ProjectedMesh, look_up
from charnerf.geometry.cameras import project
from charnerf.geometry.world import BOX_HALF_EXTENT, CENTRE
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.types import Cameras, RenderOutput, SourceViews

NO_TRAINING_SET = "no training characters were named; name them with --nearest-from"
NO_MATCH = "no training character has a mesh and was drawn from the same views"
_GRID = 128
"""Side of the masks that are compared: pixels of 2.8 cm, whatever each character's own pictures frame."""
_POPCOUNT = np.array([value.bit_count() for value in range(256)], dtype=np.uint8)


@dataclass(frozen=True)
class Nearest:
    """The answer to one character.

    Attributes:
        name: The training character.
        iou: Mean IoU of its source silhouettes with those of the drawings, world frame.
        mesh: Its surface.
    """

    name: str
    iou: float
    mesh: trimesh.Trimesh


@final
class TrainingCharacters:
    """The silhouettes of training characters, packed for comparing: 6 KB each.

    Args:
        splits: Data sets' folders with one of their splits each; characters without a mesh are passed over.

    Raises:
        DataError: If a data set or split is not there.
    """

    def __init__(self, splits: Sequence[tuple[Path, str]]) -> None:
        self._folders: list[Path] = []
        packed: dict[tuple[str, ...], list[np.ndarray]] = {}
        members: dict[tuple[str, ...], list[int]] = {}
        for root, split in splits:
            for name in names_of(read_dataset(root), split):
                character = load_character(root, name)
                if character.mesh_file is None:
                    continue
                members.setdefault(character.source_names, []).append(len(self._folders))
                packed.setdefault(character.source_names, []).append(_packed_masks(character.sources))
                self._folders.append(character.folder)
        self._masks = {names: np.stack(masks) for names, masks in packed.items()}
        self._members = members

    def __len__(self) -> int:
        """Number of characters."""
        return len(self._folders)

    def overlaps(self, character: Character) -> dict[Path, float]:
        """Mean IoU of the source silhouettes by training character's folder; of those drawn from the same views.

        The character itself, where it is among them, does not count.
        """
        masks = self._masks.get(character.source_names)
        if masks is None:
            return {}
        own = _packed_masks(character.sources)
        common = _POPCOUNT[masks & own].sum(axis=-1, dtype=np.int64)
        either = _POPCOUNT[masks | own].sum(axis=-1, dtype=np.int64)
        overlaps = (common / np.maximum(either, 1)).mean(axis=-1)
        folders = [self._folders[index] for index in self._members[character.source_names]]
        itself = character.folder.resolve()
        return {
            folder: float(iou)
            for folder, iou in zip(folders, overlaps, strict=True)
            if folder.resolve() != itself
        }

    def nearest(self, character: Character) -> Nearest | None:
        """The training character that fits best; None where none was drawn from the same views."""
        overlaps = self.overlaps(character)
        if not overlaps:
            return None
        folder = max(overlaps, key=lambda one: overlaps[one])
        mesh_file = load_character(folder.parent, folder.name).mesh_file
        assert mesh_file is not None
        triangles = load_surface_mesh(mesh_file).triangles
        mesh = trimesh.Trimesh(
            triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), process=False
        )
        return Nearest(name=folder.name, iou=overlaps[folder], mesh=mesh)


@final
class NearestBaseline:
    """A training character's surface in the colours of another character's drawings.

    Where a surface point falls beside the drawn figure it takes the colour of the nearest point of the figure.
    Parts that a material cuts out by alpha are drawn whole.

    Args:
        nearest: The training character.
        sources: The drawings, B = 1; absent and mirrored views are not used.
    """

    def __init__(self, nearest: Nearest, sources: SourceViews) -> None:
        cameras, images = used_drawings(sources)
        self._projected = ProjectedMesh(np.asarray(nearest.mesh.triangles), cameras, filled_drawings(images))

    def render(self, camera: Cameras) -> RenderOutput:
        """Picture of a camera of shape (): fields (H, W), on white."""
        return self._projected.render(camera)


def filled_drawings(images: Tensor) -> Tensor:
    """Opaque drawings (V, 4, H, W): each pixel beside the figure in the colour of the figure's nearest pixel."""
    filled = []
    for image in images:
        inside = (image[3] > 0.5).numpy()
        if not inside.any():
            filled.append(torch.ones_like(image))
            continue
        rows, columns = distance_transform_edt(~inside, return_distances=False, return_indices=True)
        rgb = image[:3, torch.from_numpy(rows), torch.from_numpy(columns)]
        filled.append(torch.cat((rgb, torch.ones_like(image[3:]))))
    return torch.stack(filled)


def _packed_masks(sources: SourceViews) -> np.ndarray:
    """Bits of the silhouettes in the world frame, uint8 (V, _GRID**2 / 8).

    Each view is sampled on the plane through the character's middle that faces its camera.
    """
    steps = (torch.arange(_GRID) + 0.5) / _GRID * 2.0 - 1.0
    up, across = torch.meshgrid(BOX_HALF_EXTENT * steps, BOX_HALF_EXTENT * steps, indexing="ij")
    offsets = torch.stack((across, up), dim=-1).reshape(-1, 2)
    rows = []
    for view in range(sources.images.shape[1]):
        camera = sources.cameras[0, view].to("cpu", torch.float32)
        axes = camera.world_from_camera[:3, :2]
        pixels, _, _ = project(camera, torch.tensor(CENTRE) + offsets @ axes.T)
        alpha = look_up(sources.images[0, view, 3:], pixels)[:, 0]
        size = pixels.new_tensor((camera.width, camera.height))
        framed = ((pixels >= 0.0) & (pixels <= size)).all(dim=-1)
        rows.append(np.packbits(((alpha > 0.5) & framed).numpy()))
    return np.stack(rows)
