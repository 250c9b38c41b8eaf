from __future__ import annotations

import numpy as np
import pytest

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.simulation import Simulation
from robocov.team import Team
from robocov_app.learning.episode import Learner
from robocov_app.learning.task import (
    ACTIONS,
    FOLLOWING,
    action_limit,
    actions_of,
    checked_kind,
    driving_forces,
)

TEAM = Team.homogeneous(2, mass=2.0, viscosity=3.0, max_speed=0.5, max_acceleration=4.0)


def test_limits_are_what_has_an_effect() -> None:
    assert action_limit("velocity", TEAM).tolist() == [0.5, 0.5]
    assert action_limit("force", TEAM).tolist() == [2.0 * 4.0 + 3.0 * 0.5] * 2


@pytest.mark.parametrize("action", ACTIONS)
def test_an_action_is_found_of_its_force(action: str) -> None:
    rng = np.random.default_rng(0)
    values, velocities = rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    forces = driving_forces(action, values, velocities, TEAM)
    np.testing.assert_allclose(actions_of(action, forces, velocities, TEAM), values, rtol=1e-12)


def test_robots_follow_a_velocity(empty: Environment) -> None:
    """The world, not a formula, says how fast: after five time constants within 1 % of what was asked."""
    simulation = Simulation(empty, Learner(), [[2.0, 2.0], [6.0, 6.0]], Team.homogeneous(2, mass=2.0), 0.01)
    wanted = np.array([[0.1, 0.05], [-0.1, 0.0]])
    for _ in range(round(5 * FOLLOWING / 0.01)):
        simulation.step(forces=driving_forces("velocity", wanted, simulation.velocities, simulation.team))
    np.testing.assert_allclose(simulation.velocities, wanted, atol=0.01 * 0.12)


def test_names() -> None:
    checked_kind("action", "force", ACTIONS)
    with pytest.raises(ParameterError, match="unknown kind of action 'forces': did you mean 'force'"):
        checked_kind("action", "forces", ACTIONS)
