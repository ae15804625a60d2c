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
        (output channels, input channels * height * width), which torch.optim.Muon does not take. Kingma & Ba 2015.
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
            move = self._turn if group["orthogonal"] else self._adam
            for parameter in group["params"]:
                if parameter.grad is not None:
                    move(parameter, parameter.grad, group["lr"])
        return loss

    def _turn(self, parameter: Tensor, gradient: Tensor, rate: float) -> None:
        state = self.state[parameter]
        if not state:
            state["momentum"] = torch.zeros_like(gradient)
        state["momentum"].lerp_(gradient, 1.0 - MOMENTUM)
        ahead = gradient.lerp(state["momentum"], MOMENTUM)
        turned = orthogonalized(ahead.flatten(1)).to(parameter.dtype)
        rows, columns = turned.shape
        parameter.add_(turned.reshape(parameter.shape), alpha=-rate * max(1.0, rows / columns) ** 0.5)

    def _adam(self, parameter: Tensor, gradient: Tensor, rate: float) -> None:
        state = self.state[parameter]
        if not state:
            state["step"] = torch.zeros((), dtype=torch.float32)
            state["mean"], state["square"] = torch.zeros_like(gradient), torch.zeros_like(gradient)
        state["step"] += 1
        step = float(state["step"])
        state["mean"].lerp_(gradient, 1.0 - BETAS[0])
        state["square"].mul_(BETAS[1]).addcmul_(gradient, gradient, value=1.0 - BETAS[1])
        scale = (state["square"] / (1.0 - BETAS[1] ** step)).sqrt_().add_(EPSILON)
        parameter.addcdiv_(state["mean"], scale, value=-rate / (1.0 - BETAS[0] ** step))


def is_matrix(parameter: Tensor) -> bool:
    """Whether a parameter is a matrix or a bank of filters with at least five rows and columns."""
    return parameter.ndim >= 2 and min(parameter.shape[0], parameter[0].numel()) >= LEAST_SIDE


def orthogonalized(matrix: Tensor) -> Tensor:
    """Roughly U V^T of a matrix U S V^T: its singular values go to about 1 (0.7 to 1.2), its zeros stay zero.

    Five quintic Newton-Schulz steps, which need products only.

    Args:
        matrix: (rows, columns), of any scale.

    Source: Jordan et al. 2024.
    """
    tall = matrix.shape[0] > matrix.shape[1]
    x = matrix.T if tall else matrix
    tiny = torch.finfo(x.dtype).tiny
    x = x / x.abs().amax().clamp_min(tiny)  # the squares of a norm would leave the range of floats
    x = x / x.norm().clamp_min(tiny)
    for a, b, c in NEWTON_SCHULZ:
        square = x @ x.T
        x = torch.addmm(x, torch.addmm(square, square, square, beta=b, alpha=c), x, beta=a)
    return x.T if tall else x
