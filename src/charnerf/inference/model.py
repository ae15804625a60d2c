"""The library's two objects: a loaded `Model`, and a `Hero`, one character encoded from its drawings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
import torch

from charnerf.drawings.turnaround import Turnaround, read_views
from charnerf.drawings.viewpoints import turnaround
from charnerf.errors import ConfigError, ShapeError
from charnerf.geometry.framing import CENTRE, HEIGHT, framing_camera, framing_radius
from charnerf.geometry.resizing import resized_views
from charnerf.meshing.build import BuiltMesh, build_mesh
from charnerf.meshing.lod import Lod, build_lods
from charnerf.meshing.symmetry import symmetric_scene
from charnerf.meshing.texture import TEXTURE_SIZE, Texturing
from charnerf.models.charnerf import CharNeRF, EncodedViews
from charnerf.types import Cameras, Scene, SourceViews
from charnerf.volume.renderers.base import AbstractRenderer

if TYPE_CHECKING:
    import trimesh

Picture = str | Path | np.ndarray
TextureKind = Literal["drawings", "field", "vertex"]


@final
@dataclass(frozen=True)
class Model:
    """A trained model, ready to use.

    Attributes:
        network: The networks, in eval mode, without gradients.
        renderer: How its scenes are rendered.
        config: The model's part of the config that it was trained with (an OmegaConf section).
        source: The file that it came from.
        note: What that file says about itself, such as that it is for one character; None if nothing.
    """

    network: CharNeRF
    renderer: AbstractRenderer
    config: Any
    source: Path
    note: str | None = None

    @property
    def image_size(self) -> int:
        """Side of the drawings that the encoder was trained on, pixels."""
        return int(self.config.model.image_size)

    @property
    def device(self) -> torch.device:
        """Where the networks are."""
        return self.network.box[0].device

    @property
    def any_size(self) -> AnySize:
        """The network for views of any size."""
        return AnySize(self.network, self.image_size)

    def to(self, device: torch.device | str) -> Model:
        """The model on another device; the networks move, they are not copied."""
        return replace(self, network=self.network.to(device))

    def encode(
        self, *, front: Picture, side: Picture, back: Picture, side_is: Literal["left", "right"] = "left"
    ) -> Hero:
        """Encode one character from three drawings.

        Args:
            front: Image file, or array (H, W, 3 or 4) of uint8 or of floats in [0, 1]; alpha or a plain
                background; any size.
            side: In profile.
            back: Seen from behind.
            side_is: Which side of the character the side drawing shows; left: the face looks to the picture's
                left.

        Returns:
            The character; `hero.turnaround` says what was assumed about the drawings.

        Raises:
            DataError: If a drawing can not be used; the message names its file.
        """
        read = read_views(turnaround(front, side, back, side_is=side_is), size=self.image_size)
        hero = self.encode_views(read.views, detailed=read.detailed)
        return replace(hero, turnaround=read)

    def encode_views(self, views: SourceViews, *, detailed: SourceViews | None = None) -> Hero:
        """Encode source views of one character, B = 1, that have their cameras already.

        Args:
            views: Of any size: they are encoded as large as the encoder was trained on.
            detailed: The same views with more pixels, for the colours of large pictures; `views` themselves where those are
                wider than the encoder's.

        Raises:
            ShapeError: If there is not exactly one character.
        """
        if views.images.shape[0] != 1:
            raise ShapeError(
                f"views: found {views.images.shape[0]} characters, expected 1; encode them one by one."
            )
        views, finer = fitted(views.to(self.device), self.image_size)
        detailed = finer if detailed is None else detailed.to(self.device)
        with torch.no_grad():
            scene = self.network.scene(self.network.encode(views, detailed=detailed), 0)
        return Hero(scene=scene, views=views, renderer=self.renderer, detailed=detailed)


def fitted(views: SourceViews, width: int) -> tuple[SourceViews, SourceViews | None]:
    """Views of any size at the width that an encoder was trained on, and the views themselves where they are wider."""
    if views.cameras.width == width:
        return views, None
    return resized_views(views, width), views if views.cameras.width > width else None


@final
@dataclass(frozen=True)
class AnySize:
    """A model's network for views of any size: what `evaluate` asks for.

    Attributes:
        network: The network.
        width: Of the pictures that its encoder was trained on, pixels.
    """

    network: CharNeRF
    width: int

    @property
    def device(self) -> torch.device:
        """Where the network is."""
        return self.network.device

    def encode(self, views: SourceViews) -> EncodedViews:
        """Encode views at the encoder's width."""
        views, detailed = fitted(views, self.width)
        return self.network.encode(views, detailed=detailed)

    def scene(self, encoded: EncodedViews, index: int) -> Scene:
        """A character's scene, coloured from the views as they were given."""
        scene = self.network.scene(encoded, index)
        if scene.at_width is None or encoded.detailed is None:
            return scene
        return scene.at_width(encoded.detailed.shape[-1])


