"""Cameras against silhouettes: who disagrees, and what would bring agreement."""

from collections.abc import Callable, Iterator
from statistics import median

import numpy as np
import torch
from torch import Tensor

from charnerf.doctor.consensus import COVERED, Consensus, carving_views, consensus, disagreeing
from charnerf.doctor.finding import Finding
from charnerf.doctor.repairs import mirror_command, pose_command
from charnerf.doctor.views import Patient, Seen
from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.carving import INSIDE
from charnerf.geometry.world import BOX_HALF_EXTENT, CENTRE, HEIGHT
from charnerf.types import Cameras

LEAST_VIEWS = 4
OFF_SCALE = 0.08  # of a drawing's size
STANDING = 0.25  # m: hulls of views from above are open below
OPENGL_OF_OPENCV = torch.diag(torch.tensor((1.0, -1.0, -1.0, 1.0), dtype=torch.float64))


def _transposed_rotations(poses: Tensor) -> Tensor:
    turned = poses.clone()
    turned[:, :3, :3] = poses[:, :3, :3].mT
    return turned


CONVENTIONS: dict[str, tuple[str, str, Callable[[Tensor], Tensor]]] = {  # by the repair's name: fault, fix, change
    "opencv": (
        "OpenCV for OpenGL cameras", "Negate the second and third columns of the poses.", lambda poses: poses @ OPENGL_OF_OPENCV,
    ),
    "inverse": ("inverse poses", "Invert the poses: these are camera_from_world.", torch.linalg.inv),
    "inverse opencv": (
        "inverse poses", "Invert the poses (these are camera_from_world, as COLMAP writes them), and negate the second and third"
        " columns.", lambda poses: torch.linalg.inv(poses) @ OPENGL_OF_OPENCV,
    ),
    "transposed rotations": ("row for column", "Transpose the rotations.", _transposed_rotations),
}  # fmt: skip


def geometry_findings(patient: Patient, sight: Seen) -> tuple[list[Finding], Seen | None]:
    """What is wrong with the cameras of a character, and the views that agree; None where these are not known."""
    kept = (sight.alphas > INSIDE).flatten(1).any(1).nonzero()[:, 0]
    if len(kept) < LEAST_VIEWS:
        return [], None
    sight = Seen(
        tuple(sight.views[one] for one in kept.tolist()),
        sight.cameras[kept],
        sight.alphas[kept],
        sight.rgb[kept.numpy()],
    )
    carving = carving_views(sight.cameras)
    first = consensus(sight.cameras, sight.alphas, carving)
    if first is not None and first.agrees:
        return list(_frame_findings(patient, sight, first)), sight
    by_convention = _convention(patient, sight, carving, first)
    if by_convention is not None:
        return [by_convention], None
    blamed = (
        disagreeing(sight.cameras, sight.alphas, carving)
        if first is None or float(first.covered.mean()) > 0.0
        else None
    )
    if blamed is None:
        worst = 0.0 if first is None else float(first.covered.mean())
        return [
            Finding(
                "misaligned cameras", str(patient.camera_file or patient.folder),
                f"silhouettes whose common hull covers {100 * worst:.0f} % of them in the mean, by no few views' fault",
                f"{100 * COVERED:.0f} % or more in every view",
                "Calibrate again, or check that pictures and poses are in one order.",
                picture=None if first is None else overlay(sight, int(first.covered.argmin()), first),
            )
        ], None  # fmt: skip
    views, agreed = blamed
    agreeing = torch.tensor([view for view in range(len(sight.views)) if view not in views])
    cut = 0.0 if first is None else float(first.covered.min())
    return [one for view in views for one in _of_view(sight, view, agreed, views, cut)], _some(
        sight, agreeing
    )


def overlay(sight: Seen, view: int, hull: Consensus) -> np.ndarray:
    """A picture with what the hull does not cover in red and what only the hull shows in blue."""
    mask, shown = (sight.alphas[view] > INSIDE).numpy(), hull.shown[view].numpy()
    rgb = (0.6 * sight.rgb[view] + 0.4 * 255.0).astype(np.uint8)
    rgb[mask & ~shown] = (220, 30, 30)
    rgb[shown & ~mask] = (170, 190, 250)
    return rgb


def _convention(patient: Patient, sight: Seen, carving: list[int], first: Consensus | None) -> Finding | None:
    """The convention by which all views agree, if it is not the stated one."""
    stated = 0.0 if first is None else float(first.covered.mean())
    for repair, (fault, fix, change) in CONVENTIONS.items():
        poses = change(sight.cameras.world_from_camera)
        cameras = Cameras(**{**vars(sight.cameras), "world_from_camera": poses})
        changed = consensus(cameras, sight.alphas, carving)
        if (
            changed is not None
            and float(changed.covered.mean()) >= COVERED
            and float(changed.covered.mean()) > stated + 0.02
        ):
            return Finding(
                fault, str(patient.camera_file or patient.folder),
                f"silhouettes whose common hull covers {100 * stated:.0f} % of them as the poses stand, and"
                f" {100 * float(changed.covered.mean()):.0f} % as {repair}",
                "world_from_camera of OpenGL cameras (+X right, +Y up, looking along -Z)", fix,
                pose_command(repair, patient.camera_file),
                picture=overlay(Seen(sight.views, cameras, sight.alphas, sight.rgb), 0, changed),
            )  # fmt: skip
    return None


