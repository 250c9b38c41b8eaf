"""A whole step (observe, cells, forces, physics) against Qhull's Delaunay triangulation and bare physics."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import pymunk
from scipy.spatial import Delaunay

from robocov.controllers import Rapf
from robocov.mapfile import load_map
from robocov.simulation import Simulation
from robocov_app.bench.measure import Case, InTurn, Parameters, Row

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov.arrays import Array

GOALS = {6: None, 50: 5.0, 200: 2.5, 1000: 1.2}
"""Wanted multiples of the time of the triangulation, by number of robots."""

REAL_TIME = {6: 60.0}
"""Wanted multiples of real time."""

WARM_UP = 120
"""Steps before the first that counts: two seconds, by when the team is on its way."""


def cases(*, quick: bool = False) -> list[Case]:
    """Return a case for each size of a team that RAPF moves on the large map."""
    return [partial(_rows, n, quick) for n in GOALS]


def _rows(n: int, quick: bool) -> Iterator[Row]:
    campus = load_map("campus")
    simulation = Simulation(campus, Rapf(), campus.start("uniform").sample(n, seed=0))
    for _ in range(WARM_UP):
        simulation.step()
    space = _bare_space(simulation.positions)
    taken = InTurn(
        {
            "step": simulation.step,
            "delaunay": lambda: Delaunay(simulation.positions),
            "space": lambda: space.step(simulation.dt),
        }
    ).rounds((30 if n > 500 else 60) if quick else (100 if n > 500 else 300))
    step = taken["step"]
    note = f"{simulation.dt / step:.0f} x real time"
    slowest = simulation.dt / REAL_TIME[n] if n in REAL_TIME else None
    size: Parameters = {"robots": n}
    triangulated = "Qhull's Delaunay", taken["delaunay"]
    yield Row("step", "one step", size, step, *triangulated, GOALS[n], slowest, note)
    yield Row("step", "one step", size, step, "bare Space.step", taken["space"])


def _bare_space(positions: Array) -> pymunk.Space:
    """Return a space with a disc at each place, (n, 2) m, and nothing else."""
    space = pymunk.Space()
    for x, y in positions.tolist():
        body = pymunk.Body(1.0, float("inf"))
        body.position = (x, y)
        space.add(body, pymunk.Circle(body, 0.1))
    return space