@final
@dataclass(frozen=True)
class Hero:
    """One character, encoded once; looked at and meshed as often as wanted.

    Attributes:
        scene: Its field.
        views: The drawings as source views, B = 1.
        renderer: How it is rendered.
        turnaround: What was assumed about the drawings; None where the views came with cameras.
        detailed: The same views with more pixels, None where there are none; for textures and large pictures.
    """

    scene: Scene
    views: SourceViews
    renderer: AbstractRenderer
    turnaround: Turnaround | None = None
    detailed: SourceViews | None = None

    def render(self, *, azimuth_deg: float, elevation_deg: float = 0.0, size: int = 256) -> np.ndarray:
        """Render a view, coloured from the drawings at the picture's resolution as far as they have it.

        Args:
            azimuth_deg: 0 front, 90 the character's left side, 180 back, 270 its right side.
            elevation_deg: 0 level, 90 from above.
            size: Side of the picture, pixels.

        Returns:
            (size, size, 4), float32 RGBA in [0, 1], sRGB-encoded, straight alpha.

        Raises:
            ConfigError: If the size is below 1 or an angle is not finite.
        """
        if size < 1:
            raise ConfigError(f"size: found {size}, expected at least 1 pixel.")
        if not np.isfinite((azimuth_deg, elevation_deg)).all():
            raise ConfigError(f"angles: found {azimuth_deg} and {elevation_deg}, expected finite degrees.")
        camera = self._camera(azimuth_deg, elevation_deg, size)
        with torch.no_grad():
            finest = self.renderer.render_camera(self._scene_for(size), camera).finest
        opacity = finest.opacity.clamp(0.0, 1.0)[..., None]
        seen = finest.rgb - (1.0 - opacity)  # the background is white
        straight = torch.where(opacity > 1e-4, seen / opacity.clamp_min(1e-4), torch.ones_like(seen))
        return torch.cat((straight.clamp(0.0, 1.0), opacity), dim=-1).cpu().numpy()

    def mesh(
        self,
        *,
        resolution: int = 256,
        num_cameras: int = 8,
        faces: int | None = None,
        smooth: int = 0,
        height: float = HEIGHT,
        texture: TextureKind = "vertex",
        texture_size: int = TEXTURE_SIZE,
    ) -> trimesh.Trimesh:
        """Make a coloured mesh: world frame, metres, on z = 0; write it with `charnerf.save_mesh`.

        Args:
            resolution: Grid points along the longest side.
            num_cameras: Cameras whose directions the density is averaged over (one where the density sees no
                direction).
            faces: Faces after decimation; None keeps all. A texture takes a second for 4000 faces.
            smooth: Rounds of smoothing; it does not shrink.
            height: Its exact height, m.
            texture: vertex: colours at vertices, by the field. drawings: a base-colour texture from the
                drawings, by the field where none sees the surface. field: a texture by the field alone.
            texture_size: Texels a side.
        """
        return self.build_mesh(
            resolution=resolution,
            num_cameras=num_cameras,
            faces=faces,
            smooth=smooth,
            height=height,
            texture=texture,
            texture_size=texture_size,
        ).mesh

    def build_mesh(
        self,
        *,
        resolution: int,
        num_cameras: int,
        faces: int | None,
        smooth: int = 0,
        height: float = HEIGHT,
        texture: TextureKind = "vertex",
        texture_size: int = TEXTURE_SIZE,
        on_points: Callable[[int], object] = lambda count: None,
    ) -> BuiltMesh:
        """As `mesh`, with how it came about: level, parts dropped, work left out, seconds."""
        with torch.no_grad():
            return build_mesh(
                self.scene,
                self.views,
                resolution=resolution,
                num_cameras=num_cameras,
                faces=faces,
                smooth=smooth,
                height=height,
                texturing=self.texturing(texture, texture_size),
                on_points=on_points,
            )

    def symmetric(self) -> Hero:
        """The character as its own mirror image: densities averaged over left and right, for meshes and views."""
        return replace(self, scene=symmetric_scene(self.scene))

    def lods(
        self,
        *,
        resolutions: Sequence[int],
        faces: Sequence[int] = (),
        num_cameras: int = 8,
        smooth: int = 0,
        height: float = HEIGHT,
        texture: TextureKind = "vertex",
        texture_size: int = TEXTURE_SIZE,
        decimated_only: bool = False,
        on_points: Callable[[int], object] = lambda count: None,
    ) -> tuple[Lod, ...]:
        """Make levels of detail, the finest first: one mesh a grid, and one a number of faces.

        Args:
            resolutions: Grids, points along the longest side.
            faces: Faces to decimate the finest grid's surface to.
            num_cameras: As of `mesh`, as are the next four.
            smooth: Rounds of smoothing of each grid's surface.
            height: Exact height of each, m.
            texture: Their colours.
            texture_size: Texels a side.
            decimated_only: Leave the grids' own meshes out.
            on_points: Called with the number of grid points after each piece of work.

        Returns:
            Levels; `charnerf.meshing.lod.lod_table` makes a table of them.
        """
        with torch.no_grad():
            return build_lods(
                self.scene,
                self.views,
                resolutions=resolutions,
                faces=faces,
                num_cameras=num_cameras,
                smooth=smooth,
                height=height,
                texturing=self.texturing(texture, texture_size),
                decimated_only=decimated_only,
                on_points=on_points,
            )

    def texturing(self, texture: TextureKind, size: int = TEXTURE_SIZE) -> Texturing | None:
        """How a mesh of this character is textured; None for vertex colours."""
        if texture == "vertex":
            return None
        if texture not in ("drawings", "field"):
            raise ConfigError(f"texture: found '{texture}', expected drawings, field or vertex.")
        views = self.views if self.detailed is None else self.detailed
        return Texturing(colours=texture, size=size, views=views)

    def radius(self) -> float:
        """Radius around (0, 0, 1) that pictures frame, m: of the hull with a margin, at least 1.05 m."""
        hull, box_min = self.scene.hull, self.scene.box_min
        if hull is None:
            return float((self.scene.box_max - box_min).amax()) / 2.0
        occupied = hull.occupancy.nonzero()
        if len(occupied) == 0:
            return framing_radius(0.0)
        cell = (hull.box_max - hull.box_min) / torch.tensor(hull.occupancy.shape, device=box_min.device)
        centres = hull.box_min + (occupied + 0.5) * cell
        return framing_radius(math.sqrt(float((centres - box_min.new_tensor(CENTRE)).square().sum(-1).max())))

    def _scene_for(self, size: int) -> Scene:
        """The scene for pictures of a size: a pixel of theirs covers as much as one of the drawings that it reads."""
        if self.scene.at_width is None:
            return self.scene
        cameras = self.views.cameras[self.views.present]
        distance = (cameras.world_from_camera[:, :3, 3] - cameras.focal.new_tensor(CENTRE)).norm(dim=-1)
        metres = torch.where(cameras.orthographic, 1.0, distance) / cameras.focal[:, 0]  # that a pixel covers
        across = cameras.width * float(metres.amax())
        return self.scene.at_width(math.ceil(size * across / (2.0 * self.radius())))

    def _camera(self, azimuth_deg: float, elevation_deg: float, size: int) -> Cameras:
        """Pinhole camera of shape () that frames the character."""
        camera = framing_camera(azimuth_deg, elevation_deg, radius=self.radius(), size=size)
        return camera.to(self.scene.box_min.device)
