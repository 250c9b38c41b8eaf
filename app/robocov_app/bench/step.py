"""A whole step (observe, cells, forces, physics) against Qhull's Delaunay triangulation and bare physics."""

from collections.abc import Iterator
from functools import partial

import pymunk
from scipy.spatial import Delaunay

from robocov.controllers import Rapf
from robocov.mapfile import load_map
from robocov.simulation import Simulation, SimulationBatch
from robocov_app.bench.measure import Call, Case, Row, in_turn

GOALS = {6: (1.0, 16.0), 50: (0.7, 12.0), 200: (0.5, 9.0), 1000: (0.5, 8.0)}
"""Wanted multiples of the times of the triangulation and of bare physics, by number of robots."""
BEFORE = {6: (4.2, 80.0), 50: (2.6, 57.0), 200: (1.4, 38.0), 1000: (1.0, 31.0)}  # see `Row.before`
TOGETHER, TOGETHER_GOAL = 64, 5.0  # runs moved on together; wanted multiple of bare physics for each
BARE = "bare Space.step"  # the physics engine alone: the same bodies in an empty space
WARM_UP = 120  # steps before the first that counts: two seconds, by when the team is on its way


def cases(*, quick: bool = False) -> list[Case]:
    return [*(partial(_rows, n, quick) for n in GOALS), partial(_together, quick)]


def _rows(n: int, quick: bool) -> Iterator[Row]:
    campus = load_map("campus")
    simulation = Simulation(campus, Rapf(), campus.start("uniform").sample(n, seed=0))
    space = _warmed_up(simulation, n)
    rounds = (60 if quick else 300) if n <= 500 else 30 if quick else 100
    calls: dict[str, Call] = {"step": simulation.step, "space": partial(space.step, simulation.dt)}
    calls["delaunay"] = lambda: Delaunay(simulation.positions)
    taken = in_turn(calls, rounds)
    step = taken["step"]
    # six robots 60 times as fast as real ones
    slowest = simulation.dt / 60.0 if n == 6 else None
    shown, triangulated = ("step", "one step", {"robots": n}, step), ("Qhull's Delaunay", taken["delaunay"])
    (goal, bare_goal), (before, bare_before) = GOALS[n], BEFORE[n]
    yield Row(*shown, *triangulated, goal, slowest, f"{simulation.dt / step:.0f} x real time", before)
    yield Row(*shown, BARE, taken["space"], bare_goal, before=bare_before)


def _together(quick: bool) -> Iterator[Row]:
    campus, n = load_map("campus"), 6
    starts = [campus.start("uniform").sample(n, seed=seed) for seed in range(TOGETHER)]
    simulation = SimulationBatch(campus, Rapf(), starts)
    # as often as there are runs: what one call takes is too short for the clock
    bare = [partial(_warmed_up(simulation, n).step, simulation.dt)] * TOGETHER
    calls: dict[str, Call] = {"step": simulation.step, "space": lambda: [call() for call in bare]}
    taken = in_turn(calls, 60 if quick else 300)
    size, each = {"robots": n, "runs together": TOGETHER}, taken["step"] / TOGETHER
    bare_each = BARE, taken["space"] / TOGETHER, TOGETHER_GOAL
    yield Row("step", "one step of one run", size, each, *bare_each, before=BEFORE[n][1])


def _warmed_up(simulation: Simulation | SimulationBatch, n: int) -> pymunk.Space:
    """Send the team on its way; return a space with discs where its first n robots are, and nothing else."""
    for _ in range(WARM_UP):
        simulation.step()
    space = pymunk.Space()
    for x, y in simulation.positions.reshape(-1, 2)[:n].tolist():
        body = pymunk.Body(1.0, float("inf"))
        body.position = (x, y)
        space.add(body, pymunk.Circle(body, 0.1))
    return space