def _of_view(sight: Seen, view: int, hull: Consensus, blamed: list[int], cut: float) -> Iterator[Finding]:
    """What is wrong with one view that disagrees with all others."""
    one, mask = sight.views[view], sight.alphas[view] > INSIDE
    evidence = (
        f"a silhouette of which the other views' hull covers {100 * float(hull.covered[view]):.0f} %, and which leaves"
        f" {100 * cut:.0f} % of another one"
    )
    picture, all_of_it = overlay(sight, view, hull), f"{100 * COVERED:.0f} % or more"
    partner = next(
        (two for two in blamed if two != view and hull.fits(view, sight.alphas[two] > INSIDE)), None
    )
    if partner is not None:
        if partner > view:
            yield Finding(
                "pictures in another order", str(one.file), f"{evidence}, and all of {sight.views[partner].file.name}",
                all_of_it, "Exchange the two pictures.", picture=picture,
            )  # fmt: skip
        return
    shift = round(float(2.0 * sight.cameras.principal_point[view, 0])) - mask.shape[-1]
    if hull.fits(view, torch.roll(mask.flip(-1), shift, dims=-1)):
        yield Finding(
            "mirrored picture", str(one.file), f"{evidence}, and all of it flipped left to right",
            all_of_it, "Flip the picture.", mirror_command(one.file), picture,
        )  # fmt: skip
        return
    ratio = _tallness(sight, view, hull) / _usual_tallness(sight, view, hull, blamed)
    if abs(ratio - 1.0) > OFF_SCALE:
        yield Finding(
            "different scale", str(one.file), f"a figure {ratio:.2f} times as tall as the other views say; {evidence}",
            "1.00 times", f"Scale the picture by {1.0 / ratio:.3f}, or multiply its fl_x and fl_y by {ratio:.3f}.", picture=picture,
        )  # fmt: skip
        return
    own, expected = _box(mask), _projected_box(sight.cameras[view : view + 1], hull)
    middle = 0.5 * (own[:2] + own[2:] - expected[:2] - expected[2:])
    angle = float(torch.rad2deg(torch.atan(middle.norm() / sight.cameras.focal[view].mean())))
    amount = "" if one.is_orthographic else f" ({angle:.1f} degrees)"
    yield Finding(
        "misaligned camera", one.key, f"{evidence}, its middle {float(middle.norm()):.0f} of {mask.shape[-1]} pixels{amount} off",
        all_of_it, "Calibrate this view again, or take it out.", picture=picture,
    )  # fmt: skip


def _frame_findings(patient: Patient, sight: Seen, hull: Consensus) -> Iterator[Finding]:
    """Where the figure stands in our frame, and whether rays reach all of it."""
    low, high = hull.points.amin(0) - 0.5 * hull.cell, hull.points.amax(0) + 0.5 * hull.cell
    inside = (
        (sight.cameras.world_from_camera[:, :3, 3] > low) & (sight.cameras.world_from_camera[:, :3, 3] < high)
    ).all(-1)
    if bool((inside & ~sight.cameras.orthographic).any()):
        view = sight.views[int(inside.nonzero()[0, 0])]
        yield Finding(
            "near and far cut", view.key, "a camera inside the figure's box", "one outside", "Move it back."
        )
    if not patient.in_our_frame:
        return
    box = ", ".join(f"{float(a):.2f} to {float(b):.2f}" for a, b in zip(low, high, strict=True))
    reach = torch.maximum(high - low.new_tensor(CENTRE), low.new_tensor(CENTRE) - low)
    stands = abs(float(low[2])) <= STANDING and abs(float(high[2]) - HEIGHT) <= STANDING
    if bool((high - low > 2.0 * BOX_HALF_EXTENT).any()) or (stands and bool((reach > BOX_HALF_EXTENT).any())):
        yield Finding(
            "near and far cut", str(patient.folder), f"a figure at x, y, z = {box} m",
            f"one within {BOX_HALF_EXTENT} m of {CENTRE}",
            "Rays end there: scale it to 2 m on z = 0, or train with a larger model.box_half_extent.",
            "charnerf capture MESH -o DATASET --split SPLIT",
        )  # fmt: skip
    elif not stands:
        yield Finding(
            "wrong frame", str(patient.folder), f"a figure at x, y, z = {box} m", "one from z = 0 to z = 2 m, +Z up",
            "Turn its y axis up to z, and scale it to 2 m.", "charnerf capture MESH -o DATASET --split SPLIT --up y",
        )  # fmt: skip


def _some(sight: Seen, index: Tensor) -> Seen:
    views = tuple(sight.views[one] for one in index.tolist())
    return Seen(views, sight.cameras[index], sight.alphas[index], sight.rgb[index.numpy()])


def _tallness(sight: Seen, view: int, hull: Consensus) -> float:
    """Height of a view's figure over that of the hull, which is taller than the figure by some cells."""
    own = _box(sight.alphas[view] > INSIDE)
    expected = _projected_box(sight.cameras[view : view + 1], hull)
    return float((own[3] - own[1]) / (expected[3] - expected[1]))


def _usual_tallness(sight: Seen, view: int, hull: Consensus, blamed: list[int]) -> float:
    """The same of the views that agree, of its kind if there are any, in the median."""
    right = [one for one in range(len(sight.views)) if one not in blamed]
    alike = [one for one in right if sight.views[one].is_orthographic == sight.views[view].is_orthographic]
    return median(_tallness(sight, one, hull) for one in alike or right)


def _box(mask: Tensor) -> Tensor:
    y, x = mask.nonzero().double().unbind(-1)
    return torch.stack((x.amin(), y.amin(), x.amax() + 1.0, y.amax() + 1.0))


def _projected_box(camera: Cameras, hull: Consensus) -> Tensor:
    """Box (4,) of the hull's cells in a camera's picture."""
    pixels, _, _ = project_into_all(camera.to(torch.float64), hull.points)
    return torch.cat((pixels[:, 0].amin(0), pixels[:, 0].amax(0)))
