"""The paper's claim on its encoder, measured: how much gradient reaches the first layer of each kind.

Run as a script it prints the table of docs/numerics.md.
"""

from collections.abc import Callable
from itertools import pairwise
from statistics import geometric_mean

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.models.encoders.double import DoubleHourglass
from charnerf.models.encoders.hourglass import StackedHourglass
from charnerf.models.encoders.single import SingleHourglass

WIDTH = 32
SIZE = 64
STACKS = (1, 2, 4, 8)


class ThroughMLP(nn.Module):
    """The coarse features enter through an MLP, as in PIFuHD, instead of side by side."""

    def __init__(self, stacks: int) -> None:
        super().__init__()
        self.pair = double(stacks)
        widths = (2 * WIDTH, 2 * WIDTH, WIDTH, WIDTH)
        self.lift = nn.Conv2d(WIDTH, widths[0], 1)
        self.layers = nn.ModuleList(nn.Conv2d(a, b, 1) for a, b in pairwise(widths))

    def forward(self, images: Tensor) -> Tensor:
        both = self.pair(images)
        coarse = self.lift(both[:, :WIDTH])
        for layer in self.layers:
            coarse = F.leaky_relu(layer(coarse))
        return torch.cat((coarse, both[:, WIDTH:]), dim=1)


def single(stacks: int) -> nn.Module:
    return SingleHourglass(
        in_channels=4, num_stacks=stacks, depth=2, width=WIDTH, out_channels=WIDTH, stride=2
    )


def double(stacks: int) -> DoubleHourglass:
    return DoubleHourglass(
        in_channels=4, coarse_stacks=stacks, fine_stacks=1, depth=2, coarse_width=WIDTH, fine_width=WIDTH,
        coarse_channels=WIDTH, fine_channels=WIDTH, reduction=2, stride=2,
    )  # fmt: skip


def trunk(module: nn.Module) -> StackedHourglass:
    """The stack that the deep gradient has to cross."""
    if isinstance(module, ThroughMLP):
        return module.pair.coarse
    return module.coarse if isinstance(module, DoubleHourglass) else module.filter


def gradient_ratio(build: Callable[[int], nn.Module], stacks: int, seed: int) -> tuple[float, float]:
    """RMS gradient of the first layer over that of the stack's last one, and its own, at the start."""
    torch.manual_seed(seed)
    module = build(stacks)
    images = torch.randn(3, 4, SIZE, SIZE)
    answer = module(images)
    (answer - torch.randn_like(answer)).square().mean().backward()
    deep = trunk(module)
    first, last = (layer.weight.grad.square().mean().sqrt() for layer in (deep.stem, deep.outputs[-1]))
    return float(first / last), float(first)


def measure(seeds: int = 3) -> dict[tuple[str, int], tuple[float, float]]:
    """Geometric means over seeds by kind and number of stacks."""
    found = {}
    for name, build in (
        ("single", single),
        ("double", double),
        ("double, coarse through an MLP", ThroughMLP),
    ):
        for stacks in STACKS:
            pairs = [gradient_ratio(build, stacks, seed) for seed in range(seeds)]
            found[name, stacks] = tuple(geometric_mean(values) for values in zip(*pairs, strict=True))
    return found


def table() -> str:
    """The measurement in Markdown."""
    found = measure()
    lines = [
        "| encoder | " + " | ".join(f"{n} stacks" for n in STACKS) + " |",
        "|---" * (len(STACKS) + 1) + "|",
    ]
    for name in dict.fromkeys(name for name, _ in found):
        cells = [f"{found[name, n][0]:.2f} ({found[name, n][1]:.1e})" for n in STACKS]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())  # noqa: T201
