"""The arrays of a record, and their file ``record.npz``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robocov.errors import InputError, format_bound
from robocov.files.array_files import read_arrays
from robocov.team import Team
from robocov.typing import FloatArray

ARRAYS = ("time", "positions", "velocities", "forces", "goals", "obstacle_points")
"""Names of the arrays of every record."""
STEERING = "steering"
"""Name of the additional array in records of unicycles."""
SENT_BYTES = "sent_bytes"
"""Name of the additional array in records of robots that send messages."""
COLUMNS = {
    "positions": ("x_m", "y_m"),
    "velocities": ("vx_m_s", "vy_m_s"),
    "forces": ("fx_N", "fy_N"),
    "goals": ("goal_x_m", "goal_y_m"),
    "obstacle_points": ("obstacle_x_m", "obstacle_y_m"),
    STEERING: ("heading_rad", "turning_rate_rad_s"),
}
"""Names of the columns of data frames, by array."""
_MAX_VALUES = {
    "time": 1e9,
    "positions": 1e7,
    "velocities": 1e300,
    "forces": 1e300,
    STEERING: 1e9,
    SENT_BYTES: 1e18,
}
"""Maximum absolute value in each array, in its unit. Arrays that are not listed may contain nan."""


def list_array_names(team: Team) -> tuple[str, ...]:
    """Return the names of the arrays that a record must have.

    Parameters
    ----------
    team : Team
        The robots of the record.

    Returns
    -------
    tuple of str
    """
    return (*ARRAYS, STEERING) if team.is_unicycle.any() else ARRAYS


def read_record_arrays(path: Path, team: Team) -> dict[str, FloatArray]:
    """Read the arrays of a record.

    Parameters
    ----------
    path : Path
        A file ``record.npz``.
    team : Team
        The robots of the record.

    Returns
    -------
    dict of str to array
        The arrays by name.

    Raises
    ------
    InputError
        If an array is missing, has a wrong shape or type, or contains numbers that are out of range.
    """
    with path.open("rb") as file:
        saved = read_arrays(file, str(path))
    names = list_array_names(team)
    if SENT_BYTES in saved:
        names = (*names, SENT_BYTES)
    for name in names:
        if name not in saved:
            raise InputError(f"{path}: there is no array {name}")
        _check_shape(path, name, saved[name], saved["time"].shape, robot_count=len(team))
    for name, maximum in _MAX_VALUES.items():
        if name in names:
            _check_range(path, name, saved[name], maximum)
    if (np.diff(saved["time"]) <= 0.0).any():
        raise InputError(f"{path}: time: expected ascending numbers")
    return {name: saved[name] for name in names}


def _check_shape(
    path: Path, name: str, array: FloatArray, time_shape: tuple[int, ...], robot_count: int
) -> None:
    """Raise an InputError unless an array has one row for each time step, and the right type."""
    is_per_step = name in ("time", SENT_BYTES)
    shape = time_shape if is_per_step else (*time_shape, robot_count, 2)
    has_steps = len(time_shape) == 1 and time_shape != (0,)
    if array.dtype != np.float64 or array.shape != shape or not has_steps:
        expected = "(T,)" if is_per_step else str(shape)
        raise InputError(
            f"{path}: {name}: expected shape {expected} of float64, got {array.shape} of {array.dtype}"
        )


def _check_range(path: Path, name: str, array: FloatArray, maximum: float) -> None:
    """Raise an InputError if the absolute value of a number exceeds the maximum, or is nan."""
    is_in_range = np.abs(array) <= maximum
    if not is_in_range.all():
        raise InputError(
            f"{path}: {name}: expected finite numbers up to {format_bound(maximum)}, "
            f"got {array[~is_in_range][0]:g}"
        )
