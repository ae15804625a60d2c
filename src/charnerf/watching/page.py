"""What the page of a run, or of several, shows: state, error against training time, speed, attention, pictures."""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from charnerf.pictures import save_png
from charnerf.reporting.blocks import Block, Bullets, Files, Heading, Picture, Plot, SideBySide, Table, Text
from charnerf.reporting.formats import cell, seconds_text
from charnerf.reporting.interactive import lines_figure
from charnerf.reporting.meshes import run_meshes
from charnerf.reporting.page import plot_library
from charnerf.reporting.plots import Line, plot_lines
from charnerf.watching.history import History
from charnerf.watching.state import Stage, State
from charnerf.wording import counted

MOST_POINTS = 1000  # of a line
REPORT = "report.html"
LEAST_HEIGHT = 96  # pixels of a picture
PSNR = "validation foreground PSNR, dB"
X = "training seconds (evaluation excluded)"
PICTURES = {
    "val/target_prediction_error_depth_opacity/": "target, prediction, error (white: none), depth and opacity",
    "val/drawings/": "drawings",
}
MEASURES = {"psnr_foreground": PSNR, "psnr": "validation PSNR, dB", "ssim": "validation SSIM"}
Panels = Mapping[str, Mapping[str, Sequence[Line]]]


@dataclass(frozen=True)
class Watched:
    """A run at a moment.

    Attributes:
        folder: Of the run.
        state: How far it is.
        history: What it wrote.
        has_report: Whether its report is there.
    """

    folder: Path
    state: State
    history: History
    has_report: bool


def run_blocks(one: Watched, scratch: Path) -> list[Block]:
    """The page of a run.

    Args:
        one: The run.
        scratch: A folder for pictures that the page embeds.
    """
    state, history = one.state, one.history
    blocks: list[Block] = [Heading(state.name, 1), Text(sentence(state), lead=True), *_warning([state])]
    if one.has_report:
        blocks.append(Files([(f"{Path(state.name).name}/{REPORT}", "of the run, as it was when it ended")]))
    if not history.points:
        return [*blocks, Text("Nothing is written yet: the first point comes after a few steps.")]
    blocks.append(_figures(history))
    blocks += _plot(
        "Error against training time", _errors(history), scratch / "error.png", "Validation, a line a phase"
    )
    blocks += _pictures(history, scratch)
    blocks += run_meshes(one.folder)
    blocks += _plot(
        "What each view counts for",
        _attention(history),
        scratch / "attention.png",
        "Shares at the points of a picture",
    )
    blocks += _plot(
        "Loss", _losses(history), scratch / "loss.png", "Terms before their weights, and the total after them"
    )
    blocks += _plot(
        "Speed", _speed(history), scratch / "speed.png", "Of all processes; shares that were not evaluated"
    )
    blocks += _plot(
        "Memory and learning rate", _means(history), scratch / "means.png", "Of the first process"
    )
    return blocks


def runs_blocks(runs: Sequence[Watched], title: str, has_report: bool, scratch: Path) -> list[Block]:
    """The page of several runs.

    Args:
        runs: By name.
        title: Of the page.
        has_report: Whether a report over all is there.
        scratch: A folder for pictures that the page embeds.
    """
    states = [one.state for one in runs]
    blocks: list[Block] = [Heading(title, 1), Text(f"{stages(states)}.", lead=True), *_warning(states)]
    blocks.append(Table(HEADER, [row(state) for state in states]))
    lines = {
        one.state.name: [_whole_line(one.history)] for one in runs if one.history.tags("by_milliseconds/")
    }
    blocks += _plot(
        "Error against training time", {PSNR: lines}, scratch / "error.png", "Validation, a line a run"
    )
    shown = [
        picture
        for one in runs
        for picture in list(_saved(one.history, scratch / one.state.name, one.state.name))[:1]
    ]
    blocks += [Heading("Pictures"), SideBySide(shown)] if shown else []
    links = [(one.state.name, one.state.stage.value) for one in runs]
    reports = [(REPORT, "over all, as it was when it was written")] if has_report else []
    return [*blocks, Heading("Each run"), Files([*reports, *links])]


HEADER = ("run", "stage", "done", "time left", "steps", "training time", "foreground ↑ dB")


def row(state: State) -> tuple[str, ...]:
    """A state as cells below HEADER."""
    done = cell(None if state.share is None else 100.0 * state.share, "{:.0f} %")
    psnr = cell(state.psnr_foreground, "{:.2f}")
    return (
        state.name,
        state.stage,
        done,
        state.left or "-",
        str(state.steps),
        seconds_text(state.seconds),
        psnr,
    )


def sentence(state: State) -> str:
    """A state in a sentence."""
    done = "" if state.share is None or state.stage.is_over else f", {100.0 * state.share:.0f} %"
    left = f", about {state.left} of training left" if state.left else ""
    reached = (
        ""
        if state.psnr_foreground is None
        else f"; {state.psnr_foreground:.2f} dB on the foreground in validation"
    )
    spent = f"{counted(state.steps, 'step')} in {seconds_text(state.seconds)} of training"
    return f"{state.stage.capitalize()}{done}{left}: {spent}{reached}."


