"""What a run has written for TensorBoard so far."""

from dataclasses import dataclass, field
from pathlib import Path

from charnerf.reporting.event_file import event_files, read_events
from charnerf.reporting.plots import Line

FOLDER = "tensorboard"
SECONDS = "train/seconds"


@dataclass(frozen=True)
class Picture:
    """A picture as it was last drawn: steps done, and a PNG's bytes."""

    step: int
    content: bytes


@dataclass(frozen=True)
class History:
    """Lines and pictures of a run.

    Attributes:
        points: By tag: values by steps done; below `by_milliseconds` by training milliseconds.
        pictures: The last ones by tag.
    """

    points: dict[str, dict[int, float]] = field(default_factory=dict)
    pictures: dict[str, Picture] = field(default_factory=dict)

    def line(self, tag: str) -> Line:
        """Abscissae and values, in order; of a tag that counts steps the abscissae are training seconds where those are known."""
        own, seconds = sorted(self.points.get(tag, {}).items()), self.points.get(SECONDS, {})
        shown = [(seconds[step], value) for step, value in own if step in seconds]
        return [at for at, _ in shown], [value for _, value in shown]

    def by_time(self, tag: str) -> Line:
        """Training seconds and values of a tag that counts milliseconds."""
        own = sorted(self.points.get(tag, {}).items())
        return [at / 1000.0 for at, _ in own], [value for _, value in own]

    def last(self, tag: str) -> float | None:
        """The newest value, None where there is none."""
        own = self.points.get(tag)
        return own[max(own)] if own else None

    def tags(self, start: str) -> list[str]:
        """Tags of lines that begin so, in order."""
        return sorted(tag for tag in self.points if tag.startswith(start))


def read_history(run: Path) -> History:
    """All that can be read; what is half written is left for the next time, and of a step that came twice the later counts.

    Raises:
        OSError: If a file can not be read.
    """
    history = History()
    for file in event_files(run / FOLDER):
        for _, event in read_events(file):
            for value in event.summary.value:
                if value.HasField("simple_value"):
                    history.points.setdefault(value.tag, {})[event.step] = value.simple_value
                elif value.HasField("image"):
                    history.pictures[value.tag] = Picture(event.step, value.image.encoded_image_string)
    return history
