"""The point of a cell with the best locational cost (4), which is the target of its robot.

The point is found by Newton's method, in all cells at the same time. In a convex cell, the cost for f = r is
a strictly convex function of the point. For f = 1/(r²+h²), the cost need not be convex, but it has only one
optimum: f is (-1/2)-concave, and in the plane, the integral of such a function over a convex set that moves
is quasi-concave (Borell; Brascamp and Lieb). Along any line, the cost to be minimized therefore first falls
and then rises. If it still falls at the end of a step, the step was not too long. A step is accepted if it is
not much too long in this sense, and does not leave the cell; there is no other condition. The search never
computes the difference of two costs, which would suffer from cancellation.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.density import Density
from robocov.errors import ParameterError, describe_unknown_name
from robocov.locational_cost.integrals import CellDerivatives, compute_derivatives
from robocov.locational_cost.performance import Distance, Performance, Sensing, SquaredDistance
from robocov.locational_cost.weighted_derivatives import compute_weighted_derivatives
from robocov.observation import Cells
from robocov.typing import BoolArray, FloatArray

TARGETS = ("centroid", "sensing", "median")
"""Names of the targets: the best points for f = r² (12), for f = 1/(r²+h²) (14), and for f = r as in (22)."""
TARGET_HELP = "goal of a robot in its cell: the optimum for r², 1/(r²+h²), or r"
"""Description of the controllers' parameter `target`."""
HEIGHT_HELP = "height h of the sensor in (14), for target=sensing"
"""Description of the controllers' parameter `height`."""

_MAX_ITERATIONS = 80
"""Maximum number of iterations. Most cells need 4; a very thin cell below a low sensor needs a few dozen."""
_MAX_WEIGHTED_ITERATIONS = 30
"""Maximum number of iterations for densities that are not uniform."""
_STEP_TOLERANCE = 1e-7
"""The search ends with a step of at most this length, as a fraction of half the perimeter of the cell."""
_WEIGHTED_STEP_TOLERANCE = 1e-6
"""Step at which the search ends for densities that are not uniform, whose quadrature limits the accuracy."""
_MIN_STEP = 1e-15
"""Steps up to this fraction of half the perimeter of the cell may be too short to change the point."""
_MIN_CURVATURE = 1e-14
"""Curvatures up to this fraction of the largest curvature may be rounding errors."""
_MIN_AREA = 1e-9
"""Areas of cells up to this fraction of the square of half the perimeter may be rounding errors."""
_MIN_WEIGHTED_CLEARANCE = 1e-9
"""A cell counts as convex if the clearance of its centroid exceeds this fraction of half the perimeter."""
_MIN_MEAN_DENSITY = 1e-12
"""A cell keeps its centroid if its mean density is below this fraction of the maximum density."""
_MAX_RISE = 0.5
"""A step is accepted if the cost rises at its end at most this fraction as steeply as it falls at its
start."""
_MIN_SHORTENING = 0.1
"""Minimum factor by which a step that is not accepted is multiplied."""
_MAX_SHORTENING = 0.5
"""Maximum such factor."""
_MIN_SLOPE_CHANGE = 1e-300
"""Minimum difference of two slopes used as a divisor; prevents division by zero."""
_MIN_LENGTH_M = 1e-300
"""Minimum length used as a divisor; prevents division by zero."""


class _Search(NamedTuple):
    """The state of the search in n cells.

    Attributes
    ----------
    points : (n, 2) array, m
        Best point of each cell so far, relative to the generator.
    trials : (n, 2) array, m
        Point of each cell that is tried next, relative to the generator.
    is_active : (n,) bool array
        Whether the search in each cell continues.
    clearances : (n,) array, m
        Distance of each best point from the boundary of its cell; infinite if the search may leave the cell.
    steps_x, steps_y : (n,) array, m
        Components of the full step from each best point.
    slopes : (n,) array
        Directional derivative of the cost along each full step, which is negative.
    fractions : (n,) array
        Fraction of each full step that leads to the trial point; nan before the first step.
    """

    points: FloatArray
    trials: FloatArray
    is_active: BoolArray
    clearances: FloatArray
    steps_x: FloatArray
    steps_y: FloatArray
    slopes: FloatArray
    fractions: FloatArray


