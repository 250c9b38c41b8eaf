"""Tools: what the mouse does in the arena. Plain classes; coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np

from robocov.errors import RobocovError
from robocov_app.demo.editing import (
    circle_of,
    moved,
    obstacle_at,
    polygon_of,
    wall_of,
    with_moved,
    with_obstacle,
    without_obstacle,
    words_for,
)

if TYPE_CHECKING:
    from robocov.environment import Environment, Obstacle
    from robocov_app.demo.session import Session

Point: TypeAlias = tuple[float, float]

WALL_WIDTH = 0.1
"""Width of drawn walls in metres."""


@dataclass(frozen=True)
class Preview:
    """What a tool shows of what it is about to do.

    Attributes
    ----------
    line : points, m
        Drawn as a line, with a mark at each.
    closed : bool
    obstacle : Obstacle or None
        Drawn as it would be.
    words : str
        Beside the last point.
    """

    line: tuple[Point, ...] = ()
    closed: bool = False
    obstacle: Obstacle | None = None
    words: str = ""


class Tool(Protocol):
    """What the mouse does."""

    name: str
    title: str
    hint: str

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Take a press of the left button; return what to tell.

        `reach` is so many metres as a finger is wide; `number` the robot under the cursor.
        """

    def move(self, session: Session, point: Point) -> None:
        """Take a move of the mouse, pressed or not."""

    def release(self, session: Session, point: Point) -> str | None:
        """Take the button's release; return what to tell."""

    def finish(self, session: Session) -> str | None:
        """Take Enter, a double or a right click; return what to tell."""

    def cancel(self, session: Session) -> bool:
        """Take Escape; say whether there was something to give up."""

    def preview(self, session: Session) -> Preview | None:
        """Return what to show."""


@dataclass
class Base:
    """A tool that does nothing."""

    name: str = ""
    title: str = ""
    hint: str = ""

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Do nothing."""
        return None

    def move(self, session: Session, point: Point) -> None:
        """Do nothing."""

    def release(self, session: Session, point: Point) -> str | None:
        """Do nothing."""
        return None

    def finish(self, session: Session) -> str | None:
        """Do nothing."""
        return None

    def cancel(self, session: Session) -> bool:
        """There is nothing to give up."""
        return False

    def preview(self, session: Session) -> Preview | None:
        """There is nothing to show."""
        return None


@dataclass
class Hand(Base):
    """Drags and throws robots, and moves obstacles."""

    name: str = "hand"
    title: str = "Hand"
    hint: str = "drag a robot or an obstacle; click a robot to ask it; drag the floor to pan"
    selected: int | None = None
    robot: int | None = None
    obstacle: int | None = None
    _from: Point = (0.0, 0.0)
    _at: Point = (0.0, 0.0)

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Take hold of what is under the cursor; a robot before an obstacle."""
        self._from = self._at = point
        self.robot, self.obstacle = number, None
        if number is not None:
            self.selected = number
        else:
            self.obstacle = obstacle_at(session.environment, point)
        return None

    @property
    def holds(self) -> bool:
        """Whether it holds something; if not, dragging pans."""
        return self.robot is not None or self.obstacle is not None

    def move(self, session: Session, point: Point) -> None:
        """Drag."""
        self._at = point
        # a click is no pull
        far = np.hypot(point[0] - self._from[0], point[1] - self._from[1]) > 0.02
        if self.robot is not None and self.robot in session.numbers and (far or session.hand is not None):
            session.grab(self.robot, point)

    def release(self, session: Session, point: Point) -> str | None:
        """Let go: what was swung flies on, an obstacle is put down."""
        self._at = point
        robot, obstacle = self.robot, self.obstacle
        self.robot = self.obstacle = None
        if robot is not None:
            session.release()
            return None
        if obstacle is None or obstacle >= len(session.environment.obstacles):
            return None
        dx, dy = self._by()
        if np.hypot(dx, dy) < 1e-3:
            return None
        words = f"{words_for(session.environment.obstacles[obstacle])} moved"
        return _edited(session, with_moved(session.environment, obstacle, dx, dy), words)

    def cancel(self, session: Session) -> bool:
        """Let go without moving anything; then forget the selection."""
        if self.holds:
            self.robot = self.obstacle = None
            session.release()
            return True
        if self.selected is not None:
            self.selected = None
            return True
        return False

    def preview(self, session: Session) -> Preview | None:
        """Show where the obstacle would go."""
        if self.obstacle is None or self.obstacle >= len(session.environment.obstacles):
            return None
        dx, dy = self._by()
        if np.hypot(dx, dy) < 1e-3:
            return None
        shape = moved(session.environment.obstacles[self.obstacle], dx, dy)
        return Preview((self._from, self._at), False, shape, f"{np.hypot(dx, dy):.2f} m")

    def _by(self) -> tuple[float, float]:
        return self._at[0] - self._from[0], self._at[1] - self._from[1]


