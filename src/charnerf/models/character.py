"""One of the model's fields for one character."""

from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from charnerf.geometry.cameras import pixel_lattice
from charnerf.models.coloring import DrawnColoring
from charnerf.models.density.base import TrunkOutput
from charnerf.models.field import Field
from charnerf.models.inputs import FieldInputs, PointViews
from charnerf.models.view_maps import Pictures, ViewMaps
from charnerf.scene import AbstractField, DensityOutput
from charnerf.types import FieldOutput, TensorRecord

UNSEEN_SCORE = -30.0  # of a view that does not see a point, where scores are interpolated: a share of 1e-13
BYTES_PER_FEATURE = 64  # of a view and a point, gradient kept: some 16 tensors of float32; measured, generous


@dataclass(frozen=True)
class PendingColors(TensorRecord):
    """What colours of points (P) are made of, once their densities are there."""

    trunk: TrunkOutput
    views: PointViews
    view_dirs: Tensor


@final
@dataclass(frozen=True)
class CharacterField(AbstractField):
    """A field of the model with the maps of a character's views.

    Attributes:
        field: The coarse or the fine field.
        maps: What the character's views show.
        latents: Rows of the feature maps, through the field's linear layer.
        detailed: The views on white with more pixels, (V, 3, H, W), or None.
        pictures: What the head's colours are read from instead of `maps`, or None.
    """

    field: Field
    maps: ViewMaps
    latents: Tensor
    detailed: Tensor | None
    pictures: Pictures | None = None

    @property
    def sees_directions(self) -> bool:
        """Whether densities depend on the query direction."""
        return self.field.density.sees_directions

    @property
    def bytes_per_point(self) -> int:
        """By the number of views and the features' width."""
        return BYTES_PER_FEATURE * len(self.maps.mirrored) * self.field.from_latents.out_features

    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """Colours (P, 3) and densities (P,)."""
        inputs = self.read(points)
        trunk = self.field.trunk(inputs, view_dirs)
        rgb = self.field.colors(trunk, self._sharpened(inputs.views), view_dirs)
        return FieldOutput(rgb=rgb, densities=self.field.densities(trunk, inputs.kept))

    def densities(self, points: Tensor, view_dirs: Tensor) -> DensityOutput:
        """Densities (P,); what the trunk alone reads is not kept for the colours."""
        inputs = self.read(points)
        trunk = self.field.trunk(inputs, view_dirs)
        pending = PendingColors(trunk, inputs.views, view_dirs)
        return DensityOutput(self.field.densities(trunk, inputs.kept), pending)

    def colors(self, state: PendingColors) -> Tensor:
        """Colours (Q, 3)."""
        return self.field.colors(state.trunk, self._sharpened(state.views), state.view_dirs)

    def lattice(self, low: Tensor, high: Tensor) -> tuple[Tensor, float]:
        """The drawings' pixels, where all that is read of them bends; feature maps bend in the middle between two."""
        return pixel_lattice(self.maps.cameras) or super().lattice(low, high)

    def uncut_densities(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Densities (P,) before the drawings' coverage cuts them, and the share of them that it leaves, above 1 all."""
        inputs = self.read(points)
        trunk = self.field.trunk(inputs, torch.zeros_like(points))
        return self.field.densities(trunk, torch.ones_like(inputs.kept)), inputs.kept

    def appearance(self, points: Tensor, view_dirs: Tensor) -> Tensor:
        """What the head makes colours of, (P, K, C), of points (P, 3) seen along (K, 3): the trunk is asked once."""
        inputs = self.read(points)
        trunk = self.field.trunk(inputs, torch.zeros_like(points))
        return torch.stack(
            [self.field.appearance(trunk, inputs.views, one.expand_as(points)) for one in view_dirs], dim=1
        ).clamp_min(UNSEEN_SCORE)

    @property
    def coloring(self) -> DrawnColoring:
        """By the head, of drawings as wide as the field reads them."""
        encoded = self.maps.colors
        return DrawnColoring(
            type(self.field.head), self.maps.cameras, encoded, self.detailed, self.pictures or encoded
        )

    def at_width(self, width: int) -> "CharacterField":
        """Colours from the detailed drawings, so many pixels wide; from the encoded ones where those are as wide."""
        if self.detailed is None:
            return self
        pictures = Pictures.of(self.detailed, width) if width > self.maps.cameras.width else None
        return replace(self, pictures=pictures)

    def read(self, points: Tensor) -> FieldInputs:
        """What the field reads at points (P, 3)."""
        return self.maps.read(points, self.latents)

    def _sharpened(self, views: PointViews) -> PointViews:
        """The same points with colours from the finer pictures."""
        return views if self.pictures is None else replace(views, rgb=self.pictures.read(views.uv))
