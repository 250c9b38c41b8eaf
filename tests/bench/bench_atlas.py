"""The goals of `atlas` that the benchmark's tracks do not measure, and another simulator's setting.

python tests/bench/bench_atlas.py doors sizes ranges rest pace lpac [--controller atlas-shared] [--count 200]
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
    Gaussian,
    Gaussians,
    Simulation,
    Team,
    UniformStart,
    generate_map,
    load_map,
    make_controller,
)
from robocov.environment import WallObstacle
from robocov.metrics import compute_path_lengths, find_settling_time
from robocov_app.benchmark import suite
from robocov_app.benchmark.results import find_reference

SIZES = (1, 2, 3, 6, 8, 9, 12, 20, 50, 100, 200)
SEEDS = range(901, 905)
SHORT = 3.0
RANGES = ({}, {"communication_range": 3.0}, {"communication_range": 6.0}, {"sensing_range": 6.0})
PROTOTYPE = {6: 0.168, 50: 0.263, 200: 0.575}  # ms, a vectorized step of RAPF before there was a compiled one


def walls(turn: float, door: float, width: float) -> tuple[WallObstacle, WallObstacle]:
    """Return the two halves of a wall through the middle of 8 x 8 m, with a door."""
    along = np.array([-math.sin(turn), math.cos(turn)])
    ends = [(4.0 + along * far).tolist() for far in (-6.0, door - width / 2, door + width / 2, 6.0)]
    return WallObstacle(ends[:2], 0.1), WallObstacle(ends[2:], 0.1)


def crosses(name: str, seed: int) -> bool:
    """Return whether one of three robots goes through a random door within 30 s."""
    rng = np.random.default_rng(seed)
    width = 0.2 * rng.uniform(1.6, 3.0)
    turn = rng.uniform(0.0, math.tau)
    door = rng.uniform(-1.5, 1.5)
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
    rooms = generate_map(seed, kind="rooms")
    team = Team.homogeneous(robots, communication_range=hears)
    start = rooms.start(None).sample(robots, seed=0, radius=0.1)
    some = Simulation(rooms, make_controller(name), start, team)
    walked = 0.0
    before = start
    while some.time < 60.0:
        some.step()
        walked += float(np.hypot(*(some.positions - before).T).mean())
        before = some.positions
    return CoverageCost(rooms, lattice=64)(some.positions).mean_distance, walked


def sizes(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Mean distances by team size, and how far one is above that of a smaller team: it should never rise."""
    for hears in (math.inf, SHORT):  # more than 90 do not fit into the corner where they begin
        for seed in SEEDS:
            found = list(pool.map(partial(final, name, seed, hears), SIZES[:-2]))
            costs = np.array([cost for cost, _ in found])
            rises = costs / np.minimum.accumulate(costs) - 1.0
            told = ", ".join(f"{n}: {cost:.2f}" for n, cost in zip(SIZES, costs, strict=False))
            first = f"rises by {rises.max():.1%}; one walks {found[0][1]:.1f} m"
            yield f"rooms {seed}, hear {hears} m: {told} m, {first}"


def ended(name: str, on: str, changes: dict[str, float]) -> tuple[float, float, float]:
    """Return gap, when the team came to rest (s, or nan), and mean way (m) of 120 s on a map of the suite."""
    rooms = suite.load_suite_map(on)
    team = Team.homogeneous(suite.TEAM_SIZE, **changes)
    start = rooms.start(None).sample(suite.TEAM_SIZE, seed=0, radius=suite.ROBOT_RADIUS_M)
    record = Simulation(rooms, make_controller(name), start, team).run(120.0)
    cost = CoverageCost(rooms, suite.LATTICE)(record.positions[-1]).mean_distance
    rest = find_settling_time(record.time, record.positions)
    gap = cost / find_reference(on, suite.TEAM_SIZE)["mean_distance_m"] - 1.0
    return gap, math.nan if rest is None else rest, float(compute_path_lengths(record.positions).mean())


