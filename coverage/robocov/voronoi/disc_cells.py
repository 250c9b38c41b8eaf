"""Areas and centroids of Voronoi cells that end at a limited range: exact for polygon and disc."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov.density.cell_edges import REGION, CellEdges

_CHORDS = 64
"""For one arc, which is less than half a turn."""


def disc_limited(edges: CellEdges, radius: Array) -> tuple[Array, Array]:
    """Return area and centroid of the part of each cell within a distance of its generator.

    By the divergence theorem every edge adds, signed, the part of the triangle that it spans with the
    generator that lies in the disc: a smaller triangle where the edge is inside the disc, sectors where
    it is outside.

    Parameters
    ----------
    edges : CellEdges
    radius : (n,) m
        Above 0; infinite for no limit.

    Returns
    -------
    area : (n,) m²
    centroid : (n, 2) m
        **Relative to the generator**; zero where nothing of the cell is that near.
    """
    count = len(radius)
    a, step = edges.start, edges.end - edges.start
    # a disc that holds the whole cell cuts nothing
    size = np.zeros(count)
    np.maximum.at(size, edges.cell, np.hypot(a[:, 0], a[:, 1]))
    rho = np.minimum(radius, 2.0 * size + 1.0)[edges.cell]
    enters, leaves = _inside(a, step, rho)
    first, last = a + enters[:, None] * step, a + leaves[:, None] * step
    cross = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    doubled = cross.copy()
    moment = cross[:, None] * (first + last) / 3.0
    for begin, end in ((a, first), (last, edges.end)):
        turn = np.arctan2(
            begin[:, 0] * end[:, 1] - begin[:, 1] * end[:, 0],
            begin[:, 0] * end[:, 0] + begin[:, 1] * end[:, 1],
        )
        angle = np.arctan2(begin[:, 1], begin[:, 0])
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

    Parameters
    ----------
    edges : CellEdges
    radius : (n,) m
        Above 0; infinite for no limit.

    Returns
    -------
    CellEdges
        Closed polygons, relative to the generators. A chord is at most a 128th of a turn: of a whole disc
        0.04 % of the area are missing. Pieces of no length are among them.
    """
    rho = np.minimum(radius[edges.cell], 4.0 * float(np.abs(edges.start).max(initial=0.0)) + 1.0)
    step = edges.end - edges.start
    enters, leaves = _inside(edges.start, step, rho)
    first, last = edges.start + enters[:, None] * step, edges.start + leaves[:, None] * step
    pieces = [(first, last, edges.cell)]
    part = np.linspace(0.0, 1.0, _CHORDS + 1)
    for begin, end in ((edges.start, first), (last, edges.end)):
        turn = np.arctan2(
            begin[:, 0] * end[:, 1] - begin[:, 1] * end[:, 0],
            begin[:, 0] * end[:, 0] + begin[:, 1] * end[:, 1],
        )
        angle = np.arctan2(begin[:, 1], begin[:, 0])[:, None] + turn[:, None] * part
        places = rho[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        some = (turn != 0.0).nonzero()[0]
        cell = np.repeat(edges.cell[some], _CHORDS)
        pieces.append((places[some, :-1].reshape(-1, 2), places[some, 1:].reshape(-1, 2), cell))
    start, end, cell = (np.concatenate([piece[k] for piece in pieces]) for k in (0, 1, 2))
    order = np.argsort(cell, kind="stable")
    return CellEdges(start[order], end[order], cell[order], np.full(len(cell), REGION))


def _inside(a: Array, step: Array, rho: Array) -> tuple[Array, Array]:
    """Return where each edge, from 0 to 1, enters and leaves the disc round the origin; equal if never."""
    square = np.maximum((step * step).sum(axis=1), 1e-300)
    middle = -(a * step).sum(axis=1) / square
    nearest = a + middle[:, None] * step
    half2 = (rho * rho - (nearest * nearest).sum(axis=1)) / square
    half = np.sqrt(np.maximum(half2, 0.0))
    return np.clip(middle - half, 0.0, 1.0), np.clip(middle + half, 0.0, 1.0)
