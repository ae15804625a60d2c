"""Combinators: one feature whatever the number and order of views; the paper's logits split exactly."""

import math
from functools import partial

import pytest
import torch

from charnerf.geometry.safe import safe_normalize
from charnerf.models.combinators.base import masked_logits, view_weights
from charnerf.models.combinators.self_attention import SelfAttention
from charnerf.models.combinators.view_attention import ViewAttention
from support import tiny_models

WIDTH, HEADS, POINTS = 12, 2, 7
NAMES = tiny_models.COMBINATORS


def inputs(num_views: int, *, seed: int = 0) -> tuple[torch.Tensor, ...]:
    """Features, query directions, source directions and flags: some points see some views, some none."""
    generator = torch.Generator().manual_seed(seed)
    random = lambda *shape: torch.randn(*shape, generator=generator, dtype=torch.float64)  # noqa: E731
    valid = torch.rand(POINTS, num_views, generator=generator) < 0.7
    valid[0], valid[1] = True, False
    return (
        random(POINTS, num_views, WIDTH),
        safe_normalize(random(POINTS, 3)),
        safe_normalize(random(POINTS, num_views, 3)),
        valid,
    )


def make(name: str) -> torch.nn.Module:
    """A combinator, float64, no layer at its special start."""
    return tiny_models.shake(tiny_models.combinator(name).double())


@pytest.mark.parametrize("num_views", [2, 3, 8])
@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_views_does_not_matter(name, num_views):
    features, dirs, sources, valid = inputs(num_views)
    combine = make(name)
    order = torch.randperm(num_views)
    torch.testing.assert_close(
        combine(features[:, order], dirs, sources[:, order], valid[:, order]),
        combine(features, dirs, sources, valid),
    )


@pytest.mark.parametrize("name", NAMES)
def test_what_is_projected_once_answers_every_direction(name):
    features, dirs, sources, valid = inputs(3)
    combine = make(name)
    projected = combine.project(features)
    for towards in (dirs, -dirs, torch.zeros_like(dirs[:1])):
        found = combine.answer(features, projected, towards, sources, valid)
        torch.testing.assert_close(found, combine(features, towards, sources, valid), atol=1e-12, rtol=0)


@pytest.mark.parametrize("name", ["sa", "view_mha", "learned"])
def test_shares_of_views_are_those_of_what_is_combined(name):
    """They sum to one, and hidden views get none."""
    features, dirs, sources, valid = inputs(3)
    combine = make(name)
    shares = combine.view_shares(features, dirs, sources, valid)
    torch.testing.assert_close(shares.sum(-1), torch.ones(POINTS, dtype=torch.float64))
    seen_by_some = valid.any(-1)
    assert not shares[seen_by_some][~valid[seen_by_some]].any()
    if name == "learned":
        combined = combine(features, dirs, sources, valid)
        torch.testing.assert_close(combined, (shares[..., None] * features).sum(1))


@pytest.mark.parametrize("name", ["mean", "learned"])
def test_one_view_is_itself(name):
    features, dirs, sources, valid = inputs(1)
    torch.testing.assert_close(make(name)(features, dirs, sources, valid), features[:, 0])


@pytest.mark.parametrize("name", ["sa", "view_mha"])
def test_attention_over_one_view_is_its_value(name):
    features, dirs, sources, valid = inputs(1)
    combine = make(name)
    torch.testing.assert_close(combine(features, dirs, sources, valid), combine.values(features[:, 0]))


@pytest.mark.parametrize("name", NAMES)
def test_views_that_do_not_see_the_point_do_not_count(name):
    features, dirs, sources, valid = inputs(4)
    valid[0] = torch.tensor((True, False, True, False))
    combine = make(name)
    found = combine(features, dirs, sources, valid)
    seen = torch.tensor((0, 2))
    alone = combine(features[:1, seen], dirs[:1], sources[:1, seen], valid[:1, seen])
    torch.testing.assert_close(found[:1], alone)
    changed = features.clone()
    changed[~valid & valid.any(-1, keepdim=True)] = 1e3
    torch.testing.assert_close(combine(changed, dirs, sources, valid), found)


