"""Cells limited to discs around their generators, as robots of limited range know them."""

from typing import NamedTuple

import numpy as np

from robocov.arrays import compute_lengths
from robocov.density.cell_edges import REGION, CellEdges
from robocov.typing import FloatArray

_CHORDS_PER_ARC = 64
"""Number of chords that replace an arc of a disc. An arc spans at most half a turn."""

_MIN_AREA = 1e-14
"""Areas of limited cells up to this fraction of the squared radius may be rounding errors."""

_MIN_SQUARED_LENGTH = 1e-300
"""Minimum divisor, m²; prevents division by zero."""


class _Arcs(NamedTuple):
    """An arc of a disc for each of e edges. Its length may be zero."""

    start_angles: FloatArray
    """(e,) Direction of the start of each arc from the generator, rad from +x."""
    turns: FloatArray
    """(e,) Angle that each arc spans, positive counter-clockwise, rad."""


class _CutEdges(NamedTuple):
    """Edges cut by discs: an arc, the section of the edge in the disc, and another arc replace each."""

    inner_starts: FloatArray
    """(e, 2) Start of the section of each edge in the disc, relative to the generator, m."""
    inner_ends: FloatArray
    """(e, 2) End of this section; the same point if the edge is outside the disc."""
    arcs_before: _Arcs
    """The arcs before these sections."""
    arcs_after: _Arcs
    """The arcs after these sections."""


def compute_disc_limited_moments(edges: CellEdges, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the area and centroid of the intersection of each cell with a disc around its generator.

    Parameters
    ----------
    edges : CellEdges
        Edges of the cells.
    radii : (n,) array, m
        Radius of each disc, above 0; infinite for no limit.

    Returns
    -------
    areas : (n,) array, m²
        Area of each intersection.
    centroids : (n, 2) array, m
        Centroid of each intersection, **relative to the generator**; zero if the area is zero.

    Notes
    -----
    By the divergence theorem, an integral over a cell is a sum of signed contributions of its edges. Each
    edge contributes the part of its triangle with the generator that lies in the disc: a smaller triangle for
    the section of the edge inside the disc, and circular sectors for the rest.
    """
    cell_count = len(radii)
    # If a disc contains the whole cell, its radius does not matter. Infinite radii are therefore replaced by
    # finite ones, which exceed the distance of the farthest vertex.
    max_distances = np.zeros(cell_count)
    np.maximum.at(max_distances, edges.cells, compute_lengths(edges.starts))
    edge_radii = np.minimum(radii, 2.0 * max_distances + 1.0)[edges.cells]
    cut = _cut_by_discs(edges, edge_radii)
    doubled_areas, doubled_moments = _compute_doubled_moments(cut, edge_radii)
    areas = 0.5 * np.bincount(edges.cells, doubled_areas, minlength=cell_count)
    doubled_moments_x = np.bincount(edges.cells, doubled_moments[:, 0], minlength=cell_count)
    doubled_moments_y = np.bincount(edges.cells, doubled_moments[:, 1], minlength=cell_count)
    moments = 0.5 * np.column_stack([doubled_moments_x, doubled_moments_y])
    has_area = areas > _MIN_AREA * np.minimum(radii, max_distances) ** 2
    centroids = moments / np.where(has_area, areas, 1.0)[:, None]
    return np.where(has_area, areas, 0.0), np.where(has_area[:, None], centroids, 0.0)


def _compute_doubled_moments(cut: _CutEdges, edge_radii: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return twice the area, (e,) m², and twice the first moments, (e, 2) m³, that each edge contributes.

    Twice the area of a sector from angle a to angle b is r² (b - a), and twice its first moment about the
    center is 2/3 r³ (sin b - sin a, cos a - cos b).
    """
    # The triangles between the generators and the sections of the edges in the discs.
    starts = cut.inner_starts
    ends = cut.inner_ends
    crosses = starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0]
    doubled_areas = crosses.copy()
    doubled_moments = crosses[:, None] * (starts + ends) / 3.0
    # The sectors of the arcs before and after these sections.
    for angles, turns in (cut.arcs_before, cut.arcs_after):
        doubled_areas += edge_radii * edge_radii * turns
        factors = 2.0 / 3.0 * edge_radii**3
        doubled_moments[:, 0] += factors * (np.sin(angles + turns) - np.sin(angles))
        doubled_moments[:, 1] += factors * (np.cos(angles) - np.cos(angles + turns))
    return doubled_areas, doubled_moments


