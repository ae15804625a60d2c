"""`python -m benchmarks`: measure parts of the benchmark; numbers and diagrams join those measured before."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from benchmarks.parts import PARTS
from benchmarks.setting import EMBEDDED, Setting
from benchmarks.tables import page
from charnerf.evaluation.environment import environment
from charnerf.files import write_text
from charnerf.inference import weights

NUMBERS, PAGE = "bench.json", "bench.md"


def main(arguments: Sequence[str]) -> None:
    """Measure what the command line names."""
    options = _parser().parse_args(arguments)
    start = time.perf_counter()

    def say(text: str) -> None:
        print(f"{time.perf_counter() - start:6.1f} s  {text}", file=sys.stderr, flush=True)

    model = weights.load(options.weights).to(torch.device(options.device))
    setting = Setting(model, options.data, options.split, options.output, say)
    for name in options.part or PARTS:
        say(f"part: {name}")
        began = time.perf_counter()
        result = PARTS[name](setting)
        part = {
            "part": name,
            "characters": setting.label,
            "weights": model.source.name,
            "note": options.note,
            "seconds": time.perf_counter() - began,
            "environment": environment(model.device),
            "result": result,
        }
        keep(options.output, part)
    say(f"{options.output / NUMBERS}, {options.output / PAGE}")


def keep(output: Path, part: dict[str, Any]) -> None:
    """Put a part among those in the folder, in place of the same part on the same characters."""
    file = output / NUMBERS
    parts = json.loads(file.read_text(encoding="utf-8"))["parts"] if file.is_file() else []
    same = (part["part"], part["characters"])
    parts = [one for one in parts if (one["part"], one["characters"]) != same] + [part]
    order = list(PARTS)
    parts.sort(key=lambda one: (one["characters"] != EMBEDDED, one["characters"], order.index(one["part"])))
    write_text(file, json.dumps({"parts": parts}, indent=2) + "\n")
    write_text(output / PAGE, page({"parts": parts}))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    add = parser.add_argument
    add("weights", nargs="?", type=Path, help="run, .ckpt or .safetensors; released weights if left out")
    add("--part", action="append", choices=PARTS, help="only this part; may be repeated")
    add("--data", type=Path, help="data set of the characters; embedded ones if left out")
    add("--split", default="test", help="of the data set")
    add("-o", "--output", type=Path, default=Path("outputs/bench"), help="for numbers, page and diagrams")
    add("--note", default="", help="stands beside the figures: what else the machine did, say")
    add("--device", default="cuda" if torch.cuda.is_available() else "cpu", help="cpu, cuda, cuda:1, ..")
    return parser


if __name__ == "__main__":
    main(sys.argv[1:])
