"""Coverage on the generalized Voronoi graph of the map that the team discovers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from scipy import ndimage

from robocov.controllers.exploration.shared_map import (
    Candidates,
    Placement,
    SharedMapController,
    Situation,
    assign_goals,
)
from robocov.controllers.gains import gain
from robocov.k_median import apply_best_swap
from robocov.planning.team_placement import UNREACHABLE_M
from robocov.planning.voronoi_roadmap import VoronoiRoadmap
from robocov.planning.window import Window
from robocov.typing import BoolArray, FloatArray

MAX_BLOCKS = 150_000
"""Maximum number of square blocks of cells in the coarser map from which the graph is built."""
MAX_VERTICES = 300
"""Approximate number of vertices of the graph."""
_MIN_SPACING_M = 0.25
"""Minimum distance between vertices."""
_MIN_FURTHER_SAVING = 1e-6
"""Fraction of the cost that an exchange must save after one that saved the threshold."""


@dataclass(frozen=True)
class VoronoiGraphCoverage(SharedMapController):
    """Placement of robots on a roadmap of the free space, by distances along it.

    The roadmap is the generalized Voronoi graph of Choset and Burdick (IJRR 19, 2000): the points with equal
    distances to two walls. The placement is that of Yun and Rus, "Distributed coverage with mobile robots on
    a graph: locational optimization and equal-mass partitioning" (Robotica 32, 2014): vertex substitution
    reduces the cost, robot by robot, until no exchange of one vertex for another saves any.

    Notes
    -----
    The cost is the sum, over all vertices, of the mass times the distance along the graph to the nearest
    robot. It is minimized by vertex substitution (Teitz and Bart 1968). The mass of a vertex is the area to
    which it is the nearest vertex, by path length, times φ.

    In the paper the graph is known, and robots know the neighbors of their neighbors. Here it is the graph
    of the map that robots discover and share, and each robot plans for itself and its neighbors. Unknown
    space that a path may lead to counts as free, so the graph extends into it. When the map has changed, the
    plan starts from the previous vertices; the first exchange must then save the fraction `threshold` of the
    cost. Robots follow the shortest paths on the map, not the graph. Goals are assigned to robots so that the
    sum of the squared path lengths is minimal. While the graph has fewer vertices than there are robots, as
    in a region in which no wall is known yet, one robot moves to each vertex, and the others stay.

    We had only the abstract of Yun and Rus, not the full texts of the papers; details may differ.
    """

    name = "voronoi-graph"
    label = "Voronoi graph"
    summary = "k-median on the Voronoi graph of the shared map (Choset and Burdick 2000, Yun and Rus 2014)"

    threshold: float = gain(0.01, "1", "fraction of the cost that the first exchange must save", high=1.0)

    def compute_placement(self, situation: Situation) -> Placement:
        """Compute the placement by vertex substitution, starting from the previous one."""
        candidates = self._build_candidates(situation)
        count = len(situation.positions)
        if len(candidates.positions) < count:
            return Placement(goals=_assign_vertices(situation, candidates.positions), is_final=False)
        goals = situation.previous_goals
        chosen = candidates.assign_to_positions(np.where(np.isfinite(goals), goals, situation.positions))
        is_fixed = np.zeros(count, dtype=bool)
        min_saving = self.threshold
        while True:
            improved = apply_best_swap(candidates.table, chosen, is_fixed, min_saving)
            if improved is chosen:
                break
            chosen = improved
            min_saving = _MIN_FURTHER_SAVING
        return Placement(goals=assign_goals(situation, candidates.positions[chosen]), is_final=True)

    def _build_candidates(self, situation: Situation) -> Candidates:
        """Build candidates at the vertices that robots can reach, with distances weighted by mass."""
        known_map = situation.known_map
        raster = known_map.raster
        window = Window.build_around(raster, situation.positions[0], math.inf, MAX_BLOCKS)
        block_size = raster.cell_size * window.stride
        is_reachable = _find_reachable_blocks(situation, window)
        cells_by_block = window.crop(~known_map.is_blocked, fill=False).reshape(window.block_shape)
        free_counts = cells_by_block.sum(axis=(1, 3))

        roadmap = VoronoiRoadmap.build(
            is_reachable, free_counts > 0, _MIN_SPACING_M / block_size, MAX_VERTICES
        )
        # The roadmap has rows and columns of blocks; positions are x and y of their centers.
        vertices = np.asarray(raster.origin) + (roadmap.vertices[:, ::-1] + 0.5) * block_size

        mass = free_counts.astype(np.float64)
        if situation.density is not None and not situation.density.is_uniform:
            mass *= situation.density.evaluate(window.compute_nodes(raster)).reshape(mass.shape)
        has_vertex = roadmap.vertex_of_cell >= 0
        weights = np.bincount(roadmap.vertex_of_cell[has_vertex], mass[has_vertex], minlength=len(vertices))

        # Row q, column p of the table: distance to vertex q from a robot at vertex p, times the weight of q.
        distances = np.minimum(roadmap.distances * block_size, UNREACHABLE_M)
        return Candidates(positions=vertices, table=np.ascontiguousarray((distances * weights).T))


def _assign_vertices(situation: Situation, vertices: FloatArray) -> FloatArray:
    """Return the goals of k robots, (k, 2) m, given fewer vertices than robots, (v, 2) m.

    One robot moves to each vertex, so that the sum of the squared path lengths is minimal. The other robots
    stay where they are.
    """
    goals = situation.positions.copy()
    if not len(vertices):
        return goals
    planner = situation.planner
    nodes = [planner.visibility.find_entry_node(vertex) for vertex in vertices]
    distances = np.array(
        [planner.compute_distances_from(position[None])[nodes] for position in situation.positions]
    )
    robots, chosen = scipy.optimize.linear_sum_assignment(np.minimum(distances, UNREACHABLE_M) ** 2)
    goals[robots] = vertices[chosen]
    return goals


def _find_reachable_blocks(situation: Situation, window: Window) -> BoolArray:
    """Return a mask of the blocks of the window that a robot can reach through blocks with clearance."""
    raster = situation.known_map.raster
    planner = situation.planner
    # The window of the planner extends beyond the raster if its last blocks do.
    row_count, column_count = raster.shape
    is_near_wall = window.crop(planner.map_window.is_near_wall[:row_count, :column_count], fill=True)
    has_clearance = ~is_near_wall.reshape(window.block_shape).any(axis=(1, 3))
    labels, _ = ndimage.label(has_clearance, np.ones((3, 3)))
    own_nodes = [planner.visibility.find_entry_node(position) for position in situation.positions]
    rows, columns = raster.find_cells(planner.map_window.nodes[own_nodes])
    own_labels = labels[rows // window.stride, columns // window.stride]
    return np.asarray(has_clearance & np.isin(labels, own_labels) & (labels > 0))
