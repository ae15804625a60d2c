"""The drawings as they are."""

from typing import final

from charnerf.models.views.base import AbstractViews
from charnerf.types import SourceViews


@final
class Turnaround(AbstractViews):
    """Use the drawings given, as the paper."""

    def __call__(self, views: SourceViews) -> SourceViews:
        """Return the views unchanged."""
        return views
