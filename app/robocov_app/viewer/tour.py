"""The guided tour: the paper's story in three and a half minutes, played on the desk. Knows no pygame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robocov.mapfile import load_map
from robocov_app.viewer.session.scenario import Law, Limits

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov_app.viewer.presenter import Desk

_PLAIN = frozenset(
    {
        *(
            "cells",
            "grid",
            "obstacles",
            "boundary",
            "trajectories",
            "starts",
            "robots",
            "failed",
            "selection",
        ),
        *("colour_bar", "legend", "scale_bar", "status", "caption"),
    }
)


@dataclass(frozen=True)
class Chapter:
    """A scene of the tour.

    Attributes
    ----------
    title : str
    text : str
        Two sentences.
    seconds : float
        Of the clock on the wall.
    map, start : str
    laws : tuple of Law
    speed : float
    also : names of layers
        Shown besides the plain ones.
    asks : int or None
        The robot that is asked about.
    then : dict of seconds to function of the desk
        What happens meanwhile.
    """

    title: str
    text: str
    seconds: float
    map: str
    start: str
    laws: tuple[Law, ...]
    speed: float = 2.0
    also: frozenset[str] = frozenset()
    asks: int | None = None
    then: dict[float, Callable[[Desk], None]] = field(default_factory=dict)


def _again_from(start: str) -> Callable[[Desk], None]:
    def go(desk: Desk) -> None:
        desk.session.restart(start=start)

    return go


def _branch_with(pane_laws: tuple[Law, ...]) -> Callable[[Desk], None]:
    def go(desk: Desk) -> None:
        session = desk.session
        session.look_at(1.0)
        for lane, law in zip(session.lanes, pane_laws, strict=True):
            session.set_law(lane, law)
        session.playing = True

    return go


def _fail(number: int) -> Callable[[Desk], None]:
    def go(desk: Desk) -> None:
        desk.session.fail_robot(number)

    return go


_RAPF, _RPF, _LLOYD, _ATLAS = (Law(name) for name in ("rapf", "rpf", "lloyd", "atlas"))

CHAPTERS: tuple[Chapter, ...] = (
    Chapter(
        "Robots that know almost nothing",
        "Each robot knows itself, the robots it hears and the one nearest point of an obstacle; the map is "
        "unknown to all of them. RAPF pushes it off what is near and draws it to the centroid of its "
        "Voronoi cell: that is all, and it spreads the team through the rooms.",
        22.0,
        "rooms",
        "corridor",
        (_RAPF,),
        1.0,
        frozenset({"centroids", "force_attraction", "force_repulsion_robots", "force_repulsion_obstacle"}),
        then={15.0: lambda desk: desk.set_speed(4.0)},
    ),
    Chapter(
        "Without obstacles: the same as Lloyd",
        "In a convex region without obstacles RAPF ends where Lloyd's algorithm ends, each robot on the "
        "centroid of its cell. The two curves of the cost below lie on top of each other.",
        18.0,
        "square",
        "corner",
        (_RAPF, _LLOYD),
        1.5,
        frozenset({"centroids"}),
    ),
    Chapter(
        "With obstacles Lloyd gets stuck",
        "Now there are walls that nobody knows, and Lloyd's robots head straight for centroids that lie "
        "behind them. They stop at the wall, while part of the building stays far from every robot.",
        22.0,
        "rooms",
        "kitchen",
        (_LLOYD,),
        2.0,
        frozenset({"goals", "centroids", "distances"}),
    ),
    Chapter(
        "Repulsion alone stops too early",
        "RPF only pushes robots apart and off the walls. Once the pushes balance it hovers, trembling, in a "
        "local minimum, often before it has left the room in which it began.",
        18.0,
        "rooms",
        "kitchen",
        (_RPF,),
        3.0,
        frozenset({"force_repulsion_robots", "force_repulsion_obstacle", "distances"}),
    ),
    Chapter(
        "Both together get through",
        "RAPF adds the two: the attraction pulls through the doors, the repulsion keeps robots off the "
        "walls and slides them along. From the same starts its cost falls below both of the others.",
        24.0,
        "rooms",
        "kitchen",
        (_RAPF, _RPF, _LLOYD),
        2.0,
    ),
    Chapter(
        "Other starts",
        "From the corridor instead of the kitchen RPF ends with quite another cost. RAPF depends less on "
        "where it starts, though not so little that it would not matter.",
        22.0,
        "rooms",
        "kitchen",
        (_RAPF, _RPF),
        3.0,
        then={12.0: _again_from("corridor")},
    ),
    Chapter(
        "Other gains",
        "Back to the first second, and on with ten times the repulsion: the dashed ghosts are what would "
        "have come without. RPF ends elsewhere; RAPF changes less, but change it does.",
        22.0,
        "rooms",
        "corridor",
        (_RAPF, _RPF),
        3.0,
        then={11.0: _branch_with((Law("rapf", {"k_rep": 3.0}), Law("rpf", {"k_rep": 30.0})))},
    ),
    Chapter(
        "A robot fails",
        "A robot stops and is not heard any more; the others see it as an obstacle like any other. Nobody "
        "is told: their cells grow over the gap, and they move in.",
        18.0,
        "museum",
        "hall",
        (_RAPF,),
        2.0,
        frozenset({"centroids"}),
        then={9.0: _fail(2)},
    ),
    Chapter(
        "Where RAPF fails",
        "Inside this trap the centroid lies behind the wall, so that attraction and repulsion balance: the "
        "robot rests, far from its goal, and would rest for ever. Who knows only the nearest point of the "
        "wall cannot tell which way round it is.",
        18.0,
        "trap",
        "inside",
        (_RAPF,),
        2.0,
        frozenset({"centroids", "goals", "force_attraction", "force_repulsion_obstacle"}),
        asks=6,
    ),
    Chapter(
        "Who remembers gets round",
        "Atlas has the same sensor and is told no more, but every robot keeps what it has seen in a map of "
        "its own, here that of robot 3. It plans on it where the whole team should be, and walks out of the "
        "trap; what that takes is memory, and some computing.",
        20.0,
        "trap",
        "inside",
        (_RAPF, _ATLAS),
        2.0,
        frozenset({"goals", "sensed"}),
        asks=3,
    ),
)
"""The chapters in their order."""


class Tour:
    """Plays the chapters on a desk, and gives it back as it was.

    Parameters
    ----------
    desk : Desk
    fit : callable
        Shows the whole map.
    chapters : tuple of Chapter
    """

    def __init__(self, desk: Desk, fit: Callable[[], None], chapters: tuple[Chapter, ...] = CHAPTERS) -> None:
        self._desk, self._fit, self._chapters = desk, fit, chapters
        self._kept = desk.shown, desk.session.clock.speed
        self._number = -1
        self._passed = 0.0
        self._left: list[tuple[float, Callable[[Desk], None]]] = []
        self.done = False
        self._next()

    @property
    def chapter(self) -> Chapter:
        """The chapter that is played."""
        return self._chapters[self._number]

    @property
    def title(self) -> str:
        """Its title with its number."""
        return f"{self._number + 1}  {self.chapter.title}"

    @property
    def text(self) -> str:
        """Its two sentences."""
        return self.chapter.text

    @property
    def progress(self) -> float:
        """How much of the whole tour is over, 0 to 1."""
        before = sum(chapter.seconds for chapter in self._chapters[: self._number])
        return (before + self._passed) / self.seconds

    @property
    def seconds(self) -> float:
        """How long the whole tour is, s."""
        return sum(chapter.seconds for chapter in self._chapters)

    def advance(self, seconds: float) -> None:
        """Let so many seconds pass."""
        if self.done:
            return
        self._passed += seconds
        while self._left and self._left[0][0] <= self._passed:
            _, action = self._left.pop(0)
            self._desk.attempt(lambda action=action: action(self._desk))  # type: ignore[misc]
        if self._passed >= self.chapter.seconds:
            self._next()

    def skip(self, by: int) -> None:
        """Go to the next chapter, or back to the one before."""
        self._number = max(self._number + by, 0) - 1
        self._next()

    @property
    def chapters(self) -> tuple[str, ...]:
        """The titles of all chapters."""
        return tuple(chapter.title for chapter in self._chapters)

    @property
    def number(self) -> int:
        """Which of them is played, from 0."""
        return self._number

    def end(self) -> None:
        """End the tour; what it shows stays, how it is shown is again as before."""
        self._desk.shown, self._desk.session.clock.speed = self._kept
        self._desk.version += 1
        self.done = True

    def _next(self) -> None:
        self._number += 1
        if self._number >= len(self._chapters):
            self._number -= 1
            self.end()
            return
        chapter, desk = self.chapter, self._desk
        self._passed = 0.0
        self._left = sorted(chapter.then.items())
        desk.tool = desk.hand
        desk.hand.selected = chapter.asks
        desk.active = 0
        desk.session.restart(
            environment=load_map(chapter.map),
            laws=chapter.laws,
            start=chapter.start,
            robots=6,
            seed=0,
            limits=Limits(),  # what was set before might not fit, and would tell another story
        )
        desk.map_name = chapter.map
        desk.session.playing, desk.session.stop_when_settled = True, False
        desk.session.clock.speed = chapter.speed
        desk.shown = set(_PLAIN | chapter.also)
        desk.message = ""
        desk.version += 1
        desk.look_at_map()
        self._fit()
