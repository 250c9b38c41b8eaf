"""LA, Lloyd's algorithm under kinematic limits: on whole cells, or on their parts within a range."""

from dataclasses import dataclass, replace

import numpy as np

from robocov.controllers.base import BaseController, Memory
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.gains import choice, gain, response_time_gain
from robocov.controllers.known_cells import cells_choice, compute_known_cells
from robocov.locational_cost.best_points import HEIGHT_HELP, TARGET_HELP, TARGETS, find_targets
from robocov.observation import Decision, Observations
from robocov.voronoi import build_disc_limited_polygons, compute_disc_limited_moments


@dataclass(frozen=True)
class Lloyd(BaseController):
    """Lloyd's algorithm (Cortés et al. 2004; section III-B of the paper), called LA there.

    Every robot heads for the centroid of its Voronoi cell at full speed, and slows down on the last metres so
    that its deceleration stays within the limits. The drive tracks that velocity and makes up for viscosity.
    Another `target` than the centroid is the optimum of the cell for another locational cost (4). Obstacles
    are not known to the law: the robot slides along them. With `cells` by time, where robots are not equally
    fast, the goal may lie outside of the cell.
    """

    name = "lloyd"
    label = "Lloyd"
    summary = "Lloyd's algorithm: every robot heads for its cell's centroid, obstacles ignored"

    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()
    target: str = choice("centroid", TARGETS, TARGET_HELP)
    height: float = gain(1.0, "m", HEIGHT_HELP, low=1e-6)

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        cells = compute_known_cells(seen, self.cells, memory.triangulation)
        goals = find_targets(cells, seen.density, self.target, self.height)
        wanted = compute_approach_velocities(goals - seen.positions, self.k_prop, memory.team.max_speed)
        forces = compute_drive_forces(wanted, seen, memory.team, self.response_time)
        memory = replace(memory, triangulation=cells.triangulation)
        return Decision(forces, goals, {"attraction": forces}, cells, memory)


@dataclass(frozen=True)
class RangeLimited(BaseController):
    """Lloyd's algorithm with limited-range interactions (Cortés, Martínez and Bullo 2005).

    The cell of a robot is the part of its Voronoi cell within half the communication range r, so that
    the robots it hears determine it: whoever is farther than r is farther than r/2 from all of it. Moving
    to the centroid of that part descends the locational cost with f = min(|q - p|², (r/2)²), which is
    what a team can descend that hears no farther: two times the part's mass times the way to its
    centroid is the gradient, (12) with the limited cell (the paper's own section on limited-range
    interactions). Where everybody's cell lies within r/2 it is Lloyd's algorithm.

    The centroid is exact with density 1; another density is integrated over a polygon, whose chords
    stand for the arcs (see `robocov.voronoi`).

    Taken from what is generally known of the paper (ESAIM: COCV 11, 691-719), not from its text: cells,
    cost and gradient. Decided here: that the motion is Lloyd's, straight to the centroid with the limits of
    the robots, and that r may be less than the communication range, which in a simulation need not end.
    """

    name = "range-limited"
    label = "LA, limited range"
    summary = "Lloyd's algorithm on cells within half the interaction range (Cortés, Martínez and Bullo 2005)"

    interaction_range: float | None = gain(
        6.0, "m", "r, at most the communication range; null for that range itself", low=0.01, optional=True
    )
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        cells = compute_known_cells(seen, "distance", memory.triangulation)
        reach = np.inf if self.interaction_range is None else self.interaction_range
        radius = 0.5 * np.minimum(memory.team.communication_range, reach)
        area, offset = compute_disc_limited_moments(cells.edges, radius)
        if seen.density is not None and not seen.density.is_uniform:
            limited = build_disc_limited_polygons(cells.edges, radius)
            uniform = seen.positions + offset
            _, centroid = seen.density.compute_mass_and_centroid(limited, seen.positions, area, uniform)
            offset = centroid - seen.positions
        wanted = compute_approach_velocities(offset, self.k_prop, memory.team.max_speed)
        forces = compute_drive_forces(wanted, seen, memory.team, self.response_time)
        memory = replace(memory, triangulation=cells.triangulation)
        return Decision(forces, seen.positions + offset, {"attraction": forces}, cells, memory)
