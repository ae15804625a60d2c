"""What a benchmark is run on: networks, characters and where its pictures go; references are computed when first asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

from torch import Tensor

from charnerf.bench.headline import Referenced, Workbench, prepared_characters, prepared_kinds
from charnerf.bench.subjects import Pictured, Subject, embedded, of_dataset

NUM_CHARACTERS = 4


class Setting:
    """Characters and networks of one benchmark.

    Args:
        bench: Networks and renderers.
        data: Data set of the characters; embedded ones if None.
        split: Of the data set.
        output: Folder for diagrams.
        say: Told what is being done.
    """

    def __init__(
        self, bench: Workbench, data: Path | None, split: str, output: Path, say: Callable[[str], None]
    ) -> None:
        self.bench, self.say = bench, say
        self._data, self._split, self._output = data, split, output

    @property
    def label(self) -> str:
        """What the characters are, in words."""
        return "embedded" if self._data is None else f"{self._data.name}, split {self._split}"

    def picture(self, name: str) -> Path:
        """Where a diagram goes; those of a data set bear its name."""
        return self._output / (
            f"{name}.png" if self._data is None else f"{name}_{self._data.name}_{self._split}.png"
        )

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
    def characters(self) -> list[Referenced]:
        """Characters with converged colours."""
        pictured = self.pictured
        self.say("converged references of characters")
        return prepared_characters(self.bench, pictured)

    @cached_property
    def kinds(self) -> list[Referenced]:
        """Kinds of scene with converged colours."""
        self.say("converged references of kinds of scene")
        return prepared_kinds(self.bench)

    def split_characters(self) -> tuple[list[Subject], list[Tensor]]:
        """Characters and references apart."""
        return [one for one, _ in self.characters], [truth for _, truth in self.characters]