def find_targets(cells: Cells, density: Density | None, target: str, height: float) -> FloatArray:
    """Find the target of each robot: the best point of its cell.

    Parameters
    ----------
    cells : Cells
        Cells of n robots.
    density : Density or None
        The density of the cells; None means 1 everywhere.
    target : {"centroid", "sensing", "median"}
        The kind of target; see `TARGETS`.
    height : float, m
        Height h of the sensor in equation (14), for "sensing".

    Returns
    -------
    (n, 2) array, m
        Target of each robot, which lies in its cell if the cell is convex.

    Raises
    ------
    ParameterError
        If the target is unknown, or the height is not above 0.

    Notes
    -----
    For "centroid" and "median", all points of the cell count. For "sensing", the points within a few times h
    of the target count most, and the far ends of a much larger cell hardly at all. If h is much larger than
    the cell, the target is close to the centroid.

    Without obstacles, the kind of target hardly affects the coverage cost (22). With walls, it matters more:
    moving a target by a few centimeters can decide whether a robot gets around a wall. This is usually a
    disadvantage of "sensing" with a low h.
    """
    if target == "centroid":
        return cells.centroids
    if target not in TARGETS:
        raise ParameterError(f"target: {describe_unknown_name('target', target, TARGETS)}")
    f = Distance() if target == "median" else Sensing(height)
    return find_best_points(cells, f, density)


def find_best_points(cells: Cells, f: Performance, density: Density | None = None) -> FloatArray:
    """Find the point of each cell at which the locational cost is best.

    Parameters
    ----------
    cells : Cells
        n cells.
    f : Performance
        The function f of the distance.
    density : Density or None
        The density φ. By default it is 1 everywhere.

    Returns
    -------
    (n, 2) array, m
        The point p of each cell for which the integral of f(|q-p|) φ(q) over the points q of the cell is
        best; for exceptions, see Notes.

    Notes
    -----
    With a uniform density, the point of a convex cell lies in the cell and is the only optimum. In a cell
    that is not convex, such as those of robots of different speeds, it is the best point for f = r, and a
    local optimum near the centroid for f = 1/(r²+h²).

    With another density, the point of a convex cell is the best one for f = r, and the optimum that is
    reached from the centroid for f = 1/(r²+h²). For a cell that is not convex, or in which the density is
    zero, it is the centroid.

    For an empty cell, it is the generator.

    Examples
    --------
    >>> from robocov import Region, partition
    >>> triangle = Region(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]))
    >>> find_best_points(partition(np.array([[1.0, 0.5]]), triangle), Distance()).round(4)
    array([[0.9733, 0.9733]])
    """
    centroids = cells.centroids - cells.generators
    # Only the shapes of the cells and the clearances of the centroids are used, not the derivatives.
    shapes = compute_derivatives(cells.edges, centroids, SquaredDistance())
    if density is None or density.is_uniform:
        points = _search_uniform(cells, f, shapes, centroids)
    else:
        points = _search_weighted(cells, f, density, shapes, centroids)
    return cells.generators + points


def _search_uniform(
    cells: Cells, f: Performance, shapes: CellDerivatives, centroids: FloatArray
) -> FloatArray:
    """Return the best points for density 1, (n, 2) m relative to the generators.

    `shapes` contains the shapes of the cells, and the clearances of their centroids.
    """
    is_active = (shapes.clearances > 0.0) | (shapes.areas > _MIN_AREA * np.square(shapes.half_perimeters))
    search = _start_search(centroids, is_active)
    for _ in range(_MAX_ITERATIONS + 1):
        if not search.is_active.any():
            break
        derivatives = compute_derivatives(cells.edges, search.trials, f)
        _advance(search, derivatives, f.sign, _STEP_TOLERANCE)
    return search.points


