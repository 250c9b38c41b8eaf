"""The Gaussian process against a direct formula, and the controller on densities that it does not know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import Conditions
from robocov.controllers import GpUcb, Lloyd
from robocov.controllers.base import Controller
from robocov.controllers.gaussian_process import NOISE_VARIANCE, Posterior, ProcessGrid
from robocov.controllers.gp_ucb import GpUcbMemory, compute_bound
from robocov.density import Gaussian, Gaussians
from robocov.density.base import Density
from robocov.environment import Environment
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.typing import BoolArray, FloatArray

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
REGION = SQUARE.region
HOT = Gaussians((Gaussian((7.5, 7.0), weight=6.0, sigma=1.5),), floor=0.3)
SENSED = Conditions(density="sensed")
GRID = ProcessGrid.build(REGION, squares_per_side=8, correlation=0.2)
SQUARE_COUNT = len(GRID.centers)


def compute_posterior_directly(
    is_measured: BoolArray, values: FloatArray, prior_mean: float
) -> tuple[FloatArray, FloatArray]:
    """Return mean and variance in all squares by the textbook formula, with a Cholesky factorization."""
    distances = scipy.spatial.distance.cdist(GRID.centers, GRID.centers)
    covariance = np.exp(-0.5 * (distances / 2.0) ** 2)
    known = covariance[np.ix_(is_measured, is_measured)] + NOISE_VARIANCE * np.eye(is_measured.sum())
    factor = scipy.linalg.cho_factor(known)
    cross = covariance[:, is_measured]
    mean = prior_mean + cross @ scipy.linalg.cho_solve(factor, values[is_measured] - prior_mean)
    variance = np.diagonal(covariance - cross @ scipy.linalg.cho_solve(factor, cross.T))
    return mean, variance


def measure_squares(density: Density, is_measured: BoolArray) -> FloatArray:
    return np.where(is_measured, density.evaluate(GRID.centers), np.nan)


def simulate(
    controller: Controller, density: Density | None, starts: FloatArray, duration: float = 30.0
) -> Simulation:
    """Return the simulation of a team that does not know the density, unless the controller is Lloyd's."""
    conditions = SENSED if isinstance(controller, GpUcb) else None
    environment = SQUARE.with_density(density)
    simulation = Simulation(environment, controller, starts, dt=0.05, conditions=conditions)
    simulation.run(duration)
    return simulation


def compute_hot_cost(positions: FloatArray, density: Density) -> float:
    """Return the mean squared distance to the nearest robot, weighted by the density, on a lattice."""
    x, y = np.meshgrid(np.arange(0.1, 10.0, 0.2), np.arange(0.1, 10.0, 0.2))
    points = np.column_stack([x.ravel(), y.ravel()])
    squared_distances = ((points[:, None] - positions) ** 2).sum(axis=2).min(axis=1)
    weights = density.evaluate(points)
    return float((weights * squared_distances).sum() / weights.sum())


@settings(deadline=None, max_examples=count_examples(30))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, SQUARE_COUNT), steps=st.integers(1, 4))
def test_the_posterior_is_that_of_the_direct_formula(seed: int, count: int, steps: int) -> None:
    """Squares are added in several steps; the result does not depend on them."""
    rng = np.random.default_rng(seed)
    values = rng.uniform(0.0, 20.0, SQUARE_COUNT)
    order = rng.permutation(SQUARE_COUNT)[:count]
    posterior = Posterior.build_prior(GRID)
    is_measured = np.zeros(SQUARE_COUNT, dtype=bool)
    for added in np.array_split(order, steps):
        is_measured[added] = True
        posterior = posterior.condition_on(is_measured)
    mean, variance = compute_posterior_directly(is_measured, values, prior_mean=3.0)
    measurements = np.where(is_measured, values, np.nan)
    np.testing.assert_allclose(posterior.compute_mean(measurements, 3.0), mean, atol=1e-7)
    np.testing.assert_allclose(posterior.compute_deviations() ** 2, variance, atol=1e-9)


