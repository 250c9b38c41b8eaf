"""What a disc can do by one scan: how far it can go along each ray, and where what blocks it ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array

_TOUCHING = 0.95
"""A point that is already nearer than the clearance is kept off by this part of its distance."""


class Gap(NamedTuple):
    """An end of the contour that blocks the way: a node of the local tangent graph.

    Attributes
    ----------
    ray : int
        The first one that passes it.
    point : (2,) m
        Just past the end, from the robot.
    """

    ray: int
    point: Array


def free_distances(points: Array, directions: Array, clearance: float, reach: float) -> Array:
    """Return how far a disc can go straight on along each direction, (k,) m, `reach` at most.

    Parameters
    ----------
    points : (m, 2) m
        Obstacle points from the robot; nan where none.
    directions : (k, 2)
        Unit vectors.
    clearance : float, m
        Distance that the robot's centre keeps from the points.
    reach : float, m
    """
    x, y = points[np.isfinite(points[:, 0])].T
    if not len(x):
        return np.full(len(directions), reach)
    keep = np.minimum(clearance, _TOUCHING * np.sqrt(x * x + y * y))
    along = directions[:, :1] * x + directions[:, 1:] * y
    across = directions[:, :1] * y - directions[:, 1:] * x
    depth2 = keep * keep - across * across
    stop = np.where((along > 0.0) & (depth2 > 0.0), along - np.sqrt(np.maximum(depth2, 0.0)), reach)
    return np.asarray(np.clip(stop.min(axis=1), 0.0, reach))


def end_of_contour(
    free: Array, directions: Array, first: int, turn: int, blocked_at: float, jump: float, reach: float
) -> Gap | None:
    """Return where the contour ends that blocks a ray, going round by `turn`; None when it is closed.

    Parameters
    ----------
    free : (k,) m
        Of `free_distances`.
    directions : (k, 2)
        Evenly round a full turn.
    first : int
        The ray nearest to the direction that is blocked.
    turn : {1, -1}
        Counter-clockwise or clockwise.
    blocked_at : float, m
        How far away it is blocked.
    jump : float, m
        By so much the next ray is free for longer where the contour ends.
    reach : float, m
        A ray that is free so far meets nothing.
    """
    rays = (first + turn * np.arange(len(free))) % len(free)
    ahead = free[rays]
    before = np.concatenate([[blocked_at], ahead[:-1]])
    ends = (ahead > before + jump) | (ahead >= reach)
    step = int(ends.argmax())
    if not ends[step]:
        return None
    ray = int(rays[step])
    return Gap(ray, directions[ray] * min(ahead[step], before[step] + jump))
