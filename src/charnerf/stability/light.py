"""Cases of alphas, transmittance, weights, compositing, depth, sampling and quadrature."""

from collections.abc import Iterator

import mpmath
import torch
from torch import Tensor

from charnerf.geometry.sampling import edges_from_t_vals, importance_t_vals, stratified_t_vals
from charnerf.stability import naive
from charnerf.stability.exact import MEDIA, ExactLight, Medium, closed_form_weights, exact_light, exactly
from charnerf.stability.measure import (
    Bounds,
    Errors,
    Target,
    count_non_finite,
    doubled,
    largest,
    relative_to_ray,
)
from charnerf.stability.report import CheckCurve, CheckRow
from charnerf.volume.compositing import (
    alphas_from_densities,
    composite,
    depth_over_background,
    expected_depth,
    weights_from_densities,
)
from charnerf.volume.quadrature import AbstractQuadrature, PiecewiseConstant, PiecewiseLinear

NUM_BINS = 32
_COLORS = (torch.arange(NUM_BINS) * 37 % 64).double() / 64  # exact in every dtype
ONE = Bounds(5e-6, 1e-13)
RAY = Bounds(5e-6, 1e-13, 1e-5, 1e-13)
ALPHA = Bounds(4e-7, 1e-15, 1e-5, 1e-13)
ORDER = Bounds(0.2, 0.2)


def stiffnesses(target: Target) -> Tensor:
    """Products of density and interval, 1e-12 to 1e30, or what the dtype can say: (N,), float64."""
    low, high = (-6.0, 3.0) if target.dtype == torch.float16 else (-12.0, 30.0)
    return torch.logspace(low, high, 2 * int(high - low) + 1, dtype=torch.float64)


def alpha_cases(target: Target) -> Iterator[CheckRow | CheckCurve]:
    """Relative error of alpha and of its gradient at every stiffness; value and gradient by themselves."""
    products = stiffnesses(target)
    densities, deltas = target.tensor(products), torch.ones_like(target.tensor(products))
    exact = exactly(lambda tau: -mpmath.expm1(-tau), densities)
    slopes = exactly(lambda tau: mpmath.exp(-tau), densities)
    for formula, function in (("ours", alphas_from_densities), ("naive", naive.alphas)):
        sigma = densities.clone().requires_grad_()
        computed = function(sigma, deltas)
        (gradient,) = torch.autograd.grad(computed.float().sum() if target.is_half else computed.sum(), sigma)
        errors = (doubled(computed) - exact).abs() / exact
        steepness = (doubled(gradient) - slopes).abs() / slopes.clamp_min(1e-30)
        slope = None if target.is_half else largest(steepness)  # a half's gradient is rounded to that half
        measured = Errors(largest(errors), slope, count_non_finite(computed, gradient))
        yield target.row("alphas", "every tau, relative", measured, ALPHA, formula=formula)
        yield _curve("alpha", target, formula, products, errors)


def _curve(what: str, target: Target, formula: str, x: Tensor, errors: Tensor) -> CheckCurve:
    label = f"{formula}, {target.dtype_name}, {target.device}"
    return CheckCurve(
        f"{what} against stiffness sigma * delta", label, tuple(x.tolist()), tuple(errors.tolist())
    )


def medium_cases(target: Target) -> Iterator[CheckRow | CheckCurve]:
    """Every medium with a closed form at every stiffness: weights, partition, colour and its gradient."""
    products = stiffnesses(target)
    for medium in MEDIA:
        bins = torch.tensor(
            [float(NUM_BINS * depth) for depth in medium.bin_depths(NUM_BINS)], dtype=torch.float64
        )
        sigma = target.tensor(products[:, None] * NUM_BINS * bins)
        exact = exact_light(sigma, torch.full_like(sigma, 1.0 / NUM_BINS), _COLORS, 0.25)
        yield from _light_rows(target, medium, sigma, exact, "ours")
        if medium.name in ("homogeneous slab", "two walls"):
            yield from _light_rows(target, medium, sigma, exact, "naive")
        if not target.is_half:
            weights, final = weights_from_densities(sigma, torch.full_like(sigma, 1.0 / NUM_BINS))
            error = relative_to_ray(weights, closed_form_weights(medium, NUM_BINS, products * NUM_BINS))
            errors = Errors(largest(error), None, count_non_finite(weights, final))
            yield target.row("weights, closed form", medium.name, errors, Bounds(2e-5, 1e-12))


