"""Cases of normalisation, encoding, rays against boxes and hulls, and projection."""

from collections.abc import Iterator
from fractions import Fraction

import mpmath
import torch
from torch import Tensor

from charnerf.geometry.cameras import cameras_towards, fibonacci_hemisphere, pixel_rays, project
from charnerf.geometry.encoding import positional_encoding
from charnerf.geometry.hull import occupied_edges
from charnerf.geometry.rays import box_interval
from charnerf.geometry.safe import safe_normalize
from charnerf.stability import naive
from charnerf.stability.measure import Bounds, Errors, Target, count_non_finite, doubled, largest
from charnerf.stability.report import CheckCurve, CheckRow
from charnerf.types import Hull, RayBundle

UNIT = Bounds(5e-7, 1e-15, 2e-6, 1e-14)
PHASE = Bounds(1e-6, 2e-15)
INTERVAL = Bounds(1e-6, 1e-14)
CENTRE = torch.tensor([0.0, 0.0, 1.0])


def normalize_cases(target: Target) -> Iterator[CheckRow | CheckCurve]:
    """Unit vectors and their gradients, times length, at lengths 1e-30 to 1e18; then the zero vector."""
    low, high = (-4, 4) if target.dtype == torch.float16 else (-30, 18)
    lengths = torch.logspace(low, high, high - low + 1, dtype=torch.float64)
    vectors = target.tensor(lengths[:, None] * torch.tensor([0.48, -0.6, 0.64], dtype=torch.float64))
    exact, length = _exact_unit(vectors)
    slope = torch.zeros_like(exact)
    slope[:, 0] = 1.0
    slope = slope - exact * exact[:, :1]
    for formula, function in (("ours", safe_normalize), ("naive", naive.normalize)):
        if formula == "naive" and target.dtype == torch.float64:
            continue  # its range holds the squares of these lengths
        leaf = vectors.clone().requires_grad_()
        unit = function(leaf)
        (gradient,) = torch.autograd.grad(unit[:, 0].sum(), leaf)
        error = (doubled(unit) - exact).abs().amax(-1)
        steep = None if target.is_half else largest(doubled(gradient) * length - slope)
        bad = count_non_finite(unit) if target.is_half else count_non_finite(unit, gradient)
        yield target.row(
            "normalise", "length 1e-30..1e18", Errors(largest(error), steep, bad), UNIT, formula=formula
        )
        label = f"{formula}, {target.dtype_name}, {target.device}"
        yield CheckCurve("unit vector against length", label, tuple(lengths.tolist()), tuple(error.tolist()))


def zero_vector_cases(target: Target) -> Iterator[CheckRow]:
    """The zero direction of the surface loss."""
    for formula, function in (("ours", safe_normalize), ("naive", naive.normalize)):
        leaf = target.tensor([[0.0, 0.0, 0.0]]).requires_grad_()
        unit = function(leaf)
        (gradient,) = torch.autograd.grad(unit.sum(), leaf)
        errors = Errors(largest(unit), largest(gradient), count_non_finite(unit, gradient))
        yield target.row("normalise", "zero vector", errors, Bounds(0.0, 0.0, 0.0, 0.0), formula=formula)


def _exact_unit(vectors: Tensor) -> tuple[Tensor, Tensor]:
    """Unit vectors and lengths (N, 1) of vectors (N, 3) in float64: their squares stay in its range."""
    wide = doubled(vectors)
    length = wide.square().sum(-1, keepdim=True).sqrt()
    return wide / length, length


def encoding_cases(target: Target) -> Iterator[CheckRow]:
    """Twelve octaves at coordinates small, ordinary and large, against exact phases."""
    ordinary = torch.linspace(-0.999, 0.999, 31, dtype=torch.float64)
    x = target.tensor(torch.cat((ordinary, torch.tensor([1e-30, 1e-7, 1.0, 12345.678], dtype=torch.float64))))
    octaves = 12
    rows = []
    with mpmath.workdps(50):
        for value in doubled(x).tolist():
            phases = [mpmath.mpf(2) ** k * mpmath.mpf(value) for k in range(octaves)]
            rows.append([[float(mpmath.sinpi(p)), float(mpmath.cospi(p))] for p in phases])
    exact = torch.tensor(rows, dtype=torch.float64)  # (N, K, 2)
    for formula, function in (("ours", positional_encoding), ("naive", naive.encoding)):
        computed = function(x[:, None], octaves).unflatten(-1, (octaves, 2))
        errors = Errors(largest(doubled(computed) - exact), None, count_non_finite(computed))
        yield target.row("positional encoding", "12 octaves, |x| to 12346", errors, PHASE, formula=formula)


