"""Classification of a robot's motion: moving, trembling, at rest, or setting off."""

from enum import Enum

import numpy as np

from robocov.metrics import SETTLED_DISTANCE_M
from robocov.typing import FloatArray
from robocov_app.viewer.explanation.situation import RobotSituation, compute_alignment

MAX_REST_SPEED_M_S = 0.05
"""Robots that are slower appear to be at rest."""

_MIN_STEADY_SPEED_M_S = 0.1 * MAX_REST_SPEED_M_S  # enough for a robot that has covered some distance
_MIN_VISIBLE_MOTION_M = 0.02  # a robot that moves by less appears to be at rest
_TREMBLING_RATIO = 3.0  # a robot trembles if its path length is more than this many times its extent
_STRAIGHT_RATIO = 1.5  # a path is straight if it is less than this many times the distance covered
_MAX_TREMBLING_EXTENT_M = 0.3  # a robot that gets around more than this is moving
_MIN_FORWARD_ALIGNMENT = 0.7  # cosine between the displacement and the velocity of a robot that sets off
_MIN_RUN_UP_FRACTION = 0.5  # of the distance in which a robot at maximum acceleration reaches its speed


class Motion(Enum):
    """Motion of a robot."""

    MOVING = "moving"
    TREMBLING = "trembling"
    TREMBLING_AT_REST = "trembling at rest"
    AT_REST = "at rest"
    STARTING = "starting"


def classify_motion(situation: RobotSituation, recent: FloatArray | None) -> Motion:
    """Classify the motion of a robot.

    Parameters
    ----------
    situation : RobotSituation
        The robot.
    recent : (k, 2) array, m, or None
        Its positions during the last seconds, oldest first. Without them, only its speed is used.

    Returns
    -------
    Motion
    """
    path = np.empty((0, 2)) if recent is None else recent[np.isfinite(recent).all(axis=1)]
    if len(path) < 2:
        if situation.speed > MAX_REST_SPEED_M_S:
            return Motion.MOVING
        return _classify_rest(situation, path_length=0.0)
    path_length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    extent = float(np.hypot(*np.ptp(path, axis=0)))
    if path_length > _TREMBLING_RATIO * max(_MIN_VISIBLE_MOTION_M, extent):
        return _classify_trembling(extent)
    # As in `RobotSituation`, vectors are complex numbers.
    dx, dy = path[-1] - path[0]
    displacement = complex(dx, dy)
    has_covered_distance = abs(displacement) >= SETTLED_DISTANCE_M
    # A robot that has covered some distance is moving even if it is slow, unless it has just stopped.
    max_rest_speed = _MIN_STEADY_SPEED_M_S if has_covered_distance else MAX_REST_SPEED_M_S
    if situation.speed <= max_rest_speed:
        return _classify_rest(situation, path_length)
    if has_covered_distance or _has_set_off(situation, displacement, path_length):
        return Motion.MOVING
    return _classify_trembling(extent)


def _classify_trembling(extent: float) -> Motion:
    """Classify a robot that trembles, by the extent of its path, m."""
    if extent < SETTLED_DISTANCE_M:
        return Motion.TREMBLING_AT_REST
    if extent > _MAX_TREMBLING_EXTENT_M:
        return Motion.MOVING
    return Motion.TREMBLING


def _classify_rest(situation: RobotSituation, path_length: float) -> Motion:
    """Classify a robot without noticeable motion: setting off if a force pushes it, else at rest."""
    is_pushed = not situation.is_balanced and not situation.holding_names
    if is_pushed and path_length < _MIN_VISIBLE_MOTION_M:
        return Motion.STARTING
    return Motion.AT_REST


def _has_set_off(situation: RobotSituation, displacement: complex, path_length: float) -> bool:
    """Return whether a robot has covered little distance because it has only just started to move.

    Parameters
    ----------
    situation : RobotSituation
        The robot, which is faster than `MAX_REST_SPEED_M_S`.
    displacement : complex
        Displacement during the last seconds, x + i y, m.
    path_length : float
        Length of the path during that time, m.
    """
    is_straight = path_length < _STRAIGHT_RATIO * abs(displacement)
    if not is_straight or compute_alignment(displacement, situation.velocity) <= _MIN_FORWARD_ALIGNMENT:
        return False
    # From rest, a robot reaches its speed v within v² / (2 a) at the earliest.
    run_up = 0.5 * situation.speed**2 / situation.max_acceleration
    return abs(displacement) > _MIN_RUN_UP_FRACTION * run_up
