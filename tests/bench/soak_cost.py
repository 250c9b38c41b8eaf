"""Search random maps for the largest error of the exact coverage cost.

    python tests/bench/soak_cost.py --duration 60 --first-seed 1

Each seed gives a map of some kind with robots on it. The cost is compared with distances that are computed
for each pair of points, and on small maps also with distances by brute force. Press Ctrl+C to stop early.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1] / "robocov"))

import brute_force_geodesic
from cost_cases import compute_distance_error
from random_maps import KINDS, SIDE, build_random_map, draw_positions

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.typing import FloatArray, Point

REPORT_INTERVAL_S = 10.0
MAX_OBSTACLES = 49
MAX_LATTICE = 39
MAX_ROBOTS = 79

MAX_BRUTE_FORCE_VERTICES = 99
MAX_BRUTE_FORCE_ROBOTS = 3
BRUTE_FORCE_LATTICE = 5


@dataclass
class MaxErrors:
    """Largest errors so far, relative to the size of the map."""

    maps: int = 0
    """Number of maps."""
    error: float = 0.0
    brute_force_maps: int = 0
    """Number of maps that were also compared with brute force."""
    brute_force_error: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.maps} maps: largest error {self.error:.2g} of the size; "
            f"{self.brute_force_maps} by brute force: {self.brute_force_error:.2g}"
        )


@dataclass(frozen=True)
class Case:
    """A kind of map, and the numbers of its items."""

    seed: int
    kind: str
    obstacles: int
    lattice: int
    robots: int

    def __str__(self) -> str:
        return (
            f"seed {self.seed}: {self.kind}, {self.obstacles} obstacles, "
            f"lattice {self.lattice}, {self.robots} robots"
        )


def draw_case(seed: int) -> Case:
    """Draw the case of a seed."""
    rng = np.random.default_rng(seed)
    kinds = sorted(KINDS)
    return Case(
        seed=seed,
        kind=kinds[seed % len(kinds)],
        obstacles=int(rng.integers(1, MAX_OBSTACLES + 1)),
        lattice=int(rng.integers(1, MAX_LATTICE + 1)),
        robots=int(rng.integers(1, MAX_ROBOTS + 1)),
    )


def list_well_placed(environment: Environment, points: FloatArray) -> list[Point]:
    """Return the points that rounding cannot move across a wall."""
    free = environment.free
    return [(x, y) for x, y in points.tolist() if brute_force_geodesic.is_well_placed(free, (x, y), SIDE)]


def compute_brute_force_error(environment: Environment, positions: FloatArray) -> float | None:
    """Return the largest error of a cost on a coarse lattice, relative to the size of the map.

    The result is None if no distance can be compared.
    """
    cost = CoverageCost(environment, BRUTE_FORCE_LATTICE)
    robots = list_well_placed(environment, positions)[:MAX_BRUTE_FORCE_ROBOTS]
    points = list_well_placed(environment, cost.points)
    if not robots or not points:
        return None
    expected = brute_force_geodesic.compute_distances(environment.free, robots, points).min(axis=0)
    is_compared = [(x, y) in points for x, y in cost.points.tolist()]
    distances = cost(np.array(robots)).distances[is_compared]
    is_reached = np.isfinite(expected)
    assert (np.isfinite(distances) == is_reached).all()
    if not is_reached.any():
        return None
    return float(np.abs(distances[is_reached] - expected[is_reached]).max()) / SIDE


def check_case(case: Case, errors: MaxErrors) -> None:
    """Compute the errors on a map, and raise an AssertionError if points or owners are wrong."""
    environment = build_random_map(case.kind, case.obstacles, case.seed)
    if environment is None:
        return
    positions = draw_positions(environment, case.robots, case.seed)
    errors.error = max(errors.error, compute_distance_error(environment, case.lattice, positions))
    errors.maps += 1
    if len(shapely.get_coordinates(environment.free)) <= MAX_BRUTE_FORCE_VERTICES:
        brute_force_error = compute_brute_force_error(environment, positions)
        if brute_force_error is not None:
            errors.brute_force_error = max(errors.brute_force_error, brute_force_error)
            errors.brute_force_maps += 1


def check_cases(first_seed: int, duration: float, errors: MaxErrors) -> None:
    """Check the cases of successive seeds, and print the errors now and then."""
    start_time = time.monotonic()
    report_time = start_time
    seed = first_seed
    while time.monotonic() - start_time < duration:
        case = draw_case(seed)
        seed += 1
        try:
            check_case(case, errors)
        except ParameterError:
            # The map is too small for a lattice.
            continue
        except AssertionError as error:
            print(f"{case}: {error}")
        if time.monotonic() - report_time > REPORT_INTERVAL_S:
            report_time = time.monotonic()
            print(errors, flush=True)


def main() -> None:
    """Check random maps, and print the largest errors."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--duration", type=float, default=60.0, help="duration, s (default: %(default)s)")
    parser.add_argument("--first-seed", type=int, default=1, help="first seed (default: %(default)s)")
    arguments = parser.parse_args()
    errors = MaxErrors()
    try:
        check_cases(arguments.first_seed, arguments.duration, errors)
    except KeyboardInterrupt:
        print("Interrupted.")
    print(errors)


if __name__ == "__main__":
    main()
