"""Errata of the paper: equation (28), equation (18), and the statement after (14)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from voronoi_cases import PENTAGON, REGIONS, names, seeds

from robocov.environment import Environment
from robocov.locational_cost import Sensing, compute_gradients
from robocov.locational_cost.best_points import find_best_points
from robocov.team import Team
from robocov.voronoi import partition
from robocov.world import World
from robocov.world.obstacle_pieces import build_obstacles

# Equation (28): F = m q'' - ν q'


def test_the_printed_sign_of_equation_28_would_accelerate_robots(empty: Environment) -> None:
    """A robot without forces must lose energy, but m q'' = ν q' increases its speed."""
    m = 2.0
    nu = 1.5
    v0 = 0.4
    duration = 1.0
    world = World(
        build_obstacles(empty),
        Team.homogeneous(1, mass=m, viscosity=nu),
        np.array([[2.0, 5.0]]),
        np.array([[v0, 0.0]]),
    )
    for _ in range(60):
        world.step(np.zeros((1, 2)), duration / 60)
    final_speeds = []
    for sign in (-1.0, 1.0):
        rate = sign * nu / m
        solution = solve_ivp(lambda _, v, rate=rate: rate * v, (0.0, duration), [v0], rtol=1e-11, atol=0.0)
        final_speeds.append(solution.y[0, -1])
    decelerated, accelerated = final_speeds
    assert world.velocities[0, 0] == pytest.approx(decelerated, rel=1e-8)
    assert decelerated < 0.5 * v0
    assert accelerated > 2.0 * v0


# Equation (18): the sign of the second integral


def compute_edge_integrals(
    a: tuple[float, float], b: tuple[float, float], p: tuple[float, float], h: float
) -> tuple[float, float]:
    """Return the two integrals of (18) for an edge, in the closed form of (17), (19) and (20)."""
    x, y = a
    u, v = b
    px, py = p
    if x == u:
        return 0.0, 0.0

    m = (v - y) / (u - x)
    q = (y * u - x * v) / (u - x)
    quadratic = 1.0 + m * m
    linear = px + m * py - m * q
    constant = px**2 + (py - q) ** 2 + h * h
    assert quadratic * constant - linear**2 == pytest.approx(
        (m * px - py + q) ** 2 + h * h * quadratic, rel=1e-6, abs=1e-9 * quadratic * constant
    )
    first = integrate_reciprocal(u, quadratic, linear, constant)
    first -= integrate_reciprocal(x, quadratic, linear, constant)
    second = integrate_reciprocal(u - px, 1.0, 0.0, py * py + h * h)
    second -= integrate_reciprocal(x - px, 1.0, 0.0, py * py + h * h)
    return first, second


def integrate_reciprocal(x: float, a: float, b: float, c: float) -> float:
    """Return an antiderivative of 1 / (a x² - 2 b x + c)."""
    root = np.sqrt(a * c - b * b)
    return float(np.arctan((a * x - b) / root) / root)


def list_edges(ring: np.ndarray) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the start and the end of each edge of a ring."""
    starts = [(x, y) for x, y in ring.tolist()]
    return list(zip(starts, [*starts[1:], starts[0]], strict=True))


def test_the_second_integral_of_equation_18_has_the_other_sign() -> None:
    """The double integral of (15) over each edge is the difference of the two integrals, not their sum."""
    px = 1.7
    py = 1.2
    h = 0.9
    errors_of_sum = []
    for a, b in list_edges(PENTAGON.vertices):
        first, second = compute_edge_integrals(a, b, (px, py), h)
        m = (b[1] - a[1]) / (b[0] - a[0])

        def integrate_over_y(x: float, m: float = m, a: tuple[float, float] = a) -> float:
            return float(
                quad(
                    lambda y: 2.0 * (y - py) / ((x - px) ** 2 + (y - py) ** 2 + h * h) ** 2,
                    0.0,
                    a[1] + m * (x - a[0]),
                )[0]
            )

        expected = quad(integrate_over_y, b[0], a[0])[0]
        assert first - second == pytest.approx(expected, rel=1e-7, abs=1e-9)
        errors_of_sum.append(abs(first + second - expected))
    assert max(errors_of_sum) > 0.1


@given(seeds, names, st.floats(0.05, 20.0))
def test_the_sign_does_not_change_the_gradient_of_a_cell(seed: int, name: str, h: float) -> None:
    """Around a cell the second integrals add up to zero, and the first ones to the gradient."""
    region = REGIONS[name]
    ring = region.vertices - region.centroid
    p = np.random.default_rng(seed).normal(scale=1.5, size=2)
    integrals = [compute_edge_integrals(a, b, (p[0], p[1]), h) for a, b in list_edges(ring)]
    first, second = np.sum(integrals, axis=0)
    cells = partition(region.centroid[None], region)
    noise = 1e-9 / h
    assert second == pytest.approx(0.0, abs=noise)
    assert compute_gradients(cells.edges, p[None], Sensing(h))[0, 1] == pytest.approx(
        first, rel=1e-7, abs=noise
    )


# After equation (14): the optimum does not depend on h


@pytest.mark.parametrize(
    ("h", "optimum"),
    [(0.01, (2.0912, 1.6745)), (1.0, (2.0849, 1.6650)), (20.0, (2.0542, 1.6190)), (1e6, (2.0538, 1.6183))],
)
def test_the_optimum_depends_on_the_height(h: float, optimum: tuple[float, float]) -> None:
    """The optima are from an independent evaluation of (21) for a pentagon without symmetry."""
    cells = partition(PENTAGON.centroid[None], PENTAGON)
    assert find_best_points(cells, Sensing(h))[0] == pytest.approx(optimum, abs=6e-5)


def test_the_optimum_moves_from_the_maximum_mean_logarithm_to_the_centroid() -> None:
    """As h → 0 it maximizes the mean logarithm of the distance to the boundary over all directions."""
    cells = partition(PENTAGON.centroid[None], PENTAGON)

    def compute_mean_logarithm(p: np.ndarray) -> float:
        angles = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
        directions = np.array([np.cos(angles), np.sin(angles)])
        side_distances = PENTAGON.offsets - PENTAGON.normals @ p
        approach = PENTAGON.normals @ directions
        with np.errstate(divide="ignore"):
            ray_lengths = np.where(approach > 0.0, side_distances[:, None] / approach, np.inf)
        return float(np.log(ray_lengths.min(axis=0)).mean())

    low = find_best_points(cells, Sensing(1e-9))[0]
    for shift in 0.02 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [0.7, 0.7], [-0.7, -0.7], [0.7, -0.7]]):
        assert compute_mean_logarithm(low + shift) < compute_mean_logarithm(low)
    distances = [
        np.hypot(*(find_best_points(cells, Sensing(h))[0] - PENTAGON.centroid))
        for h in (1e-9, 0.3, 3.0, 30.0, 3e3)
    ]
    assert distances == sorted(distances, reverse=True)
    assert distances[0] > 0.06
    assert distances[-1] < 1e-6


@pytest.mark.parametrize("sides", [3, 4, 7])
def test_the_optimum_of_a_regular_cell_does_not_depend_on_the_height(sides: int) -> None:
    turn = 2.0 * np.pi * np.arange(sides) / sides
    region = type(PENTAGON)(np.column_stack([np.cos(turn), np.sin(turn)]))
    for h in (1e-3, 0.5, 10.0):
        cells = partition(np.array([[0.2, 0.1]]), region)
        assert find_best_points(cells, Sensing(h))[0] == pytest.approx([0.0, 0.0], abs=1e-9)
