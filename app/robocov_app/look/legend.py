"""Legends: the names of what pictures show, and one legend for several pictures."""

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import TypeVar

CELL_CENTROID = "cell centroid"
CONTACT = "contact"
FAILED_ROBOT = "failed robot"
FINAL_POSITION = "final position"
FINAL_VORONOI_CELL = "final Voronoi cell"
GEODESIC_BORDER = "geodesic cell border"
GOAL = "goal"
KNOWN_REGION = "known region"
MOVING_OBSTACLE = "moving obstacle and its path"
OBSTACLE = "obstacle"
UNREACHED = "unreachable"
UNKNOWN_OBSTACLE = "obstacle (unknown to robots)"
ROBOT = "robot"
START = "start"
TRAJECTORY = "trajectory"

_Entry = TypeVar("_Entry")


def merge_legends(legends: Iterable[Sequence[_Entry]], key: Callable[[_Entry], Hashable]) -> list[_Entry]:
    """Merge the legends of several pictures into one.

    Parameters
    ----------
    legends : iterable of sequences
        Entries of each picture.
    key : callable
        Returns a value that is the same for equal entries, such as their text.

    Returns
    -------
    list
        Each entry once, in the order of the first legend. An entry that earlier legends lack is inserted
        after the entry that precedes it in its own legend.

    Examples
    --------
    >>> merge_legends([["start", "goal"], ["start", "trajectory", "goal"]], str)
    ['start', 'trajectory', 'goal']
    """
    merged: list[_Entry] = []
    for legend in legends:
        keys = [key(entry) for entry in merged]
        position = 0
        for entry in legend:
            entry_key = key(entry)
            if entry_key in keys:
                position = keys.index(entry_key)
            else:
                merged.insert(position, entry)
                keys.insert(position, entry_key)
            position += 1
    return merged
