"""The base of the editor's tools: what the mouse does on the map. Coordinates are metres."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import MapError
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Owner, Sketch
from robocov_app.editor.tools.handles import Handle
from robocov_app.editor.tools.snap_targets import Snapper
from robocov_app.editor.tools.snapping import Guide, Snap, Snapping

ANGLE = 15.0  # degrees: with Shift, lines are drawn at multiples of this


@dataclass(frozen=True)
class PointerEvent:
    """Where the mouse points, and what is held down with it."""

    point: Point  # m; after snapping
    raw: Point  # m
    reach: float  # m; so many metres a finger is wide
    shift: bool = False
    alt: bool = False
    ctrl: bool = False


@dataclass(frozen=True)
class Preview:
    """What a tool shows of what it is about to do."""

    line: tuple[Point, ...] = ()  # m, points; drawn as a line with a mark at each point
    closed: bool = False  # whether it goes back to its first point
    lengths: bool = False  # whether each edge tells its length
    shapes: tuple[Obstacle, ...] = ()  # drawn as they would be
    start: StartSpec | None = None  # drawn as it would be
    box: tuple[Point, Point] | None = None  # two opposite corners; what is being selected
    touched: bool = False  # the box takes all that it touches, not only what lies in it
    words: str = ""  # beside the cursor
    rings: tuple[Ring, ...] = ()  # m; drawn as outlines
    dots: tuple[Point, ...] = ()  # m; drawn as marks
    chosen: int | None = None  # which of these stands out


class ToolContext(Protocol):
    """What tools ask of the editor that they work in, and what they tell it."""

    grid: float
    snap_angle: float
    snaps: set[str]
    snapper: Snapper
    pixel: float
    wall_width: float

    @property
    def sketch(self) -> Sketch: ...

    @property
    def selection(self) -> Selection: ...

    @property
    def handles(self) -> tuple[Handle, ...]: ...

    @property
    def handled(self) -> tuple[Owner, ...]: ...

    def snapping(self, reach: float) -> Snapping: ...

    def snapped(
        self, raw: Point, reach: float, origin: Point | None = None, more: tuple[Point, ...] = ()
    ) -> Snap: ...

    def change(self, change: Change) -> None: ...

    def select(self, selection: Selection) -> None: ...

    def say(self, words: str) -> None: ...


class Tool:
    """A tool that does nothing; the others are like it."""

    name = ""
    title = ""
    hint = ""  # what to do next
    snaps = True  # whether the point that it gets has snapped to something
    takes_numbers = True  # whether numbers can be typed while it is `busy`
    begins_typed = False  # whether they can be typed before, too

    def __init__(self) -> None:
        self.guides: tuple[Guide, ...] = ()

    @property
    def busy(self) -> bool:
        """Whether something is half done."""
        return False

    @property
    def origin(self) -> Point | None:
        """Where the line that is drawn comes from."""
        return None

    @property
    def drawn(self) -> tuple[Point, ...]:
        """What has been drawn so far, to snap to."""
        return ()

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Take a press of the left button."""

    def twice(self, context: ToolContext, event: PointerEvent) -> None:
        """Take the second press of a double click; by default it finishes."""
        self.finish(context)

    def move(self, context: ToolContext, event: PointerEvent) -> None:
        """Take a move of the mouse, pressed or not."""

    def release(self, context: ToolContext, event: PointerEvent, *, clicked: bool) -> None:
        """Take the button's release; `clicked` if it has not moved since it was pressed."""

    def finish(self, context: ToolContext) -> bool:
        """Take Enter; return whether there was something to finish."""
        return False

    def back(self, context: ToolContext) -> bool:
        """Take Backspace: the last point goes; return whether there was one."""
        return False

    def cancel(self, context: ToolContext) -> bool:
        """Take Escape; return whether there was something to give up."""
        return False

    def enter(self, context: ToolContext, text: str) -> None:
        """Take what was typed; MapError when it means nothing."""
        raise MapError(f"“{text}”: there is nothing to type here")

    def preview(self, context: ToolContext) -> Preview | None:
        """Return what to show."""
        return None

    def shape_of_cursor(self, context: ToolContext) -> str:
        """Return what the cursor looks like over the map: arrow, cross, hand, move, ..."""
        return "cross"


def at_round_angle(origin: Point, point: Point) -> Point:
    """Return the point on the nearest line at a multiple of `ANGLE` degrees through another.

    >>> at_round_angle((0.0, 0.0), (3.0, 0.1))
    (3.0, 0.0)
    """
    dx, dy = point[0] - origin[0], point[1] - origin[1]
    step = np.radians(ANGLE)
    angle = step * np.round(np.arctan2(dy, dx) / step)
    along = dx * np.cos(angle) + dy * np.sin(angle)
    x, y = origin[0] + along * np.cos(angle), origin[1] + along * np.sin(angle)
    return round(float(x), 9) + 0.0, round(float(y), 9) + 0.0


def constrained_point(event: PointerEvent, origin: Point | None) -> Point:
    """Return where a point goes: with Shift on a line at a round angle from where the line comes from."""
    if event.shift and origin is not None:
        return at_round_angle(origin, event.raw)
    return event.point


def ring_area(points: Sequence[Point]) -> float:
    """Return the area of a ring, m².

    >>> ring_area([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)])
    2.0
    """
    x, y = np.asarray(points).T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2)


def bearing_words(a: Point, b: Point) -> str:
    """Return length and direction from one point to another, in words.

    >>> bearing_words((0.0, 0.0), (0.0, 2.4))
    '2.40 m  ∠ 90°'
    """
    angle = float(np.degrees(np.arctan2(b[1] - a[1], b[0] - a[0])))
    shown = 0.0 if abs(angle) < 0.05 else angle
    return f"{length_words(distance(a, b))}  ∠ {shown:.1f}".removesuffix(".0") + "°"


def length_words(metres: float) -> str:
    """Return a length as it stands beside the cursor.

    >>> length_words(0.0234), length_words(12.3456), length_words(1234.5)
    ('2.3 cm', '12.35 m', '1234.5 m')
    """
    if metres < 0.1:
        return f"{100 * metres:.1f} cm"
    return f"{metres:.2f} m" if metres < 1000 else f"{metres:.1f} m"


def place_words(point: Point) -> str:
    """Return a place in words.

    >>> place_words((1.0, -0.001))
    '(1.00, 0.00) m'
    """
    x, y = (round(value, 2) + 0.0 for value in point)
    return f"({x:.2f}, {y:.2f}) m"
