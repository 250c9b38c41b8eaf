"""Boundaries of the cells of robots of different speeds: pieces of lines and circles.

Relative to the generator, every curve that may bound a cell is a |q|² + b q = c, and the cell lies where
a |q|² + b q <= c. It is a line (a = 0), a circle around the cell (a > 0), or a circle around what does not
belong to the cell (a < 0). With b² + 4 a c = 1 the curves behave like unit vectors: their product
g = b b' + 2 (a c' + a' c) determines how they meet. They intersect in two points if |g| < 1.

With r n the point of a curve that is nearest to the generator, and its curvature k = 2 a, the parameter t of

    q(t) = r n + (2 t m - 2 k t² n) / (1 + k² t²),      m = n turned left,

is half the tangent of half the angle on a circle, and half the distance on a line. The cell is to the left
of the curve. The condition of every other curve on q(t) is a quadratic in t, so that both intersections come
from one square root. Each intersection is computed once, and is the same point on both curves, so that they
cannot disagree.

A curve is a row of an array, whose columns are named below.
"""

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.compiled import kernel
from robocov.observation.region import SIDE_NORMAL_X, SIDE_NORMAL_Y, SIDE_OFFSET
from robocov.voronoi.arcs import BEYOND, CELL, END_X, END_Y, HALF_ANGLE, START_X, START_Y

_NORMAL_X = 0
_NORMAL_Y = 1
_DISTANCE = 2  # r, m
_COEFFICIENT = 3  # a, 1/m
_BEGIN = 4  # the values of t between which the curve may bound the cell, m
_END = 5
_CURVE_CELL = 6
_CURVE_BEYOND = 7
_CURVE_COLUMNS = 8

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

_EDGE_START_X = 0
_EDGE_START_Y = 1
_EDGE_END_X = 2
_EDGE_END_Y = 3
_EDGE_CELL = 4
_EDGE_BEYOND = 5  # the robot on the other side; negative for a side of the region

_FIRST_IS_OUTSIDE = 1
_SECOND_IS_OUTSIDE = 2

_MIN_SQUARED_SINE = 1e-29
"""sin² of the angle at which two curves meet, below which rounding alone decides whether and where they do.
One of them then counts as within the other, which moves no boundary by more than rounding does."""


@kernel
def trace_boundaries(
    points: Array, sides: Array, pairs: Array, edges: Array, is_straight: BoolArray
) -> Array:
    """Find the pieces of the boundaries of all cells.

    Parameters
    ----------
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    pairs : (m, 6) array
        Pairs of a robot and a neighbor, sorted by robot. For the columns, see the constants `PAIR_...`.
    edges : (e, 6) array
        Edges of the cells of equally fast robots, sorted by cell: x, y, u, v of the ends relative to the
        generator (m), the cell, and the robot beyond.
    is_straight : (n,) bool array
        Overwritten: whether a cell is bounded by these edges alone.

    Returns
    -------
    (p, 7) array
        For the columns see `robocov.voronoi.arcs`.
    """
    pieces = np.empty((len(edges) + 64, 7))
    used = 0
    pair = 0
    edge = 0
    for i in range(len(points)):
        first_pair = pair
        first_edge = edge
        while pair < len(pairs) and pairs[pair, PAIR_ROBOT] == i:
            pair += 1
        while edge < len(edges) and edges[edge, _EDGE_CELL] == i:
            edge += 1
        own_pairs = pairs[first_pair:pair]
        own_edges = edges[first_edge:edge]
        line_count = edge - first_edge
        curves = np.empty((line_count + pair - first_pair, _CURVE_COLUMNS))
        count = _write_circles(curves, own_pairs, own_edges)
        # Without circles, the cell is the one among robots of equal speeds.
        is_straight[i] = count == line_count
        if is_straight[i]:
            pieces = _make_room(pieces, used, line_count)
            used = _add_edges(own_edges, pieces, used)
        elif count > 0:
            _write_lines(curves, own_pairs, own_edges, sides, points[i])
            crossings = np.empty((count, count, 2))
            _find_crossings(curves[:count], line_count, crossings)
            for c in range(count):
                pieces = _make_room(pieces, used, 2 * count + 2)
                used = _add_parts(curves[c], crossings[c], pieces, used)
    return pieces[:used]