@settings(deadline=None, max_examples=count_examples(30))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, SQUARE_COUNT - 1))
def test_a_measurement_never_increases_a_deviation(seed: int, count: int) -> None:
    order = np.random.default_rng(seed).permutation(SQUARE_COUNT)
    is_measured = np.zeros(SQUARE_COUNT, dtype=bool)
    is_measured[order[:count]] = True
    before = Posterior.build_prior(GRID).condition_on(is_measured)
    is_measured[order[count]] = True
    after = before.condition_on(is_measured)
    assert (after.compute_deviations() <= before.compute_deviations() + 1e-12).all()
    assert after.compute_deviations()[order[count]] <= np.sqrt(NOISE_VARIANCE)
    # The earlier posterior, which other copies of a simulation may use, has not changed.
    assert not before.is_measured[order[count]]


def test_the_bound_shrinks_where_the_density_is_measured() -> None:
    is_measured = np.zeros(SQUARE_COUNT, dtype=bool)
    is_measured[[9, 40]] = True
    before = Posterior.build_prior(GRID).condition_on(is_measured)
    bound_before = compute_bound(before, measure_squares(HOT, is_measured), beta=3.0)
    is_measured[10] = True
    after = before.condition_on(is_measured)
    bound_after = compute_bound(after, measure_squares(HOT, is_measured), beta=3.0)
    assert bound_after[10] < 0.6 * bound_before[10]
    far = np.hypot(*(GRID.centers - GRID.centers[10]).T) > 7.0
    np.testing.assert_allclose(bound_after[far], bound_before[far], rtol=0.1)


def test_without_deviations_the_bound_is_the_mean_but_positive() -> None:
    is_measured = np.zeros(SQUARE_COUNT, dtype=bool)
    is_measured[::3] = True
    posterior = Posterior.build_prior(GRID).condition_on(is_measured)
    narrow_peak = Gaussians((Gaussian((5.0, 5.0), weight=9.0, sigma=0.8),), floor=0.0)
    values = measure_squares(narrow_peak, is_measured)
    mean = posterior.compute_mean(values, float(np.nanmean(values)))
    bound = compute_bound(posterior, values, beta=0.0)
    assert mean.min() < 0.0 < bound.min()
    np.testing.assert_allclose(bound[mean > 0.1], mean[mean > 0.1])


def test_measurements_of_zero_leave_the_mass_in_unknown_squares() -> None:
    is_measured = np.zeros(SQUARE_COUNT, dtype=bool)
    is_measured[:16] = True
    posterior = Posterior.build_prior(GRID).condition_on(is_measured)
    bound = compute_bound(posterior, np.where(is_measured, 0.0, np.nan), beta=1.0)
    assert bound[:16].max() < 0.2 < 0.9 < bound[-8:].min()


