"""Forces, checked before they are carried out: those of a controller, and those from outside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.errors import ParameterError, shown
from robocov.observation.observations import Decision


def checked_decision(made: Any, count: int, controller: str, time: float) -> Decision:
    """Return the decision when it is one that can be carried out and recorded.

    Parameters
    ----------
    made : object
        What the controller returned.
    count : int
        Number of robots.
    controller : str
        Its name.
    time : float, s

    Raises
    ------
    ParameterError
        When it is no decision, or its forces are not finite and (n, 2).
    """
    where = f"controller {controller!r}"
    if not isinstance(made, Decision):
        raise ParameterError(f"{where}: decide gave {shown(made)}, but a Decision was wanted")
    decision: Decision = made
    forces = _rows(decision.forces, count, f"{where}: forces")
    goals = None if decision.goals is None else _rows(decision.goals, count, f"{where}: goals")
    if forces is not decision.forces or goals is not decision.goals:
        decision = replace(decision, forces=forces, goals=goals)
    # the sum of squares is finite if all are, and quicker to know; too large forces are looked at again
    if not isfinite(np.vdot(forces, forces)) and not np.isfinite(forces).all():
        robot = int(np.flatnonzero(~np.isfinite(forces).all(axis=1))[0])
        raise ParameterError(
            f"{where}: force {forces[robot].tolist()} on robot {robot + 1} "
            f"at {time:.3f} s, but finite newtons were wanted"
        )
    return decision


def detached(decision: Decision, controller: str) -> Decision:
    """Return a checked decision with arrays of its own: a user's controller may use its arrays again.

    Parameters
    ----------
    decision : Decision
    controller : str
        Its name.

    Raises
    ------
    ParameterError
        When its terms are none.
    """
    if not isinstance(decision.terms, Mapping):
        wanted = "but a dict of forces was wanted"
        raise ParameterError(f"controller {controller!r}: terms: {shown(decision.terms)}, {wanted}")
    terms = {name: np.array(term) for name, term in decision.terms.items()}
    goals = None if decision.goals is None else decision.goals.copy()
    return replace(decision, forces=decision.forces.copy(), goals=goals, terms=terms)


def given_forces(values: Array | None, count: int, what: str) -> Array | None:
    """Return forces from outside, (n, 2) N, when they can be carried out; None where there are none.

    Raises
    ------
    ParameterError
        When they are not finite and (n, 2).
    """
    if values is None:
        return None
    values = _rows(values, count, what)
    if not np.isfinite(values).all():
        raise ParameterError(f"{what}: {shown(values.tolist())}, but finite newtons were wanted")
    return values


def _rows(values: Any, count: int, what: str) -> Array:
    """Return two numbers for each robot as an array, the same one where it is one already."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(f"{what}: {shown(values)}, but numbers were wanted") from None
    if array.shape != (count, 2):
        raise ParameterError(f"{what} of shape {array.shape}, but {(count, 2)} was wanted")
    return array