@dataclass
class Polygon(Base):
    """Draws a polygon, corner by corner."""

    name: str = "polygon"
    title: str = "Polygon"
    hint: str = "click the corners; Enter, a double click or a click on the first corner closes it"
    _corners: list[Point] = field(default_factory=list)
    _at: Point = (0.0, 0.0)

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Add a corner, or close the outline at its first."""
        self._at = point
        if len(self._corners) >= 3 and _apart(point, self._corners[0]) < reach:
            return self.finish(session)
        if not self._corners or _apart(point, self._corners[-1]) > 1e-6:
            self._corners.append(point)
        return None

    def move(self, session: Session, point: Point) -> None:
        """Show the next edge."""
        self._at = point

    def finish(self, session: Session) -> str | None:
        """Put the polygon down."""
        corners, self._corners = self._corners, []
        if not corners:
            return None
        return _edited(session, with_obstacle(session.environment, polygon_of(corners)), "polygon drawn")

    def cancel(self, session: Session) -> bool:
        """Give the outline up."""
        had, self._corners = bool(self._corners), []
        return had

    def preview(self, session: Session) -> Preview | None:
        """Show the outline so far."""
        if not self._corners:
            return None
        points = (*self._corners, self._at)
        return Preview(points, len(points) > 2, None, f"{_apart(points[-1], points[-2]):.2f} m")


@dataclass
class Wall(Polygon):
    """Draws a wall, point by point."""

    name: str = "wall"
    title: str = "Wall"
    hint: str = "click its points; Enter or a double click ends it; [ and ] change its width"
    width: float = WALL_WIDTH

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Add a point, or end at the last one."""
        self._at = point
        if len(self._corners) >= 2 and _apart(point, self._corners[-1]) < 0.3 * reach:
            return self.finish(session)
        if not self._corners or _apart(point, self._corners[-1]) > 1e-6:
            self._corners.append(point)
        return None

    def finish(self, session: Session) -> str | None:
        """Put the wall down."""
        points, self._corners = self._corners, []
        if not points:
            return None
        wall = wall_of(points, self.width)
        return _edited(session, with_obstacle(session.environment, wall), "wall drawn")

    def preview(self, session: Session) -> Preview | None:
        """Show the wall so far."""
        if not self._corners:
            return None
        points = (*self._corners, self._at)
        try:
            shape = wall_of(list(points), self.width)
        except RobocovError:
            shape = None
        words = f"{_apart(points[-1], points[-2]):.2f} m, {self.width:g} m wide"
        return Preview(points, False, shape, words)

    def widen(self, factor: float) -> None:
        """Draw wider walls, or narrower ones."""
        self.width = float(np.clip(round(self.width * factor, 3), 0.02, 5.0))


