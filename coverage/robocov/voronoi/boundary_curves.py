"""Boundaries of the cells of robots of different speeds: pieces of lines and circles.

In coordinates relative to the generator, every curve that may bound a cell has an equation a |q|² + b q = c,
and the cell lies on the side where a |q|² + b q <= c. The curve is a line (a = 0), a circle around the cell
(a > 0), or a circle around an area outside the cell (a < 0). With the coefficients scaled so that
b² + 4 a c = 1, the product g = b b' + 2 (a c' + a' c) of two curves is like the scalar product of unit
vectors: it is the cosine of the angle at which the curves meet, and they intersect in two points if |g| < 1.

Let r n be the point of a curve that is nearest to the generator, where n is a unit vector, and let u be n
turned left by 90°. With the curvature k = 2 a, the points of the curve are

    q(t) = r n + (2 t u - 2 k t² n) / (1 + k² t²).

On a line, the parameter t is half the distance from the nearest point. On a circle, k t is the tangent of
half the angle from the nearest point, seen from the center. The cell is to the left of the curve.

The condition that q(t) is on the cell's side of another curve is quadratic in t, so that both intersections
follow from the same square root. Each intersection is computed only once, and used as the same point of both
curves, so that the boundaries fit together.

A curve is a row of an array, whose columns are named below.
"""

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.density.cell_edges import REGION
from robocov.observation.region import SIDE_NORMAL_X, SIDE_NORMAL_Y, SIDE_OFFSET
from robocov.typing import BoolArray, FloatArray
from robocov.voronoi.arcs import (
    CELL,
    END_X,
    END_Y,
    HALF_ANGLE,
    OTHER_CELL,
    PIECE_COLUMNS,
    START_X,
    START_Y,
)
from robocov.voronoi.clipping import (
    EDGE_CELL,
    EDGE_END_X,
    EDGE_END_Y,
    EDGE_OTHER_CELL,
    EDGE_START_X,
    EDGE_START_Y,
)

_NORMAL_X = 0
"""Column of a curve: x of the unit vector n from the generator toward the nearest point."""
_NORMAL_Y = 1
"""Column of a curve: y of this unit vector."""
_DISTANCE = 2
"""Column of a curve: distance r of the nearest point from the generator, m."""
_COEFFICIENT = 3
"""Column of a curve: coefficient a of its equation, 1/m."""
_START = 4
"""Column of a curve: start of the interval of t in which the curve may bound the cell, m."""
_END = 5
"""Column of a curve: end of this interval, m."""
_CURVE_CELL = 6
"""Column of a curve: the cell that it may bound."""
_CURVE_OTHER_CELL = 7
"""Column of a curve: the cell on the other side, or `REGION`."""
_CURVE_COLUMNS = 8
"""Number of columns of a curve."""

PAIR_ROBOT = 0
"""Column of a pair: the robot."""
PAIR_NEIGHBOR = 1
"""Column of a pair: its neighbor."""
PAIR_DX = 2
"""Column of a pair: offset in x to the neighbor's position as known to the robot, m."""
PAIR_DY = 3
"""Column of a pair: offset in y, m."""
PAIR_OWN_SPEED = 4
"""Column of a pair: speed of the robot, m/s."""
PAIR_OTHER_SPEED = 5
"""Column of a pair: speed of the neighbor, m/s."""

_ENTER = 0
"""Column of a crossing: value of t at which a curve enters the cell's side of another curve."""
_LEAVE = 1
"""Column of a crossing: value of t at which a curve leaves the cell's side of another curve."""

_SPARE_PIECES = 64
"""Initial space for pieces, in addition to one for each edge."""

_MIN_SQUARED_SINE = 1e-29
"""Minimum sin² of the angle between two curves for which their intersections are computed.

At smaller angles, only rounding errors would decide whether and where the curves meet. They are then treated
as if they did not intersect, which moves no boundary by more than a rounding error.
"""