def build_disc_limited_polygons(edges: CellEdges, radii: FloatArray) -> CellEdges:
    """Build the intersections of cells with discs around their generators, as polygons.

    Chords replace the arcs of the discs. A chord spans at most 1/128 of a turn, so that the area of the
    polygon of a whole disc is at most 0.04% smaller than that of the disc.

    Parameters
    ----------
    edges : CellEdges
        Edges of the cells.
    radii : (n,) array, m
        Radius of each disc, above 0; infinite for no limit.

    Returns
    -------
    CellEdges
        Edges of the polygons. Some have length zero, and all have `REGION` on the other side.
    """
    # If a disc contains the whole cell, its radius does not matter. Infinite radii are therefore replaced by
    # finite ones.
    max_coordinate = float(np.abs(edges.starts).max(initial=0.0))
    edge_radii = np.minimum(radii[edges.cells], 4.0 * max_coordinate + 1.0)
    cut = _cut_by_discs(edges, edge_radii)
    all_starts = [cut.inner_starts]
    all_ends = [cut.inner_ends]
    all_cells = [edges.cells]
    fractions = np.linspace(0.0, 1.0, _CHORDS_PER_ARC + 1)
    for start_angles, turns in (cut.arcs_before, cut.arcs_after):
        angles = start_angles[:, None] + turns[:, None] * fractions
        points = edge_radii[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        has_arc = turns != 0.0
        all_starts.append(points[has_arc, :-1].reshape(-1, 2))
        all_ends.append(points[has_arc, 1:].reshape(-1, 2))
        all_cells.append(np.repeat(edges.cells[has_arc], _CHORDS_PER_ARC))
    cells = np.concatenate(all_cells)
    by_cell = np.argsort(cells, kind="stable")
    return CellEdges(
        starts=np.concatenate(all_starts)[by_cell],
        ends=np.concatenate(all_ends)[by_cell],
        cells=cells[by_cell],
        other_cells=np.full(len(cells), REGION),
    )


def _cut_by_discs(edges: CellEdges, edge_radii: FloatArray) -> _CutEdges:
    """Cut each edge of cells by a disc around its generator, with the radius in `edge_radii`, (e,) m.

    The boundary of the intersection of a cell with its disc follows each edge inside the disc. Outside the
    disc, the edge is replaced by an arc of the disc that spans the same directions.
    """
    steps = edges.ends - edges.starts
    squared_lengths = np.maximum((steps * steps).sum(axis=1), _MIN_SQUARED_LENGTH)
    # An edge is start + t step with t from 0 to 1. The point of its line that is nearest to the generator is
    # at t = middle, and the line is in the disc from t = middle - half to t = middle + half.
    middles = -(edges.starts * steps).sum(axis=1) / squared_lengths
    nearest = edges.starts + middles[:, None] * steps
    squared_halves = (edge_radii * edge_radii - (nearest * nearest).sum(axis=1)) / squared_lengths
    halves = np.sqrt(np.maximum(squared_halves, 0.0))
    inner_starts = edges.starts + np.clip(middles - halves, 0.0, 1.0)[:, None] * steps
    inner_ends = edges.starts + np.clip(middles + halves, 0.0, 1.0)[:, None] * steps
    return _CutEdges(
        inner_starts=inner_starts,
        inner_ends=inner_ends,
        arcs_before=_build_arcs(edges.starts, inner_starts),
        arcs_after=_build_arcs(inner_ends, edges.ends),
    )


def _build_arcs(starts: FloatArray, ends: FloatArray) -> _Arcs:
    """Return the arcs from the directions of starts to those of ends, (e, 2) m relative to the generators."""
    start_x, start_y = starts.T
    end_x, end_y = ends.T
    cross = start_x * end_y - start_y * end_x
    dot = start_x * end_x + start_y * end_y
    return _Arcs(start_angles=np.arctan2(start_y, start_x), turns=np.arctan2(cross, dot))
