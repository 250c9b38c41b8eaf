"""The exact cost on ever new maps: how large is the largest error?

    python tests/bench/soak_cost.py [SECONDS] [FIRST SEED]

Each seed is a map of a kind with robots on it. The cost is compared with distances that are computed
pair by pair, those of small maps with the brute force as well. Ctrl-C ends it.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1] / "robocov"))

import brute_force_geodesic as brute
from cost_cases import compute_distance_error
from random_maps import KINDS, SIDE, build_random_map, draw_positions

from robocov.cost import CoverageCost
from robocov.errors import ParameterError


def compute_largest_error(environment, robots):
    """Return the largest error of a coarse cost, as a part of the map's size."""
    cost = CoverageCost(environment, 5)

    def list_well_placed(points):
        return [p for p in points.tolist() if brute.is_well_placed(environment.free, tuple(p), SIDE)]

    robots = list_well_placed(robots)[:3]
    points = list_well_placed(cost.points)
    if not robots or not points:
        return 0.0
    expected = brute.compute_distances(environment.free, robots, points).min(axis=0)
    found = cost(robots).distances[[p in points for p in cost.points.tolist()]]
    reached = np.isfinite(expected)
    assert (np.isfinite(found) == reached).all()
    return float(np.abs(found[reached] - expected[reached]).max(initial=0.0)) / SIDE


def main(seconds: float, seed: int) -> None:
    """Print the largest errors so far, now and then."""
    names = sorted(KINDS)
    worst = 0.0
    slow_worst = 0.0
    maps = 0
    slow_maps = 0
    until = said = time.monotonic()
    until += seconds
    try:
        while time.monotonic() < until:
            seed += 1
            rng = np.random.default_rng(seed)
            kind = names[seed % len(names)]
            count = rng.integers(1, 50)
            lattice = int(rng.integers(1, 40))
            robots = int(rng.integers(1, 80))
            environment = build_random_map(kind, int(count), seed)
            if environment is None:
                continue
            places = draw_positions(environment, robots, seed)
            try:
                worst = max(worst, compute_distance_error(environment, lattice, places))
                maps += 1
                if len(shapely.get_coordinates(environment.free)) < 100:
                    slow_worst = max(slow_worst, compute_largest_error(environment, places))
                    slow_maps += 1
            except ParameterError:
                continue
            except AssertionError as error:
                print(f"seed {seed}: {kind}, {count} obstacles, lattice {lattice}, {robots} robots: {error}")
            if time.monotonic() - said > 10.0:
                said = time.monotonic()
                print(f"{maps} maps: {worst:.2g}; {slow_maps} by brute force: {slow_worst:.2g}", flush=True)
    except KeyboardInterrupt:
        pass
    print(f"{maps} maps: largest error {worst:.2g} of the size; {slow_maps} by brute force: {slow_worst:.2g}")


if __name__ == "__main__":
    main(
        *(
            kind(text)
            for kind, text in zip(
                (float, int), [*sys.argv[1:3], *("60", "0")[len(sys.argv) - 1 :]], strict=True
            )
        )
    )