@kernel
def _make_room(pieces: Array, used: int, room: int) -> Array:
    """Return an array with the used pieces and room for more."""
    if used + room <= len(pieces):
        return pieces
    larger = np.empty((2 * (used + room), pieces.shape[1]))
    larger[:used] = pieces[:used]
    return larger


@kernel
def _add_edges(edges: Array, pieces: Array, used: int) -> int:
    """Add straight edges to the pieces; return the updated `used`."""
    for e in range(len(edges)):
        for column in range(HALF_ANGLE):
            pieces[used, column] = edges[e, column]
        pieces[used, HALF_ANGLE] = 0.0
        pieces[used, CELL] = edges[e, _EDGE_CELL]
        pieces[used, BEYOND] = edges[e, _EDGE_BEYOND]
        used += 1
    return used


@kernel
def _write_circles(curves: Array, pairs: Array, edges: Array) -> int:
    """Write the circles that may bound a cell to the rows after those of its lines.

    Return the number of curves, or -1 if the cell is empty because a faster robot is at the same position.
    """
    reach = _compute_reach(pairs, edges)
    if reach < 0.0:
        return -1
    count = len(edges)
    for k in range(len(pairs)):
        own_speed = pairs[k, PAIR_OWN_SPEED]
        other_speed = pairs[k, PAIR_OTHER_SPEED]
        distance = np.sqrt(pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2)
        nearest = distance * (own_speed / (own_speed + other_speed))
        if own_speed != other_speed and distance > 0.0 and nearest < reach:
            curves[count, _NORMAL_X] = pairs[k, PAIR_DX] / distance
            curves[count, _NORMAL_Y] = pairs[k, PAIR_DY] / distance
            curves[count, _DISTANCE] = nearest
            difference_of_squares = (other_speed - own_speed) * (own_speed + other_speed)
            curves[count, _COEFFICIENT] = 0.5 * (difference_of_squares / (own_speed * other_speed)) / distance
            curves[count, _BEGIN] = -np.inf
            curves[count, _END] = np.inf
            curves[count, _CURVE_CELL] = pairs[k, PAIR_ROBOT]
            curves[count, _CURVE_BEYOND] = pairs[k, PAIR_NEIGHBOR]
            count += 1
    return count


@kernel
def _compute_reach(pairs: Array, edges: Array) -> float:
    """Return an upper bound of the distances of a cell's points from its generator, m; -1 if it is empty."""
    reach = 0.0
    for e in range(len(edges)):
        reach = max(reach, np.sqrt(edges[e, _EDGE_START_X] ** 2 + edges[e, _EDGE_START_Y] ** 2))
    for k in range(len(pairs)):
        own_speed = pairs[k, PAIR_OWN_SPEED]
        other_speed = pairs[k, PAIR_OTHER_SPEED]
        if other_speed > own_speed:
            distance = np.sqrt(pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2)
            if distance == 0.0:
                return -1.0
            # The farthest point of a circle around the cell is on the side away from the faster robot.
            reach = min(reach, distance * own_speed / (other_speed - own_speed))
    return reach


@kernel
def _write_lines(curves: Array, pairs: Array, edges: Array, sides: Array, point: Array) -> None:
    """Write the edges of a cell as straight curves that begin and end at their vertices."""
    for e in range(len(edges)):
        if edges[e, _EDGE_BEYOND] >= 0.0:
            _write_bisector(curves[e], pairs, edges[e, _EDGE_BEYOND])
        else:
            _write_side(curves[e], edges[e], sides, point)
        normal_x = curves[e, _NORMAL_X]
        normal_y = curves[e, _NORMAL_Y]
        curves[e, _COEFFICIENT] = 0.0
        # On a line, t is half the signed distance along it from the point nearest to the generator.
        curves[e, _BEGIN] = 0.5 * (normal_x * edges[e, _EDGE_START_Y] - normal_y * edges[e, _EDGE_START_X])
        curves[e, _END] = 0.5 * (normal_x * edges[e, _EDGE_END_Y] - normal_y * edges[e, _EDGE_END_X])
        curves[e, _CURVE_CELL] = edges[e, _EDGE_CELL]
        curves[e, _CURVE_BEYOND] = edges[e, _EDGE_BEYOND]


