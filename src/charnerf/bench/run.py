"""The benchmark as a whole: what is measured, and the files that it writes."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from charnerf.bench.headline import quick
from charnerf.bench.subjects import embedded, of_dataset
from charnerf.bench.tables import comparison_table, headline_table
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
) -> dict[str, Any]:
    """Measure the headline.

    Args:
        model: The trained model.
        data: Data set of the characters; embedded ones if None.
        split: Of the data set.
        memory_mib: Budget.
        say: Told what is being done, with seconds.
    """
    start = time.perf_counter()

    def tell(text: str) -> None:
        say(f"{time.perf_counter() - start:6.1f} s  {text}")

    tell("capturing")
    size = model.image_size
    pictured = embedded(NUM_CHARACTERS, size) if data is None else of_dataset(data, split, NUM_CHARACTERS)
    result = quick(workbench(model, memory_mib=memory_mib), pictured, tell)
    tell("done")
    result["environment"] = environment(model.device)
    result["weights"] = model.source.name
    result["seconds"] = time.perf_counter() - start
    return result


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write results, beside and then renamed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.tmp")
    aside.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    aside.replace(path)


def summary(result: dict[str, Any]) -> str:
    """The tables of a quick run as text."""
    machine = result["environment"]
    return "\n\n".join(
        (
            headline_table(result["headline"]),
            comparison_table(result["characters"]),
            comparison_table([{**one, "name": one["kind"]} for one in result["kinds"]]),
            f"{machine['machine']}, {machine['threads']} threads, torch {machine['torch']}, {machine['device']}",
        )
    )
