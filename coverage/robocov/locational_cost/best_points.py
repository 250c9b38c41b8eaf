"""The point of a cell with the best locational cost (4), which is the target of its robot.

It is found by Newton's method, in all cells at once. For f = r the cost of a convex cell is strictly convex.
For f = 1/(r²+h²) it need not be, but it has no second optimum: f is (-1/2)-concave, and in the plane the
integral of such a function over a convex set that moves is quasi-concave (Borell; Brascamp and Lieb). Along
any line the cost therefore first falls and then rises. If it still falls at the end of a step, the step was
not too long. A step must satisfy this condition and stay in the cell; there are no other conditions. The
search never computes the difference of two costs, which would suffer from cancellation.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.compiled import kernel
from robocov.density import Density
from robocov.errors import ParameterError, describe_unknown_name
from robocov.locational_cost.integrals import CellDerivatives, compute_derivatives
from robocov.locational_cost.performance import Distance, Performance, Sensing, SquaredDistance
from robocov.locational_cost.weighted_derivatives import compute_weighted_derivatives
from robocov.observation import Cells

TARGETS = ("centroid", "sensing", "median")
"""The optima for f = r², (12); f = 1/(r²+h²), (14); and f = r, as in the coverage cost (22)."""
TARGET_HELP = "goal of a robot in its cell: the optimum for r², 1/(r²+h²), or r"
"""Description of the controllers' parameter `target`."""
HEIGHT_HELP = "height h of the sensor in (14), for target=sensing"
"""Description of the controllers' parameter `height`."""

_MAX_ITERATIONS = 80
"""Most cells need 4; a very thin cell below a low sensor needs a few dozen."""
_MAX_WEIGHTED_ITERATIONS = 30
"""The same for densities that are not uniform."""
_STEP_TOLERANCE = 1e-7
"""Length of a step, relative to half the perimeter of the cell, below which the search has converged."""
_WEIGHTED_STEP_TOLERANCE = 1e-6
"""The same for densities that are not uniform, where a quadrature limits the accuracy."""
_MIN_STEP = 1e-15
"""Smallest length of a step, relative to half the perimeter of the cell, that changes the point."""
_MIN_CURVATURE = 1e-14
"""Curvatures up to this fraction of the largest one may be rounding errors."""
_MIN_AREA = 1e-9
"""Areas of cells up to this fraction of the square of half the perimeter may be rounding errors."""
_MIN_WEIGHTED_CLEARANCE = 1e-9
"""A cell counts as convex if the clearance of its centroid exceeds this fraction of half the perimeter."""
_MIN_MEAN_DENSITY = 1e-12
"""Mean density of a cell, relative to the largest density, below which the cell keeps its centroid."""
_MAX_RISE = 0.5
"""A step is accepted if the slope at its end is at most this fraction of the descent at its start."""
_MIN_SHORTENING = 0.1
_MAX_SHORTENING = 0.5
"""Range of the factor by which a step that is not accepted is shortened."""
_MIN_SLOPE_CHANGE = 1e-300
_MIN_LENGTH_M = 1e-300
"""Smallest values used as divisors, which prevent division by zero."""


class _Search(NamedTuple):
    """State of the search in n cells.

    Attributes
    ----------
    points : (n, 2) array, m
        Best points so far, relative to the generators.
    trials : (n, 2) array, m
        Points to evaluate next.
    is_active : (n,) bool array
        Cells whose search continues.
    clearance : (n,) array, m
        Clearance of `points`; infinite in cells that do not confine the search.
    step_x, step_y : (n,) arrays, m
        Full step from `points`.
    slope : (n,) array
        Directional derivative of the cost along the full step, which is negative.
    fraction : (n,) array
        Fraction of the full step that leads to `trials`; nan before the first step.
    """

    points: Array
    trials: Array
    is_active: BoolArray
    clearance: Array
    step_x: Array
    step_y: Array
    slope: Array
    fraction: Array


