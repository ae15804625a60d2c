"""`charnerf reconstruct`: three drawings -> mesh, turntable, views and a report of what was assumed."""

import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import imageio.v3 as imageio
import numpy as np
from tqdm import tqdm

from charnerf.drawings.turnaround import Turnaround
from charnerf.meshing.build import BuiltMesh
from charnerf.meshing.export import save_mesh
from charnerf.model_api import Hero, Model

ELEVATION_DEG = 10.0
VIEWS_DEG = (0, 45, 90, 135, 180, 225, 270, 315)
FRAMES_PER_SECOND = 12


@dataclass(frozen=True)
class Reconstruction:
    """Files of one reconstructed character."""

    mesh: Path
    turntable: Path
    report: Path
    warnings: tuple[str, ...]


def reconstruct(
    model: Model,
    *,
    front: Path,
    side: Path,
    back: Path,
    output: Path,
    side_is: Literal["left", "right"],
    resolution: int,
    faces: int,
    frames: int,
    size: int,
    num_cameras: int,
) -> Reconstruction:
    """Reconstruct a character from three drawings into a folder.

    Args:
        model: Loaded, on its device.
        front: Front drawing.
        side: Side drawing.
        back: Back drawing.
        output: Folder; made if missing, files of the same names are replaced.
        side_is: Which side of the character the side drawing shows.
        resolution: Grid points along the mesh's longest side.
        faces: Faces of the mesh.
        frames: Frames of the turntable.
        size: Side of pictures, pixels.
        num_cameras: Cameras whose directions the density is averaged over.

    Returns:
        What was written.

    Raises:
        DataError: If a drawing can not be used.
    """
    start = time.perf_counter()
    hero = model.encode(front=front, side=side, back=back, side_is=side_is)
    turnaround = hero.turnaround
    assert turnaround is not None  # encode made it
    for line in (*turnaround.assumptions, *(f"warning: {one}" for one in turnaround.warnings)):
        sys.stderr.write(f"{line}\n")
    encoded = time.perf_counter()
    built = hero.build_mesh(resolution=resolution, num_cameras=num_cameras, faces=faces)
    meshed = time.perf_counter()
    output.mkdir(parents=True, exist_ok=True)
    mesh_file = save_mesh(built.mesh, output / "mesh.glb")
    imageio.imwrite(output / "drawings.png", turnaround.picture)
    turntable = write_turntable(render_turntable(hero, frames=frames, size=size), output)
    views = write_views(hero, output / "views", size=size)
    seconds = {
        "encode": encoded - start,
        "mesh": meshed - encoded,
        "turntable and views": time.perf_counter() - meshed,
    }
    report = write_report(
        output,
        model=model,
        turnaround=turnaround,
        built=built,
        turntable=turntable,
        views=views,
        seconds=seconds,
    )
    return Reconstruction(mesh=mesh_file, turntable=turntable, report=report, warnings=turnaround.warnings)


def render_turntable(hero: Hero, *, frames: int, size: int) -> list[np.ndarray]:
    """Pictures once around the character, (size, size, 3), uint8, on white."""
    angles = [360.0 * index / frames for index in range(frames)]
    bar = tqdm(angles, desc="turntable", unit="frame", dynamic_ncols=True)
    return [on_white(hero.render(azimuth_deg=a, elevation_deg=ELEVATION_DEG, size=size)) for a in bar]


def on_white(image: np.ndarray) -> np.ndarray:
    """An RGBA picture composited on white, uint8."""
    rgb = image[..., :3] * image[..., 3:] + (1.0 - image[..., 3:])
    return np.rint(255.0 * rgb).astype(np.uint8)


def write_turntable(frames: Sequence[np.ndarray], folder: Path) -> Path:
    """Write frames as turntable.mp4, or as turntable.gif where this machine has no H.264 encoder."""
    even = [np.pad(f, ((0, f.shape[0] % 2), (0, f.shape[1] % 2), (0, 0)), mode="edge") for f in frames]

    def write_mp4(path: Path) -> None:
        imageio.imwrite(
            path, np.stack(even), plugin="FFMPEG", fps=FRAMES_PER_SECOND, codec="libx264", macro_block_size=2
        )

    try:
        return _write_aside(folder / "turntable.mp4", write_mp4)
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        sys.stderr.write(f"no MP4 ({' '.join(str(error).split())[:120]}): writing a GIF instead.\n")
    return _write_aside(
        folder / "turntable.gif",
        lambda path: imageio.imwrite(path, np.stack(frames), duration=1000 / FRAMES_PER_SECOND, loop=0),
    )


def write_views(hero: Hero, folder: Path, *, size: int) -> list[Path]:
    """Write pictures from eight sides as PNG with alpha."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for azimuth in VIEWS_DEG:
        image = hero.render(azimuth_deg=azimuth, elevation_deg=0.0, size=size)
        file = folder / f"{azimuth:03d}.png"
        imageio.imwrite(file, np.rint(255.0 * image).astype(np.uint8))
        files.append(file)
    return files


def write_report(
    folder: Path,
    *,
    model: Model,
    turnaround: Turnaround,
    built: BuiltMesh,
    turntable: Path,
    views: Sequence[Path],
    seconds: dict[str, float],
) -> Path:
    """Write report.md: what was assumed, what came out, how long it took."""
    size = built.mesh.extents
    lines = [
        "# Reconstructed character",
        "",
        "![the drawings, cut out and aligned](drawings.png)",
        "",
        "## What was assumed about the drawings",
        "",
        *(f"- {one}" for one in turnaround.assumptions),
        *(f"- **warning**: {one}" for one in turnaround.warnings),
        "",
        "## Result",
        "",
        (
            f"- [mesh.glb](mesh.glb): {len(built.mesh.faces)} faces of {built.num_extracted} extracted, "
            f"{size[0]:.2f} x {size[1]:.2f} x {size[2]:.2f} m, {built.num_floaters} loose parts dropped"
        ),
        f"- [{turntable.name}]({turntable.name})",
        f"- weights: {model.source.name}",
        *(f"- {name}: {value:.1f} s" for name, value in seconds.items()),
        "",
        " ".join(f"![{one.stem} degrees]({one.relative_to(folder).as_posix()})" for one in views),
        "",
    ]
    return _write_aside(
        folder / "report.md", lambda path: path.write_text("\n".join(lines), encoding="utf-8")
    )


def _write_aside(file: Path, write: Callable[[Path], object]) -> Path:
    """Write a file under another name and rename it: it is there whole or not at all."""
    aside = file.with_name(f".{os.getpid()}.{file.name}")
    try:
        write(aside)
        os.replace(aside, file)
    finally:
        aside.unlink(missing_ok=True)
    return file
