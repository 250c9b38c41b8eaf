"""Memories and messages of robots at each state of a record, which are recomputed: files lack them."""

from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np

from robocov.conditions.communication import Inbox
from robocov.controllers import has_memory
from robocov.record import Record
from robocov.simulation import Simulation, TeamState
from robocov_app.terminal.interruption import suppress_controller_errors
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

_MAX_ROBOTS_WITH_MESSAGES = 30
"""Maximum size of a team whose messages are kept for every state. Those of a larger team are kept only for
the last state, because the memory that they need grows with the number of pairs of robots."""


class Knowledge(NamedTuple):
    """Knowledge of the robots at a recorded state.

    Attributes
    ----------
    memory : object
        Memory of the controller; None if it is unknown, or the controller has no memory.
    inbox : Inbox or None
        Messages of the robots; None if they are unknown, or the robots need no messages.
    """

    memory: Any
    inbox: Inbox | None


_UNKNOWN = Knowledge(None, None)


def recompute_knowledge(record: Record, choice: ControllerChoice, dt: float) -> list[Knowledge]:
    """Simulate a recorded run again, and return what the robots remember at each recorded state.

    The knowledge is unknown from the first state that differs from the record, for example because the
    controller has changed since then, and at all states if the controller is missing.

    Parameters
    ----------
    record : Record
        A record with conditions.
    choice : ControllerChoice
        The controller of the record.
    dt : float, s
        Control period; the interval of the recorded states may be a multiple of it.

    Returns
    -------
    list of Knowledge
        One for each state of the record.
    """
    known: list[Knowledge] = []
    # A missing controller cannot be built.
    with suppress_controller_errors():
        controller = choice.build()
        needs_memory = has_memory(controller)
        needs_messages = record.conditions is not None and record.conditions.uses_messages
        if not needs_memory and not needs_messages:
            return [_UNKNOWN] * len(record)
        simulation = Simulation(
            record.environment,
            controller,
            build_team_state(record, 0),
            record.team,
            dt,
            conditions=record.conditions,
        )
        is_small = len(record.team) <= _MAX_ROBOTS_WITH_MESSAGES
        for index in range(len(record)):
            if index > 0:
                _advance(simulation, round(record.dt / dt))
            if not _is_recorded_state(simulation, record, index):
                break
            memory = deepcopy(simulation.memory) if needs_memory else None
            is_kept = is_small or index == len(record) - 1
            known.append(Knowledge(memory, simulation.inbox if is_kept else None))
    return known + [_UNKNOWN] * (len(record) - len(known))


def build_team_state(record: Record, index: int) -> TeamState:
    """Return a recorded state of all robots, also of those that do not work."""
    return TeamState(
        positions=record.positions[index],
        velocities=record.velocities[index],
        steering=None if record.steering is None else record.steering[index],
    )


def _advance(simulation: Simulation, steps: int) -> None:
    for _ in range(steps):
        simulation.step()


def _is_recorded_state(simulation: Simulation, record: Record, index: int) -> bool:
    has_same_positions = np.array_equal(simulation.positions, record.positions[index])
    return has_same_positions and np.array_equal(simulation.velocities, record.velocities[index])
