"""What a tool is: what the mouse does in the arena. Coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from robocov_app.viewer.session.map_edits import passage_words

if TYPE_CHECKING:
    from robocov.environment import Environment, Obstacle
    from robocov_app.viewer.session.session import Session

Point: TypeAlias = tuple[float, float]


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
    marks : bool
        Whether each point of the line has one.
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
    """Put a new map in place; return what to tell.

    Raises
    ------
    StartError
        When there is no room for a robot any more.
    """
    before, radius = session.environment, session.circumstances(session.lanes[0]).team.radius
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
