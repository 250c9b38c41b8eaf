"""What `atlas` was made for, beside the benchmark: doors, team sizes, rest, and computing time.

python tests/bench/bench_atlas.py doors sizes pace rest [--controller atlas-shared] [--count 200]
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from robocov import CoverageCost, Environment, Simulation, Team, generated_map, load_map, make_controller
from robocov.environment import WallObstacle
from robocov.metrics import settled_at
from robocov.record import Record

SIZES = (1, 2, 3, 6, 8, 9, 12, 20, 50)


def door_crossed(name: str, seed: int) -> bool:
    """Return whether one of three robots goes through a random door within 30 s."""
    rng = np.random.default_rng(seed)
    width, turn = 0.2 * rng.uniform(1.6, 3.0), rng.uniform(0.0, math.tau)
    middle = np.array([4.0, 4.0])
    along, door = np.array([-math.sin(turn), math.cos(turn)]), rng.uniform(-1.5, 1.5)
    ends = [(middle + along * far).tolist() for far in (-6.0, door - width / 2, door + width / 2, 6.0)]
    walls = WallObstacle(ends[:2], 0.1), WallObstacle(ends[2:], 0.1)
    rooms = Environment("door", ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)), walls)
    across = np.array([along[1], -along[0]])
    begin = middle - 2.0 * across + np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])
    some = Simulation(rooms, make_controller(name), begin)
    while some.time < 30.0 and ((some.positions - middle) @ across).max() < 0.15:
        some.step()
    return some.time < 30.0


def doors(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    crossed = list(pool.map(partial(door_crossed, name), range(count)))
    yield f"{sum(crossed)} of {count} doors of 1.6 to 3 diameters crossed; not those of {np.flatnonzero(~np.array(crossed))}"


def _final(name: str, what: tuple[int, int]) -> tuple[float, float]:
    """Return the mean distance, and the way, of a team in generated rooms after 60 s, m."""
    seed, robots = what
    rooms = generated_map(seed, kind="rooms")
    start = rooms.start(None).sample(robots, seed=0, radius=0.1)
    some = Simulation(rooms, make_controller(name), start)
    walked, before = 0.0, some.positions
    while some.time < 60.0:
        some.step()
        walked += float(np.hypot(*(some.positions - before).T).mean())
        before = some.positions
    return CoverageCost(rooms, lattice=64)(some.positions).mean_distance, walked


def sizes(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    maps = range(901, 901 + max(1, count // 25))
    found = {n: list(pool.map(partial(_final, name), [(seed, n) for seed in maps])) for n in SIZES}
    for k, seed in enumerate(maps):
        costs = [found[n][k][0] for n in SIZES]
        more = [
            f"{n}: {cost / min(costs[: j + 1]) - 1.0:.1%}"
            for j, (n, cost) in enumerate(zip(SIZES, costs, strict=True))
        ]
        yield f"rooms {seed}: mean distance above the best of smaller teams {', '.join(more)}; way of one {found[1][k][1]:.1f} m"


def pace(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Seconds of the whole simulation for a second, and against that of RAPF, one after the other."""
    for n in (*SIZES, 100, 200):
        side = 10.0 * max(1.0, math.sqrt(n / 6.0))
        rooms = generated_map(7, kind="polygons", side=side, obstacles=max(6, n))
        start = rooms.start("uniform").sample(n, seed=0, radius=0.1)
        took = []
        for each in (name, "rapf"):
            some = Simulation(rooms, make_controller(each), start)
            some.step()
            began = time.perf_counter()
            while some.time < 20.0:
                some.step()
            took.append((time.perf_counter() - began) / 20.0)
        yield f"{n} robots: {took[0]:.3f} s for one second, {took[0] / took[1]:.1f} times RAPF's"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="+", choices=("doors", "sizes", "pace"))
    parser.add_argument("--controller", default="atlas")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    with ProcessPoolExecutor(given.workers) as pool:
        for what in given.what:
            for line in globals()[what](given.controller, given.count, pool):
                print(f"{given.controller} {what}: {line}", flush=True)


if __name__ == "__main__":
    main()
