"""The base of the tools, the workspace that they know, and handles of what is selected; all in metres."""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import MapError
from robocov_app.editor.edits.transform import bounds_of, box_of
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.geometry import Box, at_round_angle, distance, middle_of
from robocov_app.editor.model.selection import Change, Selection, Vertex, points_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch
from robocov_app.editor.tools.snapping import SNAPS, Dragged, Guide, Snap, Snapper, Snapping, snapped
from robocov_app.render.surface_cache import Latest

Kind: TypeAlias = Literal["vertex", "scale", "turn"]
BESIDE = 11.0  # pixels at scale 1 between what is selected and the box around it
KNOB = 24.0  # pixels at scale 1 that the knob is above the box
SNAPS_WITHIN = 0.6  # part of a finger's width: a line that is far off is not to beat the grid
ROOMY = 34.0  # pixels at scale 1 that a side of the box has at least when there is a handle in its middle
SMALL = 26.0  # pixels at scale 1 of a thing below which its vertices are no handles: it is to be dragged
MOST_VERTICES = 4000  # vertices that are shown at most: more could not be told apart


@dataclass(frozen=True)
class Handle:
    """Something that can be taken hold of."""

    kind: Kind  # ``vertex``, ``scale`` or ``turn``
    at: Point  # m; where it is shown
    vertex: Vertex | None = None
    side: tuple[int, int] = (0, 0)  # (x, y); of a handle that scales: -1, 0 or 1 along each axis


def handled(selection: Selection) -> tuple[Owner, ...]:
    """Return whose vertices are shown: of the one thing that is selected, or of selected vertices."""
    owners = selection.owners | {vertex.of for vertex in selection.vertices}
    return tuple(sorted(owners, key=str)) if selection.vertices or len(owners) == 1 else ()


def frame_of(sketch: Sketch, selection: Selection, pixel: float) -> Box | None:
    """Return the box that is shown around whole things; `pixel` is how many metres one is at scale 1."""
    bounds = None if selection.vertices else bounds_of(sketch, selection)
    if bounds is None:
        return None
    far = BESIDE * pixel
    return bounds[0] - far, bounds[1] - far, bounds[2] + far, bounds[3] + far


def handles(sketch: Sketch, selection: Selection, pixel: float) -> tuple[Handle, ...]:
    found: list[Handle] = []
    if (frame := frame_of(sketch, selection, pixel)) is not None:
        low_x, low_y, high_x, high_y = frame
        columns = (-1, 0, 1) if high_x - low_x > ROOMY * pixel else (-1, 1)
        rows = (-1, 0, 1) if high_y - low_y > ROOMY * pixel else (-1, 1)
        sides = [(x, y) for x in columns for y in rows if x or y]
        found += [Handle("scale", side_of(frame, side), side=side) for side in sides]
        found.append(Handle("turn", (middle_of(frame)[0], high_y + KNOB * pixel)))
    for owner in handled(selection):
        box = None if owner == BOUNDARY or selection.vertices else box_of(sketch, owner)
        if box is None or max(box[2] - box[0], box[3] - box[1]) >= SMALL * pixel:
            found += [Handle("vertex", at, vertex) for vertex, at in points_of(sketch, owner)[:MOST_VERTICES]]
    return tuple(found)


def side_of(box: Box, side: tuple[int, int]) -> Point:
    """Return a corner of a box, or the middle of a side: -1, 0 or 1 along each axis."""
    (low_x, low_y, high_x, high_y), (x, y) = box, side
    return (low_x + high_x + x * (high_x - low_x)) / 2, (low_y + high_y + y * (high_y - low_y)) / 2


def handle_at(found: tuple[Handle, ...], point: Point, reach: float) -> Handle | None:
    """Return the handle within `reach` metres of a point: the nearest, a vertex before others."""
    near = [handle for handle in found if distance(handle.at, point) <= reach]
    return min(near, key=lambda each: (each.kind != "vertex", distance(each.at, point)), default=None)


@dataclass(frozen=True)
class PointerEvent:
    """Pointer position, and the modifier keys held with it."""

    point: Point  # m; after snapping
    raw: Point  # m
    reach: float  # m; so many metres a finger is wide
    shift: bool = False
    alt: bool = False
    ctrl: bool = False

    def is_apart_from(self, place: Point) -> bool:
        """Return whether the hand that pressed there has moved on purpose."""
        return distance(place, self.raw) >= 0.25 * self.reach

    def constrained(self, origin: Point | None) -> Point:
        """Return where a point goes: with Shift on a line at a round angle from where the line comes from."""
        return at_round_angle(origin, self.raw) if self.shift and origin is not None else self.point


