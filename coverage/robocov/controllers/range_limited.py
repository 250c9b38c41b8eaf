"""Lloyd's algorithm on cells that end at half the communication range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.controllers.cells import cells_seen
from robocov.controllers.driving import approach, drive
from robocov.controllers.gains import WithGains, gain
from robocov.controllers.lloyd import LloydMemory
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.robots import Team
from robocov.voronoi.disc_cells import disc_limited, disc_polygons


@dataclass(frozen=True)
class RangeLimited(WithGains):
    """Lloyd's algorithm with limited-range interactions (Cortés, Martínez and Bullo 2005).

    The cell of a robot is the part of its Voronoi cell within half the communication range r, so that
    the robots it hears determine it: whoever is farther than r is farther than r/2 from all of it. Moving
    to the centroid of that part descends the locational cost with f = min(|q - p|², (r/2)²), which is
    what a team can descend that hears no farther: two times the part's mass times the way to its
    centroid is the gradient, (12) with the limited cell (the paper's own section on limited-range
    interactions). Where everybody's cell lies within r/2 it is Lloyd's algorithm, and it is driven as
    that is.

    The centroid is exact with density 1; another density is integrated over a polygon, whose chords
    stand for the arcs (see `robocov.voronoi.disc_cells`).

    Taken from what is generally known of the paper (ESAIM: COCV 11, 691-719), not from its text: cells,
    cost and gradient. Decided here: that the motion is Lloyd's, straight to the centroid with the limits of
    the robots, and that r may be less than the communication range, which in a simulation need not end.
    """

    name: ClassVar[str] = "range-limited"
    label: ClassVar[str] = "LA, limited range"
    summary: ClassVar[str] = (
        "Lloyd's algorithm on cells within half the interaction range (Cortés, Martínez and Bullo 2005)"
    )

    interaction_range: float | None = gain(
        6.0, "m", "r, at most the communication range; null for that range itself", low=0.01, optional=True
    )
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the centroid", high=100.0)
    response_time: float = gain(
        0.1, "s", "time constant with which the wanted velocity is reached", low=0.02, high=10.0
    )

    def begin(self, region: Region, team: Team) -> LloydMemory:
        """Return what the robots know of themselves."""
        return LloydMemory(team)

    def decide(self, seen: Observations, memory: LloydMemory) -> Decision:
        """Return the forces that drive each robot to the centroid of its limited cell."""
        team = memory.team
        cells = cells_seen(seen, "distance", memory.triangulation)
        reach = np.inf if self.interaction_range is None else self.interaction_range
        radius = 0.5 * np.minimum(team.communication_range, reach)
        area, offset = disc_limited(cells.edges, radius)
        if seen.density is not None and not seen.density.uniform:
            limited = disc_polygons(cells.edges, radius)
            uniform = seen.positions + offset
            _, centroid = seen.density.mass_and_centroid(limited, seen.positions, area, uniform)
            offset = centroid - seen.positions
        wanted = approach(offset, self.k_prop, team.max_speed)
        forces = drive(wanted, seen, team, self.response_time)
        return Decision(
            forces=forces,
            goals=seen.positions + offset,
            terms={"attraction": forces},
            cells=cells,
            memory=LloydMemory(team, cells.triangulation),
        )