def _search_weighted(
    cells: Cells, f: Performance, density: Density, shapes: CellDerivatives, centroids: FloatArray
) -> FloatArray:
    """Return the best points for a density that is not uniform, (n, 2) m relative to the generators.

    `shapes` contains the shapes of the cells, and the clearances of their centroids. Cells that are not
    convex, or almost without mass, keep their centroids.
    """
    is_convex = shapes.clearances > _MIN_WEIGHTED_CLEARANCE * shapes.half_perimeters
    has_mass = cells.masses > _MIN_MEAN_DENSITY * density.upper_bound * shapes.areas
    search = _start_search(centroids, is_convex & has_mass)
    for _ in range(_MAX_WEIGHTED_ITERATIONS + 1):
        if not search.is_active.any():
            break
        # Gradients and Hessians come from a quadrature, and all else from the integrals for density 1.
        derivatives = compute_derivatives(cells.edges, search.trials, f)
        weighted = compute_weighted_derivatives(
            cells, density, f, shapes.half_perimeters, search.trials, search.is_active
        )
        derivatives = derivatives._replace(**weighted._asdict())
        # The weighted derivatives are already those of a cost to be minimized.
        _advance(search, derivatives, 1.0, _WEIGHTED_STEP_TOLERANCE)
    return search.points


def _start_search(points: FloatArray, is_active: BoolArray) -> _Search:
    """Return the state of a search that first tries the given points, (n, 2) m relative to the generators."""
    cell_count = len(points)
    return _Search(
        points=points,
        trials=points.copy(),
        is_active=is_active,
        clearances=np.full(cell_count, np.nan),
        steps_x=np.full(cell_count, np.nan),
        steps_y=np.full(cell_count, np.nan),
        slopes=np.full(cell_count, np.nan),
        fractions=np.full(cell_count, np.nan),
    )


@kernel
def _advance(search: _Search, derivatives: CellDerivatives, sign: float, tolerance: float) -> None:
    """Carry out one iteration of Newton's method in all cells: accept the trial points, or shorten the steps.

    A full step leads from the best point of a cell so far to the point where Newton's method expects the
    optimum. Along the step, the cost falls at first, and may then rise. A trial point is accepted if it is in
    its cell and the cost does not rise too steeply there: at most half as steeply as it falls at the start of
    the step (`_MAX_RISE`). The step was then not much too long. Otherwise, a smaller fraction of the step is
    tried next.

    `derivatives` are those at the trial points. Multiplied by `sign`, they are those of a cost to be
    minimized. The search in a cell has converged if the step is not longer than `tolerance`, as a fraction of
    half the perimeter of the cell.
    """
    for i in range(len(search.points)):
        if not search.is_active[i]:
            continue
        clearance = derivatives.clearances[i]
        is_first = np.isnan(search.fractions[i])
        # The clearance is the distance from the boundary, and negative outside the cell. If it is not
        # positive at the first point, the centroid, the cell is not convex, and the search may leave it.
        may_leave_cell = search.clearances[i] == np.inf or (is_first and clearance <= 0.0)
        if may_leave_cell:
            clearance = np.inf
        trial_slope = sign * (derivatives.x[i] * search.steps_x[i] + derivatives.y[i] * search.steps_y[i])
        # The slope at the start of the step is negative, so that this limit is positive.
        max_trial_slope = -_MAX_RISE * search.slopes[i]
        is_in_cell = clearance >= 0.0
        if is_first or (is_in_cell and trial_slope <= max_trial_slope):
            _accept_trial(search, derivatives, i, sign, clearance)
        elif is_in_cell:
            _shorten_to_zero_slope(search, i, trial_slope)
        else:
            search.fractions[i] *= _MAX_SHORTENING
        _choose_next_trial(search, i, derivatives.half_perimeters[i], tolerance)


@kernel
def _shorten_to_zero_slope(search: _Search, i: int, trial_slope: float) -> None:
    """Shorten the step in cell i, because the cost rises too steeply at its trial point.

    The next trial point is where the slope would be zero if it changed linearly along the step. The factor by
    which the step is shortened is limited, however.
    """
    factor = search.slopes[i] / min(search.slopes[i] - trial_slope, -_MIN_SLOPE_CHANGE)
    search.fractions[i] *= min(max(factor, _MIN_SHORTENING), _MAX_SHORTENING)