def box_cases(target: Target) -> Iterator[CheckRow]:
    """Rays along axes, on faces, through corners, far away, with slopes to 1e-42, against fractions."""
    if target.is_half:
        return
    low, high = (-0.8, -0.8, 0.0), (0.8, 0.8, 2.0)
    origins = [
        (-4.0, 0.1, 1.0),
        (-4.0, -0.8, 1.0),
        (-4.0, 0.8, 2.0),
        (-0.8, -0.8, 0.0),
        (0.0, 0.0, 1.0),
        (-4e3, 0.3, 0.7),
    ]
    directions = [
        (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1e-4, -1e-4), (1.0, 1e-20, 0.0), (1.0, 1e-38, 1e-38),
        (0.6, 0.0, 0.8), (1.0, 1e-42, -1e-42),
    ]  # fmt: skip
    pairs = [(o, d) for o in origins for d in directions]
    start, along = target.tensor([o for o, _ in pairs]), target.tensor([d for _, d in pairs])
    box_min, box_max = target.tensor(low), target.tensor(high)
    least = 4.0 * torch.finfo(target.dtype).tiny
    exact = [
        _exact_interval(o, d, box_min.tolist(), box_max.tolist(), least)
        for o, d in zip(start.tolist(), along.tolist(), strict=True)
    ]
    hits = torch.tensor([near < far for near, far in exact])
    expected = torch.tensor(
        [[float(near), float(far)] if near < far else [0.0, 0.0] for near, far in exact], dtype=torch.float64
    )
    scale = doubled(start).abs().amax(-1, keepdim=True)
    for formula in ("ours", "naive"):
        if formula == "ours":
            near, far = box_interval(RayBundle(start, along), box_min, box_max)
        else:
            near, far = naive.box_interval(start, along, box_min, box_max)
            near = near.clamp_min(0.0)
        computed = torch.stack((doubled(near), doubled(far)), dim=-1)
        length = computed[:, 1] - computed[:, 0]
        errors = torch.where(hits[:, None], (computed - expected) / scale, length.clamp_min(0.0)[:, None])
        yield target.row(
            "ray and box", "axes, faces, corners, slopes to 1e-42",
            Errors(largest(errors), None, count_non_finite(computed[hits])), INTERVAL, formula=formula,
        )  # fmt: skip


def _exact_interval(
    origin: list, direction: list, low: list, high: list, least: float
) -> tuple[Fraction, Fraction]:
    """Slab method in fractions; an interval without length where the ray misses or only touches."""
    near, far = Fraction(0), Fraction(10) ** 60
    for o, d, a, b in zip(origin, direction, low, high, strict=True):
        if abs(d) < least:  # a slope that moves nothing counts as none: on a face it stays inside
            if not a <= o <= b:
                return Fraction(0), Fraction(0)
            continue
        first, second = sorted(
            ((Fraction(a) - Fraction(o)) / Fraction(d), (Fraction(b) - Fraction(o)) / Fraction(d))
        )
        near, far = max(near, first), min(far, second)
    return (near, far) if near < far else (Fraction(0), Fraction(0))


