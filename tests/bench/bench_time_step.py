"""Measure how far runs of RAPF are from the solution of its equation of motion, by control period.

    python tests/bench/bench_time_step.py

In a simulation, the force of a controller is constant over a control period. The differential equation (28)
has no such period. This script repeats runs with shorter and shorter periods, the shortest of which stands
for the solution. It prints the largest distance of a robot from its position in that run, and the final mean
distance. The column "limits" is about those of speed and acceleration. Near walls the force grows fast, and
the nearest obstacle point jumps from wall to wall: there the result depends on the period.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

import numpy as np

from robocov import CoverageCost, Environment, Rapf, Simulation, Team, load_map
from robocov.typing import FloatArray

DEFAULT_PERIOD_S = 1.0 / 60.0
REFINEMENTS = (1, 2, 4, 8)
"""Numbers by which `DEFAULT_PERIOD_S` is divided, one for each row of the table."""
REFERENCE_REFINEMENT = 32
"""Number by which it is divided in the run that stands for the solution."""
ROBOTS = 6
NO_LIMIT = 1e3
"""Maximum speed and acceleration if the limits are off, m/s and m/s²."""
SHARED_GAINS: dict[str, Any] = {"k_rep": 1.0, "rho_0": 2.0, "k_att": 3.0, "attraction_limit": None}
"""Gains that RAPF and RPF share in the study of the paper."""
GAINS: dict[str, dict[str, Any]] = {"default": {}, "shared": SHARED_GAINS}
LATTICE = 128


class Run(NamedTuple):
    """A run with one control period."""

    positions: FloatArray
    """(T, n, 2) m, at multiples of `DEFAULT_PERIOD_S`, so that runs can be compared."""
    mean_distance: float
    """Mean distance at the end, m."""


class Setting(NamedTuple):
    """A map, its start, the gains, and whether speed and acceleration are limited."""

    map: str
    start: str
    gains: str
    has_limits: bool


def simulate(setting: Setting, refinement: int, duration: float) -> Run:
    """Simulate a setting with a control period of `DEFAULT_PERIOD_S` / `refinement`."""
    environment = load_map(setting.map)
    limits: dict[str, Any] = {}
    if not setting.has_limits:
        limits = {"max_speed": NO_LIMIT, "max_acceleration": NO_LIMIT}
    simulation = Simulation(
        environment,
        Rapf(**GAINS[setting.gains]),
        environment.start(setting.start).sample(ROBOTS, seed=0),
        Team.homogeneous(ROBOTS, **limits),
        dt=DEFAULT_PERIOD_S / refinement,
    )
    positions = simulation.run(duration).positions[::refinement]
    return Run(positions, compute_mean_distance(environment, positions[-1]))


def compute_mean_distance(environment: Environment, positions: FloatArray) -> float:
    """Return the mean distance to the nearest robot, m."""
    return float(CoverageCost(environment, LATTICE)(positions).mean_distance)


def print_setting(setting: Setting, duration: float) -> None:
    """Print a row for each control period, as Markdown."""
    reference = simulate(setting, REFERENCE_REFINEMENT, duration)
    limits = "on" if setting.has_limits else "off"
    for refinement in REFINEMENTS:
        run = simulate(setting, refinement, duration)
        offsets = run.positions - reference.positions
        distances = np.hypot(offsets[..., 0], offsets[..., 1]).max(axis=1)
        change = run.mean_distance / reference.mean_distance - 1.0
        print(
            f"| {setting.map} | {setting.gains} | {limits} | 1/{round(refinement / DEFAULT_PERIOD_S)} s | "
            f"{distances.max():.3f} m | {distances[-1]:.3f} m | {run.mean_distance:.4f} m | {change:+.2%} |",
            flush=True,
        )


def main() -> None:
    """Simulate all settings, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--maps", nargs="+", default=["blocks-a/paper"], help="maps with their starts")
    parser.add_argument(
        "--gains", nargs="+", choices=tuple(GAINS), default=tuple(GAINS), help="sets of gains"
    )
    parser.add_argument("--limits", nargs="+", choices=("on", "off"), default=("on", "off"))
    parser.add_argument("--duration", type=float, default=30.0, help="duration of a run, s")
    arguments = parser.parse_args()
    print(
        "| map | gains | limits | control period | largest distance | at the end | mean distance | change |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in arguments.maps:
        map_name, _, start = name.partition("/")
        for gains in arguments.gains:
            for limits in arguments.limits:
                setting = Setting(map_name, start, gains, has_limits=limits == "on")
                print_setting(setting, arguments.duration)


if __name__ == "__main__":
    main()
