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
    """Return what a controller decided for `count` robots if it can be carried out and recorded.

    Raises
    ------
    ParameterError
        When it is no decision, or its forces are not finite and (n, 2).
    """
    if not isinstance(made, Decision):
        wanted = "but a Decision was wanted"
        raise ParameterError(f"controller {controller!r}: decide gave {shown(made)}, {wanted}")
    decision: Decision = made
    forces = _rows(decision.forces, count, "forces", controller)
    goals = None if decision.goals is None else _rows(decision.goals, count, "goals", controller)
    if forces is not decision.forces or goals is not decision.goals:
        decision = replace(decision, forces=forces, goals=goals)
    if not _finite(forces):
        robot = int(np.flatnonzero(~np.isfinite(forces).all(axis=1))[0])
        raise ParameterError(
            f"controller {controller!r}: force {forces[robot].tolist()} on robot {robot + 1} "
            f"at {time:.3f} s, but finite newtons were wanted"
        )
    return decision


def detached(decision: Decision, controller: str) -> Decision:
    """Return a checked decision with arrays of its own: a user's controller may use its arrays again.

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


def given_forces(values: Any, count: int, what: str) -> Array:
    """Return forces from outside, (n, 2) N, if they can be carried out.

    Raises
    ------
    ParameterError
        When they are not finite and (n, 2).
    """
    forces = _rows(values, count, what)
    if not _finite(forces):
        raise ParameterError(f"{what}: {shown(forces.tolist())}, but finite newtons were wanted")
    return forces


def _finite(forces: Array) -> bool:
    # a sum of squares is soon known, and finite if they are, unless they are huge
    return isfinite(np.vdot(forces, forces)) or bool(np.isfinite(forces).all())


def _rows(values: Any, count: int, what: str, controller: str | None = None) -> Array:
    """Return two numbers for each robot as an array, the same one where it is one already."""
    try:
        array = np.asarray(values, dtype=np.float64)
        if array.shape == (count, 2):
            return array
        found = f" of shape {array.shape}, but {(count, 2)} was wanted"
    except (TypeError, ValueError):
        found = f": {shown(values)}, but numbers were wanted"
    raise ParameterError((what if controller is None else f"controller {controller!r}: {what}") + found)
