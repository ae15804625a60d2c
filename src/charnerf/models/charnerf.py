"""The model: drawings -> encoder -> feature maps -> scenes that answer points with colour and density."""

from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor, nn

from charnerf.errors import ShapeError
from charnerf.geometry.bounds import Bounds
from charnerf.geometry.hull import build_hull
from charnerf.geometry.resizing import resized_views
from charnerf.models.encoders.base import AbstractEncoder
from charnerf.models.features.base import AbstractFeatures, ViewReadings
from charnerf.models.field import Field, PendingColors
from charnerf.models.inputs import PointInputs
from charnerf.models.lookup import maps_to_rows
from charnerf.models.view_maps import Pictures, ViewMaps, kept_share
from charnerf.models.views.base import AbstractViews
from charnerf.pictures import images_on_white
from charnerf.scene import AbstractField, DensityOutput, Scene
from charnerf.types import FieldOutput, Hull, SourceViews, TensorRecord

BYTES_PER_FEATURE = 64  # of a view and a point, gradient kept: some 16 tensors of float32; measured, generous
HULL_DEPTH_FADE = 20.0  # per half-extent: a point this share behind the hull's front counts as hidden by 1/e


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
        features: Further inputs of f1.
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
        features: AbstractFeatures,
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
        self.features = features
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
        rows = maps_to_rows(maps)
        view_maps = self.view_maps(views, hull, present, maps)
        detailed = None if encoded.detailed is None else encoded.detailed[index][present]

        def answering(field: Field) -> CharacterField:
            mirrored = views.mirrored.to(maps.dtype)
            return CharacterField(self, field, view_maps, field.hoist(rows), mirrored, detailed)

        coarse, fine = answering(self.coarse), None if self.fine is None else answering(self.fine)
        outlines = None if view_maps.shown is None else view_maps.in_outlines
        return Scene(coarse, fine, Bounds(*self.box, hull, outlines)).at_width(encoded.width)

    def view_maps(self, views: SourceViews, hull: Hull | None, present: Tensor, maps: Tensor) -> ViewMaps:
        """What present views (V,) of a character show, for `point_inputs`; maps (V, F, h, w)."""
        size = (maps.shape[-1], maps.shape[-2])
        # in training the field learns the outlines by itself: with them it came to 0.2 dB less foreground (docs/results.md)
        outlines = hull is not None and not self.training
        return ViewMaps.of(
            views, hull, present, size, sections=self.features.reads_sections, coverage=outlines
        )

    def point_inputs(
        self, points: Tensor, view_dirs: Tensor, *, maps: ViewMaps, latents: Tensor, mirrored: Tensor
    ) -> PointInputs:
        """What a field sees of points (P, 3) looked at along view_dirs (P, 3)."""
        sight = maps.look(points, latents)
        if sight.front is None or sight.edge is None:
            behind = edge = torch.zeros_like(sight.along_ray)
        else:
            behind = (sight.along_ray - sight.front) / self.box_half_extent
            edge = sight.edge / maps.cameras.width
        if sight.coverage is None:
            kept = torch.ones_like(points[:, 0])
        else:
            kept = kept_share(sight.coverage[:, maps.carving])
        places, half_lengths = maps.places(points)
        readings = ViewReadings(
            source_rgb=sight.rgb,
            behind=behind,
            edge=edge,
            source_dirs=sight.source_dirs,
            mirrored=mirrored,
            places=places,
            half_lengths=half_lengths / self.box_half_extent,
        )
        return PointInputs(
            latents=sight.latents,
            point_features=self.features(readings),
            source_rgb=sight.rgb,
            uv=sight.uv,
            visibility=torch.exp(-HULL_DEPTH_FADE * behind.clamp_min(0.0)),
            valid=sight.valid,
            encoded_points=self.coarse.single_view.locate(
                (points - self.box_centre) / self.box_half_extent,
                maps.cameras.world_from_camera[:, :3, :3],
            ),
            view_dirs=view_dirs,
            source_dirs=sight.source_dirs,
            kept=kept,
        )


@final
@dataclass(frozen=True)
class CharacterField(AbstractField):
    """One of the model's fields for one character.

    Attributes:
        network: The model.
        field: Its coarse or fine field.
        maps: What the character's views show.
        latents: Rows of the feature maps, through the field's linear layer.
        mirrored: (V,), 1 where a view is mirrored.
        detailed: The views with more pixels, (V, 3, H, W), or None.
        pictures: What colours are read from instead of `maps`, or None.
    """

    network: CharNeRF
    field: Field
    maps: ViewMaps
    latents: Tensor
    mirrored: Tensor
    detailed: Tensor | None
    pictures: Pictures | None = None

    @property
    def sees_directions(self) -> bool:
        """Whether densities depend on the query direction."""
        return self.field.density.sees_directions

    @property
    def bytes_per_point(self) -> int:
        """By the number of views and the features' width."""
        return BYTES_PER_FEATURE * len(self.mirrored) * self.field.from_latents.out_features

    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """Colours (P, 3) and densities (P,)."""
        return self.field(self._colored(self._inputs(points, view_dirs)))

    def densities(self, points: Tensor, view_dirs: Tensor) -> DensityOutput:
        """Densities (P,); colours are read and made when they are asked for."""
        return self.field.densities(self._inputs(points, view_dirs))

    def colors(self, state: PendingColors) -> Tensor:
        """Colours (Q, 3)."""
        return self.field.colors(state.trunk, self._colored(state.inputs))

    def at_width(self, width: int) -> "CharacterField":
        """Colours from the detailed drawings, so many pixels wide; from the encoded ones where those are as wide."""
        if self.detailed is None:
            return self
        pictures = Pictures.of(self.detailed, width) if width > self.maps.cameras.width else None
        return replace(self, pictures=pictures)

    def _inputs(self, points: Tensor, view_dirs: Tensor) -> PointInputs:
        return self.network.point_inputs(
            points, view_dirs, maps=self.maps, latents=self.latents, mirrored=self.mirrored
        )

    def _colored(self, inputs: PointInputs) -> PointInputs:
        if self.pictures is None:
            return inputs
        return replace(inputs, source_rgb=self.pictures.read(inputs.uv))
