"""Checks at public doors; inner loops trust their callers."""

from torch import Tensor

from charnerf.errors import NumericalError, ShapeError


def check_last_dim(name: str, tensor: Tensor, size: int) -> None:
    """Check that the last axis of a tensor has a given size.

    Raises:
        ShapeError: If it has not.
    """
    if tensor.ndim == 0 or tensor.shape[-1] != size:
        raise ShapeError(f"{name}: found shape {tuple(tensor.shape)}, expected (..., {size}).")


def check_same_shape(first_name: str, first: Tensor, second_name: str, second: Tensor) -> None:
    """Check that two tensors have one shape.

    Raises:
        ShapeError: If they have not.
    """
    if first.shape != second.shape:
        raise ShapeError(
            f"{first_name} and {second_name}: found shapes {tuple(first.shape)} and {tuple(second.shape)}, "
            "expected the same shape."
        )


def check_finite(name: str, tensor: Tensor) -> None:
    """Check that a tensor holds finite numbers only.

    Raises:
        NumericalError: If it holds NaN or infinity; the message counts them.
    """
    bad = int((~tensor.isfinite()).sum())
    if bad:
        raise NumericalError(
            f"{name}: found {bad} of {tensor.numel()} values not finite, expected finite numbers."
        )
