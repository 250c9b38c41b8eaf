"""Stairs of cells: runs of short sides that represent a wall oblique to the grid.

Every short side between a left and a right turn is replaced by its midpoint. The midpoints are within a third
of a cell of the wall, so lines fitted to them are more accurate than lines through corners of cells.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import concatenate_ranges
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.geometry.simplification.ring_vertices import RingVertices
from robocov_app.formats.geometry.vectors import compute_cross, intersect_lines, project_onto_lines

_MIN_STAIRS_TOLERANCE = 0.75
"""Minimum tolerance, in cells, at which stairs are replaced by lines."""
_MIN_STAIRS_SIZE = 8.0
"""Minimum size of a ring whose stairs are replaced: square root of its area, in cells."""
_MIN_MIDPOINTS = 3
"""Minimum number of midpoints to which a line is fitted."""
_MIN_SINE = 0.2
"""Two lines are intersected only if the sine of the angle between them is larger."""


def replace_stairs(outline: RingVertices, cell: float, tolerance: FloatArray) -> RingVertices:
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
    # Each vertex is followed by the midpoint of the next side. At most one of the two remains.
    is_kept = np.column_stack([~(is_step | is_step[outline.before]), is_step]).ravel()
    with_midpoints = np.stack([points, (points + points[after]) / 2], axis=1).reshape(-1, 2)
    source = np.column_stack([outline.source, outline.source + 0.5]).ravel()
    starts = np.append(0, np.cumsum(is_kept))[2 * outline.starts]
    return RingVertices(with_midpoints[is_kept], starts, source[is_kept])


def fit_walls(
    path: RingVertices, kept: IntArray, simplified: RingVertices, tolerance: FloatArray
) -> RingVertices:
    """Move simplified sides onto the walls that their stairs represent, and restore cut corners.

    A side that represents stairs becomes the least-squares line through their midpoints, and ends where that
    line meets the lines of the adjacent sides. A short side between two long ones whose lines meet nearby is
    a cut corner, and is replaced by the point where they meet.

    Parameters
    ----------
    path : RingVertices
        Result of `replace_stairs`.
    kept : (m,) array of int
        Indices of the path's vertices that form the simplified outline.
    simplified : RingVertices
    tolerance : (m,) array, m

    Returns
    -------
    RingVertices
    """
    points = simplified.points
    stairs = _fit_stairs(path, kept, simplified)
    move = _move_to_stairs(simplified, stairs)
    # Only vertices next to stairs move, and only up to twice the tolerance.
    move[~(stairs.is_stairs | stairs.is_stairs[simplified.before])] = 0.0
    move[np.hypot(*move.T) > 2 * tolerance] = 0.0
    corners = _find_cut_corners(simplified, stairs, tolerance)
    move[corners.is_cut] = corners.positions[corners.is_cut] - points[corners.is_cut]
    # The side of a cut corner becomes one point: its first end moves there, its second end is dropped.
    is_kept = ~corners.is_cut[simplified.before]
    starts = np.searchsorted(simplified.ring[is_kept], np.arange(len(simplified.starts)))
    return RingVertices((points + move)[is_kept], starts, simplified.source[is_kept])


class _StairLines(NamedTuple):
    """A line for each of m sides, as a point on it, m, and a direction; and which sides represent stairs."""

    is_stairs: BoolArray
    origins: FloatArray
    directions: FloatArray


class _CutCorners(NamedTuple):
    """Mask of the m sides that are cut corners, and the position of each corner, (m, 2) m."""

    is_cut: BoolArray
    positions: FloatArray


def _fit_stairs(path: RingVertices, kept: IntArray, simplified: RingVertices) -> _StairLines:
    """Fit a line to the midpoints of the stairs that each side represents; other sides are their own line."""
    count = path.size[simplified.ring]
    first = path.starts[simplified.ring]
    # The vertices of the path between each kept vertex and the next, which may be past the end of the ring.
    length = np.maximum((kept[simplified.after] - kept) % count - 1, 0)
    side = np.arange(len(kept)).repeat(length)
    inner = first[side] + (concatenate_ranges(kept + 1, length) - first[side]) % count[side]
    is_midpoint = path.source[inner] % 1.0 != 0.0
    side = side[is_midpoint]
    inner = inner[is_midpoint]
    number = np.bincount(side, minlength=len(kept))

    def average(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(side, values, len(kept)) / np.maximum(number, 1))

    # Relative to the first vertex of the side, to avoid cancellation in the squares of large coordinates.
    x, y = (path.points[inner] - simplified.points[side]).T
    center = np.column_stack([average(x), average(y)])
    x = x - center[side, 0]
    y = y - center[side, 1]
    # Principal axis of the midpoints, which is their total least-squares line.
    angle = np.arctan2(2 * average(x * y), average(x * x) - average(y * y)) / 2
    fitted = np.column_stack([np.cos(angle), np.sin(angle)])
    is_stairs = (number >= _MIN_MIDPOINTS) & (2 * number >= length)
    chord = simplified.sides / np.maximum(simplified.lengths, 1e-300)[:, None]
    return _StairLines(
        is_stairs,
        origins=np.where(is_stairs[:, None], simplified.points + center, simplified.points),
        directions=np.where(is_stairs[:, None], fitted, chord),
    )


def _move_to_stairs(simplified: RingVertices, lines: _StairLines) -> FloatArray:
    """Return the vector, (m, 2) m, from each vertex to the point where the lines before and after it meet."""
    before = simplified.before
    previous_origins = lines.origins[before]
    previous_directions = lines.directions[before]
    meeting, sine = intersect_lines(previous_origins, previous_directions, lines.origins, lines.directions)
    # Nearly parallel lines have no accurate intersection; the vertex is placed midway between them.
    first_foot = project_onto_lines(simplified.points, previous_origins, previous_directions)
    second_foot = project_onto_lines(simplified.points, lines.origins, lines.directions)
    middle = (first_foot + second_foot) / 2
    return np.asarray(np.where(np.abs(sine)[:, None] > _MIN_SINE, meeting, middle) - simplified.points)


def _find_cut_corners(simplified: RingVertices, lines: _StairLines, tolerance: FloatArray) -> _CutCorners:
    """Find short sides between two long ones whose lines meet nearby, without those for stairs."""
    points = simplified.points
    after = simplified.after
    before = simplified.before
    length = simplified.lengths
    # Both ends of a side must be allowed to move.
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