@pytest.mark.parametrize("name", NAMES)
def test_where_no_view_sees_the_point_all_count(name):
    features, dirs, sources, valid = inputs(3)
    none, every = torch.zeros_like(valid), torch.ones_like(valid)
    combine = make(name)
    features.requires_grad_()
    found = combine(features, dirs, sources, none)
    torch.testing.assert_close(found, combine(features, dirs, sources, every))
    (gradient,) = torch.autograd.grad(found.sum(), features)
    assert found.isfinite().all() and gradient.isfinite().all()


@pytest.mark.parametrize("name", NAMES)
def test_no_direction_is_finite_in_value_and_gradient(name):
    """The surface loss asks with a zero direction."""
    features, dirs, sources, valid = inputs(3)
    zero, no_source = (
        torch.zeros_like(dirs, requires_grad=True),
        torch.zeros_like(sources, requires_grad=True),
    )
    features.requires_grad_()
    combine = make(name)
    for flat in (features, torch.zeros_like(features, requires_grad=True)):
        found = combine(flat, zero, no_source, valid)
        gradients = torch.autograd.grad(
            found.square().sum(), (flat, zero, no_source, *combine.parameters()), allow_unused=True
        )
        assert found.isfinite().all()
        assert all(g.isfinite().all() for g in gradients if g is not None)


@pytest.mark.parametrize("name", NAMES)
def test_whether_the_query_is_seen_is_said_truly(name):
    features, dirs, sources, valid = inputs(3)
    combine = make(name)
    same = torch.allclose(
        combine(features, dirs, sources, valid), combine(features, -dirs, sources, valid), atol=1e-9
    )
    assert same != combine.sees_query


@pytest.mark.parametrize("temperature", [None, 3.0])
def test_split_logits_sum_to_the_plain_concatenated_dot_product(temperature):
    """Q = [V, s d], K = [V, s d_i] for every head, over sqrt(d_k + 3); a temperature scales the first."""
    combine = ViewAttention(**tiny_models.attention(temperature=temperature), view_scale=0.7).double()
    features, dirs, sources, _ = inputs(4)
    logits = combine.logits(features, dirs, sources)
    size = WIDTH // HEADS
    for head in range(HEADS):
        piece = slice(head * size, (head + 1) * size)
        query = safe_normalize(features @ combine.queries.weight.T[:, piece])
        key = safe_normalize(features @ combine.keys.weight.T[:, piece])
        factor = 1.0 if temperature is None else combine.log_temperature.exp().sqrt()
        scaled = combine.view_scale * dirs[:, None].expand(-1, 4, -1)
        whole_query = torch.cat((factor * query, scaled), dim=-1)
        whole_key = torch.cat((factor * key, combine.view_scale * sources), dim=-1)
        plain = whole_query @ whole_key.mT / math.sqrt(size + 3)
        torch.testing.assert_close(logits.features[:, head] + logits.view[:, head], plain, atol=1e-14, rtol=0)


def test_without_view_scale_it_is_self_attention():
    """The two differ by sqrt(d_k + 3) against sqrt(d_k) alone, which a temperature takes away."""
    size = WIDTH // HEADS
    attention = tiny_models.attention
    plain = SelfAttention(**attention()).double()
    warm = attention(temperature=math.sqrt((size + 3) / size))
    view = ViewAttention(**warm, view_scale=0.0).double()
    view.load_state_dict(plain.state_dict(), strict=False)
    features, dirs, sources, valid = inputs(4)
    torch.testing.assert_close(
        view(features, dirs, sources, valid), plain(features, dirs, sources, valid), atol=1e-8, rtol=0
    )
    bare = ViewAttention(**attention(), view_scale=0.0).double()
    bare.load_state_dict(plain.state_dict(), strict=False)
    logits = bare.logits(features, dirs, sources)
    expected = plain.scale * plain.feature_logits(features)
    torch.testing.assert_close(logits.features * math.sqrt((size + 3) / size), expected)
    assert logits.view.eq(0).all()