def find_targets(cells: Cells, density: Density | None, target: str, height: float) -> Array:
    """Find the target of each robot, which lies in its cell if that is convex.

    Parameters
    ----------
    cells : Cells
        Cells of n robots.
    density : Density or None
    target : {"centroid", "sensing", "median"}
    height : float, m
        h of equation (14), for "sensing".

    Returns
    -------
    (n, 2) array, m

    Raises
    ------
    ParameterError
        If the target is unknown, or the height is not above 0.

    Notes
    -----
    "centroid" and "median" take all points of the cell into account. With "sensing", points within a few h of
    the target matter most, and the far ends of a much larger cell hardly count; if h is much larger than the
    cell, the target is the centroid.

    Without obstacles, the choice hardly affects the coverage cost (22). With walls it matters more: moving
    the target by a few centimeters can decide whether a robot gets around a wall. This is usually a
    disadvantage of "sensing" with a low h.
    """
    if target == "centroid":
        return cells.centroid
    if target not in TARGETS:
        raise ParameterError(f"target: {describe_unknown_name('target', target, TARGETS)}")
    f = Distance() if target == "median" else Sensing(height)
    return find_best_points(cells, f, density)


def find_best_points(cells: Cells, f: Performance, density: Density | None = None) -> Array:
    """Find the point of each cell at which the locational cost is best.

    Parameters
    ----------
    cells : Cells
        n cells.
    f : Performance
    density : Density or None
        By default 1 everywhere.

    Returns
    -------
    (n, 2) array, m
        Points at which ∫ f(|q-p|) φ(q) dq over the cell is best.

    Notes
    -----
    With density 1, the point lies in its cell and is the only optimum, if the cell is convex. In a cell that
    is not convex, such as those of robots of different speeds, it is an optimum near the centroid; for f = r
    it is the best one.

    With another density, it is the best point for f = r and a convex cell; for f = 1/(r²+h²) it is the
    optimum that is reached from the centroid. A cell that is not convex, or in which the density is zero,
    keeps its centroid.

    An empty cell keeps its generator.

    Examples
    --------
    >>> from robocov import Region, partition
    >>> triangle = Region(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]))
    >>> find_best_points(partition(np.array([[1.0, 0.5]]), triangle), Distance()).round(4)
    array([[0.9733, 0.9733]])
    """
    centroid = cells.centroid - cells.generators
    shape = compute_derivatives(cells.edges, centroid, SquaredDistance())
    if density is None or density.is_uniform:
        points = _search_uniform(cells, f, shape, centroid)
    else:
        points = _search_weighted(cells, f, density, shape, centroid)
    return cells.generators + points


def _search_uniform(cells: Cells, f: Performance, shape: CellDerivatives, centroid: Array) -> Array:
    """Return the best points for density 1, (n, 2) m relative to the generators."""
    is_active = (shape.clearance > 0.0) | (shape.area > _MIN_AREA * np.square(shape.half_perimeter))
    search = _start_search(centroid, is_active)
    for _ in range(_MAX_ITERATIONS + 1):
        if not search.is_active.any():
            break
        derivatives = compute_derivatives(cells.edges, search.trials, f)
        _advance(search, derivatives, f.sign, _STEP_TOLERANCE)
    return search.points


def _search_weighted(
    cells: Cells, f: Performance, density: Density, shape: CellDerivatives, centroid: Array
) -> Array:
    """Return the best points for a density that is not uniform, (n, 2) m relative to the generators.

    Gradient and Hessian come from a quadrature, and the shapes of the cells from the integrals for density 1.
    Cells that are not convex, or almost without mass, keep their centroids.
    """
    is_convex = shape.clearance > _MIN_WEIGHTED_CLEARANCE * shape.half_perimeter
    has_mass = cells.mass > _MIN_MEAN_DENSITY * density.max_value * shape.area
    search = _start_search(centroid, is_convex & has_mass)
    for _ in range(_MAX_WEIGHTED_ITERATIONS + 1):
        if not search.is_active.any():
            break
        derivatives = compute_derivatives(cells.edges, search.trials, f)
        weighted = compute_weighted_derivatives(
            cells, density, f, shape.half_perimeter, search.trials, search.is_active
        )
        derivatives = derivatives._replace(**weighted._asdict())
        # The weighted derivatives are already those of a cost to be minimized.
        _advance(search, derivatives, 1.0, _WEIGHTED_STEP_TOLERANCE)
    return search.points


