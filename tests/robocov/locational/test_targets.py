"""What robots head for."""

from __future__ import annotations

import numpy as np
import pytest
from voronoi_cases import PENTAGON, scattered

from robocov.controllers import make_controller
from robocov.density import Uniform
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.locational import Distance, Sensing
from robocov.locational.best_points import best_points
from robocov.locational.targets import TARGETS, targets
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.robots import Team
from robocov.simulation import Simulation
from robocov.voronoi import partition

POINTS = scattered(PENTAGON, 9, np.random.default_rng(2))


def test_each_word_is_an_optimum() -> None:
    cells = partition(POINTS, PENTAGON)
    assert targets(cells, None, "centroid", 1.0) is cells.centroid
    np.testing.assert_array_equal(targets(cells, None, "median", 1.0), best_points(cells, Distance()))
    np.testing.assert_array_equal(targets(cells, None, "sensing", 0.4), best_points(cells, Sensing(0.4)))
    found = [targets(cells, None, word, 0.4) for word in TARGETS]
    assert min(np.abs(found[0] - found[1]).max(), np.abs(found[1] - found[2]).max()) > 1e-3


def test_a_density_that_is_the_same_everywhere_changes_nothing() -> None:
    for density in (Uniform(1.0), Uniform(3.0)):
        cells = partition(POINTS, PENTAGON, density=density)
        for word in TARGETS:
            np.testing.assert_allclose(
                targets(cells, density, word, 0.4),
                targets(partition(POINTS, PENTAGON), None, word, 0.4),
                atol=1e-9,
            )


def test_other_words_are_refused() -> None:
    cells = partition(POINTS, PENTAGON)
    with pytest.raises(ParameterError, match="unknown target 'mediane': did you mean 'median'"):
        targets(cells, None, "mediane", 1.0)
    with pytest.raises(ParameterError, match="height: 0"):
        targets(cells, None, "sensing", 0.0)


@pytest.mark.parametrize("law", ["rapf", "lloyd"])
@pytest.mark.parametrize("target", TARGETS)
def test_laws_head_for_their_target(law: str, target: str) -> None:
    n = len(POINTS)
    seen = Observations(POINTS, np.zeros((n, 2)), Neighbours(n), np.full((n, 2), np.nan), PENTAGON)
    controller = make_controller(law, {"target": target, "height": 0.7})
    decision = controller.decide(seen, controller.begin(PENTAGON, Team.homogeneous(n)))
    expected = targets(partition(POINTS, PENTAGON), None, target, 0.7)
    assert decision.goals is not None
    np.testing.assert_allclose(decision.goals, expected, atol=1e-12)
    pull = decision.terms["attraction"]
    along = expected - POINTS
    np.testing.assert_allclose(pull[:, 0] * along[:, 1], pull[:, 1] * along[:, 0], atol=1e-9)


def test_at_rest_a_team_is_where_its_targets_are(empty: Environment) -> None:
    """In a convex region; and the three partitions are three."""
    starts = scattered(Region(np.array(empty.boundary)), 5, np.random.default_rng(4))
    ends = []
    for target in TARGETS:
        controller = make_controller("lloyd", {"target": target, "height": 0.5})
        last = Simulation(empty, controller, starts=starts, dt=1 / 30).run(12.0).positions[-1]
        assert np.abs(last - targets(partition(last, empty.region), None, target, 0.5)).max() < 0.1
        ends.append(last)
    assert np.abs(ends[0] - ends[2]).max() > 1e-3
    assert np.abs(ends[0] - ends[1]).max() > 1e-3
