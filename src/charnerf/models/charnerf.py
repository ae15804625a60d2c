"""The model: drawings -> encoder -> feature maps -> scenes that answer points with colour and density."""

from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor, nn

from charnerf.errors import ShapeError
from charnerf.geometry.bounds import Bounds
from charnerf.geometry.hull import build_hull
from charnerf.geometry.resizing import resized_views
from charnerf.models.character import CharacterField
from charnerf.models.encoders.base import AbstractEncoder
from charnerf.models.field import Field
from charnerf.models.lookup import maps_to_rows
from charnerf.models.view_maps import ViewMaps
from charnerf.models.views.base import AbstractViews
from charnerf.pictures import images_on_white
from charnerf.scene import Scene
from charnerf.types import Hull, SourceViews, TensorRecord


@dataclass(frozen=True)
class EncodedViews(TensorRecord):
    """Characters, encoded once.

    Attributes:
        views: The source views used, (B, V), mirrored ones included.
        feature_maps: W^i = E(I_i), (B, V, F, h, w).
        hull: Their hulls, or None for a model without.
        width: Of the drawings as they were given, pixels: scenes are coloured at it.
        detailed: The views used on white with more pixels, (B, V, 3, H', W'), or None where there are none.
    """

    views: SourceViews
    feature_maps: Tensor
    hull: Hull | None
    width: int
    detailed: Tensor | None = None


@final
class CharNeRF(nn.Module):
    """Encoder, source views rule and one or two fields.

    Args:
        encoder: E.
        views: Which views are used.
        coarse: The field of the coarse pass.
        fine: The field of the fine pass, or None where the configuration has none.
        box_centre: Centre of the space looked at, m, 3 numbers.
        box_half_extent: Half of its side, m; coordinates are scaled by it before eq. 1, so that they stay
            in (-1, 1).
        hull: Whether the visual hull belongs to the model.
        image_size: Width that drawings are encoded at, pixels.

    Source: paper, Overview.
    """

    box_centre: Tensor

    def __init__(
        self,
        *,
        encoder: AbstractEncoder,
        views: AbstractViews,
        coarse: Field,
        fine: Field | None,
        box_centre: list[float],
        box_half_extent: float,
        hull: bool,
        image_size: int,
    ) -> None:
        super().__init__()
        self.encoder = encoder
        self.views = views
        self.coarse = coarse
        self.fine = fine
        self.box_half_extent = float(box_half_extent)
        self.register_buffer("box_centre", torch.tensor(box_centre, dtype=torch.float32), persistent=False)
        self.has_hull = hull
        self.image_size = image_size

    @property
    def device(self) -> torch.device:
        """Where the networks are."""
        return self.box_centre.device

    @property
    def finest(self) -> Field:
        """The field that pictures and meshes are made of."""
        return self.coarse if self.fine is None else self.fine

    @property
    def box(self) -> tuple[Tensor, Tensor]:
        """Lower and upper corner of the space looked at, (3,) each, m."""
        return self.box_centre - self.box_half_extent, self.box_centre + self.box_half_extent

    def fitted(self, views: SourceViews) -> SourceViews:
        """Drawings of any size as they are encoded: at the width that the encoder was trained on."""
        return views if views.cameras.width == self.image_size else resized_views(views, self.image_size)

    def carve(self, views: SourceViews) -> Hull | None:
        """Hulls of drawings (B, V), for callers who keep them; None for a model without a hull."""
        if not self.has_hull:
            return None
        views = self.fitted(views)
        box_min, box_max = (corner.to(views.images) for corner in self.box)  # data carves on its own device
        return build_hull(self.views(views), box_min=box_min, box_max=box_max)

    def encode(
        self, views: SourceViews, hull: Hull | None = None, *, detailed: SourceViews | None = None
    ) -> EncodedViews:
        """Encode characters once.

        Args:
            views: Drawings of any size, (B, V), V from 1 to 8; padded views are marked absent. They are encoded at the width
                that the encoder was trained on, and scenes coloured at their own.
            hull: Their hulls from `carve`, carved here if not given.
            detailed: The same drawings with more pixels: `Scene.at_width` then reads colours from them; `views` themselves
                where those are wider than the encoder's.

        Returns:
            What `scene` needs.

        Raises:
            ShapeError: If the pictures' sides do not suit the encoder, or the detailed ones are other views.
        """
        given, views = views, self.fitted(views)
        if detailed is None and given.cameras.width > self.image_size:
            detailed = given
        height, width = views.images.shape[-2:]
        multiple = self.encoder.multiple
        if height % multiple or width % multiple:
            raise ShapeError(
                f"source_views.images: found {width} x {height} pixels, expected sides that are multiples of {multiple} "
                "(the encoder halves them that often). Resize or pad the drawings."
            )
        if hull is None:
            hull = self.carve(views)
        used = self.views(views)
        alpha = used.images[:, :, 3:]
        pixels = torch.cat((2.0 * images_on_white(used.images) - 1.0, 2.0 * alpha - 1.0), dim=2).flatten(0, 1)
        maps = self.encoder(pixels.contiguous(memory_format=torch.channels_last))
        return EncodedViews(
            views=used,
            feature_maps=maps.unflatten(0, used.present.shape),
            hull=hull,
            width=given.cameras.width,
            detailed=None if detailed is None else self._detail_of(used, detailed),
        )

    def _detail_of(self, used: SourceViews, detailed: SourceViews) -> Tensor:
        """The views used with more pixels, on white."""
        images = self.views(detailed).images
        (height, width), (tall, wide) = used.images.shape[-2:], images.shape[-2:]
        if images.shape[:2] != used.images.shape[:2] or tall * width != wide * height:
            raise ShapeError(
                f"detailed: found images {tuple(images.shape)}, expected the same views as {tuple(used.images.shape)}, of the "
                "same proportions."
            )
        return images_on_white(images)

    def scene(self, encoded: EncodedViews, index: int) -> Scene:
        """One character of a batch as a scene for a renderer; its absent views are dropped here."""
        views = encoded.views[index]
        present = views.present.nonzero()[:, 0]
        views = views[present]
        hull = encoded.hull[index] if encoded.hull is not None else None
        maps = encoded.feature_maps[index][present]
        view_maps = ViewMaps.of(
            views,
            hull,
            present,
            map_size=(maps.shape[-1], maps.shape[-2]),
            box_centre=self.box_centre,
            box_half_extent=self.box_half_extent,
            sections=self.coarse.features.reads_sections,
            # in training the field learns the outlines by itself: with them it came to 0.2 dB less foreground (docs/results.md)
            coverage=hull is not None and not self.training,
        )
        rows = maps_to_rows(maps)
        detailed = None if encoded.detailed is None else encoded.detailed[index][present]

        def reading(field: Field) -> CharacterField:
            return CharacterField(field, view_maps, field.hoist(rows), detailed)

        scene = Scene(
            coarse=reading(self.coarse),
            fine=None if self.fine is None else reading(self.fine),
            bounds=Bounds(*self.box, hull, None if view_maps.shown is None else view_maps.in_outlines),
        )
        return scene.at_width(encoded.width)
