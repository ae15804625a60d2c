"""Drawings and weights to a folder of adapted weights: what `charnerf finetune` does."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from charnerf.drawings.turnaround import Picture
from charnerf.drawings.viewpoints import Viewpoint
from charnerf.errors import DataError
from charnerf.files import check_folder
from charnerf.finetuning.finetune import CurvePoint, Finetuned, finetune
from charnerf.finetuning.recipe import Recipe
from charnerf.finetuning.report import summary_lines, write_finetuned
from charnerf.inference.hero import Hero
from charnerf.inference.model import Model
from charnerf.progress import Progress


def refine(model: Model, hero: Hero, seconds: float, *, progress: Progress) -> Finetuned:
    """Fine-tune in a stage that shows how the held-out patches fare."""

    def on_progress(share: float, point: CurvePoint) -> None:
        progress.update(share, note=f"held out {point.held_out_psnr:.1f} dB")

    return finetune(model, hero, replace(Recipe(), seconds=seconds), on_progress=on_progress)


def finetune_drawings(
    model: Model,
    given: Mapping[Viewpoint, Picture],
    *,
    output: Path,
    seconds: float,
    say: Callable[[str], object],
) -> Finetuned:
    """Adapt a model to a character's drawings and write the folder.

    Args:
        model: Starting weights.
        given: Drawings by where they are seen from.
        output: Folder; made if missing.
        seconds: Time for it.
        say: Gets what was assumed and what happened, sentence by sentence.

    Raises:
        DataError: If a drawing can not be used, the folder can not be written, or the time ends before the first step.
    """
    check_folder(output)
    hero = model.encode_drawings(given)
    drawings = hero.turnaround
    assert drawings is not None  # encode made it
    for line in (*drawings.assumptions, *(f"warning: {one}" for one in drawings.warnings)):
        say(line)
    with Progress("fine-tune", {"fine-tune": seconds}, in_seconds=True) as progress:
        done = refine(model, hero, seconds, progress=progress)
    if done.curve[-1].step == 0:
        raise DataError(
            f"--seconds: found {seconds:g}, but preparing the drawings took {done.seconds['prepare']:.0f} s here and no step was"
            f" made, expected time to learn; nothing was written. Give --seconds {done.seconds['prepare'] + 30.0:.0f}."
        )
    write_finetuned(done, output, recipe=replace(Recipe(), seconds=seconds), drawings=drawings)
    for line in summary_lines(done):
        say(line)
    return done
