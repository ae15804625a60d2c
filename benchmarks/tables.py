"""Markdown of what was measured: a table or some for each part of bench.json, the targets and the machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from benchmarks.setting import EMBEDDED, diagram
from benchmarks.targets import target_rows
from charnerf.bench.baseline import NUM_COARSE, NUM_FINE
from charnerf.bench.tables import comparison_table, headline_table, markdown, rows_table
from charnerf.bench.workbench import BASELINE

BASELINE_SETTING = f"{NUM_COARSE} + {NUM_FINE}"
Parts = Sequence[Mapping[str, Any]]
Show = Callable[[Any], list[str]]


def tables(bench: Mapping[str, Any]) -> dict[str, str]:
    """Markdown by mark: every part, "PART" of embedded characters, "PART DATASET SPLIT" of others; "targets" and "machine".

    Args:
        bench: As bench.json holds it.
    """
    parts: Parts = bench["parts"]
    targets = target_rows({one["part"]: one["result"] for one in parts if one["characters"] == EMBEDDED})
    return {
        **({"targets": markdown(("target", "measured", "met"), targets)} if targets else {}),
        **{mark_of(one): "\n\n".join(SECTIONS[one["part"]][1](one["result"])) for one in parts},
        "machine": _machines(parts),
    }


def mark_of(part: Mapping[str, Any]) -> str:
    """Name of a part's tables."""
    where = [] if part["characters"] == EMBEDDED else [part["characters"].replace(", split", "")]
    return " ".join([part["part"], *where])


def page(bench: Mapping[str, Any]) -> str:
    """A page of all that was measured, with its diagrams in the same folder."""
    by_mark = tables(bench)
    lines = ["# Error against run time"]
    if "targets" in by_mark:
        lines += ["## Targets", by_mark["targets"]]
    for one in bench["parts"]:
        where = "" if one["characters"] == EMBEDDED else f": {one['characters']}"
        lines.append(f"## {SECTIONS[one['part']][0]}{where}")
        if one["part"] in DRAWN:
            lines.append(f"![{one['part']}]({diagram(one['part'], one['characters'])})")
        lines.append(by_mark[mark_of(one)])
    return "\n\n".join([*lines, "## Machine", by_mark["machine"]]) + "\n"


def _machines(parts: Parts) -> str:
    """Where each part was measured."""
    rows = []
    for one in parts:
        where = one["environment"]
        rows.append(
            (
                one["part"],
                one["characters"],
                where["machine"] if where["device"] == "cpu" else f"{where['device']}, {where['machine']}",
                where["threads"],
                where["torch"],
                one["weights"],
                one["seconds"],
                one["note"] or None,
            )
        )
    return markdown(("part", "characters", "machine", "threads", "torch", "weights", "seconds", "note"), rows)


def _headline(result: Any) -> list[str]:
    how = "\n".join(f"- `{name}`: {text}" for name, text in result["headline"]["how"].items())
    return [headline_table(result["headline"]), how, comparison_table(result["characters"])]


def _table(text: str = "") -> Show:
    def show(result: Any) -> list[str]:
        rows = result if isinstance(result, list) else [result]
        return [*([text] if text else []), rows_table(rows) if rows else "The model has no hull."]

    return show


def _kind_samples(result: Any) -> list[str]:
    """The fastest setting of each method that is as accurate as the baseline, on every kind."""
    rows = []
    for kind, some in result.items():
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
        f"The fastest setting of each method whose rms error is at most that of `{BASELINE}` with {BASELINE_SETTING} samples, "
        "and its speed-up over that; a method without such a setting is left out. All points are in bench.json.",
        rows_table(rows) if rows else "No setting is.",
    ]


