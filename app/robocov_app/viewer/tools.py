"""Tools: what the mouse does on the canvas, and how walls that are drawn snap to others. Meters."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from math import dist
from time import perf_counter
from typing import ClassVar

import numpy as np
import shapely

from robocov.environment import Environment, Obstacle, Point, Ring
from robocov.errors import RobocovError
from robocov_app.toolkit.draw_tools import SAME, Outline
from robocov_app.viewer.session import map_edits
from robocov_app.viewer.session.passages import describe_passage_changes
from robocov_app.viewer.session.session import Session, toggle_failure

SNAPS_WITHIN = 0.6  # part of a finger's width within which corners and walls draw what is drawn
WALL_WIDTH = 0.1  # of drawn walls, m
_SPACING = 0.25  # radii from one dab of the brush to the next
_PAUSE = 0.08  # seconds between two times that the robots get to know of what is being painted
_RING = 48  # corners of the circle that shows the brush's size


@dataclass(frozen=True)
class Preview:
    """Preview of a tool's next action: a `line` with marks, the obstacle, words beside the last point."""

    line: tuple[Point, ...] = ()
    closed: bool = False
    obstacle: Obstacle | None = None
    words: str = ""
    marks: bool = True


class Tool:
    """Mouse tool; this one does nothing. Returned words are told.

    `press`: of the left button; `reach` is so many meters as a finger is wide, `number` the robot under the
    cursor. `move`: pressed or not. `finish`: Enter, a double or a right click. `cancel`: Escape; says whether
    there was something to give up.
    """

    name = title = hint = ""
    painting = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        return None

    def move(self, session: Session, point: Point) -> None:
        pass

    def release(self, session: Session, point: Point) -> str | None:
        return None

    def finish(self, session: Session) -> str | None:
        return None

    def cancel(self, session: Session) -> bool:
        return False

    def preview(self, session: Session) -> Preview | None:
        return None

    def widen(self, session: Session, factor: float) -> str:
        return ""


def edited(session: Session, environment: Environment, words: str) -> str:
    """Put a new map in place; return what to tell. StartError when there is no room for a robot any more."""
    before, radius = (
        session.displayed.environment,
        session.displayed.get_setup(session.timeline.panes[0]).team.radius,
    )
    gone = set(before.starts) - set(environment.starts)
    if pushed := session.edit_map(environment, words):
        words += f"; {pushed} robot{'s' if pushed > 1 else ''} pushed out of the way"
    if gone:
        words += f"; it covers the start{'s' if len(gone) > 1 else ''} {', '.join(sorted(gone))}"
    robots = session.displayed.get_positions(session.timeline.panes[0])
    return "; ".join(
        filter(None, [words, describe_passage_changes(before, environment, float(radius.min()), robots)])
    )


@dataclass
class Hand(Tool):
    """Drags and throws robots, and moves obstacles; `selected` is the robot that is asked about."""

    name, title = "hand", "Hand"
    hint = "drag a robot or an obstacle; click a robot to ask it; drag the floor to pan"
    selected: int | None = None
    robot: int | None = None
    obstacle: int | None = None
    _from: Point = (0.0, 0.0)
    _at: Point = (0.0, 0.0)
    _taken: tuple[Obstacle, ...] = ()
    _drags: bool = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._from, self._at, self._drags = point, point, False
        self.robot, self._taken = number, session.displayed.environment.obstacles
        self.obstacle = (
            None if number is not None else map_edits.find_obstacle(session.displayed.environment, point)
        )
        self.selected = self.selected if number is None else number
        return None

    @property
    def holds(self) -> bool:
        return self.robot is not None or self.obstacle is not None

    def move(self, session: Session, point: Point) -> None:
        self._at = point
        self._drags = self._drags or dist(self._from, point) > 0.02  # a click is no pull
        # meanwhile it may have been taken out
        if (
            self.robot is not None
            and self._drags
            and self.robot in session.displayed.get_setup(session.timeline.panes[0]).all_numbers
        ):
            session.drag_robot(self.robot, point)

    def release(self, session: Session, point: Point) -> str | None:
        self._at = point
        robot, dragged = self.robot, self._dragged(session)
        self.robot = self.obstacle = None
        if robot is not None:
            session.release()
        if dragged is None:
            return None
        k, moved = dragged
        words = f"{map_edits.describe_obstacle(moved)} moved"
        return edited(
            session, map_edits.replace_obstacles(session.displayed.environment, k, 1, [moved]), words
        )

    def cancel(self, session: Session) -> bool:
        if not self.holds:
            asked, self.selected = self.selected, None
            return asked is not None
        self.robot = self.obstacle = None
        session.release()
        return True

    def preview(self, session: Session) -> Preview | None:
        if (dragged := self._dragged(session)) is None:
            return None
        return Preview((self._from, self._at), False, dragged[1], f"{dist(self._from, self._at):.2f} m")

    def _dragged(self, session: Session) -> tuple[int, Obstacle] | None:
        there, k, (dx, dy) = (
            session.displayed.environment.obstacles,
            self.obstacle,
            np.subtract(self._at, self._from),
        )
        # meanwhile there may be another map
        if k is None or there[k : k + 1] != self._taken[k : k + 1] or np.hypot(dx, dy) < 1e-3:
            return None
        return k, map_edits.move_obstacle(there[k], float(dx), float(dy))


