"""What robots head for."""

from __future__ import annotations

import numpy as np
import pytest
from voronoi_cases import PENTAGON, scatter_points

from robocov.controllers import Lloyd, Rapf, make_controller
from robocov.cost import CoverageCost
from robocov.density import Uniform
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.locational_cost import Distance, Sensing, compute_locational_costs
from robocov.locational_cost.best_points import TARGETS, find_best_points, find_targets
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import partition

POINTS = scatter_points(PENTAGON, 9, np.random.default_rng(2))


def test_each_word_is_an_optimum() -> None:
    cells = partition(POINTS, PENTAGON)
    assert find_targets(cells, None, "centroid", 1.0) is cells.centroid
    np.testing.assert_array_equal(
        find_targets(cells, None, "median", 1.0), find_best_points(cells, Distance())
    )
    np.testing.assert_array_equal(
        find_targets(cells, None, "sensing", 0.4), find_best_points(cells, Sensing(0.4))
    )
    found = [find_targets(cells, None, word, 0.4) for word in TARGETS]
    assert min(np.abs(found[0] - found[1]).max(), np.abs(found[1] - found[2]).max()) > 1e-3


def test_a_density_that_is_the_same_everywhere_changes_nothing() -> None:
    for density in (Uniform(1.0), Uniform(3.0)):
        cells = partition(POINTS, PENTAGON, density=density)
        for word in TARGETS:
            np.testing.assert_allclose(
                find_targets(cells, density, word, 0.4),
                find_targets(partition(POINTS, PENTAGON), None, word, 0.4),
                atol=1e-9,
            )


def test_unknown_targets_are_rejected() -> None:
    cells = partition(POINTS, PENTAGON)
    with pytest.raises(ParameterError, match="unknown target 'mediane': did you mean 'median'"):
        find_targets(cells, None, "mediane", 1.0)
    with pytest.raises(ParameterError, match=r"height: expected a number above 0, got 0\.0 m"):
        find_targets(cells, None, "sensing", 0.0)


@pytest.mark.parametrize("law", ["rapf", "lloyd"])
@pytest.mark.parametrize("target", TARGETS)
def test_laws_head_for_their_target(law: str, target: str) -> None:
    n = len(POINTS)
    seen = Observations(POINTS, np.zeros((n, 2)), Neighbors(n), np.full((n, 2), np.nan), PENTAGON)
    controller = make_controller(law, {"target": target, "height": 0.7})
    decision = controller.decide(seen, controller.begin(PENTAGON, Team.homogeneous(n)))
    expected = find_targets(partition(POINTS, PENTAGON), None, target, 0.7)
    assert decision.goals is not None
    np.testing.assert_allclose(decision.goals, expected, atol=1e-12)
    pull = decision.terms["attraction"]
    along = expected - POINTS
    np.testing.assert_allclose(pull[:, 0] * along[:, 1], pull[:, 1] * along[:, 0], atol=1e-9)


def test_at_rest_a_team_is_where_its_targets_are(empty: Environment) -> None:
    """In a convex region; and the three partitions are three."""
    starts = scatter_points(Region(np.array(empty.boundary)), 5, np.random.default_rng(4))
    ends = []
    for target in TARGETS:
        controller = make_controller("lloyd", {"target": target, "height": 0.5})
        last = Simulation(empty, controller, starts=starts, dt=1 / 30).run(12.0).positions[-1]
        assert np.abs(last - find_targets(partition(last, empty.region), None, target, 0.5)).max() < 0.1
        ends.append(last)
    assert np.abs(ends[0] - ends[2]).max() > 1e-3
    assert np.abs(ends[0] - ends[1]).max() > 1e-3


def test_a_sensor_sees_more_from_its_own_target_and_without_walls_the_cost_is_the_same() -> None:
    box = Environment("box", ((0, 0), (12, 0), (12, 7), (0, 7)))
    starts = np.random.default_rng(0).uniform([0.5, 0.5], [11.5, 6.5], (5, 2))
    height, seen, costs = 0.5, [], []
    for target in ("centroid", "sensing"):
        law = Lloyd(target=target, height=height)
        last = Simulation(box, law, starts=starts, dt=1 / 30).run(20.0).positions[-1]
        cells = partition(last, box.region)
        seen.append(compute_locational_costs(cells.edges, np.zeros((5, 2)), Sensing(height)).sum())
        costs.append(CoverageCost(box, 48)(last).mean_distance)
    assert 1.0002 < seen[1] / seen[0] < 1.01
    assert costs[1] / costs[0] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("held", ["centroid", "sensing"])
def test_a_wall_holds_a_robot_whose_goal_has_its_foot_on_it(held: str) -> None:
    """The targets are 1 m apart behind a wall that ends between them; either may be the one that is held."""
    corners = ((0.0, 0.0), (12.0, 0.0), (0.0, 6.0))
    whole = partition(np.array([[3.5, 0.5]]), Region(np.array(corners)))
    goals = {word: find_targets(whole, None, word, 1.0)[0] for word in ("centroid", "sensing")}
    end = 3.5
    assert goals["sensing"][0] + 0.4 < end < goals["centroid"][0] - 0.4
    wall = WallObstacle(((end, 1.2), (8.0 if held == "centroid" else 0.8, 1.2)), 0.1)
    room = Environment("room", corners, (wall,))
    for word, goal in goals.items():
        last = Simulation(room, Rapf(target=word), [[end, 0.5]], dt=1 / 30).run(30.0).positions[-1][0]
        if word == held:
            assert last[1] < 1.0 and last[0] == pytest.approx(goal[0], abs=0.05)
        else:
            assert last[1] > 1.5 and np.hypot(*(last - goal)) < 0.4
