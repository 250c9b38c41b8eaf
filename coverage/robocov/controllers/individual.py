"""Control laws written for one robot at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from robocov.arrays import Array
from robocov.controllers.cells import voronoi_cells
from robocov.errors import ParameterError, shown
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.robots import Team
from robocov.voronoi import VoronoiPartition
from robocov.voronoi.delaunay import Mesh

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, eq=False)
class OwnView:
    """All that one robot knows: what it senses and hears, and the convex outer boundary."""

    number: int  # its own, from 0
    position: Array  # (2,) m
    velocity: Array  # (2,) m/s
    neighbours: Array  # (k, 2) m, of the robots that it hears, as the last message of each has it
    obstacle_point: Array | None  # (2,) m, the closest obstacle or boundary point in sensing range
    region: Region
    time: float  # s
    _cells: VoronoiPartition

    @property
    def centroid(self) -> Array:
        """Centroid of the robot's Voronoi cell, (2,) m."""
        return np.asarray(self._cells.centroid[self.number])

    @property
    def cell(self) -> Array:
        """The robot's Voronoi cell, (k, 2) m counter-clockwise."""
        return self._cells.polygons[self.number]


@runtime_checkable
class IndividualController(Protocol):
    """A law for one robot: one method from what it knows to the force that it wants."""

    def force(self, own: OwnView) -> Sequence[float] | Array:
        """Return the force in newtons, two numbers."""


class Individually:
    """Makes a controller for the team of a law for one robot: it is asked for every robot in turn.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Home:
    ...     stiffness: float = 0.5
    ...     def force(self, own):
    ...         return self.stiffness * (own.centroid - own.position)
    >>> Individually(Home()).name
    'Home'
    """

    def __init__(self, law: IndividualController) -> None:
        self.law = law
        kind = type(law)
        self.name = str(getattr(law, "name", kind.__name__))
        self.label = str(getattr(law, "label", self.name))
        self.summary = str(getattr(law, "summary", (kind.__doc__ or "").strip().split("\n")[0]))

    def begin(self, region: Region, team: Team) -> None:
        """Nothing is remembered yet; later, the triangulation from which the next cells start."""

    def decide(self, seen: Observations, memory: Mesh | None) -> Decision:
        """Ask the law for each robot's force."""
        cells = voronoi_cells(seen, memory)
        forces = np.empty_like(seen.positions)
        for i in range(len(forces)):
            point = seen.obstacle_points[i]
            own = OwnView(
                number=i,
                position=seen.positions[i].copy(),
                velocity=seen.velocities[i].copy(),
                neighbours=seen.neighbour_positions(i),
                obstacle_point=None if np.isnan(point[0]) else point.copy(),
                region=seen.region,
                time=seen.time,
                _cells=cells,
            )
            force = np.asarray(self.law.force(own), dtype=float)
            if force.shape != (2,):
                told = f"gave {shown(force.tolist())}, but two numbers in newtons were wanted"
                raise ParameterError(f"controller {self.name!r}: force(own) {told}")
            forces[i] = force
        return Decision(forces=forces, goals=cells.centroid, cells=cells, memory=cells.triangulation)
