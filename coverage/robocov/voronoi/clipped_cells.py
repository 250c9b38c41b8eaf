"""Voronoi cells one robot at a time: the region, clipped by the bisectors to the robots it hears.

The path for few robots, for limited communication and for every degenerate case. It is purely local:
a cell is computed from its own generator and the generators that it hears, by the same operations
whatever the others do, so that its row is the same to the last bit. It is plain Python on floats: a
cell has about six vertices, and numpy's calls would cost more than the arithmetic.
"""

from __future__ import annotations

from itertools import chain, pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.voronoi.cell_edges import REGION, CellEdges

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_ENOUGH = 32
"""Neighbours a robot, on average, among which most cells find all that cut them."""

Vertex: TypeAlias = tuple[float, float, int]
"""x and y in metres relative to the generator, and what lies beyond the edge that begins here: the index
of a robot or `REGION`."""

Cell: TypeAlias = list[Vertex]
"""The vertices of a cell, counter-clockwise; none when the cell is empty."""


def clip_cells(
    generators: Array, region: Region, neighbours: Neighbours, heard: Array | None = None
) -> list[Cell]:
    """Return the cells V_i of equation (1) within `region`.

    Parameters
    ----------
    generators : (n, 2) m
    neighbours : Neighbours
        Cell i is cut by the bisectors to the robots that i hears. Generators at the very same place
        do not cut each other: they get the same cell.
    heard : (m, 2) m or None
        Where each robot knows those that it hears to be, in the order of ``neighbours.indices``.
    """
    if heard is not None:
        return _clip_heard(generators, region, neighbours, heard)
    corners = region.vertices.tolist()
    places = generators.tolist()
    cells = []
    for (px, py), others in zip(places, _by_distance(generators, neighbours), strict=True):
        cell = [(x - px, y - py, REGION) for x, y in corners]
        security = _security(cell)
        for other in others:
            x, y = places[other]
            dx, dy = x - px, y - py
            square = dx * dx + dy * dy
            if square > security:
                break
            level = 0.5 * square
            for x, y, _ in cell:
                if x * dx + y * dy > level:
                    cell = _cut(cell, dx, dy, level, other)
                    security = _security(cell)
                    break
        cells.append(cell)
    return cells


def _clip_heard(generators: Array, region: Region, neighbours: Neighbours, heard: Array) -> list[Cell]:
    """Return the cells where each robot has an idea of its own of where the others are."""
    corners = region.vertices.tolist()
    robot, others = neighbours.pairs()
    offset = heard - generators[robot]
    square = np.square(offset[:, 0]) + np.square(offset[:, 1])
    stops = np.cumsum(np.bincount(robot, minlength=len(generators))).tolist()
    cells = []
    for (px, py), start, stop in zip(generators.tolist(), [0, *stops], stops, strict=False):
        cell = [(x - px, y - py, REGION) for x, y in corners]
        security = _security(cell)
        for rank in _nearest_first(square[start:stop]):
            if square[start + rank] > security:
                break
            dx, dy = offset[start + rank].tolist()
            level = 0.5 * (dx * dx + dy * dy)
            for x, y, _ in cell:
                if x * dx + y * dy > level:
                    cell = _cut(cell, dx, dy, level, int(others[start + rank]))
                    security = _security(cell)
                    break
        cells.append(cell)
    return cells


def _nearest_first(square: Array) -> Iterator[int]:
    """Yield the ranks of squared distances, the smallest first; the far ones are sorted when needed."""
    if len(square) <= 2 * _ENOUGH:
        yield from square.argsort(kind="stable").tolist()
        return
    parted = square.argpartition(_ENOUGH)
    near, far = np.sort(parted[:_ENOUGH]), np.sort(parted[_ENOUGH:])
    for ranks in (near, far):
        yield from ranks[square[ranks].argsort(kind="stable")].tolist()


