"""A fake network that answers in place of a trained one: whatever is drawn, it sees an egg."""

from dataclasses import replace
from pathlib import Path

import torch
from PIL import Image, ImageDraw

from charnerf.drawings.turnaround import read_views
from charnerf.geometry.bounds import Bounds
from charnerf.geometry.hull import build_hull
from charnerf.inference.hero import Hero
from charnerf.meshing.options import MeshOptions
from charnerf.reconstruction.options import ReconstructionOptions
from charnerf.scene import FunctionField, Scene
from charnerf.types import FieldOutput
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer

MESH = MeshOptions(resolution=32, faces=600, num_cameras=2, texture="drawings", texture_size=128)
OPTIONS = ReconstructionOptions(mesh=MESH, frames=6, size=48)
BOX = torch.tensor([-1.8, -1.8, -0.8]), torch.tensor([1.8, 1.8, 2.8])


def _egg(points: torch.Tensor, view_dirs: torch.Tensor) -> FieldOutput:
    """An egg 2 m tall and 1 m wide, red in front and green behind."""
    scaled = (points - points.new_tensor((0.0, 0.0, 1.0))) / points.new_tensor((0.5, 0.5, 1.0))
    densities = 300.0 * torch.sigmoid((1.0 - scaled.norm(dim=-1)) * 60.0)
    front = (points[:, 1] < 0)[:, None]
    return FieldOutput(
        torch.where(front, points.new_tensor((0.9, 0.1, 0.1)), points.new_tensor((0.1, 0.8, 0.1))), densities
    )


class FakeModel:
    """What `reconstruct` asks of a model."""

    source = Path("weights.safetensors")
    image_size = 64

    def __init__(self, density: float = 1.0) -> None:
        self.density = density

    def encode_drawings(self, drawings, options=None) -> Hero:
        read = read_views(drawings, size=self.image_size, options=options)
        hull = build_hull(read.views, box_min=BOX[0], box_max=BOX[1], grid_size=32)[0]

        def field(points, view_dirs):
            output = _egg(points, view_dirs)
            return replace(output, densities=self.density * output.densities)

        renderer = CulledRenderer(
            quadrature=PiecewiseConstant(), num_coarse=24, num_fine=0, hull_steps=64, memory_mib=64
        )
        return Hero(Scene(FunctionField(field), None, Bounds(*BOX, hull)), read.views, renderer, read)


def draw_eggs(folder: Path) -> dict[str, Path]:
    """Drawings of the egg: red in front, orange from the side, green behind."""
    paths = {}
    for view, color in (("front", "red"), ("side", "orange"), ("back", "green")):
        picture = Image.new("RGB", (200, 260), "white")
        ImageDraw.Draw(picture).ellipse((50, 30, 150, 230), fill=color)
        paths[view] = folder / f"{view}.png"
        picture.save(paths[view])
    return paths
