"""Tools: what the mouse does in the arena. Plain classes; coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.demo.brush import Brush
from robocov_app.demo.drawing import WALL_WIDTH, Circle, Polygon, Wall
from robocov_app.demo.editing import moved, obstacle_at, with_moved, without_obstacle, words_for
from robocov_app.demo.tool import Base, Point, Preview, Tool, edited

if TYPE_CHECKING:
    from robocov.environment import Obstacle
    from robocov_app.demo.session import Session

__all__ = [
    "WALL_WIDTH",
    "Adder",
    "Base",
    "Brush",
    "Circle",
    "Eraser",
    "Failer",
    "Hand",
    "Point",
    "Polygon",
    "Preview",
    "Ruler",
    "Tool",
    "Wall",
    "toolbox",
]


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
    _taken: Obstacle | None = None
    _drags: bool = False

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Take hold of what is under the cursor; a robot before an obstacle."""
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
        """Drag."""
        self._at = point
        # a click is no pull
        self._drags = self._drags or bool(np.hypot(*self._by()) > 0.02)
        if self.robot is None or not self._drags:
            return
        # meanwhile it may have been taken out
        if self.robot in {*session.numbers, *session.circumstances(session.lanes[0]).failed}:
            session.grab(self.robot, point)

    def release(self, session: Session, point: Point) -> str | None:
        """Let go: what was swung flies on, an obstacle is put down."""
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
        return edited(session, without_obstacle(session.environment, index), words)


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
    tools: list[Tool] = [
        *(Hand(), Polygon(), Wall(), Circle(), Brush(), Eraser(), Adder(), Failer(), Ruler())
    ]
    return {tool.name: tool for tool in tools}
