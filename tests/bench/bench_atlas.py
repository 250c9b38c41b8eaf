"""The goals of `atlas` that the benchmark's tracks do not measure: doors, team sizes, rest, and pace.

python tests/bench/bench_atlas.py doors sizes rest pace [--controller atlas-shared] [--count 200]
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from robocov import (
    Conditions,
    CoverageCost,
    Environment,
    Failure,
    Simulation,
    Team,
    generated_map,
    load_map,
    make_controller,
)
from robocov.environment import WallObstacle

SIZES, SEEDS, SHORT = (1, 2, 3, 6, 8, 9, 12, 20, 50), range(901, 905), 3.0
PROTOTYPE = {6: 0.168, 50: 0.263, 200: 0.575}  # ms, a vectorised step of RAPF before there was a compiled one


def walls(turn: float, door: float, width: float) -> tuple[WallObstacle, WallObstacle]:
    """Return the two halves of a wall through the middle of 8 x 8 m, with a door."""
    along = np.array([-math.sin(turn), math.cos(turn)])
    ends = [(4.0 + along * far).tolist() for far in (-6.0, door - width / 2, door + width / 2, 6.0)]
    return WallObstacle(ends[:2], 0.1), WallObstacle(ends[2:], 0.1)


def crosses(name: str, seed: int) -> bool:
    """Return whether one of three robots goes through a random door within 30 s."""
    rng = np.random.default_rng(seed)
    width, turn, door = 0.2 * rng.uniform(1.6, 3.0), rng.uniform(0.0, math.tau), rng.uniform(-1.5, 1.5)
    square = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    across = np.array([math.cos(turn), math.sin(turn)])
    begin = 4.0 - 2.0 * across + np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])
    some = Simulation(Environment("door", square, walls(turn, door, width)), make_controller(name), begin)
    while some.time < 30.0 and ((some.positions - 4.0) @ across).max() < 0.15:
        some.step()
    return some.time < 30.0


def doors(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    crossed = np.array(list(pool.map(partial(crosses, name), range(count))))
    yield f"{crossed.sum()} of {count}, 1.6 to 3 diameters wide, are crossed; not {np.flatnonzero(~crossed)}"


def final(name: str, seed: int, hears: float, robots: int) -> tuple[float, float]:
    """Return the mean distance, and the mean way, of a team in generated rooms after 60 s, m."""
    rooms, team = generated_map(seed, kind="rooms"), Team.homogeneous(robots, communication_range=hears)
    start = rooms.start(None).sample(robots, seed=0, radius=0.1)
    some, walked, before = Simulation(rooms, make_controller(name), start, team), 0.0, start
    while some.time < 60.0:
        some.step()
        walked += float(np.hypot(*(some.positions - before).T).mean())
        before = some.positions
    return CoverageCost(rooms, lattice=64)(some.positions).mean_distance, walked


def sizes(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Mean distances by team size, and how far one is above that of a smaller team: it should never rise."""
    for hears in (math.inf, SHORT):
        for seed in SEEDS:
            found = list(pool.map(partial(final, name, seed, hears), SIZES))
            costs = np.array([cost for cost, _ in found])
            rises = costs / np.minimum.accumulate(costs) - 1.0
            told = ", ".join(f"{n}: {cost:.2f}" for n, cost in zip(SIZES, costs, strict=True))
            first = f"rises by {rises.max():.1%}; one walks {found[0][1]:.1f} m"
            yield f"rooms {seed}, hear {hears} m: {told} m, {first}"


def moved(name: str, what: str) -> float:
    """Return how far a team that has rested for ten minutes goes when something happens, mean, m."""
    rooms = load_map("rooms")
    start = rooms.start(None).sample(6, seed=0, radius=0.1)
    square = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    if what == "a door opens":
        rooms = Environment("shut", square, walls(0.0, 0.0, 0.0))
        start = np.array([[x, y] for x in (1.0, 1.5) for y in (1.0, 1.5, 2.0)])
    dies = Conditions(failures=(Failure(2, 600.0),)) if what == "a robot fails" else None
    some = Simulation(rooms, make_controller(name), start, conditions=dies)
    while some.time < 600.0:
        some.step()
    before = some.positions
    if what == "a door opens":
        some = some.changed(environment=replace(rooms, name="open", obstacles=walls(0.0, 0.0, 1.0)))
    while some.time < 660.0:
        some.step()
    return float(np.hypot(*(some.positions - before).T).mean())


def rest(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    events = ("nothing happens", "a robot fails", "a door opens")
    for what, way in zip(events, pool.map(partial(moved, name), events), strict=True):
        yield f"after 10 min {what}: in 1 min robots move by {way:.2f} m"


def pace(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Seconds of the whole simulation for one second: six robots on 10 x 10 m, more on as much each."""
    for n in (*SIZES, 100, 200):
        side = 10.0 * max(1.0, math.sqrt(n / 6.0))
        rooms = generated_map(7, kind="polygons", side=side, obstacles=max(6, n))
        start, took = rooms.start("uniform").sample(n, seed=0, radius=0.1), []
        for each in (name, "rapf"):
            some = Simulation(rooms, make_controller(each), start)
            some.step()
            began = time.perf_counter()
            while some.time < 20.0:
                some.step()
            took.append((time.perf_counter() - began) / 20.0)
        old = f", {took[0] / (0.06 * PROTOTYPE[n]):.1f} times its prototype's" if n in PROTOTYPE else ""
        yield f"{n} robots: {took[0]:.3f} s for one second, {took[0] / took[1]:.0f} times RAPF's{old}"


def main() -> None:
    measures = {each.__name__: each for each in (doors, sizes, rest, pace)}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="+", choices=measures)
    parser.add_argument("--controller", default="atlas")
    parser.add_argument("--count", type=int, default=200, help="of doors")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    with ProcessPoolExecutor(given.workers) as pool:
        for what in given.what:
            for line in measures[what](given.controller, given.count, pool):
                print(f"{given.controller}, {what}: {line}", flush=True)


if __name__ == "__main__":
    main()
