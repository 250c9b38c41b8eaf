"""Voronoi cells one robot at a time: the region, clipped by the bisectors to the robots it hears.

The path for few robots, for limited communication and for every degenerate case. It is purely local:
a cell is computed from its own generator and the generators that it hears, by the same operations
whatever the others do, so that its row is the same to the last bit. It is plain Python on floats: a
cell has about six vertices, and numpy's calls would cost more than the arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np

from robocov.arrays import Array
from robocov.cell_edges import REGION, CellEdges
from robocov.observation import Neighbours
from robocov.region import Region


@dataclass(frozen=True, slots=True, eq=False)
class ClippedCell:
    """One cell: vertices relative to its generator, counter-clockwise; edge k goes from vertex k to k + 1.

    Attributes
    ----------
    x, y : (k,) m
    beyond : (k,)
        What lies beyond edge k: the index of a robot or `REGION`.
    """

    x: list[float]
    y: list[float]
    beyond: list[int]


def clip_cells(generators: Array, region: Region, neighbours: Neighbours) -> list[ClippedCell]:
    """Return the cells V_i of equation (1) within `region`.

    Parameters
    ----------
    generators : (n, 2) m
    neighbours : Neighbours
        Cell i is cut by the bisectors to the robots that i hears. Generators at the very same place
        do not cut each other: they get the same cell.
    """
    corners_x, corners_y = region.vertices[:, 0].tolist(), region.vertices[:, 1].tolist()
    x, y = generators[:, 0].tolist(), generators[:, 1].tolist()
    cells = []
    for robot, others in enumerate(_by_distance(generators, neighbours)):
        px, py = x[robot], y[robot]
        cell = ClippedCell(
            [u - px for u in corners_x], [v - py for v in corners_y], [REGION] * len(corners_x)
        )
        security = _security(cell)
        for other in others:
            dx, dy = x[other] - px, y[other] - py
            square = dx * dx + dy * dy
            if square > security:
                break
            if dx or dy:
                cut = _cut(cell, dx, dy, 0.5 * square, other)
                if cut is not cell:
                    cell, security = cut, _security(cut)
        cells.append(cell)
    return cells


def mass_and_centroid(cells: list[ClippedCell], generators: Array) -> tuple[Array, Array]:
    """Return the areas (n,) m² and centroids (n, 2) m of the cells; an empty cell's is its generator."""
    mass, offset = [], []
    for cell in cells:
        area = moment_x = moment_y = 0.0
        if cell.x:
            u, v = cell.x[-1], cell.y[-1]
            for x, y in zip(cell.x, cell.y, strict=True):
                cross = u * y - x * v
                area += cross
                moment_x += cross * (u + x)
                moment_y += cross * (v + y)
                u, v = x, y
        if area > 0.0:
            mass.append(0.5 * area)
            offset.append((moment_x / (3.0 * area), moment_y / (3.0 * area)))
        else:
            mass.append(0.0)
            offset.append((0.0, 0.0))
    return np.array(mass), generators + np.array(offset).reshape(-1, 2)


def edges_of(cells: list[ClippedCell]) -> CellEdges:
    """Return the edges of all cells as arrays."""
    x = np.array(list(chain.from_iterable(cell.x for cell in cells)))
    y = np.array(list(chain.from_iterable(cell.y for cell in cells)))
    start = np.column_stack([x, y])
    counts = np.array([len(cell.x) for cell in cells], dtype=np.intp)
    following = np.arange(1, len(start) + 1)
    last = np.cumsum(counts)
    filled = counts > 0
    following[last[filled] - 1] = (last - counts)[filled]
    return CellEdges(
        start=start,
        end=start[following],
        cell=np.repeat(np.arange(len(cells)), counts),
        beyond=np.array(list(chain.from_iterable(cell.beyond for cell in cells)), dtype=np.intp),
    )


def _by_distance(generators: Array, neighbours: Neighbours) -> list[list[int]]:
    """Return for every robot those that it hears, nearest first; at equal distances the lower index."""
    n = len(generators)
    x, y = generators[:, 0], generators[:, 1]
    if neighbours.indptr is None or neighbours.indices is None:
        square = np.square(x[:, None] - x) + np.square(y[:, None] - y)
        # a robot comes first in its own row, even when another is at the same place
        square.ravel()[:: n + 1] = -1.0
        rows: list[list[int]] = square.argsort(axis=1, kind="stable")[:, 1:].tolist()
        return rows
    first = np.repeat(np.arange(n), np.diff(neighbours.indptr))
    second = neighbours.indices
    square = np.square(x[first] - x[second]) + np.square(y[first] - y[second])
    ordered = second[np.lexsort((square, first))].tolist()
    stops = neighbours.indptr.tolist()
    return [ordered[start:stop] for start, stop in pairwise(stops)]


def _security(cell: ClippedCell) -> float:
    """Return the square of the distance beyond which no generator can cut the cell.

    Twice the distance of the farthest vertex: a bisector lies half way to the other generator.
    """
    return 4.0 * max([x * x + y * y for x, y in zip(cell.x, cell.y, strict=True)], default=-1.0)


def _cut(cell: ClippedCell, dx: float, dy: float, level: float, other: int) -> ClippedCell:
    """Return the part of `cell` where x dx + y dy <= level: `cell` itself when all of it is."""
    depth = [x * dx + y * dy - level for x, y in zip(cell.x, cell.y, strict=True)]
    if max(depth, default=0.0) <= 0.0:
        return cell
    new_x: list[float] = []
    new_y: list[float] = []
    beyond: list[int] = []
    following = zip([*cell.x[1:], cell.x[0]], [*cell.y[1:], cell.y[0]], [*depth[1:], depth[0]], strict=True)
    for x, y, a, label, (u, v, b) in zip(cell.x, cell.y, depth, cell.beyond, following, strict=True):
        # the edge from (x, y) to (u, v), whose ends lie a and b beyond the bisector
        if a <= 0.0:
            new_x.append(x)
            new_y.append(y)
            beyond.append(other if a == 0.0 < b else label)
        if a < 0.0 < b or b < 0.0 < a:
            part = a / (a - b)
            new_x.append(x + part * (u - x))
            new_y.append(y + part * (v - y))
            beyond.append(other if b > 0.0 else label)
    return ClippedCell(new_x, new_y, beyond)
