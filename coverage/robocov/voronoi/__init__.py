"""The bounded Voronoi partition of all robots at once: equation (1) and what equation (2) needs of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.density.base import CellEdges, Density
from robocov.errors import InputError, shown
from robocov.observation import Cells
from robocov.observation.neighbours import NOBODY, Neighbours
from robocov.observation.region import Region
from robocov.voronoi.clipping import cells_of
from robocov.voronoi.delaunay import Mesh

__all__ = ["VoronoiPartition", "partition"]

_TRIANGULATE_FROM = 16
"""Size of team from which a triangulation is quicker than clipping by everybody."""

_NOT_HEARD = np.empty((0, 2))
_NO_MESH = np.empty((2, 0), dtype=np.int32)
_NO_EDGES = np.empty((0, 6))

_AnyCells = TypeVar("_AnyCells", bound=Cells)


@dataclass(eq=False, kw_only=True)
class VoronoiPartition(Cells):
    """The cells V_i of equation (1) within a convex region."""

    _find_edges: Callable[[], CellEdges]

    @cached_property
    def edges(self) -> CellEdges:
        return self._find_edges()

    @cached_property
    def polygons(self) -> list[Array]:
        """The cells, (k, 2) m each, counter-clockwise; (0, 2) where a cell is empty."""
        return self.edges.polygons(self.generators)

    @property
    def outlines(self) -> tuple[list[Array], IntArray]:
        return self.polygons, np.arange(len(self.generators))


def partition(
    generators: Array,
    region: Region,
    neighbours: Neighbours | None = None,
    warm: Mesh | None = None,
    heard: Array | None = None,
    density: Density | None = None,
) -> VoronoiPartition:
    """Return the Voronoi cells of `generators` within `region`; obstacles play no part.

    Parameters
    ----------
    generators : (n, 2) m
        They may lie on the region's boundary or outside. Those at the very same place do not cut
        each other: they get the same cell.
    region : Region
    neighbours : Neighbours or None
        Who hears whom. Cell i is cut only by the bisectors to the robots that i hears, and depends,
        to the last bit, on nothing else. None: everybody hears everybody.
    warm : Mesh or None
        The triangulation of the partition before. When the generators have moved little since, this one
        takes a fraction of the time; its cells are the same, to the last bit where no four generators
        lie on a circle up to rounding.
    heard : (m, 2) m or None
        Where robots know those that they hear to be, in the order of ``neighbours.indices``. The cells of
        two robots may then overlap or leave a gap: each is what its own robot takes for it. None: where
        they are.
    density : Density or None
        φ of mass, centroid and moments; the cells are the same. None: 1 everywhere.

    Raises
    ------
    InputError
        When the generators are not (n, 2) finite numbers.

    Examples
    --------
    >>> square = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> halves = partition(np.array([[0.5, 1.0], [1.5, 1.0]]), square)
    >>> halves.mass, halves.adjacency
    (array([2., 2.]), array([[0, 1]]))
    """
    points = generators_of(generators)
    n, mesh = len(points), _NO_MESH
    if neighbours is None or neighbours.indptr is None or neighbours.indices is None:
        if heard is not None:
            raise InputError("heard: given without the neighbours that they are of")
        indptr = indices = NOBODY
        if n >= _TRIANGULATE_FROM:
            size = 8 * n + 4
            mesh = np.full((2, size), -1, np.int32) if warm is None or warm.shape[1] != size else warm.copy()
    else:
        indptr, indices = neighbours.indptr, neighbours.indices
    known = _NOT_HEARD if heard is None else np.ascontiguousarray(heard)
    mass, centroid = np.empty(n), np.empty((n, 2))
    count = cells_of(points, region.sides, known, indptr, indices, n, mesh, mass, centroid, _NO_EDGES)
    if count < 0:
        bad = -1 - count
        raise InputError(f"generators[{bad}]: {shown(points[bad].tolist())}, but finite numbers were wanted")
    mesh = mesh if mesh.shape[1] and mesh[0, 0] >= 0 else _NO_MESH
    mesh.setflags(write=False)
    edges = partial(_edges, points, region.sides, known, indptr, indices, mesh, count)
    triangulation = mesh if mesh.shape[1] else None
    cells = VoronoiPartition(points, mass, centroid, triangulation=triangulation, _find_edges=edges)
    return weighted(cells, density)


def _edges(
    points: Array, sides: Array, known: Array, indptr: IntArray, indices: IntArray, mesh: Mesh, count: int
) -> CellEdges:
    n, edges = len(points), np.empty((count, 6))
    work = points.copy(), sides, known, indptr, indices, n, mesh.copy(), np.empty(n), np.empty((n, 2))
    cells_of(*work, edges)
    return CellEdges(edges[:, :2].copy(), edges[:, 2:4].copy(), *edges[:, 4:].T.astype(np.intp))


def generators_of(values: object) -> Array:
    """Return a copy of what is to be (n, 2) generators; an InputError where it is not."""
    points = np.array(values, dtype=np.float64, order="C")
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"generators: an array of shape {points.shape}, but (n, 2) was wanted")
    return points


def weighted(cells: _AnyCells, density: Density | None) -> _AnyCells:
    """Give cells that are being made mass and centroid by a density; return them, now read-only."""
    cells.density = density
    if density is not None and density.uniform:
        cells.mass = cells.mass * density.highest
    elif density is not None:
        places = cells.generators
        cells.mass, cells.centroid = density.mass_and_centroid(
            cells.edges, places, cells.mass, cells.centroid
        )
    for values in (cells.generators, cells.mass, cells.centroid):
        values.setflags(write=False)
    return cells
