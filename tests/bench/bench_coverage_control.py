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
import importlib.util
import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import scipy

from robocov import Environment, Raster, Simulation, Team, UniformStart, make_controller
from robocov.typing import FloatArray

SIDE_M = 1024.0
PIXELS = 1024
"""Number of pixels along a side of a world."""
RASTER_PIXELS = 256
"""Number of pixels along a side of the density that robots of robocov sense."""
ROBOTS = 32
PEAKS = 32
SIGMA_RANGE_M = (40.0, 50.0)
MASS_RANGE = (6.0, 10.0)
TRUNCATION = 2.0
"""Distance from its center at which a peak ends, in standard deviations."""
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


class Peak(NamedTuple):
    """A circular Gaussian, cut off at `TRUNCATION` standard deviations."""

    x: float
    """m"""
    y: float
    """m"""
    sigma: float
    """Standard deviation, m."""
    mass: float
    """Integral of the density without the cut."""


class World(NamedTuple):
    """A world, and the starts of the robots."""

    peaks: Sequence[Peak]
    density: FloatArray
    """(PIXELS, PIXELS) Density by row (y) and column (x), at most 1."""
    starts: FloatArray
    """(ROBOTS, 2) m"""


def draw_world(seed: int) -> World:
    """Draw a world by the default rules of CoverageControl."""
    rng = np.random.default_rng(seed)
    peaks = []
    for _ in range(PEAKS):
        x, y = rng.uniform(0.0, SIDE_M, 2)
        peaks.append(Peak(x=x, y=y, sigma=rng.uniform(*SIGMA_RANGE_M), mass=rng.uniform(*MASS_RANGE)))
    starts = rng.uniform(1.0, SIDE_M - 1.0, (ROBOTS, 2))
    return World(peaks=peaks, density=compute_density(peaks), starts=starts)


def compute_density(peaks: Sequence[Peak]) -> FloatArray:
    """Compute the mass of the peaks in each pixel, relative to the largest, (PIXELS, PIXELS)."""
    edges = np.linspace(0.0, SIDE_M, PIXELS + 1)
    centers = 0.5 * (edges[:-1] + edges[1:])
    density = np.zeros((PIXELS, PIXELS))
    for peak in peaks:
        mass_x = np.diff(scipy.special.ndtr((edges - peak.x) / peak.sigma))
        mass_y = np.diff(scipy.special.ndtr((edges - peak.y) / peak.sigma))
        squared_distances = (centers - peak.x) ** 2 + (centers[:, None] - peak.y) ** 2
        is_near = squared_distances <= (TRUNCATION * peak.sigma) ** 2
        density += np.where(is_near, peak.mass * mass_x * mass_y[:, None], 0.0)
    relative: FloatArray = density / density.max()
    return relative


def compute_cost(density: FloatArray, positions: FloatArray) -> float:
    """Compute the sum of the squared distances to the nearest robot, weighted by the density."""
    x, y = np.meshgrid(np.arange(PIXELS) + 0.5, np.arange(PIXELS) + 0.5)
    pixel_side = SIDE_M / PIXELS
    centers = pixel_side * np.column_stack([x.ravel(), y.ravel()])
    distances, _ = scipy.spatial.KDTree(positions).query(centers)
    return float(density.ravel() @ distances**2)


def build_environment(world: World) -> Environment:
    """Build the world as a map of robocov, with a coarser raster that has the same mass in each pixel."""
    merged = PIXELS // RASTER_PIXELS
    blocks = world.density.reshape(RASTER_PIXELS, merged, RASTER_PIXELS, merged)
    raster = Raster(blocks.mean(axis=(1, 3)), extent=(0.0, 0.0, SIDE_M, SIDE_M), interpolation="cells")
    square = ((0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M))
    return Environment("world", square, density=raster, starts={"anywhere": UniformStart()})


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
    simulation = Simulation(build_environment(world), make_controller(name), world.starts, team)
    while simulation.time < duration:
        simulation.step()
    return compute_cost(world.density, simulation.positions) / compute_cost(world.density, world.starts)


def run_theirs(name: str, seed: int, *, duration: float) -> float:
    """Return the fraction of the initial cost that a controller of CoverageControl leaves."""
    library = load_coverage_control()
    parameters = library.Parameters()
    world = draw_world(seed)
    world_density = library.WorldIDF(parameters)
    for peak in world.peaks:
        center = np.array([peak.x, peak.y])
        world_density.AddNormalDistribution(
            library.BivariateNormalDistribution(center, peak.sigma, peak.mass)
        )
    world_density.GenerateMap()
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


def load_coverage_control() -> Any:
    """Load the compiled part of CoverageControl, which contains the simulator and its controllers.

    Its Python package imports PyTorch Geometric even if only this part is used.
    """
    if "coverage_control" not in sys.modules:
        spec = importlib.util.find_spec("coverage_control")
        if spec is None or spec.submodule_search_locations is None:
            raise SystemExit(
                'CoverageControl is missing: pip install "robocov[coverage-control]", or use --ours'
            )
        package = ModuleType("coverage_control")
        package.__path__ = [str(Path(folder)) for folder in spec.submodule_search_locations]
        sys.modules["coverage_control"] = package
    return importlib.import_module("coverage_control._core")


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
