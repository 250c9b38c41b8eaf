"""The exact coverage cost on bundled maps against the distances that a k-d tree finds.

The tree (scipy's `cKDTree`) knows the nearest robot of the same sites as the crow flies, through walls: the
least that a coverage cost takes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from scipy.spatial import cKDTree

from robocov.cost import CoverageCost
from robocov.mapfile import load_map
from robocov_app.bench.cost import Places, evaluated
from robocov_app.bench.measure import Case, InTurn, Parameters, Row

TREE = "k-d tree of the robots"

BEFORE = {
    ("rooms", 64, 6): 4.5, ("rooms", 128, 6): 2.8, ("rooms", 256, 6): 1.7,
    ("rooms", 64, 50): 4.9, ("rooms", 128, 50): 2.4, ("rooms", 256, 50): 1.0,
    ("museum", 64, 6): 7.4, ("museum", 128, 6): 3.8, ("museum", 256, 6): 1.9,
    ("museum", 64, 50): 6.9, ("museum", 128, 50): 4.2, ("museum", 256, 50): 1.1,
    ("campus", 64, 6): 19.5, ("campus", 128, 6): 14.6, ("campus", 256, 6): 4.9,
    ("campus", 64, 50): 20.6, ("campus", 128, 50): 10.3, ("campus", 256, 50): 3.2,
    ("campus", 64, 1000): 136.8,
}  # fmt: skip
"""Multiples of the time of the tree, by map, lattice and robots; see `Row.before`."""

FASTER = {64: 4.0, 128: 2.5, 256: 1.7}
"""Wanted speed-ups by lattice; twice that on campus, ten times for 1000 robots."""


def cases(*, quick: bool = False) -> list[Case]:
    """Return a case for each map and lattice."""
    maps = sorted({(name, lattice) for name, lattice, _ in BEFORE if not quick or lattice == 64})
    return [partial(_on_map, name, lattice, quick) for name, lattice in maps]


def _on_map(name: str, lattice: int, quick: bool) -> Iterator[Row]:
    cost = CoverageCost(load_map(name), lattice)
    for robots in [n for known, size, n in BEFORE if (known, size) == (name, lattice)]:
        places = Places(cost, robots)
        calls: dict[str, Callable[[], object]] = {
            "exact": partial(evaluated, cost, places),
            "tree": lambda: cKDTree(places.now).query(cost.points),  # noqa: B023 - called at once
        }
        taken = InTurn(calls, before=places.move).rounds(7, 0.3 if quick else 1.0)
        before = BEFORE[name, lattice, robots]
        faster = 10.0 if robots == 1000 else FASTER[lattice] * (2.0 if name == "campus" else 1.0)
        size: Parameters = {"map": name, "lattice": lattice, "robots": robots}
        tree = TREE, taken["tree"], before / faster
        yield Row("maps", "evaluated", size, taken["exact"], *tree, before=before)
