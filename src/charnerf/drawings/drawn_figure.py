"""A figure on its way from its drawing to a source view."""

from dataclasses import dataclass

from charnerf.drawings.align import FigureBox
from charnerf.drawings.cutout import Cutout
from charnerf.drawings.load import Drawing
from charnerf.drawings.viewpoints import Viewpoint


@dataclass(frozen=True)
class DrawnFigure:
    """One figure on its way.

    Attributes:
        viewpoint: Where it is seen from.
        drawing: What it was cut out of.
        cutout: The figure alone.
        box: Where it is.
        is_guessed: Whether nobody drew it.
    """

    viewpoint: Viewpoint
    drawing: Drawing
    cutout: Cutout
    box: FigureBox
    is_guessed: bool = False

    @property
    def name(self) -> str:
        """What the view is."""
        return f"{self.viewpoint.name}, guessed" if self.is_guessed else self.viewpoint.name
