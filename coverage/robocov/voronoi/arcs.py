"""Boundaries that consist of segments and circular arcs: moments, chords and closed rings.

A piece of a boundary is a segment or an arc of at most half a circle. It is a row of an array, whose columns
are named below. The *half angle* is half of the angle that an arc spans about the center of its circle, from
-pi/2 to pi/2. It is positive if the arc turns left, and zero for a segment. An arc that is almost a segment
keeps its full precision, however large its radius is.

By Green's theorem, the moments of a cell are sums over its pieces. Each piece adds the moments of the
triangle between its chord and the origin, and those of the circular segment between its chord and its arc.
"""

from math import comb

import numpy as np

from robocov.arrays import compute_lengths
from robocov.compiled import kernel
from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, POLAR_MOMENT
from robocov.typing import FloatArray

START_X = 0
"""Column of a piece: x of its start relative to the generator, m."""
START_Y = 1
"""Column of a piece: y of its start, m."""
END_X = 2
"""Column of a piece: x of its end, m."""
END_Y = 3
"""Column of a piece: y of its end, m."""
HALF_ANGLE = 4
"""Column of a piece: its half angle, rad."""
CELL = 5
"""Column of a piece: the cell that it bounds."""
OTHER_CELL = 6
"""Column of a piece: the cell on the other side, or `robocov.density.cell_edges.REGION`."""
PIECE_COLUMNS = 7
"""Number of columns of a piece."""

_MAX_SERIES_SQUARED_SINE = 0.04
"""sin² of the half angle up to which the series is used, because the closed form loses precision there."""

_SERIES_TERMS = 13
"""Number of terms of the series, with which the error is less than that of rounding."""
_SERIES = np.array([2.0 * comb(2 * m, m) / 4.0**m / (2 * m + 3) for m in range(_SERIES_TERMS, 0, -1)])
"""Coefficients of the power series of (x - sin x cos x - 2/3 sin³ x) / sin⁵ x in sin² x, the highest power
first."""

_MIN_DIVISOR = 1e-300
"""Minimum divisor; prevents division by zero."""
_MIN_CHORD_HALF_ANGLE = 1e-3
"""Half angle of the shortest chords that replace an arc, rad."""


def compute_moments(pieces: FloatArray, cell_count: int) -> FloatArray:
    """Compute the moments of cells from the pieces of their boundaries.

    Parameters
    ----------
    pieces : (p, 6 or more) array
        The pieces of all cells in any order, each relative to the generator of its cell.
    cell_count : int
        Number of cells n.

    Returns
    -------
    (n, 4) array
        Area (m²), first moments in x and y (m³) and polar moment (m⁴) of each cell about its generator.
    """
    return np.asarray(_compute_moments(np.ascontiguousarray(pieces), cell_count, _SERIES))


@kernel
def _compute_moments(pieces: FloatArray, cell_count: int, series: FloatArray) -> FloatArray:
    """Return the areas, first moments in x and y, and polar moments of the cells, (n, 4).

    By Green's theorem, each piece of a boundary adds the moments of the triangle between its chord and the
    generator, and those of the circular segment between its chord and its arc.
    """
    moments = np.zeros((cell_count, 4))
    for k in range(len(pieces)):
        start_x = pieces[k, START_X]
        start_y = pieces[k, START_Y]
        end_x = pieces[k, END_X]
        end_y = pieces[k, END_Y]
        cross = start_x * end_y - end_x * start_y
        sum_x = start_x + end_x
        sum_y = start_y + end_y
        middle_x = 0.5 * sum_x
        middle_y = 0.5 * sum_y
        # The normal points to the right of the chord, and has the same length.
        normal_x = end_y - start_y
        normal_y = start_x - end_x
        squared_length = normal_x * normal_x + normal_y * normal_y
        # The moments of the circular segment. The first moment lacks one factor of the length of the chord,
        # which the normal contains.
        unit_area, unit_first_moment, unit_polar_moment = _compute_segment_moments(
            pieces[k, HALF_ANGLE], series
        )
        area = unit_area * squared_length
        first_moment = unit_first_moment * squared_length
        polar_moment = unit_polar_moment * squared_length * squared_length
        i = int(pieces[k, CELL])
        moments[i, MASS] += 0.5 * cross + area
        moments[i, MOMENT_X] += middle_x * (cross / 3.0 + area) + first_moment * normal_x
        moments[i, MOMENT_Y] += middle_y * (cross / 3.0 + area) + first_moment * normal_y
        # The polar moment of the triangle with the corners 0, s and e is cross (s·s + s·e + e·e) / 12. That
        # of the circular segment is about the middle of the chord. By the parallel axis theorem, it is
        # converted to that about the generator.
        sum_of_products = start_x * sum_x + end_x * end_x + start_y * sum_y + end_y * end_y
        shift = first_moment * (middle_x * normal_x + middle_y * normal_y)
        squared_middle = middle_x * middle_x + middle_y * middle_y
        moments[i, POLAR_MOMENT] += (
            cross * sum_of_products / 12.0 + polar_moment + 2.0 * shift + area * squared_middle
        )
    return moments


