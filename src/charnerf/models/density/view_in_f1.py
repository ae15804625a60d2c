"""Directions enter f1 alone, as pixelNeRF: density depends on them, H and f2 do not see them."""

from typing import final

from charnerf.models.density.base import AbstractDensity


@final
class ViewInF1Density(AbstractDensity):
    """(c, sigma) = f2(H(f1(W(x), d))).

    Source: pixelNeRF (Yu 2021), whose first layer alone reads the direction.
    """

    f1_sees_directions = True
    combinator_sees_directions = False
    f2_sees_directions = False
