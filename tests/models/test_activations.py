"""Density activations over the whole float range."""

import pytest
import torch

from charnerf.models.activations import ReLU, ShiftedSoftplus, TruncatedExp

ACTIVATIONS = [
    ReLU(scale=20.0),
    ShiftedSoftplus(shift=-1.0, scale=20.0),
    TruncatedExp(shift=-1.0, scale=1.0, limit=8.0),
]


@pytest.mark.parametrize("activation", ACTIVATIONS, ids=lambda a: type(a).__name__)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_densities_and_gradients_are_finite_and_monotone(activation, dtype):
    magnitudes = torch.logspace(-30, 30, 200, dtype=dtype)
    raw = torch.cat((-magnitudes.flip(0), torch.zeros(1, dtype=dtype), magnitudes)).requires_grad_()
    densities = activation(raw)
    densities.sum().backward()
    assert densities.isfinite().all() and densities.ge(0).all() and densities.diff().ge(0).all()
    assert raw.grad.isfinite().all() and raw.grad.ge(0).all()


def test_values_by_hand():
    raw = torch.tensor([1.0, 3.0])
    torch.testing.assert_close(ReLU(scale=2.0)(raw), torch.tensor([2.0, 6.0]))
    expected = 20.0 * torch.log(torch.tensor([2.0, 1.0 + torch.tensor(2.0).exp().item()]))
    torch.testing.assert_close(ShiftedSoftplus(shift=-1.0, scale=20.0)(raw), expected)
    exp = TruncatedExp(shift=-1.0, scale=3.0, limit=1.0)(raw)
    torch.testing.assert_close(exp, torch.tensor([3.0, 3.0 * 2.718281828 * 2.0]))


def test_plain_exponential_is_not_finite_where_the_truncated_is():
    raw = torch.tensor([89.0], requires_grad=True)
    assert raw.exp().isinf().all()
    TruncatedExp(shift=0.0, scale=1.0, limit=8.0)(raw).sum().backward()
    assert raw.grad.item() == pytest.approx(2980.958, rel=1e-5)


def test_half_precision_is_widened():
    for activation in ACTIVATIONS:
        assert activation(torch.tensor([11.5], dtype=torch.float16)).dtype == torch.float32


@pytest.mark.parametrize("activation", ACTIVATIONS, ids=lambda a: type(a).__name__)
def test_gradcheck(activation):
    raw = torch.tensor([-3.0, -0.5, 0.5, 4.0, 12.0], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(activation, raw)


def test_scale_carries_the_unit_of_length():
    """The same scene in millimetres: densities 1/1000, intervals times 1000, optical depth the same."""
    raw = torch.linspace(-5, 5, 11)
    metres = ShiftedSoftplus(shift=-1.0, scale=20.0)(raw) * 0.01
    millimetres = ShiftedSoftplus(shift=-1.0, scale=20.0e-3)(raw) * 10.0
    torch.testing.assert_close(metres, millimetres)
