"""The progress bar of commands that make meshes: what a mesh takes is known only about."""

from collections.abc import Callable, Sequence

from tqdm import tqdm

MESH_POINTS = 0.06  # of the grid: evaluated in the usual case; only the progress bar depends on it
BAR = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}, about {remaining} left"


def meter(bar: tqdm, resolutions: Sequence[int], steps: float) -> Callable[[int], None]:
    """Turn numbers of evaluated points into about so many steps of the bar, which stops short of its end."""
    per_point = steps / (MESH_POINTS * sum(resolution**3 for resolution in resolutions))

    def step(count: int) -> None:
        bar.update(max(0.0, min(count * per_point, (bar.total or 0) - 0.5 - bar.n)))

    return step
