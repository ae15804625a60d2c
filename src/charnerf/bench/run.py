"""The benchmark as a whole: which parts are measured, and the files that it writes."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from charnerf.bench.everything import PARTS, QUICK
from charnerf.bench.headline import ADAPTIVE, CULLED, NUM_PIXELS
from charnerf.bench.page import write_page
from charnerf.bench.roofline import roofline
from charnerf.bench.setting import Setting
from charnerf.bench.subjects import subject
from charnerf.bench.tables import comparison_table, headline_table, markdown
from charnerf.bench.workbench import workbench
from charnerf.errors import ConfigError
from charnerf.evaluation.environment import environment
from charnerf.files import write_text
from charnerf.inference.model import Model

NUMBERS, PAGE = "bench.json", "bench.md"


@dataclass(frozen=True)
class Request:
    """What of a benchmark is wanted.

    Attributes:
        parts: Names of PARTS.
        data: Data set of the characters; embedded ones if None.
        split: Of the data set.
        memory_mib: Budget.
        output: Folder for numbers and diagrams; None writes no files.
        page: Markdown file whose measured part is written anew; bench.md of the folder if None.
        note: Written beside the figures: what else the machine did, say.
    """

    parts: Sequence[str] = QUICK
    data: Path | None = None
    split: str = "test"
    memory_mib: float = 2048.0
    output: Path | None = None
    page: Path | None = None
    note: str = ""


def chosen_parts(names: Sequence[str]) -> tuple[str, ...]:
    """The parts of these names, all if there are none.

    Raises:
        ConfigError: If there is no such part.
    """
    for name in names:
        if name not in PARTS:
            raise ConfigError(f"--part: found '{name}', expected one of {', '.join(PARTS)}.")
    return tuple(name for name in PARTS if not names or name in names)


def run(model: Model, request: Request, say: Callable[[str], None]) -> dict[str, Any]:
    """Measure parts; after each, numbers, diagrams and page are on disk, beside those measured before.

    Args:
        model: The trained model.
        request: What is wanted.
        say: Told what is being done, with seconds.

    Returns:
        The headline's numbers on the top level, further parts by name under "parts"; environment, weights,
        data, seconds.
    """
    start = time.perf_counter()

    def tell(text: str) -> None:
        say(f"{time.perf_counter() - start:6.1f} s  {text}")

    bench = workbench(model, memory_mib=request.memory_mib)
    output = request.output or Path()
    setting = Setting(bench, request.data, request.split, output, tell)
    about = {
        "characters": setting.label,
        "weights": model.source.name,
        "note": request.note,
        "environment": environment(model.device),
    }
    result: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for name in request.parts:
        tell(f"part: {name}")
        began = time.perf_counter()
        found = PARTS[name](setting)
        result |= found if name == "headline" else {}
        others |= {} if name == "headline" else {name: found}
        if request.output is not None:
            taken = {"part": name, "seconds": time.perf_counter() - began, **about, "result": found}
            _keep(request.output, request.page or request.output / PAGE, taken)
    tell("done")
    seconds = time.perf_counter() - start
    known = {name: about[name] for name in ("environment", "weights")}
    return {**result, **known, "parts": others, "data": setting.label, "seconds": seconds}


def _keep(output: Path, page: Path, taken: dict[str, Any]) -> None:
    """Put a part among those in the folder, in place of the same part on the same characters, and write the page."""
    file = output / NUMBERS
    parts = json.loads(file.read_text(encoding="utf-8"))["parts"] if file.is_file() else []
    same = (taken["part"], taken["characters"])
    parts = [one for one in parts if (one["part"], one["characters"]) != same]
    parts.append(taken)
    parts.sort(
        key=lambda one: (one["characters"] != "embedded", one["characters"], list(PARTS).index(one["part"]))
    )
    write_json(file, {"parts": parts})
    write_page(page, parts, pictures=output)


def run_roofline(model: Model, request: Request, say: Callable[[str], None]) -> dict[str, Any]:
    """Measure arithmetic against the machine's peak: the model's own width, and 512; arguments as `run`."""
    bench = workbench(model, memory_mib=request.memory_mib)
    pictured = Setting(bench, request.data, request.split, Path(), say).pictured[0]
    found = {}
    for name, network in (("own width", bench.network), ("width 512", bench.wide)):
        one = subject(pictured, network, kind=name, num_pixels=NUM_PIXELS)
        for method in (CULLED, ADAPTIVE):
            say(f"{name}, {method}")
            found[f"{name}, {method}"] = roofline(one, bench.renderers[method]).as_dict()
    return {"roofline": found, "environment": environment(model.device), "weights": model.source.name}


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write results, whole or not at all."""
    write_text(path, json.dumps(result, indent=2) + "\n")


def summary(result: dict[str, Any]) -> str:
    """The main tables of a run as text."""
    machine = result["environment"]
    parts = []
    if "headline" in result:
        parts += [
            headline_table(result["headline"]),
            comparison_table(result["characters"]),
            comparison_table([{**one, "name": one["kind"]} for one in result["kinds"]]),
        ]
    elif "roofline" in result:
        names = ("share", "achieved_gflops", "peak_gflops", "gflop", "seconds")
        rows = [(name, *(found[key] for key in names)) for name, found in result["roofline"].items()]
        parts.append(markdown(("rendering", *names), rows))
    parts.append(
        f"{machine['machine']}, {machine['threads']} threads, torch {machine['torch']}, {machine['device']}"
    )
    return "\n\n".join(parts)