def snapped(environment: Environment, point: Point, reach: float) -> Point:
    """Return the corner within `reach` m of a point, else the nearest place on a wall, else the point."""
    walls, corners = environment.free.boundary, shapely.get_coordinates(environment.free.boundary)
    away = np.hypot(*(corners - point).T)
    if len(away) and away.min() <= reach:
        x, y = corners[away.argmin()].tolist()
        return x, y
    line = shapely.shortest_line(walls, shapely.Point(point))
    if line is None or line.length > reach:
        return point
    x, y = shapely.get_coordinates(line)[0].tolist()
    return x, y


@dataclass
class Polygon(Tool):
    """Draws a polygon, corner by corner."""

    name, title = "polygon", "Polygon"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"
    outline: Outline = field(default_factory=lambda: Outline(least=3, closes=True), repr=False)
    _reach: float = 0.0
    _same: ClassVar[float] = 0.0  # part of a finger's width from the last point within which a press ends it

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._reach, same = reach, max(SAME, self._same * reach)
        ended = self.outline.press(self._snapped(session, point), point, reach, same)
        return self.finish(session) if ended else None

    def move(self, session: Session, point: Point) -> None:
        self.outline.at = self._snapped(session, point) if self.outline.points else point

    def release(self, session: Session, point: Point) -> str | None:
        if not self.outline.release(self._snapped(session, point), point, self._reach):
            return None
        self.outline.points.append(self.outline.at)
        return self.finish(session)

    def finish(self, session: Session) -> str | None:
        corners = self.outline.take()
        return _drawn(session, self._made(corners), self.name) if corners else None

    def cancel(self, session: Session) -> bool:
        return self.outline.cancel()

    def preview(self, session: Session) -> Preview | None:
        points = (*self.outline.points, self.outline.at)
        words = f"{dist(*points[-2:]):.2f} m" if len(points) > 1 else ""
        return Preview(points, len(points) > 2, None, words) if words else None

    def _snapped(self, session: Session, point: Point) -> Point:
        return snapped(session.displayed.environment, point, SNAPS_WITHIN * self._reach)

    def _made(self, corners: list[Point]) -> Obstacle:
        return map_edits.build_polygon(corners)


@dataclass
class Wall(Polygon):
    """Draws a wall, point by point."""

    name, title = "wall", "Wall"
    hint = "drag, or click its points, Enter or a double click ends it; [ and ] change its width"
    outline: Outline = field(default_factory=lambda: Outline(drags=True), repr=False)
    width: float = WALL_WIDTH
    _same = 0.3

    def widen(self, session: Session, factor: float) -> str:
        self.width = float(np.clip(round(self.width * factor, 3), 0.02, 5.0))
        return f"walls are {self.width:g} m wide"

    def preview(self, session: Session) -> Preview | None:
        if (drawn := super().preview(session)) is None:
            return None
        wall, words = None, f"{drawn.words}, {self.width:g} m wide"
        with suppress(RobocovError):
            wall = self._made(list(drawn.line))
        return Preview(drawn.line, False, wall, words)

    def _made(self, corners: list[Point]) -> Obstacle:
        return map_edits.build_wall(corners, self.width)


@dataclass
class Ruler(Tool):
    """Measures."""

    name, title = "ruler", "Ruler"
    hint = "drag from one place to another"
    _from: Point | None = None
    _at: Point = (0.0, 0.0)
    _pressed: bool = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._from, self._at, self._pressed = point, point, True
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
        dx, dy = np.subtract(self._at, self._from)
        words = f"{np.hypot(dx, dy):.2f} m  (Δx {dx:.2f}, Δy {dy:.2f})"
        return Preview((self._from, self._at), False, None, words)


@dataclass
class Circle(Ruler):
    """Draws a round pillar from its middle."""

    name, title = "circle", "Circle"
    hint = "drag from the middle to the rim"

    def release(self, session: Session, point: Point) -> str | None:
        middle, self._from = self._from, None
        return None if middle is None else _drawn(session, map_edits.build_circle(middle, point), "circle")

    def preview(self, session: Session) -> Preview | None:
        if self._from is None:
            return None
        circle, line = None, (self._from, self._at)
        with suppress(RobocovError):
            circle = map_edits.build_circle(*line)
        return Preview(line, False, circle, f"radius {dist(*line):.2f} m")