@dataclass(frozen=True)
class Preview:
    """Preview of a tool's next action."""

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


class Workspace:
    """The map that is open, what is selected of it, and what it snaps to: what tools know of the editor."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.version = 0  # grows whenever panel and sheet have to look again at what there is
        self.snaps = set(SNAPS)
        self.grid, self.snap_angle, self.wall_width = 0.1, 15.0, 0.1
        self.pixel = 0.01  # m; what a pixel at scale 1 is on the sheet
        self.snapper = Snapper()
        self.message, self.trouble = "", False  # what was said last, empty when it is old
        self.now = self.said = 0.0
        self._handles: Latest[tuple[Handle, ...]] = Latest()

    @property
    def sketch(self) -> Sketch:
        return self.document.history.sketch

    @property
    def selection(self) -> Selection:
        return self.document.history.selection

    @property
    def handled(self) -> tuple[Owner, ...]:
        return handled(self.selection)

    @property
    def handles(self) -> tuple[Handle, ...]:
        sketch, look = self.sketch, (self.selection, self.pixel)
        return self._handles.of(sketch, look, lambda: handles(sketch, *look))

    def snapping(self, reach: float) -> Snapping:
        kinds = frozenset(kind for name in self.snaps for kind in SNAPS[name][1])
        return Snapping(SNAPS_WITHIN * reach, self.grid, self.snap_angle, kinds)

    def snapped(
        self, raw: Point, reach: float, origin: Point | None = None, more: Ring = (), without: Dragged = ()
    ) -> Snap:
        targets = self.snapper.targets(self.sketch, without, more)
        return Snap(raw) if targets is None else snapped(raw, targets, self.snapping(reach), origin)

    def change(self, change: Change, *, drag: Hashable | None = None) -> None:
        if self.document.history.do(change, drag=drag):
            self.say(change.words)
        self._changed()

    def _changed(self) -> None:
        self.version += 1

    def select(self, selection: Selection) -> None:
        if selection != self.selection:
            self.document.history.selection = selection
            self.version += 1

    def say(self, words: str, *, trouble: bool = False) -> None:
        if words:
            self.message, self.trouble, self.said = words, trouble, self.now


class Tool:
    """A tool that does nothing; the others are like it."""

    name = title = ""  # the title is the name where there is no other
    hint = ""  # what to do next
    snaps = True  # whether the point that it gets has snapped to something
    takes_numbers = True  # whether numbers can be typed while it is `busy`
    begins_typed = False  # whether they can be typed before, too

    def __init__(self) -> None:
        self.title = self.title or self.name.capitalize()
        self.guides: tuple[Guide, ...] = ()
        self.begun: PointerEvent | None = None  # where the button was pressed that is held down
        self.clicked: list[Point] = []  # m; points of something that is half done
        self.at: Point = (0.0, 0.0)  # m; where the cursor is
        self.change: Change | None = None  # what letting go of the mouse would make

    @property
    def busy(self) -> bool:
        return self.begun is not None or bool(self.clicked)

    @property
    def origin(self) -> Point | None:
        """Last point of the line that is being drawn."""
        return None

    @property
    def drawn(self) -> tuple[Point, ...]:
        """Points drawn so far, to snap to."""
        return ()

    def press(self, context: Workspace, event: PointerEvent) -> None:
        self.begun, self.change = event, None

    def twice(self, context: Workspace, event: PointerEvent) -> None:
        self.press(context, event)

    def move(self, context: Workspace, event: PointerEvent) -> None:
        self.at = event.point

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        """Take the button's release; `clicked` if it has not moved since it was pressed."""

    def finish(self, context: Workspace) -> bool:
        """Take Enter; return whether there was something to finish."""
        return False

    def back(self, context: Workspace) -> bool:
        """Take Backspace: the last point goes; return whether there was one."""
        return bool(self.clicked and self.clicked.pop())

    def cancel(self, context: Workspace) -> bool:
        """Take Escape; return whether there was something to give up."""
        had, self.begun, self.change, self.clicked = self.busy, None, None, []
        return had

    def enter(self, context: Workspace, text: str) -> None:
        """Take what was typed; MapError when it means nothing."""
        raise MapError(f"“{text}”: there is nothing to type here")

    def preview(self, context: Workspace) -> Preview | None:
        return None

    def shape_of_cursor(self, context: Workspace) -> str:
        """Return what the cursor looks like over the map: arrow, cross, hand, move, ..."""
        return "cross"
