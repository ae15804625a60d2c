"""What a term of the loss is: what it weighs, what it reads, and the points that it asks the field about."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.types import FieldOutput, RenderOutput, TensorRecord, TrainBatch


@dataclass(frozen=True)
class Needs:
    """What is read of a batch besides rays, colours and alphas; nothing else is opened or drawn.

    Attributes:
        depth: Whether depth pictures are.
        surface: Whether points on the captured surface are.
        space_points: Points in space labelled inside or outside, a step and process, of all its characters together; 0 for none.
    """

    depth: bool = False
    surface: bool = False
    space_points: int = 0

    def __or__(self, other: "Needs") -> "Needs":
        """What either needs."""
        return Needs(
            depth=self.depth or other.depth,
            surface=self.surface or other.surface,
            space_points=max(self.space_points, other.space_points),
        )


@dataclass(frozen=True)
class Query(TensorRecord):
    """Points of every character, (B, P, 3), m, and the directions (B, P, 3), unit or zero, that they are seen along."""

    points: Tensor
    directions: Tensor


class AbstractTerm(ABC):
    """A term of the loss, of one value or several.

    Attributes:
        weights: Of its values, by the names under which they are logged, written to curve.csv and weighed anew by a phase. The
            config sets them as `weight`, or as `..._weight` where there are several.
        needs: What it reads where it weighs above 0.
    """

    weights: Mapping[str, float]
    needs: Needs

    @abstractmethod
    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> Query | None:
        """Points that the field of each pass answers for this term; None where rays are all that it looks at.

        Args:
            batch: Of the step.
            generators: Randomness of the step, of each character, on the CPU.
        """

    @abstractmethod
    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """Unweighted values () of one pass, by name; those are left out whose data the batch lacks.

        Gradients are averaged over the processes of a training, which have as many rays and points each: means over those need
        nothing more. Who divides by another count divides by its `mean_over_processes`.

        Args:
            rays: Rendering of the batch's rays, (B, R).
            answer: The field's answer to the query, (B, P); None without one.
            batch: Of the step.
        """
