"""TensorBoard's event files of a run that goes on: what came after its checkpoint is forgotten, so that no step comes twice."""

from collections.abc import Callable
from pathlib import Path

from tensorboard.compat.proto.event_pb2 import Event
from tensorboard.summary.writer.record_writer import RecordWriter

from charnerf.files import write_aside
from charnerf.reporting.event_file import event_files, read_events


def forget(folder: Path, keeps: Callable[[str, int], bool]) -> None:
    """Drop events; each file stays as it is, or becomes a whole one with fewer, or goes. The end of a cut-off one is not read.

    Args:
        folder: Of the event files; none where it is not there.
        keeps: Whether to keep what has a tag and a step.
    """
    for file in event_files(folder):
        events = list(read_events(file))
        kept = [content for content, event in events if _is_kept(event, keeps)]
        if len(kept) <= 1:  # the first says the version
            file.unlink()
        elif len(kept) < len(events):
            with write_aside(file) as aside, aside.open("wb") as stream:
                writer = RecordWriter(stream)
                for content in kept:
                    writer.write(content)


def _is_kept(event: Event, keeps: Callable[[str, int], bool]) -> bool:
    return all(keeps(value.tag, event.step) for value in event.summary.value)
