"""Foreign data sets written out of ours, in each format's own conventions, of figures whose shape is known."""

import gzip
import json
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from scipy import ndimage

from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.geometry.similarity import Similarity
from charnerf.types import Cameras
from support.figures import CENTRE, figure, photograph

SIZE = 32
AZIMUTHS = (0.0, 90.0, 180.0, 270.0, 30.0, 140.0, 210.0, 320.0)
ELEVATIONS = (5.0, 0.0, 10.0, 0.0, 40.0, 20.0, 30.0, -5.0)


def around(size: int = SIZE) -> Cameras:
    """Eight cameras (8,), float64, the first three near front, side and back."""
    directions = direction_from_angles(torch.tensor(AZIMUTHS), torch.tensor(ELEVATIONS)).double()
    return cameras_towards(
        directions, target=CENTRE.double(), distance=4.0, half_extent=1.2, size=size, orthographic=False
    )


def pictures(cameras: Cameras) -> list[np.ndarray]:
    """RGBA of the figure of legs, body and head, 2 m tall."""
    mesh = figure("person")
    return [photograph(mesh, cameras[index].to(torch.float32)).numpy() for index in range(len(cameras.focal))]


def elsewhere(cameras: Cameras, rotation: np.ndarray, *, scale: float = 0.3) -> Cameras:
    """The same cameras in a world that is smaller, turned and shifted."""
    shift = torch.tensor([0.4, -2.0, 0.7], dtype=torch.float64)
    return Similarity(torch.from_numpy(rotation), scale, shift).cameras(cameras)


def on_white(rgba: np.ndarray) -> np.ndarray:
    """RGB bytes; the figure itself is never pure white."""
    alpha = rgba[..., 3:] / 255.0
    return np.where(alpha > 0.5, np.minimum(rgba[..., :3], 254), 255).astype(np.uint8)


def turn_about_z(degrees: float) -> np.ndarray:
    """Rotation (3, 3)."""
    angle = np.deg2rad(degrees)
    return np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )


def write_nerf_blender(folder: Path, cameras: Cameras, images: list[np.ndarray]) -> None:
    """transforms_{train,val,test}.json with camera_angle_x and names without .png."""
    poses = cameras.world_from_camera.tolist()
    for split, members in (("train", range(4)), ("val", range(4, 6)), ("test", range(6, 8))):
        (folder / split).mkdir(parents=True)
        frames = []
        for index in members:
            Image.fromarray(images[index]).save(folder / split / f"r_{index}.png")
            frames.append(
                {"file_path": f"./{split}/r_{index}", "rotation": 0.01, "transform_matrix": poses[index]}
            )
        angle = 2.0 * np.arctan(0.5 * cameras.width / float(cameras.focal[0, 0]))
        text = json.dumps({"camera_angle_x": angle, "frames": frames})
        (folder / f"transforms_{split}.json").write_text(text)


def write_srn(folder: Path, cameras: Cameras, images: list[np.ndarray]) -> None:
    """rgb/, pose/, intrinsics.txt: OpenCV cameras, opaque pictures on white, intrinsics for pictures four times as large."""
    for sub in ("rgb", "pose"):
        (folder / sub).mkdir(parents=True)
    for index, image in enumerate(images):
        Image.fromarray(on_white(image)).save(folder / f"rgb/{index:06d}.png")
        pose = cameras.world_from_camera[index].numpy() @ np.diag([1.0, -1.0, -1.0, 1.0])
        (folder / f"pose/{index:06d}.txt").write_text(" ".join(map(str, pose.reshape(-1))))
    side = 4 * cameras.width
    focal = 4 * float(cameras.focal[0, 0])
    (folder / "intrinsics.txt").write_text(f"{focal} {side / 2} {side / 2} 0.\n0. 0. 0.\n1.\n{side} {side}\n")


def write_nmr(folder: Path, cameras: Cameras, images: list[np.ndarray]) -> None:
    """image/, mask/, cameras.npz of a world with +Y up."""
    for sub in ("image", "mask"):
        (folder / sub).mkdir(parents=True)
    y_up = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
    focal = 2.0 * float(cameras.focal[0, 0]) / cameras.width
    arrays = {}
    for index, image in enumerate(images):
        Image.fromarray(on_white(image)).save(folder / f"image/{index:04d}.png")
        Image.fromarray(image[..., 3]).save(folder / f"mask/{index:04d}.png")
        pose = y_up @ cameras.world_from_camera[index].numpy() @ np.diag([1.0, -1.0, -1.0, 1.0])
        arrays[f"world_mat_{index}"] = np.linalg.inv(pose)[:3]
        arrays[f"camera_mat_{index}"] = np.diag([focal, focal, 1.0, 1.0])
    np.savez(folder / "cameras.npz", **arrays)


