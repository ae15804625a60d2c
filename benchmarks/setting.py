"""What a benchmark is run on: the model, its characters, and where diagrams go; what costs time is made when first read."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

from benchmarks.kinds import subjects_by_kind
from charnerf.bench.subjects import NUM_CHARACTERS, Pictured, Subject, embedded, of_dataset, prepared
from charnerf.bench.workbench import Workbench, workbench
from charnerf.inference.model import Model

EMBEDDED = "embedded"


class Setting:
    """Model and characters of one run of the benchmarks.

    Args:
        model: The trained model.
        data: Data set of the characters; embedded ones if None.
        split: Of the data set.
        output: Folder for diagrams.
        say: Gets a line at every stage.
    """

    def __init__(
        self, model: Model, data: Path | None, split: str, output: Path, say: Callable[[str], None]
    ) -> None:
        self.model, self.say = model, say
        self._data, self._split, self._output = data, split, output

    @property
    def label(self) -> str:
        """What the characters are, in words."""
        return EMBEDDED if self._data is None else f"{self._data.name}, split {self._split}"

    def picture(self, name: str) -> Path:
        """Where a diagram goes."""
        return self._output / diagram(name, self.label)

    @cached_property
    def bench(self) -> Workbench:
        """Renderers of the model."""
        return workbench(self.model)

    @cached_property
    def pictured(self) -> list[Pictured]:
        """The first characters, each with a target picture."""
        self.say("capturing")
        if self._data is None:
            return embedded(NUM_CHARACTERS, self.bench.image_size)
        return of_dataset(self._data, self._split, NUM_CHARACTERS)

    @property
    def every(self) -> list[Pictured]:
        """All characters of the split; of embedded ones the first."""
        return self.pictured if self._data is None else of_dataset(self._data, self._split, None)

    @cached_property
    def characters(self) -> list[Subject]:
        """Characters with converged colors."""
        pictured = self.pictured
        self.say("converged references of characters")
        return prepared(self.bench.network, pictured)

    @cached_property
    def kinds(self) -> list[Subject]:
        """Kinds of scene."""
        return subjects_by_kind(self.bench.network, size=self.bench.image_size)


def diagram(name: str, characters: str) -> str:
    """File name of a diagram; those of a data set bear its name and split."""
    return f"{name}.png" if characters == EMBEDDED else f"{name}_{characters.replace(', split ', '_')}.png"
