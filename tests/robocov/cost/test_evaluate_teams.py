"""The coverage cost of several teams at once."""

from __future__ import annotations

import numpy as np
import pytest
from cost_cases import OFFICE

from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, WallObstacle
from robocov.errors import InputError

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
WALL_FROM_SIDE_TO_SIDE = WallObstacle(((4.0, -1.0), (4.0, 9.0)), 0.2)
TWO_ROOMS = Environment("two rooms", SQUARE, (WALL_FROM_SIDE_TO_SIDE,))
DENSITY = Gaussians((Gaussian((2.0, 2.0), 5.0, sigma=1.0),), 0.2)


def assert_results_are_equal(result, expected):
    assert result.mean_distance == expected.mean_distance
    assert result.value == expected.value
    assert result.uncovered_area == expected.uncovered_area
    for name in ("positions", "distances", "owners", "first_corners", "last_corners", "gradient"):
        np.testing.assert_array_equal(getattr(result, name), getattr(expected, name))


@pytest.mark.parametrize("environment", [OFFICE, OFFICE.with_density(DENSITY)], ids=["plain", "density"])
@pytest.mark.parametrize("robots", [1, 5])
def test_results_are_those_of_separate_calls(environment, robots):
    cost = CoverageCost(environment, 24)
    rng = np.random.default_rng(robots)
    teams = cost.points[rng.choice(len(cost.points), (4, robots))]
    results = cost.evaluate_teams(teams)
    assert len(results) == len(teams)
    assert len({result.mean_distance for result in results}) == len(teams)
    for result, team in zip(results, teams, strict=True):
        assert_results_are_equal(result, cost(team))


def test_teams_may_cover_different_components():
    cost = CoverageCost(TWO_ROOMS, 16)
    teams = np.array([[[1.0, 1.0], [2.0, 7.0]], [[7.0, 1.0], [6.0, 6.0]], [[1.0, 1.0], [7.0, 7.0]]])
    results = cost.evaluate_teams(teams)
    room_area = 3.9 * 8.0
    assert [result.uncovered_area for result in results] == pytest.approx([room_area, room_area, 0.0])
    for result, team in zip(results, teams, strict=True):
        assert_results_are_equal(result, cost(team))


def test_an_empty_array_of_teams_has_no_results():
    assert CoverageCost(TWO_ROOMS, 8).evaluate_teams(np.empty((0, 3, 2))) == []


@pytest.mark.parametrize("positions", [[[1.0, 1.0]], np.empty((2, 0, 2)), np.zeros((2, 3, 3))])
def test_an_array_of_another_shape_is_rejected(positions):
    with pytest.raises(InputError, match=r"positions: expected an array of shape \(r, n, 2\)"):
        CoverageCost(TWO_ROOMS, 8).evaluate_teams(positions)


def test_errors_name_a_robot_inside_an_obstacle():
    with pytest.raises(InputError, match=r"positions\[3\]: .* outside the free space"):
        CoverageCost(TWO_ROOMS, 8).evaluate_teams([[[1.0, 1.0], [2.0, 2.0]], [[7.0, 7.0], [4.0, 4.0]]])
