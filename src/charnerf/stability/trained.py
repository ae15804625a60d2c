"""What can go wrong in a trained field."""

from collections.abc import Iterator
from dataclasses import dataclass

from charnerf.models.charnerf import CharNeRF
from charnerf.stability.report import CheckCurve, CheckRow
from charnerf.types import Cameras, SourceViews
from charnerf.volume.renderers.base import AbstractRenderer


@dataclass(frozen=True)
class TrainedField:
    """A model with a renderer, the drawings of one character (B = 1) and a camera () that looks at it."""

    network: CharNeRF
    renderer: AbstractRenderer
    views: SourceViews
    camera: Cameras


def check_trained(trained: TrainedField) -> Iterator[CheckRow | CheckCurve]:
    """Rows of a trained field."""
    yield from ()
