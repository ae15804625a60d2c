"""How drawings are read."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from charnerf.drawings.load import Drawing

Segment = Callable[["Drawing"], "np.ndarray"]
"""Tells the share (H, W) in [0, 1] of each of a drawing's pixels that is figure."""


@dataclass(frozen=True)
class ReadingOptions:
    """What is done to drawings before the model sees them.

    Attributes:
        reconciled: Whether views that disagree are mended, and a missing side guessed; else they are only compared.
        keep_ink: Whether lines along outlines stay, as if they were paint.
        segment: Tells figures from what lies behind them, as `cutout.cut_out` takes it.
    """

    reconciled: bool = True
    keep_ink: bool = False
    segment: Segment | None = None
