"""The loss of a training step: the weighted sum of its terms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from charnerf.errors import ConfigError
from charnerf.losses.base import AbstractTerm, Needs, Query
from charnerf.scene import AbstractField
from charnerf.schedule import PhaseSchedule
from charnerf.types import FieldOutput, RenderOutput, TrainBatch


@dataclass(frozen=True)
class Pass:
    """The coarse or the fine pass of a step.

    Attributes:
        rays: Its rendering of the batch's rays, (B, R).
        fields: Its field of each of the B characters.
    """

    rays: RenderOutput
    fields: Sequence[AbstractField]

    def answer(self, query: Query) -> FieldOutput:
        """Colours (B, P, 3) and densities (B, P) at the query's points."""
        triples = zip(self.fields, query.points, query.directions, strict=True)
        answers = [field(points, directions) for field, points, directions in triples]
        return FieldOutput(
            rgb=torch.stack([one.rgb for one in answers]),
            densities=torch.stack([one.densities for one in answers]),
        )


@final
class WeightedLosses:
    """Sum over coarse and fine of weighted terms; what weighs 0 is neither computed nor its data read.

    Args:
        terms: By their names in the config.

    Raises:
        ConfigError: If two terms name a value alike.
    """

    def __init__(self, terms: Mapping[str, AbstractTerm]) -> None:
        self.terms = tuple(terms.values())
        self.weights: dict[str, float] = {}
        for key, term in terms.items():
            for name in term.weights.keys() & self.weights.keys():
                raise ConfigError(f"loss.{key}: found a second value named {name}, expected each name once.")
            self.weights |= term.weights

    @property
    def names(self) -> tuple[str, ...]:
        """Of the values, in the order of the terms."""
        return tuple(self.weights)

    def active(self, overrides: Mapping[str, float]) -> dict[str, float]:
        """Weights above 0 by the names of their values, with a phase's overrides applied."""
        return {name: weight for name, weight in {**self.weights, **overrides}.items() if weight > 0}

    def needs(self, schedule: PhaseSchedule) -> Needs:
        """What the terms read that weigh above 0 in some phase of a run.

        Raises:
            ConfigError: If a phase weighs a value that no term has.
        """
        needs = Needs()
        for index, phase in enumerate(schedule.phases):
            for name in phase.loss_weights.keys() - self.weights.keys():
                raise ConfigError(
                    f"schedule.phases.{index}.loss_weights.{name}: found no such value, expected one of {', '.join(self.names)}."
                )
            active = self.active(phase.loss_weights)
            for term in self.terms:
                if active.keys() & term.weights.keys():
                    needs |= term.needs
        return needs

    def __call__(
        self, passes: Sequence[Pass], batch: TrainBatch, generators: Sequence[torch.Generator]
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """Total () and unweighted values (), each summed over the passes.

        Args:
            passes: The fine one, and the coarse one where there are two.
            batch: Of the step.
            generators: Randomness of the step, of each character, on the CPU.
        """
        weights = self.active(batch.loss_weights)
        values: dict[str, Tensor] = {}
        for term in self.terms:
            if weights.keys().isdisjoint(term.weights):
                continue
            query = term.query(batch, generators)
            for one in passes:
                answer = None if query is None else one.answer(query)
                for name, value in term.values(one.rays, answer, batch).items():
                    if name in weights:
                        values[name] = values[name] + value if name in values else value
        weighted = (weights[name] * value for name, value in values.items())
        return sum(weighted, start=passes[0].rays.rgb.new_zeros(())), values
