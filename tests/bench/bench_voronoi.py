"""How long a Voronoi partition takes, as a multiple of scipy's Delaunay triangulation of the same points.

    python tests/bench/bench_voronoi.py [rounds]

The calls are interleaved and medians compared, so that the machine's moods fall on all alike.
"""

from __future__ import annotations

import sys
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import Delaunay

from robocov.neighbours import Neighbours
from robocov.region import Region
from robocov.voronoi import partition

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

REGION = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 6.0], [0.0, 6.0]]))
RANGE = 2.5


def medians(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
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
        heard = Neighbours.within(points, np.full(n, RANGE))
        calls: dict[str, Callable[[], object]] = {
            "partition": lambda points=points: partition(points, REGION),
            "limited": lambda points=points, heard=heard: partition(points, REGION, heard),
            "polygons": lambda points=points: partition(points, REGION).polygons,
        }
        if n >= 4:
            calls["delaunay"] = lambda points=points: Delaunay(points)
        taken = medians(calls, max(15, budget // n))
        floor = taken.get("delaunay", np.nan)
        row = f"{n:6d} {floor * 1e6:9.0f} µs"
        for name in ("partition", "limited"):
            row += f" {taken[name] * 1e6:9.0f} µs {taken[name] / floor:4.2f}x"
        print(row, f"{(taken['polygons'] - taken['partition']) * 1e6:9.0f} µs")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20000)