@dataclass
class Circle(Base):
    """Draws a round pillar from its middle."""

    name: str = "circle"
    title: str = "Circle"
    hint: str = "drag from the middle to the rim"
    _middle: Point | None = None
    _at: Point = (0.0, 0.0)

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Begin at the middle."""
        self._middle = self._at = point
        return None

    def move(self, session: Session, point: Point) -> None:
        """Show the rim."""
        self._at = point

    def release(self, session: Session, point: Point) -> str | None:
        """Put the pillar down."""
        middle, self._middle = self._middle, None
        if middle is None:
            return None
        circle = circle_of(middle, point)
        return _edited(session, with_obstacle(session.environment, circle), "circle drawn")

    def cancel(self, session: Session) -> bool:
        """Give it up."""
        had, self._middle = self._middle is not None, None
        return had

    def preview(self, session: Session) -> Preview | None:
        """Show the pillar."""
        if self._middle is None:
            return None
        try:
            shape: Obstacle | None = circle_of(self._middle, self._at)
        except RobocovError:
            shape = None
        return Preview(
            (self._middle, self._at), False, shape, f"radius {_apart(self._middle, self._at):.2f} m"
        )


@dataclass
class Eraser(Base):
    """Deletes obstacles and takes robots out."""

    name: str = "eraser"
    title: str = "Delete"
    hint: str = "click an obstacle or a robot to delete it"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Delete what is under the cursor; a robot before an obstacle."""
        if number is not None:
            session.remove_robot(number)
            return f"robot {number} taken out"
        index = obstacle_at(session.environment, point, 0.5 * reach)
        if index is None:
            return None
        words = f"{words_for(session.environment.obstacles[index])} deleted"
        return _edited(session, without_obstacle(session.environment, index), words)


@dataclass
class Adder(Base):
    """Lets robots join."""

    name: str = "robot"
    title: str = "Robot"
    hint: str = "click where a robot is to join"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Let a robot join."""
        return f"robot {session.add_robot(point)} joined"


@dataclass
class Failer(Base):
    """Lets robots fail, and work again."""

    name: str = "failure"
    title: str = "Failure"
    hint: str = "click a robot to let it fail; click it again to revive it"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Let the robot fail, or work again."""
        if number is None:
            return None
        if number in session.circumstances(session.lanes[0]).failed:
            session.revive_robot(number)
            return f"robot {number} works again"
        session.fail_robot(number)
        return f"robot {number} failed"


@dataclass
class Ruler(Base):
    """Measures."""

    name: str = "ruler"
    title: str = "Ruler"
    hint: str = "drag from one place to another"
    _from: Point | None = None
    _at: Point = (0.0, 0.0)
    _pressed: bool = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Begin to measure."""
        self._from = self._at = point
        self._pressed = True
        return None

    def move(self, session: Session, point: Point) -> None:
        """Measure to here."""
        if self._pressed:
            self._at = point

    def release(self, session: Session, point: Point) -> str | None:
        """Leave the ruler there."""
        self._pressed = False
        return None

    def cancel(self, session: Session) -> bool:
        """Put the ruler away."""
        had, self._from = self._from is not None, None
        return had

    def preview(self, session: Session) -> Preview | None:
        """Show the length."""
        if self._from is None:
            return None
        dx, dy = self._at[0] - self._from[0], self._at[1] - self._from[1]
        length = float(np.hypot(dx, dy))
        return Preview((self._from, self._at), False, None, f"{length:.2f} m  (Δx {dx:.2f}, Δy {dy:.2f})")


def toolbox() -> dict[str, Tool]:
    """Return one of each tool by name, in the order in which they are shown."""
    tools: list[Tool] = [Hand(), Polygon(), Wall(), Circle(), Eraser(), Adder(), Failer(), Ruler()]
    return {tool.name: tool for tool in tools}


def _edited(session: Session, environment: Environment, words: str) -> str:
    """Put a new map in place; return what to tell."""
    gone = set(session.environment.starts) - set(environment.starts)
    pushed = session.edit(environment, words)
    if pushed:
        words += f"; {pushed} robot{'s' if pushed > 1 else ''} pushed out of the way"
    if gone:
        words += f"; it covers the start{'s' if len(gone) > 1 else ''} {', '.join(sorted(gone))}"
    return words


def _apart(a: Point, b: Point) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))