class _Equation(NamedTuple):
    """The coefficients of the equation a |q|² + b q = c of a curve, scaled so that b² + 4 a c = 1."""

    a: float
    """Half of the curvature, 1/m."""
    bx: float
    """x of the vector b."""
    by: float
    """y of the vector b."""
    c: float
    """Right side of the equation, m."""


class _Intersection(NamedTuple):
    """Intersection of two curves, in terms of the parameter t of the first one."""

    enter: float
    """Parameter t at which the first curve enters the cell's side of the second one, m; nan if the curves do
    not intersect."""
    leave: float
    """Parameter t at which the first curve leaves that side, m; nan if the curves do not intersect."""
    is_first_outside: bool
    """Whether the first curve is nowhere on the cell's side of the second one."""
    is_second_outside: bool
    """Whether the second curve is nowhere on the cell's side of the first one."""


@kernel
def trace_boundaries(
    points: FloatArray, sides: FloatArray, pairs: FloatArray, edges: FloatArray, is_straight: BoolArray
) -> FloatArray:
    """Find the pieces of the boundaries of all cells.

    If only the region and the neighbors of the same speed bounded it, a cell would be a convex polygon. The
    edges of this polygon are given. The circles of Apollonius between robots of different speeds cut parts
    off it. The sections of each edge and of each circle that are on the cell's side of all other curves are
    divided into pieces.

    Parameters
    ----------
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    pairs : (m, 6) array
        Pairs of a robot and a neighbor, sorted by robot. For the columns, see the constants `PAIR_...`.
    edges : (e, 6) array
        Edges of the polygons, sorted by cell. For the columns, see the constants `EDGE_...` of
        `robocov.voronoi.clipping`.
    is_straight : (n,) bool array
        Output: whether each cell is bounded by these edges alone.

    Returns
    -------
    (p, 7) array
        The pieces, sorted by cell. For the columns, see `robocov.voronoi.arcs`.
    """
    pieces = np.empty((len(edges) + _SPARE_PIECES, PIECE_COLUMNS))
    piece_count = 0
    first_pair = 0
    first_edge = 0
    for i in range(len(points)):
        end_pair = _find_group_end(pairs, PAIR_ROBOT, i, first_pair)
        end_edge = _find_group_end(edges, EDGE_CELL, i, first_edge)
        own_pairs = pairs[first_pair:end_pair]
        own_edges = edges[first_edge:end_edge]
        first_pair = end_pair
        first_edge = end_edge
        if _is_cell_empty(own_pairs):
            is_straight[i] = False
            continue
        line_count = len(own_edges)
        curves = np.empty((line_count + len(own_pairs), _CURVE_COLUMNS))
        # The lines are counted here, but written only if there are circles. Without circles, the cell is the
        # polygon that the edges bound.
        curve_count = _write_circles(curves, own_pairs, own_edges)
        is_straight[i] = curve_count == line_count
        if is_straight[i]:
            pieces = _reserve(pieces, piece_count, line_count)
            piece_count = _add_edges(own_edges, pieces, piece_count)
        else:
            _write_lines(curves, own_pairs, own_edges, sides, points[i])
            pieces, piece_count = _add_boundaries(curves[:curve_count], line_count, pieces, piece_count)
    return pieces[:piece_count]


@kernel
def _add_boundaries(
    curves: FloatArray, line_count: int, pieces: FloatArray, piece_count: int
) -> tuple[FloatArray, int]:
    """Add the pieces of the boundary of a cell to the array of pieces, from row `piece_count` on.

    The first `line_count` curves are lines, and the others circles. Return the array, which is a larger copy
    if there was too little space, and the new number of pieces.
    """
    curve_count = len(curves)
    crossings = np.empty((curve_count, curve_count, 2))
    gaps = np.empty((curve_count, 2))
    _find_crossings(curves, line_count, crossings)
    # Each other curve cuts at most one gap into a curve, which leaves at most `curve_count` sections. Only a
    # section with the parameter 0 in its interior becomes two pieces.
    max_new_pieces = curve_count + 1
    for c in range(curve_count):
        pieces = _reserve(pieces, piece_count, max_new_pieces)
        piece_count = _add_boundary(curves[c], crossings[c], gaps, pieces, piece_count)
    return pieces, piece_count