@kernel
def _compute_segment_moments(half_angle: float, series: FloatArray) -> tuple[float, float, float]:
    """Return the area, first moment and polar moment of the circular segment on a chord of length 1.

    The first moment is about the line of the chord, and positive on the side away from the center of the
    circle. The polar moment is about the middle of the chord. Let x be the half angle, s its sine and c its
    cosine. The usual formulas, such as (x - s c) / (4 s²) for the area, subtract almost equal numbers if x is
    small. They are therefore rewritten in terms of h = (x - s c - 2/3 s³) / s⁵, which tends to 1/5 as x tends
    to 0: the area, for example, is s (2/3 + s² h) / 4. If x is small, h is evaluated by a power series in s²,
    whose coefficients are in `series`, the highest power first.
    """
    s = np.sin(half_angle)
    c = np.cos(half_angle)
    squared_sine = s * s
    if squared_sine > _MAX_SERIES_SQUARED_SINE:
        h = ((half_angle - s * c) / s**3 - 2.0 / 3.0) / squared_sine
    else:
        # Horner's method.
        h = 0.0
        for coefficient in series:
            h = h * squared_sine + coefficient
    area = s * (2.0 / 3.0 + squared_sine * h) / 4.0
    first_moment = squared_sine * (2.0 / 3.0 / (1.0 + c) - c * h) / 8.0
    polar_moment = s * (1.0 / (1.0 + c) - 2.0 / 3.0 + (1.5 - squared_sine) * h) / 16.0
    return area, first_moment, polar_moment


def split_into_chords(pieces: FloatArray, max_deviation: float) -> list[FloatArray]:
    """Compute the chords that replace each piece.

    Parameters
    ----------
    pieces : (p, 5 or more) array
        The pieces. Of the columns at the top of this module, the first five are used.
    max_deviation : float, m
        Maximum distance of a chord from its arc.

    Returns
    -------
    list of (k, 2) arrays, m
        The ends of the chords of each piece in order, including both ends of the piece.
    """
    return [_split_piece(piece, max_deviation) for piece in pieces[:, :CELL].tolist()]


def _split_piece(piece: list[float], max_deviation: float) -> FloatArray:
    """Return the ends of the chords that replace a piece, (k, 2) m. A segment is a single chord."""
    start_x, start_y, end_x, end_y, half_angle = piece
    dx = end_x - start_x
    dy = end_y - start_y
    chord_count = _count_chords(np.hypot(dx, dy), half_angle, max_deviation)
    if chord_count == 1:
        return np.array([[start_x, start_y], [end_x, end_y]])
    angles = half_angle * np.linspace(-1.0, 1.0, chord_count + 1)
    # Coordinates along the line between the ends of the arc, and to its right, as fractions of the distance
    # of the ends. On a circle of radius r, this distance is 2 r sin(half_angle).
    along = 0.5 + 0.5 * np.sin(angles) / np.sin(half_angle)
    rightward = 0.5 * (np.cos(angles) - np.cos(half_angle)) / np.sin(half_angle)
    vertex_x = start_x + along * dx + rightward * dy
    vertex_y = start_y + along * dy - rightward * dx
    vertices = np.column_stack([vertex_x, vertex_y])
    # The first and the last vertex are exact, so that adjacent pieces meet.
    vertices[0] = start_x, start_y
    vertices[-1] = end_x, end_y
    return vertices


def _count_chords(length: float, half_angle: float, max_deviation: float) -> int:
    """Return the number of chords that replace an arc whose ends are at the distance `length`."""
    radius = 0.5 * length / max(abs(np.sin(half_angle)), _MIN_DIVISOR)
    # A chord of half angle x deviates from its arc of radius r by r (1 - cos x), which is at most r x² / 2.
    if radius * half_angle**2 < 2.0 * max_deviation:
        return 1
    # With this limit of the ratio, the half angle of a chord is at most 1 rad, however small the radius is.
    ratio = min(max_deviation / max(radius, _MIN_DIVISOR), 0.5)
    max_half_angle = np.sqrt(2.0 * ratio)
    return int(np.ceil(abs(half_angle) / max(max_half_angle, _MIN_CHORD_HALF_ANGLE)))


def link_rings(pieces: FloatArray, max_deviation: float) -> list[FloatArray]:
    """Link pieces into closed rings, in which chords replace the arcs.

    Parameters
    ----------
    pieces : (p, 5 or more) array
        The pieces in any order. Each ends where another one starts, up to rounding.
    max_deviation : float, m
        Maximum distance of a chord from its arc.

    Returns
    -------
    list of (k, 2) arrays, m
        Vertices of each ring; the first vertex is not repeated. If the pieces run counter-clockwise around an
        area, so do the outer rings, and the holes run clockwise.
    """
    # Each ring starts with any of the remaining pieces. It is continued by the piece whose start is nearest
    # to its end, and closed if its own start is at least as near.
    lines = split_into_chords(pieces, max_deviation)
    starts = pieces[:, :END_X]
    ends = pieces[:, END_X:HALF_ANGLE]
    remaining = list(range(len(pieces)))
    rings = []
    while remaining:
        first = remaining.pop(0)
        last = first
        ring = [lines[first][:-1]]
        while remaining:
            gap_to_first = compute_lengths(starts[first] - ends[last])
            gaps = compute_lengths(starts[remaining] - ends[last])
            if gap_to_first <= gaps.min():
                # The ring is closed.
                break
            last = remaining.pop(int(gaps.argmin()))
            ring.append(lines[last][:-1])
        rings.append(np.concatenate(ring))
    return rings
