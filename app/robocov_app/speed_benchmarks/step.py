"""Benchmark of a whole step (observations, cells, forces, physics).

The baselines are Qhull's Delaunay triangulation of the robots, and a step of the bare physics engine.
"""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import pymunk
from scipy.spatial import Delaunay

from robocov.controllers import Rapf
from robocov.mapfile import load_map
from robocov.simulation import Simulation, SimulationBatch
from robocov_app.speed_benchmarks.measure import Call, Case, Row, measure_interleaved


class Ratios(NamedTuple):
    """Ratios of the time of a step to the time of each baseline."""

    triangulation: float
    physics: float


GOALS = {
    6: Ratios(triangulation=1.3, physics=36.0),
    50: Ratios(triangulation=1.05, physics=30.0),
    200: Ratios(triangulation=0.75, physics=26.0),
    1000: Ratios(triangulation=0.65, physics=16.0),
}
"""Maximum ratios by number of robots: 1.5 times the ratios of an engine that bypasses pymunk's interface."""
EARLIER_RATIOS = {
    6: Ratios(triangulation=4.2, physics=80.0),
    50: Ratios(triangulation=2.6, physics=57.0),
    200: Ratios(triangulation=1.4, physics=38.0),
    1000: Ratios(triangulation=1.0, physics=31.0),
}
"""Earlier ratios; see `Row.earlier_ratio`."""
BATCH_RUNS = 64
"""Number of runs that are simulated together."""
BATCH_GOAL = 5.0
"""Maximum ratio of one step of one run in the batch to a step of bare physics."""
BATCH_ROBOTS = 6
"""Number of robots of each run in the batch."""
BARE_PHYSICS = "bare Space.step"
"""Name of a baseline: the physics engine alone, with the same bodies in an empty space."""
TRIANGULATION = "Qhull's Delaunay"
"""Name of a baseline: the triangulation of the robots' positions."""
WARM_UP_STEPS = 120
"""Steps before the measurement: two seconds of simulation time, after which the team is moving."""
_MIN_SPEED = 60.0
"""Minimum ratio of simulation time to real time for a team of `_REAL_TIME_ROBOTS`."""
_REAL_TIME_ROBOTS = 6
_QUICK_ROUNDS = 60
_FULL_ROUNDS = 300
_LARGE_TEAM = 500
"""Maximum number of robots for which the usual number of rounds is measured."""
_QUICK_LARGE_TEAM_ROUNDS = 30
_FULL_LARGE_TEAM_ROUNDS = 100
_ROBOT_RADIUS_M = 0.1


def list_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark cases of single simulations of each team size, and of a batch."""
    return [
        *(partial(_measure_step, robots, quick=quick) for robots in GOALS),
        partial(_measure_batch, quick=quick),
    ]


def _measure_step(robots: int, *, quick: bool) -> Iterator[Row]:
    """Measure a step of one simulation, compared with each of the two baselines."""
    campus = load_map("campus")
    simulation = Simulation(campus, Rapf(), campus.start("uniform").sample(robots, seed=0))
    space = _warm_up(simulation, robots)
    calls: dict[str, Call] = {
        "step": simulation.step,
        "space": partial(space.step, simulation.dt),
        "delaunay": lambda: Delaunay(simulation.positions),
    }
    times = measure_interleaved(calls, _get_rounds(robots, quick=quick))
    step = times["step"]
    goals = GOALS[robots]
    earlier_ratios = EARLIER_RATIOS[robots]
    max_step_s = None
    if robots == _REAL_TIME_ROBOTS:
        max_step_s = simulation.dt / _MIN_SPEED
    yield Row(
        "step",
        "one step",
        {"robots": robots},
        step,
        baseline=TRIANGULATION,
        baseline_seconds=times["delaunay"],
        max_ratio=goals.triangulation,
        max_seconds=max_step_s,
        note=f"{simulation.dt / step:.0f} x real time",
        earlier_ratio=earlier_ratios.triangulation,
    )
    yield Row(
        "step",
        "one step",
        {"robots": robots},
        step,
        baseline=BARE_PHYSICS,
        baseline_seconds=times["space"],
        max_ratio=goals.physics,
        earlier_ratio=earlier_ratios.physics,
    )


def _get_rounds(robots: int, *, quick: bool) -> int:
    """Return the number of rounds for a team size; large teams have fewer rounds."""
    if robots > _LARGE_TEAM:
        return _QUICK_LARGE_TEAM_ROUNDS if quick else _FULL_LARGE_TEAM_ROUNDS
    return _QUICK_ROUNDS if quick else _FULL_ROUNDS


def _measure_batch(*, quick: bool) -> Iterator[Row]:
    """Measure a step of a batch of simulations, compared with the same number of bare physics steps."""
    campus = load_map("campus")
    starts = [campus.start("uniform").sample(BATCH_ROBOTS, seed=seed) for seed in range(BATCH_RUNS)]
    simulation = SimulationBatch(campus, Rapf(), starts)
    space = _warm_up(simulation, BATCH_ROBOTS)

    def step_spaces() -> None:
        # A single step is too short to time accurately, so it is repeated once for each run.
        for _ in range(BATCH_RUNS):
            space.step(simulation.dt)

    calls: dict[str, Call] = {"step": simulation.step, "space": step_spaces}
    times = measure_interleaved(calls, _get_rounds(BATCH_ROBOTS, quick=quick))
    yield Row(
        "step",
        "one step per run",
        {"robots": BATCH_ROBOTS, "runs": BATCH_RUNS},
        times["step"] / BATCH_RUNS,
        baseline=BARE_PHYSICS,
        baseline_seconds=times["space"] / BATCH_RUNS,
        max_ratio=BATCH_GOAL,
        earlier_ratio=EARLIER_RATIOS[BATCH_ROBOTS].physics,
    )


def _warm_up(simulation: Simulation | SimulationBatch, robots: int) -> pymunk.Space:
    """Run a simulation until its robots move; return a pymunk space with discs at the same positions.

    The space has no obstacles. In a batch, the discs are the robots of the first run.
    """
    for _ in range(WARM_UP_STEPS):
        simulation.step()
    space = pymunk.Space()
    for x, y in simulation.positions.reshape(-1, 2)[:robots].tolist():
        body = pymunk.Body(1.0, float("inf"))
        body.position = (x, y)
        space.add(body, pymunk.Circle(body, _ROBOT_RADIUS_M))
    return space