@kernel
def _find_group_end(table: FloatArray, column: int, value: int, first_row: int) -> int:
    """Return the end of the rows, from `first_row` on, in which a column of a sorted table has a value."""
    row = first_row
    while row < len(table) and table[row, column] == value:
        row += 1
    return row


@kernel
def _reserve(pieces: FloatArray, piece_count: int, new_pieces: int) -> FloatArray:
    """Return the array of pieces if it has space for a number of new pieces, and otherwise a larger copy."""
    if piece_count + new_pieces <= len(pieces):
        return pieces
    larger = np.empty((2 * (piece_count + new_pieces), PIECE_COLUMNS))
    larger[:piece_count] = pieces[:piece_count]
    return larger


@kernel
def _add_edges(edges: FloatArray, pieces: FloatArray, piece_count: int) -> int:
    """Append edges to the pieces, as pieces whose half angle is 0; return the new number of pieces."""
    for e in range(len(edges)):
        pieces[piece_count, START_X] = edges[e, EDGE_START_X]
        pieces[piece_count, START_Y] = edges[e, EDGE_START_Y]
        pieces[piece_count, END_X] = edges[e, EDGE_END_X]
        pieces[piece_count, END_Y] = edges[e, EDGE_END_Y]
        pieces[piece_count, HALF_ANGLE] = 0.0
        pieces[piece_count, CELL] = edges[e, EDGE_CELL]
        pieces[piece_count, OTHER_CELL] = edges[e, EDGE_OTHER_CELL]
        piece_count += 1
    return piece_count


@kernel
def _is_cell_empty(pairs: FloatArray) -> bool:
    """Return whether the cell of a robot is empty because a faster robot is at the same position."""
    for k in range(len(pairs)):
        squared_distance = pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2
        if squared_distance == 0.0 and pairs[k, PAIR_OTHER_SPEED] > pairs[k, PAIR_OWN_SPEED]:
            return True
    return False


@kernel
def _write_circles(curves: FloatArray, pairs: FloatArray, edges: FloatArray) -> int:
    """Write the circles that may bound a cell to `curves`, after the rows of its lines.

    Two robots of speeds v and w, at a distance d from each other, arrive at the points of a circle at the
    same time. The point that is nearest to the first robot is on the line between them, at the distance d v /
    (v + w). Circles that are farther away than all points of the cell are left out. Return the number of
    lines and circles.
    """
    max_distance = _bound_distance(pairs, edges)
    curve_count = len(edges)
    for k in range(len(pairs)):
        own_speed = pairs[k, PAIR_OWN_SPEED]
        other_speed = pairs[k, PAIR_OTHER_SPEED]
        distance = np.sqrt(pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2)
        circle_distance = distance * (own_speed / (own_speed + other_speed))
        if own_speed != other_speed and distance > 0.0 and circle_distance < max_distance:
            curves[curve_count, _NORMAL_X] = pairs[k, PAIR_DX] / distance
            curves[curve_count, _NORMAL_Y] = pairs[k, PAIR_DY] / distance
            curves[curve_count, _DISTANCE] = circle_distance
            # The coefficient a of the curve a |q|² + b q = c is (w² - v²) / (2 v w d).
            difference_of_squares = (other_speed - own_speed) * (own_speed + other_speed)
            curves[curve_count, _COEFFICIENT] = (
                0.5 * (difference_of_squares / (own_speed * other_speed)) / distance
            )
            curves[curve_count, _START] = -np.inf
            curves[curve_count, _END] = np.inf
            curves[curve_count, _CURVE_CELL] = pairs[k, PAIR_ROBOT]
            curves[curve_count, _CURVE_OTHER_CELL] = pairs[k, PAIR_NEIGHBOR]
            curve_count += 1
    return curve_count


