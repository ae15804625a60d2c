"""What the stages of making pictures and meshes take, for the time left; nothing but that depends on it."""

import math
from collections.abc import Callable, Sequence

from charnerf.meshing.options import MeshOptions
from charnerf.progress import Progress
from charnerf.reconstruction.options import ReconstructionOptions

# seconds on two cores
ENCODE, BAKE, WRITE = 1.0, 6.0, 3.0
FRAME = 0.1  # of 192 pixels
SURFACE = 4.0  # of a grid of 128
TEXTURE = 1.0 / 4000.0  # a face
ALL_FACES = 30_000  # of a grid of 128
MESH_POINTS = 0.1  # of the grid, evaluated in the usual case


def reconstruction_stages(options: ReconstructionOptions) -> dict[str, float]:
    """Seconds that each stage of a reconstruction takes, about."""
    refine = {} if options.refine_seconds is None else {"refine": options.refine_seconds}
    pictures = {"bake": BAKE, "pictures": options.frames * FRAME * (options.size / 192.0) ** 2}
    return {"encode": ENCODE, **refine, **pictures, "mesh": mesh_seconds(options.mesh), "files": WRITE}


def mesh_seconds(options: MeshOptions) -> float:
    """Seconds that a mesh takes, about."""
    scale = options.resolution / 128.0
    faces = ALL_FACES * scale**2 if options.faces is None else options.faces
    return SURFACE * scale**2.5 + (0.0 if options.texture == "vertex" else TEXTURE * faces)


def meter(progress: Progress, resolutions: Sequence[int]) -> Callable[[int], None]:
    """Turn numbers of evaluated points into the share of a stage: how many there will be is known only about."""
    expected = MESH_POINTS * sum(resolution**3 for resolution in resolutions)
    total = 0

    def step(count: int) -> None:
        nonlocal total
        total += count
        progress.update(0.8 * -math.expm1(-total / expected))

    return step
