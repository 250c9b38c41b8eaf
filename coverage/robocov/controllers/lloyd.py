"""Lloyd's algorithm under kinematic limits: on whole Voronoi cells, or on cells of limited range.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

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
    """Lloyd's algorithm (Cortés et al. 2004; LA in section III-B of the paper).

    Each robot moves to the centroid of its Voronoi cell at full speed, and slows down when it gets close. By
    default, its deceleration is then at most the maximum acceleration. The drive tracks this velocity and
    compensates for the viscosity. Obstacles are ignored: robots slide along them.

    A `target` other than the centroid is the optimum of the cell for another performance function f of the
    locational cost (4). With `cells` divided by time, and unequal maximum speeds, the target may lie outside
    the robot's own cell.

    Parameters
    ----------
    k_prop : float, 1/s
        Desired speed per meter of distance to the target.
    response_time : float, s
        Time constant with which the desired velocity is reached.
    cells : {"distance", "time"}
        Owner of a point: the nearest robot, or the one that reaches it first at its own maximum speed.
    target : {"centroid", "sensing", "median"}
        Goal of a robot in its cell: the optimum for f = r², for 1 / (r² + h²), or for r.
    height : float, m
        Height h of the sensor in (14), for the target "sensing".

    See Also
    --------
    Rapf : The same goals, and repulsion from robots and obstacles.
    partition : The cells.

    Notes
    -----
    The centroid C of the cell is the optimum for f = r²: the derivative (12) of the locational cost is
    2 M (p - C), where M is the mass of the cell and p the position of its robot.

    Examples
    --------
    >>> import robocov as rc
    >>> room = rc.Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = rc.Simulation(room, rc.Lloyd(), [[1.0, 1.0]])
    >>> simulation.run(20.0).positions[-1].round(1)
    array([[4., 3.]])
    """

    name = "lloyd"
    label = "Lloyd"
    summary = "Lloyd's algorithm: each robot moves to the centroid of its cell and ignores obstacles"

    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the target", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()
    target: str = choice("centroid", TARGETS, TARGET_HELP)
    height: float = gain(1.0, "m", HEIGHT_HELP, low=1e-6)

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Compute the forces that drive each robot to the target in its cell.

        Parameters
        ----------
        seen : Observations
        memory : Memory
            From `begin` or the previous decision.

        Returns
        -------
        Decision
        """
        team = memory.team
        cells = compute_known_cells(seen, self.cells, memory.triangulation)
        goals = find_targets(cells, seen.density, self.target, self.height)
        velocities = compute_approach_velocities(goals - seen.positions, self.k_prop, team.max_speed)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(
            forces=forces,
            goals=goals,
            terms={"attraction": forces},
            cells=cells,
            memory=replace(memory, triangulation=cells.triangulation),
        )


@dataclass(frozen=True)
class RangeLimited(BaseController):
    """Lloyd's algorithm with limited-range interactions (Cortés, Martínez and Bullo 2005).

    Each robot moves to the centroid of its limited cell: the part of its Voronoi cell within half the
    interaction range r. The robots within r determine it, because a robot farther away than r is farther
    than r/2 from each of its points.

    Notes
    -----
    With the limited cell, the gradient (12) is that of the locational cost with f = min(|q - p|², (r/2)²):
    twice the mass of the limited cell times the vector from its centroid to the robot. The motion therefore
    descends this cost. If all cells lie within r/2, the algorithm is Lloyd's.

    The centroid is exact for the uniform density. Another density is integrated over a polygon whose chords
    replace the arcs (see `robocov.voronoi`).

    We did not have the full text of the paper (ESAIM: COCV 11, 691-719); details may differ. Two choices are
    our own: robots move straight to the centroid within their limits, as with `Lloyd`, and r may be smaller
    than the communication range, which may be infinite in a simulation.
    """

    name = "range-limited"
    label = "Lloyd, limited range"
    summary = "Lloyd's algorithm on cells within half the interaction range (Cortés, Martínez and Bullo 2005)"

    interaction_range: float | None = gain(
        6.0, "m", "r, at most the communication range; null for that range itself", low=0.01, optional=True
    )
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Compute the forces that drive each robot to the centroid of its limited cell."""
        team = memory.team
        cells = compute_known_cells(seen, "distance", memory.triangulation)
        interaction_range = np.inf if self.interaction_range is None else self.interaction_range
        radius = 0.5 * np.minimum(team.communication_range, interaction_range)
        area, offsets = compute_disc_limited_moments(cells.edges, radius)
        if seen.density is not None and not seen.density.is_uniform:
            polygons = build_disc_limited_polygons(cells.edges, radius)
            uniform_centroids = seen.positions + offsets
            _, centroids = seen.density.compute_masses_and_centroids(
                polygons, seen.positions, area, uniform_centroids
            )
            offsets = centroids - seen.positions
        velocities = compute_approach_velocities(offsets, self.k_prop, team.max_speed)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(
            forces=forces,
            goals=seen.positions + offsets,
            terms={"attraction": forces},
            cells=cells,
            memory=replace(memory, triangulation=cells.triangulation),
        )