@kernel
def _bound_distance(pairs: FloatArray, edges: FloatArray) -> float:
    """Return an upper bound on the distance of the points of a cell from its generator, m.

    The edges bound a convex polygon that contains the cell. A circle of Apollonius around the robot, which is
    the border to a faster robot, may limit the cell further.
    """
    max_distance = 0.0
    for e in range(len(edges)):
        max_distance = max(max_distance, np.sqrt(edges[e, EDGE_START_X] ** 2 + edges[e, EDGE_START_Y] ** 2))
    for k in range(len(pairs)):
        own_speed = pairs[k, PAIR_OWN_SPEED]
        other_speed = pairs[k, PAIR_OTHER_SPEED]
        if other_speed > own_speed:
            distance = np.sqrt(pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2)
            # The point of the circle that is farthest from the robot is on the side away from the faster
            # robot.
            max_distance = min(max_distance, distance * own_speed / (other_speed - own_speed))
    return max_distance


@kernel
def _write_lines(
    curves: FloatArray, pairs: FloatArray, edges: FloatArray, sides: FloatArray, point: FloatArray
) -> None:
    """Write the edges of a cell to the first rows of `curves`, as lines that start and end at their vertices.

    The line of an edge is either the bisector to a neighbor, or a side of the region.
    """
    for e in range(len(edges)):
        if edges[e, EDGE_OTHER_CELL] != REGION:
            _write_bisector(curves[e], pairs, edges[e, EDGE_OTHER_CELL])
        else:
            _write_side(curves[e], edges[e], sides, point)
        normal_x = curves[e, _NORMAL_X]
        normal_y = curves[e, _NORMAL_Y]
        curves[e, _COEFFICIENT] = 0.0
        # On a line, t is half the signed distance from the point nearest to the generator.
        curves[e, _START] = 0.5 * (normal_x * edges[e, EDGE_START_Y] - normal_y * edges[e, EDGE_START_X])
        curves[e, _END] = 0.5 * (normal_x * edges[e, EDGE_END_Y] - normal_y * edges[e, EDGE_END_X])
        curves[e, _CURVE_CELL] = edges[e, EDGE_CELL]
        curves[e, _CURVE_OTHER_CELL] = edges[e, EDGE_OTHER_CELL]


@kernel
def _write_bisector(curve: FloatArray, pairs: FloatArray, neighbor: float) -> None:
    """Write the normal of the bisector to a neighbor, and its distance from the generator, to a curve.

    They do not follow from the edge, because it may be so short that rounding decides its direction.
    """
    for k in range(len(pairs)):
        if pairs[k, PAIR_NEIGHBOR] == neighbor:
            distance = np.sqrt(pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2)
            curve[_NORMAL_X] = pairs[k, PAIR_DX] / distance
            curve[_NORMAL_Y] = pairs[k, PAIR_DY] / distance
            curve[_DISTANCE] = 0.5 * distance


@kernel
def _write_side(curve: FloatArray, edge: FloatArray, sides: FloatArray, point: FloatArray) -> None:
    """Write to a curve which side of the region an edge lies on.

    The curve receives the normal of this side, and the distance of the line of the edge from the generator.
    """
    middle_x = 0.5 * (edge[EDGE_START_X] + edge[EDGE_END_X])
    middle_y = 0.5 * (edge[EDGE_START_Y] + edge[EDGE_END_Y])
    min_offset = np.inf
    for s in range(len(sides)):
        normal_x = sides[s, SIDE_NORMAL_X]
        normal_y = sides[s, SIDE_NORMAL_Y]
        distance = sides[s, SIDE_OFFSET] - (point[0] * normal_x + point[1] * normal_y)
        offset = abs(middle_x * normal_x + middle_y * normal_y - distance)
        if offset < min_offset:
            min_offset = offset
            curve[_NORMAL_X] = normal_x
            curve[_NORMAL_Y] = normal_y
            # The distance of the edge, whose ends are rounded, differs slightly from that of the side.
            curve[_DISTANCE] = normal_x * middle_x + normal_y * middle_y


