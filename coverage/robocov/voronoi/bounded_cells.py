"""The bounded Voronoi partition of all robots at once: equation (1) and what equation (2) needs of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.errors import InputError, shown
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.voronoi.cell_edges import CellEdges
from robocov.voronoi.clipped_cells import clip_cells, edges_of, mass_and_centroid
from robocov.voronoi.delaunay_cells import delaunay_cells
from robocov.voronoi.triangulation import Triangulation

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.density import Density

_TRIANGULATE_FROM = 7
"""Size of team from which all cells at once, off a triangulation at hand, are quicker than one by one."""


@dataclass(frozen=True, eq=False)
class VoronoiPartition:
    """The cells V_i of equation (1) within a convex region.

    Mass and centroid are there at once; everything else is computed when it is first asked for.

    Attributes
    ----------
    generators : (n, 2) m
    mass : (n,) m²
        M of equation (2): the areas of the cells where the density is 1.
    centroid : (n, 2) m
        C of equation (2). An empty cell's is its generator.
    triangulation : Triangulation or None
        What the next partition of slowly moving generators may start from, as its `warm`; None when the
        cells were not read from one.
    density : Density or None
        φ of mass, centroid and moments; None for 1.
    """

    generators: Array
    mass: Array
    centroid: Array
    triangulation: Triangulation | None
    _find_edges: Callable[[], CellEdges]
    density: Density | None = None

    @cached_property
    def edges(self) -> CellEdges:
        """The edges of all cells, with what lies beyond them."""
        return self._find_edges()

    @cached_property
    def polygons(self) -> list[Array]:
        """The cells, (k, 2) m each, counter-clockwise; (0, 2) where a cell is empty."""
        return self.edges.polygons(self.generators)

    @cached_property
    def adjacency(self) -> IntArray:
        """The pairs (i, j), i < j, of cells that share an edge, (m, 2), ascending.

        Where communication is limited, cells overlap: i and j are then a pair when the bisector
        between them is an edge of either.
        """
        return self.edges.adjacency()

    @cached_property
    def polar_moment(self) -> Array:
        """J_{V,p} of equation (2), (n,) m⁴: the polar moments of the cells about their generators."""
        if self.density is not None:
            return self.density.moments(self.edges, self.generators).polar
        return self.edges.polar_moment(len(self.generators))

    @cached_property
    def polar_moment_about_centroid(self) -> Array:
        """J_{V,C}, (n,) m⁴, by the parallel axis theorem, equation (3)."""
        lever = self.generators - self.centroid
        return self.polar_moment - self.mass * (lever[:, 0] ** 2 + lever[:, 1] ** 2)


def partition(
    generators: Array,
    region: Region,
    neighbours: Neighbours | None = None,
    warm: Triangulation | None = None,
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
    warm : Triangulation or None
        The triangulation of the partition before. When the generators have moved little since, this one
        takes a fraction of the time; its cells are the same, to the last bit where no four generators
        lie on a circle up to rounding.
    heard : (m, 2) m or None
        Where robots know those that they hear to be, in the order of ``neighbours.indices``. The cells of
        two robots may then overlap or leave a gap: each is what its own robot takes for it. None: where
        they are.
    density : Density or None
        φ, by which mass, centroid and moments are taken; the cells are the same. None: 1 everywhere.

    Raises
    ------
    InputError
        When the generators are not (n, 2) finite numbers.

    Examples
    --------
    >>> square = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> halves = partition(np.array([[0.5, 1.0], [1.5, 1.0]]), square)
    >>> halves.mass
    array([2., 2.])
    >>> halves.adjacency
    array([[0, 1]])
    """
    cells = _partition(generators, region, neighbours, warm, heard)
    return cells if density is None else _weighted(cells, density)


def _partition(
    generators: Array,
    region: Region,
    neighbours: Neighbours | None,
    warm: Triangulation | None,
    heard: Array | None,
) -> VoronoiPartition:
    points = np.array(generators, dtype=np.float64, order="C")
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"generators: an array of shape {points.shape}, but (n, 2) was wanted")
    if heard is not None:
        if neighbours is None or neighbours.complete:
            raise InputError("heard: given without the neighbours that they are of")
        return _clipped(points, region, neighbours, heard)
    if len(points) >= _TRIANGULATE_FROM and (neighbours is None or neighbours.complete):
        cells = delaunay_cells(points, region, warm)
        if cells is not None:
            return VoronoiPartition(
                _fixed(points),
                _fixed(cells.mass),
                _fixed(cells.centroid),
                cells.triangulation,
                partial(cells.edges, points),
            )
    return _clipped(points, region, neighbours if neighbours is not None else Neighbours(len(points)))


def _weighted(cells: VoronoiPartition, density: Density) -> VoronoiPartition:
    """Return the same cells with another density."""
    mass, centroid = cells.mass, cells.centroid
    if density.uniform:
        mass = mass * density.highest
    else:
        mass, centroid = density.mass_and_centroid(cells.edges, cells.generators, mass, centroid)
    edges = cells._find_edges if density.uniform else partial(_same, cells.edges)
    return replace(cells, mass=_fixed(mass), centroid=_fixed(centroid), _find_edges=edges, density=density)


def _same(edges: CellEdges) -> CellEdges:
    return edges


def _clipped(
    points: Array, region: Region, neighbours: Neighbours, heard: Array | None = None
) -> VoronoiPartition:
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        bad = int(np.argmin(finite))
        raise InputError(f"generators[{bad}]: {shown(points[bad].tolist())}, but finite numbers were wanted")
    cells = clip_cells(points, region, neighbours, heard)
    mass, centroid = mass_and_centroid(cells, points)
    return VoronoiPartition(_fixed(points), _fixed(mass), _fixed(centroid), None, partial(edges_of, cells))


def _fixed(values: Array) -> Array:
    values.setflags(write=False)
    return values
