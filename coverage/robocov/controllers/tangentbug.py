"""Voronoi coverage with TangentBug as local planner: Lloyd's algorithm that goes round obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers.bug import Bug, Look, Mode
from robocov.controllers.cells import cells_seen, choice_of_cells
from robocov.controllers.driving import drive, limit_approach_speed, offsets_from_neighbours
from robocov.controllers.gains import gain, validate_gains
from robocov.controllers.returns import last_returns, with_nearest
from robocov.controllers.tangents import free_distances
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.observation.scans import Scanning, headings
from robocov.robots import Team
from robocov.voronoi.triangulation import Triangulation

_GRAIN = 0.1
"""Side in metres of the squares in which a robot remembers what it has met."""

_EAGERNESS = 4.0
"""Speed in 1/s with which the distance to what is close may fall to the clearance."""


@dataclass(frozen=True, slots=True, eq=False)
class TangentBugMemory:
    """What the robots remember.

    Attributes
    ----------
    team : Team
        A robot knows its own body and limits.
    bugs : tuple of Bug
    returns : (n, rays, 2) m or None
        What the last scan of each met.
    met : tuple of (w,)
        The squares in which each has met something so far, as `_squares` counts them, ascending.
    triangulation : Triangulation or None
        From which the next cells start.
    """

    team: Team
    bugs: tuple[Bug, ...] = ()
    returns: Array | None = None
    met: tuple[IntArray, ...] = ()
    triangulation: Triangulation | None = None


@dataclass(frozen=True)
class TangentBug:
    """Voronoi coverage of non-convex environments (Breitenmoser et al., ICRA 2010).

    The goal of every robot is the centroid of its Voronoi cell of the convex region, as Lloyd's
    algorithm has it, and TangentBug (Kamon, Rivlin and Rimon 1996) drives it there by what its scans see:

    - *Motion to the goal*: straight there, or, where something blocks the way, to that end of the
      blocking contour by way of which the goal is nearer, as long as this leads nearer to the goal.
    - *Boundary following*: where it does not, along the boundary, until some place in view is nearer to
      the goal than all of the boundary that was followed: d_reach < d_followed.
    - *Projection*: a robot that has been round in vain cannot reach its goal, which lies in an obstacle.
      It goes to the point of the boundary that is nearest to the goal, and rests. So it does at once
      where the goal lies in what it has met so far, or closer to that than a robot can be.

    Decided here: a robot's own centroid moves with it, and would pull it back from every detour, so that
    it keeps the goal from where it meets a boundary until it is there or has given up. It follows a
    boundary `detour` times as far as the goal is away, and then goes back; a way round a wall may be as
    long as the building. It tries again when its centroid has moved by `moved`. Scans are of the robot's
    own sensor; its body is accounted for by widening what they meet by radius and `clearance`.
    Robots that are near are gone round by sliding along them.

    Taken from the paper's abstract and what is generally known of both papers, not from their text. That
    others may be as large as the largest of the team is taken for granted.
    """

    name: ClassVar[str] = "tangentbug"
    label: ClassVar[str] = "LA + TangentBug"
    summary: ClassVar[str] = (
        "Lloyd's algorithm, with TangentBug to go round obstacles (Breitenmoser et al. 2010)"
    )
    scanning: ClassVar[Scanning] = Scanning(rays=120, period=0.1)

    clearance: float = gain(
        0.05, "m", "distance kept from obstacles and robots, beside the radius", high=10.0
    )
    jump: float = gain(0.5, "m", "depth of a step in the view that is an end of an obstacle", low=0.01)
    detour: float | None = gain(
        4.0,
        "distances",
        "longest way along a boundary, in those to the goal; null for once round",
        optional=True,
    )
    moved: float = gain(0.25, "m", "way of a goal given up after which it is tried again", high=1e4)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the goal", high=100.0)
    response_time: float = gain(
        0.1, "s", "time constant with which the wanted velocity is reached", low=0.02, high=10.0
    )
    cells: str = choice_of_cells()

    def __post_init__(self) -> None:
        validate_gains(self)

    def begin(self, region: Region, team: Team) -> TangentBugMemory:
        """Return what the robots know of themselves."""
        return TangentBugMemory(team)

    def decide(self, seen: Observations, memory: TangentBugMemory) -> Decision:
        """Return the forces that drive each robot along its way."""
        cells = cells_seen(seen, self.cells, memory.triangulation)
        bugs, met = memory.bugs, memory.met
        returns = last_returns(seen, memory.returns)
        points = with_nearest(seen, returns)
        if not bugs or seen.scans is not None or returns is None:
            met = _remembered(points, met)
            bugs = self._bugs(seen, memory, cells.centroid, points, met)
        # until the next scan, who has its centroid in view follows it
        direct = np.array([bug.aim is None and not bug.passing for bug in bugs])
        way = np.where(direct[:, None], cells.centroid, np.array([bug.way for bug in bugs]))
        passing = np.array([bug.passing for bug in bugs])
        wanted = self._wanted(seen, memory.team, way, passing, points)
        forces = drive(wanted, seen, memory.team, self.response_time)
        kept = [own if bug.aim is None else bug.aim for bug, own in zip(bugs, cells.centroid, strict=True)]
        return Decision(
            forces=forces,
            goals=np.array(kept),
            terms={"attraction": forces},
            cells=cells,
            memory=TangentBugMemory(memory.team, bugs, returns, met, cells.triangulation),
        )

    def _wanted(self, seen: Observations, team: Team, way: Array, passing: Array, points: Array) -> Array:
        """Return the velocities towards the next way-points, slowed before what is close, (n, 2) m/s."""
        offset = way - seen.positions
        distance = np.hypot(*offset.T)
        speed = np.where(passing, team.max_speed, np.minimum(self.k_prop * distance, team.max_speed))
        speed = np.minimum(speed, distance / self.response_time)
        wanted = offset * (speed / np.maximum(distance, 1e-300))[:, None]
        largest = float(team.radius.max())
        others = offsets_from_neighbours(seen, 4.0 * largest + 1.0)
        walls = seen.positions[:, None] - points
        robots = np.arange(others.shape[1] + walls.shape[1]) < others.shape[1]
        keep = (team.radius + 0.5 * self.clearance)[:, None] + np.where(robots, largest, 0.0)
        # of two robots each brakes for its half of the way
        braking = np.where(robots, 0.25, 0.5) * team.max_acceleration[:, None]
        close = np.concatenate([others, walls], axis=1)
        return limit_approach_speed(wanted, close, keep, _EAGERNESS, braking, team.max_speed)

    def _bugs(
        self,
        seen: Observations,
        memory: TangentBugMemory,
        goals: Array,
        points: Array,
        met: tuple[IntArray, ...],
    ) -> tuple[Bug, ...]:
        team, directions = memory.team, headings(self.scanning.rays)
        found = []
        for i, position in enumerate(seen.positions):
            bug = memory.bugs[i] if memory.bugs else Bug(Mode.GOAL, 1, position)
            bug = bug.before(position, goals[i], self.moved)
            reach = min(float(team.sensing_range[i]), seen.region.diameter)
            keep = float(team.radius[i]) + self.clearance
            near = points[i] - position
            look = Look(
                position=position,
                goal=(goals[i] if bug.aim is None else bug.aim) - position,
                points=near,
                walls=_middles(met[i]) - position,
                directions=directions,
                free=free_distances(near, directions, keep, reach),
                keep=keep,
                reach=reach,
                grain=_GRAIN,
                jump=self.jump,
                detour=self.detour,
            )
            found.append(look.next(bug))
        return tuple(found)


def _remembered(points: Array, met: tuple[IntArray, ...]) -> tuple[IntArray, ...]:
    """Return the squares that each robot has met something in, with those of (n, k, 2) points."""
    found = [np.unique(_squares(near[~np.isnan(near[:, 0])])) for near in points]
    return tuple(np.union1d(old, new) for old, new in zip(met, found, strict=True)) if met else tuple(found)


def _squares(points: Array) -> IntArray:
    """Return numbers of the squares of (k, 2) points."""
    column, row = np.floor(points / _GRAIN).astype(np.int64).T
    return np.asarray((column << 32) + row + (1 << 31))


def _middles(squares: IntArray) -> Array:
    """Return the middles of squares, (k, 2) m."""
    row = (squares & 0xFFFFFFFF) - (1 << 31)
    return np.asarray((np.column_stack([squares >> 32, row]) + 0.5) * _GRAIN)
