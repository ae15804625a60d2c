"""Muon with Adam: orthogonal steps, Adam's own numbers, and one state for both."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import nn

from charnerf.training.muon import MOMENTUM, MuonWithAdam, is_matrix, orthogonalized


@settings(max_examples=30, deadline=None)
@given(
    rows=st.integers(5, 40), columns=st.integers(5, 40), exponent=st.floats(-30, 15), seed=st.integers(0, 99)
)
def test_singular_values_become_about_one_at_any_scale(rows, columns, exponent, seed):
    generator = torch.Generator().manual_seed(seed)
    matrix = torch.randn(rows, columns, generator=generator)
    u, s, v = torch.linalg.svd(matrix, full_matrices=False)
    level = u @ torch.diag(0.2 + 0.8 * s / s.max()) @ v  # well conditioned
    found = orthogonalized(10.0**exponent * level)
    assert found.shape == matrix.shape
    values = torch.linalg.svdvals(found)
    assert values.min() > 0.6 and values.max() < 1.3
    torch.testing.assert_close(
        u.T @ found @ v.T, torch.diag(torch.diagonal(u.T @ found @ v.T)), atol=2e-3, rtol=0
    )


def test_a_zero_gradient_moves_nothing():
    assert orthogonalized(torch.zeros(6, 9)).eq(0).all()


def test_directions_without_gradient_stay():
    matrix = torch.zeros(8, 8)
    matrix[0, 0], matrix[1, 1] = 3.0, 1.0
    values = torch.linalg.svdvals(orthogonalized(matrix))
    assert values[1] > 0.6 and values[2:].abs().max() < 1e-6


def test_the_first_step_of_a_matrix_is_the_orthogonalized_gradient():
    weight = nn.Parameter(torch.zeros(12, 6))
    optimizer = MuonWithAdam([weight], lr=1.0, matrix_lr=0.1)
    weight.grad = torch.randn(12, 6, generator=torch.Generator().manual_seed(1))
    optimizer.step()
    torch.testing.assert_close(weight.detach(), -0.1 * 2.0**0.5 * orthogonalized(weight.grad))


def test_filters_count_as_matrices_of_their_outputs():
    filters = nn.Parameter(torch.zeros(6, 2, 3, 3))
    optimizer = MuonWithAdam([filters], lr=1.0, matrix_lr=1.0)
    filters.grad = torch.randn(6, 2, 3, 3, generator=torch.Generator().manual_seed(2))
    optimizer.step()
    values = torch.linalg.svdvals(filters.detach().flatten(1))
    assert values.min() > 0.5 and values.max() < 1.4


def test_the_rest_moves_as_torch_s_adam_moves_it():
    start = torch.randn(7, generator=torch.Generator().manual_seed(3))
    ours, theirs = nn.Parameter(start.clone()), nn.Parameter(start.clone())
    both = MuonWithAdam([ours], lr=1e-2, matrix_lr=1.0), torch.optim.Adam([theirs], lr=1e-2)
    for step in range(20):
        for parameter, optimizer in zip((ours, theirs), both, strict=True):
            parameter.grad = (parameter.detach() - step) * torch.arange(7.0)
            optimizer.step()
    torch.testing.assert_close(ours, theirs)


def test_what_counts_as_a_matrix():
    model = nn.Sequential(nn.Conv2d(4, 8, 3), nn.GroupNorm(2, 8), nn.Linear(8, 8), nn.Linear(8, 4))
    found = [name for name, parameter in model.named_parameters() if is_matrix(parameter)]
    assert found == ["0.weight", "2.weight"]


def test_a_resumed_run_goes_on_as_if_never_stopped():
    def run(stop: int | None) -> torch.Tensor:
        torch.manual_seed(4)
        model = nn.Sequential(nn.Linear(6, 6), nn.Tanh(), nn.Linear(6, 1))
        optimizer = MuonWithAdam(model.parameters(), lr=1e-2, matrix_lr=1e-2)
        x = torch.randn(32, 6)
        for step in range(12):
            if step == stop:
                kept = optimizer.state_dict()
                optimizer = MuonWithAdam(model.parameters(), lr=1.0, matrix_lr=1.0)
                optimizer.load_state_dict(kept)
            optimizer.zero_grad()
            (model(x) - x.prod(-1, keepdim=True)).square().mean().backward()
            optimizer.step()
        return torch.cat([p.detach().reshape(-1) for p in model.parameters()])

    torch.testing.assert_close(run(5), run(None), rtol=0, atol=0)


def test_it_levels_what_a_gradient_step_can_not():
    """A quadratic of condition 1e6: both start alike, momentum SGD at its best fixed rate leaves the flat direction."""
    scales = torch.logspace(0, -3, 8)
    target = torch.eye(8)

    def loss(weight: torch.Tensor) -> torch.Tensor:
        return (scales[:, None] * (weight - target)).square().sum()

    weight = nn.Parameter(torch.zeros(8, 8))
    optimizer = MuonWithAdam([weight], lr=1.0, matrix_lr=0.02)
    for _ in range(200):
        optimizer.zero_grad()
        loss(weight).backward()
        optimizer.step()
    plain = nn.Parameter(torch.zeros(8, 8))
    sgd = torch.optim.SGD([plain], lr=0.05, momentum=MOMENTUM)
    for _ in range(200):
        sgd.zero_grad()
        loss(plain).backward()
        sgd.step()
    assert (
        weight - target
    ).abs().max() < 0.3  # the rate is a step of a fixed length: it circles at that distance
    assert (plain - target).abs().max() > 0.9


@pytest.mark.parametrize("name", ["lr", "matrix_lr"])
def test_a_rate_must_be_positive(name):
    rates = {"lr": 1e-3, "matrix_lr": 1e-2} | {name: 0.0}
    with pytest.raises(ValueError, match=name):
        MuonWithAdam([nn.Parameter(torch.zeros(3))], **rates)


@pytest.mark.parametrize("shape", [(6, 9), (9, 6), (7, 7)])
def test_matrices_of_one_shape_turn_together_as_alone(shape):
    matrices = torch.randn(3, *shape, generator=torch.Generator().manual_seed(5))
    together = orthogonalized(matrices)
    for one, turned in zip(matrices, together, strict=True):
        torch.testing.assert_close(turned, orthogonalized(one), atol=1e-5, rtol=1e-5)
