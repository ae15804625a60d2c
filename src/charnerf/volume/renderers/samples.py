"""Samples of a block of rays: evaluated in chunks, densities at once, colours when asked for, each at most once.

Letters: R rays, K samples a ray, M samples in all. A sample is known by its number, given in the order of
evaluation; -1 is none.
"""

import torch
from torch import Tensor

from charnerf.scene import DensityOutput, Scene
from charnerf.types import RayBundle, TensorRecord

GREY = 0.5  # of samples whose colour was not wanted


class Samples:
    """What was evaluated on some rays.

    Args:
        scene: What is looked at.
        rays: Rays (R,).
        size: Points of a chunk.
    """

    def __init__(self, scene: Scene, rays: RayBundle, size: int) -> None:
        self.scene = scene
        self.rays = rays
        self.size = size
        self.num_colors = 0
        self._densities = rays.origins.new_zeros(1)  # the last one stands for "none"
        self._rgb = rays.origins.new_full((1, 3), GREY)
        self._colored = torch.zeros(1, dtype=torch.bool, device=rays.origins.device)
        self._answers: list[tuple[int, DensityOutput]] = []

    def __len__(self) -> int:
        """Samples whose density was evaluated."""
        return len(self._densities) - 1

    @property
    def num_evaluated(self) -> int:
        """Samples that the field answered."""
        return sum(len(answer.densities) for _, answer in self._answers)

    def add(self, rows: Tensor, t_vals: Tensor, wanted: Tensor) -> Tensor:
        """Find densities of samples of some rays: evaluated where the scene may hold something, else zero.

        Args:
            rows: Which rays, (r,).
            t_vals: Their samples, (r, K), m.
            wanted: Samples to find, (r, K), bool.

        Returns:
            Numbers of the samples, (r, K); -1 where not wanted.
        """
        places = wanted.reshape(-1).nonzero()[:, 0]
        rays = self.rays.rows(rows.index_select(0, places // wanted.shape[1]))
        along = t_vals.reshape(-1).index_select(0, places)
        points = torch.addcmul(rays.origins, rays.directions, along[:, None])
        start, count, densities = len(self), len(points), []
        held = self.scene.bounds.may_hold(points)
        inside, empty = held.nonzero()[:, 0], (~held).nonzero()[:, 0]
        for first in range(0, len(inside), self.size):
            some = inside[first : first + self.size]
            answer = self.scene.field.densities(
                points.index_select(0, some), rays.directions.index_select(0, some)
            )
            self._answers.append((start + first, answer))
            densities.append(answer.densities)
        densities.append(self._densities.new_zeros(len(empty)))
        self._densities = torch.cat((self._densities[:-1], *densities, self._densities[-1:]))
        self._rgb = torch.cat((self._rgb[:-1], self._rgb.new_full((count + 1, 3), GREY)))
        self._colored = torch.cat((self._colored[:-1], self._colored.new_zeros(count + 1)))
        numbers = places.new_full((wanted.numel(),), -1)
        # no answer holds the colours of what is empty: a weight of zero asks for none
        order = places.index_select(0, torch.cat((inside, empty)))
        numbers[order] = torch.arange(start, start + count, device=numbers.device)
        return numbers.view(wanted.shape)

    def densities(self, numbers: Tensor) -> Tensor:
        """Densities of samples by number, zero for none."""
        return self._densities[numbers]

    def colors(self, numbers: Tensor, wanted: Tensor) -> tuple[Tensor, Tensor]:
        """Colours (R, K, 3) of samples by number (R, K), those wanted evaluated if they were not; and which have one."""
        missing = numbers[wanted & ~self._colored[numbers]]
        if len(missing):
            missing = missing.sort().values
            starts = torch.tensor([start for start, _ in self._answers], device=missing.device)
            counts = torch.bincount(
                torch.searchsorted(starts, missing, right=True) - 1, minlength=len(starts)
            ).tolist()
            groups = zip(self._answers, missing.split(counts), strict=True)
            parts = [answer.state.rows(group - start) for (start, answer), group in groups if len(group)]
            self._rgb[missing] = self._evaluate(type(parts[0]).joined(parts), len(missing))
            self._colored[missing] = True
            self.num_colors += len(missing)
        return self._rgb[numbers], self._colored[numbers]

    def _evaluate(self, state: TensorRecord, count: int) -> Tensor:
        """Colours (count, 3) of parts of answers, in chunks."""
        parts = [
            self.scene.field.colors(state[i : i + self.size] if count > self.size else state)
            for i in range(0, count, self.size)
        ]
        return torch.cat(parts).to(self._rgb.dtype)
