"""Muon for matrices and filters, Adam for the rest, as one optimiser (beyond the paper)."""

from collections.abc import Callable, Iterable
from typing import Any, final

import torch
from torch import Tensor

LEAST_SIDE = 5  # of a matrix: thinner ones (a head of four outputs) have no spectrum worth levelling
NEWTON_SCHULZ = ((3.4445, -4.7750, 2.0315),) * 5  # coefficients of the quintic steps
MOMENTUM = 0.95
BETAS = (0.9, 0.999)
EPSILON = 1e-8


@final
class MuonWithAdam(torch.optim.Optimizer):
    """Moves matrices and convolution filters along their orthogonalised momentum, biases, norms and thin matrices by Adam.

    Small encoders learn slowly under Adam: the gradients of their filters are of low rank, and the rare directions get no step.
    An orthogonal step moves all directions alike.

    Args:
        params: Parameters.
        lr: Learning rate of Adam.
        matrix_lr: Learning rate of Muon: the step's spectral norm, times sqrt(rows / columns) where there are more rows.

    Raises:
        ValueError: If a rate is not positive.

    Source: Jordan et al. 2024, "Muon: an optimizer for hidden layers in neural networks"; filters count as matrices of
        (output channels, input channels * height * width). Kingma & Ba 2015. torch.optim.Muon, without weight decay,
        takes the same step of a matrix but turns it in bfloat16 (1.3 to 1.6 % of the step's length away from ours),
        takes no filters, and turns one matrix at a time (twice the time for 16 of 64 x 64).
    """

    def __init__(self, params: Iterable[Tensor], *, lr: float, matrix_lr: float) -> None:
        for name, rate in (("lr", lr), ("matrix_lr", matrix_lr)):
            if not rate > 0.0:
                raise ValueError(f"{name}: found {rate}, expected a positive learning rate.")
        every = list(params)
        matrices = [one for one in every if is_matrix(one)]
        rest = [one for one in every if not is_matrix(one)]
        groups: list[dict[str, Any]] = [
            {"params": rest, "lr": lr, "orthogonal": False},
            {"params": matrices, "lr": matrix_lr, "orthogonal": True},
        ]
        super().__init__([group for group in groups if group["params"]], {"lr": lr})

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> float | None:  # type: ignore[override]
        """Take one step; parameters without a gradient stay."""
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        for group in self.param_groups:
            parameters = [one for one in group["params"] if one.grad is not None]
            if parameters:
                move = self._turn if group["orthogonal"] else self._adam
                move(parameters, [one.grad for one in parameters], group["lr"])
        return loss

    def _turn(self, parameters: list[Tensor], gradients: list[Tensor], rate: float) -> None:
        """Move matrices along their orthogonalised momentum, those of one shape together."""
        for parameter in parameters:
            if not self.state[parameter]:
                self.state[parameter]["momentum"] = torch.zeros_like(parameter)
        momenta = [self.state[parameter]["momentum"] for parameter in parameters]
        torch._foreach_lerp_(momenta, gradients, 1.0 - MOMENTUM)
        ahead = torch._foreach_lerp(gradients, momenta, MOMENTUM)
        alike: dict[tuple[int, int], list[int]] = {}
        for index, parameter in enumerate(parameters):
            alike.setdefault((parameter.shape[0], parameter[0].numel()), []).append(index)
        for (rows, columns), chosen in alike.items():
            turned = orthogonalized(torch.stack([ahead[index].flatten(1) for index in chosen]))
            moved = [parameters[index] for index in chosen]
            steps = [one.reshape(to.shape).to(to.dtype) for one, to in zip(turned, moved, strict=True)]
            torch._foreach_add_(moved, steps, alpha=-rate * max(1.0, rows / columns) ** 0.5)

    def _adam(self, parameters: list[Tensor], gradients: list[Tensor], rate: float) -> None:
        for parameter in parameters:
            if not (state := self.state[parameter]):
                state["step"] = torch.zeros((), dtype=torch.float32)
                state["mean"], state["square"] = torch.zeros_like(parameter), torch.zeros_like(parameter)
        states = [self.state[parameter] for parameter in parameters]
        means, squares = [one["mean"] for one in states], [one["square"] for one in states]
        torch._foreach_add_([one["step"] for one in states], 1)
        torch._foreach_lerp_(means, gradients, 1.0 - BETAS[0])
        torch._foreach_mul_(squares, BETAS[1])
        torch._foreach_addcmul_(squares, gradients, gradients, value=1.0 - BETAS[1])
        steps = [float(one["step"]) for one in states]
        scales = torch._foreach_div(squares, [1.0 - BETAS[1] ** step for step in steps])
        torch._foreach_sqrt_(scales)
        torch._foreach_add_(scales, EPSILON)
        torch._foreach_addcdiv_(
            parameters, means, scales, [-rate / (1.0 - BETAS[0] ** step) for step in steps]
        )


def is_matrix(parameter: Tensor) -> bool:
    """Whether a parameter is a matrix or a bank of filters with at least five rows and columns."""
    return parameter.ndim >= 2 and min(parameter.shape[0], parameter[0].numel()) >= LEAST_SIDE


def orthogonalized(matrices: Tensor) -> Tensor:
    """Roughly U V^T of matrices U S V^T: singular values go to about 1 (0.7 to 1.2), zeros stay zero.

    Five quintic Newton-Schulz steps, which need products only.

    Args:
        matrices: (rows, columns), or several of one shape, (N, rows, columns); of any scale.

    Source: Jordan et al. 2024.
    """
    tall = matrices.shape[-2] > matrices.shape[-1]
    x = (matrices.mT if tall else matrices).reshape(-1, *sorted(matrices.shape[-2:]))
    tiny = torch.finfo(x.dtype).tiny
    x = x / x.abs().amax((-2, -1), keepdim=True).clamp_min(
        tiny
    )  # the squares of a norm would leave the range of floats
    x = x / torch.linalg.vector_norm(x, dim=(-2, -1), keepdim=True).clamp_min(tiny)
    for a, b, c in NEWTON_SCHULZ:
        square = x @ x.mT
        x = torch.baddbmm(x, torch.baddbmm(square, square, square, beta=b, alpha=c), x, beta=a)
    return (x.mT if tall else x).reshape(matrices.shape)
