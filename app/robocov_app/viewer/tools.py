"""Tools: what the mouse does in the arena. Coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import RobocovError
from robocov_app.viewer.brush import Brush
from robocov_app.viewer.session.map_edits import (
    circle_of,
    moved,
    obstacle_at,
    polygon_of,
    snapped,
    wall_of,
    with_moved,
    with_obstacle,
    without_obstacle,
    words_for,
)
from robocov_app.viewer.tool import Point, Preview, Tool, apart, edited

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Obstacle
    from robocov_app.viewer.session.session import Session

SNAPS_WITHIN = 0.6
"""Part of a finger's width within which corners and walls draw what is drawn."""

WALL_WIDTH = 0.1
"""Width of drawn walls in metres."""


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
        if self.robot in {*session.numbers, *session.circumstances(session.lanes[0]).failed}:
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
        if self.holds:
            self.robot = self.obstacle = None
            session.release()
            return True
        if self.selected is not None:
            self.selected = None
            return True
        return False

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
    _corners: list[Point] = field(default_factory=list)
    _at: Point = (0.0, 0.0)
    _reach: float = 0.0

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        if self._ends(point, reach):
            return self.finish(session)
        self._reach = SNAPS_WITHIN * reach
        self._at = point = snapped(session.environment, point, self._reach)
        if not self._corners or apart(point, self._corners[-1]) > 1e-6:
            self._corners.append(point)
        return None

    def move(self, session: Session, point: Point) -> None:
        self._at = snapped(session.environment, point, self._reach) if self._corners else point

    def finish(self, session: Session) -> str | None:
        corners, self._corners = self._corners, []
        if not corners:
            return None
        return edited(session, with_obstacle(session.environment, self._made(corners)), f"{self.name} drawn")

    def cancel(self, session: Session) -> bool:
        had, self._corners = bool(self._corners), []
        return had

    def preview(self, session: Session) -> Preview | None:
        if not self._corners:
            return None
        points = (*self._corners, self._at)
        return Preview(points, len(points) > 2, None, f"{apart(points[-1], points[-2]):.2f} m")

    def _ends(self, point: Point, reach: float) -> bool:
        """Whether a click there ends it: on the first corner."""
        return len(self._corners) >= 3 and apart(point, self._corners[0]) < reach

    def _made(self, corners: list[Point]) -> Obstacle:
        return polygon_of(corners)


@dataclass
class Wall(Polygon):
    """Draws a wall, point by point."""

    name: str = "wall"
    title: str = "Wall"
    hint: str = "click its points; Enter or a double click ends it; [ and ] change its width"
    width: float = WALL_WIDTH

    def preview(self, session: Session) -> Preview | None:
        if not self._corners:
            return None
        points = (*self._corners, self._at)
        words = f"{apart(points[-1], points[-2]):.2f} m, {self.width:g} m wide"
        return Preview(points, False, _tried(self._made, list(points)), words)

    def widen(self, factor: float) -> None:
        """Draw wider walls, or narrower ones."""
        self.width = float(np.clip(round(self.width * factor, 3), 0.02, 5.0))

    def _ends(self, point: Point, reach: float) -> bool:
        """Whether a click there ends it: on the last point."""
        return len(self._corners) >= 2 and apart(point, self._corners[-1]) < 0.3 * reach

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
        return Preview((self._from, self._at), False, _tried(circle_of, self._from, self._at), words)


def _tried(make: Callable[..., Obstacle], *args: object) -> Obstacle | None:
    """Return an obstacle, None where it cannot be."""
    try:
        return make(*args)
    except RobocovError:
        return None


@dataclass
class Eraser(Tool):
    """Deletes obstacles and takes robots out."""

    name: str = "eraser"
    title: str = "Delete"
    hint: str = "click an obstacle or a robot to delete it"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        if number is not None:
            session.remove_robot(number)
            return f"robot {number} taken out"
        index = obstacle_at(session.environment, point, 0.5 * reach)
        if index is None:
            return None
        words = f"{words_for(session.environment.obstacles[index])} deleted"
        return edited(session, without_obstacle(session.environment, index), words)


@dataclass
class Adder(Tool):
    """Lets robots join."""

    name: str = "robot"
    title: str = "Robot"
    hint: str = "click where a robot is to join"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        return f"robot {session.add_robot(point)} joined"


@dataclass
class Failer(Tool):
    """Lets robots fail, and work again."""

    name: str = "failure"
    title: str = "Failure"
    hint: str = "click a robot to let it fail; click it again to revive it"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        if number is None:
            return None
        if number in session.circumstances(session.lanes[0]).failed:
            session.revive_robot(number)
            return f"robot {number} works again"
        session.fail_robot(number)
        return f"robot {number} failed"


def toolbox() -> dict[str, Tool]:
    """Return one of each tool by name, in the order in which they are shown."""
    tools: list[Tool] = [
        *(Hand(), Polygon(), Wall(), Circle(), Brush(), Eraser(), Adder(), Failer(), Ruler())
    ]
    return {tool.name: tool for tool in tools}
