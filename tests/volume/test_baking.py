"""What is baked: places between grid points, light, gaps, directions; and what a grid leaves out."""

import math

import pytest
import torch

from charnerf.geometry.cameras import pixel_lattice, project_into_all
from charnerf.volume.baking.bake import _expected_errors, _without_bias
from charnerf.volume.baking.directions import expected_error, polynomials, projection, sampled_directions
from charnerf.volume.baking.grid import (
    EMPTY_U,
    between,
    combined,
    densities_from_u,
    interpolated,
    u_from_densities,
)
from charnerf.volume.baking.lattice import corners_of, finer_points, gaps, light_depths
from support import helpers

SHAPE = (5, 6, 7)


def test_functions_linear_along_each_axis_are_read_exactly():
    generator = torch.Generator().manual_seed(0)
    places = torch.stack(torch.meshgrid(*[torch.arange(n) for n in SHAPE], indexing="ij"), dim=-1).reshape(
        -1, 3
    )
    order = torch.randperm(len(places), generator=generator)

    def values(at: torch.Tensor) -> torch.Tensor:
        x, y, z = at.double().unbind(-1)
        return torch.stack((x * y * z, 1.0 + x - 2.0 * y * z), dim=-1)

    index = torch.zeros(SHAPE, dtype=torch.int32)
    index.view(-1)[order] = torch.arange(len(order), dtype=torch.int32)
    at = torch.rand(200, 3, generator=generator, dtype=torch.float64) * (torch.tensor(SHAPE) - 1)
    corners = places[[0, -1]].double()
    for asked in (at, corners):
        torch.testing.assert_close(interpolated(index, values(places[order]), asked), values(asked))
        volumes = values(places).view(*SHAPE, 2).unbind(-1)
        torch.testing.assert_close(torch.stack(between(volumes, asked.t()), dim=-1), values(asked))


def test_densities_survive_their_scale():
    densities = torch.logspace(-4, 4, 50)
    torch.testing.assert_close(densities_from_u(u_from_densities(densities)), densities, rtol=2e-5, atol=2e-5)
    assert float(u_from_densities(torch.zeros(()))) == EMPTY_U


def test_polynomials_are_orthonormal_on_the_directions_asked():
    directions = sampled_directions()
    torch.testing.assert_close(directions.norm(dim=-1), torch.ones(12, dtype=torch.float64))
    product = polynomials(directions).T @ polynomials(directions) / 12
    torch.testing.assert_close(product, torch.eye(9, dtype=torch.float64))


def test_what_is_quadratic_in_the_direction_is_kept():
    generator = torch.Generator().manual_seed(0)
    matrices = torch.rand(4, 3, 3, generator=generator, dtype=torch.float64)  # C = 4

    def values(along: torch.Tensor) -> torch.Tensor:
        return torch.einsum("kx,cxy,ky->kc", along, matrices, along) + along[:, :1]

    coefficients = (projection(matrices) @ values(sampled_directions())).reshape(1, -1)  # (1, B * C)
    along = torch.nn.functional.normalize(  # noqa: TID251
        torch.randn(20, 3, generator=generator, dtype=torch.float64), dim=-1
    )
    found = combined(coefficients.expand(20, -1), polynomials(along))
    torch.testing.assert_close(found, values(along))


def test_of_what_a_network_bends_no_more_is_missed_than_expected():
    """Rectified linear functions of the direction: errors over the sphere against those at the directions that were fitted."""
    generator = torch.Generator().manual_seed(0)
    slopes = torch.randn(3, 500, generator=generator, dtype=torch.float64)
    starts = 0.5 * torch.randn(500, generator=generator, dtype=torch.float64)
    along = torch.randn(300, 3, generator=generator, dtype=torch.float64)
    along = along / along.norm(dim=-1, keepdim=True)
    sampled = sampled_directions()
    coefficients = projection(slopes) @ (sampled @ slopes + starts).relu()
    missed, left = ((of @ slopes + starts).relu() - polynomials(of) @ coefficients for of in (along, sampled))
    of_square = missed.square().mean()
    assert 1.0 < float(expected_error(left).square().mean() / of_square) < 2.0
    assert float(left.square().mean() / of_square) < 0.5  # what least squares leave says too little


