"""Tools: what the mouse does on the canvas. Coordinates are metres."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from robocov.environment import Environment, Obstacle, Point, Ring
from robocov.errors import RobocovError
from robocov_app.toolkit.draw_tools import SAME, Outline
from robocov_app.viewer.session.map_edits import (
    circle_of,
    moved,
    obstacle_at,
    passage_words,
    polygon_of,
    snapped,
    wall_of,
    with_moved,
    with_obstacle,
    without_obstacle,
    words_for,
)
from robocov_app.viewer.session.session import Session

SNAPS_WITHIN = 0.6  # part of a finger's width within which corners and walls draw what is drawn
WALL_WIDTH = 0.1  # of drawn walls, m

_SPACING = 0.25  # radii from one dab of the brush to the next
_PAUSE = 0.08  # seconds between two times that the robots get to know of what is being painted
_RING = 48  # corners of the circle that shows the brush's size


@dataclass(frozen=True)
class Preview:
    """What a tool shows of what it is about to do.

    A `line`, with a mark at each point, the obstacle as it would be, and words beside the last point.
    """

    line: tuple[Point, ...] = ()
    closed: bool = False
    obstacle: Obstacle | None = None
    words: str = ""
    marks: bool = True


@dataclass
class Tool:
    """What the mouse does; this one does nothing."""

    name: str = ""
    title: str = ""
    hint: str = ""

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Take a press of the left button; return what to tell.

        `reach` is so many metres as a finger is wide; `number` the robot under the cursor.
        """
        return None

    def move(self, session: Session, point: Point) -> None:
        """Take a move of the mouse, pressed or not."""

    def release(self, session: Session, point: Point) -> str | None:
        """Take the button's release; return what to tell."""
        return None

    def finish(self, session: Session) -> str | None:
        """Take Enter, a double or a right click; return what to tell."""
        return None

    def cancel(self, session: Session) -> bool:
        """Take Escape; say whether there was something to give up."""
        return False

    def preview(self, session: Session) -> Preview | None:
        """Return what to show."""
        return None


def edited(session: Session, environment: Environment, words: str) -> str:
    """Put a new map in place; return what to tell. StartError when there is no room for a robot any more."""
    before, radius = session.environment, session.setup(session.panes[0]).team.radius
    gone = set(before.starts) - set(environment.starts)
    pushed = session.edit(environment, words)
    if pushed:
        words += f"; {pushed} robot{'s' if pushed > 1 else ''} pushed out of the way"
    if gone:
        words += f"; it covers the start{'s' if len(gone) > 1 else ''} {', '.join(sorted(gone))}"
    return "; ".join(filter(None, [words, passage_words(before, environment, float(radius.min()))]))


def apart(a: Point, b: Point) -> float:
    """Return the distance of two points, m."""
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


@dataclass
class Hand(Tool):
    """Drags and throws robots, and moves obstacles."""

    name: str = "hand"
    title: str = "Hand"
    hint: str = "drag a robot or an obstacle; click a robot to ask it; drag the floor to pan"
    selected: int | None = None
    robot: int | None = None
    obstacle: int | None = None
    _from: Point = (0.0, 0.0)
    _at: Point = (0.0, 0.0)
    _taken: Obstacle | None = None
    _drags: bool = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._from, self._at, self._drags = point, point, False
        self.robot, self.obstacle = number, None
        if number is not None:
            self.selected = number
            return None
        self.obstacle = obstacle_at(session.environment, point)
        if self.obstacle is not None:
            self._taken = session.environment.obstacles[self.obstacle]
        return None

    @property
    def holds(self) -> bool:
        """Whether it holds something; if not, dragging pans."""
        return self.robot is not None or self.obstacle is not None

    def move(self, session: Session, point: Point) -> None:
        self._at = point
        # a click is no pull
        self._drags = self._drags or bool(np.hypot(*self._by()) > 0.02)
        if self.robot is None or not self._drags:
            return
        # meanwhile it may have been taken out
        if self.robot in {*session.numbers, *session.setup(session.panes[0]).failed}:
            session.grab(self.robot, point)

    def release(self, session: Session, point: Point) -> str | None:
        self._at = point
        robot, obstacle = self.robot, self._dragged(session)
        self.robot = self.obstacle = None
        if robot is not None:
            session.release()
            return None
        if obstacle is None:
            return None
        words = f"{words_for(session.environment.obstacles[obstacle])} moved"
        return edited(session, with_moved(session.environment, obstacle, *self._by()), words)

    def cancel(self, session: Session) -> bool:
        something = self.holds or self.selected is not None
        if self.holds:
            self.robot = self.obstacle = None
            session.release()
        else:
            self.selected = None
        return something

    def preview(self, session: Session) -> Preview | None:
        obstacle = self._dragged(session)
        if obstacle is None:
            return None
        dx, dy = self._by()
        shape = moved(session.environment.obstacles[obstacle], dx, dy)
        return Preview((self._from, self._at), False, shape, f"{np.hypot(dx, dy):.2f} m")

    def _dragged(self, session: Session) -> int | None:
        """Return the number of the obstacle that is dragged somewhere; meanwhile there may be another map."""
        there = session.environment.obstacles
        if self.obstacle is None or self.obstacle >= len(there) or there[self.obstacle] != self._taken:
            return None
        return self.obstacle if np.hypot(*self._by()) >= 1e-3 else None

    def _by(self) -> tuple[float, float]:
        return self._at[0] - self._from[0], self._at[1] - self._from[1]