def hull_cases(target: Target) -> Iterator[CheckRow]:
    """Occupied lengths: a full grid against the box, an empty one, a ball against its chords."""
    if target.is_half:
        return
    box_min, box_max = target.tensor([-1.0, -1.0, 0.0]), target.tensor([1.0, 1.0, 2.0])
    side = 64
    centres = (torch.arange(side, device=target.device) + 0.5) * (2.0 / side)
    x, y, z = torch.meshgrid(centres - 1.0, centres - 1.0, centres, indexing="ij")
    ball = x.square() + y.square() + (z - 1.0).square() < 0.64
    cameras = cameras_towards(
        fibonacci_hemisphere(7).to(target.dtype), target=CENTRE.to(target.dtype),
        distance=4.0, half_extent=1.0, size=16, orthographic=False,
    ).to(target.device)  # fmt: skip
    pixels = target.tensor(
        torch.rand(40, 7, 2, generator=torch.Generator().manual_seed(0), dtype=torch.float64) * 16
    )
    rays = pixel_rays(cameras, pixels)[:, :].to(target.device)
    rays = RayBundle(rays.origins.reshape(-1, 3), rays.directions.reshape(-1, 3))
    near, far = box_interval(rays, box_min, box_max)
    to_centre = target.tensor([0.0, 0.0, 1.0]) - rays.origins
    across = torch.linalg.cross(to_centre, rays.directions).square().sum(-1)
    chord = 2.0 * (0.64 - across).clamp_min(0.0).sqrt()
    grids = {
        "full grid": (torch.ones_like(ball), far - near, Bounds(2e-6, 1e-14)),
        "empty grid": (torch.zeros_like(ball), torch.zeros_like(near), Bounds(0.0, 0.0)),
        "ball of 0.8 m, cells of 31 mm": (ball, chord, Bounds(0.3, 0.3)),
    }
    for name, (occupancy, expected, bounds) in grids.items():
        nothing = box_min.new_zeros(0)
        hull = Hull(occupancy, box_min, box_max, nothing, nothing, nothing)
        t_edges, occupied = occupied_edges(hull, rays, 256)
        length = (torch.diff(t_edges, dim=-1) * occupied).sum(-1)
        errors = Errors(largest(length - expected), None, count_non_finite(t_edges, length))
        yield target.row("occupied length", f"{name}, m", errors, bounds)


def projection_cases(target: Target) -> Iterator[CheckRow]:
    """There and back through cameras; then points on the camera's plane, at its centre and behind it."""
    if target.is_half:
        return
    generator = torch.Generator().manual_seed(0)
    pixels = target.tensor(torch.rand(50, 9, 2, generator=generator, dtype=torch.float64) * 128)
    distances = target.tensor(
        10.0 ** (6.0 * torch.rand(50, 9, generator=generator, dtype=torch.float64) - 3.0)
    )
    for orthographic in (False, True):
        cameras = cameras_towards(
            fibonacci_hemisphere(9).to(target.dtype), target=CENTRE.to(target.dtype),
            distance=4.0, half_extent=1.3, size=128, orthographic=orthographic,
        ).to(target.device)  # fmt: skip
        kind = "orthographic" if orthographic else "pinhole"
        near = distances.clamp(0.5, 10.0)
        rays = pixel_rays(cameras, pixels)
        back, depth, in_front = project(cameras, rays.origins + near[..., None] * rays.directions)
        wrong = int((~in_front).sum())
        errors = Errors(largest(back - pixels) / 128, None, count_non_finite(back, depth) + wrong)
        yield target.row(
            "pixel -> point -> pixel", f"{kind}, 0.5..10 m, of the picture", errors, Bounds(1e-5, 1e-14)
        )
        centre = cameras.world_from_camera[..., :3, 3]
        right, forward = cameras.world_from_camera[..., :3, 0], -cameras.world_from_camera[..., :3, 2]
        odd = torch.stack((centre, centre + right, centre - forward, centre - 1e-3 * forward + 1e-4 * right))
        leaf = odd.clone().requires_grad_()
        computed, depth, in_front = project(cameras, leaf)
        (gradient,) = torch.autograd.grad(computed.sum() + depth.sum(), leaf)
        accepted = 0 if orthographic else int(in_front.sum())
        errors = Errors(float(accepted), None, count_non_finite(computed, depth, gradient))
        yield target.row("projection", f"{kind}: centre, plane, behind accepted", errors, Bounds(0.0, 0.0))
    local = target.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1e-4, 0.0, 1e-3]])
    computed = naive.project(local, 150.0)
    accepted = int((computed.abs() < 64).all(-1).sum())
    errors = Errors(float(accepted), None, count_non_finite(computed))
    yield target.row(
        "projection", "pinhole: centre, plane, behind accepted", errors, Bounds(0.0, 0.0), formula="naive"
    )


CASES = (normalize_cases, zero_vector_cases, encoding_cases, box_cases, hull_cases, projection_cases)
