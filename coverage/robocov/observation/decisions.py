"""Decisions of a controller, and checks of the values that controllers return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np

from robocov.errors import ParameterError, quote
from robocov.observation.cells import Cells
from robocov.observation.messages import Message, check_messages
from robocov.typing import FloatArray


@dataclass(slots=True, eq=False)
class Decision:
    """The forces that a controller commands, and the quantities that explain them.

    Attributes
    ----------
    forces : (n, 2) array, N
        The driving force of each robot before any limit; viscosity is added by the world.
    goals : (n, 2) array or None, m
        The goal of each robot; nan if it has none. None if the controller does not use goals.
    terms : mapping of str to (n, 2) array, N
        The forces by cause (``attraction``, ``repulsion_robots``, ``repulsion_obstacle``, ...).
    cells : Cells or None
        The cells that the controller used.
    memory : object
        Memory of the robots, which the controller receives again at its next decision.
    messages : sequence of sequence of Message
        The messages that each robot sends; empty if no robot sends any.

    See Also
    --------
    Observations : The input of a controller.
    Controller : The interface of controllers.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> simulation = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(3, seed=0))
    >>> decision = simulation.observe_and_decide().decision
    >>> decision.forces.shape, sorted(decision.terms)
    ((3, 2), ['attraction', 'repulsion_obstacle', 'repulsion_robots'])
    """

    forces: FloatArray
    goals: FloatArray | None = None
    terms: Mapping[str, FloatArray] = field(default_factory=dict)
    cells: Cells | None = None
    memory: Any = None
    messages: Sequence[Sequence[Message]] = ()


def check_decision(
    returned: Any, robot_count: int, controller: str, time: float, source: str = ""
) -> Decision:
    """Check that a decision can be executed and recorded, and return it with float arrays.

    Parameters
    ----------
    returned : object
        Value returned by the controller's ``decide``.
    robot_count : int
        Number of robots for which a decision is expected.
    controller : str
        Name of the controller, for messages.
    time : float, s
        Simulation time, for messages.
    source : str
        File and line of ``decide``, for messages, such as " (mine.py, line 12)".

    Returns
    -------
    Decision
        The same object if its arrays are already floats.

    Raises
    ------
    ParameterError
        If it is not a `Decision`, its forces are not finite numbers of shape (robot_count, 2), or its goals
        are not numbers of this shape.
    """
    subject = f"controller {controller!r}: decide(observations, memory) returned"
    suffix = f" at {time:.3f} s{source}"
    if not isinstance(returned, Decision):
        hint = " (is a return statement missing?)" if returned is None else ""
        raise ParameterError(f"{subject} {quote(returned)}{hint}{suffix}, expected a Decision")
    decision: Decision = returned
    forces = _to_rows(decision.forces, robot_count, f"{subject} forces", suffix)
    goals = decision.goals
    if goals is not None:
        goals = _to_rows(goals, robot_count, f"{subject} goals", suffix)
    if forces is not decision.forces or goals is not decision.goals:
        decision = replace(decision, forces=forces, goals=goals)
    if not _is_finite(forces):
        robot = int(np.flatnonzero(~np.isfinite(forces).all(axis=1))[0])
        got = f"the force {forces[robot].tolist()} for robot {robot + 1}{suffix}"
        raise ParameterError(f"{subject} {got}, expected two finite numbers in newtons")
    return decision


def copy_decision(decision: Decision, controller: str, source: str = "") -> Decision:
    """Copy the arrays and messages of a checked decision, which a user's controller may overwrite later.

    Parameters
    ----------
    decision : Decision
        A decision that `check_decision` returned.
    controller, source : str
        As for `check_decision`.

    Returns
    -------
    Decision

    Raises
    ------
    ParameterError
        If `terms` is not a mapping of names to forces of all robots, `cells` is not a `Cells` object, or
        `messages` are not messages of each robot.
    """
    subject = f"controller {controller!r}: decide(observations, memory) returned"
    if not isinstance(decision.terms, Mapping):
        raise ParameterError(f"{subject} terms {quote(decision.terms)}{source}, expected a dict of forces")
    terms = {}
    for name, term in decision.terms.items():
        rows = _to_rows(term, len(decision.forces), f"{subject} the term {quote(name)}", source)
        terms[name] = rows.copy()
    if decision.cells is not None and not isinstance(decision.cells, Cells):
        got = f"{quote(decision.cells)}{source}"
        raise ParameterError(f"{subject} cells {got}, expected the result of robocov.partition, or None")
    goals = None if decision.goals is None else decision.goals.copy()
    messages = check_messages(decision.messages, len(decision.forces), f"{subject} messages")
    if messages:
        messages = [[_copy_message(message) for message in robot_messages] for robot_messages in messages]
    return replace(decision, forces=decision.forces.copy(), goals=goals, terms=terms, messages=messages)


def _copy_message(message: Message) -> Message:
    """Return a copy of a message, or the message itself if its payload cannot be copied."""
    try:
        return Message(deepcopy(message.payload), message.size)
    except Exception:
        return message


def check_forces(values: Any, shape: tuple[int, ...], name: str) -> FloatArray:
    """Check forces that do not come from a controller, and return them as an array of floats.

    Parameters
    ----------
    values : array-like, N
        The forces.
    shape : tuple of int
        Expected shape, such as (n, 2) for n robots.
    name : str
        Name of the forces in messages.

    Returns
    -------
    array of this shape, N

    Raises
    ------
    ParameterError
        If the forces are not finite numbers of that shape.
    """
    forces = to_numbers(values)
    if forces is None:
        raise ParameterError(f"{name}: expected numbers of shape {shape}, got {quote(values)}")
    if forces.shape != shape:
        raise ParameterError(f"{name}: expected an array of shape {shape}, got shape {forces.shape}")
    if not _is_finite(forces):
        raise ParameterError(f"{name}: expected finite forces in newtons, got {quote(forces.tolist())}")
    return forces


def to_numbers(values: object) -> FloatArray | None:
    """Convert real numbers to an array of floats.

    Complex numbers, strings and objects are rejected even if they can be converted to floats.

    Parameters
    ----------
    values : object
        Anything that a controller may return, such as an array or a nested list.

    Returns
    -------
    array or None
        The same object if it is an array of floats; None if the values are not real numbers.
    """
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return values
    try:
        array = np.asarray(values)
        return array.astype(np.float64) if array.dtype.kind in "biuf" else None
    except Exception:
        # The values may be of any class, such as a tensor of another library, and their conversion may fail
        # with any error.
        return None


def _is_finite(forces: FloatArray) -> bool:
    # The sum of squares is fast to compute, and finite only if all forces are. It may overflow for huge
    # finite forces; only then is each force tested.
    return isfinite(np.vdot(forces, forces)) or bool(np.isfinite(forces).all())


def _to_rows(values: Any, robot_count: int, name: str, suffix: str = "") -> FloatArray:
    """Convert two numbers for each robot to a (robot_count, 2) array; an array of floats is not copied.

    In messages, `suffix` follows the values.
    """
    array = to_numbers(values)
    shape = (robot_count, 2)
    if array is None:
        raise ParameterError(f"{name} {quote(values)}{suffix}, expected numbers of shape {shape}")
    if array.shape != shape:
        raise ParameterError(f"{name} of shape {array.shape}{suffix}, expected {shape}")
    return array
