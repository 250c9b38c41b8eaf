"""Starts: random and given positions, tight starts, and starts without space."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import (
    DiscStart,
    Environment,
    PointsStart,
    Start,
    UniformStart,
    compute_start_clearance,
)
from robocov.errors import StartError

SQUARE = shapely.box(0, 0, 10, 10)


@settings(max_examples=count_examples(40))
@given(
    n=st.integers(1, 60),
    seed=st.integers(0, 2**32),
    radius=st.floats(0.02, 0.3),
    name=st.sampled_from(["corner", "uniform"]),
)
def test_robots_start_clear_of_walls_and_of_each_other(
    cluttered: Environment, n: int, seed: int, radius: float, name: str
) -> None:
    try:
        points = cluttered.start(name).sample(n, seed, radius)
    except StartError as error:
        assert f"but {n} were requested" in str(error)
        # Requests are rejected only if there is little space.
        assert np.pi * radius**2 * n > 0.5 * np.pi * 0.8**2
        return
    assert points.shape == (n, 2)
    shape = shapely.points(points)
    assert shapely.contains(cluttered.free, shape).all()
    assert shapely.distance(cluttered.free.boundary, shape).min() >= radius
    distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) + 99 * np.eye(n)
    assert n == 1 or distances.min() >= 2 * radius
    if name == "corner":
        assert np.hypot(*(points - [1.0, 1.0]).T).max() <= 0.8 + 1e-9


def test_the_same_seed_gives_the_same_positions(cluttered: Environment) -> None:
    start = cluttered.start("uniform")
    np.testing.assert_array_equal(start.sample(6, 3), start.sample(6, 3))
    assert not np.array_equal(start.sample(6, 3), start.sample(6, 4))


def test_a_seed_gives_the_positions_of_earlier_versions() -> None:
    """Saved studies contain starts and seeds, so positions must not change."""
    start = Start("wide", DiscStart((2.5, 2.5), 1.0), SQUARE)
    expected = [[1.9774691843, 2.9420289396], [3.157775734, 2.2890007007], [2.7120956862, 1.5850145627]]
    np.testing.assert_allclose(start.sample(24, 5)[[0, 11, 23]], expected, atol=1e-9)
    assert not np.array_equal(start.sample(2, 5), start.sample(3, 5)[:2])


def test_a_tight_start_is_filled_by_a_lattice() -> None:
    """75 discs of radius 0.1 m fill 75% of a disc of radius 1 m. Random darts cannot place so many."""
    start = Start("tight", DiscStart((5.0, 5.0), 0.9), SQUARE)
    points = start.sample(62, seed=0)
    distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) + 99 * np.eye(62)
    assert distances.min() >= 0.2
    with pytest.raises(
        StartError, match=r"start 'tight': space for about \d+ robots of radius 0.1 m, but 200 were requested"
    ):
        start.sample(200, seed=0)


def test_uniform_starts_cover_the_free_space(cluttered: Environment) -> None:
    points = np.concatenate([cluttered.start("uniform").sample(40, seed) for seed in range(20)])
    quarter = shapely.box(5, 5, 10, 10)
    fraction = shapely.contains_xy(quarter, points[:, 0], points[:, 1]).mean()
    expected = cluttered.free.intersection(quarter).area / cluttered.free_area
    assert fraction == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize(
    ("positions", "n", "message"),
    [
        (((1.0, 1.0),), 2, "expected at most 1 robot, one for each of its positions, got 2"),
        (((1.0, 1.0), (1.1, 1.0)), 2, r"positions\[0\] and positions\[1\] are 0.1 m apart"),
        (((0.05, 1.0),), 1, r"positions\[0\] = \[0.05, 1\] is 0.05 m from a wall"),
        (((385123.25, 1.0),), 1, r"\[385123.25, 1\] is inside an obstacle or outside the boundary"),
    ],
)
def test_given_positions_are_checked(positions, n: int, message: str) -> None:
    with pytest.raises(StartError, match=message):
        Start("given", PointsStart(positions), SQUARE).sample(n)


def test_given_positions_may_touch_walls_and_each_other() -> None:
    start = Start("given", PointsStart(((0.25, 1.0), (0.75, 1.0))), SQUARE)
    assert len(start.sample(2, radius=0.25)) == 2


def test_given_positions_are_used_in_order() -> None:
    start = Start("given", PointsStart(((1.0, 1.0), (2.0, 1.0), (3.0, 1.0))), SQUARE)
    np.testing.assert_array_equal(start.sample(2, seed=9), [[1.0, 1.0], [2.0, 1.0]])


def test_a_start_without_space_is_reported() -> None:
    with pytest.raises(StartError, match=r"start 'slit': no space for a robot of radius 0.1 m"):
        Start("slit", DiscStart((5.0, 5.0), 0.5), shapely.box(0, 4.95, 10, 5.05)).sample(1)


def test_suggestions_suit_the_start() -> None:
    closet = shapely.box(0.0, 0.0, 0.3, 0.3)
    with pytest.raises(StartError, match=r"0\.2 m\. Try a wider start\.$"):
        Start("slit", DiscStart((0.1, 0.1), 0.1), closet).sample(1, radius=0.2)
    with pytest.raises(StartError, match=r"0\.2 m\. Try a smaller robot or another map\.$"):
        Start("uniform", UniformStart(), closet).sample(1, radius=0.2)
    with pytest.raises(StartError, match=r"space for about 1 robot of radius 0\.1 m, but 2 were requested"):
        Start("uniform", UniformStart(), closet).sample(2)


@pytest.mark.parametrize("radius", ["a", None, True, 0.0, 1e-200, np.nan, np.inf])
def test_invalid_radii_are_rejected(radius: Any) -> None:
    start = Start("all", UniformStart(), SQUARE)
    message = r"start 'all': radius: expected a number from 0\.001 to 1000 m, got "
    with pytest.raises(StartError, match=message):
        start.sample(2, radius=radius)
    with pytest.raises(StartError, match=message):
        start.estimate_capacity(radius)


def test_a_disc_that_only_touches_the_space_of_centers_has_no_space() -> None:
    start = Start("rim", DiscStart((0.0, 5.0), compute_start_clearance(0.1)), SQUARE)
    assert start.estimate_capacity(0.1) == 0
    with pytest.raises(StartError, match=r"start 'rim': no space for a robot of radius 0.1 m"):
        start.sample(1, radius=0.1)


@pytest.mark.parametrize("disc", [DiscStart((5.0, 5.0), 0.9), DiscStart((0.0, 0.0), 1.5)])
def test_the_capacity_of_a_start_does_not_depend_on_the_request(disc: DiscStart) -> None:
    start = Start("tight", disc, SQUARE)
    capacity = start.estimate_capacity(0.1)
    assert Start("tight", disc, SQUARE).estimate_capacity(0.1) == capacity
    messages = set()
    for n, seed in ((capacity + 10, 0), (capacity + 10, 1), (2 * capacity, 0), (5000, 3)):
        with pytest.raises(StartError, match=f"space for about {capacity} robots") as caught:
            start.sample(n, seed, 0.1)
        messages.add(str(caught.value).replace(f"but {n} were", ""))
    assert len(messages) == 1
    assert "Try fewer or smaller robots, start 'uniform' (space for about" in messages.pop()
    for seed in range(4):
        assert start.sample(capacity, seed, 0.1).shape == (capacity, 2)


def test_the_capacity_of_a_narrow_passage_is_that_of_random_darts() -> None:
    """Lattices hold fewer robots here."""
    start = Start("slit", DiscStart((5.0, 5.0), 4.0), shapely.box(0, 4.85, 10, 5.15))
    capacity = start.estimate_capacity(0.1)
    assert capacity >= 20
    assert len(start.sample(capacity, seed=7)) == capacity


def test_a_uniform_start_does_not_suggest_itself() -> None:
    with pytest.raises(StartError, match=r"Try fewer or smaller robots or another map\.$"):
        Start("uniform", UniformStart(), shapely.box(0, 0, 1, 1)).sample(500)