def _size(result: Any) -> list[str]:
    rows = [{"method": name, **numbers} for name, numbers in result["methods"].items()]
    return [
        f"`experiment=pixelnerf scale=paper`: {result['parameters']:,} parameters with its encoder ({result['encoder']}; "
        f"pixelNeRF counts 13 million more that its ResNet never uses), seeded weights, {result['rays']} rays. Fog, as all "
        "untrained fields: a trained field asks adaptive for more samples. Culled with pixelNeRF's numbers of samples, and "
        "with a quarter of them: the hull's segments are a quarter of the box's length or less.",
        rows_table(rows),
    ]


def _steps(result: Any) -> list[str]:
    rows = [
        {
            "scale": one["scale"],
            "rays": one["rays"],
            **{f"{name} s": value for name, value in one["seconds"].items()},
            **{f"over {name}": value for name, value in one["speedup_of_culled"].items() if name != "culled"},
        }
        for one in result
    ]
    return [
        "Encoder, random pixels, loss, gradient and Adam at an equal batch. `pixelNeRF-like` evaluates 64 samples and then "
        "96 over the whole box, in slices of 128 rays (a whole batch would fill the memory); `dense` and `culled` take the "
        "scale's own samples on the hull's segments of the ray, `dense` on all rays.",
        rows_table(rows),
    ]


def _scaling(result: Any) -> list[str]:
    rows = [
        {k: ", ".join(map(_short, v)) if isinstance(v, list | tuple) else v for k, v in one.items()}
        for one in result
    ]
    return [rows_table(rows)]


def _short(value: float) -> str:
    return f"{value:.3g}"


SECTIONS: dict[str, tuple[str, Show]] = {
    "headline": ("Headline", _headline),
    "samples": ("Samples a ray and tolerances", _table()),
    "kinds": ("Kinds of scene", lambda result: [comparison_table(result)]),
    "kind_samples": ("Samples a ray on kinds of scene", _kind_samples),
    "tricks": ("One trick off at a time", _table()),
    "precision": ("Precision", _table()),
    "compile": ("Compiled", _table()),
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
            "36 frames of 192 pixels by `renderer=baked`, baking included, and single ones of 256; the baseline's seconds are "
            "extrapolated from 512 timed pixels."
        ),
    ),
    "size": ("At pixelNeRF's size", _size),
    "arithmetic": (
        "Arithmetic",
        _table(
            "Products and convolutions counted by torch while 512 pixels are rendered, over the best of the seconds timed, over "
            "the best by square products of side 2048; width 512 with seeded weights."
        ),
    ),
    "steps": ("Training steps", _steps),
    "threads": (
        "Threads beside other processes",
        _table(
            "Steps a second of `python train.py` at `scale=small`, alone and beside one busy process a core, medians of three runs "
            "of 30 s in turns. `always`: OMP_NUM_THREADS is set."
        ),
    ),
    "processes": (
        "Processes",
        _table(
            "Trainings at `scale=small` of as many steps by `python train.py`, medians over turns. The error is reached when"
            " validation on the foreground reaches what the worst of them reaches; one process of twice the batch and two"
            " processes make the same steps."
        ),
    ),
    "repeats": (
        "Memory of repeated work",
        _table(
            "The model loaded, a character encoded and rendered at 96 pixels, again and again in one process; and a baked character"
            " opened and rendered. Resident MiB, medians of 20 rounds; `growth` from those after the tenth to the last."
        ),
    ),
    "losses": (
        "Loss curves",
        _table(
            "One character from seeded weights, `scale=small`, 128 rays a step, three seeds of batches that all methods share. "
            "The last third of the steps, its distance from the baseline's, and the spread of seeds."
        ),
    ),
    "grids": (
        "Grids",
        _table(
            "`share`: distinct grid points evaluated over 257^3 in a cube of side 2.2 m, 8 cameras; `all share`: of all points "
            "inside the hull; `same`: the same faces, or a Hausdorff distance of vertices below 1e-4 m."
        ),
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
DRAWN = ("samples", "kind_samples", "tricks", "precision", "compile", "losses", "scaling")
