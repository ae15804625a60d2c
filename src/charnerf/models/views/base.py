"""Which views the model conditions on, given the drawings."""

from abc import ABC, abstractmethod

from charnerf.types import SourceViews


class AbstractViews(ABC):
    """A rule from the drawings given to the source views used."""

    @abstractmethod
    def __call__(self, views: SourceViews) -> SourceViews:
        """Return the source views to use."""
