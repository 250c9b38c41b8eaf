"""The point of a cell with the least locational cost (4): a robot's target.

It is found by Newton's method, in all cells at once. For f = r the cost of a convex cell is strictly convex.
For f = 1/(r²+h²) it need not be, but it has no second optimum: f is (-1/2)-concave, and in the plane the
integral of such a function over a convex set that moves is quasi-concave (Borell; Brascamp and Lieb). Along
any line the cost therefore falls, and then rises. So where it still falls at the end of a step, the step has
not gone too far. That is all that is asked of a step, beside that it stays in the cell; no difference of two
costs is ever formed, which would cancel.

With a density φ that varies, derivatives are by quadrature. A cell is taken apart into the triangles that the
point itself spans with the edges. In the coordinates q = p + u (e(t) - p), where e(t) runs along an edge,
distance and direction from p are smooth, so that Gauss's rule converges quickly where φ is smooth; where it
jumps within a cell, the error is of the order of the distance of the nodes.
"""

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.compiled import kernel
from robocov.density import Density
from robocov.errors import ParameterError, describe_unknown_name
from robocov.locational_cost import Distance, Performance, Sensing, SquaredDistance, compute_derivatives
from robocov.observation import Cells

TARGETS = ("centroid", "sensing", "median")
"""The optima for f = r², (12); f = 1/(r²+h²), (14); and f = r, by which the coverage cost (22) counts."""

TARGET_HELP = "what a robot heads for in its cell: the optimum for r², for 1/(r²+h²), or for r"
HEIGHT_HELP = "h of (14), for the target sensing: how high the sensor is; what is much farther counts little"

_NEAR, _WEIGHED_NEAR = 1e-7, 1e-6  # a step so short, relative to the cell's size, is the last
_ROUNDS, _WEIGHED_ROUNDS = 80, 30  # evaluations; most need 4, hairs below a low sensor some dozens
_FLATTEST = 1e-14  # least curvature, relative to the greatest, that is more than rounding
_FLAT = 1e-9  # area by the square of the size of a cell that is no rounding
_NOTHING = 1e-15  # a step so short, relative to the cell's size, changes nothing
_EMPTY = 1e-12  # φ so small, relative to its highest value, all over a cell is nothing
_RISE = 0.5  # where the cost rises again at the end of a step, it may rise so many times as fast as it fell
_LEAST, _MOST = 0.1, 0.5  # of a step that went too far, so much is tried next
_ALONG, _OUTWARD = 16, 12  # nodes along an edge, and from the point to it


def find_targets(cells: Cells, density: Density | None, target: str, height: float) -> Array:
    """Return where each robot heads for, (n, 2) m: within its cell, if that is convex.

    Centroid and median count how far away places are, f = 1/(r²+h²) counts what is within a few h: in a cell
    that is large against h it gives up the far ends, for h well above the size of the cells it is the
    centroid. Where nothing is in the way that hardly changes the coverage cost (22). Walls magnify it:
    whether a robot gets round one depends on centimetres of its goal, mostly against "sensing" with low h.

    The `target` is one of `TARGETS`, the `height` (m) h of equation (14), for "sensing". A ParameterError
    tells of another target, or a height that is not above 0.
    """
    if target == "centroid":
        return cells.centroid
    if target not in TARGETS:
        raise ParameterError(f"target: {describe_unknown_name('target', target, TARGETS)}")
    return find_best_points(cells, Distance() if target == "median" else Sensing(height), density)


def find_best_points(cells: Cells, f: Performance, density: Density | None = None) -> Array:
    """Return the points where ∫ f(|q-p|) φ(q) dq over each cell, with that density, is best, (n, 2) m.

    With density 1, a convex cell's lies in it, and is its only optimum. Of a cell that is not convex, as
    those of robots of different speeds may be, it is one near the centroid; for f = r it is the best all the
    same. With another density, of f = r and a convex cell it is the best of all, of f = 1/(r²+h²) the one
    that lies downhill from the centroid; a cell that is not convex, or in which φ is nothing, keeps its
    centroid. An empty cell's is its generator.

    >>> from robocov import Region, partition
    >>> triangle = Region(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]))
    >>> find_best_points(partition(np.array([[1.0, 0.5]]), triangle), Distance()).round(4)
    array([[0.9733, 0.9733]])
    """
    points = cells.centroid - cells.generators
    room, size, area = compute_derivatives(cells.edges, points, SquaredDistance())[:, 5:].T
    weighed = None if density is None or density.is_uniform else density
    if weighed is None:
        searching = (room > 0.0) | (area > _FLAT * np.square(size))
        sign, near, rounds = f.sign, _NEAR, _ROUNDS
    else:
        searching = (room > 1e-9 * size) & (cells.mass > _EMPTY * weighed.max_value * area)
        sign, near, rounds = 1.0, _WEIGHED_NEAR, _WEIGHED_ROUNDS
    there = points.copy()
    # room, step in full, slope along it, part of it that is tried
    state = np.full((len(points), 5), np.nan)
    for _ in range(rounds + 1):
        if not searching.any():
            break
        slopes = compute_derivatives(cells.edges, there, f)
        if weighed is not None:
            slopes[:, :5] = _weighed_slopes(cells, weighed, f, size, there, searching)
        _advance(points, there, searching, state, slopes, sign, near)
    return cells.generators + points


