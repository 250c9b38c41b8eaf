"""What the robots know, and what they decide: the two types between the world and the controllers.

*Distributed* and *unknown obstacles* are facts of these types. Row i of `Observations` belongs to
robot i: its own state, the robots it hears, the nearest obstacle point it senses, the convex region.
A controller computes all rows at once for speed, but row i of its `Decision` may depend only on
row i and on the positions of the neighbours of i.

Nobody changes them in place. They are not frozen only because a frozen one takes three times as long to make,
which at six robots is a tenth of a step.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.errors import counted
from robocov.observation.neighbours import Neighbours

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.density import Density
    from robocov.observation.cells import Cells
    from robocov.observation.region import Region
    from robocov.observation.scans import Scans


@dataclass(slots=True, eq=False)
class Observations:
    """All that the robots know, as a structure of arrays; row i belongs to robot i alone.

    Attributes
    ----------
    positions : (n, 2) m
    velocities : (n, 2) m/s
        A robot knows its own velocity, not those of others.
    neighbours : Neighbours
        The robots within communication range: their positions are known, nothing else.
    obstacle_points : (n, 2) m
        The single closest obstacle or boundary point within sensing range, nan where none.
    region : Region
        The known convex outer boundary.
    time : float, s
    reported_positions : (m, 2) m or None
        Where robots know their neighbours to be, in the order of ``neighbours.indices``: what the last
        message said that arrived. None: where they are, ``positions``.
    report_ages : (m,) s or None
        How old that is.
    max_speeds : (n,) m/s or None
        The largest speed of each robot: its own, and what its neighbours tell of theirs. None: not told.
    density : Density or None
        φ, how much each place counts: part of the task, known to all. None: every place the same.
    scans : Scans or None
        A ray scan of each robot, in the steps in which the controller wants one.
    """

    positions: Array
    velocities: Array
    neighbours: Neighbours
    obstacle_points: Array
    region: Region
    time: float = 0.0
    max_speeds: Array | None = None
    reported_positions: Array | None = None
    report_ages: Array | None = None
    density: Density | None = None
    scans: Scans | None = None

    def neighbour_positions(self, robot: int) -> Array:
        """Return where a robot knows its neighbours to be, (k, 2) m, in the order of ``neighbours.of``."""
        if self.reported_positions is None:
            return self.positions[self.neighbours.of(robot)]
        return self.reported_positions[self.neighbours.row(robot)]

    def neighbours_within(self, reach: float) -> tuple[IntArray, IntArray, Array, Array]:
        """Return the directed pairs of neighbours that are at most `reach` metres apart, for all they know.

        Returns
        -------
        robot : (m,), neighbour : (m,)
            Sorted by robot, then neighbour.
        offset : (m, 2) m
            From the neighbour, as the robot knows it, to the robot.
        distance : (m,) m
        """
        if self.reported_positions is None:
            robot, neighbour, distance = self.neighbours.closer_than(self.positions, reach)
            return robot, neighbour, self.positions[robot] - self.positions[neighbour], distance
        robot, neighbour = self.neighbours.pairs()
        offset = self.positions[robot] - self.reported_positions
        distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
        near = distance <= reach
        return robot[near], neighbour[near], offset[near], distance[near]


@dataclass(slots=True, eq=False)
class Decision:
    """What a controller decides, and what explains it.

    Attributes
    ----------
    forces : (n, 2) N
        What each robot wants to be driven with, before any limit; viscosity is the world's.
    goals : (n, 2) m or None
        Where each robot is drawn to, nan where it has no goal; None when the law knows no goals.
    terms : dict of name to (n, 2) N
        The forces by cause (``attraction``, ``repulsion_robots``, ``repulsion_obstacle``, ...).
    cells : Cells or None
        The cells that the law used.
    memory : object
        What the robots remember; it is handed back at the next decision.
    """

    forces: Array
    goals: Array | None = None
    terms: Mapping[str, Array] = field(default_factory=dict)
    cells: Cells | None = None
    memory: Any = None


@dataclass(slots=True, eq=False)
class Snapshot:
    """One moment of a simulation: the state, what was seen in it, and what was decided on it.

    Attributes
    ----------
    seen : Observations
    decision : Decision
    truth : (n, 2) m or None
        Where the robots are, if that is not where they believe themselves to be, ``seen.positions``.
    working : (n,) bool or None
        Which robots are there and have not failed; None: all.
    inbox : robocov.conditions.perception.Inbox or None
        The messages that the robots then have; None where they know the others as they are.
    """

    seen: Observations
    decision: Decision
    truth: Array | None = None
    working: BoolArray | None = None
    inbox: Any = None

    def __repr__(self) -> str:
        return f"<Snapshot at {self.time:.2f} s, {counted(len(self.positions), 'robot')}>"

    @property
    def time(self) -> float:
        """Simulated time in seconds."""
        return self.seen.time

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m."""
        return self.seen.positions if self.truth is None else self.truth

    @property
    def velocities(self) -> Array:
        """Velocities, (n, 2) m/s."""
        return self.seen.velocities
