"""Directions enter f1, H and f2, so that density depends on them, as the paper."""

from typing import final

from charnerf.models.density.base import AbstractDensity


@final
class ViewDependentDensity(AbstractDensity):
    """(c, sigma) = f2(H(f1(W(x), d)), d)."""

    f1_sees_directions = True
    combinator_sees_directions = True
    f2_sees_directions = True
