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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robocov.conditions import Conditions, Failure, Join
    from robocov.controllers import (
        CONTROLLERS,
        Atlas,
        AtlasShared,
        Controller,
        IndividualController,
        Individually,
        Lloyd,
        OwnView,
        Rapf,
        Rpf,
        make_controller,
    )
    from robocov.controllers.gains import choice, gain
    from robocov.cost import CoverageCost, CoverageResult
    from robocov.cost.momentary_cost import MomentaryCost
    from robocov.density import (
        Density,
        Gaussian,
        Gaussians,
        Raster,
        Uniform,
        WeightedArea,
        WeightedPolygons,
    )
    from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
    from robocov.environment.obstacle_path import ObstaclePath
    from robocov.environment.starts import DiscStart, PointsStart, UniformStart
    from robocov.errors import InputError, MapError, OutputError, ParameterError, RobocovError, StartError
    from robocov.files.array_cache import ArrayCache
    from robocov.generator import GENERATORS, generated_map
    from robocov.mapfile import bundled_maps, load_map, map_schema, save_map
    from robocov.mapfile.check import check_map
    from robocov.metrics import cost_history, settled_at, summarise
    from robocov.metrics.results import Results, read_results
    from robocov.metrics.run_metrics import RunMetrics, run_metrics
    from robocov.observation import Decision, Observations, Snapshot
    from robocov.observation.neighbours import Neighbours
    from robocov.observation.region import Region
    from robocov.optimum import Optimum
    from robocov.record import Record
    from robocov.robots import Team
    from robocov.robots.teamfile import read_team
    from robocov.sensor import RangeSensor
    from robocov.simulation import Simulation
    from robocov.voronoi import VoronoiPartition, partition
    from robocov.voronoi.weighted_cells import WeightedCells, weighted_partition
    from robocov.world import World

__version__ = "0.1.0"

_HOME = {
    "ArrayCache": "files.array_cache",
    "Atlas": "controllers",
    "AtlasShared": "controllers",
    "CONTROLLERS": "controllers",
    "CircleObstacle": "environment",
    "Conditions": "conditions",
    "Controller": "controllers",
    "CoverageCost": "cost",
    "CoverageResult": "cost",
    "Decision": "observation",
    "Density": "density",
    "DiscStart": "environment.starts",
    "Environment": "environment",
    "Failure": "conditions",
    "GENERATORS": "generator",
    "Gaussian": "density",
    "Gaussians": "density",
    "IndividualController": "controllers",
    "Individually": "controllers",
    "InputError": "errors",
    "Join": "conditions",
    "Lloyd": "controllers",
    "MapError": "errors",
    "MomentaryCost": "cost.momentary_cost",
    "Neighbours": "observation.neighbours",
    "Observations": "observation",
    "ObstaclePath": "environment.obstacle_path",
    "Optimum": "optimum",
    "OutputError": "errors",
    "OwnView": "controllers",
    "ParameterError": "errors",
    "PointsStart": "environment.starts",
    "PolygonObstacle": "environment",
    "RangeSensor": "sensor",
    "Rapf": "controllers",
    "Raster": "density",
    "Record": "record",
    "Region": "observation.region",
    "Results": "metrics.results",
    "RobocovError": "errors",
    "Rpf": "controllers",
    "RunMetrics": "metrics.run_metrics",
    "Simulation": "simulation",
    "Snapshot": "observation",
    "StartError": "errors",
    "Team": "robots",
    "Uniform": "density",
    "UniformStart": "environment.starts",
    "VoronoiPartition": "voronoi",
    "WallObstacle": "environment",
    "WeightedArea": "density",
    "WeightedCells": "voronoi.weighted_cells",
    "WeightedPolygons": "density",
    "World": "world",
    "bundled_maps": "mapfile",
    "check_map": "mapfile.check",
    "choice": "controllers.gains",
    "cost_history": "metrics",
    "gain": "controllers.gains",
    "generated_map": "generator",
    "load_map": "mapfile",
    "make_controller": "controllers",
    "map_schema": "mapfile",
    "partition": "voronoi",
    "read_results": "metrics.results",
    "read_team": "robots.teamfile",
    "run_metrics": "metrics.run_metrics",
    "save_map": "mapfile",
    "settled_at": "metrics",
    "summarise": "metrics",
    "weighted_partition": "voronoi.weighted_cells",
}

__all__ = [
    "CONTROLLERS",
    "GENERATORS",
    "ArrayCache",
    "Atlas",
    "AtlasShared",
    "CircleObstacle",
    "Conditions",
    "Controller",
    "CoverageCost",
    "CoverageResult",
    "Decision",
    "Density",
    "DiscStart",
    "Environment",
    "Failure",
    "Gaussian",
    "Gaussians",
    "IndividualController",
    "Individually",
    "InputError",
    "Join",
    "Lloyd",
    "MapError",
    "MomentaryCost",
    "Neighbours",
    "Observations",
    "ObstaclePath",
    "Optimum",
    "OutputError",
    "OwnView",
    "ParameterError",
    "PointsStart",
    "PolygonObstacle",
    "RangeSensor",
    "Rapf",
    "Raster",
    "Record",
    "Region",
    "Results",
    "RobocovError",
    "Rpf",
    "RunMetrics",
    "Simulation",
    "Snapshot",
    "StartError",
    "Team",
    "Uniform",
    "UniformStart",
    "VoronoiPartition",
    "WallObstacle",
    "WeightedArea",
    "WeightedCells",
    "WeightedPolygons",
    "World",
    "bundled_maps",
    "check_map",
    "choice",
    "cost_history",
    "gain",
    "generated_map",
    "load_map",
    "make_controller",
    "map_schema",
    "partition",
    "read_results",
    "read_team",
    "run_metrics",
    "save_map",
    "settled_at",
    "summarise",
    "weighted_partition",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'robocov' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"robocov.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