def mass_and_centroid(cells: list[Cell], generators: Array) -> tuple[Array, Array]:
    """Return the areas (n,) m² and centroids (n, 2) m of the cells; an empty cell's is its generator."""
    mass, offset = [], []
    for cell in cells:
        area = moment_x = moment_y = 0.0
        if cell:
            u, v, _ = cell[-1]
            for x, y, _ in cell:
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


def edges_of(cells: list[Cell]) -> CellEdges:
    """Return the edges of all cells as arrays."""
    vertices = np.array(list(chain.from_iterable(cells))).reshape(-1, 3)
    counts = np.array([len(cell) for cell in cells], dtype=np.intp)
    following = np.arange(1, len(vertices) + 1)
    last = np.cumsum(counts)
    filled = counts > 0
    following[last[filled] - 1] = (last - counts)[filled]
    return CellEdges(
        start=vertices[:, :2],
        end=vertices[following, :2],
        cell=np.repeat(np.arange(len(cells)), counts),
        beyond=vertices[:, 2].astype(np.intp),
    )


def _by_distance(generators: Array, neighbours: Neighbours) -> list[Iterable[int]]:
    """Return for every robot those that it hears, nearest first; at equal distances the lower index."""
    n = len(generators)
    x, y = generators[:, 0], generators[:, 1]
    if neighbours.indptr is None or neighbours.indices is None:
        square = np.square(x[:, None] - x) + np.square(y[:, None] - y)
        # each row begins with the robot itself, or with one at the same place, which does not cut it either
        rows: list[Iterable[int]] = square.argsort(axis=1, kind="stable")[:, 1:].tolist()
        return rows
    first = np.repeat(np.arange(n), np.diff(neighbours.indptr))
    second = neighbours.indices
    square = np.square(x[first] - x[second]) + np.square(y[first] - y[second])
    if len(second) <= _ENOUGH * n:
        return list(_sorted_rows(first, second, square, n))

    # sorting what a cell's security radius never reaches would take longer than the cells
    near = square <= np.partition(square, _ENOUGH * n)[_ENOUGH * n]
    far_stops = np.cumsum(np.bincount(first[~near], minlength=n)).tolist()
    far, far_square = second[~near], square[~near]
    return [
        chain(row, _sorted_when_needed(far[start:stop], far_square[start:stop]))
        for row, start, stop in zip(
            _sorted_rows(first[near], second[near], square[near], n), [0, *far_stops], far_stops, strict=False
        )
    ]


def _sorted_rows(first: IntArray, second: IntArray, square: Array, n: int) -> Iterator[list[int]]:
    ordered = second[np.lexsort((square, first))].tolist()
    stops = np.cumsum(np.bincount(first, minlength=n)).tolist()
    for start, stop in pairwise([0, *stops]):
        yield ordered[start:stop]


def _sorted_when_needed(others: IntArray, square: Array) -> Iterator[int]:
    yield from others[square.argsort(kind="stable")].tolist()


def _security(cell: Cell) -> float:
    """Return the square of the distance beyond which no generator can cut the cell.

    Twice the distance of the farthest vertex: a bisector lies half way to the other generator.
    """
    return 4.0 * max([x * x + y * y for x, y, _ in cell], default=-1.0)


def _cut(cell: Cell, dx: float, dy: float, level: float, other: int) -> Cell:
    """Return the part of `cell` where x dx + y dy <= level, the bisector to `other`."""
    kept: Cell = []
    x, y, beyond = vertex = cell[0]
    a = x * dx + y * dy - level
    for following in [*cell[1:], vertex]:
        # the edge from (x, y) to (u, v), whose ends lie a and b beyond the bisector
        u, v, next_beyond = following
        b = u * dx + v * dy - level
        if a <= 0.0:
            kept.append((x, y, other) if a == 0.0 < b else vertex)
        if a < 0.0 < b or b < 0.0 < a:
            part = a / (a - b)
            kept.append((x + part * (u - x), y + part * (v - y), other if a < 0.0 else beyond))
        vertex, x, y, beyond, a = following, u, v, next_beyond, b
    return kept
