"""Characters in memory, opened when first asked for, within a memory bound."""

import logging
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import final

import torch
from torch import Tensor

from charnerf.data.characters import Character, load_character
from charnerf.data.layout import MESH_FILE
from charnerf.data.shards import is_cache, read_index_once
from charnerf.data.space import AbstractSpace
from charnerf.data.surface import AbstractSurface
from charnerf.errors import DataError
from charnerf.geometry.silhouettes import hull_silhouettes
from charnerf.types import Hull, SourceViews

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class OpenCharacter:
    """A character's pictures in memory.

    Attributes:
        character: The files.
        images: uint8 (N, H, W, 4).
        hull: Hull of its drawings (B = 1), None for a model without.
        foreground: Flat indices into (N, H, W) of pixels that show the character, int32.
        background: Those of the other pixels whose rays may meet the hull, int32: of the rest there is nothing to learn.
        surface: What surface points are drawn from, None where nothing reads them or there is no mesh.
        space: What labelled points are drawn from, None where nothing reads them.
    """

    character: Character
    images: Tensor
    hull: Hull | None
    foreground: Tensor
    background: Tensor
    surface: AbstractSurface | None
    space: AbstractSpace | None

    @property
    def size_bytes(self) -> int:
        """Memory of the tensors."""
        hull = 0 if self.hull is None else self.hull.occupancy.numel() + 8 * self.hull.front_depths.numel()
        drawn_from = sum(one.size_bytes for one in (self.surface, self.space) if one is not None)
        return (
            self.images.numel() + 4 * (self.foreground.numel() + self.background.numel()) + hull + drawn_from
        )


SurfaceOf = Callable[[Character], AbstractSurface | None]
SpaceOf = Callable[[Character, Tensor, Hull | None], AbstractSpace | None]


def no_surface(character: Character) -> None:
    """Of no character: where nothing reads surface points."""


def no_space(character: Character, images: Tensor, hull: Hull | None) -> None:
    """Of no character: where nothing reads labelled points."""


@final
class CharacterStore:
    """Least recently used characters are dropped when the bound is reached.

    Args:
        root: Data set.
        names: Characters.
        carve: Makes the hull of drawings (the model's `carve`).
        memory_mib: Bound, MiB; at least one character is always kept.
        surface_of: Makes a character's surface.
        space_of: Makes what labelled points are drawn from, of a character's files, pictures and hull.
    """

    def __init__(
        self,
        *,
        root: Path,
        names: Sequence[str],
        carve: Callable[[SourceViews], Hull | None],
        memory_mib: float,
        surface_of: SurfaceOf = no_surface,
        space_of: SpaceOf = no_space,
    ) -> None:
        self.root = root
        self.names = tuple(names)
        self.carve = carve
        self.memory_bytes = memory_mib * 2**20
        self.surface_of = surface_of
        self.space_of = space_of
        self._open: OrderedDict[str, OpenCharacter] = OrderedDict()
        self._used_bytes = 0
        self._seconds = 0.0
        self._has_warned = False

    def __len__(self) -> int:
        """Number of characters."""
        return len(self.names)

    def has_mesh(self, name: str) -> bool:
        """Whether a character has a mesh, without opening it."""
        if is_cache(self.root):
            return name in read_index_once(self.root).with_mesh
        return (self.root / name / MESH_FILE).is_file()

    def open(self, name: str) -> OpenCharacter:
        """Return a character, from memory if it is there."""
        held = self._open.get(name)
        if held is not None:
            self._open.move_to_end(name)
            return held
        start = perf_counter()
        character = load_character(self.root, name)
        images = character.images(range(len(character.image_files)))
        try:
            hull = self.carve(character.sources)
        except DataError as err:
            raise DataError(f"{self.root / name}: {err}") from err
        shown = images[..., 3] > 0
        foreground = shown.reshape(-1).nonzero()[:, 0].to(torch.int32)
        near = ~shown if hull is None else hull_silhouettes(hull[0], character.cameras) & ~shown
        background = near.reshape(-1).nonzero()[:, 0].to(torch.int32)
        surface, space = self.surface_of(character), self.space_of(character, images, hull)
        opened = OpenCharacter(character, images, hull, foreground, background, surface, space)
        self._seconds += perf_counter() - start
        self._open[name] = opened
        self._used_bytes += opened.size_bytes
        if self._used_bytes > self.memory_bytes and not self._has_warned:
            self._warn_of_reopening()
        while self._used_bytes > self.memory_bytes and len(self._open) > 1:
            _, dropped = self._open.popitem(last=False)
            self._used_bytes -= dropped.size_bytes
        return opened

    def _warn_of_reopening(self) -> None:
        """Warn once, when the first is about to be dropped, that characters are opened again and again, and what that costs."""
        self._has_warned = True
        opened, wanted = len(self._open), len(set(self.names))
        needed = self._used_bytes / opened * wanted / 2**20
        log.warning(
            "batches.memory_mib=%.0f holds about %d of %d characters; the others are opened anew at each turn, %.2f s each. "
            "batches.memory_mib=%.0f would hold all; batches.window=%d draws from as many as fit, exchanged one by one;"
            " batches.workers=1 opens them beside the training.",
            self.memory_bytes / 2**20, max(opened - 1, 1), wanted, self._seconds / opened, 1.05 * needed, max(opened - 2, 1),
        )  # fmt: skip
