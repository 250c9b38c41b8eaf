"""Stairs of cells: flights of short sides that stand for a wall at an angle to the grid.

Every short side between two opposite turns becomes its midpoint. These midpoints lie along the wall to
within a third of a cell, so that lines fitted to them are better than lines through corners of cells.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray, concatenate_ranges
from robocov_app.formats.geometry.simplification.ring_vertices import RingVertices
from robocov_app.formats.geometry.vectors import compute_cross, intersect_lines, project_onto_lines

_MIN_STAIRS_TOLERANCE = 0.75
"""Tolerance, in cells, above which stairs are replaced by lines."""
_MIN_STAIRS_SIZE = 8.0
"""Side, in cells, of the square that is as large as the smallest ring whose stairs are replaced."""
_MIN_MIDPOINTS = 3
"""Number of midpoints that a line is fitted to."""
_MIN_SINE = 0.2
"""Sine of the angle between two lines below which their intersection is not used."""


def replace_stairs(outline: RingVertices, cell: float, tolerance: Array) -> RingVertices:
    """Replace the short sides of stairs by their midpoints.

    Parameters
    ----------
    outline : RingVertices
        Outline of cells.
    cell : float, m
    tolerance : (k,) array, m

    Returns
    -------
    RingVertices
        Its ``source`` refers to the vertices of the outline.
    """
    points = outline.points
    after = outline.after
    turn = np.sign(np.round(compute_cross(outline.sides[outline.before], outline.sides) / cell**2, 6))
    # The steps of a small ring are its shape, not the stairs of a wall.
    is_large = np.sqrt(np.abs(outline.areas)) >= _MIN_STAIRS_SIZE * cell
    is_loose = (tolerance >= _MIN_STAIRS_TOLERANCE * cell) & is_large[outline.ring]
    is_short = outline.lengths <= cell * (1 + 1e-6)
    is_step = is_short & (turn * turn[after] < 0) & is_loose & is_loose[after]
    # Each vertex is followed by the midpoint of the side after it; at most one of both remains.
    is_kept = np.column_stack([~(is_step | is_step[outline.before]), is_step]).ravel()
    with_midpoints = np.stack([points, (points + points[after]) / 2], axis=1).reshape(-1, 2)
    source = np.column_stack([outline.source, outline.source + 0.5]).ravel()
    starts = np.append(0, np.cumsum(is_kept))[2 * outline.starts]
    return RingVertices(with_midpoints[is_kept], starts, source[is_kept])


def fit_walls(path: RingVertices, kept: IntArray, drawing: RingVertices, tolerance: Array) -> RingVertices:
    """Move the sides of a drawing onto the stairs that they stand for, and restore cut corners.

    A side that stands for stairs becomes the least-squares line of their midpoints, and ends where that line
    meets its neighbors. A short side between two long ones that meet nearby is a cut corner.

    Parameters
    ----------
    path : RingVertices
        Result of `replace_stairs`.
    kept : (m,) array of int
        Vertices of the path that the drawing consists of.
    drawing : RingVertices
    tolerance : (m,) array, m

    Returns
    -------
    RingVertices
    """
    points = drawing.points
    stairs = _fit_stairs(path, kept, drawing)
    move = _move_to_stairs(drawing, stairs)
    move[~(stairs.is_stairs | stairs.is_stairs[drawing.before])] = 0.0
    move[np.hypot(*move.T) > 2 * tolerance] = 0.0
    corners = _find_cut_corners(drawing, stairs, tolerance)
    move[corners.is_cut] = corners.positions[corners.is_cut] - points[corners.is_cut]
    # The second end of a cut corner is dropped.
    is_kept = ~corners.is_cut[drawing.before]
    starts = np.searchsorted(drawing.ring[is_kept], np.arange(len(drawing.starts)))
    return RingVertices((points + move)[is_kept], starts, drawing.source[is_kept])


class _StairLines(NamedTuple):
    """A line for each of m sides: a point on it, m, and its direction; and which sides stand for stairs."""

    is_stairs: BoolArray
    origins: Array
    directions: Array


class _CutCorners(NamedTuple):
    """Which sides are cut corners, (m,), and where these corners are, (m, 2) m."""

    is_cut: BoolArray
    positions: Array


def _fit_stairs(path: RingVertices, kept: IntArray, drawing: RingVertices) -> _StairLines:
    """Fit a line to the midpoints of stairs that each side stands for, else take the side itself."""
    count = path.size[drawing.ring]
    first = path.starts[drawing.ring]
    # The vertices of the path between each kept vertex and the next one, around the ring.
    length = np.maximum((kept[drawing.after] - kept) % count - 1, 0)
    side = np.arange(len(kept)).repeat(length)
    inner = first[side] + (concatenate_ranges(kept + 1, length) - first[side]) % count[side]
    is_midpoint = path.source[inner] % 1.0 != 0.0
    side = side[is_midpoint]
    inner = inner[is_midpoint]
    number = np.bincount(side, minlength=len(kept))

    def average(values: Array) -> Array:
        return np.asarray(np.bincount(side, values, len(kept)) / np.maximum(number, 1))

    # Relative to the first vertex of the side, as squares of large coordinates would cancel.
    x, y = (path.points[inner] - drawing.points[side]).T
    center = np.column_stack([average(x), average(y)])
    x = x - center[side, 0]
    y = y - center[side, 1]
    angle = np.arctan2(2 * average(x * y), average(x * x) - average(y * y)) / 2
    fitted = np.column_stack([np.cos(angle), np.sin(angle)])
    is_stairs = (number >= _MIN_MIDPOINTS) & (2 * number >= length)
    chord = drawing.sides / np.maximum(drawing.lengths, 1e-300)[:, None]
    return _StairLines(
        is_stairs,
        origins=np.where(is_stairs[:, None], drawing.points + center, drawing.points),
        directions=np.where(is_stairs[:, None], fitted, chord),
    )


def _move_to_stairs(drawing: RingVertices, lines: _StairLines) -> Array:
    """Return the vectors from the vertices to where the lines before and after them meet, (m, 2) m."""
    before = drawing.before
    previous_origins = lines.origins[before]
    previous_directions = lines.directions[before]
    meeting, sine = intersect_lines(previous_origins, previous_directions, lines.origins, lines.directions)
    # Almost parallel lines have no accurate intersection; the vertex is placed half-way between them.
    first_foot = project_onto_lines(drawing.points, previous_origins, previous_directions)
    second_foot = project_onto_lines(drawing.points, lines.origins, lines.directions)
    middle = (first_foot + second_foot) / 2
    return np.asarray(np.where(np.abs(sine)[:, None] > _MIN_SINE, meeting, middle) - drawing.points)


def _find_cut_corners(drawing: RingVertices, lines: _StairLines, tolerance: Array) -> _CutCorners:
    """Find short sides between two long ones that meet nearby."""
    points = drawing.points
    after = drawing.after
    before = drawing.before
    length = drawing.lengths
    # A side is only cut if both of its ends may move.
    allowed = np.minimum(tolerance, tolerance[after])
    is_long = length > 4 * allowed
    positions, sine = intersect_lines(
        lines.origins[before], lines.directions[before], lines.origins[after], lines.directions[after]
    )
    is_cut = np.abs(sine) > _MIN_SINE
    is_cut &= ~lines.is_stairs & (allowed > 0.0) & (length <= 2 * allowed)
    is_cut &= is_long[before] & is_long[after]
    for end in (points, points[after]):
        is_cut &= np.hypot(*(positions - end).T) <= 2 * allowed
    return _CutCorners(is_cut, positions)
