"""Inspected items: a robot, a pane, and the point under the cursor."""

from dataclasses import dataclass

from robocov.environment import Point


@dataclass
class Inspection:
    """Robot, pane and point that the user inspects.

    Attributes
    ----------
    selected : int or None
        Number of the selected robot, which may have been removed in the meantime.
    active_pane : int
        Index of the pane whose controller and gains are edited.
    cursor : Point or None
        Point of the map under the cursor, m.
    cursor_pane : int
        Index of the pane under the cursor.
    """

    selected: int | None = None
    active_pane: int = 0
    cursor: Point | None = None
    cursor_pane: int = 0
