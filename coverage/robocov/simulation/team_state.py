"""The state from which a run starts or continues."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robocov.errors import StartError, quote, require_whole_number, to_floats
from robocov.typing import FloatArray
from robocov.world.free_positions import require_finite_starts


@dataclass(frozen=True, eq=False)
class TeamState:
    """The state of a team from which a simulation starts or continues.

    Parameters
    ----------
    positions : (n, 2) array, m
        Centers of the robots.
    velocities : (n, 2) array or None, m/s
        By default robots are at rest.
    steering : (n, 2) array or None, rad and rad/s
        Heading, from +x, and turning rate of unicycles. By default they face the direction in which they
        move.
    steps : int
        Number of control steps taken before this state.
    is_computed : bool
        Whether a simulation computed this state. It is then not checked for overlaps, because bodies in
        contact overlap a little.

    Raises
    ------
    StartError
        If there is no robot, or an array does not contain two finite numbers for each robot.
    ParameterError
        If the number of steps is not a whole number of at least 0.

    See Also
    --------
    Simulation : Starts from positions or from a state.

    Examples
    --------
    A simulation that starts with moving robots:

    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> state = rc.TeamState(positions=[[1.0, 1.0]], velocities=[[0.5, 0.0]])
    >>> rc.Simulation(rooms, rc.Rapf(), state).velocities
    array([[0.5, 0. ]])
    """

    positions: FloatArray
    velocities: FloatArray | None = None
    steering: FloatArray | None = None
    steps: int = 0
    is_computed: bool = False

    def __post_init__(self) -> None:
        positions = to_floats("starts", self.positions, "[x, y] of each robot in meters", StartError)
        if positions.ndim != 2 or positions.shape[1] != 2 or len(positions) < 1:
            raise StartError(
                f"starts: expected an array of shape (n, 2) with n >= 1, got shape {positions.shape}"
            )
        require_finite_starts(positions)
        object.__setattr__(self, "positions", positions)
        if self.velocities is not None:
            velocities = to_floats("velocities", self.velocities, "[x, y] of each robot in m/s", StartError)
            _check_rows("velocities", velocities, positions.shape, "[x, y]")
            object.__setattr__(self, "velocities", velocities)
        if self.steering is not None:
            columns = "[heading, turning rate]"
            steering = to_floats("steering", self.steering, f"{columns} of each robot", StartError)
            _check_rows("steering", steering, positions.shape, columns)
            object.__setattr__(self, "steering", steering)
        require_whole_number("steps", self.steps, 0)

    def __len__(self) -> int:
        """Return the number of robots."""
        return len(self.positions)


def _check_rows(name: str, rows: FloatArray, shape: tuple[int, ...], columns: str) -> None:
    """Raise a StartError unless an array has the given shape and is finite."""
    if rows.shape != shape or not np.isfinite(rows).all():
        raise StartError(f"{name}: expected finite {columns} for each robot, got {quote(rows.tolist())}")


def to_team_state(starts: Any) -> TeamState:
    """Return the state of robots at rest at the given positions, or the given state itself.

    Parameters
    ----------
    starts : TeamState or (n, 2) array_like, m
        Positions of robots at rest, or a state.

    Returns
    -------
    TeamState
    """
    return starts if isinstance(starts, TeamState) else TeamState(starts)
