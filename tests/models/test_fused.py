"""Parts with gradients written out equal their plain forms."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.models.fused import (
    linear_of_columns,
    once,
    pair_dots,
    read_bags,
    residual_rows,
    score_views,
    softmax_views,
    sum_views,
    view_cosines,
)


def rand(*shape: int) -> Tensor:
    return torch.randn(*shape, dtype=torch.float64, generator=torch.Generator().manual_seed(sum(shape)))


def assert_equal_with_gradients(
    fused: Callable[..., Tensor], plain: Callable[..., Tensor], *inputs: Tensor
) -> None:
    outputs, gradients = [], []
    for function in (fused, plain):
        leaves = [one.clone().requires_grad_() for one in inputs]
        output = function(*leaves)
        upstream = rand(*output.shape, 1)[..., 0]
        gradients.append(torch.autograd.grad((output * upstream).sum(), leaves))
        outputs.append(output)
        with torch.no_grad():
            assert torch.allclose(function(*inputs), output, rtol=0, atol=1e-12)
    assert torch.allclose(outputs[0], outputs[1], rtol=0, atol=1e-12)
    for ours, theirs in zip(*gradients, strict=True):
        assert ours.shape == theirs.shape
        assert torch.allclose(ours, theirs, rtol=0, atol=1e-12)


@pytest.mark.parametrize("rows", [0, 1, 37])
def test_residual_rows(rows: int) -> None:
    def plain(x: Tensor, w1: Tensor, b1: Tensor, w2: Tensor, b2: Tensor) -> Tensor:
        return x + F.linear(F.linear(x.relu(), w1, b1).relu(), w2, b2)

    assert_equal_with_gradients(
        residual_rows, plain, rand(rows, 8), rand(8, 8), rand(8), rand(8, 8) + 1, rand(8)
    )


@pytest.mark.parametrize("points", [0, 1, 13])
@pytest.mark.parametrize("alike", [False, True])
def test_score_views(points: int, alike: bool) -> None:
    def plain(x: Tensor, addend: Tensor, ws: Tensor, bs: Tensor) -> Tensor:
        return F.linear((x + addend).relu(), ws, bs)[..., 0]

    addend = rand(1 if alike else points, 3, 5)
    assert_equal_with_gradients(score_views, plain, rand(points, 3, 5), addend, rand(1, 5), rand(1))


@pytest.mark.parametrize("points", [0, 1, 13])
@pytest.mark.parametrize("views", [1, 4])
def test_softmax_over_views(views: int, points: int) -> None:
    logits = rand(points, views)
    logits[:1, 1:] = -torch.inf
    assert_equal_with_gradients(softmax_views, lambda x: torch.softmax(x, dim=-1), logits)


@pytest.mark.parametrize("alike", [False, True])
def test_cosines_of_views(alike: bool) -> None:
    """Of directions that are alike for all points, too."""
    sources = rand(1 if alike else 13, 4, 3)
    assert_equal_with_gradients(view_cosines, lambda d, s: (d[:, None] * s).sum(-1), rand(13, 3), sources)


def test_what_was_expanded_is_taken_once() -> None:
    rows = rand(1, 4, 3)
    assert once(rows.expand(7, -1, -1)).shape == (1, 4, 3)
    assert once(rand(7, 4, 3)).shape == (7, 4, 3)
    assert once(rows.expand(0, -1, -1)).shape == (0, 4, 3)


@pytest.mark.parametrize("points", [0, 1, 13])
def test_linear_layers_of_columns(points: int) -> None:
    """Whether the features lie point by point or feature by feature in memory."""
    assert_equal_with_gradients(linear_of_columns, lambda x, w: x @ w.t(), rand(points, 4, 6), rand(5, 6))
    columns = rand(6, points, 4).permute(1, 2, 0)
    assert torch.allclose(
        linear_of_columns(columns, rand(5, 6)), columns @ rand(5, 6).t(), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("points", [0, 1, 13])
@pytest.mark.parametrize("views", [1, 3, 8])
def test_pair_dots(views: int, points: int) -> None:
    assert_equal_with_gradients(
        pair_dots,
        lambda q, k: torch.einsum("pvhd,pwhd->pvwh", q, k),
        rand(points, views, 2, 5),
        rand(points, views, 2, 5) + 1.0,
    )


@pytest.mark.parametrize("views", [1, 3])
def test_sum_views_by_head(views: int) -> None:
    assert_equal_with_gradients(
        sum_views,
        lambda w, f: (w[..., None] * f).sum(1),
        rand(11, 2, views).transpose(1, 2),
        rand(11, views, 2, 6),
    )


@pytest.mark.parametrize("views", [1, 3, 8])
def test_sum_views(views: int) -> None:
    assert_equal_with_gradients(
        sum_views, lambda w, f: (w[..., None] * f).sum(1), rand(11, views), rand(11, views, 6)
    )


@pytest.mark.parametrize("readings", [0, 1, 50])
def test_read_bags(readings: int) -> None:
    """Rows that nothing reads get a zero, rows read twice by one reading both shares."""
    indices = torch.randint(0, 20, (readings, 4), generator=torch.Generator().manual_seed(0))
    weights = rand(readings, 4)

    def plain(rows: Tensor) -> Tensor:
        return (rows[indices] * weights[..., None]).sum(1)

    assert_equal_with_gradients(lambda rows: read_bags(rows, indices, weights), plain, rand(30, 3))


def test_read_bags_gives_the_weights_a_gradient_where_they_want_one() -> None:
    indices = torch.randint(0, 20, (9, 4), generator=torch.Generator().manual_seed(0))
    assert_equal_with_gradients(
        lambda rows, weights: read_bags(rows, indices, weights),
        lambda rows, weights: (rows[indices] * weights[..., None]).sum(1),
        rand(20, 3),
        rand(9, 4),
    )


def test_autocast_runs_the_plain_forms() -> None:
    x, w = torch.randn(6, 8, requires_grad=True), torch.randn(8, 8)
    with torch.autocast("cpu", torch.bfloat16):
        residual = residual_rows(x, w, w[0], w, w[1])
        scores = score_views(x[:, None], x[:, None], w[:1], w[0, :1])
        summed = sum_views(torch.rand(6, 2), x[:, None].expand(-1, 2, -1))
    (residual.sum() + scores.sum() + summed.sum()).backward()
    assert x.grad is not None and bool(x.grad.isfinite().all())
