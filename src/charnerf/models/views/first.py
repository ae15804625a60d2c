"""The first few drawings."""

from typing import final

from charnerf.errors import ConfigError
from charnerf.models.views.base import AbstractViews
from charnerf.types import SourceViews


@final
class FirstViews(AbstractViews):
    """Use the first drawings in the order front, side, back, and no other.

    Args:
        count: How many at most, at least 1.
    """

    def __init__(self, *, count: int) -> None:
        if count < 1:
            raise ConfigError(f"views.count: found {count}, expected at least 1.")
        self.count = count

    def __call__(self, views: SourceViews) -> SourceViews:
        """Return views (B, count)."""
        return views[:, : self.count]