def _start_search(points: Array, is_active: BoolArray) -> _Search:
    """Return the state before the first step from the given points."""
    count = len(points)
    return _Search(
        points=points,
        trials=points.copy(),
        is_active=is_active,
        clearance=np.full(count, np.nan),
        step_x=np.full(count, np.nan),
        step_y=np.full(count, np.nan),
        slope=np.full(count, np.nan),
        fraction=np.full(count, np.nan),
    )


@kernel
def _advance(search: _Search, derivatives: CellDerivatives, sign: float, tolerance: float) -> None:
    """Advance Newton's method in all cells: accept the trial points, or shorten the steps to them.

    A full step leads from the best point of a cell so far to where Newton's method expects the optimum. Along
    it, the cost falls at first, and may then rise. A trial point is accepted if it is in its cell and the
    cost rises there, if at all, at most half as steeply as it falls at the start of the step (`_MAX_RISE`):
    then the step was not much too long. Otherwise, only a fraction of the step is tried next.

    `derivatives` are those at the trial points, and `sign` makes the cost one to be minimized. The search in
    a cell has converged if the step is shorter than `tolerance`, relative to half the perimeter of the cell.
    """
    for i in range(len(search.points)):
        if not search.is_active[i]:
            continue
        clearance = derivatives.clearance[i]
        is_first = np.isnan(search.fraction[i])
        # The clearance is the distance from the boundary, and negative outside the cell. A cell that is not
        # convex does not confine the search.
        is_unconfined = search.clearance[i] == np.inf or (is_first and clearance <= 0.0)
        if is_unconfined:
            clearance = np.inf
        trial_slope = sign * (derivatives.x[i] * search.step_x[i] + derivatives.y[i] * search.step_y[i])
        # The slope at the start of the step is negative, so that this limit is positive.
        max_trial_slope = -_MAX_RISE * search.slope[i]
        is_in_cell = clearance >= 0.0
        if is_first or (is_in_cell and trial_slope <= max_trial_slope):
            _accept_trial(search, derivatives, i, sign, clearance)
        elif is_in_cell:
            _shorten_to_zero_slope(search, i, trial_slope)
        else:
            search.fraction[i] *= _MAX_SHORTENING
        _choose_next_trial(search, i, derivatives.half_perimeter[i], tolerance)


@kernel
def _shorten_to_zero_slope(search: _Search, i: int, trial_slope: float) -> None:
    """Shorten the step in cell i, because the cost rises too steeply at its trial point.

    The next trial is where the slope would be zero if it changed linearly along the step, within limits.
    """
    factor = search.slope[i] / min(search.slope[i] - trial_slope, -_MIN_SLOPE_CHANGE)
    search.fraction[i] *= min(max(factor, _MIN_SHORTENING), _MAX_SHORTENING)


@kernel
def _accept_trial(
    search: _Search, derivatives: CellDerivatives, i: int, sign: float, clearance: float
) -> None:
    """Move the best point of cell i to the trial point, and compute the full Newton step from there.

    With `sign`, the derivatives are those of a cost to be minimized.
    """
    search.points[i, 0] = search.trials[i, 0]
    search.points[i, 1] = search.trials[i, 1]
    gradient_x = sign * derivatives.x[i]
    gradient_y = sign * derivatives.y[i]
    xx = sign * derivatives.xx[i]
    xy = sign * derivatives.xy[i]
    yy = sign * derivatives.yy[i]
    step_x, step_y = _compute_newton_step(gradient_x, gradient_y, xx, xy, yy, derivatives.half_perimeter[i])
    search.clearance[i] = clearance
    search.step_x[i] = step_x
    search.step_y[i] = step_y
    search.slope[i] = gradient_x * step_x + gradient_y * step_y
    search.fraction[i] = 1.0


