"""Actions of learning robots: limits, forces and velocities."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.simulation import Simulation
from robocov.team import Team
from robocov_app.learning.actions import (
    ACTIONS,
    VELOCITY_TIME_CONSTANT_S,
    compute_action_limits,
    compute_actions,
    compute_driving_forces,
)
from robocov_app.learning.episode import ExternalController
from robocov_app.learning.task import check_kind

TEAM = Team.homogeneous(2, mass=2.0, viscosity=3.0, max_speed=0.5, max_acceleration=4.0)


def test_limits_of_actions_follow_from_the_team() -> None:
    assert compute_action_limits("velocity", TEAM).tolist() == [0.5, 0.5]
    assert compute_action_limits("force", TEAM).tolist() == [2.0 * 4.0 + 3.0 * 0.5] * 2


@pytest.mark.parametrize("action", ACTIONS)
def test_actions_are_recovered_from_forces(action: str) -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=(2, 2))
    velocities = rng.normal(size=(2, 2))
    forces = compute_driving_forces(action, values, velocities, TEAM)
    np.testing.assert_allclose(compute_actions(action, forces, velocities, TEAM), values, rtol=1e-12)


def test_robots_follow_a_velocity(empty: Environment) -> None:
    """After five time constants, simulated velocities are within 1% of those requested."""
    simulation = Simulation(
        empty, ExternalController(), [[2.0, 2.0], [6.0, 6.0]], Team.homogeneous(2, mass=2.0), 0.01
    )
    requested = np.array([[0.1, 0.05], [-0.1, 0.0]])
    for _ in range(round(5 * VELOCITY_TIME_CONSTANT_S / 0.01)):
        simulation.step(
            forces=compute_driving_forces("velocity", requested, simulation.velocities, simulation.team)
        )
    np.testing.assert_allclose(simulation.velocities, requested, atol=0.01 * 0.12)


def test_unknown_kinds_of_actions_are_rejected() -> None:
    check_kind("action", "force", ACTIONS)
    with pytest.raises(ParameterError, match="unknown kind of action 'forces': did you mean 'force'"):
        check_kind("action", "forces", ACTIONS)