def ranges(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Six robots on the maps of the benchmark's short-range track for 120 s, beside RAPF."""
    maps = suite.TRACKS["short-range"].maps
    for changes in RANGES:
        tables = [list(pool.map(partial(ended, each, changes=changes), maps)) for each in (name, "rapf")]
        (gaps, rest, ways), (others, _, theirs) = (np.transpose(each) for each in tables)
        behind = [each for each, mine, its in zip(maps, gaps, others, strict=True) if mine > its]
        above = (gaps > 0.05).sum()
        still = np.isfinite(rest).mean()
        yield (
            f"{changes or 'all hear all, see 3 m'}: gap {np.median(gaps):.1%} (worst {gaps.max():.0%}; "
            f"{above} of {len(maps)} above 5 %), {still:.0%} at rest by 120 s, way {np.median(ways):.1f} m; "
            f"RAPF {np.median(others):.1%}, {np.median(theirs):.1f} m; behind it on {behind}"
        )


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
        some = some.with_changes(environment=replace(rooms, name="open", obstacles=walls(0.0, 0.0, 1.0)))
    while some.time < 660.0:
        some.step()
    return float(np.hypot(*(some.positions - before).T).mean())


def rest(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    events = ("nothing happens", "a robot fails", "a door opens")
    for what, way in zip(events, pool.map(partial(moved, name), events), strict=True):
        yield f"after 10 min {what}: in 1 min robots move by {way:.2f} m"


def pace(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Seconds of the whole simulation for one second: six robots on 10 x 10 m, more on as much each."""
    for n in SIZES:
        side = 10.0 * max(1.0, math.sqrt(n / 6.0))
        rooms = generate_map(7, kind="polygons", side=side, obstacles=max(6, n))
        start = rooms.start("uniform").sample(n, seed=0, radius=0.1)
        took = []
        for each in (name, "rapf"):
            some = Simulation(rooms, make_controller(each), start)
            some.step()
            began = time.perf_counter()
            while some.time < 20.0:
                some.step()
            took.append((time.perf_counter() - began) / 20.0)
        old = f", {took[0] / (0.06 * PROTOTYPE[n]):.1f} times its prototype's" if n in PROTOTYPE else ""
        yield f"{n} robots: {took[0]:.3f} s for one second, {took[0] / took[1]:.0f} times RAPF's{old}"


def world(seed: int) -> tuple[Environment, np.ndarray]:
    """Return the default setting of the simulator CoverageControl (Agarwal et al. 2024, LPAC), and starts.

    32 robots in a square of 1024 m without obstacles, with 32 places of interest.
    """
    rng = np.random.default_rng(seed)
    side = 1024.0
    peaks = [
        Gaussian(tuple(rng.uniform(0.0, side, 2).tolist()), rng.uniform(6.0, 10.0), rng.uniform(40.0, 60.0))
        for _ in range(32)
    ]
    square = ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side))
    field = Environment("field", square, density=Gaussians(tuple(peaks), 0.0), starts={"any": UniformStart()})
    return field, field.start("any").sample(32, seed=seed, radius=1.0)


def remaining(name: str, seed: int) -> float:
    """Return the sum of squared distances, weighed by the density, after 120 s by that at the start."""
    field, start = world(seed)
    team = Team.homogeneous(
        32, radius=1.0, max_speed=5.0, max_acceleration=10.0, sensing_range=32.0, communication_range=128.0
    )
    some = Simulation(field, make_controller(name), start, team)
    cost = CoverageCost(field, 128)
    while some.time < 120.0:
        some.step()
    weights = field.density.evaluate(cost.points)
    ends, begins = (weights @ cost(each).distances ** 2 for each in (some.positions, start))
    return float(ends / begins)


def lpac(name: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    shares = np.array(list(pool.map(partial(remaining, name), range(4))))
    told = " ".join(f"{each:.2f}" for each in shares)
    yield f"CoverageControl's setting: after 120 s {shares.mean():.2f} of the first cost is left ({told})"


def main() -> None:
    measures = {each.__name__: each for each in (doors, sizes, ranges, rest, pace, lpac)}
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