def stages(states: Sequence[State]) -> str:
    """How many runs are at which stage."""
    counts = {stage: sum(state.stage is stage for state in states) for stage in Stage}
    return ", ".join(f"{number} {stage}" for stage, number in counts.items() if number)


def _warning(states: Sequence[State]) -> list[Block]:
    """Runs that nobody works on although they are not done."""
    lines = []
    for state in states:
        if state.stage is Stage.FAILED:
            lines.append(f"{state.name} failed: {state.error or 'its error.txt says why'}")
        elif state.stage is Stage.STOPPED:
            again = (
                "the same command goes on with it, a single run's with its hydra.run.dir and ckpt_path=last"
            )
            lines.append(f"{state.name}: nobody works on it; it was killed or crashed; {again}")
    return [Bullets(lines, warnings=True)] if lines else []


def _figures(history: History) -> Table:
    """The newest values."""
    forms = {
        "val/psnr_foreground": ("foreground ↑ dB", "{:.2f}"),
        "val/psnr": ("PSNR ↑ dB", "{:.2f}"),
        "val/ssim": ("SSIM ↑", "{:.3f}"),
        "train/loss/total": ("loss", "{:.4f}"),
        "train/rays_per_second": ("rays a second", "{:.0f}"),
        "train/left_out/rays": ("rays left out", "{:.1%}"),
        "train/left_out/samples": ("samples left out", "{:.1%}"),
        "train/memory_mib": ("memory, MiB", "{:.0f}"),
        "train/lr": ("learning rate", "{:.2g}"),
    }
    return Table(
        [title for title, _ in forms.values()],
        [[cell(history.last(tag), form) for tag, (_, form) in forms.items()]],
    )


def _errors(history: History) -> Panels:
    """Panels of what is validated, a line a phase."""
    panels = {}
    for name, title in MEASURES.items():
        tags = history.tags(f"by_milliseconds/{name}/")
        panels[title] = {tag.rpartition("/")[2].replace("_", " "): [history.by_time(tag)] for tag in tags}
    return panels


def _whole_line(history: History) -> Line:
    """Foreground PSNR of all phases as one line."""
    lines = [history.by_time(tag) for tag in history.tags("by_milliseconds/psnr_foreground/")]
    points = sorted(point for xs, ys in lines for point in zip(xs, ys, strict=True))
    return [at for at, _ in points], [value for _, value in points]


def _attention(history: History) -> Panels:
    return {
        "share of each view": {
            tag.partition("/")[2]: [history.line(tag)] for tag in history.tags("attention/")
        }
    }


def _losses(history: History) -> Panels:
    return {"loss": _rows(history, *history.tags("train/loss/"))}


def _speed(history: History) -> Panels:
    shares = _rows(history, *history.tags("train/left_out/"))
    return {"rays a second": _rows(history, "train/rays_per_second"), "shares left out": shares}


def _means(history: History) -> Panels:
    return {"memory, MiB": _rows(history, "train/memory_mib"), "learning rate": _rows(history, "train/lr")}


def _rows(history: History, *tags: str) -> dict[str, list[Line]]:
    """Lines by the ends of their tags."""
    return {tag.rpartition("/")[2].replace("_", " "): [history.line(tag)] for tag in tags}


def _plot(title: str, panels: Panels, still: Path, caption: str) -> list[Block]:
    """A diagram with its title; nothing where no panel has a line."""
    thinned = {
        name: {label: [_thinned(line) for line in lines if line[0]] for label, lines in rows.items()}
        for name, rows in panels.items()
    }
    kept = {name: rows for name, rows in thinned.items() if any(rows.values())}
    if not kept:
        return []
    if plot_library() is None:
        plot_lines(kept, still, x=X)
    return [Heading(title), Plot(lines_figure(kept, x=X), Picture(still, caption))]


def _thinned(line: Line) -> Line:
    """A line of fewer points, its newest one among them."""
    xs, ys = line
    step = -(-len(xs) // MOST_POINTS)
    return list(xs[::-1][::step])[::-1], list(ys[::-1][::step])[::-1]


def _pictures(history: History, scratch: Path) -> list[Block]:
    shown = list(_saved(history, scratch, ""))
    return [Heading("Validation pictures"), SideBySide(shown)] if shown else []


def _saved(history: History, folder: Path, name: str) -> Iterator[Picture]:
    """The newest pictures, as files; small ones enlarged."""
    for start, what in PICTURES.items():
        for tag in sorted(tag for tag in history.pictures if tag.startswith(start)):
            one = history.pictures[tag]
            path = folder / f"{tag.replace('/', '_')}.png"
            with Image.open(io.BytesIO(one.content)) as picture:
                factor = -(-LEAST_HEIGHT // picture.height)
                save_png(
                    path,
                    picture.resize(
                        (factor * picture.width, factor * picture.height), Image.Resampling.NEAREST
                    ),
                )
            yield Picture(path, f"{name or tag.rpartition('/')[2]}: {what}, step {one.step}")
