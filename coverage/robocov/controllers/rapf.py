"""RAPF: repulsion and attraction to the centroid of the robot's Voronoi cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robocov.controllers.cells import cells_seen, choice_of_cells
from robocov.controllers.gains import WithGains, choice, gain
from robocov.controllers.repulsion import forces_seen
from robocov.locational.targets import HEIGHT, MEANING, TARGETS, targets
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.robots import Team
from robocov.voronoi.delaunay import Mesh


@dataclass(frozen=True)
class Rapf(WithGains):
    """Repulsive and attractive potential field (Renzaglia and Martinelli), equations (23)-(28).

    As RPF, but every robot is also drawn to the centroid of its Voronoi cell of the known convex
    region. The cells ignore the unknown obstacles; the repulsion keeps robots off them.
    Another `target` than the centroid is the optimum of the cell for another locational cost (4).
    The goal may lie in or behind an obstacle: then the robot rests where the forces balance. With `cells` by
    time, where robots are not equally fast, it may lie outside of the robot's own cell as well.

    With `attraction_limit` at viscosity x maximum speed (2 N by default) the attraction never
    exceeds what drives a robot at full speed, and no wall is touched; None is the paper's (27).
    """

    name: ClassVar[str] = "rapf"
    label: ClassVar[str] = "RAPF"
    summary: ClassVar[str] = (
        "the paper's law: short-range repulsion + attraction to the cell's centroid, (23)-(28)"
    )

    k_rep: float = gain(0.3, "N m³", "strength of the repulsion, (24)")
    rho_0: float = gain(2.0, "m", "range of the repulsion, (24)", low=0.01, high=1e4)
    k_att: float = gain(30.0, "N/m³", "strength of the attraction, (27)")
    attraction_limit: float | None = gain(
        2.0, "N", "cap of the attraction; null is the paper's formula", low=1e-6, optional=True
    )
    cells: str = choice_of_cells()
    target: str = choice("centroid", TARGETS, MEANING)
    height: float = gain(1.0, "m", HEIGHT, low=1e-6)

    def begin(self, region: Region, team: Team) -> None:
        """Nothing is remembered yet; later, the triangulation from which the next cells start."""

    def decide(self, seen: Observations, memory: Mesh | None) -> Decision:
        """Return the forces (25) + (27)."""
        cells = cells_seen(seen, self.cells, memory)
        goals = targets(cells, seen.density, self.target, self.height)
        forces, attraction, robots, obstacle = forces_seen(
            seen, goals, self.k_rep, self.rho_0, self.k_att, self.attraction_limit
        )
        return Decision(
            forces=forces,
            goals=goals,
            terms={"attraction": attraction, "repulsion_robots": robots, "repulsion_obstacle": obstacle},
            cells=cells,
            memory=cells.triangulation,
        )