@dataclass
class Polygon(Tool):
    """Draws a polygon, corner by corner."""

    name: str = "polygon"
    title: str = "Polygon"
    hint: str = "click the corners; Enter, a double click or a click on the first corner closes it"
    outline: Outline = field(default_factory=lambda: Outline(least=3, closes=True), repr=False)
    _reach: float = 0.0

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._reach = reach
        ended = self.outline.press(self._snapped(session, point), point, reach, self._same(reach))
        return self.finish(session) if ended else None

    def move(self, session: Session, point: Point) -> None:
        self.outline.at = self._snapped(session, point) if self.outline.points else point

    def release(self, session: Session, point: Point) -> str | None:
        if self.outline.release(self._snapped(session, point), point, self._reach):
            self.outline.points.append(self.outline.at)
            return self.finish(session)
        return None

    def finish(self, session: Session) -> str | None:
        corners = self.outline.take()
        if not corners:
            return None
        return edited(session, with_obstacle(session.environment, self._made(corners)), f"{self.name} drawn")

    def cancel(self, session: Session) -> bool:
        return self.outline.cancel()

    def preview(self, session: Session) -> Preview | None:
        if not self.outline.points:
            return None
        points = (*self.outline.points, self.outline.at)
        return Preview(points, len(points) > 2, None, f"{apart(points[-1], points[-2]):.2f} m")

    def _snapped(self, session: Session, point: Point) -> Point:
        return snapped(session.environment, point, SNAPS_WITHIN * self._reach)

    def _same(self, reach: float) -> float:
        """Return how near to the last point a press ends it, m."""
        return SAME

    def _made(self, corners: list[Point]) -> Obstacle:
        return polygon_of(corners)


@dataclass
class Wall(Polygon):
    """Draws a wall, point by point."""

    name: str = "wall"
    title: str = "Wall"
    hint: str = "drag, or click its points, Enter or a double click ends it; [ and ] change its width"
    outline: Outline = field(default_factory=lambda: Outline(drags=True), repr=False)
    width: float = WALL_WIDTH

    def preview(self, session: Session) -> Preview | None:
        if not self.outline.points:
            return None
        points = (*self.outline.points, self.outline.at)
        words = f"{apart(points[-1], points[-2]):.2f} m, {self.width:g} m wide"
        wall = None
        with suppress(RobocovError):
            wall = self._made(list(points))
        return Preview(points, False, wall, words)

    def widen(self, factor: float) -> None:
        """Draw wider walls, or narrower ones."""
        self.width = float(np.clip(round(self.width * factor, 3), 0.02, 5.0))

    def _same(self, reach: float) -> float:
        return 0.3 * reach

    def _made(self, corners: list[Point]) -> Obstacle:
        return wall_of(corners, self.width)


@dataclass
class Ruler(Tool):
    """Measures."""

    name: str = "ruler"
    title: str = "Ruler"
    hint: str = "drag from one place to another"
    _from: Point | None = None
    _at: Point = (0.0, 0.0)
    _pressed: bool = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._from = self._at = point
        self._pressed = True
        return None

    def move(self, session: Session, point: Point) -> None:
        if self._pressed:
            self._at = point

    def release(self, session: Session, point: Point) -> str | None:
        self._pressed = False
        return None

    def cancel(self, session: Session) -> bool:
        had, self._from = self._from is not None, None
        return had

    def preview(self, session: Session) -> Preview | None:
        if self._from is None:
            return None
        dx, dy = self._at[0] - self._from[0], self._at[1] - self._from[1]
        words = f"{np.hypot(dx, dy):.2f} m  (Δx {dx:.2f}, Δy {dy:.2f})"
        return Preview((self._from, self._at), False, None, words)


@dataclass
class Circle(Ruler):
    """Draws a round pillar from its middle."""

    name: str = "circle"
    title: str = "Circle"
    hint: str = "drag from the middle to the rim"

    def release(self, session: Session, point: Point) -> str | None:
        middle, self._from = self._from, None
        if middle is None:
            return None
        circle = circle_of(middle, point)
        return edited(session, with_obstacle(session.environment, circle), "circle drawn")

    def preview(self, session: Session) -> Preview | None:
        if self._from is None:
            return None
        words = f"radius {apart(self._from, self._at):.2f} m"
        circle = None
        with suppress(RobocovError):
            circle = circle_of(self._from, self._at)
        return Preview((self._from, self._at), False, circle, words)


