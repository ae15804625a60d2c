"""Parts of the field whose gradients are written out, so that a training step passes over memory less often.

At width 64 a step on a CPU waits for memory more than for arithmetic. Each function here equals its plain form to
rounding, values and gradients. They work on two dimensions: what a linear layer makes of three is a view, and the
gradient of a view changed in place copies the whole tensor several times.

Letters: N rows, D and H widths, P points, V views, K heads, Q readings.
"""

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn import functional as F


def residual_rows(x: Tensor, w1: Tensor, b1: Tensor, w2: Tensor, b2: Tensor) -> Tensor:
    """`x + relu(relu(x) W1' + b1) W2' + b2` of rows x (N, D)."""
    if torch.is_autocast_enabled(x.device.type):
        return x + F.linear(F.linear(x.relu(), w1, b1).relu(), w2, b2)
    if not torch.is_grad_enabled():
        return _residual(x, w1, b1, w2, b2)[0]
    return _Residual.apply(x, w1, b1, w2, b2)  # type: ignore[no-any-return, no-untyped-call]


def score_views(projected: Tensor, addend: Tensor, w_score: Tensor, b_score: Tensor) -> Tensor:
    """`relu(x + addend) w' + b_score` of projected features x (P, V, H): a score each, (P, V); addends broadcast to x."""
    if torch.is_autocast_enabled(projected.device.type):
        return F.linear((projected + addend).relu(), w_score, b_score)[..., 0]
    if not torch.is_grad_enabled():
        return _score(projected, addend, w_score, b_score)[0]
    rows, addends = (one.expand_as(projected).reshape(-1, projected.shape[-1]) for one in (projected, addend))
    scores: Tensor = _Score.apply(rows, addends, w_score, b_score)  # type: ignore[no-untyped-call]
    return scores.view(projected.shape[:-1])


def linear_of_columns(features: Tensor, w: Tensor) -> Tensor:
    """`x W'` of features x (P, V, E), read without a copy where they lie feature by feature in memory: (P, V, D)."""
    columns = features.permute(2, 0, 1).reshape(features.shape[2], -1)
    return (columns.t() @ w.t()).view(*features.shape[:2], len(w))


def once(rows: Tensor) -> Tensor:
    """Rows (P, ...) that were expanded from one as that one, (1, ...), others as they are: what is alike costs one row."""
    return rows[:1] if len(rows) and rows.stride(0) == 0 else rows


def view_cosines(view_dirs: Tensor, source_dirs: Tensor) -> Tensor:
    """Cosines (P, V) of unit directions (P, 3) and (P, V, 3), column by column: sums over an axis of three are slow."""
    x, y, z = (view_dirs[:, axis, None] * source_dirs[..., axis] for axis in range(3))
    return x + y + z


def softmax_views(logits: Tensor) -> Tensor:
    """Softmax over the views of logits (P, V), points in a row: along an axis of three or four it costs thirty times as much."""
    return torch.softmax(logits.t().contiguous(), dim=0).t()


def sum_views(weights: Tensor, features: Tensor) -> Tensor:
    """Sum over the views of weights (P, V, ...) times features (P, V, ..., D): (P, ..., D)."""
    if torch.is_autocast_enabled(features.device.type):
        return (weights[..., None] * features).sum(1)
    if not torch.is_grad_enabled():
        return _sum_views(weights, features)
    return _SumViews.apply(weights, features)  # type: ignore[no-any-return, no-untyped-call]


def pair_dots(queries: Tensor, keys: Tensor) -> Tensor:
    """Dot products of every view's query with every view's key, (P, V, K, D) each: (P, V query, V key, K).

    Pair by pair: with three or four views a batched matrix product costs far more than its arithmetic, and one product of all
    pairs is V times as large as the features.
    """
    if torch.is_autocast_enabled(queries.device.type):
        return (queries[:, :, None] * keys[:, None]).sum(-1)
    if not torch.is_grad_enabled():
        return _pair_dots(queries, keys)
    return _PairDots.apply(queries, keys)  # type: ignore[no-any-return, no-untyped-call]


def read_bags(rows: Tensor, indices: Tensor, weights: Tensor) -> Tensor:
    """Weighted sums of rows (N, C), indices and weights (Q, 4): (Q, C)."""
    if weights.requires_grad or not torch.is_grad_enabled():
        return F.embedding_bag(indices, rows, per_sample_weights=weights, mode="sum")
    return _Bags.apply(rows, indices, weights)  # type: ignore[no-any-return, no-untyped-call]