def _light_rows(
    target: Target, medium: Medium, sigma: Tensor, exact: ExactLight, formula: str
) -> Iterator[CheckRow | CheckCurve]:
    """Rows and curves of one medium by one formula."""
    leaf = sigma.clone().requires_grad_()
    deltas = torch.full_like(sigma, 1.0 / NUM_BINS)
    weights, final = (weights_from_densities if formula == "ours" else naive.weights)(leaf, deltas)
    shades = _COLORS.to(weights)[:, None].expand(*weights.shape, 1)
    color = composite(weights, shades, weights.new_tensor([0.25]))[..., 0]
    (gradient,) = torch.autograd.grad(color.sum(), leaf)
    error, slope = (
        relative_to_ray(weights, exact.weights),
        relative_to_ray(gradient * NUM_BINS, exact.gradients),
    )
    bad = count_non_finite(weights, final, gradient)
    steepness = None if target.is_half else largest(slope)  # a half's gradient is rounded to that half
    yield target.row("weights", medium.name, Errors(largest(error), steepness, bad), RAY, formula=formula)
    partition = doubled(weights.sum(-1) + final - 1.0)
    if formula == "ours":
        yield target.row(
            "weights + transmittance = 1", medium.name, Errors(largest(partition), None, bad), ONE
        )
        seen = Errors(largest(doubled(color) - exact.color), None, bad)
        yield target.row("composite", medium.name, seen, ONE)
    if medium.name == "homogeneous slab":
        yield _curve("weights", target, formula, stiffnesses(target), error)
        yield _curve("weights + transmittance - 1", target, formula, stiffnesses(target), partition.abs())
        if not target.is_half:
            yield _curve("gradient of the colour", target, formula, stiffnesses(target), slope)


def long_ray_cases(target: Target) -> Iterator[CheckRow]:
    """Partition of the light over many samples, where a running sum gathers rounding."""
    for count in (192, 4096):
        share = torch.rand(64, count, generator=torch.Generator().manual_seed(count), dtype=torch.float64)
        densities = target.tensor(share * 10.0 ** torch.linspace(-4.0, 4.0, 64, dtype=torch.float64)[:, None])
        weights, final = weights_from_densities(densities, torch.full_like(densities, 1.0 / count))
        errors = Errors(largest(weights.sum(-1) + final - 1.0), None, count_non_finite(weights, final))
        yield target.row("weights + transmittance = 1", f"{count} samples", errors, ONE)


def depth_cases(target: Target) -> Iterator[CheckRow]:
    """Expected depth from no opacity to full, and the gradient of the depth over a background."""
    opacity = torch.cat((torch.zeros(1), torch.logspace(-38, 0, 39))).double()
    if target.is_half:
        opacity = torch.cat((torch.zeros(1), torch.logspace(-4, 0, 9))).double()
    t_vals = target.tensor(torch.linspace(2.0, 4.0, 5)).expand(len(opacity), 5)
    weights = target.tensor(opacity[:, None] * torch.tensor([0.1, 0.2, 0.4, 0.2, 0.1]).double())
    far = target.tensor(6.0)
    light, t = weights.double().cpu(), t_vals.double().cpu()
    exact = ((light * t).sum(-1) + 6e-7) / (light.sum(-1) + 1e-7)  # the background weighs 1e-7
    over = (light * (t - 6.0)).sum(-1) + 6.0
    for kernel, function, expected in (
        ("expected_depth", expected_depth, exact),
        ("depth_over_background", depth_over_background, over),
    ):
        leaf = weights.clone().requires_grad_()
        computed = function(leaf, t_vals, far)
        (gradient,) = torch.autograd.grad(computed.sum(), leaf)
        bad = count_non_finite(computed) if target.is_half else count_non_finite(computed, gradient)
        errors = Errors(largest(doubled(computed) - expected), None, bad)
        yield target.row(kernel, "opacity 0..1, m", errors, Bounds(5e-6, 1e-13))
    steepest = largest(gradient) / 4.0
    yield target.row(
        "depth_over_background",
        "gradient / (far - near)",
        Errors(steepest, None, 0),
        Bounds(1.0 + 1e-2, 1.0 + 1e-2),
    )
    if not target.is_half:
        leaf = weights.clone().requires_grad_()
        computed = naive.depth(leaf, t_vals)
        (gradient,) = torch.autograd.grad(computed.sum(), leaf)
        errors = Errors(largest(doubled(computed) - exact), None, count_non_finite(computed, gradient))
        yield target.row("expected_depth", "opacity 0..1, m", errors, Bounds(5e-6, 1e-13), formula="naive")


def last_interval_cases(target: Target) -> Iterator[CheckRow]:
    """Steepest gradient of an opacity to a density: a last interval of 1e10 m against one of 0.1 m."""
    if target.is_half:
        return
    for formula, last in (("ours", 0.1), ("naive", 1e10)):
        densities = target.tensor(torch.logspace(-12, 3, 16)[:, None].expand(16, 8)).requires_grad_()
        deltas = target.tensor([0.1] * 7 + [last]).expand(16, 8)
        weights, _ = weights_from_densities(densities, deltas)
        (gradient,) = torch.autograd.grad(weights.sum(), densities)
        errors = Errors(largest(gradient), None, count_non_finite(gradient))
        yield target.row(
            "last interval", "steepest gradient, ray of 0.8 m", errors, Bounds(0.8, 0.8), formula=formula
        )


