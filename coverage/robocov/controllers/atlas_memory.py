"""What robots under `Atlas` remember: their maps, plans and ways, all of it immutable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.planning.discovered import DiscoveredMap
from robocov.planning.placement import Table
from robocov.planning.wayfinding import Ways
from robocov.robots import Team

STILL_WITHIN = 0.1
"""Metres that a robot must get away to count as moving."""


@dataclass(frozen=True, eq=False)
class RestTracker:
    """Since when each robot that is heard has been where it is.

    Attributes
    ----------
    robots : (k,)
    places : (k, 2) m
    since : (k,) s
    """

    robots: IntArray
    places: Array
    since: Array

    def goes_on(self, robots: IntArray, places: Array, time: float) -> RestTracker:
        """Return the watch after one more look."""
        at, since = places.copy(), np.full(len(robots), time)
        _, here, there = np.intersect1d(robots, self.robots, assume_unique=True, return_indices=True)
        moved = np.sqrt(((places[here] - self.places[there]) ** 2).sum(axis=1))
        here, there = here[moved < STILL_WITHIN], there[moved < STILL_WITHIN]
        at[here], since[here] = self.places[there], self.since[there]
        return RestTracker(robots, at, since)


@dataclass(frozen=True, eq=False)
class PlannerState:
    """What one robot remembers. Immutable.

    Attributes
    ----------
    known : DiscoveredMap
    due : float, s
        When it plans next.
    watch : RestTracker
    since : float, s
        When it began, or the robots that it hears became others.
    ways : Ways or None
    table : Table or None
        Both of the map as it was when the last plan was made.
    planned : DiscoveredMap or None
        That map.
    situation : (k, 2) m or None
        Where the robots were at the last plan, this one first.
    crew : (k,) or None
        Who they were.
    quiet : bool
        Whether all others rested then.
    places : (k, 3) or None
        Where they were to be: number, x, y.
    own : (2,) m
        Its own place in the plan; nan for none.
    node : int
        The node there.
    look : (2,) m or None
        Where it goes first, to look around.
    former : places
        From where it has looked.
    looked : float, s
        How long it has been looking around.
    idle : bool
        Whether the next plan may be left out where nothing has changed.
    """

    known: DiscoveredMap
    due: float
    watch: RestTracker
    since: float = 0.0
    ways: Ways | None = None
    table: Table | None = None
    planned: DiscoveredMap | None = None
    situation: Array | None = None
    crew: IntArray | None = None
    quiet: bool = False
    places: Array | None = None
    own: Array | None = None
    node: int = -1
    look: Array | None = None
    former: tuple[Array, ...] = ()
    looked: float = 0.0
    idle: bool = False

    def __deepcopy__(self, memo: object) -> PlannerState:
        return self


@dataclass(frozen=True, slots=True, eq=False)
class AtlasMemory:
    """What the robots remember.

    Attributes
    ----------
    team : Team
        A robot knows its own limits.
    states : tuple of PlannerState, one for each robot
    routes : tuple of (w, 2) m
        The way-points that are left, the last one the goal.
    legs : (n,)
        The way-point that is headed for.
    returns : (n, rays, 2) m or None
        The points that the last scan hit; nan where a ray met nothing.
    """

    team: Team
    states: tuple[PlannerState, ...]
    routes: tuple[Array, ...]
    legs: IntArray
    returns: Array | None = None

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map that each robot has discovered."""
        return tuple(state.known for state in self.states)
