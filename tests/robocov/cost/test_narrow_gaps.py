"""Gaps that are narrower than a robot, in the coverage cost, the optimum and the lower bound."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.density import Uniform
from robocov.environment import Environment, WallObstacle
from robocov.environment.obstacle_paths import ObstaclePath
from robocov.errors import ParameterError
from robocov.lower_bound import compute_lower_bound
from robocov.optimum import find_optimum
from robocov.typing import FloatArray

HALL = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
CRACKED = Environment("cracked", HALL, (WallObstacle(((7.0, 0.1), (7.0, 6.0)), width=0.2),))
"""A crack of 0.1 m leads from a room of 6.9 by 6 m to one of 2.9 by 6 m."""
SEALED = Environment("sealed", HALL, (WallObstacle(((7.0, 0.0), (7.0, 6.0)), width=0.2),))
SMALL_ROOM_M2 = 2.9 * 6.0
"""Area of the small room. The inside of the crack, 0.02 m², may belong to either room."""
ROBOT = np.array([[3.0, 3.0]])


def test_area_behind_a_crack_is_uncovered() -> None:
    result = CoverageCost(CRACKED, 32)(ROBOT)
    assert result.uncovered_area == pytest.approx(SMALL_ROOM_M2, abs=0.03)
    assert (result.owners[result.points[:, 0] > 7.1] == -1).all()
    assert result.environment is CRACKED
    assert result.mean_distance == pytest.approx(CoverageCost(SEALED, 32)(ROBOT).mean_distance)


@pytest.mark.parametrize("radius", [0.0, 0.04])
def test_smaller_robots_cover_it(radius: float) -> None:
    result = CoverageCost(CRACKED, 32, radius=radius)(ROBOT)
    assert result.uncovered_area == 0.0
    assert (result.owners == 0).all()


def test_density_keeps_the_gaps_closed() -> None:
    weighted = CoverageCost(CRACKED, 32).with_density(CRACKED.with_density(Uniform(2.0)))
    result = weighted(ROBOT)
    plain = CoverageCost(CRACKED, 32)(ROBOT)
    assert result.uncovered_area == plain.uncovered_area
    assert result.value == pytest.approx(2.0 * plain.value)


@pytest.mark.parametrize("position", [[7.0, 0.05], [6.9, 0.05], [6.9, 0.0], [6.9, 0.1], [6.9000015, 0.05]])
def test_robot_at_a_closed_gap_covers_a_side(position: list[float]) -> None:
    result = CoverageCost(CRACKED, 32)(np.array([position]))
    assert np.isfinite(result.mean_distance)


@pytest.mark.parametrize("position", [[6.9, 0.05], [6.9000015, 0.05], [7.1, 0.05]])
def test_a_point_at_a_closed_gap_may_have_a_path(position: list[float]) -> None:
    path = CoverageCost(CRACKED, 32).find_path(ROBOT, np.array(position))
    assert path.shape[1] == 2


def test_optimum_covers_the_largest_rooms() -> None:
    single = find_optimum(CRACKED, 1, lattice=32, restarts=2)
    assert single.uncovered_area == pytest.approx(SMALL_ROOM_M2, abs=0.03)
    assert single.positions[0] == pytest.approx([3.45, 3.0], abs=0.05)
    pair = find_optimum(CRACKED, 2, lattice=32, restarts=2)
    assert pair.uncovered_area == 0.0
    assert pair.positions[1] == pytest.approx([8.55, 3.0], abs=0.05)
    small = find_optimum(CRACKED, 1, radius=0.04, lattice=32, restarts=2)
    assert small.uncovered_area == 0.0


def test_lower_bound_is_that_of_the_sealed_room() -> None:
    position = [[3.45, 3.0]]
    bound = compute_lower_bound(CRACKED, position, lattice=16, precision=0.01)
    sealed_bound = compute_lower_bound(SEALED, position, lattice=16, precision=0.01)
    assert bound.mean_distance == pytest.approx(sealed_bound.mean_distance, rel=0.01)
    assert bound.mean_distance <= CoverageCost(CRACKED, 16)(position).mean_distance


def test_lower_bound_counts_positions_in_the_mouth_of_a_crack() -> None:
    # A robot of radius 0.1 m fits between the walls of the mouth, but not through its end.
    mouth = Environment("mouth", HALL, (WallObstacle(((7.0, 0.19), (7.0, 6.0)), width=0.2),))
    position = [[6.9, 0.0999]]
    bound = compute_lower_bound(mouth, position, lattice=16, precision=0.01)
    placement = CoverageCost(mouth, 16)(position)
    assert bound.mean_distance <= placement.mean_distance


def test_gaps_follow_moving_obstacles() -> None:
    path = ObstaclePath(((0.0, 0.0), (0.0, 2.0)), speed=1.0)
    moving = Environment("moving", HALL, (WallObstacle(((7.0, 0.1), (7.0, 6.0)), width=0.2, path=path),))
    cost = TimeVaryingCost(CoverageCost(moving, 32))

    def compute_uncovered_area(time: float) -> float:
        return cost.compute_summary(time, ROBOT).uncovered_area

    assert compute_uncovered_area(0.0) == pytest.approx(SMALL_ROOM_M2, abs=0.03)
    assert compute_uncovered_area(1.0) == 0.0


@pytest.mark.parametrize("radius", [-0.1, np.inf, None])
def test_an_invalid_radius_is_rejected(radius: object) -> None:
    with pytest.raises(ParameterError, match="radius"):
        CoverageCost(CRACKED, 32, radius=radius)  # type: ignore[arg-type]


def test_teams_are_evaluated_like_single_ones() -> None:
    cost = CoverageCost(CRACKED, 16)
    teams: FloatArray = np.array([[[3.0, 3.0]], [[8.0, 3.0]]])
    areas = [result.uncovered_area for result in cost.evaluate_teams(teams)]
    assert areas == [cost(team).uncovered_area for team in teams]
    assert areas == pytest.approx([SMALL_ROOM_M2, 6.9 * 6.0], abs=0.03)