def _histograms() -> dict[str, Tensor]:
    bins = torch.arange(64, dtype=torch.float64)
    spike = torch.zeros(64, dtype=torch.float64)
    spike[17] = 1e-37
    return {
        "weights 1..1e-37": 10.0 ** (-(37.0 * ((bins * 29) % 64) / 63)),
        "one bin of 1e-37": spike,
        "all zero": torch.zeros(64, dtype=torch.float64),
        "one NaN": torch.where(bins == 5, torch.nan, 1.0),
        "one infinite": torch.where(bins == 5, torch.inf, 1.0),
        "all 1e37": torch.full((64,), 1e37, dtype=torch.float64),
    }


def sampling_cases(target: Target) -> Iterator[CheckRow]:
    """Mass of the histogram before each draw against its share."""
    if target.is_half:
        return
    edges = target.tensor(torch.linspace(2.0, 4.0, 65))
    for name, masses in _histograms().items():
        weights = target.tensor(masses)
        usable = bool(weights.isfinite().all()) and float(weights.sum()) > 0
        reference = doubled(weights) if usable else torch.ones(64, dtype=torch.float64)
        cdf = torch.cat((torch.zeros(1, dtype=torch.float64), (reference / reference.sum()).cumsum(0)))
        quantiles = (torch.arange(128, dtype=torch.float64) + 0.5) / 128
        for formula in ("ours", "naive"):
            if formula == "ours":
                drawn = importance_t_vals(edges, weights, 128)
            else:
                drawn = naive.draw(edges, weights, target.tensor(quantiles))
            computed = doubled(drawn)
            position = ((computed - 2.0) * 32.0).nan_to_num(nan=0.0).clamp(0, 64)
            index = position.floor().long().clamp_max(63)
            mass = cdf[index] + (position - index) * (cdf[index + 1] - cdf[index])
            errors = Errors(largest(mass - quantiles), None, count_non_finite(drawn))
            if formula == "ours" or not usable:
                yield target.row("importance sampling", name, errors, Bounds(2e-5, 1e-12), formula=formula)


def linear_draw_cases(target: Target) -> Iterator[CheckRow]:
    """Draws of the linear quadrature against the CDF of the density sigma * t, at every stiffness."""
    if target.is_half:
        return
    scales = torch.logspace(-12, 30, 43, dtype=torch.float64)
    t_vals = target.tensor(torch.linspace(0.0, 1.0, 17)).expand(43, 17)
    ends = torch.zeros_like(t_vals[:, 0]), torch.ones_like(t_vals[:, 0])
    densities = target.tensor(scales)[:, None] * t_vals
    drawn = PiecewiseLinear().importance_t_vals(densities, t_vals, edges_from_t_vals(t_vals, *ends), 64)
    quantiles = (torch.arange(64, dtype=torch.float64) + 0.5) / 64
    half = 0.5 * doubled(target.tensor(scales))[:, None]
    mass = torch.expm1(-half * doubled(drawn).square()) / torch.expm1(-half)
    errors = Errors(largest(mass - quantiles), None, count_non_finite(drawn))
    yield target.row("importance sampling, linear", "density t, tau 1e-12..1e30", errors, Bounds(2e-5, 1e-10))


def _render_error(quadrature: AbstractQuadrature, target: Target, count: int, exact: float) -> float:
    """Error of the colour c(t) = t^2 through the density 6 exp(-2 t) on [0, 1]."""
    near, far = target.tensor([0.0]), target.tensor([1.0])
    t_vals = stratified_t_vals(near, far, count)
    weights, _ = quadrature.weights(
        6.0 * torch.exp(-2.0 * t_vals), t_vals, edges_from_t_vals(t_vals, near, far)
    )
    return abs(float(doubled((weights * t_vals.square()).sum())) - exact)


def order_cases(target: Target) -> Iterator[CheckRow | CheckCurve]:
    """Order of convergence: error of a render as samples double, declared 2 for both quadratures."""
    if target.is_half:
        return
    with mpmath.workdps(30):
        exact = float(
            mpmath.quad(
                lambda t: 6 * mpmath.exp(-2 * t) * mpmath.exp(3 * mpmath.expm1(-2 * t)) * t * t, [0, 0.5, 1]
            )
        )
    counts = [8, 16, 32, 64] if target.dtype == torch.float32 else [8, 16, 32, 64, 128, 256, 512]
    for quadrature in (PiecewiseConstant(), PiecewiseLinear()):
        errors = [_render_error(quadrature, target, count, exact) for count in counts]
        x, y = -torch.tensor(counts).double().log(), torch.tensor(errors).double().log()
        order = float(((x - x.mean()) * (y - y.mean())).sum() / (x - x.mean()).square().sum())
        name = type(quadrature).__name__
        yield target.row(
            "quadrature order", f"{name}: {order:.2f}, declared 2", Errors(abs(order - 2.0)), ORDER
        )
        yield CheckCurve(
            "render of an exponential medium against samples a ray",
            f"{name}, {target.dtype_name}, {target.device}",
            tuple(map(float, counts)),
            tuple(errors),
        )


CASES = (
    alpha_cases,
    medium_cases,
    long_ray_cases,
    depth_cases,
    last_interval_cases,
    sampling_cases,
    linear_draw_cases,
    order_cases,
)
