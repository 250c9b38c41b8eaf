"""Coverage of an unknown density in the default setting of CoverageControl, next to its own controllers.

    python tests/bench/bench_coverage_control.py --worlds 4

CoverageControl (Agarwal et al. 2024, LPAC) is another simulator. By default, 32 robots start anywhere in a
square of 1024 m without walls, and the density has 32 peaks. Robots move at up to 5 m/s, communicate
within 128 m, and sense the density in a square of 64 m around them; in robocov, they sense it in a disc with
this diameter. The cost is the sum of the squared distances to the nearest robot, weighted by the density.

The table, which the handbook shows on the page on controllers, contains the remaining cost: the final cost
divided by the initial one. Both simulators run on the same worlds, from the same starts. The controllers of
CoverageControl are run by its own library, which has to be installed:
``pip install "robocov[coverage-control]"``.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy

from robocov import ParameterError, Simulation, Team, make_controller
from robocov.typing import FloatArray
from robocov_app.benchmark.coverage_control_cvt import build_world_density, load_library
from robocov_app.benchmark.maps.worlds import (
    PIXELS,
    ROBOTS,
    SIDE_M,
    build_open_square,
    draw_world,
    merge_pixels,
)

MAX_MEAN_DIFFERENCE = 1e-3
"""Maximum mean difference between the densities of both simulators, which are 1 at most."""
SENSING_RANGE_M = 32.0
COMMUNICATION_RANGE_M = 128.0
MAX_SPEED_M_S = 5.0
THEIR_CONTROLLERS = {
    "ClairvoyantCVT": "the density and all positions",
    "CentralizedCVT": "what the whole team has sensed, and all positions",
    "DecentralizedCVT": "what it has sensed itself, and positions within range",
}
"""Controllers of CoverageControl, with what a robot knows."""
OUR_CONTROLLERS = {
    "exploring-lloyd": "what robots have sensed and sent each other",
    "rapf": "the density, and positions within range",
    "lloyd": "the density, and positions within range",
    "gp-ucb": "the density where robots have been, and measurements of others",
    "adaptive": "the density where robots have been, and estimates of others",
}
"""Controllers of robocov that run by default, with what a robot knows."""
CLAIRVOYANT_LLOYD_LABEL = "`lloyd` with unlimited communication"
CLAIRVOYANT_LLOYD_KNOWLEDGE = "the density and all positions"
"""What a robot of Lloyd's algorithm knows with unlimited communication."""
HEAD = "| controller | what a robot knows | remaining cost | in each world |\n|---|---|---|---|"


def compute_cost(density: FloatArray, positions: FloatArray) -> float:
    """Compute the sum of the squared distances to the nearest robot, weighted by the density."""
    x, y = np.meshgrid(np.arange(PIXELS) + 0.5, np.arange(PIXELS) + 0.5)
    pixel_side = SIDE_M / PIXELS
    centers = pixel_side * np.column_stack([x.ravel(), y.ravel()])
    distances, _ = scipy.spatial.KDTree(positions).query(centers)
    return float(density.ravel() @ distances**2)


def run_ours(name: str, seed: int, *, duration: float, communication_range: float) -> float:
    """Return the fraction of the initial cost that a controller of robocov leaves."""
    world = draw_world(seed)
    team = Team.homogeneous(
        ROBOTS,
        radius=1.0,
        max_speed=MAX_SPEED_M_S,
        max_acceleration=10.0,
        sensing_range=SENSING_RANGE_M,
        communication_range=communication_range,
    )
    # The map has a coarser raster. Averaging preserves the mass.
    environment = build_open_square("world", merge_pixels(world.density))
    simulation = Simulation(environment, make_controller(name), world.starts, team)
    while simulation.time < duration:
        simulation.step()
    return compute_cost(world.density, simulation.positions) / compute_cost(world.density, world.starts)