@dataclass
class Brush(Tool):
    """Paints the density: the left button raises it, the right one lowers it.

    `radius` is None until it is first needed: then a tenth of the map. `lowers`: what a press does.
    """

    name: str = "brush"
    title: str = "Brush"
    hint: str = "paint where more is needed; the right button takes away; the wheel, [ and ] change the size"
    radius: float | None = None
    lowers: bool = False
    clock: Callable[[], float] = field(default=perf_counter, repr=False)
    _dabs: list[Point] = field(default_factory=list, repr=False)
    _stroke: int = 0
    _painting: bool = False
    _boundary: Ring = ()
    _at: Point | None = None
    _shown: float = -1e9

    @property
    def painting(self) -> bool:
        """Whether a stroke has begun and not yet ended."""
        return self._painting

    def size(self, session: Session) -> float:
        """Return the radius, m."""
        if self.radius is None:
            self.radius = float(f"{0.1 * session.environment.region.diameter:.2g}")
        return self.radius

    def widen(self, session: Session, factor: float) -> str:
        """Take a larger brush, or a smaller one; return what to tell."""
        whole = session.environment.region.diameter
        self.radius = float(f"{np.clip(self.size(session) * factor, whole / 200, whole / 2):.3g}")
        return f"the brush has a radius of {self.radius:g} m"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._painting, self._at, self._shown = True, point, -1e9
        self._boundary = session.environment.boundary
        self._stroke += 1
        self._dabs = [point]
        self._show(session)
        return None

    def move(self, session: Session, point: Point) -> None:
        if not self._painting or self._at is None:
            self._at = point
            return
        if session.environment.boundary != self._boundary:
            self._painting = False  # meanwhile there is another map
            return
        spacing = _SPACING * self.size(session)
        count, begin = int(apart(self._at, point) / spacing), self._at
        for k in range(1, count + 1):
            part = k * spacing / apart(begin, point)
            x, y = (round(a + part * (b - a), 4) for a, b in zip(begin, point, strict=True))
            self._dabs.append((x, y))
            self._at = x, y
        if self._dabs and self.clock() - self._shown >= _PAUSE:
            self._show(session)

    def release(self, session: Session, point: Point) -> str | None:
        if self._painting:
            self.move(session, point)
        painting, self._painting = self._painting, False
        if not painting:
            return None
        if self._dabs:
            self._show(session)
        return "density lowered" if self.lowers else "density raised"

    def cancel(self, session: Session) -> bool:
        painting, self._painting, self._at = self._painting, False, None
        if painting:
            session.undo()
        return painting

    def preview(self, session: Session) -> Preview | None:
        if self._at is None:
            return None
        turn = np.linspace(0.0, 2.0 * np.pi, _RING + 1)
        radius = self.size(session)
        x, y = self._at[0] + radius * np.cos(turn), self._at[1] + radius * np.sin(turn)
        outline = tuple(zip(x.tolist(), y.tolist(), strict=True))
        density = session.environment.density
        value = 1.0 if density is None else float(density.value(np.array([self._at]))[0])
        return Preview(outline, False, None, f"φ {value:.2g}", marks=False)

    def _show(self, session: Session) -> None:
        """Let the robots know of it."""
        dabs, self._dabs = tuple(self._dabs), []
        session.paint(dabs, self.size(session), lowers=self.lowers, stroke=self._stroke)
        self._shown = self.clock()


@dataclass
class Click(Tool):
    """Does something at a place, or to the robot there; returns what to tell."""

    does: Callable[[Session, Point, float, int | None], str | None] = lambda *_: None

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        return self.does(session, point, reach, number)


def _erase(session: Session, point: Point, reach: float, number: int | None) -> str | None:
    if number is not None:
        session.remove_robot(number)
        return f"robot {number} taken out"
    index = obstacle_at(session.environment, point, 0.5 * reach)
    if index is None:
        return None
    words = f"{words_for(session.environment.obstacles[index])} deleted"
    return edited(session, without_obstacle(session.environment, index), words)


def _add(session: Session, point: Point, reach: float, number: int | None) -> str:
    return f"robot {session.add_robot(point)} joined"


def _fail(session: Session, point: Point, reach: float, number: int | None) -> str | None:
    if number is None:
        return None
    if number in session.setup(session.panes[0]).failed:
        session.revive_robot(number)
        return f"robot {number} works again"
    session.fail_robot(number)
    return f"robot {number} failed"


def toolbox() -> dict[str, Tool]:
    """Return one of each tool by name, in the order in which they are shown."""
    fails = "click a robot to let it fail; click it again to revive it"
    tools: list[Tool] = [
        *(Hand(), Polygon(), Wall(), Circle(), Brush()),
        Click("eraser", "Delete", "click an obstacle or a robot to delete it", _erase),
        Click("robot", "Robot", "click where a robot is to join", _add),
        Click("failure", "Failure", fails, _fail),
        Ruler(),
    ]
    return {tool.name: tool for tool in tools}
