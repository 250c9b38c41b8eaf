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
    from robocov.array_cache import ArrayCache
    from robocov.controllers import (
        CONTROLLERS,
        Controller,
        IndividualController,
        Individually,
        Lloyd,
        OwnView,
        Rapf,
        Rpf,
        make_controller,
    )
    from robocov.controllers.gains import gain
    from robocov.cost import CoverageCost, CoverageResult
    from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
    from robocov.errors import InputError, MapError, OutputError, ParameterError, RobocovError, StartError
    from robocov.generator import GENERATORS, generated_map
    from robocov.mapcheck import check_map
    from robocov.mapfile import bundled_maps, load_map, map_schema, save_map
    from robocov.metrics import cost_history, settled_at, summarise
    from robocov.neighbours import Neighbours
    from robocov.observation import Decision, Observations, Snapshot
    from robocov.optimum import Optimum
    from robocov.record import Record
    from robocov.region import Region
    from robocov.results import Results, read_results
    from robocov.robots import Team
    from robocov.sensor import RangeSensor
    from robocov.simulation import Simulation
    from robocov.starts import DiscStart, PointsStart, UniformStart
    from robocov.voronoi import VoronoiPartition, partition
    from robocov.world import World

__version__ = "0.1.0"

_HOME = {
    "ArrayCache": "array_cache",
    "CONTROLLERS": "controllers",
    "CircleObstacle": "environment",
    "Controller": "controllers",
    "CoverageCost": "cost",
    "CoverageResult": "cost",
    "Decision": "observation",
    "DiscStart": "starts",
    "Environment": "environment",
    "GENERATORS": "generator",
    "IndividualController": "controllers",
    "Individually": "controllers",
    "InputError": "errors",
    "Lloyd": "controllers",
    "MapError": "errors",
    "Neighbours": "neighbours",
    "Observations": "observation",
    "Optimum": "optimum",
    "OutputError": "errors",
    "OwnView": "controllers",
    "ParameterError": "errors",
    "PointsStart": "starts",
    "PolygonObstacle": "environment",
    "RangeSensor": "sensor",
    "Rapf": "controllers",
    "Record": "record",
    "Region": "region",
    "Results": "results",
    "RobocovError": "errors",
    "Rpf": "controllers",
    "Simulation": "simulation",
    "Snapshot": "observation",
    "StartError": "errors",
    "Team": "robots",
    "UniformStart": "starts",
    "VoronoiPartition": "voronoi",
    "WallObstacle": "environment",
    "World": "world",
    "bundled_maps": "mapfile",
    "check_map": "mapcheck",
    "cost_history": "metrics",
    "gain": "controllers.gains",
    "generated_map": "generator",
    "load_map": "mapfile",
    "make_controller": "controllers",
    "map_schema": "mapfile",
    "partition": "voronoi",
    "read_results": "results",
    "save_map": "mapfile",
    "settled_at": "metrics",
    "summarise": "metrics",
}

__all__ = [
    "CONTROLLERS",
    "GENERATORS",
    "ArrayCache",
    "CircleObstacle",
    "Controller",
    "CoverageCost",
    "CoverageResult",
    "Decision",
    "DiscStart",
    "Environment",
    "IndividualController",
    "Individually",
    "InputError",
    "Lloyd",
    "MapError",
    "Neighbours",
    "Observations",
    "Optimum",
    "OutputError",
    "OwnView",
    "ParameterError",
    "PointsStart",
    "PolygonObstacle",
    "RangeSensor",
    "Rapf",
    "Record",
    "Region",
    "Results",
    "RobocovError",
    "Rpf",
    "Simulation",
    "Snapshot",
    "StartError",
    "Team",
    "UniformStart",
    "VoronoiPartition",
    "WallObstacle",
    "World",
    "bundled_maps",
    "check_map",
    "cost_history",
    "gain",
    "generated_map",
    "load_map",
    "make_controller",
    "map_schema",
    "partition",
    "read_results",
    "save_map",
    "settled_at",
    "summarise",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'robocov' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"robocov.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
