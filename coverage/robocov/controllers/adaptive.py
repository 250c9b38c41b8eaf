"""Adaptive coverage: robots learn an unknown density from measurements along their paths."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from robocov.compiled import kernel
from robocov.controllers.base import BaseController, is_plan_due
from robocov.controllers.density_exchange import (
    MeasurementExchange,
    MeasurementMemory,
    MessageLists,
    ParameterExchange,
    add_received_measurements,
    measure_own_density,
)
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.gains import choice, gain, response_time_gain
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

_SAMPLES_PER_SIDE = 40
"""Number of samples along a side of the region, at which densities are estimated."""
_SQUARES_PER_SIDE = 20
"""Number of squares along a side; one measurement is stored for each square."""
_BASIS_WIDTH = 0.8
"""Standard deviation of a basis function, relative to the distance to the next one."""
_TIME_DECIMALS = 9
"""Number of decimal places to which the time between two plans, in seconds, is rounded."""
_NOISE_VARIANCE = 1e-3
"""Variance of a measurement, relative to that of the prior."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AdaptiveMemory(MeasurementMemory):
    """Memory of the robots, with the density as each robot estimates it."""

    lattice: Lattice
    estimates: FloatArray
    """(n, k) Estimates of φ at the samples of the lattice."""
    parameters: FloatArray
    """(n, m) Weights a of the basis functions."""
    information_matrices: FloatArray
    """(n, m, m) s, matrices Λ: the integrals of K K^T over time, along the paths of the robots."""
    information_vectors: FloatArray
    """(n, m) s, vectors λ: the integrals of K φ over time, along the paths of the robots."""
    has_new_measurements: BoolArray
    """(n,) Whether measurements of others have arrived since the last estimate of each robot."""
    parameter_exchange: ParameterExchange


