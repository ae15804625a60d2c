"""`Hero`: one character, encoded from its drawings; looked at and meshed as often as wanted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, final

import numpy as np
import torch

from charnerf.drawings.turnaround import Turnaround
from charnerf.errors import ConfigError
from charnerf.geometry.framing import framing_camera, framing_radius
from charnerf.geometry.world import CENTRE
from charnerf.meshing.build import BuiltMesh, build_mesh
from charnerf.meshing.lod import Lod, build_lods
from charnerf.meshing.options import MeshOptions, Texture
from charnerf.meshing.symmetry import symmetric_scene
from charnerf.scene import Scene
from charnerf.types import Cameras, SourceViews
from charnerf.volume.renderers.baked import TOLERANCE, TURNING_TOLERANCE, BakedRenderer
from charnerf.volume.renderers.base import AbstractRenderer

if TYPE_CHECKING:
    import trimesh


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
        framed: Radius that pictures frame, m, where a file says it; else by hull and drawings.
    """

    scene: Scene
    views: SourceViews
    renderer: AbstractRenderer
    turnaround: Turnaround | None = None
    detailed: SourceViews | None = None
    framed: float | None = None
    _scene_by_width: dict[int, Scene] = field(default_factory=dict, init=False, repr=False, compare=False)

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
        resolution: int = MeshOptions.resolution,
        num_cameras: int = MeshOptions.num_cameras,
        faces: int | None = MeshOptions.faces,
        smooth: int = MeshOptions.smooth,
        height: float | None = MeshOptions.height,
        texture: Texture = MeshOptions.texture,
        texture_size: int = MeshOptions.texture_size,
    ) -> trimesh.Trimesh:
        """Make a colored mesh: world frame, metres, on z = 0; write it with `charnerf.save_mesh`.

        Args are those of `charnerf.meshing.options.MeshOptions`.
        """
        return self.build_mesh(
            MeshOptions(
                resolution=resolution,
                num_cameras=num_cameras,
                faces=faces,
                smooth=smooth,
                height=height,
                texture=texture,
                texture_size=texture_size,
            )
        ).mesh

    def build_mesh(
        self, options: MeshOptions, *, on_points: Callable[[int], object] = lambda count: None
    ) -> BuiltMesh:
        """As `mesh`, with how it came about: level, parts dropped, work left out, seconds."""
        with torch.no_grad():
            return build_mesh(self.scene, self.views, options, detailed=self.detailed, on_points=on_points)

    def symmetric(self) -> Hero:
        """The character as its own mirror image: densities averaged over left and right, for meshes and views."""
        return replace(self, scene=symmetric_scene(self.scene))

    def baked(
        self, tolerance: float = TOLERANCE, *, on_share: Callable[[float], object] = lambda share: None
    ) -> Hero:
        """The character evaluated once on a grid, for many views of it: see `renderer=baked`; as it is where it can not be.

        Args:
            tolerance: Error of a colour that is aimed at, in [0, 1]; 0 leaves it as it is.
            on_share: Called again and again with the share of the work that is done, in [0, 1], such as `progress.update`; what it
                raises ends the work.

        Raises:
            ConfigError: If the tolerance is negative or not finite.
        """
        if not 0.0 <= tolerance < math.inf:
            raise ConfigError(f"tolerance: found {tolerance}, expected a number from 0 on.")
        renderer = BakedRenderer(**self.renderer.settings, tolerance=tolerance)
        return replace(self, scene=renderer.prepared(self.scene, on_share), renderer=renderer)

    def turning(self) -> Hero:
        """A baked character as it is looked at while it turns: the same grid by a tolerance of 0.15, where it has a finer one."""
        renderer = self.renderer
        finer = isinstance(renderer, BakedRenderer) and 0.0 < renderer.tolerance < TURNING_TOLERANCE
        return self.baked(TURNING_TOLERANCE) if finer else self

    def view(self, *, size: int = 256) -> Any:
        """A widget for a notebook that shows the character from where its sliders say; baked first, where it is not.

        While a slider moves pictures are those of `turning`; where it rests they are exact to the renderer's tolerance.

        Args:
            size: Side of the picture, pixels.

        Raises:
            ConfigError: If the size is below 1.
            DependencyError: If ipywidgets is missing.
        """
        from charnerf.inference.notebook import turning

        baked = self if isinstance(self.renderer, BakedRenderer) else self.baked()
        moving, still = (partial(_look, one, size=size) for one in (baked.turning(), baked))
        return turning(moving, still, size=size)

    def lods(
        self,
        options: MeshOptions | None = None,
        *,
        resolutions: Sequence[int],
        faces: Sequence[int] = (),
        on_points: Callable[[int], object] = lambda count: None,
    ) -> tuple[Lod, ...]:
        """Make levels of detail, the finest first: one mesh a grid, and one a number of faces.

        Args:
            options: How each is made, grid and faces aside; the defaults if None.
            resolutions: Grids, points along the longest side.
            faces: Faces to decimate the finest grid's surface to.
            on_points: Called with the number of grid points after each piece of work.

        Returns:
            Levels; `charnerf.meshing.lod.lod_table` makes a table of them.
        """
        with torch.no_grad():
            return build_lods(
                self.scene,
                self.views,
                options or MeshOptions(),
                resolutions=resolutions,
                faces=faces,
                detailed=self.detailed,
                on_points=on_points,
            )

    def radius(self) -> float:
        """Radius around (0, 0, 1) that pictures frame, m: as wide as the drawings, which frame the figure, or of the hull.

        The hull counts with a margin, where it is narrower or a drawing has a perspective; at least 1.05 m.
        """
        return self._radius

    @cached_property
    def _radius(self) -> float:
        if self.framed is not None:
            return self.framed
        bounds = self.scene.bounds
        hull, box_min = bounds.hull, bounds.box_min
        if hull is None:
            return float((bounds.box_max - box_min).amax()) / 2.0
        occupied = hull.occupancy.nonzero()
        if len(occupied) == 0:
            return framing_radius(0.0)
        cell = (hull.box_max - hull.box_min) / torch.tensor(hull.occupancy.shape, device=box_min.device)
        centres = hull.box_min + (occupied + 0.5) * cell
        reach = math.sqrt(float((centres - box_min.new_tensor(CENTRE)).square().sum(-1).max()))
        return min(framing_radius(reach), self._drawn_extent())

    def _drawn_extent(self) -> float:
        """Half the side of the widest drawing, m, at least 1.05 m; infinite where one has a perspective."""
        cameras = self.views.cameras[self.views.present]
        if not bool(cameras.orthographic.all()):
            return math.inf
        return max(0.5 * cameras.width / float(cameras.focal.amin()), framing_radius(0.0))

    def _scene_for(self, size: int) -> Scene:
        """The scene for pictures of a size: a pixel of theirs covers as much as one of the drawings that it reads."""
        cameras = self.views.cameras[self.views.present]
        distance = (cameras.world_from_camera[:, :3, 3] - cameras.focal.new_tensor(CENTRE)).norm(dim=-1)
        metres = torch.where(cameras.orthographic, 1.0, distance) / cameras.focal[:, 0]  # that a pixel covers
        across = cameras.width * float(metres.amax())
        width = math.ceil(size * across / (2.0 * self.radius()))
        if width not in self._scene_by_width:
            self._scene_by_width.clear()  # the pictures of a turntable are of one size
            self._scene_by_width[width] = self.scene.at_width(width)
        return self._scene_by_width[width]

    def _camera(self, azimuth_deg: float, elevation_deg: float, size: int) -> Cameras:
        """Pinhole camera of shape () that frames the character."""
        camera = framing_camera(azimuth_deg, elevation_deg, radius=self.radius(), size=size)
        return camera.to(self.scene.bounds.box_min.device)


def _look(hero: Hero, azimuth: int, elevation: int, *, size: int) -> np.ndarray:
    """A picture at whole degrees."""
    return hero.render(azimuth_deg=azimuth, elevation_deg=elevation, size=size)
