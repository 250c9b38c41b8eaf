"""LA: Lloyd's algorithm under kinematic limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.controllers.cells import cells_seen, choice_of_cells
from robocov.controllers.gains import WithGains, choice, gain
from robocov.locational.targets import HEIGHT, MEANING, TARGETS, targets
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.robots import Team
from robocov.voronoi.delaunay import Mesh


@dataclass(frozen=True, slots=True, eq=False)
class LloydMemory:
    """What the robots remember.

    Attributes
    ----------
    team : Team
        A robot knows its own mass, viscosity and largest speed.
    triangulation : Mesh or None
        From which the next cells start.
    """

    team: Team
    triangulation: Mesh | None = None


@dataclass(frozen=True)
class Lloyd(WithGains):
    """Lloyd's algorithm (Cortés et al. 2004; section III-B of the paper), called LA there.

    Every robot heads for the centroid of its Voronoi cell at full speed, and slows down on the
    last metres so that its deceleration stays within the limits. The drive tracks that velocity
    and makes up for viscosity. Another `target` than the centroid is the optimum of the cell for
    another locational cost (4). Obstacles are not known to the law: the robot slides along them.
    With `cells` by time, where robots are not equally fast, the goal may lie outside of the cell.
    """

    name: ClassVar[str] = "lloyd"
    label: ClassVar[str] = "LA"
    summary: ClassVar[str] = "Lloyd's algorithm: every robot heads for its cell's centroid, obstacles ignored"

    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the centroid", high=100.0)
    response_time: float = gain(
        0.1, "s", "time constant with which the wanted velocity is reached", low=0.02, high=10.0
    )
    cells: str = choice_of_cells()
    target: str = choice("centroid", TARGETS, MEANING)
    height: float = gain(1.0, "m", HEIGHT, low=1e-6)

    def begin(self, region: Region, team: Team) -> LloydMemory:
        """Return what the robots know of themselves."""
        return LloydMemory(team)

    def decide(self, seen: Observations, memory: LloydMemory) -> Decision:
        """Return the forces that drive each robot to its centroid."""
        team = memory.team
        cells = cells_seen(seen, self.cells, memory.triangulation)
        goals = targets(cells, seen.density, self.target, self.height)
        offset = goals - seen.positions
        distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
        speed_per_metre = np.minimum(self.k_prop, team.max_speed / np.maximum(distance, 1e-300))
        wanted = offset * speed_per_metre[:, None]
        drive = (wanted - seen.velocities) * (team.mass / self.response_time)[:, None]
        forces = drive + seen.velocities * team.viscosity[:, None]
        return Decision(
            forces=forces,
            goals=goals,
            terms={"attraction": forces},
            cells=cells,
            memory=LloydMemory(team, cells.triangulation),
        )
