"""Conditions: imperfections and changes during a run.

Without them, the world is ideal, as in the paper: robots in range always know each other's positions, each
robot knows exactly where it is, the range sensor is exact, and all robots work from start to end.

- `conditions`, `events`: the conditions of a run, and robots that fail or join
- `perception`, `communication`: observations under these conditions, and messages between robots
- `random_streams`: random numbers for noise, loss and failures
"""

from robocov.conditions.conditions import (
    PARAMETERS,
    TIME_TOLERANCE_S,
    UNITS,
    Conditions,
    DensityKnowledge,
)
from robocov.conditions.events import Failure, Join, JoinedRobot, parse_event
from robocov.conditions.random_streams import (
    FAILURE_STREAM,
    LOSS_STREAM,
    POSITION_STREAM,
    SCANNING_STREAM,
    SENSING_STREAM,
)

__all__ = [
    "FAILURE_STREAM",
    "LOSS_STREAM",
    "PARAMETERS",
    "POSITION_STREAM",
    "SCANNING_STREAM",
    "SENSING_STREAM",
    "TIME_TOLERANCE_S",
    "UNITS",
    "Conditions",
    "DensityKnowledge",
    "Failure",
    "Join",
    "JoinedRobot",
    "parse_event",
]