@kernel
def _advance(
    points: Array, there: Array, searching: BoolArray, state: Array, slopes: Array, sign: float, near: float
) -> None:
    """Take the step to `there`, or a shorter one, by the slopes there; and propose the next."""
    for i in range(len(points)):
        if not searching[i]:
            continue
        gx, gy, room, size = sign * slopes[i, 0], sign * slopes[i, 1], slopes[i, 5], slopes[i, 6]
        fresh = np.isnan(state[i, 4])
        if (fresh and room <= 0.0) or state[i, 0] == np.inf:
            room = np.inf  # a cell that is not convex confines nothing
        fall, slope = state[i, 3], gx * state[i, 1] + gy * state[i, 2]
        if fresh or (room >= 0.0 and slope <= -_RISE * fall):
            points[i, 0], points[i, 1] = there[i, 0], there[i, 1]
            xx, xy, yy = sign * slopes[i, 2], sign * slopes[i, 3], sign * slopes[i, 4]
            go_x, go_y = _newton_step(gx, gy, xx, xy, yy, size)
            state[i, 0], state[i, 1], state[i, 2] = room, go_x, go_y
            state[i, 3], state[i, 4] = gx * go_x + gy * go_y, 1.0
        else:
            # where the line through both slopes is level, but neither too near nor too far
            level = min(max(fall / min(fall - slope, -1e-300), _LEAST), _MOST)
            state[i, 4] *= level if room >= 0.0 else _MOST
        x, y = state[i, 4] * state[i, 1], state[i, 4] * state[i, 2]
        length = np.sqrt(x * x + y * y)
        there[i, 0], there[i, 1] = points[i, 0] + x, points[i, 1] + y
        if length <= min(near * size, state[i, 0]):
            points[i, 0], points[i, 1], searching[i] = there[i, 0], there[i, 1], False
        elif not length > _NOTHING * size:
            searching[i] = False


@kernel
def _newton_step(gx: float, gy: float, xx: float, xy: float, yy: float, size: float) -> tuple[float, float]:
    """Return Newton's step, or one that goes down where the Hessian is no bowl; at most as long as `size`."""
    trace, determinant = xx + yy, xx * yy - xy * xy
    if trace > 0.0 and determinant > _FLATTEST * trace * trace:
        x, y = (xy * gy - yy * gx) / determinant, (xy * gx - xx * gy) / determinant
    else:
        x, y = _downhill(gx, gy, xx, xy, yy)
    part = size / max(np.sqrt(x * x + y * y), size, 1e-300)
    return x * part, y * part


@kernel
def _downhill(gx: float, gy: float, xx: float, xy: float, yy: float) -> tuple[float, float]:
    """Return a step as Newton's, but with the sizes of the Hessian's eigenvalues: it always goes down."""
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius, sign = np.sqrt(half * half + xy * xy), -1.0 if mean < 0.0 else 1.0
    # the eigenvalue of the greater size; the other by the determinant, as a difference would cancel
    great = mean + sign * radius
    greatest = abs(great) if great != 0.0 else 1.0
    small = (xx * yy - xy * xy) / (great if great != 0.0 else 1.0)
    # along its eigenvector, of which of two forms the longer is taken
    turned = sign * half
    x, y = (radius + turned, sign * xy) if turned >= 0.0 else (sign * xy, radius - turned)
    size = np.sqrt(x * x + y * y)
    x, y = (x / size, y / size) if size > 0.0 else (1.0, 0.0)
    along = -(gx * x + gy * y) / greatest
    across = -(gy * x - gx * y) / max(abs(small), _FLATTEST * greatest)
    return along * x - across * y, along * y + across * x


def _weighed_slopes(
    cells: Cells, density: Density, f: Performance, size: Array, points: Array, wanted: BoolArray
) -> Array:
    """Return the derivatives of what is to be small by quadrature, (n, 5), zero where not wanted."""
    edges = cells.edges
    some = np.flatnonzero(wanted[edges.cell])
    cell = edges.cell[some]
    nodes, weights = np.polynomial.legendre.leggauss(_ALONG)
    t, t_weights = 0.5 * (nodes + 1.0), 0.5 * weights
    nodes, weights = np.polynomial.legendre.leggauss(_OUTWARD)
    u, u_weights = np.tile(0.5 * (nodes + 1.0), (len(size), 1)), np.tile(0.5 * weights, (len(size), 1))
    if isinstance(f, Sensing):
        # as close to the point as f is steep
        bend = np.arcsinh(np.maximum(size / f.height, 1e-3))[:, None]
        u_weights = u_weights * bend * np.cosh(bend * u) / np.sinh(bend)
        u = np.sinh(bend * u) / np.sinh(bend)
    u, u_weights = u[cell][:, None, :], (u * u_weights)[cell][:, None, :]
    # (edges, along, outward, 2)
    start, end = edges.start[some] - points[cell], edges.end[some] - points[cell]
    rim = start[:, None] + (end - start)[:, None] * t[:, None]
    off = rim[:, :, None, :] * u[..., None]
    double = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    weight = double[:, None, None] * t_weights[:, None] * u_weights
    places = off + (cells.generators + points)[cell][:, None, None]
    weight = weight * density.evaluate(places.reshape(-1, 2)).reshape(weight.shape)
    dx, dy = off[..., 0], off[..., 1]
    square = dx * dx + dy * dy
    if isinstance(f, Sensing):
        low = 1.0 / (square + f.height**2)
        first, second = 2.0 * weight * low * low, -8.0 * weight * low * low * low
    else:
        inverse = 1.0 / np.sqrt(np.maximum(square, 1e-300))
        first, second = weight * inverse, -weight * inverse * inverse * inverse
    parts = -first * dx, -first * dy, first + second * dx * dx, second * dx * dy, first + second * dy * dy
    return np.column_stack([np.bincount(cell, part.sum(axis=(1, 2)), len(points)) for part in parts])
