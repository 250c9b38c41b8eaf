"""Lloyd's algorithm in a convex chart of the known map, in which obstacles are points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from robocov.controllers.base import is_plan_due
from robocov.controllers.convex_chart import ConvexChart
from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    compute_approach_velocities,
    compute_drive_forces,
)
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.known_map import WholeMapController
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

_MIN_DETERMINANT = 1e-300
"""Minimum divisor; prevents division by zero."""

# Charts take long to build, and must not be copied with the memories of robots.
_build_cached_chart = lru_cache(maxsize=8)(ConvexChart)


@dataclass(frozen=True, slots=True, eq=False)
class DiffeomorphismMemory:
    """Memory of the last plan."""

    team: Team
    chart_centroids: FloatArray | None = None
    """(n, 2) m, centroids of the cells in the chart; None before the first plan."""
    goals: FloatArray | None = None
    """(n, 2) m, the same points in the map; None before the first plan."""
    plan_time: float = -np.inf
    """Time of the last plan, s."""


@dataclass(frozen=True)
class Diffeomorphism(WholeMapController):
    """Coverage of a non-convex region by means of a convex one (Caicedo-Núñez and Žefran 2008).

    A diffeomorphism F maps the free space to a convex region, in which each obstacle is only a point or a
    slit. In this chart, Lloyd's algorithm moves straight to the centroids of Voronoi cells, with the density
    transferred by F, so that each part keeps its mass. In the map, the robots then move around the obstacles:

        u_i = k DF(p_i)⁻¹ (C_i - F(p_i)),    C_i the centroid of the cell of F(p_i)

    Notes
    -----
    The controller minimizes the coverage cost in the chart. Distances there differ from path lengths in the
    map: a room at the end of a long corridor is small in the chart, and barely attracts robots.

    Any diffeomorphism can be used; this one is a `ConvexChart`. For a `shrink` of 1, or without obstacles, it
    is the identity, and the controller is `Lloyd`.

    Obstacles are enlarged by the radius of the largest robot and `clearance`. A robot in this margin is
    mapped to where F maps the nearest point outside. Robots avoid collisions by slowing down. Cells are
    sampled by the triangles of the mesh, and computed every `period` seconds, for each robot from the
    positions of the robots within communication range. The chart includes unreachable rooms, but no moving
    obstacles.

    We did not have the full text of the two papers ("A coverage algorithm for a class of non-convex regions",
    CDC 2008; "Performing coverage on nonconvex domains", CCA 2008); details may differ. Here F is piecewise
    linear, and obstacles become small areas instead of points.
    """

    name = "diffeomorphism"
    label = "Lloyd, diffeomorphism"
    summary = "Lloyd's algorithm in a convex chart of the known map (Caicedo-Núñez and Žefran 2008)"

    shrink: float = gain(1e4, "1", "stiffness of obstacles relative to the free space", low=1.0, high=1e6)
    lattice: float = gain(
        64.0, "cells", "number of cells of the mesh along a side", low=4.0, high=512.0, whole=True
    )
    clearance: float = gain(0.03, "m", "margin between robots and walls along paths", high=10.0)
    period: float = gain(0.2, "s", "time between two plans", high=60.0)
    k_prop: float = gain(
        2.0, "1/s", "desired speed per meter of distance to the centroid, in the chart", high=100.0
    )
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> DiffeomorphismMemory:
        """Return the initial memory; raise ParameterError if no robot fits into the map."""
        self._get_chart(team)
        return DiffeomorphismMemory(team)

    def decide(self, seen: Observations, memory: DiffeomorphismMemory) -> Decision:
        """Compute the forces that drive each robot straight, in the chart, to the centroid of its cell."""
        team = memory.team
        chart = self._get_chart(team)
        chart_positions, jacobians = chart.map_to_chart(seen.positions)
        chart_centroids = memory.chart_centroids
        if chart_centroids is None or is_plan_due(memory.plan_time, self.period, seen.time):
            chart_centroids = _compute_chart_centroids(seen, chart, chart_positions)
            memory = DiffeomorphismMemory(
                team=team,
                chart_centroids=chart_centroids,
                goals=chart.map_to_region(chart_centroids),
                plan_time=seen.time,
            )
        offsets = _apply_inverses(jacobians, chart_centroids - chart_positions)
        velocities = compute_approach_velocities(offsets, self.k_prop, team.max_speed)
        # Each robot avoids one obstacle point, the nearest one in view.
        obstacle_points = seen.obstacle_points[:, None]
        # Paths in the chart keep the whole clearance. With half of it as the margin, the avoidance of
        # collisions does not stop a robot on such a path.
        margins = Margins.build_with_gap(team, 0.5 * self.clearance)
        velocities = avoid_collisions(velocities, seen, team, obstacle_points, margins)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(forces=forces, goals=memory.goals, terms={"attraction": forces}, memory=memory)

    def _get_chart(self, team: Team) -> ConvexChart:
        """Return the chart of the map for the largest robot of the team."""
        clearance = float(team.radius.max()) + self.clearance
        return _build_cached_chart(self.get_environment(), clearance, int(self.lattice), self.shrink)


def _compute_chart_centroids(
    seen: Observations, chart: ConvexChart, chart_positions: FloatArray
) -> FloatArray:
    """Return the centroids of the robots' cells in the chart, (n, 2) m.

    `chart_positions`, (n, 2) m, are the positions F(p_i) of the robots in the chart.
    """
    pairs = seen.find_neighbors()
    if seen.reported_positions is None:
        neighbor_chart_positions = chart_positions[pairs.neighbors]
    else:
        # Robots know their neighbors' positions as reported, which may differ from one receiver to the next.
        # The offset leads from the reported position to the robot.
        reported_positions = seen.positions[pairs.robots] - pairs.offsets
        neighbor_chart_positions, _ = chart.map_to_chart(reported_positions)
    is_own = find_own_samples(chart.samples, chart_positions, pairs.robots, neighbor_chart_positions)
    return compute_sample_centroids(is_own, chart.samples, chart.mass, chart_positions)


def _apply_inverses(jacobians: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return the products of the inverses of Jacobians, (n, 2, 2), with (n, 2) vectors."""
    a, b, c, d = jacobians.reshape(-1, 4).T
    x, y = vectors.T
    # The chart preserves orientation, so its determinant is positive. The limit only prevents division by
    # zero if the determinant underflows.
    determinant = np.maximum(a * d - b * c, _MIN_DETERMINANT)
    return np.asarray(np.column_stack([d * x - b * y, a * y - c * x]) / determinant[:, None])
