"""Execution of actions in a simulation, with measurement of the time in contact."""

from dataclasses import replace

import numpy as np

from robocov.metrics import MAX_CONTACT_GAP_M
from robocov.observation import Decision, Snapshot
from robocov.observation.close_pairs import find_close_pairs
from robocov.simulation import Simulation, SimulationBatch
from robocov.typing import BoolArray, FloatArray
from robocov_app.learning.actions import compute_driving_forces
from robocov_app.learning.task import CoverageTask

_REACH_MARGIN = 1.001
"""Factor by which the search radius for contacts is enlarged, as a margin for rounding errors."""


def execute_actions(
    task: CoverageTask,
    simulation: Simulation | SimulationBatch,
    actions: FloatArray,
    snapshots: list[Snapshot] | None = None,
) -> FloatArray:
    """Advance a simulation by one action period while its robots execute the same actions.

    Parameters
    ----------
    task : CoverageTask
    simulation : Simulation or SimulationBatch
    actions : (n, 2) or (runs, n, 2) array, N or m/s
    snapshots : list of Snapshot, optional
        List to which a snapshot of each step is appended; only for a single simulation.

    Returns
    -------
    (n,) or (runs, n) array, s
        Time in contact with a wall or another robot.
    """
    contact_time = np.zeros(actions.shape[:-1])
    for _ in range(task.repeat):
        forces = compute_driving_forces(task.action, actions, simulation.velocities, simulation.team)
        forces = np.where(simulation.is_working[..., None], forces, 0.0)
        if snapshots is not None and isinstance(simulation, Simulation):
            snapshots.append(replace(simulation.observe_and_decide(), decision=Decision(forces)))
        simulation.step(forces=forces)
        contact_time += task.dt * _find_contacts(simulation)
    return contact_time


def _find_contacts(simulation: Simulation | SimulationBatch) -> BoolArray:
    """Return a mask of the working robots that touch a wall or a robot, (n,) or (runs, n)."""
    shape = simulation.is_working.shape
    positions = simulation.positions.reshape(-1, 2)
    working = simulation.is_working.ravel()
    radius = np.broadcast_to(simulation.team.radius, shape).ravel()
    nearest = simulation.sensor.find_nearest_points(positions, radius + MAX_CONTACT_GAP_M)
    has_contact = working & ~np.isnan(nearest[:, 0])
    reach = 2.0 * float(radius.max()) + MAX_CONTACT_GAP_M
    run_distance = 2.0 * (simulation.environment.region.diameter + reach)
    separated = _separate_runs(positions, len(simulation.team), run_distance)
    first, second, _ = find_close_pairs(separated, _REACH_MARGIN * reach)
    if len(first) > 0:
        x, y = (positions[first] - positions[second]).T
        # Both robots of a pair have contact, because each pair is listed in both orders.
        is_contact = np.sqrt(x * x + y * y) <= radius[first] + radius[second] + MAX_CONTACT_GAP_M
        has_contact[first[is_contact & working[first] & working[second]]] = True
    return has_contact.reshape(shape)


def _separate_runs(positions: FloatArray, robots: int, distance: float) -> FloatArray:
    """Shift each run by `distance` from the previous one, so that robots of different runs are not close."""
    runs = np.arange(len(positions)) // robots
    return np.asarray(positions + (distance * runs)[:, None])