@dataclass(frozen=True)
class Adaptive(BaseController):
    """Lloyd's algorithm with a density that is learned (Schwager, Rus and Slotine, IJRR 28, 2009).

    A robot measures the density only at its own position. It estimates the density everywhere from its own
    measurements and from the messages of others, and moves to the centroid of its Voronoi cell, weighted by
    the estimated density. It does not explore: where no robot has been, the estimate stays close to `prior`.

    With ``estimate="basis"``, the estimate is a sum of Gaussians as in the paper, and robots send each other
    its parameters: 4 + 8 `basis`² bytes every `period` seconds. With ``estimate="gp"``, the estimate is the
    mean of a Gaussian process, and robots send each other measurements, their own and received ones: at most
    50 every `period` seconds, 4 + 10 k bytes for k measurements. Both have the information "shared map";
    `robocov.controllers.density_exchange` describes the messages. Obstacles are not known; robots slide along
    them as with `Lloyd`.

    The gains are the fields of the dataclass; `get_gains` returns their meanings, units and ranges.

    Notes
    -----
    *Basis functions.* The estimate of robot i is K(q)·a_i. The components of K are Gaussians, centered on a
    grid of `basis` by `basis` points and divided by their sum, so that a constant density is represented
    exactly. Robot i measures φ at its position p_i, in its cell V_i with the centroid C_i, and learns by

        dΛ_i/dt = w K K^T,  dλ_i/dt = w K φ
        da_i/dt = γ (λ_i - Λ_i a_i) + k P_i (C_i - p_i) + ζ Σ_j (a_j - a_i) / deg_i,    a_i >= `min_density`

    where w is the weight of a measurement. The first term of da_i/dt fits the robot's measurements. The
    second one, with P_i = ∫ K (q - p_i)^T dq over V_i, makes the paper's Lyapunov function decrease. The
    third one is the consensus with the deg_i neighbors j from which robot i has received parameters; a_j are
    the newest of these.

    *Gaussian process.* One measurement is stored for each of 20 by 20 squares, as if taken at its center. The
    kernel is the squared exponential with the length `correlation`, as in Luo and Sycara (ICRA 2018) and
    Santos, Diaz-Mercado and Egerstedt (2018), without their mixtures and bounds. The estimate is the mean
    plus `explore` standard deviations: with a positive number, robots are attracted by unvisited areas, and
    the computation takes several times as long.

    We had only summaries of the papers, not their full texts; details may differ. Known differences from the
    paper: implicit steps of `period` seconds, which are stable for all gains; cells and centroids that are
    sampled on a lattice; w = 1; equal weights of all neighbors in the consensus.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> from robocov.simulation import Simulation
    >>> room = Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = Simulation(room, Adaptive(), [[1.0, 1.0]])
    >>> simulation.run(20.0).positions[-1].round(1)
    array([[4., 3.]])
    """

    name = "adaptive"
    label = "Adaptive"
    summary = "Lloyd's algorithm, learning the density while moving (Schwager, Rus and Slotine 2009)"
    information = "shared map"

    estimate: str = choice("basis", ("basis", "gp"), "how the density is learned")
    basis: float = gain(
        8.0, "functions", "number of functions along a side of the region", low=2.0, high=20.0, whole=True
    )
    prior: float = gain(1.0, "1", "density everywhere before the first measurement", low=1e-3)
    min_density: float = gain(0.05, "1", "minimum of the estimated density", low=1e-6)
    learning: float = gain(3.0, "1/s²", "γ, rate at which measurements are learned")
    consensus: float = gain(1.0, "1/s", "ζ, rate at which neighbors agree")
    coupling: float = gain(1e-3, "1/(m⁴ s)", "k, effect of the offset to the centroid")
    correlation: float = gain(
        0.12,
        "sides",
        "correlation length of the process, relative to the longer side of the region",
        low=0.01,
    )
    explore: float = gain(0.0, "σ", "number of standard deviations added to the estimate", high=100.0)
    period: float = gain(0.2, "s", "time from one estimate to the next", low=0.01, high=60.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> AdaptiveMemory:
        """Return the initial memory, without any measurements."""
        robot_count = len(team)
        # Gains are floats, even those that have to be whole numbers.
        functions_per_side = int(self.basis)
        lattice = Lattice.build(region, functions_per_side, self.correlation)
        sample_count, function_count = lattice.functions.shape
        return AdaptiveMemory(
            team=team,
            lattice=lattice,
            estimates=np.full((robot_count, sample_count), self.prior),
            parameters=np.full((robot_count, function_count), self.prior),
            information_matrices=np.zeros((robot_count, function_count, function_count)),
            information_vectors=np.zeros((robot_count, function_count)),
            measurements=np.full((robot_count, len(lattice.squares)), np.nan),
            has_new_measurements=np.zeros(robot_count, dtype=bool),
            parameter_exchange=ParameterExchange.build_empty(robot_count),
            measurement_exchange=MeasurementExchange.build_empty(robot_count, len(lattice.squares)),
        )

    def decide(self, seen: Observations, memory: AdaptiveMemory) -> Decision:
        """Update the estimates if they are due, and compute the forces toward the centroids."""
        memory = self._receive(seen, memory)
        if memory.goals is None or is_plan_due(memory.plan_time, self.period, seen.time):
            memory = self._plan(seen, memory)
        assert memory.goals is not None
        velocities = compute_approach_velocities(
            memory.goals - seen.positions, self.k_prop, memory.team.max_speed
        )
        forces = compute_drive_forces(velocities, seen, memory.team, self.response_time)
        terms = {"attraction": forces}
        memory, messages = self._send(seen, memory)
        return Decision(forces, memory.goals, terms, memory=memory, messages=messages)

    def _receive(self, seen: Observations, memory: AdaptiveMemory) -> AdaptiveMemory:
        """Return the memory with the content of the messages that arrive in this step."""
        if not seen.messages:
            return memory
        if self.estimate == "basis":
            return replace(memory, parameter_exchange=memory.parameter_exchange.receive(seen))
        measurements = add_received_measurements(seen, memory.measurements)
        is_added = np.isnan(memory.measurements) & ~np.isnan(measurements)
        return replace(
            memory,
            measurements=measurements,
            has_new_measurements=memory.has_new_measurements | is_added.any(axis=1),
        )

    def _send(self, seen: Observations, memory: AdaptiveMemory) -> tuple[AdaptiveMemory, MessageLists]:
        """Return the memory after this step's messages have been sent, and the messages."""
        if self.estimate == "basis":
            parameter_exchange, messages = memory.parameter_exchange.send(seen, memory.parameters)
            return replace(memory, parameter_exchange=parameter_exchange), messages
        measurement_exchange, messages = memory.measurement_exchange.send(seen, memory.measurements)
        return replace(memory, measurement_exchange=measurement_exchange), messages

    def _plan(self, seen: Observations, memory: AdaptiveMemory) -> AdaptiveMemory:
        """Return the memory with new estimates, and with the centroids of the cells as goals."""
        samples = memory.lattice.samples
        pairs = seen.find_neighbors()
        neighbor_positions = seen.positions[pairs.robots] - pairs.offsets
        is_own = find_own_samples(samples, seen.positions, pairs.robots, neighbor_positions)
        if self.estimate == "gp":
            memory = self._learn_by_gaussian_process(seen, memory)
        else:
            memory = self._learn_by_basis(seen, memory, is_own)
        goals = compute_sample_centroids(is_own, samples, memory.estimates, seen.positions)
        return replace(memory, goals=goals, plan_time=seen.time)

    def _learn_by_basis(
        self, seen: Observations, memory: AdaptiveMemory, is_own: BoolArray
    ) -> AdaptiveMemory:
        """Return the memory after one implicit step of the equations in the notes of `Adaptive`.

        Parameters
        ----------
        seen : Observations
        memory : AdaptiveMemory
        is_own : (n, k) bool array
            Which samples are in the cell of each robot.
        """
        lattice = memory.lattice
        exchange = memory.parameter_exchange.forget_silent_robots(seen.neighbors)
        dt = self._compute_elapsed_time(seen.time, memory.plan_time)
        functions = lattice.evaluate_basis(seen.positions)
        # These are Λ and λ, after one step of the first two equations.
        matrices = memory.information_matrices + dt * functions[:, :, None] * functions[:, None]
        vectors = memory.information_vectors + dt * functions * measure_own_density(seen)[:, None]
        goals = compute_sample_centroids(is_own, lattice.samples, memory.estimates, seen.positions)
        # P (C - p) is the integral over the cell of K(q) (q - p)·(C - p), here a sum over samples q.
        offsets = lattice.samples - seen.positions[:, None]
        moments = is_own * (offsets * (goals - seen.positions)[:, None]).sum(axis=2) * lattice.sample_area
        coupling = _multiply(moments, lattice.functions)
        # The equation has the form da/dt = drive - decay a. An implicit step solves
        # (1 + dt decay) a' = a + dt drive, which is stable for all gains.
        drive = (
            self.learning * vectors
            + self.consensus * exchange.compute_means(memory.parameters)
            + self.coupling * coupling
        )
        identity = np.eye(memory.parameters.shape[1])
        decay = self.learning * matrices + self.consensus * identity
        parameters = _solve(identity + dt * decay, memory.parameters + dt * drive)
        parameters = np.maximum(parameters, self.min_density)
        return replace(
            memory,
            estimates=_multiply(parameters, lattice.functions.T),
            parameters=parameters,
            information_matrices=matrices,
            information_vectors=vectors,
            parameter_exchange=exchange.start_period(),
        )

    def _compute_elapsed_time(self, time: float, plan_time: float) -> float:
        """Return the time since the last plan, s; `period` if there is none, or if the run was rewound."""
        elapsed = time - plan_time
        if not 0.0 < elapsed < np.inf:
            return self.period
        # Rounded, because the times contain rounding errors that depend on the step.
        return round(elapsed, _TIME_DECIMALS)

    def _learn_by_gaussian_process(self, seen: Observations, memory: AdaptiveMemory) -> AdaptiveMemory:
        """Return the memory after each robot has measured, with estimates from all known measurements."""
        lattice = memory.lattice
        values = measure_own_density(seen)
        measurements = memory.measurements.copy()
        estimates = memory.estimates.copy()
        for robot, position in enumerate(seen.positions):
            square = ((lattice.squares - position) ** 2).sum(axis=1).argmin()
            is_new = measurements[robot, square] != values[robot]
            measurements[robot, square] = values[robot]
            if is_new or memory.has_new_measurements[robot]:
                estimate = self._estimate_by_gaussian_process(lattice, measurements[robot])
                estimates[robot] = np.maximum(estimate, self.min_density)
        return replace(
            memory,
            estimates=estimates,
            measurements=measurements,
            has_new_measurements=np.zeros(len(values), dtype=bool),
            measurement_exchange=memory.measurement_exchange.start_period(measurements),
        )

    def _estimate_by_gaussian_process(self, lattice: Lattice, measurements: FloatArray) -> FloatArray:
        """Return one robot's estimate at the samples, (k,), given its measurements in the squares, (s,).

        It is the mean of the Gaussian process, plus `explore` standard deviations. All variances and
        covariances are relative to the variance of the prior, whose standard deviation is taken to be as
        large as its mean, `prior`.
        """
        is_known = ~np.isnan(measurements)
        known_covariance = lattice.square_covariance[is_known][:, is_known]
        noise = _NOISE_VARIANCE * np.eye(len(known_covariance))
        factor = scipy.linalg.cho_factor(known_covariance + noise)
        weights = scipy.linalg.cho_solve(factor, measurements[is_known] - self.prior)
        estimate = self.prior + lattice.sample_covariance[:, is_known] @ weights
        if self.explore:
            # The posterior variance of square i is 1 - c_i^T C^-1 c_i: row i of `cross_covariance`, c_i,
            # contains the covariances with the measured squares, and C is the noisy covariance of these.
            cross_covariance = lattice.square_covariance[:, is_known]
            solution = scipy.linalg.cho_solve(factor, cross_covariance.T).T
            variances = np.maximum(1.0 - (cross_covariance * solution).sum(axis=1), 0.0)
            # A sample has the standard deviation of the nearest square: the one with the largest covariance.
            nearest_square = lattice.sample_covariance.argmax(axis=1)
            estimate += self.explore * self.prior * np.sqrt(variances)[nearest_square]
        return np.asarray(estimate)


@kernel
def _multiply(first: FloatArray, second: FloatArray) -> FloatArray:
    """Multiply two matrices. The result has the same bits on all processors, unlike that of BLAS."""
    result = np.zeros((len(first), second.shape[1]))
    for i in range(len(first)):
        for k in range(len(second)):
            for j in range(second.shape[1]):
                result[i, j] += first[i, k] * second[k, j]
    return result


@kernel
def _solve(matrices: FloatArray, right_sides: FloatArray) -> FloatArray:
    """Solve n systems of m linear equations by Gaussian elimination, and return the solutions, (n, m).

    The results have the same bits on all processors, unlike those of LAPACK. The matrices, (n, m, m), must be
    symmetric and positive definite, so that no pivoting is needed. The right-hand sides are (n, m).
    """
    matrices = matrices.copy()
    solutions = right_sides.copy()
    m = solutions.shape[1]
    for i in range(len(solutions)):
        # Eliminate the elements below the diagonal.
        for k in range(m):
            for row in range(k + 1, m):
                factor = matrices[i, row, k] / matrices[i, k, k]
                if factor == 0.0:
                    continue
                solutions[i, row] -= factor * solutions[i, k]
                for column in range(k, m):
                    matrices[i, row, column] -= factor * matrices[i, k, column]
        # Substitute back, from the last row to the first.
        for row in range(m - 1, -1, -1):
            for column in range(row + 1, m):
                solutions[i, row] -= matrices[i, row, column] * solutions[i, column]
            solutions[i, row] /= matrices[i, row, row]
    return solutions


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Sample points of a region, basis functions, and squares with one measurement each."""

    samples: FloatArray
    """(k, 2) Sample points, in meters."""
    sample_area: float
    """Area that each sample represents, m²."""
    centers: FloatArray
    """(m, 2) Centers of the basis functions, in meters."""
    width: float
    """Standard deviation of the basis functions, m."""
    functions: FloatArray
    """(k, m) K at the samples."""
    squares: FloatArray
    """(s, 2) m, centers of the squares with one measurement each. They divide the bounding box of the region
    equally in x and in y. If the box is not a square, they are rectangles."""
    sample_covariance: FloatArray
    """(k, s) Covariances of φ at the samples and at the centers of the squares."""
    square_covariance: FloatArray
    """(s, s) Covariances of φ at the centers of the squares."""

    @classmethod
    def build(cls, region: Region, basis: int, correlation: float) -> Lattice:
        """Build the lattice of a region.

        Parameters
        ----------
        region : Region
        basis : int
            Number of basis functions along each side of the bounding box.
        correlation : float
            Correlation length, relative to the longer side of the bounding box.
        """
        low_x, low_y, high_x, high_y = region.bounds
        longer_side = max(high_x - low_x, high_y - low_y)
        length = correlation * longer_side
        width = _BASIS_WIDTH * longer_side / basis
        samples = _build_grid(region, _SAMPLES_PER_SIDE)
        sample_area = (high_x - low_x) * (high_y - low_y) / len(samples)
        samples = samples[region.contains(samples)]
        centers = _build_grid(region, basis)
        squares = _build_grid(region, _SQUARES_PER_SIDE)
        return cls(
            samples=samples,
            sample_area=sample_area,
            centers=centers,
            width=width,
            functions=_evaluate_basis(samples, centers, width),
            squares=squares,
            sample_covariance=np.exp(-_compute_exponents(samples, squares, length)),
            square_covariance=np.exp(-_compute_exponents(squares, squares, length)),
        )

    def evaluate_basis(self, points: FloatArray) -> FloatArray:
        """Return the basis functions K at (n, 2) points, (n, m)."""
        return _evaluate_basis(points, self.centers, self.width)


def _build_grid(region: Region, count: int) -> FloatArray:
    """Return the centers of `count` by `count` equal rectangles over the bounding box, (count², 2) m."""
    low_x, low_y, high_x, high_y = region.bounds
    fractions = (np.arange(count) + 0.5) / count
    x, y = np.meshgrid(low_x + fractions * (high_x - low_x), low_y + fractions * (high_y - low_y))
    return np.column_stack([x.ravel(), y.ravel()])


def _evaluate_basis(points: FloatArray, centers: FloatArray, width: float) -> FloatArray:
    """Return Gaussians at points, (k, m), divided by their sum at each point."""
    exponents = _compute_exponents(points, centers, width)
    # Scaled so that the nearest Gaussian is 1: far from all centers, the sum would underflow.
    values = np.exp(exponents.min(axis=1, keepdims=True) - exponents)
    return np.asarray(values / values.sum(axis=1, keepdims=True))


def _compute_exponents(points: FloatArray, others: FloatArray, length: float) -> FloatArray:
    """Return d² / (2 length²) for the distances d of (k, 2) points from (m, 2) others, (k, m)."""
    squared_distances = ((points[:, None] - others) ** 2).sum(axis=2)
    return np.asarray(squared_distances / (2.0 * length * length))