def test_directions_are_signed_and_opposite_views_differ():
    """Features alike, the view that looks along the query wins; turned round, the other one does."""
    combine = ViewAttention(**tiny_models.attention(), view_scale=3.0).double()
    features = torch.ones(1, 2, WIDTH, dtype=torch.float64)
    ahead = torch.tensor(((0.0, 1.0, 0.0),), dtype=torch.float64)
    sources = torch.stack((ahead, -ahead), dim=1)
    logits = combine.logits(features, ahead, sources).view
    assert (logits[..., 0] > 0.5).all() and (logits[..., 1] < -0.5).all()
    torch.testing.assert_close(combine.logits(features, -ahead, sources).view, -logits)


@pytest.mark.parametrize("name", ["sa", "view_mha"])
def test_rows_sum_to_one_and_averaging_weights_first_changes_nothing(name):
    features, _, _, valid = inputs(4)
    combine = make(name)
    logits = torch.randn(POINTS, HEADS, 4, 4, dtype=torch.float64)
    weights = torch.softmax(masked_logits(logits, valid), dim=-1)
    torch.testing.assert_close(weights.sum(-1), torch.ones_like(weights[..., 0]))
    assert (weights[2:] * ~valid[2:, None, None]).sum() == 0
    rows = torch.einsum("phij,pjhd->pihd", weights, combine.split(combine.values(features))).flatten(-2)
    averaged_later = (rows * view_weights(valid, rows.dtype)[..., None]).sum(1)
    torch.testing.assert_close(combine.attend(logits, features, valid), averaged_later)


def test_the_residual_form_adds_the_mean_and_normalises():
    combine = SelfAttention(**tiny_models.attention(residual=True, temperature=2.0)).double()
    features, dirs, sources, valid = inputs(3)
    found = combine(features, dirs, sources, valid)
    torch.testing.assert_close(found.mean(-1), torch.zeros(POINTS, dtype=torch.float64), atol=1e-12, rtol=0)
    names = {name for name, _ in combine.named_parameters()}
    plain = {name for name, _ in tiny_models.combinator("sa").named_parameters()}
    assert names - plain == {
        "norm.weight",
        "norm.bias",
        "output.weight",
        "output.bias",
        "log_temperature",
    }


def test_learned_weights_start_as_the_mean():
    features, dirs, sources, valid = inputs(5)
    learned = tiny_models.combinator("learned").double()
    mean = tiny_models.combinator("mean")
    torch.testing.assert_close(learned(features, dirs, sources, valid), mean(features, dirs, sources, valid))
    learned(features, dirs, sources, valid).sum().backward()
    assert learned.score.weight.grad.abs().sum() > 0  # and leave it at the first step


@pytest.mark.parametrize("name", NAMES)
def test_gradcheck(name):
    features, dirs, sources, valid = inputs(3)
    combine = make(name)
    for tensor in (features, dirs, sources):
        tensor.requires_grad_()
    assert torch.autograd.gradcheck(
        lambda *x: combine(*x, valid[:2]), (features[:2].detach().requires_grad_(), dirs[:2], sources[:2])
    )


@pytest.mark.parametrize("name", ["sa", "view_mha"])
def test_attention_may_be_narrower_than_the_network(name):
    """Queries, keys and values of 4 numbers in all; a linear layer brings them back to D."""
    kind = {"sa": SelfAttention, "view_mha": partial(ViewAttention, view_scale=1.0)}[name]
    features, dirs, sources, valid = inputs(3)
    narrow = kind(**tiny_models.attention(attention_width=4)).double()
    assert narrow.values.out_features == 4 and narrow.norm is None
    assert narrow(features, dirs, sources, valid).shape == (POINTS, WIDTH)
    plain = kind(**tiny_models.attention()).double()
    same = kind(**tiny_models.attention(attention_width=WIDTH)).double()
    same.load_state_dict(plain.state_dict())  # the plain form has no further weights
    assert torch.equal(same(features, dirs, sources, valid), plain(features, dirs, sources, valid))


def test_the_residual_without_its_norm_is_the_sum():
    plain = SelfAttention(**tiny_models.attention()).double()
    bare = SelfAttention(**tiny_models.attention(residual=True, norm=False)).double()
    bare.load_state_dict(plain.state_dict(), strict=False)
    features, dirs, sources, valid = inputs(3)
    mean = tiny_models.combinator("mean")(features, dirs, sources, valid)
    expected = mean + bare.output(plain(features, dirs, sources, valid))
    torch.testing.assert_close(bare(features, dirs, sources, valid), expected)