@kernel
def _write_bisector(curve: Array, pairs: Array, neighbor: float) -> None:
    """Write the direction and distance of the bisector to a neighbor.

    They are not taken from the edge: it may be so short that rounding decides its direction.
    """
    for k in range(len(pairs)):
        if pairs[k, PAIR_NEIGHBOR] == neighbor:
            distance = np.sqrt(pairs[k, PAIR_DX] ** 2 + pairs[k, PAIR_DY] ** 2)
            curve[_NORMAL_X] = pairs[k, PAIR_DX] / distance
            curve[_NORMAL_Y] = pairs[k, PAIR_DY] / distance
            curve[_DISTANCE] = 0.5 * distance


@kernel
def _write_side(curve: Array, edge: Array, sides: Array, point: Array) -> None:
    """Write the direction and distance from the generator of the side of the region that an edge lies on."""
    middle_x = 0.5 * (edge[_EDGE_START_X] + edge[_EDGE_END_X])
    middle_y = 0.5 * (edge[_EDGE_START_Y] + edge[_EDGE_END_Y])
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
            curve[_DISTANCE] = normal_x * middle_x + normal_y * middle_y


@kernel
def _find_crossings(curves: Array, line_count: int, crossings: Array) -> None:
    """For each pair of curves, find the interval of the first one on the cell's side of the second one.

    The crossings are (k, k, 2) values of t on the first curve, nan if the two do not intersect. A curve that
    is nowhere on the cell's side of another one gets an empty interval. The first `line_count` curves are the
    edges of the cell among equally fast robots. They are not compared with each other.
    """
    count = len(curves)
    for one in range(count):
        crossings[one, one, 0] = np.nan
        crossings[one, one, 1] = np.nan
        for other in range(one + 1, count):
            enter = np.nan
            leave = np.nan
            outside = 0
            if other >= line_count:
                enter, leave, outside = _intersect(curves[one], curves[other])
            if outside & _FIRST_IS_OUTSIDE:
                curves[one, _END] = -np.inf
            if outside & _SECOND_IS_OUTSIDE:
                curves[other, _END] = -np.inf
            crossings[one, other, 0] = enter
            crossings[one, other, 1] = leave
            # Where a curve leaves the side of another one, that one enters its side, at the same point.
            x, y = _evaluate(curves[one], leave)
            crossings[other, one, 0] = _find_parameter(curves[other], x, y)
            x, y = _evaluate(curves[one], enter)
            crossings[other, one, 1] = _find_parameter(curves[other], x, y)


@kernel
def _intersect(one: Array, other: Array) -> tuple[float, float, int]:
    """Find where a curve enters and leaves the cell's side of another one.

    Return both values of t, nan if the curves do not intersect, and flags that say which of them is nowhere
    on the cell's side of the other one.
    """
    n1x = one[_NORMAL_X]
    n1y = one[_NORMAL_Y]
    r1 = one[_DISTANCE]
    a1 = one[_COEFFICIENT]
    n2x = other[_NORMAL_X]
    n2y = other[_NORMAL_Y]
    r2 = other[_DISTANCE]
    a2 = other[_COEFFICIENT]
    # From b² + 4 a c = 1, and a r² + |b| r = c at the nearest point.
    b1 = 1.0 - 2.0 * a1 * r1
    b1x = n1x * b1
    b1y = n1y * b1
    c1 = r1 * (1.0 - a1 * r1)
    b2 = 1.0 - 2.0 * a2 * r2
    b2x = n2x * b2
    b2y = n2y * b2
    c2 = r2 * (1.0 - a2 * r2)
    outward = b2x * n1x + b2y * n1y
    leftward = b2y * n1x - b2x * n1y + 0.0  # The sum turns a negative zero into a positive one.
    k = 2.0 * a1
    bend = 2.0 - r1 * k
    # On the first curve the condition of the other one is quadratic t² + 2 leftward t + constant <= 0.
    quadratic = a2 * bend * bend - k * outward * bend - c2 * k * k
    constant = a2 * r1 * r1 + r1 * outward - c2
    # 1 - g² as a sum of minors: if the curves meet at a small angle, g itself would leave only rounding.
    b_cross = b1x * b2y - b1y * b2x
    across = a1 * c2 - a2 * c1
    squared_sine = b_cross * b_cross - 4.0 * across * across
    squared_sine += 4.0 * (
        (b1x * a2 - b2x * a1) * (b1x * c2 - b2x * c1) + (b1y * a2 - b2y * a1) * (b1y * c2 - b2y * c1)
    )
    if squared_sine > _MIN_SQUARED_SINE:
        large = -leftward - np.copysign(np.sqrt(squared_sine), leftward)
        if leftward >= 0.0:
            return large / quadratic, constant / large, 0
        return constant / large, large / quadratic, 0
    # One curve is within the other (g >= 1), or none is, or each is outside the other.
    is_outside = quadratic + constant > 0.0
    g = b1x * b2x + b1y * b2y + 2.0 * (a1 * c2 + a2 * c1)
    outside = _FIRST_IS_OUTSIDE if is_outside else 0
    if is_outside == (g < 0.0):
        outside += _SECOND_IS_OUTSIDE
    return np.nan, np.nan, outside


