"""Files read and pictures rendered by Blender, in processes of its own."""

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Literal, final

import numpy as np
from PIL import Image

from charnerf.blender.program import find_blender, run_job
from charnerf.blender.surface_file import read_surface, write_surface
from charnerf.capture.lights import AbstractLight
from charnerf.capture.meshes import surface_to_world, turn_of
from charnerf.capture.renderers.base import AbstractRenderer, ReadCharacter
from charnerf.capture.studio import Shot
from charnerf.errors import ConfigError, DataError
from charnerf.pictures import LARGEST
from charnerf.surfaces.scene_files import check_files
from charnerf.surfaces.surface_mesh import SurfaceMesh
from charnerf.types import Cameras

REST = "rest"
_READ_LIMIT_S = 900.0
_PICTURE_LIMIT_S = 60.0  # each, on a busy machine without a GPU
_THREADS = 1  # captures run in as many processes as there are cores
_JOINED = re.compile(r"[^\w.+-]+", re.ASCII)


@final
@dataclass(frozen=True)
class Blender(AbstractRenderer):
    """Needs the wheel `bpy` or the program `blender`.

    Attributes:
        engine: Cycles, which needs no GPU, or Eevee.
        samples: A pixel, evenly over it.
        pose: "rest", or ACTION:FRAME of an action in the file.
        objects: Names of the objects and collections that are the character; all that the file shows if none.
    """

    suffixes: ClassVar[tuple[str, ...]] = (".fbx", ".blend", ".vrm", ".glb", ".gltf", ".obj", ".dae")
    engine: Literal["cycles", "eevee"] = "cycles"
    samples: int = 64
    pose: str = REST
    objects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ConfigError: If one is out of its range.
        """
        if self.engine not in ("cycles", "eevee"):
            raise ConfigError(f"engine: found {self.engine!r}, expected 'cycles' or 'eevee'.")
        if self.samples < 1:
            raise ConfigError(f"samples: found {self.samples}, expected at least 1.")
        self._action()

    def check(self) -> None:
        """Find Blender."""
        find_blender()

    def name_of(self, file: Path) -> str:
        """The file's stem, and the first object that was chosen."""
        return "-".join((file.stem, *(_JOINED.sub("_", name) for name in self.objects[:1])))

    def read(self, file: Path, up: str | None, facing: str | None) -> ReadCharacter:
        """Import a file, set its pose and bake what no picture says."""
        if file.suffix.lower() not in self.suffixes:
            raise DataError(
                f"{file}: found the suffix {file.suffix!r}, expected one of {', '.join(self.suffixes)}; "
                "capture it without Blender, or convert it."
            )
        rotation = turn_of(file, up, facing)
        check_files(file)
        action, frame = self._action()
        with tempfile.TemporaryDirectory(prefix="charnerf-blender-") as folder:
            surface_file = Path(folder) / "surface.npz"
            job = {
                "do": "read",
                "file": str(file.resolve()),
                "action": action,
                "frame": frame,
                "objects": self.objects,
                "most_pixels": LARGEST,
                "surface": str(surface_file),
            }
            answer = run_job(Path(folder), job, where=str(file), limit_s=_READ_LIMIT_S)
            surface = read_surface(surface_file)
        if not np.isfinite(surface.triangles).all():
            raise DataError(f"{file}: holds vertices that are not finite (NaN or infinity); repair the mesh.")
        return ReadCharacter(surface_to_world(surface, rotation, where=str(file)), tuple(answer["notes"]))

    def shoot(
        self, surface: SurfaceMesh, cameras: Sequence[Cameras], light: AbstractLight, *, depth: bool
    ) -> list[list[Shot]]:
        """Render all sets in one process; depth is rendered for itself, by rays through pixels' centres."""
        shots = []
        with tempfile.TemporaryDirectory(prefix="charnerf-blender-") as folder:
            write_surface(Path(folder) / "surface.npz", surface)
            views = [_view(each[index]) for each in cameras for index in range(len(each.orthographic))]
            job = {
                "do": "pictures",
                "surface": str(Path(folder) / "surface.npz"),
                "cameras": views,
                "size": cameras[0].width,
                "engine": self.engine,
                "samples": self.samples,
                "constant": light.constant,
                "depth": depth,
                "folder": folder,
                "threads": _THREADS,
            }
            limit = _READ_LIMIT_S + _PICTURE_LIMIT_S * len(views)
            run_job(Path(folder), job, where="pictures", limit_s=limit)
            load = partial(_shot, Path(folder), depth=depth)
            done = 0
            for each in cameras:
                count = len(each.orthographic)
                shots.append([load(index) for index in range(done, done + count)])
                done += count
        return shots

    def facts(self) -> dict[str, Any]:
        """Its name and its settings."""
        return {
            "renderer": "blender",
            "engine": self.engine,
            "samples": self.samples,
            "pose": self.pose,
            "objects": list(self.objects),
        }

    def _action(self) -> tuple[str | None, float]:
        """Action and frame of the pose; None at rest.

        Raises:
            ConfigError: If it is no pose.
        """
        if self.pose == REST:
            return None, 0.0
        action, _, frame = self.pose.rpartition(":")
        try:
            return action or _no_pose(self.pose), float(frame)
        except ValueError:
            return _no_pose(self.pose), 0.0


def _no_pose(pose: str) -> str:
    raise ConfigError(f"pose: found {pose!r}, expected 'rest' or ACTION:FRAME, such as 'Walk:12'.")


def _view(camera: Cameras) -> dict[str, Any]:
    """A camera in plain numbers."""
    return {
        "world_from_camera": camera.world_from_camera.double().tolist(),
        "focal": float(camera.focal[0]),
        "center": camera.principal_point.double().tolist(),
        "orthographic": bool(camera.orthographic),
    }


def _shot(folder: Path, index: int, *, depth: bool) -> Shot:
    if not (folder / f"{index:03d}.png").is_file():
        raise DataError(f"Blender wrote no picture {index}; see that its temporary folder has room.")
    with Image.open(folder / f"{index:03d}.png") as picture:
        rgba = np.array(picture.convert("RGBA"))
    if not depth:
        return Shot(rgba=rgba, depth=np.zeros(rgba.shape[:2], np.uint16))
    with Image.open(folder / f"depth_{index:03d}.png") as picture:
        return Shot(rgba=rgba, depth=np.array(picture).astype(np.uint16))