@kernel
def _accept_trial(
    search: _Search, derivatives: CellDerivatives, i: int, sign: float, clearance: float
) -> None:
    """Move the best point of cell i to the trial point, and compute the full Newton step from there.

    Multiplied by `sign`, the derivatives are those of a cost to be minimized.
    """
    search.points[i, 0] = search.trials[i, 0]
    search.points[i, 1] = search.trials[i, 1]
    gradient_x = sign * derivatives.x[i]
    gradient_y = sign * derivatives.y[i]
    xx = sign * derivatives.xx[i]
    xy = sign * derivatives.xy[i]
    yy = sign * derivatives.yy[i]
    step_x, step_y = _compute_newton_step(gradient_x, gradient_y, xx, xy, yy, derivatives.half_perimeters[i])
    search.clearances[i] = clearance
    search.steps_x[i] = step_x
    search.steps_y[i] = step_y
    search.slopes[i] = gradient_x * step_x + gradient_y * step_y
    search.fractions[i] = 1.0


@kernel
def _choose_next_trial(search: _Search, i: int, half_perimeter: float, tolerance: float) -> None:
    """Choose the next trial point of cell i, or end its search if the step to it is short enough.

    A short last step is taken without a trial, unless it might leave the cell: it must not be longer than the
    clearance, which is the distance of the best point so far from the boundary.
    """
    x = search.fractions[i] * search.steps_x[i]
    y = search.fractions[i] * search.steps_y[i]
    length = np.sqrt(x * x + y * y)
    search.trials[i, 0] = search.points[i, 0] + x
    search.trials[i, 1] = search.points[i, 1] + y
    if length <= min(tolerance * half_perimeter, search.clearances[i]):
        search.points[i, 0] = search.trials[i, 0]
        search.points[i, 1] = search.trials[i, 1]
        search.is_active[i] = False
    elif not length > _MIN_STEP * half_perimeter:
        # The step is too short to change the point, or its length is nan.
        search.is_active[i] = False


@kernel
def _compute_newton_step(
    gradient_x: float, gradient_y: float, xx: float, xy: float, yy: float, max_length: float
) -> tuple[float, float]:
    """Return the Newton step -H⁻¹ g for the gradient g and the Hessian H, shortened to at most `max_length`.

    If H is not positive definite, or is nearly singular, this step might not lead toward a minimum. A step
    that certainly descends is then returned instead.
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

    The matrix with these eigenvalues, and the eigenvectors of the Hessian, is positive definite, so that the
    step always descends. The component of the step along an eigenvector is minus that of the gradient,
    divided by the eigenvalue. The smaller eigenvalue is replaced by at least `_MIN_CURVATURE` times the
    larger one.
    """
    # The eigenvalues are mean + radius and mean - radius.
    mean = 0.5 * (xx + yy)
    half_difference = 0.5 * (xx - yy)
    radius = np.sqrt(half_difference * half_difference + xy * xy)
    sign = -1.0 if mean < 0.0 else 1.0
    # `large` is the eigenvalue of larger magnitude. The other eigenvalue, `small`, follows from the
    # determinant, without cancellation.
    large = mean + sign * radius
    if large != 0.0:
        magnitude = abs(large)
        small = (xx * yy - xy * xy) / large
    else:
        # The Hessian is zero. The step descends, but mainly along y, because `small` is replaced by its
        # minimum below. Its length does not matter, because the caller limits it.
        magnitude = 1.0
        small = 0.0
    # The eigenvector of `large`. If the Hessian is multiplied by `sign`, `large` becomes its larger
    # eigenvalue.
    x, y = _compute_eigenvector(sign * half_difference, sign * xy, radius)
    # The component of the step along this eigenvector, and along the other one, perpendicular to it.
    along = -(gradient_x * x + gradient_y * y) / magnitude
    across = -(gradient_y * x - gradient_x * y) / max(abs(small), _MIN_CURVATURE * magnitude)
    return along * x - across * y, along * y + across * x


@kernel
def _compute_eigenvector(half_difference: float, xy: float, radius: float) -> tuple[float, float]:
    """Return the unit eigenvector of a symmetric 2 x 2 matrix for its larger eigenvalue.

    The matrix is a multiple of the identity plus ((half_difference, xy), (xy, -half_difference)), whose
    eigenvalues are plus and minus `radius`. Both (radius + half_difference, xy) and
    (xy, radius - half_difference) are such eigenvectors. The longer one is used, because it is more accurate.
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
