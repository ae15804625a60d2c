"""One picture of a figure moved smoothly onto another one's outline and colours.

Flows are (2, S, S), down and right: where a pixel of the fixed picture comes from in the moving one, relative to its
place, in shares of the canvas' side, so that one flow serves canvases of any size.
"""

import numpy as np
from PIL import Image
from scipy import ndimage
from skimage.color import rgb2lab
from skimage.registration import optical_flow_tvl1

SIDE = 128  # pixels of the canvases that flows are found on
OUTLINE_WEIGHT, BRIGHTNESS_WEIGHT = 0.6, 0.4
REACH = 16.0 / 128.0  # share of the side beyond which a pixel's distance from the outline pulls no more
ATTACHMENT = 8.0  # of TV-L1; twice as much fits outlines better and tears colours, see docs/drawings.md


def find_flow(fixed: np.ndarray, moving: np.ndarray) -> np.ndarray:
    """Find the flow from a fixed picture to a moving one, by outline and brightness.

    Args:
        fixed: RGBA (S, S, 4) in [0, 1], straight alpha.
        moving: RGBA (S, S, 4).

    Returns:
        (2, SIDE, SIDE), float32, shares of the side.

    Source: TV-L1 optical flow (Zach, Pock, Bischof 2007), scikit-image's.
    """
    flow = optical_flow_tvl1(
        _landscape(resized(fixed, SIDE)),
        _landscape(resized(moving, SIDE)),
        attachment=ATTACHMENT,
        num_warp=8,
        num_iter=15,
    )
    return (np.asarray(flow) / SIDE).astype(np.float32)


def warped(rgba: np.ndarray, flow: np.ndarray) -> np.ndarray:
    """Move a picture (S, S, 4) along a flow of any size: RGBA with straight alpha, bilinear on premultiplied colours."""
    side = rgba.shape[0]
    down, right = (
        side * np.asarray(Image.fromarray(one).resize((side, side), Image.Resampling.BILINEAR))
        for one in flow
    )
    rows, columns = np.mgrid[:side, :side].astype(np.float32)
    weighted = premultiplied(rgba)
    moved = np.stack(
        [
            ndimage.map_coordinates(weighted[..., c], (rows + down, columns + right), order=1)
            for c in range(4)
        ],
        axis=-1,
    )
    alpha = moved[..., 3:]
    return np.concatenate((moved[..., :3] / np.maximum(alpha, 1e-3), alpha), axis=-1).clip(0.0, 1.0)


def filled(rgba: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """A figure (S, S, 4) given another outline (S, S): where it has no colour of its own it takes the nearest one."""
    inside = ndimage.binary_erosion(
        rgba[..., 3] > 0.9
    )  # the outermost pixels are mixed with the ground, or ink
    if not inside.any():
        inside = rgba[..., 3] > 0.5
    nearest = ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
    keep = (rgba[..., 3] > 0.9)[..., None]
    colors = np.where(keep, rgba[..., :3], rgba[..., :3][tuple(nearest)])
    return np.concatenate((colors, alpha[..., None]), axis=-1).astype(np.float32)


def premultiplied(rgba: np.ndarray) -> np.ndarray:
    """Straight-alpha pixels (..., 4) with their colours weighted by alpha."""
    return np.concatenate((rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]), axis=-1)


def resized(rgba: np.ndarray, side: int) -> np.ndarray:
    """A canvas (S, S, 4) at another size, antialiased on premultiplied colours."""
    if rgba.shape[0] == side:
        return rgba
    weighted = premultiplied(rgba).astype(np.float32)
    small = np.stack(
        [
            np.asarray(
                Image.fromarray(np.ascontiguousarray(weighted[..., c])).resize(
                    (side, side), Image.Resampling.BOX if side < rgba.shape[0] else Image.Resampling.BILINEAR
                )
            )
            for c in range(4)
        ],
        axis=-1,
    )
    return np.concatenate((small[..., :3] / np.maximum(small[..., 3:], 1e-3), small[..., 3:]), axis=-1).clip(
        0.0, 1.0
    )


def _landscape(rgba: np.ndarray) -> np.ndarray:
    """What the flow compares: distance from the outline, and brightness on white, (SIDE, SIDE)."""
    inside = rgba[..., 3] > 0.5
    reach = REACH * SIDE
    signed = ndimage.distance_transform_edt(inside) - ndimage.distance_transform_edt(~inside)
    on_white = rgba[..., :3] * rgba[..., 3:] + 1.0 - rgba[..., 3:]
    brightness = rgb2lab(on_white)[..., 0] / 100.0
    return OUTLINE_WEIGHT * np.clip(signed, -reach, reach) / reach + BRIGHTNESS_WEIGHT * brightness
