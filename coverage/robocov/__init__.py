"""robocov: multi-robot coverage control among unknown obstacles.

    import robocov as rc

    environment = rc.load_map("rooms")
    simulation = rc.Simulation(environment, rc.Rapf(), starts=environment.start().sample(6, seed=0))
    record = simulation.run(60.0)
    cost = rc.CoverageCost(environment, lattice=128)
    cost(record.positions[-1]).mean_distance

Names are loaded on first use: importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

# fmt: off
if TYPE_CHECKING:  # isort: off
    from robocov.conditions import Conditions, Failure, Join
    from robocov.controllers import (
        CONTROLLERS, Atlas, AtlasShared, Controller, IndividualController, Individually, Lloyd, OwnView, Rapf,
        Rpf, make_controller,
    )
    from robocov.controllers.gains import choice, gain
    from robocov.cost import CoverageCost, CoverageResult, TimeVaryingCost
    from robocov.density import Density, Gaussian, Gaussians, Raster, Uniform, WeightedArea, WeightedPolygons
    from robocov.drawing import show
    from robocov.environment import (
        CircleObstacle, DiscStart, Environment, ObstaclePath, PointsStart, PolygonObstacle, UniformStart,
        WallObstacle,
    )
    from robocov.errors import InputError, MapError, OutputError, ParameterError, RobocovError, StartError
    from robocov.files.array_files import ArrayCache
    from robocov.generator import GENERATORS, generate_map
    from robocov.lower_bound import LowerBound, compute_lower_bound
    from robocov.mapfile import build_map_schema, list_bundled_maps, load_map, save_map
    from robocov.mapfile.check import check_map
    from robocov.metrics import compute_cost_history, find_settling_time, summarise
    from robocov.metrics.results import Results, read_results
    from robocov.metrics.run_metrics import RunMetrics, compute_run_metrics
    from robocov.observation import Decision, Observations, Snapshot
    from robocov.observation.neighbours import Neighbours
    from robocov.observation.region import Region
    from robocov.optimum import Optimum, find_optimum
    from robocov.record import Record
    from robocov.sensor import RangeSensor
    from robocov.simulation import Simulation, SimulationBatch, TeamState
    from robocov.team import Team
    from robocov.team_files import read_team
    from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time
    from robocov.world import World

__version__ = "0.1.0"

_NAMES = {
    "conditions": "Conditions Failure Join",
    "controllers": "Atlas AtlasShared CONTROLLERS Controller IndividualController Individually "
    "Lloyd OwnView Rapf Rpf make_controller",
    "controllers.gains": "choice gain",
    "cost": "CoverageCost CoverageResult TimeVaryingCost",
    "density": "Density Gaussian Gaussians Raster Uniform WeightedArea WeightedPolygons",
    "drawing": "show",
    "environment": "CircleObstacle DiscStart Environment ObstaclePath PointsStart PolygonObstacle "
    "UniformStart WallObstacle",
    "errors": "InputError MapError OutputError ParameterError RobocovError StartError",
    "files.array_files": "ArrayCache",
    "generator": "GENERATORS generate_map",
    "lower_bound": "LowerBound compute_lower_bound",
    "mapfile": "build_map_schema list_bundled_maps load_map save_map",
    "mapfile.check": "check_map",
    "metrics": "compute_cost_history find_settling_time summarise",
    "metrics.results": "Results read_results",
    "metrics.run_metrics": "RunMetrics compute_run_metrics",
    "observation": "Decision Observations Snapshot",
    "observation.neighbours": "Neighbours",
    "observation.region": "Region",
    "optimum": "Optimum find_optimum",
    "record": "Record",
    "sensor": "RangeSensor",
    "simulation": "Simulation SimulationBatch TeamState",
    "team": "Team",
    "team_files": "read_team",
    "voronoi": "VoronoiPartition WeightedCells partition partition_by_travel_time",
    "world": "World",
}
"""Public names by the module that has them."""

_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "CONTROLLERS", "GENERATORS", "ArrayCache", "Atlas", "AtlasShared", "CircleObstacle", "Conditions",
    "Controller", "CoverageCost", "CoverageResult", "Decision", "Density", "DiscStart", "Environment",
    "Failure", "Gaussian", "Gaussians", "IndividualController", "Individually", "InputError", "Join",
    "Lloyd", "LowerBound", "MapError", "Neighbours", "Observations", "ObstaclePath", "Optimum",
    "OutputError", "OwnView", "ParameterError", "PointsStart", "PolygonObstacle", "RangeSensor", "Rapf",
    "Raster", "Record", "Region", "Results", "RobocovError", "Rpf", "RunMetrics", "Simulation",
    "SimulationBatch", "Snapshot", "StartError", "Team", "TeamState", "TimeVaryingCost", "Uniform",
    "UniformStart", "VoronoiPartition", "WallObstacle", "WeightedArea", "WeightedCells",
    "WeightedPolygons", "World", "build_map_schema", "check_map", "choice", "compute_cost_history",
    "compute_lower_bound", "compute_run_metrics", "find_optimum", "find_settling_time", "gain",
    "generate_map", "list_bundled_maps", "load_map", "make_controller", "partition",
    "partition_by_travel_time", "read_results", "read_team", "save_map", "show", "summarise",
]
# fmt: on


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        # with the object, of which Python finds the nearest name
        raise AttributeError(
            f"module 'robocov' has no attribute {name!r}", name=name, obj=sys.modules[__name__]
        )
    value = getattr(importlib.import_module(f"robocov.{_HOME[name]}"), name)
    if name == "CONTROLLERS":  # with those of installed packages
        value = importlib.import_module("robocov.controllers").controller_kinds()
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
