"""Coverage on the generalized Voronoi graph of the map that the team discovers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from robocov.arrays import Array
from robocov.controllers.gains import gain
from robocov.controllers.shared_map import Candidates, SharedMapLaw, Situation, assigned
from robocov.k_median import apply_best_swap
from robocov.planning.voronoi_roadmap import VoronoiRoadmap
from robocov.planning.window import Window

MOST_CELLS, MOST_VERTICES = 150_000, 300  # that the map is thinned on, and of the graph, about
_SPACING = 0.25  # metres between vertices, at least
_FALL = 1e-6  # part of the cost that an exchange must save, once there is one worth it


@dataclass(frozen=True)
class VoronoiGraphCoverage(SharedMapLaw):
    """Robots are placed on the roadmap of the building, by distances along it.

    The roadmap is the generalized Voronoi graph of Choset and Burdick (IJRR 19, 2000): the places halfway
    between walls. The placement is that of Yun and Rus, "Distributed coverage with mobile robots on a graph:
    locational optimization and equal-mass partitioning" (Robotica 32, 2014): the cost is the sum over the
    vertices of their mass times the distance along the graph to the nearest robot, and vertex substitution
    (Teitz and Bart 1968) lowers it, robot by robot, until no exchange of one vertex for another helps.

    The paper's graph is given, its robots know their neighbours of neighbours. Here it is the graph of the
    map that robots discover and share, on which each plans for all whom it hears; what is not known to be
    wall counts as free where a way may lead to, so that the graph reaches into the unknown. The mass of a
    vertex is the area nearest to it by a way, times φ. As the map grows, the plan goes on from the former
    vertices; exchanges must then save the part `threshold` of the cost. Ways are the shortest ones on the
    map, which need not follow the graph. Who goes where is such that their sum of squares is the least.

    Taken from the abstract of Yun and Rus and what is generally known of the others, not from their text.
    """

    name = "voronoi-graph"
    label = "Voronoi graph"
    summary = "k-median on the Voronoi graph of the shared map (Choset and Burdick 2000, Yun and Rus 2014)"

    threshold: float = gain(0.01, "1", "part of the cost that a first exchange must save", high=1.0)

    def placed(self, now: Situation) -> tuple[Array, bool, Array]:
        among, notes = self._vertices(now), np.empty((0, 2))
        if len(among.places) < len(now.at):
            return now.at, False, notes
        begin = np.where(np.isfinite(now.begin), now.begin, now.at)
        chosen, fixed, worth = among.nearest(begin), np.zeros(len(begin), dtype=bool), self.threshold
        while (after := apply_best_swap(among.table, chosen, fixed, worth)) is not chosen:
            chosen, worth = after, _FALL
        return assigned(now, among.places[chosen]), True, notes

    def _vertices(self, now: Situation) -> Candidates:
        """Return the vertices of the graph where the robots are, with distances along it."""
        known, raster, ways = now.known, now.known.raster, now.ways
        window = Window.build_around(raster, now.at[0], math.inf, MOST_CELLS)
        blocks = window.rows, window.stride, window.columns, window.stride
        rows, columns = raster.shape
        room = ~window.crop(ways.is_tight[:rows, :columns], True).reshape(blocks).any(axis=(1, 3))
        free = window.crop(~known.is_blocked, False).reshape(blocks).sum(axis=(1, 3))
        part, _ = ndimage.label(room, np.ones((3, 3)))
        standing = np.array([ways.nodes[ways.find_own_node(place)] for place in now.at])
        row, column = (each // window.stride for each in raster.find_cells(standing))
        room &= np.isin(part, part[row, column]) & (part > 0)
        side = raster.cell_size * window.stride
        graph = VoronoiRoadmap.build(room, free > 0, _SPACING / side, MOST_VERTICES)
        places = np.asarray(raster.origin) + (graph.vertices[:, ::-1] + 0.5) * side
        mass = free.astype(np.float64)
        if now.density is not None and not now.density.is_uniform:
            mass *= now.density.evaluate(window.compute_nodes(raster)).reshape(mass.shape)
        inside = graph.vertex_of_cell >= 0
        weights = np.bincount(graph.vertex_of_cell[inside], mass[inside], minlength=len(places))
        away = np.minimum(graph.distances * side, 1e9)
        return Candidates(places, np.ascontiguousarray((away * weights).T))
