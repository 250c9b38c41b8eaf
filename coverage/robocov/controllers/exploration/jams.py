"""Jams: robots that block each other, for example at a door, and move away from each other for a while."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocov.controllers.exploration.atlas_memory import JamState
from robocov.controllers.exploration.staggering import compute_stagger_fraction
from robocov.typing import FloatArray

_MAX_STUCK_PLANS = 3
"""Number of consecutive plans after which a stuck robot is in a jam."""
_JAM_RADIUS_M = 0.7
"""Distance from a robot within which others are in the same jam."""
_MAX_EVASION_S = 8.0
"""Maximum time that a robot spends moving out of a jam."""


def plan_evasion(
    jam: JamState, positions: FloatArray, *, is_stuck: bool, time: float, robot: int
) -> tuple[JamState, FloatArray | None]:
    """Decide whether a robot moves out of a jam and, if so, where to.

    Parameters
    ----------
    jam : JamState
        State after the robot's last plan.
    positions : (k, 2) array, m
        Positions of the robot itself, which comes first, and of the others that it knows of.
    is_stuck : bool
        Whether the robot has barely moved since its last plan, although it is not at its goal.
    time : float, s
    robot : int
        Index of the robot.

    Returns
    -------
    jam : JamState
        State after this plan.
    goal : (2,) array or None, m
        A point away from the other robots in the jam. None if the robot need not move away.
    """
    stuck_plans = jam.stuck_plans + 1 if is_stuck else 0
    jam = replace(jam, stuck_plans=stuck_plans)
    if stuck_plans >= _MAX_STUCK_PLANS:
        # Robots move away for different lengths of time, so that they do not all return at once.
        duration = _MAX_EVASION_S * compute_stagger_fraction(robot + time)
        jam = JamState(stuck_plans=0, evasion_end=time + duration)
    position = positions[0]
    is_in_jam = ((positions - position) ** 2).sum(axis=1) < _JAM_RADIUS_M**2
    away = position - positions[is_in_jam].mean(axis=0)
    if not (time < jam.evasion_end and away.any()):
        return jam, None
    goal = position + away * (_JAM_RADIUS_M / float(np.hypot(*away)))
    return replace(jam, stuck_plans=0), goal