@kernel
def _find_crossings(curves: FloatArray, line_count: int, crossings: FloatArray) -> None:
    """Find where each curve enters and leaves the cell's side of each other curve.

    Only the points of a curve that are on the cell's side of all other curves can bound the cell. Entry [i,
    j] of `crossings`, (k, k, 2), receives the two values of the parameter t of curve i at which it enters and
    leaves the cell's side of curve j; nan if the curves do not intersect. A curve that is nowhere on the
    cell's side of another one does not bound the cell, and its interval of t becomes empty.

    The first `line_count` curves are the edges of a convex polygon. They meet only at their ends, so no two
    of them need to be intersected.
    """
    curve_count = len(curves)
    for first in range(curve_count):
        crossings[first, first, _ENTER] = np.nan
        crossings[first, first, _LEAVE] = np.nan
        for second in range(first + 1, curve_count):
            enter = np.nan
            leave = np.nan
            are_both_edges = second < line_count
            if not are_both_edges:
                intersection = _intersect(curves[first], curves[second])
                enter = intersection.enter
                leave = intersection.leave
                if intersection.is_first_outside:
                    _make_empty(curves, first)
                if intersection.is_second_outside:
                    _make_empty(curves, second)
            crossings[first, second, _ENTER] = enter
            crossings[first, second, _LEAVE] = leave
            # The second curve crosses the first one at the same two points. Both curves have the cell on
            # their left, so one enters where the other leaves. Without crossings, all these values are nan.
            leave_x, leave_y = _evaluate(curves[first], leave)
            enter_x, enter_y = _evaluate(curves[first], enter)
            crossings[second, first, _ENTER] = _find_parameter(curves[second], leave_x, leave_y)
            crossings[second, first, _LEAVE] = _find_parameter(curves[second], enter_x, enter_y)


@kernel
def _make_empty(curves: FloatArray, curve: int) -> None:
    """Record that a curve does not bound the cell: its interval of t ends at minus infinity."""
    curves[curve, _END] = -np.inf


@kernel
def _intersect(first: FloatArray, second: FloatArray) -> _Intersection:
    """Find where a curve enters and leaves the cell's side of another one.

    The cell is on the side of the second curve where a |q|² + b q <= c. For the point q(t) of the first
    curve, this condition is quadratic in t, and its roots are the crossings. The curves meet at an angle
    whose cosine is g = b b' + 2 (a c' + a' c), so that they intersect if sin² = 1 - g² > 0.
    """
    equation = _compute_equation(second)
    # The components of b along the normal of the first curve, and to the left of it.
    normal_x = first[_NORMAL_X]
    normal_y = first[_NORMAL_Y]
    b_outward = equation.bx * normal_x + equation.by * normal_y
    # Adding 0 turns a negative zero into a positive one.
    b_leftward = equation.by * normal_x - equation.bx * normal_y + 0.0
    # On the first curve, with the distance r and the curvature k, |q|² = (r² + (2 - r k)² t²) / (1 + k² t²).
    # Multiplied by 1 + k² t², the condition is quadratic t² + 2 b_leftward t + constant <= 0.
    distance = first[_DISTANCE]
    curvature = 2.0 * first[_COEFFICIENT]
    factor = 2.0 - distance * curvature
    quadratic = (
        equation.a * factor * factor - curvature * b_outward * factor - equation.c * curvature * curvature
    )
    constant = equation.a * distance * distance + distance * b_outward - equation.c
    cosine, squared_sine = _compute_angle(_compute_equation(first), equation)
    if squared_sine > _MIN_SQUARED_SINE:
        # The roots are (-b_leftward ± sqrt) / quadratic. The curve enters at the root with the minus sign,
        # where the quadratic function falls, and leaves at the other. To avoid cancellation, only the root
        # with the larger numerator is computed in this form, and the other one as constant / numerator.
        numerator = -b_leftward - np.copysign(np.sqrt(squared_sine), b_leftward)
        if b_leftward >= 0.0:
            enter = numerator / quadratic
            leave = constant / numerator
        else:
            enter = constant / numerator
            leave = numerator / quadratic
        return _Intersection(enter, leave, is_first_outside=False, is_second_outside=False)
    # The curves do not intersect, so that the quadratic function has the same sign on the whole first curve:
    # that of `constant` at t = 0, and that of `quadratic` at infinity. Their sum has it even if one is zero.
    # If g >= 1, exactly one of the curves is on the cell's side of the other one; if g <= -1, both or neither
    # are.
    is_first_outside = quadratic + constant > 0.0
    is_second_outside = is_first_outside if cosine < 0.0 else not is_first_outside
    return _Intersection(np.nan, np.nan, is_first_outside, is_second_outside)