@kernel
def _add_parts(curve: Array, crossings: Array, pieces: Array, used: int) -> int:
    """Add the parts of a curve that are on the cell's side of all others; return the updated `used`.

    The crossings with the other curves, (k, 2), are overwritten.
    """
    start = curve[_BEGIN]
    end = curve[_END]
    for other in range(len(crossings)):
        if crossings[other, 0] <= crossings[other, 1]:
            start = max(start, crossings[other, 0])
            end = min(end, crossings[other, 1])
    # A curve that is left before it is entered cuts a gap out of this one. Sort the gaps by their start.
    gaps = 0
    for other in range(len(crossings)):
        enter = crossings[other, 0]
        leave = crossings[other, 1]
        if leave < enter and leave < end and enter > start:
            k = gaps
            while k > 0 and crossings[k - 1, 1] > leave:
                crossings[k, 0] = crossings[k - 1, 0]
                crossings[k, 1] = crossings[k - 1, 1]
                k -= 1
            crossings[k, 0] = enter
            crossings[k, 1] = leave
            gaps += 1
    for k in range(gaps):
        used = _add_pieces(curve, start, min(crossings[k, 1], end), pieces, used)
        start = max(start, crossings[k, 0])
    return _add_pieces(curve, start, end, pieces, used)


@kernel
def _add_pieces(curve: Array, start: float, end: float, pieces: Array, used: int) -> int:
    """Add a part of a curve, cut at t = 0 so that no piece exceeds half a circle; return the new `used`."""
    k = 2.0 * curve[_COEFFICIENT]
    while start < end:
        stop = 0.0 if start < 0.0 < end and k != 0.0 else end
        pieces[used, START_X], pieces[used, START_Y] = _evaluate(curve, start)
        pieces[used, END_X], pieces[used, END_Y] = _evaluate(curve, stop)
        pieces[used, HALF_ANGLE] = 0.0 if k == 0.0 else np.arctan(k * stop) - np.arctan(k * start)
        pieces[used, CELL] = curve[_CURVE_CELL]
        pieces[used, BEYOND] = curve[_CURVE_BEYOND]
        start = stop
        used += 1
    return used


@kernel
def _evaluate(curve: Array, t: float) -> tuple[float, float]:
    """Return q(t), m, by one of two formulas, so that nothing overflows for large t."""
    k = 2.0 * curve[_COEFFICIENT]
    if abs(k * t) <= 1.0:
        divisor = 1.0 + (k * t) ** 2
        leftward = 2.0 * t / divisor
        outward = curve[_DISTANCE] - 2.0 * k * t * t / divisor
    else:
        inverse = 1.0 / t
        divisor = inverse * inverse + k * k
        leftward = 2.0 * inverse / divisor
        outward = curve[_DISTANCE] - 2.0 * k / divisor
    x = outward * curve[_NORMAL_X] - leftward * curve[_NORMAL_Y]
    y = outward * curve[_NORMAL_Y] + leftward * curve[_NORMAL_X]
    return x, y


@kernel
def _find_parameter(curve: Array, x: float, y: float) -> float:
    """Return the t of the point q(t) nearest to a point that is close to the curve."""
    k = 2.0 * curve[_COEFFICIENT]
    outward = x * curve[_NORMAL_X] + y * curve[_NORMAL_Y] - curve[_DISTANCE]
    leftward = y * curve[_NORMAL_X] - x * curve[_NORMAL_Y]
    divisor = 2.0 + k * outward
    t: float = leftward / divisor if divisor > 1.0 else -outward / (k * leftward)
    return t
