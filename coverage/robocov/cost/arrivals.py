"""Who is where first, when robots are not equally fast: equation (22) with distance over speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.errors import InputError, shown

if TYPE_CHECKING:
    from collections.abc import Callable

Ways: TypeAlias = tuple[Array, IntArray, IntArray, IntArray]
"""Of (m,) sites: the distance of a robot, inf where none can come; that robot, -1 there; and the corners
where its way bends first and last, -1 where it is straight."""


def checked_speeds(speeds: object, robots: int) -> Array:
    """Return the speeds of so many robots, (n,) m/s.

    Raises
    ------
    InputError
        When they are not as many positive numbers.
    """
    try:
        values = np.array(speeds, dtype=float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (robots,):
        raise InputError(f"speeds: {shown(speeds)}, but a number for each of {robots} robots was wanted")
    for k, value in enumerate(values.tolist()):
        if not 0.0 < value < np.inf:
            raise InputError(f"speeds[{k}]: {shown(value)} m/s, but a number above 0 was wanted")
    return values


def first_there(
    nearest: Callable[[Array, Array, BoolArray], Ways], x: Array, y: Array, holds: BoolArray, speeds: Array
) -> Ways:
    """Return the ways of the robots that are first at each site, of equals the fastest.

    Of robots that are equally fast the nearest is first: each speed is one exact search among its robots.

    Parameters
    ----------
    nearest : callable
        Returns the ways of the nearest of robots at (x, y), which stand in the components of a mask.
    x, y : (n,)
    holds : (n, components)
        Which component holds which robot.
    speeds : (n,) m/s
    """
    best = np.inf
    found: Ways | None = None
    for speed in np.unique(speeds)[::-1].tolist():
        rows = np.flatnonzero(speeds == speed)
        covered = np.asarray(holds[rows].any(axis=0))
        distance, owner, corner, last_corner = nearest(x[rows], y[rows], covered)
        ways = distance, np.where(owner >= 0, rows[owner], -1), corner, last_corner
        time = distance / speed
        if found is None:
            best, found = time, ways
            continue
        sooner = time < best
        best = np.minimum(best, time)
        found = tuple(np.where(sooner, new, old) for new, old in zip(ways, found, strict=True))  # type: ignore[assignment]
    assert found is not None
    return found
