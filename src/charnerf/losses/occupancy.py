"""Points in space that the mesh or the pictures label inside or outside."""

from collections.abc import Sequence
from typing import final

import torch
from torch import Tensor

from charnerf.errors import ConfigError
from charnerf.losses.base import AbstractTerm, Needs, Query
from charnerf.losses.terms import balanced_occupancy_error
from charnerf.types import FieldOutput, RenderOutput, TrainBatch
from charnerf.volume.compositing import alphas_from_densities


@final
class Occupancy(AbstractTerm):
    """An interval around a labelled point is opaque inside the character and empty outside (beyond the paper).

    Args:
        weight: Of the term.
        num_points: Labelled points a step, of all characters together.
        delta: Length of the interval, m.

    Raises:
        ConfigError: If the length is not positive.
    """

    def __init__(self, *, weight: float, num_points: int, delta: float) -> None:
        if not delta > 0.0:
            raise ConfigError(f"loss.occupancy.delta: found {delta}, expected more than 0 m.")
        self.weights = {"occupancy": weight}
        self.needs = Needs(space_points=num_points)
        self.delta = delta

    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> Query | None:
        """The batch's labelled points, along no direction."""
        if batch.space is None:
            return None
        return Query(batch.space.points, torch.zeros_like(batch.space.points))

    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """The error, both labels weighing the same."""
        if answer is None or batch.space is None:
            return {}
        alphas = alphas_from_densities(answer.densities, torch.full_like(answer.densities, self.delta))
        return {"occupancy": balanced_occupancy_error(alphas, batch.space.inside)}
