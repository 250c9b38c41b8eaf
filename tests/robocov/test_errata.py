"""What the paper prints and does not mean: equation (28), equation (18), and what it says after (14)."""

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

# (28): F = m q'' - ν q'


def test_with_the_printed_sign_of_28_robots_would_fly_apart(empty: Environment) -> None:
    """Left alone, a robot must lose its energy; m q'' = ν q' makes it grow without bound."""
    m, nu, v0, seconds = 2.0, 1.5, 0.4, 1.0
    world = World(
        build_obstacles(empty),
        Team.homogeneous(1, mass=m, viscosity=nu),
        np.array([[2.0, 5.0]]),
        np.array([[v0, 0.0]]),
    )
    for _ in range(60):
        world.step(np.zeros((1, 2)), seconds / 60)
    ends = []
    for sign in (-1.0, 1.0):
        rate = sign * nu / m
        solved = solve_ivp(lambda _, v, rate=rate: rate * v, (0.0, seconds), [v0], rtol=1e-11, atol=0.0)
        ends.append(solved.y[0, -1])
    assert world.velocities[0, 0] == pytest.approx(ends[0], rel=1e-8)
    assert ends[0] < 0.5 * v0 < 2.0 * v0 < ends[1]


# (18): the sign of the second integral


def edge(
    a: tuple[float, float], b: tuple[float, float], p: tuple[float, float], h: float
) -> tuple[float, float]:
    """Return the two integrals of (18) for an edge, in the closed form of (17), (19) and (20)."""
    (x, y), (u, v), (px, py) = a, b, p
    if x == u:
        return 0.0, 0.0

    def arctan(x: float, a: float, b: float, c: float) -> float:
        root = np.sqrt(a * c - b * b)
        return float(np.arctan((a * x - b) / root) / root)

    m, q = (v - y) / (u - x), (y * u - x * v) / (u - x)
    one = 1.0 + m * m, px + m * py - m * q, px**2 + (py - q) ** 2 + h * h
    assert one[0] * one[2] - one[1] ** 2 == pytest.approx(
        (m * px - py + q) ** 2 + h * h * (1.0 + m * m), rel=1e-6, abs=1e-9 * one[0] * one[2]
    )
    other = 1.0, 0.0, py * py + h * h
    return arctan(u, *one) - arctan(x, *one), arctan(u - px, *other) - arctan(x - px, *other)


def ends(ring: np.ndarray) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return list(zip(map(tuple, ring.tolist()), map(tuple, np.roll(ring, -1, axis=0).tolist()), strict=True))


def test_the_second_integral_of_18_has_the_other_sign() -> None:
    """Edge by edge, the double integral of (15) is their difference, not their sum."""
    (px, py), h = p, h = (1.7, 1.2), 0.9
    missed = []
    for a, b in ends(PENTAGON.vertices):
        first, second = edge(a, b, p, h)
        m = (b[1] - a[1]) / (b[0] - a[0])

        def inner(x: float, m: float = m, a: tuple[float, float] = a) -> float:
            return float(
                quad(
                    lambda y: 2.0 * (y - py) / ((x - px) ** 2 + (y - py) ** 2 + h * h) ** 2,
                    0.0,
                    a[1] + m * (x - a[0]),
                )[0]
            )

        integrated = quad(inner, b[0], a[0])[0]
        assert first - second == pytest.approx(integrated, rel=1e-7, abs=1e-9)
        missed.append(abs(first + second - integrated))
    assert max(missed) > 0.1


@given(seeds, names, st.floats(0.05, 20.0))
def test_which_does_no_harm_and_the_rest_is_ours(seed: int, name: str, h: float) -> None:
    """Round a cell the second integral is nothing, and the first is the gradient without axes."""
    region = REGIONS[name]
    ring = region.vertices - region.centroid
    p = np.random.default_rng(seed).normal(scale=1.5, size=2)
    first, second = np.array([edge(a, b, (p[0], p[1]), h) for a, b in ends(ring)]).sum(axis=0)
    cells = partition(region.centroid[None], region)
    noise = 1e-9 / h
    assert second == pytest.approx(0.0, abs=noise)
    assert compute_gradients(cells.edges, p[None], Sensing(h))[0, 1] == pytest.approx(
        first, rel=1e-7, abs=noise
    )


# after (14): the optimum does not depend on h


@pytest.mark.parametrize(
    ("h", "optimum"),
    [(0.01, (2.0912, 1.6745)), (1.0, (2.0849, 1.6650)), (20.0, (2.0542, 1.6190)), (1e6, (2.0538, 1.6183))],
)
def test_the_optimum_depends_on_the_height(h: float, optimum: tuple[float, float]) -> None:
    """On a pentagon without symmetry, by an evaluation of (21) apart from ours, to four digits."""
    cells = partition(PENTAGON.centroid[None], PENTAGON)
    assert find_best_points(cells, Sensing(h))[0] == pytest.approx(optimum, abs=6e-5)


def test_it_goes_from_the_mean_logarithm_to_the_centroid() -> None:
    """As h → 0 it is where the logarithm of the way to the boundary is longest in the mean."""
    cells = partition(PENTAGON.centroid[None], PENTAGON)

    def mean_logarithm(p: np.ndarray) -> float:
        angles = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
        to = np.cos(angles), np.sin(angles)
        room = PENTAGON.offsets - PENTAGON.normals @ p
        toward = PENTAGON.normals @ np.array(to)
        with np.errstate(divide="ignore"):
            return float(np.log(np.where(toward > 0.0, room[:, None] / toward, np.inf).min(axis=0)).mean())

    low = find_best_points(cells, Sensing(1e-9))[0]
    for shift in 0.02 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [0.7, 0.7], [-0.7, -0.7], [0.7, -0.7]]):
        assert mean_logarithm(low + shift) < mean_logarithm(low)
    away = [
        np.hypot(*(find_best_points(cells, Sensing(h))[0] - PENTAGON.centroid))
        for h in (1e-9, 0.3, 3.0, 30.0, 3e3)
    ]
    assert away == sorted(away, reverse=True)
    assert away[0] > 0.06
    assert away[-1] < 1e-6


@pytest.mark.parametrize("sides", [3, 4, 7])
def test_only_on_a_regular_cell_it_does_not(sides: int) -> None:
    turn = 2.0 * np.pi * np.arange(sides) / sides
    region = type(PENTAGON)(np.column_stack([np.cos(turn), np.sin(turn)]))
    for h in (1e-3, 0.5, 10.0):
        assert find_best_points(partition(np.array([[0.2, 0.1]]), region), Sensing(h))[0] == pytest.approx(
            [0.0, 0.0], abs=1e-9
        )
