"""A model on a split of a data set, beside what a user has without learning: every number of metrics.json."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal

from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.data.sampler import Share
from charnerf.distributed import gathered
from charnerf.evaluation.character import CharacterResult, FindSurface, measure_character
from charnerf.evaluation.frames import fixed_views
from charnerf.evaluation.lpips import Lpips
from charnerf.evaluation.metrics_file import VIEWS_FILE, split_metrics, write_views
from charnerf.evaluation.nearest import TrainingCharacters
from charnerf.evaluation.pictures import save_pictures
from charnerf.evaluation.side_by_side import measured_side_by_side, processes_worth
from charnerf.models.charnerf import CharNeRF
from charnerf.progress import Progress
from charnerf.volume.renderers.base import AbstractRenderer

ALONE = Share()


def as_captured(character: Character) -> Character:
    """The character with the source views that it has."""
    return character


def evaluate(
    network: CharNeRF,
    renderer: AbstractRenderer,
    root: str | Path,
    split: str,
    *,
    views: int | Literal["all"],
    output: Path | None = None,
    mesh: FindSurface | None = None,
    baselines: bool = True,
    training: TrainingCharacters | None = None,
    train_seconds: float | None = None,
    redrawn: Callable[[Character], Character] = as_captured,
    share: Share = ALONE,
    processes: int | None = 1,
) -> dict[str, Any]:
    """Measure a model on a split; draws a bar with the time left, returns the content of metrics.json.

    Args:
        network: In eval mode.
        renderer: Draws its scenes.
        root: Folder of the data set.
        split: Of the data set.
        views: Fixed views a character, evenly chosen, or "all".
        output: Folder for views.csv, and in images/NAME/ predictions (RGBA, named as the set's pictures) and sheet.png, or None.
        mesh: As `measure_character` takes it; without it figures of surfaces are null.
        baselines: As `measure_character` takes it.
        training: As `measure_character` takes it; without it figures of `nearest` are null.
        train_seconds: Training time to report; None where it is unknown.
        redrawn: Gives a character other source views, such as `drawings.redrawn` does.
        share: Which of the processes that measure the split together this is; each returns the numbers of all.
        processes: How many, of one thread each, share it; all arguments are sent to them. None: as many as are worth their start.

    Raises:
        DataError: If the split is unknown or empty, or a file is missing or wrong.
        NumericalError: If a prediction is not finite; the message names the picture.
    """
    of_one = partial(
        measure_character, network, renderer, mesh=mesh, baselines=baselines, training=training, lpips=Lpips()
    )
    names = names_of(read_dataset(root), split)[share.process :: share.processes]
    processes = processes or processes_worth(len(names), network.device)
    measure = partial(_measured, of_one, Path(root), redrawn, views, output)
    cost = partial(_figure_pixels, Path(root))
    results = _of_all(_every(measure, names, processes, cost, title=f"evaluate {split}"), share)
    if output is not None and share.process == 0:
        write_views(output / VIEWS_FILE, results)
    return split_metrics(
        results, root, split, device=network.device, train_seconds=train_seconds, processes=processes
    )


def _every(
    measure: Callable[..., CharacterResult],
    names: Sequence[str],
    processes: int,
    cost: Callable[[str], float],
    *,
    title: str,
) -> list[CharacterResult]:
    """Measure characters by name, here one by one or in several processes, under a bar with a title."""
    with Progress(title) as progress:
        if min(processes, len(names)) > 1:
            return measured_side_by_side(measure, names, processes, cost=cost, on_share=progress.update)
        counters = [partial(progress.counter, of=(place, len(names))) for place in range(len(names))]
        return [measure(name, counter=counter) for name, counter in zip(names, counters, strict=True)]


def _figure_pixels(root: Path, name: str) -> float:
    """Pixels of a character in its drawings, which most of the work on it goes with."""
    return float(load_character(root, name).sources.images[:, :, 3].sum())


def _uncounted(total: int) -> Callable[[], None]:
    """A counter of pictures that nobody looks at."""
    return lambda: None


def _measured(
    measure: Callable[..., CharacterResult],
    root: Path,
    redrawn: Callable[[Character], Character],
    views: int | Literal["all"],
    output: Path | None,
    name: str,
    *,
    counter: Callable[[int], Callable[[], object]] = _uncounted,
) -> CharacterResult:
    """Measure a character, and keep its pictures in files alone: they take memory."""
    captured = load_character(root, name)
    character = redrawn(captured)
    frames = fixed_views(character, views)
    before = None if character is captured else captured
    result = measure(character, frames, captured=before, on_picture=counter(len(frames)))
    if output is not None:
        save_pictures(output / "images" / character.name, character, frames, result.pictures)
    return replace(result, pictures={})


def _of_all(results: list[CharacterResult], share: Share) -> list[CharacterResult]:
    """The results of all processes, in the order of the split."""
    if share.processes == 1:
        return results
    return [one for turn in zip_longest(*gathered(results)) for one in turn if one is not None]
