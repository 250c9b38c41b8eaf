"""Time of a Voronoi partition, as a multiple of scipy's Delaunay triangulation of the same points.

    python tests/bench/bench_voronoi.py [rounds]

The calls are interleaved and medians compared, so that the machine's moods fall on all alike. The last
table is for robots on the move, as a simulation has them: each partition starts from the triangulation
of the one before.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import Delaunay

from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import partition

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

REGION = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 6.0], [0.0, 6.0]]))
RANGE = 2.5


def measure_medians(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median seconds of each call, all of them called in turn `rounds` times."""
    taken: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            begin = perf_counter()
            call()
            taken[name].append(perf_counter() - begin)
    return {name: median(times) for name, times in taken.items()}


def main(budget: int) -> None:
    """Print one row a team size; `budget` is roughly the number of robots partitioned."""
    rng = np.random.default_rng(0)
    print(f"{'robots':>6} {'Delaunay':>12} {'partition':>18} {'limited range':>18} {'polygons':>12}")
    for n in (2, 4, 5, 6, 12, 50, 200, 1000):
        points = rng.uniform([0.0, 0.0], [10.0, 6.0], (n, 2))
        heard = Neighbors.from_ranges(points, np.full(n, RANGE))
        calls: dict[str, Callable[[], object]] = {
            "partition": lambda points=points: partition(points, REGION),
            "limited": lambda points=points, heard=heard: partition(points, REGION, heard),
            "polygons": lambda points=points: partition(points, REGION).polygons,
        }
        if n >= 4:
            calls["delaunay"] = lambda points=points: Delaunay(points)
        taken = measure_medians(calls, max(15, budget // n))
        floor = taken.get("delaunay", np.nan)
        row = f"{n:6d} {floor * 1e6:9.0f} µs"
        for name in ("partition", "limited"):
            row += f" {taken[name] * 1e6:9.0f} µs {taken[name] / floor:4.2f}x"
        print(row, f"{(taken['polygons'] - taken['partition']) * 1e6:9.0f} µs")


def print_moving_teams(budget: int) -> None:
    """Print one row a team size: robots that cross 1/60 s in straight lines, 10 m² a robot."""
    rng = np.random.default_rng(0)
    print(f"\n{'robots':>6} {'Delaunay':>12} {'anew':>18} {'on the move':>18} {'goal':>6}")
    for n, goal in ((12, None), (50, None), (200, 0.6), (1000, 0.35)):
        side = np.sqrt(10.0 * n)
        region = Region(side * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
        points = rng.uniform(0.1, side - 0.1, (n, 2))
        heading = rng.uniform(0.0, 2.0 * np.pi, n)
        stride = rng.uniform(0.0, 1.0 / 60.0, n)[:, None] * np.column_stack(
            [np.cos(heading), np.sin(heading)]
        )
        warm = partition(points, region).triangulation
        taken: list[list[float]] = []
        for _ in range(max(60, budget // n)):
            stride[(points + stride < 0.1) | (points + stride > side - 0.1)] *= -1.0
            points = points + stride
            times = [perf_counter()]
            Delaunay(points)
            times.append(perf_counter())
            partition(points, region)
            times.append(perf_counter())
            warm = partition(points, region, triangulation=warm).triangulation
            times.append(perf_counter())
            taken.append([stop - start for start, stop in pairwise(times)])
        floor, anew, moving = np.median(taken, axis=0)
        row = f"{n:6d} {floor * 1e6:9.0f} µs"
        for each in (anew, moving):
            row += f" {each * 1e6:9.0f} µs {each / floor:4.2f}x"
        print(row, f"{goal:5.2f}x" if goal else f"{'-':>6}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20000)
    print_moving_teams(int(sys.argv[1]) if len(sys.argv) > 1 else 20000)
