"""The loss of a training step: named terms and their weights."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from charnerf.errors import ConfigError
from charnerf.losses.terms import (
    absolute_alpha_error,
    absolute_depth_error,
    balanced_occupancy_error,
    squared_color_error,
    squared_opacity_error,
)
from charnerf.types import RenderOutput, TrainBatch

TERMS = ("reconstruction", "surface_rgb", "surface_alpha", "opacity", "depth", "occupancy")


@dataclass(frozen=True)
class PassOutput:
    """What one field (coarse or fine) answered in a step.

    Attributes:
        rays: The rendering of the rays, (B, R).
        surface_rgb: Colours of the surface points, (B, P, 3), or None.
        surface_alpha: Their alphas, (B, P), or None.
        space_alpha: Alphas of the labelled points, (B, Q), or None.
    """

    rays: RenderOutput
    surface_rgb: Tensor | None
    surface_alpha: Tensor | None
    space_alpha: Tensor | None


@final
class WeightedLosses:
    """Sum over coarse and fine of weighted terms; a term of weight 0 is neither computed nor its data read.

    Args:
        weights: By term: reconstruction, surface_rgb, surface_alpha, opacity, depth, occupancy. Terms not named weigh 0.

    Raises:
        ConfigError: If a term is unknown.

    Source: paper, Final Loss function (reconstruction 1.0; surface_rgb and surface_alpha 0.1); the others are beyond the paper.
    """

    def __init__(self, *, weights: Mapping[str, float]) -> None:
        unknown = sorted(set(weights) - set(TERMS))
        if unknown:
            raise ConfigError(
                f"loss.weights.{unknown[0]}: found an unknown term, expected one of {', '.join(TERMS)}."
            )
        self.weights = dict(weights)

    def active(self, overrides: Mapping[str, float] | None = None) -> dict[str, float]:
        """Terms that count, with a phase's overrides applied."""
        merged = {**self.weights, **(overrides or {})}
        return {term: weight for term, weight in merged.items() if weight > 0}

    def reads(self, term: str) -> bool:
        """Whether a term counts before overrides: what the data must bring."""
        return self.weights.get(term, 0.0) > 0

    def __call__(self, passes: list[PassOutput], batch: TrainBatch) -> tuple[Tensor, dict[str, Tensor]]:
        """Total and unweighted terms (each summed over the passes)."""
        terms: dict[str, Tensor] = {}
        for term in self.active(batch.loss_weights):
            values = [value for one in passes if (value := _term(term, one, batch)) is not None]
            if values:
                terms[term] = sum(values[1:], start=values[0])
        weights = self.active(batch.loss_weights)
        total = sum(
            (weights[term] * value for term, value in terms.items()), start=passes[0].rays.rgb.new_zeros(())
        )
        return total, terms


def _term(term: str, one: PassOutput, batch: TrainBatch) -> Tensor | None:  # noqa: PLR0911 (one line a term)
    """One unweighted term of one pass; None where its data is missing (a character without a mesh)."""
    match term:
        case "reconstruction":
            return squared_color_error(one.rays.rgb, batch.rgb)
        case "opacity":
            return squared_opacity_error(one.rays.opacity, batch.alpha)
        case "depth" if batch.depth is not None:
            return absolute_depth_error(one.rays.depth, batch.depth, one.rays.opacity)
        case "surface_rgb" if one.surface_rgb is not None and batch.surface is not None:
            return squared_color_error(one.surface_rgb, batch.surface.rgb)
        case "surface_alpha" if one.surface_alpha is not None:
            return absolute_alpha_error(one.surface_alpha, one.surface_alpha.new_ones(()))
        case "occupancy" if one.space_alpha is not None and batch.space is not None:
            return balanced_occupancy_error(one.space_alpha, batch.space.inside)
    return None
