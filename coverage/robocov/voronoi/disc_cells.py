"""Areas and centroids of Voronoi cells that end at a limited range: exact for polygon and disc."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov.density.base import REGION, CellEdges

_CHORDS = 64
"""For one arc, which is less than half a turn."""


def disc_limited(edges: CellEdges, radius: Array) -> tuple[Array, Array]:
    """Return area (n,) m² and centroid (n, 2) m of the part of each cell within a distance of its generator.

    The centroid is **relative to the generator**; zero where nothing of the cell is that near. By the
    divergence theorem every edge adds, signed, the part of the triangle that it spans with the generator that
    lies in the disc: a smaller triangle where the edge is inside the disc, sectors where it is outside.
    Radii, (n,) m, are above 0; infinite for no limit.
    """
    count = len(radius)
    # a disc that holds the whole cell cuts nothing
    size = np.zeros(count)
    np.maximum.at(size, edges.cell, np.hypot(edges.start[:, 0], edges.start[:, 1]))
    rho = np.minimum(radius, 2.0 * size + 1.0)[edges.cell]
    first, last, arcs = _cut(edges, rho)
    cross = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    doubled = cross.copy()
    moment = cross[:, None] * (first + last) / 3.0
    for angle, turn in arcs:
        doubled += rho * rho * turn
        third = 2.0 / 3.0 * rho**3
        moment[:, 0] += third * (np.sin(angle + turn) - np.sin(angle))
        moment[:, 1] += third * (np.cos(angle) - np.cos(angle + turn))
    area = 0.5 * np.bincount(edges.cell, doubled, minlength=count)
    first_moment = np.column_stack([np.bincount(edges.cell, part, minlength=count) for part in moment.T])
    # less than rounding makes of nothing is nothing
    some = area > 1e-14 * np.minimum(radius, size) ** 2
    centroid = 0.5 * first_moment / np.where(some, area, 1.0)[:, None]
    return np.where(some, area, 0.0), np.where(some[:, None], centroid, 0.0)


def disc_polygons(edges: CellEdges, radius: Array) -> CellEdges:
    """Return the same parts of the cells as polygons, whose chords stand for the arcs of the discs.

    A chord is at most a 128th of a turn: of a whole disc 0.04 % of the area are missing. Pieces of no length
    are among them.
    """
    rho = np.minimum(radius[edges.cell], 4.0 * float(np.abs(edges.start).max(initial=0.0)) + 1.0)
    first, last, arcs = _cut(edges, rho)
    pieces = [(first, last, edges.cell)]
    part = np.linspace(0.0, 1.0, _CHORDS + 1)
    for begin, turn in arcs:
        angle = begin[:, None] + turn[:, None] * part
        places = rho[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        some = (turn != 0.0).nonzero()[0]
        cell = np.repeat(edges.cell[some], _CHORDS)
        pieces.append((places[some, :-1].reshape(-1, 2), places[some, 1:].reshape(-1, 2), cell))
    start, end, cell = (np.concatenate([piece[k] for piece in pieces]) for k in (0, 1, 2))
    order = np.argsort(cell, kind="stable")
    return CellEdges(start[order], end[order], cell[order], np.full(len(cell), REGION))


def _cut(edges: CellEdges, rho: Array) -> tuple[Array, Array, list[tuple[Array, Array]]]:
    """Return the ends of each edge's part in the disc round the generator, and the arcs before and behind it.

    An arc is the angle where it begins, and how far it turns. Out of the disc, an edge's part has no length.
    """
    step = edges.end - edges.start
    square = np.maximum((step * step).sum(axis=1), 1e-300)
    middle = -(edges.start * step).sum(axis=1) / square
    nearest = edges.start + middle[:, None] * step
    half2 = (rho * rho - (nearest * nearest).sum(axis=1)) / square
    half = np.sqrt(np.maximum(half2, 0.0))
    first, last = (edges.start + np.clip(middle + side, 0.0, 1.0)[:, None] * step for side in (-half, half))
    arcs = []
    for (x, y), (u, v) in ((edges.start.T, first.T), (last.T, edges.end.T)):
        arcs.append((np.arctan2(y, x), np.arctan2(x * v - y * u, x * u + y * v)))
    return first, last, arcs