@pytest.mark.parametrize(("width", "height", "squares"), [(4.0, 4.0, 64), (4.0, 1.9, 32), (1.9, 4.0, 32)])
def test_squares_cover_the_region(width: float, height: float, squares: int) -> None:
    region = Region(np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
    grid = ProcessGrid.build(region, squares_per_side=8, correlation=0.2)
    assert len(grid.centers) == squares
    assert region.contains(grid.samples).all()
    np.testing.assert_allclose(grid.samples.mean(axis=0), [width / 2, height / 2], atol=0.07)
    # A linear function is interpolated exactly between the centers of the squares.
    is_between = (grid.samples >= grid.centers.min(axis=0)).all(axis=1)
    is_between &= (grid.samples <= grid.centers.max(axis=0)).all(axis=1)
    interpolated = grid.interpolate(grid.centers @ [2.0, -3.0])
    np.testing.assert_allclose(interpolated[is_between], (grid.samples @ [2.0, -3.0])[is_between])


def test_beta_decreases_to_zero() -> None:
    controller = GpUcb(beta=2.0, exploration=20.0)
    assert [controller.compute_beta(time) for time in (0.0, 5.0, 20.0, 100.0)] == [2.0, 1.5, 0.0, 0.0]
    assert GpUcb(exploration=0.0).compute_beta(0.0) == 0.0


def test_robots_measure_only_where_they_are() -> None:
    starts = SQUARE.start().sample(3, seed=1, radius=0.1)
    simulation = Simulation(SQUARE.with_density(HOT), GpUcb(), starts, conditions=SENSED)
    seen = simulation.observe_and_decide().seen
    assert seen.density is None
    assert seen.density_sensor is not None
    measured = seen.density_sensor.log
    assert list(measured) == [(robot, starts[robot].tobytes()) for robot in range(3)]
    np.testing.assert_allclose(list(measured.values()), HOT.evaluate(starts))


def test_a_known_uniform_density_needs_no_measurements_and_no_messages() -> None:
    starts = SQUARE.start().sample(4, seed=1, radius=0.1)
    simulation = Simulation(SQUARE, GpUcb(), starts)
    simulation.run(30.0)
    assert np.isnan(simulation.memory.measurements).all()
    assert simulation.sent_bytes == 0
    lloyd = Simulation(SQUARE, Lloyd(), starts)
    lloyd.run(30.0)
    np.testing.assert_allclose(simulation.positions, lloyd.positions, atol=0.2)


def test_robots_with_the_same_measurements_have_the_same_bounds() -> None:
    starts = SQUARE.start().sample(4, seed=2, radius=0.1)
    simulation = Simulation(SQUARE.with_density(HOT), GpUcb(), starts, conditions=SENSED)
    simulation.run(20.0)
    memory: GpUcbMemory = simulation.memory
    is_known = ~np.isnan(memory.measurements)
    assert is_known.sum(axis=1).min() > 30
    first, second = (
        compute_bound(posterior, measurements, 1.0)
        for posterior, measurements in list(zip(memory.posteriors, memory.measurements, strict=True))[:2]
    )
    # All but the newest measurements have been exchanged.
    assert np.median(np.abs(first - second)) < 0.02 * np.median(first)


def test_robots_use_nothing_that_was_sent_less_than_the_latency_ago() -> None:
    """Change what two robots know after 1 s: with a latency of 2 s, the third one notices after 3 s."""
    starts = SQUARE.start().sample(3, seed=2, radius=0.1)
    conditions = Conditions(delay=2.0, density="sensed")
    hot_square = SQUARE.with_density(HOT)
    usual = Simulation(hot_square, GpUcb(), starts, conditions=conditions)
    changed = Simulation(hot_square, GpUcb(), starts, conditions=conditions)
    is_same = []
    for step in range(240):
        if step == 60:
            measurements = changed.memory.measurements.copy()
            measurements[:2, 0] = 5.0
            changed.memory = replace(changed.memory, measurements=measurements)
        usual.step()
        changed.step()
        is_same.append((usual.memory.goals[2] == changed.memory.goals[2]).all())
    assert all(is_same[:180])
    assert not is_same[-1]


def test_lost_measurements_are_sent_again() -> None:
    starts = SQUARE.start().sample(4, seed=2, radius=0.1)
    conditions = Conditions(loss=0.5, message_rate=4.0, density="sensed")
    simulation = Simulation(SQUARE.with_density(HOT), GpUcb(), starts, conditions=conditions)
    simulation.run(60.0)
    is_known = ~np.isnan(simulation.memory.measurements)
    assert np.count_nonzero(is_known[0]) > 20
    assert (is_known == is_known[0]).all()


def test_a_copy_continues_identically() -> None:
    starts = SQUARE.start().sample(4, seed=3, radius=0.1)
    simulation = Simulation(SQUARE.with_density(HOT), GpUcb(), starts, conditions=SENSED)
    simulation.run(3.0)
    twin = simulation.copy()
    simulation.run(3.0)
    twin.run(3.0)
    np.testing.assert_array_equal(twin.positions, simulation.positions)
    np.testing.assert_array_equal(twin.memory.measurements, simulation.memory.measurements)


@pytest.mark.slow
def test_a_team_that_learns_ends_near_one_that_knows_the_density() -> None:
    """The costs over seeds of hot spots and starts: uniform Lloyd, learning, and Lloyd with the density."""
    uniform_costs = []
    learned_costs = []
    informed_costs = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        peaks = [Gaussian(tuple(rng.uniform(1.0, 9.0, 2).tolist()), weight=20.0, sigma=1.0) for _ in range(2)]
        density = Gaussians(tuple(peaks), floor=1.0)
        starts = SQUARE.start().sample(6, seed=seed, radius=0.1)
        uniform_costs.append(compute_hot_cost(simulate(Lloyd(), None, starts).positions, density))
        learned_costs.append(compute_hot_cost(simulate(GpUcb(), density, starts).positions, density))
        informed_costs.append(compute_hot_cost(simulate(Lloyd(), density, starts).positions, density))
    uniform_cost, learned_cost, informed_cost = np.mean(
        [uniform_costs, learned_costs, informed_costs], axis=1
    ).tolist()
    assert learned_cost < 0.8 * uniform_cost
    assert learned_cost < 1.2 * informed_cost
