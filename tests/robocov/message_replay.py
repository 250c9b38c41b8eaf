"""Replays of controllers, in which a robot does not get what it has neither observed nor received."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from robocov.density.base import Density
from robocov.observation import Decision, DensitySensor, Observations
from robocov.simulation import Simulation
from robocov_app.benchmark.verification.controller_messages import encode_payload
from robocov_app.benchmark.verification.isolation import hide_others, sample_substitutes


def record_run(simulation: Simulation, steps: int) -> tuple[list[Observations], list[Decision]]:
    """Run a simulation; return the observations and the decisions of all robots in each step."""
    observations = []
    decisions = []
    for _ in range(steps):
        snapshot = simulation.observe_and_decide()
        observations.append(snapshot.seen)
        decisions.append(snapshot.decision)
        simulation.step()
    return observations, decisions


def replay(simulation: Simulation, observations: list[Observations]) -> list[Decision]:
    """Return the decisions of a controller from the start for given observations."""
    controller = simulation.controller
    memory = controller.begin(observations[0].region, simulation.team)
    decisions = []
    for seen in observations:
        decision = controller.decide(seen, memory)
        memory = decision.memory
        decisions.append(decision)
    return decisions


def hide_undelivered(observations: list[Observations], robot: int, seed: int) -> list[Observations]:
    """Return observations in which all is replaced that a robot has neither observed nor received."""
    robot_count = len(observations[0].positions)
    substitutes = sample_substitutes(observations[0].region, robot_count, np.random.default_rng(seed))
    return [hide_others(seen, robot, substitutes) for seen in observations]


def replace_density_sensor(observations: list[Observations], density: Density) -> list[Observations]:
    """Return observations in which robots can measure the density everywhere, also where they have not been.

    A controller that decides differently needs this, because it may measure elsewhere.
    """
    sensor = DensitySensor(lambda robots, points: density.evaluate(points))
    return [replace(seen, density_sensor=sensor) for seen in observations]


def remove_messages(observations: list[Observations], kinds: tuple[type, ...]) -> list[Observations]:
    """Return observations without messages whose payloads are of these kinds."""
    changed = []
    for seen in observations:
        messages = [
            [message for message in inbox if not isinstance(message.payload, kinds)]
            for inbox in seen.messages
        ]
        changed.append(replace(seen, messages=messages))
    return changed


def extract_robot_decisions(decisions: list[Decision], robot: int) -> list[tuple[Any, ...]]:
    """Return the force, the goal and the messages of a robot in each step, with bytes in place of arrays."""
    extracts = []
    for decision in decisions:
        assert decision.goals is not None
        sent = decision.messages[robot] if decision.messages else ()
        messages = [(message.size, encode_payload(message.payload)) for message in sent]
        extracts.append((decision.forces[robot].tobytes(), decision.goals[robot].tobytes(), messages))
    return extracts
