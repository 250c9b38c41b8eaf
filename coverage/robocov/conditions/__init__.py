"""Conditions: imperfections and changes during a run.

Without them the world of the paper is ideal: robots in range know each other's positions at all times, each
robot knows exactly where it is, the range sensor is exact, and all robots work from the start to the end.

- `conditions`, `events`: the conditions of a run; robots that fail and join
- `perception`, `communication`: observations under these conditions, and messages of the robots
- `random_streams`: random numbers for noise, loss and failures
"""

from robocov.conditions.conditions import (
    FAILING,
    LOSS,
    PARAMETERS,
    POSITION,
    SCANNING,
    SENSING,
    TIME_TOLERANCE_S,
    UNITS,
    Conditions,
)
from robocov.conditions.events import Failure, Join, JoinedRobot, parse_event

__all__ = [
    "FAILING",
    "LOSS",
    "PARAMETERS",
    "POSITION",
    "SCANNING",
    "SENSING",
    "TIME_TOLERANCE_S",
    "UNITS",
    "Conditions",
    "Failure",
    "Join",
    "JoinedRobot",
    "parse_event",
]