def write_co3d(category: Path, cameras: Cameras, images: list[np.ndarray]) -> None:
    """frame_annotations.jgz with one sequence of a world with y down."""
    y_down = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    entries = []
    (category / "seq").mkdir(parents=True)
    for index, image in enumerate(images):
        Image.fromarray(image[..., :3]).save(category / f"seq/{index}.png")
        Image.fromarray(image[..., 3]).save(category / f"seq/mask_{index}.png")
        pose = cameras.world_from_camera[index].numpy()
        rotation = y_down @ pose[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
        shift = -rotation.T @ (y_down @ pose[:3, 3])
        focal = 2.0 * float(cameras.focal[index, 0]) / cameras.width
        view = {
            "R": rotation.tolist(),
            "T": shift.tolist(),
            "focal_length": [focal, focal],
            "principal_point": [0.0, 0.0],
            "intrinsics_format": "ndc_isotropic",
        }
        name = f"{category.name}/seq"
        entries.append(
            {
                "sequence_name": "seq",
                "frame_number": len(images) - index,  # reversed, so that the file's order is not the frames'
                "image": {"path": f"{name}/{index}.png", "size": [cameras.height, cameras.width]},
                "mask": {"path": f"{name}/mask_{index}.png"},
                "viewpoint": view,
            }
        )
    (category / "frame_annotations.jgz").write_bytes(gzip.compress(json.dumps(entries).encode()))


def write_nerfstudio(folder: Path, cameras: Cameras, images: list[np.ndarray], **keys: object) -> None:
    """transforms.json with shared intrinsics, masks and opaque pictures."""
    (folder / "images").mkdir(parents=True)
    (folder / "masks").mkdir()
    frames = []
    for index, image in enumerate(images):
        Image.fromarray(image[..., :3]).save(folder / f"images/frame_{index:05d}.png")
        Image.fromarray(image[..., 3]).save(folder / f"masks/frame_{index:05d}.png")
        frames.append(
            {
                "file_path": f"images/frame_{index:05d}.png",
                "mask_path": f"masks/frame_{index:05d}.png",
                "transform_matrix": cameras.world_from_camera[index].tolist(),
            }
        )
    (focal_x, focal_y), (centre_x, centre_y) = cameras.focal[0].tolist(), cameras.principal_point[0].tolist()
    content = {
        **{"camera_model": "OPENCV", "w": cameras.width, "h": cameras.height},
        **{"fl_x": focal_x, "fl_y": focal_y, "cx": centre_x, "cy": centre_y},
        **{"k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0},
        **keys,
        "frames": frames,
    }
    (folder / "transforms.json").write_text(json.dumps(content))


def looking_along_z(cameras: Cameras) -> Cameras:
    """The same cameras with poses as OpenCV writes them."""
    flip = torch.tensor([1.0, -1.0, -1.0, 1.0], dtype=torch.float64)
    return Cameras(**{**vars(cameras), "world_from_camera": cameras.world_from_camera * flip})


def through_lens(
    image: np.ndarray, focal: float, *, k1: float, k2: float, p1: float, p2: float
) -> np.ndarray:
    """What a lens shows of a pinhole's picture with its centre in the middle: each pixel's ray by fixed-point iteration."""
    side = image.shape[0]
    grid = (np.arange(side) + 0.5 - side / 2) / focal
    bent_x, bent_y = np.meshgrid(grid, grid)
    x, y = bent_x.copy(), bent_y.copy()
    for _ in range(50):
        square = x * x + y * y
        radial = 1 + k1 * square + k2 * square**2
        x = (bent_x - 2 * p1 * x * y - p2 * (square + 2 * x * x)) / radial
        y = (bent_y - p1 * (square + 2 * y * y) - 2 * p2 * x * y) / radial
    at = np.stack((y, x)) * focal + side / 2 - 0.5
    channels = [
        ndimage.map_coordinates(image[..., one].astype(float), at, order=1, cval=0.0) for one in range(4)
    ]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def with_focal(cameras: Cameras, focal: torch.Tensor) -> Cameras:
    """The same cameras (N,) with focal lengths (N,), pixels, of their own."""
    return Cameras(**{**vars(cameras), "focal": focal.double()[:, None].expand(-1, 2)})
