"""How long a whole simulated step takes, as a multiple of scipy's Delaunay triangulation of the same robots.

    python tests/bench/bench_step.py [map] [controller]

A step is everything: observe, cells, forces, physics. The second yardstick is a bare step of the physics
engine with as many discs. The calls are interleaved and medians compared, so that the machine's moods
fall on all alike.
"""

from __future__ import annotations

import sys
from time import perf_counter

import numpy as np
import pymunk
from scipy.spatial import Delaunay

from robocov.controllers import make_controller
from robocov.mapfile import load_map
from robocov.robots import Team
from robocov.simulation import DEFAULT_DT, Simulation

GOALS = {6: None, 50: 5.0, 200: 2.5, 1000: 1.2}
"""Multiples of Delaunay's time, by the number of robots."""

REAL_TIME = {6: 60.0}
"""Goals as multiples of real time."""

WARM_UP = 120
"""Steps before the first that counts: two seconds, by when the team is on its way."""


def bare_space(positions: np.ndarray) -> pymunk.Space:
    """Return a space with a disc at each place and nothing else."""
    space = pymunk.Space()
    for place in positions.tolist():
        body = pymunk.Body(1.0, float("inf"))
        body.position = tuple(place)
        space.add(body, pymunk.Circle(body, 0.1))
    return space


def main(name: str, controller: str) -> None:
    """Print one row a team size."""
    environment = load_map(name)
    print(f"{controller} on {name}, dt = 1/60 s")
    print(
        f"{'robots':>6} {'step':>10} {'Delaunay':>10} {'ratio':>7} {'goal':>6} "
        f"{'bare space':>12} {'real time':>10}"
    )
    for n, goal in GOALS.items():
        starts = environment.start("uniform").sample(n, seed=0)
        simulation = Simulation(environment, make_controller(controller), starts, Team.homogeneous(n))
        for _ in range(WARM_UP):
            simulation.step()
        space = bare_space(simulation.positions)
        taken: list[tuple[float, float, float]] = []
        for _ in range(100 if n > 500 else 300):
            begin = perf_counter()
            simulation.step()
            stepped = perf_counter()
            Delaunay(simulation.positions)
            triangulated = perf_counter()
            space.step(DEFAULT_DT)
            taken.append((stepped - begin, triangulated - stepped, perf_counter() - triangulated))
        step, floor, bare = np.median(taken, axis=0)
        limit = f"{goal:5.1f}x" if goal else f"{'-':>6}"
        wanted = f" (goal {REAL_TIME[n]:.0f}x)" if n in REAL_TIME else ""
        print(
            f"{n:6d} {step * 1e6:7.0f} µs {floor * 1e6:7.0f} µs {step / floor:6.2f}x {limit} "
            f"{bare * 1e6:9.0f} µs {DEFAULT_DT / step:9.0f}x{wanted}"
        )


if __name__ == "__main__":
    main(*[*sys.argv[1:], *["campus", "rapf"][len(sys.argv) - 1 :]])
