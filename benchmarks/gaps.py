"""`python -m benchmarks.gaps DATA`: how many gaps of paper are seen through, and how much white is taken for one.

Front and back of captured characters, whose alpha is known, are put on paper, plain and with an inked outline, and cut out again.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from scipy import ndimage
from skimage.measure import label

from benchmarks.csv_rows import write_rows
from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.drawings.cutout import Cutout, cut_out
from charnerf.drawings.enclosed import SMALLEST, shared
from charnerf.drawings.load import drawing_from_array
from charnerf.errors import DataError

PAPERS = {"white": (1.0, 1.0, 1.0), "off-white": (0.98, 0.965, 0.93), "grey": (0.75, 0.75, 0.78)}
INK = 0.1  # its brightness
GRAIN = 0.004  # standard deviation of the paper's noise
ENLARGED = 3  # times: drawings have more pixels than captures
SETTLED = (0.1, 0.5)  # alphas: a gap is clearer than the first, figure more opaque than the second


def rows(characters: Sequence[Character]) -> Iterator[dict[str, object]]:
    """Counts on every paper, plain and inked; views that can not be cut out are counted too."""
    for paper, inked in product(PAPERS, (False, True)):
        counts = {"opened": 0, "wrongly": 0, "missed": 0, "not cut out": 0}
        for character in characters:
            pair = [_on_paper(character, view, paper, inked) for view in ("front", "back")]
            try:
                cuts = [cut_out(drawing_from_array(drawn, character.name)) for drawn, _ in pair]
            except DataError:
                counts["not cut out"] += 1
                continue
            both = shared(cuts[0].gaps, cuts[1].gaps)
            for cut, (_, alpha), gaps in zip(cuts, pair, both, strict=True):
                right = [float(alpha[gap.mask].mean()) < SETTLED[1] for gap in gaps]
                counts["opened"] += sum(right)
                counts["wrongly"] += len(right) - sum(right)
                counts["missed"] += _missed(cut, alpha, [gap.mask for gap in gaps])
        yield {"paper": paper, "outlines": "inked" if inked else "plain", **counts}


def _on_paper(character: Character, view: str, paper: str, inked: bool) -> tuple[np.ndarray, np.ndarray]:
    """A source view on paper (H, W, 3), uint8, and its true alpha (H, W)."""
    rgba = character.sources.images[0, character.source_names.index(view)].permute(1, 2, 0).numpy()
    large = np.kron(rgba, np.ones((ENLARGED, ENLARGED, 1), np.float32))
    premultiplied = np.concatenate((large[..., :3] * large[..., 3:], large[..., 3:]), axis=-1)
    soft = ndimage.gaussian_filter(premultiplied, (0.8, 0.8, 0.0))
    color, alpha = soft[..., :3], soft[..., 3]
    if inked:
        figure = alpha > SETTLED[1]
        color[figure & ~ndimage.binary_erosion(figure, iterations=2)] = INK
    noise = np.random.default_rng(0).normal(0.0, GRAIN, color.shape)
    drawn = color + (1.0 - alpha[..., None]) * np.array(PAPERS[paper]) + noise
    return np.round(255.0 * drawn.clip(0.0, 1.0)).astype(np.uint8), alpha


def _missed(cut: Cutout, alpha: np.ndarray, opened: Sequence[np.ndarray]) -> int:
    """True gaps, large enough, that were not opened."""
    figure = cut.rgba[..., 3] > SETTLED[1]
    gaps = label(figure & (alpha < SETTLED[0]))
    sizes = np.bincount(gaps.reshape(-1), minlength=1)
    sizes[0] = 0
    large = np.flatnonzero(sizes >= SMALLEST * figure.sum())
    return sum(not any((mask & (gaps == one)).sum() > 0.5 * sizes[one] for mask in opened) for one in large)


def main() -> None:
    """Measure what the command line names and write a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="data set of captured characters")
    parser.add_argument("--split", action="append", required=True, help="as often as wanted")
    parser.add_argument("-o", "--output", type=Path, required=True, help="CSV file")
    options = parser.parse_args()
    info = read_dataset(options.data)
    names = [name for split in options.split for name in names_of(info, split)]
    loaded = (load_character(options.data, name) for name in names)
    characters = [one for one in loaded if {"front", "back"} <= set(one.source_names)]
    write_rows(options.output, rows(characters))


if __name__ == "__main__":
    main()
