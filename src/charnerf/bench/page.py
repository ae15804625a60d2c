"""The page of a benchmark: targets, tables and diagrams of all parts that were measured, between two marks of a Markdown file."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from charnerf.bench.baseline import NUM_COARSE, NUM_FINE
from charnerf.bench.rendering import BASELINE
from charnerf.bench.tables import comparison_table, headline_table, markdown
from charnerf.bench.targets import target_rows
from charnerf.errors import DataError
from charnerf.files import write_text

BEGIN, END = "<!-- figures: written by `charnerf bench` -->", "<!-- end of figures -->"
TITLE = "# Error against run time"
EMBEDDED = "embedded"
BASELINE_SETTING = f"{NUM_COARSE} + {NUM_FINE}"


def write_page(page: Path, parts: Sequence[dict[str, Any]], *, pictures: Path) -> None:
    """Write the parts between the marks of a page; a page that is not there is begun.

    Args:
        page: Markdown file.
        parts: As bench.json holds them, in order.
        pictures: Folder of the diagrams.

    Raises:
        DataError: If the page is there and lacks its marks.
    """
    text = page.read_text(encoding="utf-8") if page.is_file() else f"{TITLE}\n\n{BEGIN}\n{END}\n"
    if BEGIN not in text or END not in text.partition(BEGIN)[2]:
        raise DataError(
            f"{page}: found no lines '{BEGIN}' and '{END}', expected both; add them where the tables go."
        )
    start = text.index(BEGIN)
    end = text.index(END, start)
    page.parent.mkdir(parents=True, exist_ok=True)
    folder = os.path.relpath(pictures, page.parent)
    write_text(page, f"{text[:start]}{BEGIN}\n\n{measured(parts, Path(folder))}\n\n{text[end:]}")


def measured(parts: Sequence[dict[str, Any]], pictures: Path) -> str:
    """Markdown of all parts."""
    lines = []
    rows = target_rows({one["part"]: one["result"] for one in parts if one["characters"] == EMBEDDED})
    if rows:
        lines += ["## What was asked, and what it reads", markdown(("asked", "reads", "met"), rows)]
    for one in parts:
        title, show = SECTIONS[one["part"]]
        if one["part"] == "headline" and one["characters"] != EMBEDDED:
            show = _headline_again
        where = "" if one["characters"] == EMBEDDED else f": {one['characters']}"
        lines += [f"## {title}{where}", *show(one["result"], _suffixed(pictures, one["characters"]))]
    return "\n\n".join([*lines, "## Machine", _machines(parts)])


def _machines(parts: Sequence[dict[str, Any]]) -> str:
    """Where each part was measured."""
    rows = []
    for one in parts:
        known = one["environment"]
        rows.append(
            (
                one["part"],
                one["characters"],
                known["machine"] if known["device"] == "cpu" else f"{known['device']}, {known['machine']}",
                known["threads"],
                known["torch"],
                one["weights"],
                one["seconds"],
                one["note"] or None,
            )
        )
    return markdown(("part", "characters", "machine", "threads", "torch", "weights", "seconds", "note"), rows)


Picture = Callable[[str], str]


def _suffixed(pictures: Path, characters: str) -> Picture:
    """Names a diagram in Markdown; those of a data set bear its name and split."""
    suffix = "" if characters == EMBEDDED else "_" + characters.replace(", split ", "_")
    return lambda name: f"![{name}]({(pictures / f'{name}{suffix}.png').as_posix()})"


def _headline(found: Any, picture: Picture) -> list[str]:
    kinds = [{**one, "name": one["kind"]} for one in found["kinds"]]
    return [
        headline_table(found["headline"]),
        "\n".join(f"- `{name}`: {text}" for name, text in found["headline"]["how"].items()),
        "Characters:",
        comparison_table(found["characters"]),
        "Kinds of scene:",
        comparison_table(kinds),
    ]


def _headline_again(found: Any, picture: Picture) -> list[str]:
    """Of a data set: kinds of scene and how it is measured are as above."""
    return [headline_table(found["headline"]), comparison_table(found["characters"])]


def _diagram(name: str) -> Callable[[Any, Picture], list[str]]:
    return lambda found, picture: [picture(name), rows_table(found)]


def _table(text: str = "") -> Callable[[Any, Picture], list[str]]:
    def show(found: Any, picture: Picture) -> list[str]:
        rows = found if isinstance(found, list) else [found]
        return [*([text] if text else []), rows_table(rows) if rows else "The model has no hull."]

    return show


def _kinds(found: Any, picture: Picture) -> list[str]:
    """The fastest setting of each method that is as accurate as the baseline, on every kind."""
    rows = []
    for kind, some in found.items():
        base = next(row for row in some if (row["curve"], row["setting"]) == (BASELINE, BASELINE_SETTING))
        for curve in dict.fromkeys(row["curve"] for row in some):
            good = [row for row in some if row["curve"] == curve and row["rms_error"] <= base["rms_error"]]
            if curve == BASELINE or not good:
                continue
            best = min(good, key=lambda row: row["seconds"])
            shown = {name: best[name] for name in ("curve", "setting", "seconds")}
            errors = {name: best[name] for name in ("rms_error", "max_error")}
            rows.append({"kind": kind, **shown, "speed-up": base["seconds"] / best["seconds"], **errors})
    return [
        picture("kinds"),
        f"The fastest setting of each method whose rms error is at most that of `{BASELINE}` with {BASELINE_SETTING} samples, "
        "and its speed-up over that; a method without such a setting is left out. All points are in bench.json.",
        rows_table(rows) if rows else "No setting is.",
    ]


def _size(found: Any, picture: Picture) -> list[str]:
    rows = [{"method": name, **numbers} for name, numbers in found["methods"].items()]
    return [
        f"`experiment=pixelnerf scale=paper`: {found['parameters']:,} parameters with its encoder ({found['encoder']}; "
        f"pixelNeRF counts 13 million more that its ResNet never uses), seeded weights, {found['rays']} rays. Fog, as all "
        "untrained fields: a trained field asks adaptive for more samples. Culled with pixelNeRF's numbers of samples, and "
        "with a quarter of them: the hull's segments are a quarter of the box's length or less.",
        rows_table(rows),
    ]


def _steps(found: Any, picture: Picture) -> list[str]:
    rows = [
        {
            "scale": one["scale"],
            "rays": one["rays"],
            **{f"{name} s": value for name, value in one["seconds"].items()},
            **{f"over {name}": value for name, value in one["speedup_of_culled"].items() if name != "culled"},
        }
        for one in found
    ]
    return [
        "Encoder, random pixels, loss, gradient and Adam at an equal batch. `pixelNeRF-like` evaluates 64 samples and then "
        "96 over the whole box, in slices of 128 rays (a whole batch would fill the memory); `dense` and `culled` take the "
        "scale's own samples on the hull's segments of the ray, `dense` on all rays.",
        rows_table(rows),
    ]


def _scaling(found: Any, picture: Picture) -> list[str]:
    rows = [
        {k: ", ".join(map(_short, v)) if isinstance(v, list) else v for k, v in one.items()} for one in found
    ]
    return [picture("scaling"), rows_table(rows)]


def _short(value: float) -> str:
    return f"{value:.3g}"


def rows_table(rows: Sequence[dict[str, Any]]) -> str:
    """A table of dicts with the same keys."""
    return markdown([name.replace("_", " ") for name in rows[0]], [tuple(row.values()) for row in rows])


SECTIONS: dict[str, tuple[str, Callable[[Any, Picture], list[str]]]] = {
    "headline": ("Headline", _headline),
    "samples": ("Samples a ray and tolerances", _diagram("samples")),
    "kinds": ("Kinds of scene", _kinds),
    "tricks": ("One trick off at a time", _diagram("tricks")),
    "precision": ("Precision", _diagram("precision")),
    "compile": ("Compiled", _diagram("compile")),
    "exactness": (
        "Culled is dense",
        _table(
            "Largest difference of a colour between `renderer=culled` and `renderer=dense` at the same samples."
        ),
    ),
    "hull": (
        "What the hull cuts away",
        _table(
            "Pixels of one whole target picture that show the character, and those of them whose rays meet no cell of its hull."
        ),
    ),
    "turntable": (
        "Turntable",
        _table(
            "36 whole frames with hull, encoding and all by `renderer=adaptive`; the baseline's seconds are extrapolated "
            "from 512 timed pixels."
        ),
    ),
    "size": ("At pixelNeRF's size", _size),
    "steps": ("Training steps", _steps),
    "losses": (
        "Loss curves",
        lambda found, picture: [
            "One character from seeded weights, `scale=small`, 128 rays a step, three seeds of batches that all methods share. "
            "The last third of the steps, its distance from the baseline's, and the spread of seeds:",
            picture("losses"),
            rows_table(found),
        ],
    ),
    "meshes": ("Meshes", _table("`distance`: the largest to the surface of a grid of 256 cells, m.")),
    "memory": ("Memory by size", _table("Peak over the loaded, encoded model, a fresh process each.")),
    "scaling": ("Growth", _scaling),
    "resolution": (
        "Drawings' resolution",
        _table(
            "The drawings of 128 pixels, resampled; the reference is that of the drawings as they are. The encoder knows the "
            "scale that it was trained at."
        ),
    ),
    "builds": ("Builds", _table("Seeded weights.")),
}