def _residual(x: Tensor, w1: Tensor, b1: Tensor, w2: Tensor, b2: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The block's result, and what its gradient reads: both layers' inputs."""
    rectified = x.relu()
    hidden = (rectified @ w1.t()).add_(b1).relu_()
    return (hidden @ w2.t()).add_(x).add_(b2), rectified, hidden


def _score(x: Tensor, addend: Tensor, w_score: Tensor, b_score: Tensor) -> tuple[Tensor, Tensor]:
    """The scores (...) of x (..., H), and the rows that they are made of."""
    rows = (x + addend).relu_().reshape(-1, x.shape[-1])
    return torch.addmm(b_score, rows, w_score.t()).view(x.shape[:-1]), rows


def _sum_views(weights: Tensor, features: Tensor) -> Tensor:
    """View by view: fewer passes over memory than a product and a sum, far fewer than a batched matrix product."""
    total = features[:, 0] * weights[:, 0, ..., None]
    for view in range(1, features.shape[1]):
        total.addcmul_(features[:, view], weights[:, view, ..., None])
    return total


def _pair_dots(queries: Tensor, keys: Tensor) -> Tensor:
    product = torch.empty_like(queries[:, 0])
    dots = queries.new_empty(queries.shape[0], keys.shape[1], keys.shape[1], keys.shape[2])
    for i, query in enumerate(queries.unbind(1)):
        for j, key in enumerate(keys.unbind(1)):
            torch.sum(torch.mul(query, key, out=product), -1, out=dots[:, i, j])
    return dots


class _Residual(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, w1: Tensor, b1: Tensor, w2: Tensor, b2: Tensor) -> Tensor:
        result, rectified, hidden = _residual(x, w1, b1, w2, b2)
        ctx.save_for_backward(rectified, hidden, w1, w2)
        return result

    @staticmethod
    @once_differentiable  # type: ignore[no-untyped-call, untyped-decorator]
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, ...]:
        rectified, hidden, w1, w2 = ctx.saved_tensors
        inner = _where_positive_(grad @ w2, hidden)
        outer = _where_positive_(inner @ w1, rectified).add_(grad)
        return outer, inner.t() @ rectified, inner.sum(0), grad.t() @ hidden, grad.sum(0)


class _Score(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, addend: Tensor, w_score: Tensor, b_score: Tensor) -> Tensor:
        scores, hidden = _score(x, addend, w_score, b_score)
        ctx.save_for_backward(hidden, w_score)
        return scores

    @staticmethod
    @once_differentiable  # type: ignore[no-untyped-call, untyped-decorator]
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, ...]:
        hidden, w_score = ctx.saved_tensors
        column = grad[:, None]
        inner = _where_positive_(column * w_score, hidden)
        return inner, inner, column.t() @ hidden, grad.sum(0, keepdim=True)


class _SumViews(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, weights: Tensor, features: Tensor) -> Tensor:
        ctx.save_for_backward(weights, features)
        return _sum_views(weights, features)

    @staticmethod
    @once_differentiable  # type: ignore[no-untyped-call, untyped-decorator]
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, ...]:
        weights, features = ctx.saved_tensors
        to_weights = torch.stack([(one * grad).sum(-1) for one in features.unbind(1)], dim=1)
        return to_weights, grad[:, None] * weights[..., None]


class _PairDots(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, queries: Tensor, keys: Tensor) -> Tensor:
        ctx.save_for_backward(queries, keys)
        return _pair_dots(queries, keys)

    @staticmethod
    @once_differentiable  # type: ignore[no-untyped-call, untyped-decorator]
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, ...]:
        queries, keys = ctx.saved_tensors
        to_queries = [_sum_views(grad[:, i], keys) for i in range(queries.shape[1])]
        to_keys = [_sum_views(grad[:, :, j], queries) for j in range(keys.shape[1])]
        return torch.stack(to_queries, dim=1), torch.stack(to_keys, dim=1)


class _Bags(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, rows: Tensor, indices: Tensor, weights: Tensor) -> Tensor:
        ctx.save_for_backward(indices, weights)
        ctx.num_rows = rows.shape[0]
        return F.embedding_bag(indices, rows, per_sample_weights=weights, mode="sum")

    @staticmethod
    @once_differentiable  # type: ignore[no-untyped-call, untyped-decorator]
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, ...]:
        """Each row is itself a weighted sum, of the gradients of the readings that it took part in."""
        indices, weights = ctx.saved_tensors
        sorted_rows, order = indices.reshape(-1).int().sort()
        offsets = torch.searchsorted(
            sorted_rows, torch.arange(ctx.num_rows, dtype=torch.int32, device=grad.device)
        )
        factors = weights.reshape(-1)[order]
        readings = order.div_(indices.shape[1], rounding_mode="floor")
        return F.embedding_bag(readings, grad, offsets, per_sample_weights=factors, mode="sum"), None, None


def _where_positive_(grad: Tensor, rectified: Tensor) -> Tensor:
    """The gradient of a rectifier, in place: kept where its result is positive."""
    torch.ops.aten.threshold_backward.grad_input(grad, rectified, 0, grad_input=grad)
    return grad
