"""Coverage of an unknown density by a Gaussian process with upper confidence bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from robocov.controllers.base import BaseController, Information, is_plan_due
from robocov.controllers.density_exchange import (
    MeasurementExchange,
    MeasurementMemory,
    add_received_measurements,
    measure_own_density,
)
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.gaussian_process import Posterior, ProcessGrid
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

_MIN_RELATIVE_DENSITY = 1e-3
"""Minimum density in plans, relative to the root mean square of the measurements.

The posterior mean can be negative, but a mass must not be.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GpUcbMemory(MeasurementMemory):
    """Memory of the robots, with the posterior of each robot."""

    grid: ProcessGrid
    posteriors: tuple[Posterior, ...]
    """Posterior of each robot, given its own measurements and those that it has received."""


@dataclass(frozen=True)
class GpUcb(BaseController):
    """Lloyd's algorithm for an unknown density, with upper confidence bounds of a Gaussian process.

    A robot measures the density only at its own position. Robots exchange their own and received
    measurements. From all measurements that it knows, a robot computes the mean μ and the standard deviation
    σ of a Gaussian process, and moves to the centroid of its Voronoi cell, weighted by the bound μ + β σ.
    Unknown areas attract robots, because σ is large there. β decreases to 0, so that robots end at the
    centroids for the mean.

    The gains are the fields of the dataclass; `get_gains` returns their meanings, units and ranges.

    Parameters
    ----------
    beta : float, σ
        β at the start: number of standard deviations that are added to the mean.
    exploration : float, s
        Time over which β decreases linearly to 0.
    squares : float
        Number of squares along the longer side of the region. One measurement is stored for each, so that a
        robot knows at most `squares`² measurements, 400 by default.
    correlation : float, sides
        Correlation length of the process, relative to the longer side of the region.
    period : float, s
        Time between two plans.
    k_prop : float, 1/s
        Desired speed per meter of distance to the goal.
    response_time : float, s
        Time constant with which the desired velocity is reached.

    See Also
    --------
    Adaptive : Learns the density by basis functions; ``estimate="gp"`` uses the mean of a Gaussian process.
    ExploringLloyd : Explores cells systematically, and measures within the sensing range.
    Lloyd : Knows the density.

    Notes
    -----
    *Process.* The kernel is the squared exponential with the length `correlation`. The mean of the prior is
    the mean of the measurements that a robot knows, and its standard deviation their root mean square; no
    absolute scale of the density has to be known. A measurement is assigned to the center of its
    square, with a variance of 1% of that of the prior. Between the centers, mean and standard deviation are
    interpolated bilinearly.

    *Updates.* With the prior covariance K, the posterior covariance C is updated for each newly measured
    square s, in the order of the squares:

        C_ij ← C_ij - C_is C_js / (C_ss + r)

    where r is the variance of a measurement. This is exact. The posterior mean follows from all measurements
    y as μ = m + Σ_s C_is (y_s - m) / r, with the mean m of the prior. Each robot stores C: `squares`⁴
    numbers, 1.3 MB by default.

    *Messages.* In each period, a robot sends at most 50 measurements, 4 + 10 k bytes for k of them, see
    `robocov.controllers.density_exchange`.

    *Sources.* The controller follows Luo and Sycara (ICRA 2018), Benevento, Santos, Notarstefano, Paynabar,
    Bloch and Egerstedt (ICRA 2020), and Santos, Madhushani, Benevento and Leonard (MRS 2021); the bound with
    a weight β is that of Gaussian-process bandits (Krause and Ong 2011). We had only abstracts and summaries
    of these papers, not their full texts; details may differ. Known differences: one process instead of
    mixtures; robots exchange measurements instead of sending them to one place; a linear decrease of β
    instead of schedules from regret bounds, which grow with the logarithm of the number of measurements;
    fixed parameters of the kernel, apart from its scale; cells that are sampled on a lattice.

    Obstacles are not known; robots slide along them as with `Lloyd`. If robots know that the density is the
    same everywhere, they do not explore.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> from robocov.simulation import Simulation
    >>> room = Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = Simulation(room, GpUcb(), [[1.0, 1.0]])
    >>> simulation.run(20.0).positions[-1].round(1)
    array([[4., 3.]])
    """

    name = "gp-ucb"
    label = "GP-UCB"
    summary = "Lloyd's algorithm on upper confidence bounds of a learned density (Benevento et al. 2020)"
    information: ClassVar[Information] = "shared map"

    beta: float = gain(3.0, "σ", "β at the start, standard deviations added to the mean", high=100.0)
    exploration: float = gain(30.0, "s", "time over which β decreases to 0", high=1e6)
    squares: float = gain(
        20.0, "1", "number of squares along the longer side of the region", low=4.0, high=40.0, whole=True
    )
    correlation: float = gain(
        0.12,
        "sides",
        "correlation length of the process, relative to the longer side of the region",
        low=0.01,
        high=10.0,
    )
    period: float = gain(0.25, "s", "time between two plans", low=0.01, high=60.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> GpUcbMemory:
        """Return the initial memory, without any measurements."""
        robot_count = len(team)
        grid = ProcessGrid.build(region, int(self.squares), self.correlation)
        square_count = len(grid.centers)
        return GpUcbMemory(
            team=team,
            grid=grid,
            posteriors=(Posterior.build_prior(grid),) * robot_count,
            measurements=np.full((robot_count, square_count), np.nan),
            measurement_exchange=MeasurementExchange.build_empty(robot_count, square_count),
        )

    def decide(self, seen: Observations, memory: GpUcbMemory) -> Decision:
        """Receive messages, replan if it is due, and compute the forces toward the goals."""
        memory = replace(memory, measurements=add_received_measurements(seen, memory.measurements))
        if memory.goals is None or is_plan_due(memory.plan_time, self.period, seen.time):
            memory = self._plan(seen, memory)
        assert memory.goals is not None
        velocities = compute_approach_velocities(
            memory.goals - seen.positions, self.k_prop, memory.team.max_speed
        )
        forces = compute_drive_forces(velocities, seen, memory.team, self.response_time)
        exchange, messages = memory.measurement_exchange.send(seen, memory.measurements)
        memory = replace(memory, measurement_exchange=exchange)
        return Decision(forces, memory.goals, {"attraction": forces}, memory=memory, messages=messages)

    def compute_beta(self, time: float) -> float:
        """Return β at a simulation time, s."""
        if time >= self.exploration:
            return 0.0
        return self.beta * (1.0 - time / self.exploration)

    def _plan(self, seen: Observations, memory: GpUcbMemory) -> GpUcbMemory:
        """Return the memory with new measurements, and with the centroids of the cells as goals."""
        samples = memory.grid.samples
        # A known uniform density needs no measurements: a factor changes no centroid.
        bounds = np.ones((len(seen.positions), len(samples)))
        if not seen.has_known_uniform_density:
            memory = _add_own_measurements(seen, memory)
            beta = self.compute_beta(seen.time)
            for robot, posterior in enumerate(memory.posteriors):
                bound = compute_bound(posterior, memory.measurements[robot], beta)
                bounds[robot] = memory.grid.interpolate(bound)
        pairs = seen.find_neighbors()
        neighbor_positions = seen.positions[pairs.robots] - pairs.offsets
        is_own = find_own_samples(samples, seen.positions, pairs.robots, neighbor_positions)
        goals = compute_sample_centroids(is_own, samples, bounds, seen.positions)
        return replace(memory, goals=goals, plan_time=seen.time)


def compute_bound(posterior: Posterior, measurements: FloatArray, beta: float) -> FloatArray:
    """Compute the upper confidence bound of the density in each square.

    Parameters
    ----------
    posterior : Posterior
        Posterior of a robot.
    measurements : (s,) array
        The measurements that the robot knows; nan if there is none. At least one is known.
    beta : float, σ
        Number of standard deviations that are added to the mean.

    Returns
    -------
    (s,) array
        At least `_MIN_RELATIVE_DENSITY` times the root mean square of the measurements.
    """
    known_values = measurements[posterior.is_measured]
    scale = float(np.sqrt((known_values**2).mean()))
    if scale == 0.0:
        # Only zeros have been measured. All scales give the same centroids.
        scale = 1.0
    mean = posterior.compute_mean(measurements, float(known_values.mean()))
    bound = mean + beta * scale * posterior.compute_deviations()
    return np.maximum(bound, _MIN_RELATIVE_DENSITY * scale)


def _add_own_measurements(seen: Observations, memory: GpUcbMemory) -> GpUcbMemory:
    """Return the memory with a new measurement of each robot, made at its own position."""
    values = measure_own_density(seen)
    measurements = memory.measurements.copy()
    posteriors = []
    for robot, posterior in enumerate(memory.posteriors):
        measurements[robot, memory.grid.find_square(seen.positions[robot])] = values[robot]
        posteriors.append(posterior.condition_on(~np.isnan(measurements[robot])))
    return replace(
        memory,
        measurements=measurements,
        posteriors=tuple(posteriors),
        measurement_exchange=memory.measurement_exchange.start_period(measurements),
    )
