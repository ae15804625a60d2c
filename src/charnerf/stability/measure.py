"""Where a case runs, and how its errors become rows."""

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.stability.report import CheckRow

HALVES = (torch.bfloat16, torch.float16)


@dataclass(frozen=True)
class Bounds:
    """Largest errors in value and gradient, computed in float32 and in float64; None: not judged."""

    value32: float | None
    value64: float | None
    gradient32: float | None = None
    gradient64: float | None = None

    def of(self, dtype: torch.dtype) -> tuple[float | None, float | None]:
        """Bounds for inputs of a dtype; half precisions are computed in float32."""
        double = dtype == torch.float64
        return (self.value64, self.gradient64) if double else (self.value32, self.gradient32)


@dataclass(frozen=True)
class Errors:
    """Largest errors of one measurement, and how many numbers were not finite."""

    value: float
    gradient: float | None = None
    non_finite: int = 0


@dataclass(frozen=True)
class Target:
    """A device and the dtype of the inputs."""

    device: torch.device
    dtype: torch.dtype

    @property
    def is_half(self) -> bool:
        """Whether the inputs are bfloat16 or float16."""
        return self.dtype in HALVES

    @property
    def dtype_name(self) -> str:
        """Such as "float32"."""
        return str(self.dtype).removeprefix("torch.")

    def tensor(self, values: object) -> Tensor:
        """Numbers rounded to the dtype, on the device; from float64, so that float64 keeps its digits."""
        if not isinstance(values, Tensor):
            values = torch.tensor(values, dtype=torch.float64)
        return values.to(self.dtype).to(self.device)

    def row(
        self, kernel: str, case: str, errors: Errors, bounds: Bounds, *, formula: str = "ours"
    ) -> CheckRow:
        """A row of the report."""
        value_bound, gradient_bound = bounds.of(self.dtype)
        return CheckRow(
            kernel=kernel,
            case=case,
            device=str(self.device),
            dtype=self.dtype_name,
            formula=formula,
            value_error=errors.value,
            gradient_error=errors.gradient,
            non_finite=errors.non_finite,
            value_bound=value_bound,
            gradient_bound=gradient_bound if errors.gradient is not None else None,
        )


def doubled(values: Tensor) -> Tensor:
    """Values as float64 on the CPU, detached, to be compared."""
    return values.detach().double().cpu()


def count_non_finite(*values: Tensor) -> int:
    """How many numbers of all the tensors are NaN or infinite."""
    return sum(int((~value.detach().isfinite()).sum()) for value in values)


def largest(errors: Tensor) -> float:
    """Largest error, infinite where one is NaN."""
    if errors.numel() == 0:
        return 0.0
    return float(
        torch.nan_to_num(doubled(errors), nan=torch.inf, posinf=torch.inf, neginf=-torch.inf).abs().max()
    )


def relative_to_ray(computed: Tensor, exact: Tensor, floor: float = 1e-30) -> Tensor:
    """Largest error along the last axis over the largest exact number there, or the floor, (...)."""
    scale = exact.abs().amax(dim=-1).clamp_min(floor)
    return (
        torch.nan_to_num(doubled(computed) - exact, nan=torch.inf, posinf=torch.inf).abs().amax(dim=-1)
        / scale
    )
