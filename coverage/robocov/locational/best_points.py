"""The point of a cell from which its locational cost is best: by Newton's method, in all cells at once.

For f = r the cost of a convex cell is strictly convex. For f = 1/(r²+h²) it need not be, but it has no second
optimum: f is (-1/2)-concave, and in the plane the integral of such a function over a convex set that moves is
quasi-concave (Borell; Brascamp and Lieb). Along any line the cost therefore falls, and then rises. So where
it still falls at the end of a step, the step has not gone too far. That is all that is asked of a step,
beside that it stays in the cell; no difference of two costs is ever formed, which would cancel.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.locational.cost import CellSides

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array, BoolArray
    from robocov.locational.cost import Performance, Seen
    from robocov.voronoi import VoronoiPartition
    from robocov.voronoi.weighted_cells import WeightedCells

_NEAR = 1e-7
"""A Newton step so short, relative to the cell's size, is the last: the next would be its square."""

_ROUNDS = 80
"""Evaluations after which a cell has what it has: most need 4, hairs below a low sensor some dozens."""

_FLATTEST = 1e-14
"""Least curvature, relative to the greatest, that is more than rounding."""

_FLAT = 1e-9
"""Area by the square of the size of a cell that is no rounding."""

_NOTHING = 1e-15
"""A step so short, relative to the cell's size, changes nothing."""

_RISE = 0.5
"""Where the cost rises again at the end of a step, it may rise so many times as fast as it fell."""

_LEAST, _MOST = 0.1, 0.5
"""Of a step that went too far, so much is tried next."""


def best_points(cells: VoronoiPartition | WeightedCells, f: Performance, start: Array | None = None) -> Array:
    """Return the points where ∫ f(|q-p|) dq over each cell is best, (n, 2) m.

    A convex cell's lies in it, and is its only optimum. Of a cell that is not convex, as those of robots of
    different speeds may be, it is one near the centroid; for f = r it is the best all the same. An empty
    cell's is its generator, like its centroid.

    Parameters
    ----------
    cells : VoronoiPartition or WeightedCells
    f : Performance
    start : (n, 2) m or None
        Where the search begins, within the cells; None: at the centroids.

    Examples
    --------
    >>> from robocov import Region, partition
    >>> from robocov.locational.cost import Distance
    >>> triangle = Region(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]))
    >>> best_points(partition(np.array([[1.0, 0.5]]), triangle), Distance()).round(4)
    array([[0.9733, 0.9733]])
    """
    start = (cells.centroid if start is None else start) - cells.generators
    sides = CellSides(cells.edges, len(start))

    def slopes(x: Array, y: Array, seen: Seen, wanted: BoolArray) -> Slopes:
        over = f.over_edges(seen)
        return Slopes(*(f.sign * each for each in (*sides.gradient(over), *sides.hessian(over))))

    return np.asarray(cells.generators + newton(sides, slopes, start))


class Slopes(NamedTuple):
    """Gradient and Hessian of what is to be small, (n,) each."""

    x: Array
    y: Array
    xx: Array
    xy: Array
    yy: Array


