"""Descent of the exact coverage cost from given positions to a local minimum."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy

from robocov.arrays import compute_lengths
from robocov.cost import CoverageCost, CoverageResult
from robocov.optimum.configuration_space import ConfigurationSpace
from robocov.typing import FloatArray, IntArray

_MAX_STEPS = 300
"""Maximum number of steps of a descent. A few dozen are typical."""

_MAX_CURVATURE_PAIRS = 8
"""Maximum number of recent steps from which the curvature is estimated."""

_SUFFICIENT_DECREASE = 1e-4
"""Fraction of the decrease predicted by the gradient that a step must achieve (the Armijo condition)."""

_MAX_QUASI_NEWTON_TRIALS = 4
"""Maximum number of trial steps along the quasi-Newton direction, each half as long as the previous one."""

_MAX_GRADIENT_TRIALS = 14
"""Maximum number of trial steps along the scaled gradient, each half as long as the previous one."""

_STALL_STEPS = 5
"""Number of the last steps whose decreases are added up to detect a stall."""

_STALL_DECREASE = 1e-7
"""The descent ends when this sum is below this fraction of the cost."""

_MIN_CURVATURE = 1e-10
"""A step is recorded only if its scalar product with the change of the gradient is larger than this fraction
of the squared change."""


@dataclass(frozen=True, slots=True)
class _CurvaturePair:
    """A step of the descent and the change of the gradient, from which the curvature is estimated."""

    move: FloatArray
    """(n, 2) m, change of the positions."""
    gradient_change: FloatArray
    """(n, 2) change of the gradient."""


def descend(
    cost: CoverageCost,
    space: ConfigurationSpace,
    positions: FloatArray,
    robot_components: IntArray,
    heartbeat: Callable[[], None] = lambda: None,
) -> CoverageResult:
    """Find a local minimum of the coverage cost by descent from given positions.

    Parameters
    ----------
    cost : CoverageCost
        The cost to minimize.
    space : ConfigurationSpace
        The positions at which robots fit.
    positions : (n, 2) array, m
        Positions from which the descent starts.
    robot_components : (n,) int array
        Index of the component of the free space in which each robot stays.
    heartbeat : callable, optional
        Called before each step. It may raise an exception to stop.

    Returns
    -------
    CoverageResult
        The cost of the final positions. Its mean distance is never larger than that of the initial positions.

    Notes
    -----
    The descent takes projected quasi-Newton steps: L-BFGS (Nocedal and Wright, *Numerical Optimization*,
    algorithm 7.4), with an initial Hessian that contains the curvature of Weiszfeld's iteration for the
    geometric median. Each step is projected onto the configuration space, and halved until the cost decreases
    enough. The cost is only piecewise smooth, since sites change owners and paths, and a wall may stop a
    robot. If no step along the quasi-Newton direction decreases the cost enough, the descent forgets the
    curvature and follows the gradient, divided by the initial Hessian.
    """
    descent = _Descent(cost, space, robot_components, cost(positions))
    decreases: deque[float] = deque(maxlen=_STALL_STEPS)
    for _ in range(_MAX_STEPS):
        heartbeat()
        previous_distance = descent.result.mean_distance
        if not descent.step():
            break
        mean_distance = descent.result.mean_distance
        decreases.append(previous_distance - mean_distance)
        if len(decreases) == _STALL_STEPS and sum(decreases) < _STALL_DECREASE * mean_distance:
            break
    return descent.result


@dataclass
class _Descent:
    """The state of a descent.

    Attributes
    ----------
    cost : CoverageCost
        The cost to minimize.
    space : ConfigurationSpace
        The positions at which robots fit.
    robot_components : (n,) int array
        Index of the component of the free space in which each robot stays.
    result : CoverageResult
        The cost of the current positions.
    recent_pairs : deque of _CurvaturePair
        The last steps, from which the curvature is estimated.
    """

    cost: CoverageCost
    space: ConfigurationSpace
    robot_components: IntArray
    result: CoverageResult
    recent_pairs: deque[_CurvaturePair] = field(default_factory=lambda: deque(maxlen=_MAX_CURVATURE_PAIRS))

    def step(self) -> bool:
        """Move the robots to positions of lower cost; return whether that was possible."""
        gradient = _compute_gradient(self.result)
        # The cost does not resolve distances below half the spacing of the sites.
        curvature = _compute_curvature(self.result, min_distance=self.cost.spacing / 2.0)[:, None]
        improved = None
        if self.recent_pairs:
            direction = _compute_quasi_newton_direction(gradient, curvature, self.recent_pairs)
            improved = self._search_line(gradient, direction, _MAX_QUASI_NEWTON_TRIALS)
        if improved is None:
            self.recent_pairs.clear()
            improved = self._search_line(gradient, -gradient / curvature, _MAX_GRADIENT_TRIALS)
        if improved is None:
            return False
        move = improved.positions - self.result.positions
        gradient_change = _compute_gradient(improved) - gradient
        # Quasi-Newton directions lead downhill only if the cost has a positive curvature along each recorded
        # step.
        if (move * gradient_change).sum() > _MIN_CURVATURE * (gradient_change * gradient_change).sum():
            self.recent_pairs.append(_CurvaturePair(move, gradient_change))
        self.result = improved
        return True

    def _search_line(
        self, gradient: FloatArray, direction: FloatArray, max_trials: int
    ) -> CoverageResult | None:
        """Return the result of the longest trial step that lowers the cost enough, or None if none does.

        The first trial step is the whole `direction`, (n, 2) m. Each later one is half as long as the
        previous one.
        """
        start = self.result
        for k in range(max_trials):
            desired_positions = start.positions + 0.5**k * direction
            positions = self.space.find_nearest(desired_positions, self.robot_components)
            if positions is None:
                continue
            predicted_change = float((gradient * (positions - start.positions)).sum())
            if not predicted_change < 0.0:
                continue
            end = self.cost(positions)
            if end.mean_distance <= start.mean_distance + _SUFFICIENT_DECREASE * predicted_change:
                return end
        return None


def _compute_gradient(result: CoverageResult) -> FloatArray:
    """Return the derivative of the mean distance with respect to the positions, (n, 2)."""
    if not result.value > 0.0:
        return np.zeros_like(result.positions)
    return result.gradient * (result.mean_distance / result.value)


def _compute_curvature(result: CoverageResult, min_distance: float) -> FloatArray:
    """Return the curvature of the cost for each robot, (n,) 1/m, as in Weiszfeld's iteration.

    It is the sum of the weights of the robot's sites, each divided by the distance from the robot to its
    first waypoint, divided by the sum of the weights of all sites with an owner. For a robot without sites,
    it is 1.
    """
    sites = np.flatnonzero(result.owners >= 0)
    owners = result.owners[sites]
    offsets = result.first_waypoints[sites] - result.positions[owners]
    # Without a minimum, a site at the position of a robot would keep the robot from moving.
    distances = np.maximum(compute_lengths(offsets), min_distance)
    site_curvatures = 1.0 / distances
    total_weight = float(max(len(sites), 1))
    if result.weights is not None:
        site_curvatures *= result.weights[sites]
        # If all weights are 0, any divisor gives curvatures of 0.
        total_weight = float(result.weights[sites].sum()) or 1.0
    curvatures = np.bincount(owners, site_curvatures, minlength=len(result.positions)) / total_weight
    return np.where(curvatures > 0.0, curvatures, 1.0)


def _compute_quasi_newton_direction(
    gradient: FloatArray, curvature: FloatArray, pairs: deque[_CurvaturePair]
) -> FloatArray:
    """Return the L-BFGS direction, (n, 2) m, for an initial curvature of each robot, (n, 1) 1/m."""
    moves = np.array([pair.move for pair in pairs]).reshape(len(pairs), -1)
    changes = np.array([pair.gradient_change for pair in pairs]).reshape(len(pairs), -1)
    # SciPy's recursion starts from a Hessian equal to the identity. It therefore runs in coordinates
    # z = root * x, in which the initial Hessian, diag(root²), becomes the identity. As in Nocedal and Wright,
    # equation 7.20, the initial Hessian is scaled to fit the last move.
    diagonal = np.broadcast_to(curvature, gradient.shape).ravel()
    factor = changes[-1] @ (changes[-1] / diagonal) / (moves[-1] @ changes[-1])
    root = np.sqrt(diagonal * factor)
    inverse_hessian = scipy.optimize.LbfgsInvHessProduct(moves * root, changes / root)
    direction = inverse_hessian @ (gradient.ravel() / root)
    return np.asarray(-(direction / root).reshape(gradient.shape))
