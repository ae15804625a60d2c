"""What fine-tuning leaves in its folder: weights, config, curve, plot and report, whole or not at all."""

from __future__ import annotations

import csv
import math
from dataclasses import asdict, fields
from pathlib import Path

from charnerf.drawings.turnaround import Turnaround
from charnerf.files import write_folder_aside
from charnerf.finetuning.finetune import LEARNING, CurvePoint, Finetuned
from charnerf.finetuning.recipe import Recipe
from charnerf.inference.weights import save_config, save_weights
from charnerf.reporting.blocks import Block, Bullets, Heading, Picture, Table, Text
from charnerf.reporting.document import write_report

ROWS = 12  # of the curve shown in the report; curve.csv has all
OURS, LIKENESS = "#1f5fa8", "#b8641f"


def write_finetuned(done: Finetuned, output: Path, *, recipe: Recipe, drawings: Turnaround | None) -> Path:
    """Write DIR/weights.safetensors, config.yaml, curve.csv, curve.png, report.md and report.html.

    Args:
        done: What fine-tuning gave.
        output: Folder; made if missing, pieces of an earlier one are replaced.
        recipe: The settings that were used.
        drawings: What was assumed about the drawings; None where views came with cameras.

    Returns:
        The report.
    """
    with write_folder_aside(output) as aside:
        save_weights(aside / "weights.safetensors", done.model.network, done.model.config, note=note_of(done))
        save_config(aside, done.model.config)
        write_curve(done, aside / "curve.csv")
        plot_curve(done, aside / "curve.png")
        write_report(aside, "Fine-tuned to one character", report_blocks(done, recipe, drawings, aside))
    return output / "report.html"


def note_of(done: Finetuned) -> str:
    """What the weights' file says about itself."""
    if not done.kept:
        return "The weights that fine-tuning started with: adapted ones were not kept."
    return (
        "Adapted by `charnerf finetune` to one character's drawings: for this character alone, others may "
        "come out worse than by the weights that it started with."
    )


def write_curve(done: Finetuned, path: Path) -> None:
    """Error against seconds, every look."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, [field.name for field in fields(CurvePoint)])
        writer.writeheader()
        writer.writerows(asdict(point) for point in done.curve)


def plot_curve(done: Finetuned, path: Path) -> None:
    """PSNR of held-out patches, and likeness of novel views to the start, against seconds."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    seconds = [point.seconds for point in done.curve]
    label = "held-out patches of the drawings"
    axes.plot(
        seconds, [point.held_out_psnr for point in done.curve], color=OURS, marker="o", ms=3, label=label
    )
    likeness = [(point.seconds, point.likeness) for point in done.curve if math.isfinite(point.likeness)]
    if likeness:
        label = "novel views, against the start"
        axes.plot(*zip(*likeness, strict=True), color=LIKENESS, marker="o", ms=3, label=label)
    axes.axvline(
        done.best.seconds, color="#9aa0a6", linewidth=1.0, label="kept" if done.kept else "start, kept"
    )
    axes.set_xlabel("seconds")
    axes.set_ylabel("PSNR, dB")
    axes.grid(color="#e6e8eb", linewidth=0.8)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=120)


def summary_lines(done: Finetuned) -> list[str]:
    """What happened, sentences for a report or for the terminal."""
    shares = done.left_out.shares()
    step = done.curve[-1].step
    if step == 0:
        return [
            f"No step was made: preparing the drawings took {done.seconds['prepare']:.0f} s, all of the time that was given. Give"
            f" {done.seconds['prepare'] + 30.0:.0f} s."
        ]
    return [
        done.reason,
        f"{step} steps in {sum(done.seconds.values()):.1f} s; the weights of step {done.best.step} are given back.",
        "These weights are for this one character."
        if done.kept
        else "The character is the same as without fine-tuning.",
        f"Left out: {done.num_encodings} encoder passes (the drawings were encoded once), f1 at "
        f"{max(0, done.num_answers - done.num_samples)} of {done.num_answers} samples, "
        f"{100 * (shares['rays'] or 0.0):.0f} % of the drawings' rays (they miss the hull, or memory) and "
        f"{100 * (shares['samples'] or 0.0):.0f} % of their samples.",
    ]


def curve_table(done: Finetuned) -> Table:
    """Error against seconds, thinned out."""
    heads = ("seconds", "step", "held-out error", "held-out PSNR, dB", "novel views to the start, dB")
    rows = []
    every = max(1, -(-len(done.curve) // ROWS))
    for index, point in enumerate(done.curve):
        if index % every and point is not done.best and index != len(done.curve) - 1:
            continue
        mark = " (kept)" if point.step == done.best.step else ""
        likeness = f"{point.likeness:.1f}" if math.isfinite(point.likeness) else "equal"
        cells = [f"{point.seconds:.1f}", f"{point.step}{mark}", f"{point.held_out:.5f}"]
        rows.append([*cells, f"{point.held_out_psnr:.2f}", likeness])
    return Table(heads, rows)


def report_blocks(done: Finetuned, recipe: Recipe, drawings: Turnaround | None, folder: Path) -> list[Block]:
    """The report; its curve lies in the folder."""
    learnt = (
        f"Learnt: {', '.join(LEARNING)} of the finest field. Held out: {100 * recipe.held_out:.0f} % of "
        f"{recipe.patches} x {recipe.patches} patches a drawing, of which nothing was learnt. Novel views: cameras around "
        "the character, against the weights at the start; those of the guard are other ones than those learnt from."
    )
    blocks: list[Block] = [
        Heading("Fine-tuned to one character", 1),
        Bullets(summary_lines(done)),
        Text("Load them by `charnerf.load(DIR)` or `--weights DIR`."),
        Heading("Error against seconds"),
        Picture(folder / "curve.png", "PSNR against seconds"),
        curve_table(done),
        Text(learnt),
        Heading("Recipe"),
        Table(("setting", "value"), [(name, str(value)) for name, value in asdict(recipe).items()]),
    ]
    if drawings is not None:
        blocks += [Heading("What was assumed about the drawings"), Bullets(drawings.assumptions)]
        blocks += [Bullets(drawings.warnings, warnings=True)] if drawings.warnings else []
    stages = [(stage, f"{value:.1f}") for stage, value in done.seconds.items()]
    return [*blocks, Heading("Seconds"), Table(("stage", "seconds"), stages)]