@kernel
def _compute_angle(first: _Equation, second: _Equation) -> tuple[float, float]:
    """Return the cosine g of the angle at which two curves meet, and its sin² = 1 - g².

    The cosine is g = b b' + 2 (a c' + a' c). At small angles, the subtraction of g² from 1 would leave only
    rounding errors. Because b² + 4 a c = 1 for both curves, sin² is also a sum of products of the 2 x 2
    determinants of their coefficients.
    """
    b_cross = first.bx * second.by - first.by * second.bx
    ac_cross = first.a * second.c - second.a * first.c
    ab_cross_x = first.bx * second.a - second.bx * first.a
    ab_cross_y = first.by * second.a - second.by * first.a
    bc_cross_x = first.bx * second.c - second.bx * first.c
    bc_cross_y = first.by * second.c - second.by * first.c
    squared_sine = b_cross * b_cross - 4.0 * ac_cross * ac_cross
    squared_sine += 4.0 * (ab_cross_x * bc_cross_x + ab_cross_y * bc_cross_y)
    cosine = first.bx * second.bx + first.by * second.by + 2.0 * (first.a * second.c + second.a * first.c)
    return cosine, squared_sine


@kernel
def _compute_equation(curve: FloatArray) -> _Equation:
    """Return the coefficients of the equation a |q|² + b q = c of a curve.

    b and c follow from b² + 4 a c = 1, and from a r² + |b| r = c at the point nearest to the generator, which
    is at the distance r in the direction of b.
    """
    a = curve[_COEFFICIENT]
    r = curve[_DISTANCE]
    b_length = 1.0 - 2.0 * a * r
    return _Equation(a, curve[_NORMAL_X] * b_length, curve[_NORMAL_Y] * b_length, r * (1.0 - a * r))


@kernel
def _add_boundary(
    curve: FloatArray, crossings: FloatArray, gaps: FloatArray, pieces: FloatArray, piece_count: int
) -> int:
    """Add the sections of a curve on the cell's side of all other curves; return the new number of pieces.

    `crossings`, (k, 2), are the values of the parameter t at which the curve enters and leaves the cell's
    side of each other curve. If it enters before it leaves, it is on that side only in between. If it leaves
    before it enters, it is on that side everywhere except for the gap in between. The sections are the
    intersection of all these intervals, without the gaps. `gaps`, (k, 2), is scratch space with the columns
    of `crossings`.
    """
    # The crossings with curves that do not intersect this one are nan. Comparisons with nan are false, so
    # that these curves neither limit the interval nor add a gap.
    start = curve[_START]
    end = curve[_END]
    for k in range(len(crossings)):
        if crossings[k, _ENTER] <= crossings[k, _LEAVE]:
            start = max(start, crossings[k, _ENTER])
            end = min(end, crossings[k, _LEAVE])
    # List the gaps within the interval, sorted by their start.
    gap_count = 0
    for k in range(len(crossings)):
        enter = crossings[k, _ENTER]
        leave = crossings[k, _LEAVE]
        if leave < enter and leave < end and enter > start:
            _insert_gap(gaps, gap_count, enter, leave)
            gap_count += 1
    # Add the section before each gap, and the section after the last gap. If gaps overlap, the section
    # between them is empty, and adds nothing.
    for gap in range(gap_count):
        piece_count = _add_pieces(curve, start, min(gaps[gap, _LEAVE], end), pieces, piece_count)
        start = max(start, gaps[gap, _ENTER])
    return _add_pieces(curve, start, end, pieces, piece_count)