def run_theirs(name: str, seed: int, *, duration: float) -> float:
    """Return the fraction of the initial cost that a controller of CoverageControl leaves."""
    library = load_library()
    parameters = library.Parameters()
    world = draw_world(seed)
    world_density = build_world_density(library, parameters, world.peaks)
    # Its maps are indexed by x, then y, and have single precision.
    differences = np.asarray(world_density.GetWorldMap()).T - world.density
    if np.abs(differences).mean() > MAX_MEAN_DIFFERENCE:
        raise SystemExit(f"world {seed}: the densities of robocov and of CoverageControl differ")
    starts = library.PointVector(list(world.starts))
    system = library.CoverageSystem(parameters, world_density, starts)
    controller = getattr(library, name)(parameters, ROBOTS, system)
    initial_cost = system.GetObjectiveValue()
    for _ in range(round(duration / parameters.pTimeStep)):
        controller.ComputeActions()
        system.StepActions(controller.GetActions())
    return float(system.GetObjectiveValue() / initial_cost)


class Row(NamedTuple):
    """A row of the table."""

    label: str
    knowledge: str
    """What a robot knows."""
    fractions: Sequence[float]
    """Remaining cost in each world."""

    @property
    def mean(self) -> float:
        """Mean over the worlds, rounded as in the table."""
        return round(float(np.mean(self.fractions)), 2)


def format_row(row: Row) -> str:
    """Format a row of the table as Markdown."""
    each = ", ".join(f"{fraction:.2f}" for fraction in row.fractions)
    return f"| {row.label} | {row.knowledge} | {row.mean:.2f} | {each} |"


def format_table(rows: Sequence[Row]) -> str:
    """Format the table as Markdown. Rows are in the order of their means; equal means keep their order."""
    return "\n".join([HEAD, *(format_row(row) for row in sorted(rows, key=lambda row: row.mean))])


def format_our_label(name: str) -> str:
    """Return the label of a controller of robocov."""
    return f"`{name}`"


def format_their_label(name: str) -> str:
    """Return the label of a controller of CoverageControl."""
    return f"{name} (CoverageControl)"


def list_labels() -> dict[str, str]:
    """Return what a robot knows, by the label of each row of the table with the default options."""
    labels = {format_their_label(name): knowledge for name, knowledge in THEIR_CONTROLLERS.items()}
    labels[CLAIRVOYANT_LLOYD_LABEL] = CLAIRVOYANT_LLOYD_KNOWLEDGE
    return labels | {format_our_label(name): knowledge for name, knowledge in OUR_CONTROLLERS.items()}


def main() -> None:
    """Run the controllers, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--worlds", type=int, default=4, help="number of worlds")
    parser.add_argument("--duration", type=float, default=120.0, help="duration of a run, s")
    parser.add_argument("--controllers", nargs="+", default=list(OUR_CONTROLLERS), help="of robocov")
    parser.add_argument("--ours", action="store_true", help="leave out the controllers of CoverageControl")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    arguments = parser.parse_args()
    limited = partial(run_ours, duration=arguments.duration, communication_range=COMMUNICATION_RANGE_M)
    runs: dict[str, Callable[[int], float]] = {}
    if not arguments.ours:
        try:
            load_library()
        except ParameterError as error:
            raise SystemExit(f"{error}. Pass --ours to run only the controllers of robocov.") from None
        for name in THEIR_CONTROLLERS:
            runs[format_their_label(name)] = partial(run_theirs, name, duration=arguments.duration)
    runs[CLAIRVOYANT_LLOYD_LABEL] = partial(
        run_ours, "lloyd", duration=arguments.duration, communication_range=math.inf
    )
    for name in arguments.controllers:
        runs[format_our_label(name)] = partial(limited, name)
    knowledge = list_labels()
    rows = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for label, run in runs.items():
            fractions = list(pool.map(run, range(arguments.worlds)))
            rows.append(Row(label, knowledge.get(label, ""), fractions))
            print(format_row(rows[-1]), file=sys.stderr, flush=True)
    print(format_table(rows))


if __name__ == "__main__":
    main()
