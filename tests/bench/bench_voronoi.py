"""Measure the time of a Voronoi partition, relative to a Delaunay triangulation of the same points by SciPy.

    python tests/bench/bench_voronoi.py --budget 20000

The first table is for random points. The second one is for moving robots, as in a simulation: each partition
starts from the triangulation of the previous step. The compared calls take turns, and the tables contain
medians, so that all of them suffer alike from other processes of the machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from statistics import median
from time import perf_counter

import numpy as np
from scipy.spatial import Delaunay

from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.typing import FloatArray
from robocov.voronoi import partition

DEFAULT_BUDGET = 20_000
"""Number of robots in all partitions of a row together."""
MICROSECONDS_PER_S = 1e6

WIDTH_M = 10.0
HEIGHT_M = 6.0
RECTANGLE = Region(np.array([[0.0, 0.0], [WIDTH_M, 0.0], [WIDTH_M, HEIGHT_M], [0.0, HEIGHT_M]]))
COMMUNICATION_RANGE_M = 2.5
TEAM_SIZES = (2, 4, 5, 6, 12, 50, 200, 1000)
MIN_DELAUNAY_POINTS = 4
MIN_ROUNDS = 15

AREA_PER_ROBOT_M2 = 10.0
MAX_SPEED_M_S = 1.0
STEP_S = 1.0 / 60.0
MARGIN_M = 0.1
"""Minimum distance of moving robots from the boundary."""
MIN_STEPS = 60
MOVING_TEAM_GOALS: dict[int, float | None] = {12: None, 50: None, 200: 0.6, 1000: 0.35}
"""Maximum time of a partition of moving robots, relative to a triangulation, by team size."""

Call = Callable[[], object]


def measure_time(call: Call) -> float:
    """Return the time of a call, s."""
    start_time = perf_counter()
    call()
    return perf_counter() - start_time


def measure_median_times(calls: Mapping[str, Call], rounds: int) -> dict[str, float]:
    """Return the median time of each call, s. The calls take turns."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            times[name].append(measure_time(call))
    return {name: median(times_of_call) for name, times_of_call in times.items()}


def format_times(times: list[float], delaunay_time: float) -> str:
    """Return cells of a table: the time of a triangulation, and further times with their ratios to it."""
    cells = [f"{seconds * MICROSECONDS_PER_S:9.0f} µs {seconds / delaunay_time:4.2f}x" for seconds in times]
    return " ".join([f"{delaunay_time * MICROSECONDS_PER_S:9.0f} µs", *cells])


def measure_random_points(points: FloatArray, rounds: int) -> dict[str, float]:
    """Return the median times of the calls for some points, s."""
    neighbors = Neighbors.from_ranges(points, np.full(len(points), COMMUNICATION_RANGE_M))
    calls: dict[str, Call] = {
        "partition": lambda: partition(points, RECTANGLE),
        "limited range": lambda: partition(points, RECTANGLE, neighbors),
        "polygons": lambda: partition(points, RECTANGLE).polygons,
    }
    if len(points) >= MIN_DELAUNAY_POINTS:
        calls["Delaunay"] = lambda: Delaunay(points)
    return measure_median_times(calls, rounds)


def print_random_points_table(budget: int) -> None:
    """Print the table for random points, with a row for each team size."""
    rng = np.random.default_rng(0)
    print(f"{'robots':>6} {'Delaunay':>12} {'partition':>18} {'limited range':>18} {'polygons':>12}")
    for size in TEAM_SIZES:
        points = rng.uniform([0.0, 0.0], [WIDTH_M, HEIGHT_M], (size, 2))
        times = measure_random_points(points, max(MIN_ROUNDS, budget // size))
        cells = format_times([times["partition"], times["limited range"]], times.get("Delaunay", np.nan))
        polygons_time = times["polygons"] - times["partition"]
        print(f"{size:6d} {cells} {polygons_time * MICROSECONDS_PER_S:9.0f} µs")


def measure_moving_robots(size: int, steps: int, rng: np.random.Generator) -> list[float]:
    """Simulate robots that move in straight lines, and measure the partitions of each step.

    Returns
    -------
    list of float, s
        Median times of a triangulation by SciPy, of a partition, and of one that starts from the previous
        triangulation.
    """
    side = np.sqrt(AREA_PER_ROBOT_M2 * size)
    region = Region(side * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
    points = rng.uniform(MARGIN_M, side - MARGIN_M, (size, 2))
    headings = rng.uniform(0.0, 2.0 * np.pi, size)
    distances = rng.uniform(0.0, MAX_SPEED_M_S * STEP_S, size)
    displacements = distances[:, None] * np.column_stack([np.cos(headings), np.sin(headings)])
    triangulation = partition(points, region).triangulation
    times = []
    for _ in range(steps):
        next_points = points + displacements
        displacements[(next_points < MARGIN_M) | (next_points > side - MARGIN_M)] *= -1.0
        points = points + displacements

        start_time = perf_counter()
        Delaunay(points)
        delaunay_end_time = perf_counter()
        partition(points, region)
        partition_end_time = perf_counter()
        triangulation = partition(points, region, triangulation=triangulation).triangulation
        end_time = perf_counter()
        times.append(
            [
                delaunay_end_time - start_time,
                partition_end_time - delaunay_end_time,
                end_time - partition_end_time,
            ]
        )
    medians: list[float] = np.median(times, axis=0).tolist()
    return medians


def print_moving_robots_table(budget: int) -> None:
    """Print the table for moving robots, with a row for each team size."""
    rng = np.random.default_rng(0)
    print(f"{'robots':>6} {'Delaunay':>12} {'from scratch':>18} {'from previous':>18} {'goal':>6}")
    for size, goal in MOVING_TEAM_GOALS.items():
        delaunay_time, *times = measure_moving_robots(size, max(MIN_STEPS, budget // size), rng)
        goal_text = f"{'-':>6}" if goal is None else f"{goal:5.2f}x"
        print(f"{size:6d} {format_times(times, delaunay_time)} {goal_text}")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--budget",
        type=int,
        default=DEFAULT_BUDGET,
        help="number of robots in all partitions of a row together (default: %(default)s)",
    )
    arguments = parser.parse_args()
    print_random_points_table(arguments.budget)
    print()
    print_moving_robots_table(arguments.budget)


if __name__ == "__main__":
    main()
