"""The point of a cell from which its locational cost is best: by Newton's method, in all cells at once.

For f = r the cost of a convex cell is strictly convex. For f = 1/(r²+h²) it need not be, but it has no second
optimum: f is (-1/2)-concave, and in the plane the integral of such a function over a convex set that moves is
quasi-concave (Borell; Brascamp and Lieb). Along any line the cost therefore falls, and then rises. So where
it still falls at the end of a step, the step has not gone too far. That is all that is asked of a step,
beside that it stays in the cell; no difference of two costs is ever formed, which would cancel.

With a density φ that varies, derivatives are by quadrature. A cell is taken apart into the triangles that the
point itself spans with the edges. In the coordinates q = p + u (e(t) - p), where e(t) runs along an edge,
distance and direction from p are smooth, so that Gauss's rule converges quickly where φ is smooth; where it
jumps within a cell, the error is of the order of the distance of the nodes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.compiled import inner_kernel, kernel
from robocov.locational.cost import Distance, Performance, Sensing, SquaredDistance, derivatives
from robocov.observation.cells import Cells

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.density import Density

_NEAR, _WEIGHED_NEAR = 1e-7, 1e-6
"""A Newton step so short, relative to the cell's size, is the last: the next would be its square."""

_ROUNDS, _WEIGHED_ROUNDS = 80, 30
"""Evaluations after which a cell has what it has: most need 4, hairs below a low sensor some dozens."""

_FLATTEST = 1e-14
"""Least curvature, relative to the greatest, that is more than rounding."""

_FLAT = 1e-9
"""Area by the square of the size of a cell that is no rounding."""

_NOTHING = 1e-15
"""A step so short, relative to the cell's size, changes nothing."""

_EMPTY = 1e-12
"""φ so small, relative to its highest value, all over a cell is nothing: its centroid is as good a point."""

_RISE = 0.5
"""Where the cost rises again at the end of a step, it may rise so many times as fast as it fell."""

_LEAST, _MOST = 0.1, 0.5
"""Of a step that went too far, so much is tried next."""

_ALONG, _OUTWARD = 16, 12
"""Nodes along an edge, and from the point to it."""


def best_points(cells: Cells, f: Performance, start: Array | None = None) -> Array:
    """Return the points where ∫ f(|q-p|) dq over each cell is best, (n, 2) m.

    A convex cell's lies in it, and is its only optimum. Of a cell that is not convex, as those of robots of
    different speeds may be, it is one near the centroid; for f = r it is the best all the same. An empty
    cell's is its generator, like its centroid.

    Parameters
    ----------
    cells : Cells
    f : Performance
    start : (n, 2) m or None
        Where the search begins, within the cells; None: at the centroids.

    Examples
    --------
    >>> from robocov import Region, partition
    >>> triangle = Region(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]))
    >>> best_points(partition(np.array([[1.0, 0.5]]), triangle), Distance()).round(4)
    array([[0.9733, 0.9733]])
    """
    start = (cells.centroid if start is None else start) - cells.generators
    room, size, area = derivatives(cells.edges, start, SquaredDistance())[:, 5:].T
    searching = (room > 0.0) | (area > _FLAT * np.square(size))

    def slopes(points: Array, wanted: BoolArray) -> Array:
        return derivatives(cells.edges, points, f)

    return cells.generators + _newton(slopes, start, searching, f.sign, _NEAR, _ROUNDS)


def weighed_best_points(cells: Cells, density: Density, f: Distance | Sensing) -> Array:
    """Return the points where ∫ f(|q-p|) φ(q) dq over each cell is best, (n, 2) m.

    From the centroid by φ on: of f = r and a convex cell it is the best of all, of f = 1/(r²+h²) the one
    that lies downhill from there. A cell that is not convex, or in which φ is nothing, keeps its centroid.

    Parameters
    ----------
    cells : Cells
        With the density.
    density : Density
    f : Distance or Sensing
    """
    start = cells.centroid - cells.generators
    room, size, area = derivatives(cells.edges, start, SquaredDistance())[:, 5:].T
    searching = (room > 1e-9 * size) & (cells.mass > _EMPTY * density.highest * area)

    def slopes(points: Array, wanted: BoolArray) -> Array:
        found = derivatives(cells.edges, points, SquaredDistance())
        found[:, :5] = _weighed_slopes(cells, density, f, size, points, wanted)
        return found

    return cells.generators + _newton(slopes, start, searching, 1.0, _WEIGHED_NEAR, _WEIGHED_ROUNDS)


def _newton(
    slopes: Callable[[Array, BoolArray], Array],
    start: Array,
    searching: BoolArray,
    sign: float,
    near: float,
    rounds: int,
) -> Array:
    """Return where Newton's method, safeguarded, ends in each cell, (n, 2) m relative to the generators.

    Parameters
    ----------
    slopes : callable
        Of points (n, 2) m, and for which cells they are wanted: what `derivatives` returns.
    start : (n, 2) m
    searching : (n,)
        In which cells.
    sign, near, rounds
        Of f, and when a search ends.
    """
    points, there = start.copy(), start.copy()
    # room, step in full, slope along it, part of it that is tried
    state = np.full((len(start), 5), np.nan)
    for _ in range(rounds + 1):
        if not searching.any():
            break
        _advance(points, there, searching, state, slopes(there, searching), sign, near)
    return points


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
            go_x, go_y = _newton_step(
                gx, gy, sign * slopes[i, 2], sign * slopes[i, 3], sign * slopes[i, 4], size
            )
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


@inner_kernel
def _newton_step(gx: float, gy: float, xx: float, xy: float, yy: float, size: float) -> tuple[float, float]:
    """Return Newton's step, or one that goes down where the Hessian is no bowl; at most as long as `size`."""
    trace, determinant = xx + yy, xx * yy - xy * xy
    if trace > 0.0 and determinant > _FLATTEST * trace * trace:
        x, y = (xy * gy - yy * gx) / determinant, (xy * gx - xx * gy) / determinant
    else:
        x, y = _downhill(gx, gy, xx, xy, yy)
    part = size / max(np.sqrt(x * x + y * y), size, 1e-300)
    return x * part, y * part


@inner_kernel
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
    cells: Cells, density: Density, f: Distance | Sensing, size: Array, points: Array, wanted: BoolArray
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
        u, u_weights = (
            np.sinh(bend * u) / np.sinh(bend),
            u_weights * bend * np.cosh(bend * u) / np.sinh(bend),
        )
    u, u_weights = u[cell][:, None, :], (u * u_weights)[cell][:, None, :]
    # (edges, along, outward, 2)
    start, end = edges.start[some] - points[cell], edges.end[some] - points[cell]
    rim = start[:, None] + (end - start)[:, None] * t[:, None]
    off = rim[:, :, None, :] * u[..., None]
    double = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    weight = double[:, None, None] * t_weights[:, None] * u_weights
    places = off + (cells.generators + points)[cell][:, None, None]
    weight = weight * density.value(places.reshape(-1, 2)).reshape(weight.shape)
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
