"""Characters as they are examined: what could be read of their views, and what was wrong with the rest."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from torch import Tensor

from charnerf.doctor.finding import Finding
from charnerf.types import Cameras


@dataclass(frozen=True)
class View:
    """A picture with the camera that its file states.

    Attributes:
        name: What to call it.
        file: The picture.
        key: Where its camera stands: file and key.
        matrix: The pose as it is written, (4, 4), finite.
        focal: Along x and y, pixels; pixels per metre of an orthographic view.
        centre: Principal point, pixels.
        size: Width and height that the file states, pixels.
        is_orthographic: Whether its rays are parallel.
        is_source: Whether it is a source view.
        mask: Picture that shows where the figure is, or None.
        depth: Its depth picture, or None.
    """

    name: str
    file: Path
    key: str
    matrix: np.ndarray
    focal: tuple[float, float]
    centre: tuple[float, float]
    size: tuple[int, int]
    is_orthographic: bool = False
    is_source: bool = False
    mask: Path | None = None
    depth: Path | None = None


@dataclass(frozen=True)
class Seen:
    """Views whose pictures could be read, on squares of one size.

    Attributes:
        views: N of them.
        cameras: As their files state them, (N,), float64.
        alphas: (N, S, S), in [0, 1].
        rgb: On white, uint8 (N, S, S, 3).
    """

    views: tuple[View, ...]
    cameras: Cameras
    alphas: Tensor
    rgb: np.ndarray


@dataclass(frozen=True)
class Patient:
    """A character before it is examined.

    Attributes:
        name: Its name.
        folder: Its folder.
        camera_file: The JSON file of all its cameras, None where there is no such one.
        views: What could be read.
        findings: What could not.
        mesh_file: Its mesh, if there is one.
        in_our_frame: Whether it ought to stand 2 m tall on z = 0.
    """

    name: str
    folder: Path
    camera_file: Path | None
    views: tuple[View, ...]
    findings: tuple[Finding, ...]
    mesh_file: Path | None = None
    in_our_frame: bool = False
