"""Tools: base class of the mouse tools for a map, their events and their overlays."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist
from typing import Any, Generic, Literal, TypeAlias, TypeVar

from robocov_app.toolkit.tools.geometry import Point, constrain_angle

CursorShape: TypeAlias = Literal["arrow", "cross", "hand", "move", "sideways", "updown", "rising", "falling"]
"""Shape of the mouse cursor; "rising" and "falling" are arrows along the diagonals."""

MOVED_FRACTION = 0.25
"""Fraction of the pointer's reach; moves of at least this length are deliberate."""


@dataclass(frozen=True)
class PointerEvent:
    """Position of the pointer, and the modifier keys held down with it.

    Attributes
    ----------
    point : (x, y), m
        Position after snapping.
    unsnapped_point : (x, y), m
        Position before snapping.
    reach : float, m
        Distance within which the pointer grabs an object.
    shift, alt, ctrl : bool
        Whether the key is held down.
    """

    point: Point
    unsnapped_point: Point
    reach: float
    shift: bool = False
    alt: bool = False
    ctrl: bool = False

    def constrain(self, origin: Point | None) -> Point:
        """Return the snapped point; with Shift, the nearest point at a round angle from `origin`."""
        if self.shift and origin is not None:
            return constrain_angle(origin, self.unsnapped_point)
        return self.point

    def has_moved_from(self, position: Point) -> bool:
        """Return whether the pointer has moved deliberately since it was pressed at a position, m."""
        return dist(position, self.unsnapped_point) >= MOVED_FRACTION * self.reach


@dataclass(frozen=True)
class ToolOverlay:
    """The overlay of a tool on the map.

    Attributes
    ----------
    line : tuple of (x, y), m
        Points of a line with a mark at each.
    is_closed : bool
        Whether the line returns to its first point.
    label : str
        Text next to the line, or to the cursor.
    """

    line: tuple[Point, ...] = ()
    is_closed: bool = False
    label: str = ""


ContextT = TypeVar("ContextT")
EventT = TypeVar("EventT", bound=PointerEvent)


class Tool(Generic[ContextT, EventT]):
    """A tool that does nothing: base class of the tools of both windows.

    Every method gets the context on which the tool acts: the session of the viewer, or the map and selection
    of the editor. If a method returns a string, it is shown as a message.

    Attributes
    ----------
    name : str
        Unique name, as in the command ``tool:name``.
    title : str
        Name in the window.
    key : str
        Key that selects the tool.
    hint : str
        Short instructions, shown when the tool is selected.
    snaps : bool
        Whether pointer positions are snapped before the tool gets them.
    """

    name = ""
    title = ""
    key = ""
    hint = ""
    snaps = False

    @property
    def is_busy(self) -> bool:
        """Whether an action has been started but not completed."""
        return False

    def press(self, context: ContextT, event: EventT) -> str | None:
        """Handle a press of the button; return a message or None."""
        return None

    def double_click(self, context: ContextT, event: EventT) -> str | None:
        """Handle the second press of a double click; by default like any other press."""
        return self.press(context, event)

    def move(self, context: ContextT, event: EventT) -> None:
        """Handle a move of the pointer, with or without a button held down."""

    def release(self, context: ContextT, event: EventT, *, is_click: bool) -> str | None:
        """Handle the release of the button; `is_click` if the pointer has not moved since the press."""
        return None

    def finish(self, context: ContextT) -> str | None:
        """Complete the current drawing, on Enter or a right click; return a message or None."""
        return None

    def cancel(self, context: ContextT) -> bool:
        """Cancel the action in progress, as Escape does; return whether there was one."""
        return False

    def build_overlay(self, context: ContextT) -> ToolOverlay:
        """Return the overlay that the tool shows on the map."""
        return ToolOverlay()

    def choose_cursor(self, context: ContextT) -> CursorShape:
        """Return the shape of the cursor over the map."""
        return "cross"


ToolT = TypeVar("ToolT", bound=Tool[Any, Any])


class Toolbox(Generic[ToolT]):
    """The tools of a window, and the one in use.

    Parameters
    ----------
    *groups : sequence of Tool
        The tools in the order of the tool rail, which separates the groups. The first tool is in use until
        another one is chosen.

    Attributes
    ----------
    groups : tuple of sequence of Tool
        The groups.
    by_name : dict of str to Tool
        The tools by their names.
    current : Tool
        The tool in use.
    """

    def __init__(self, *groups: Sequence[ToolT]) -> None:
        self.groups = groups
        self.by_name = {tool.name: tool for group in groups for tool in group}
        self.current: ToolT = next(iter(self.by_name.values()))
