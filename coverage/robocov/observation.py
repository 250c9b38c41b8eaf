"""What the robots know, and what they decide: the two types between the world and the controllers.

*Distributed* and *unknown obstacles* are facts of these types. Row i of `Observations` belongs to
robot i: its own state, the robots it hears, the nearest obstacle point it senses, the convex region.
A controller computes all rows at once for speed, but row i of its `Decision` may depend only on
row i and on the positions of the neighbours of i.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from robocov.arrays import Array
from robocov.errors import counted
from robocov.neighbours import Neighbours

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.region import Region
    from robocov.voronoi import VoronoiPartition


@dataclass(frozen=True, slots=True, eq=False)
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
    """

    positions: Array
    velocities: Array
    neighbours: Neighbours
    obstacle_points: Array
    region: Region
    time: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
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
    cells : VoronoiPartition or None
        The cells that the law used.
    memory : object
        What the robots remember; it is handed back at the next decision.
    """

    forces: Array
    goals: Array | None = None
    terms: Mapping[str, Array] = field(default_factory=dict)
    cells: VoronoiPartition | None = None
    memory: Any = None


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """One moment of a simulation: the state, what was seen in it, and what was decided on it."""

    seen: Observations
    decision: Decision

    def __repr__(self) -> str:
        return f"<Snapshot at {self.time:.2f} s, {counted(len(self.positions), 'robot')}>"

    @property
    def time(self) -> float:
        """Simulated time in seconds."""
        return self.seen.time

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m."""
        return self.seen.positions

    @property
    def velocities(self) -> Array:
        """Velocities, (n, 2) m/s."""
        return self.seen.velocities