@kernel
def _insert_gap(gaps: FloatArray, gap_count: int, enter: float, leave: float) -> None:
    """Insert the gap from t = leave to t = enter into the first `gap_count` rows, sorted by start."""
    # Move the gaps that start later by one row.
    row = gap_count
    while row > 0 and gaps[row - 1, _LEAVE] > leave:
        gaps[row, _ENTER] = gaps[row - 1, _ENTER]
        gaps[row, _LEAVE] = gaps[row - 1, _LEAVE]
        row -= 1
    gaps[row, _ENTER] = enter
    gaps[row, _LEAVE] = leave


@kernel
def _add_pieces(curve: FloatArray, start: float, end: float, pieces: FloatArray, piece_count: int) -> int:
    """Append the section of a curve from t = start to t = end to the pieces; return the new number of pieces.

    The angle of the point q(t) of a circle of curvature k, measured at its center from the point nearest to
    the generator, is 2 atan(k t). The half angle of a piece is therefore a difference of arctangents. A piece
    must not be longer than half a circle, so that a section with t = 0 in its interior becomes two pieces.
    """
    curvature = 2.0 * curve[_COEFFICIENT]
    while start < end:
        must_divide = start < 0.0 < end and curvature != 0.0
        piece_end = 0.0 if must_divide else end
        half_angle = 0.0
        if curvature != 0.0:
            half_angle = np.arctan(curvature * piece_end) - np.arctan(curvature * start)
        pieces[piece_count, START_X], pieces[piece_count, START_Y] = _evaluate(curve, start)
        pieces[piece_count, END_X], pieces[piece_count, END_Y] = _evaluate(curve, piece_end)
        pieces[piece_count, HALF_ANGLE] = half_angle
        pieces[piece_count, CELL] = curve[_CURVE_CELL]
        pieces[piece_count, OTHER_CELL] = curve[_CURVE_OTHER_CELL]
        start = piece_end
        piece_count += 1
    return piece_count


@kernel
def _evaluate(curve: FloatArray, t: float) -> tuple[float, float]:
    """Return the point q(t) of a curve, in meters; for the formula, see the description of the module.

    `outward` is the coordinate along the normal n of the curve, and `leftward` that along u, which is n
    turned left. For large t, numerator and denominator of the fraction are divided by t² to avoid overflow.
    """
    curvature = 2.0 * curve[_COEFFICIENT]
    if abs(curvature * t) <= 1.0:
        divisor = 1.0 + (curvature * t) ** 2
        leftward = 2.0 * t / divisor
        outward = curve[_DISTANCE] - 2.0 * curvature * t * t / divisor
    else:
        inverse = 1.0 / t
        divisor = inverse * inverse + curvature * curvature
        leftward = 2.0 * inverse / divisor
        outward = curve[_DISTANCE] - 2.0 * curvature / divisor
    x = outward * curve[_NORMAL_X] - leftward * curve[_NORMAL_Y]
    y = outward * curve[_NORMAL_Y] + leftward * curve[_NORMAL_X]
    return x, y


@kernel
def _find_parameter(curve: FloatArray, x: float, y: float) -> float:
    """Return the parameter t of a point on a curve: the inverse of `_evaluate`.

    The point may lie off the curve because of rounding.
    """
    # Relative to r n, the components of q(t) are outward = -2 k t² / (1 + k² t²) and
    # leftward = 2 t / (1 + k² t²). Therefore, t is leftward / (2 + k outward), and also
    # -outward / (k leftward), which is accurate where the divisor of the first quotient is small.
    curvature = 2.0 * curve[_COEFFICIENT]
    outward = x * curve[_NORMAL_X] + y * curve[_NORMAL_Y] - curve[_DISTANCE]
    leftward = y * curve[_NORMAL_X] - x * curve[_NORMAL_Y]
    divisor = 2.0 + curvature * outward
    t: float = leftward / divisor if divisor > 1.0 else -outward / (curvature * leftward)
    return t