@kernel
def _choose_next_trial(search: _Search, i: int, half_perimeter: float, tolerance: float) -> None:
    """Choose the next trial point of cell i, or end its search if the step to it is short enough.

    A short last step is taken without a trial, unless it might lead out of the cell: it must not be longer
    than the distance of the best point so far from the boundary (the clearance).
    """
    x = search.fraction[i] * search.step_x[i]
    y = search.fraction[i] * search.step_y[i]
    length = np.sqrt(x * x + y * y)
    search.trials[i, 0] = search.points[i, 0] + x
    search.trials[i, 1] = search.points[i, 1] + y
    if length <= min(tolerance * half_perimeter, search.clearance[i]):
        search.points[i, 0] = search.trials[i, 0]
        search.points[i, 1] = search.trials[i, 1]
        search.is_active[i] = False
    elif not length > _MIN_STEP * half_perimeter:
        # The step changes nothing, or its length is nan.
        search.is_active[i] = False


@kernel
def _compute_newton_step(
    gradient_x: float, gradient_y: float, xx: float, xy: float, yy: float, max_length: float
) -> tuple[float, float]:
    """Return the Newton step -H⁻¹ g for the gradient g and the Hessian H, of limited length.

    If H is not positive definite, or almost singular, the step would not lead to a minimum. A step that is
    certain to descend replaces it.
    """
    trace = xx + yy
    determinant = xx * yy - xy * xy
    if trace > 0.0 and determinant > _MIN_CURVATURE * trace * trace:
        x = (xy * gradient_y - yy * gradient_x) / determinant
        y = (xy * gradient_x - xx * gradient_y) / determinant
    else:
        x, y = _compute_descent_step(gradient_x, gradient_y, xx, xy, yy)
    factor = max_length / max(np.sqrt(x * x + y * y), max_length, _MIN_LENGTH_M)
    return x * factor, y * factor


@kernel
def _compute_descent_step(
    gradient_x: float, gradient_y: float, xx: float, xy: float, yy: float
) -> tuple[float, float]:
    """Return the Newton step for the Hessian with the absolute values of its eigenvalues.

    This matrix is positive definite, so that the step always descends. The step is the sum of those along the
    two eigenvectors: minus the component of the gradient, divided by the absolute value of the eigenvalue.
    """
    # The eigenvalues are mean + radius and mean - radius.
    mean = 0.5 * (xx + yy)
    half_difference = 0.5 * (xx - yy)
    radius = np.sqrt(half_difference * half_difference + xy * xy)
    sign = -1.0 if mean < 0.0 else 1.0
    # The eigenvalue of larger magnitude. The other one follows from the determinant, without cancellation.
    large = mean + sign * radius
    if large != 0.0:
        magnitude = abs(large)
        small = (xx * yy - xy * xy) / large
    else:
        # The Hessian is zero. Any length will do, because the caller limits it.
        magnitude = 1.0
        small = xx * yy - xy * xy
    # The eigenvector of `large`, whose absolute value is the larger eigenvalue of the Hessian times `sign`.
    x, y = _compute_eigenvector(sign * half_difference, sign * xy, radius)
    # The step along this eigenvector, and along the one perpendicular to it, of the eigenvalue `small`.
    along = -(gradient_x * x + gradient_y * y) / magnitude
    across = -(gradient_y * x - gradient_x * y) / max(abs(small), _MIN_CURVATURE * magnitude)
    return along * x - across * y, along * y + across * x


@kernel
def _compute_eigenvector(half_difference: float, xy: float, radius: float) -> tuple[float, float]:
    """Return a unit eigenvector of a symmetric matrix, for its larger eigenvalue.

    The matrix is a multiple of the identity plus ((half_difference, xy), (xy, -half_difference)), whose
    eigenvalues are plus and minus `radius`. Both (radius + half_difference, xy) and
    (xy, radius - half_difference) are eigenvectors; the longer one is more accurate, and is used.
    """
    if half_difference >= 0.0:
        x = radius + half_difference
        y = xy
    else:
        x = xy
        y = radius - half_difference
    length = np.sqrt(x * x + y * y)
    if length > 0.0:
        return x / length, y / length
    return 1.0, 0.0