def test_gaps_are_cells_to_the_next_that_holds_something():
    holding = torch.zeros(9, 8, 7, dtype=torch.bool)
    holding[2, 3, 4] = holding[8, 0, 0] = True
    cells = torch.ones_like(holding).nonzero()
    expected = (cells[:, None] - holding.nonzero()[None]).abs().amax(-1).amin(-1).view(holding.shape)
    assert torch.equal(gaps(holding).long(), expected)
    assert bool((gaps(torch.zeros_like(holding)) == 255).all())


def test_points_of_cells():
    cells = torch.zeros(2, 2, 2, dtype=torch.bool)
    cells[0, 1, 1] = True
    assert corners_of(cells).nonzero().tolist() == [[x, y, z] for x in (0, 1) for y in (1, 2) for z in (1, 2)]
    assert int(finer_points(cells, 3).sum()) == 4**3


def test_no_straight_ray_is_darker_than_the_bound():
    """Along rays from outside to any point the optical depth is at least the bound there; deep inside it is dark."""
    generator = torch.Generator().manual_seed(0)
    side, pitch = 17, 0.05
    densities = 20.0 + 10.0 * torch.rand(side, side, side, generator=generator)
    bound = light_depths(densities, pitch)
    assert float(bound.amax()) > 3.0
    numbers = torch.arange(side**3, dtype=torch.int32).view(densities.shape)
    directions = sampled_directions().float()
    for point in torch.randint(2, side - 2, (30, 3), generator=generator):
        for along in directions:
            steps = torch.arange(0.0, 2.0 * side, 0.1)
            at = point - steps[:, None] * along
            inside = ((at >= 0) & (at <= side - 1)).all(-1)
            met = interpolated(numbers, densities.reshape(-1, 1), at[inside])[:, 0]
            assert float(met.sum()) * 0.1 * pitch >= float(bound[tuple(point)]) - 1e-4


def test_a_lattice_goes_through_the_centres_of_pixels():
    cameras = helpers.source_cameras((0.0, 90.0, 180.0), size=16)
    found = pixel_lattice(cameras)
    assert found is not None
    through, pitch = found
    points = through + pitch * torch.tensor([[0, 0, 0], [3, 5, -2]])
    pixels = project_into_all(cameras, points.float())[0]
    torch.testing.assert_close(pixels - 0.5, (pixels - 0.5).round(), atol=1e-3, rtol=0)
    assert pitch == pytest.approx(1.0 / float(cameras.focal[0, 0]))
    assert math.isfinite(float(through.sum()))


def test_curved_values_are_right_in_the_mean_between_points():
    """Along each axis, of a parabola: bent at the lattice's points nothing moves; beside nothing neither."""
    shape = (5, 5, 5)
    places = torch.ones(shape).nonzero()
    index = torch.arange(125, dtype=torch.int32).view(shape)
    for axis in range(3):
        along = places[:, axis].double()
        moved = _without_bias(-0.5 * along**2, index, places, 2)
        fine = torch.linspace(0.0, 4.0, 4001, dtype=torch.float64)
        at = torch.full((4001, 3), 1.0, dtype=torch.float64)
        at[:, axis] = fine
        error = interpolated(index, moved[:, None], at)[:, 0] + 0.5 * fine**2
        assert abs(float(error.mean())) < 1e-3
        bent = -(along - 2.0).abs()
        torch.testing.assert_close(_without_bias(bent, index, places, 2), bent)
        jump = torch.where(along > 2, 1.0, EMPTY_U).double()
        torch.testing.assert_close(_without_bias(jump, index, places, 2), jump)


def test_the_expected_error_is_that_of_straight_lines_through_a_curve():
    """Of u = x^2 lines between points one apart are an eighth of its second derivative off, halfway; of straight u nothing is."""
    x = torch.arange(6, dtype=torch.float64)[:, None, None].expand(6, 5, 4) - 2.0
    all_of_it = torch.ones_like(x)
    found = _expected_errors(x.square(), all_of_it)[1:-1]
    between = densities_from_u(x.square() + 0.25) - densities_from_u(x.square())
    torch.testing.assert_close(found, between[1:-1], rtol=0.1, atol=0)
    assert bool((_expected_errors(3.0 * x, all_of_it) == 0.0).all())
    torch.testing.assert_close(_expected_errors(x.square(), 0.5 * all_of_it)[1:-1], 0.5 * found)