def _drawn(session: Session, obstacle: Obstacle, name: str) -> str:
    return edited(session, map_edits.add_obstacle(session.displayed.environment, obstacle), f"{name} drawn")


@dataclass
class Brush(Tool):
    """Paints the density: the left button raises it, the right one lowers it."""

    name, title = "brush", "Brush"
    hint = "paint where more is needed; the right button takes away; the wheel, [ and ] change the size"
    radius: float | None = None  # m, None until it is first needed: then a tenth of the map
    lowers: bool = False  # what a press does
    clock: Callable[[], float] = field(default=perf_counter, repr=False)
    painting: bool = False  # whether a stroke has begun and not yet ended
    _dabs: list[Point] = field(default_factory=list, repr=False)
    _stroke: int = 0
    _boundary: Ring = ()
    _at: Point | None = None
    _shown: float = -1e9

    def size(self, session: Session) -> float:
        if self.radius is None:
            self.radius = float(f"{0.1 * session.displayed.environment.region.diameter:.2g}")
        return self.radius

    def widen(self, session: Session, factor: float) -> str:
        whole = session.displayed.environment.region.diameter
        self.radius = float(f"{np.clip(self.size(session) * factor, whole / 200, whole / 2):.3g}")
        return f"the brush has a radius of {self.radius:g} m"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self.painting, self._at, self._dabs = True, point, [point]
        self._boundary = session.displayed.environment.boundary
        self._stroke += 1
        self._show(session)
        return None

    def move(self, session: Session, point: Point) -> None:
        if not self.painting or self._at is None:
            self._at = point
            return
        if session.displayed.environment.boundary != self._boundary:
            self.painting = False  # meanwhile there is another map
            return
        spacing, begin = _SPACING * self.size(session), self._at
        away = dist(begin, point)
        for k in range(1, int(away / spacing) + 1):
            x, y = (round(a + k * spacing / away * (b - a), 4) for a, b in zip(begin, point, strict=True))
            self._at = x, y
            self._dabs.append(self._at)
        if self._dabs and self.clock() - self._shown >= _PAUSE:
            self._show(session)

    def release(self, session: Session, point: Point) -> str | None:
        if self.painting:
            self.move(session, point)
        if not self.painting:
            return None
        self.painting = False
        if self._dabs:
            self._show(session)
        return "density lowered" if self.lowers else "density raised"

    def cancel(self, session: Session) -> bool:
        painting, self.painting, self._at = self.painting, False, None
        if painting:
            session.undo()
        return painting

    def preview(self, session: Session) -> Preview | None:
        if self._at is None:
            return None
        turn, radius = np.linspace(0.0, 2.0 * np.pi, _RING + 1), self.size(session)
        x, y = self._at[0] + radius * np.cos(turn), self._at[1] + radius * np.sin(turn)
        outline, density = (
            tuple(zip(x.tolist(), y.tolist(), strict=True)),
            session.displayed.environment.density,
        )
        value = 1.0 if density is None else float(density.evaluate(np.array([self._at]))[0])
        return Preview(outline, False, None, f"φ {value:.2g}", marks=False)

    def _show(self, session: Session) -> None:
        dabs, self._dabs = tuple(self._dabs), []
        session.paint(dabs, self.size(session), lowers=self.lowers, stroke=self._stroke)
        self._shown = self.clock()


@dataclass
class Click(Tool):
    """Does something at a place, or to the robot there."""

    name: str
    title: str
    hint: str
    does: Callable[[Session, Point, float, int | None], str | None] = field(kw_only=True)

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        return self.does(session, point, reach, number)


def _erase(session: Session, point: Point, reach: float, number: int | None) -> str | None:
    if number is not None:
        session.remove_robot(number)
        return f"robot {number} taken out"
    index = map_edits.find_obstacle(session.displayed.environment, point, 0.5 * reach)
    if index is None:
        return None
    words = f"{map_edits.describe_obstacle(session.displayed.environment.obstacles[index])} deleted"
    return edited(session, map_edits.replace_obstacles(session.displayed.environment, index, 1), words)


def _add(session: Session, point: Point, reach: float, number: int | None) -> str:
    return f"robot {session.add_robot(point)} joined"


def _fail(session: Session, point: Point, reach: float, number: int | None) -> str | None:
    return None if number is None else toggle_failure(session, number)


def toolbox() -> dict[str, Tool]:
    erase = Click("eraser", "Delete", "click an obstacle or a robot to delete it", does=_erase)
    join = Click("robot", "Join", "click where a robot is to join", does=_add)
    hint = "click a robot to let it fail; click it again to revive it"
    fail = Click("failure", "Failure", hint, does=_fail)
    tools = Hand(), Polygon(), Wall(), Circle(), Brush(), erase, join, fail, Ruler()
    return {tool.name: tool for tool in tools}
