"""Which pixels of the drawings are held out: whole patches, because neighbouring pixels know each other."""

import torch
from torch import Tensor

from charnerf.errors import DataError


def held_out_patches(height: int, width: int, *, patches: int, share: float, seed: int) -> Tensor:
    """Mask (height, width), True where held out.

    The picture is divided into `patches` x `patches` nearly equal ones. Along each row of them, one patch of
    every run of 1 / share is drawn, so that the held-out ones are spread over the whole picture.

    Args:
        height: Pixels.
        width: Pixels.
        patches: Patches along a side.
        share: Of the patches, in (0, 1).
        seed: Of the draw.

    Raises:
        DataError: If a patch would have no pixel.
    """
    if patches < 1 or patches > min(height, width):
        raise DataError(
            f"patches: found {patches} along {min(height, width)} pixels, expected 1 or more a patch."
        )
    generator = torch.Generator().manual_seed(seed)
    run = max(2, round(1.0 / share))
    order = torch.arange(patches * patches)
    draws = torch.randint(run, (-(-len(order) // run),), generator=generator)
    chosen = (order % run == draws[order // run]).reshape(patches, patches)
    rows = torch.arange(height) * patches // height
    columns = torch.arange(width) * patches // width
    return chosen[rows][:, columns]