def newton(
    sides: CellSides,
    slopes: Callable[[Array, Array, Seen, BoolArray], Slopes],
    start: Array,
    searching: BoolArray | None = None,
    near: float = _NEAR,
    rounds: int = _ROUNDS,
) -> Array:
    """Return where Newton's method, safeguarded, ends in each cell, (n, 2) m relative to the generators.

    Parameters
    ----------
    sides : CellSides
    slopes : callable
        Of x and y, (n,) m, the edges as seen from there, and for which cells they are wanted.
    start : (n, 2) m
    searching : (n,) or None
        In which cells; None: in all that are more than rounding.
    near : float
        A step so short, relative to the cell's size, is the last.
    rounds : int
        Evaluations after which a cell has what it has.
    """
    x, y = start[:, 0].copy(), start[:, 1].copy()
    seen = sides.seen_from(x, y)
    room = sides.room(seen)
    confined = room > 0.0
    if searching is None:
        searching = confined | (sides.area > _FLAT * np.square(sides.size))
    if not searching.any():
        return start
    room = np.where(confined, room, np.inf)
    go_x, go_y, fall = _newton_steps(slopes(x, y, seen, searching), sides.size)
    part = np.ones(len(x))
    for _ in range(rounds):
        step_x, step_y = part * go_x, part * go_y
        length = np.sqrt(step_x * step_x + step_y * step_y)
        last = searching & (length <= np.minimum(near * sides.size, room))
        x[last] += step_x[last]
        y[last] += step_y[last]
        searching = searching & ~last & (length > _NOTHING * sides.size)
        if not searching.any():
            break
        there_x, there_y = np.where(searching, x + step_x, x), np.where(searching, y + step_y, y)
        seen = sides.seen_from(there_x, there_y)
        room_there = np.where(confined, sides.room(seen), np.inf)
        inside = room_there >= 0.0
        there = slopes(there_x, there_y, seen, searching & inside)
        slope = there.x * go_x + there.y * go_y
        taken = searching & inside & (slope <= -_RISE * fall)
        # where the line through both slopes is level, but neither too near nor too far
        level = np.clip(fall / np.minimum(fall - slope, -1e-300), _LEAST, _MOST)
        part = np.where(taken, 1.0, part * np.where(inside, level, _MOST))
        if taken.any():
            next_x, next_y, next_fall = _newton_steps(there, sides.size)
            x, y = np.where(taken, there_x, x), np.where(taken, there_y, y)
            go_x, go_y = np.where(taken, next_x, go_x), np.where(taken, next_y, go_y)
            fall, room = np.where(taken, next_fall, fall), np.where(taken, room_there, room)
    return np.column_stack([x, y])


def _newton_steps(slopes: Slopes, size: Array) -> tuple[Array, Array, Array]:
    """Return Newton's steps x and y, (n,) m, and how fast the cost falls along them: its slope, negative.

    No step is longer than half the cell's perimeter.
    """
    slope_x, slope_y, xx, xy, yy = slopes
    trace, determinant = xx + yy, xx * yy - xy * xy
    bowl = (trace > 0.0) & (determinant > _FLATTEST * trace * trace)
    if bowl.all():
        go_x, go_y = xy * slope_y - yy * slope_x, xy * slope_x - xx * slope_y
        go_x, go_y = go_x / determinant, go_y / determinant
    else:
        safe = np.where(bowl, determinant, 1.0)
        otherwise = _downhill(slope_x, slope_y, xx, xy, yy)
        go_x = np.where(bowl, (xy * slope_y - yy * slope_x) / safe, otherwise[0])
        go_y = np.where(bowl, (xy * slope_x - xx * slope_y) / safe, otherwise[1])
    length = np.sqrt(go_x * go_x + go_y * go_y)
    part = size / np.maximum(np.maximum(length, size), 1e-300)
    go_x, go_y = go_x * part, go_y * part
    return go_x, go_y, slope_x * go_x + slope_y * go_y


def _downhill(slope_x: Array, slope_y: Array, xx: Array, xy: Array, yy: Array) -> tuple[Array, Array]:
    """Return steps as Newton's, but with the sizes of the Hessian's eigenvalues: they go down in any case."""
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = np.sqrt(half * half + xy * xy)
    # the eigenvalue of the greater size; the other by the determinant, as a difference would cancel
    great = mean + np.copysign(radius, mean)
    safe = np.where(great == 0.0, 1.0, great)
    small = (xx * yy - xy * xy) / safe
    # along its eigenvector, of which of two forms the longer is taken
    turned = np.copysign(half, half * mean)
    upper = turned >= 0.0
    axis_x = np.where(upper, radius + turned, np.copysign(1.0, mean) * xy)
    axis_y = np.where(upper, np.copysign(1.0, mean) * xy, radius - turned)
    size = np.sqrt(axis_x * axis_x + axis_y * axis_y)
    round_ = size == 0.0
    axis_x, axis_y = np.where(round_, 1.0, axis_x), np.where(round_, 0.0, axis_y)
    size = np.where(round_, 1.0, size)
    axis_x, axis_y = axis_x / size, axis_y / size
    greatest = np.abs(safe)
    along = -(slope_x * axis_x + slope_y * axis_y) / greatest
    across = -(slope_y * axis_x - slope_x * axis_y) / np.maximum(np.abs(small), _FLATTEST * greatest)
    return along * axis_x - across * axis_y, along * axis_y + across * axis_x
