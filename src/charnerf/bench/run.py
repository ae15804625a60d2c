"""The benchmark as a whole: what is measured, and the files that it writes."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from charnerf.bench.everything import all_sweeps
from charnerf.bench.headline import ADAPTIVE, CULLED, NUM_PIXELS, prepare, quick
from charnerf.bench.hull_cut import cut_by_hull
from charnerf.bench.report import report
from charnerf.bench.roofline import roofline
from charnerf.bench.subjects import Pictured, embedded, of_dataset, subject
from charnerf.bench.tables import comparison_table, headline_table, markdown
from charnerf.bench.workbench import workbench
from charnerf.evaluation.environment import environment
from charnerf.model_api import Model

NUM_CHARACTERS = 4


def run_quick(
    model: Model,
    *,
    data: Path | None,
    split: str,
    memory_mib: float,
    say: Callable[[str], None],
    output: Path | None = None,
) -> dict[str, Any]:
    """Measure the headline, and all sweeps where there is a folder for their plots.

    Args:
        model: The trained model.
        data: Data set of the characters; embedded ones if None.
        split: Of the data set.
        memory_mib: Budget.
        say: Told what is being done, with seconds.
        output: Folder for plots; None for the headline alone.
    """
    start = time.perf_counter()

    def tell(text: str) -> None:
        say(f"{time.perf_counter() - start:6.1f} s  {text}")

    tell("capturing")
    bench = workbench(model, memory_mib=memory_mib)
    pictured = _characters(model, data, split, NUM_CHARACTERS)
    prepared = prepare(bench, pictured, tell)
    result = quick(bench, pictured, prepared, tell)
    if output is not None:
        result |= all_sweeps(bench, pictured, prepared, output, tell)
        tell("what the hull cuts away")
        every = pictured if data is None else of_dataset(data, split, None)
        result["cut_by_hull"] = cut_by_hull(model.network, every)
    tell("done")
    result["environment"] = environment(model.device)
    result["weights"] = model.source.name
    result["data"] = "embedded" if data is None else f"{data.name}, split {split}"
    result["seconds"] = time.perf_counter() - start
    return result


def run_roofline(
    model: Model,
    *,
    data: Path | None,
    split: str,
    memory_mib: float,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """Measure arithmetic against the machine's peak: the model's own width, and 512; arguments as `run_quick`."""
    bench = workbench(model, memory_mib=memory_mib)
    pictured = _characters(model, data, split, 1)[0]
    found = {}
    for name, network in (("own width", bench.network), ("width 512", bench.wide)):
        one = subject(pictured, network, kind=name, num_pixels=NUM_PIXELS)
        for method in (CULLED, ADAPTIVE):
            say(f"{name}, {method}")
            found[f"{name}, {method}"] = roofline(one, bench.renderers[method]).as_dict()
    return {"roofline": found, "environment": environment(model.device), "weights": model.source.name}


def run_full(
    model: Model,
    output: Path,
    *,
    data: Path | None,
    split: str,
    memory_mib: float,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """Measure the headline and all sweeps; plots, bench.json and bench.md go to `output`; arguments as `run_quick`."""
    result = run_quick(model, data=data, split=split, memory_mib=memory_mib, say=say, output=output)
    write_json(output / "bench.json", result)
    (output / "bench.md").write_text(report(result), encoding="utf-8")
    return result


def _characters(model: Model, data: Path | None, split: str, count: int) -> list[Pictured]:
    if data is None:
        return embedded(count, model.image_size)
    return of_dataset(data, split, count)


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write results, beside and then renamed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.tmp")
    aside.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    aside.replace(path)


def summary(result: dict[str, Any]) -> str:
    """The tables of a run as text."""
    machine = result["environment"]
    parts = []
    if "headline" in result:
        parts += [
            headline_table(result["headline"]),
            comparison_table(result["characters"]),
            comparison_table([{**one, "name": one["kind"]} for one in result["kinds"]]),
        ]
    else:
        names = ("share", "achieved_gflops", "peak_gflops", "gflop", "seconds")
        rows = [(name, *(found[key] for key in names)) for name, found in result["roofline"].items()]
        parts.append(markdown(("rendering", *names), rows))
    parts.append(
        f"{machine['machine']}, {machine['threads']} threads, torch {machine['torch']}, {machine['device']}"
    )
    return "\n\n".join(parts)
