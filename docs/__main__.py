"""`python -m docs`: write every figure of README.md and docs/ from the files of this repository.

With --check nothing is written; stale pages are listed and the exit status is 1. What stands between marks is the figures' own
(docs/figures/marks.py); the words around them stay.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.tables import page as benchmark_page
from docs.figures.characters import credits, licences, splits
from docs.figures.marks import written
from docs.figures.meshes import lods, meshes
from docs.figures.numerics import kernels, trained
from docs.figures.options import groups, options
from docs.figures.scores import azimuths, course, measured, scores, seconds, table2
from docs.figures.sources import BENCH, ROOT, read, speed, table, value
from docs.figures.weights import weights

PLAIN = (value, table)
OF_CHARACTERS = (splits, licences, credits)
OF_EVALUATIONS = (scores, measured, seconds, azimuths, course, table2, lods, meshes)
OTHERS = (groups, options, kernels, trained, speed, weights)
KINDS = {kind.__name__: kind for kind in (*PLAIN, *OF_CHARACTERS, *OF_EVALUATIONS, *OTHERS)}


def pages() -> list[Path]:
    """Every page with words of its own."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def stale() -> dict[Path, str]:
    """Pages whose figures are not those of the files, with the text that they should have."""
    found = {ROOT / "docs/speed/bench.md": benchmark_page(read(BENCH))}
    for page in pages():
        try:
            found[page] = written(page.read_text(encoding="utf-8"), KINDS)
        except (ValueError, LookupError, StopIteration, OSError) as error:
            raise ValueError(f"{page}: {error!r}") from error
    return {
        page: text
        for page, text in found.items()
        if not page.is_file() or page.read_text(encoding="utf-8") != text
    }


def main() -> int:
    """Write or check; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m docs", description=__doc__)
    parser.add_argument("--check", action="store_true", help="list stale pages instead of writing them")
    checking = parser.parse_args().check
    found = stale()
    for page, text in found.items():
        print(f"{'stale' if checking else 'written'}: {page.relative_to(ROOT)}")
        if not checking:
            page.write_text(text, encoding="utf-8")
    return int(checking and bool(found))


if __name__ == "__main__":
    sys.exit(main())
