"""The public names of robocov, each with the module that defines it.

This is the only list of public names. It is read by type checkers and by ``__init__.py``, which loads names
on first use and expects one line for each: ``from .module import Name as Name``.
"""

from .conditions import Conditions as Conditions
from .conditions import Failure as Failure
from .conditions import Join as Join
from .controllers import Atlas as Atlas
from .controllers import AtlasShared as AtlasShared
from .controllers import Controller as Controller
from .controllers import IndividualController as IndividualController
from .controllers import IndividualControllerAdapter as IndividualControllerAdapter
from .controllers import Lloyd as Lloyd
from .controllers import OwnView as OwnView
from .controllers import Rapf as Rapf
from .controllers import Rpf as Rpf
from .controllers import list_controller_classes as list_controller_classes
from .controllers import make_controller as make_controller
from .controllers.gains import choice as choice
from .controllers.gains import gain as gain
from .cost import CoverageCost as CoverageCost
from .cost import CoverageResult as CoverageResult
from .cost import TimeVaryingCost as TimeVaryingCost
from .density import Density as Density
from .density import Gaussian as Gaussian
from .density import Gaussians as Gaussians
from .density import Raster as Raster
from .density import Uniform as Uniform
from .density import WeightedArea as WeightedArea
from .density import WeightedPolygons as WeightedPolygons
from .drawing import show as show
from .environment import CircleObstacle as CircleObstacle
from .environment import DiscStart as DiscStart
from .environment import Environment as Environment
from .environment import ObstaclePath as ObstaclePath
from .environment import PointsStart as PointsStart
from .environment import PolygonObstacle as PolygonObstacle
from .environment import UniformStart as UniformStart
from .environment import WallObstacle as WallObstacle
from .errors import InputError as InputError
from .errors import MapError as MapError
from .errors import OutputError as OutputError
from .errors import ParameterError as ParameterError
from .errors import RobocovError as RobocovError
from .errors import StartError as StartError
from .files.array_files import ArrayCache as ArrayCache
from .generator import GENERATORS as GENERATORS
from .generator import generate_map as generate_map
from .lower_bound import LowerBound as LowerBound
from .lower_bound import compute_lower_bound as compute_lower_bound
from .mapfile import build_map_schema as build_map_schema
from .mapfile import list_bundled_maps as list_bundled_maps
from .mapfile import load_map as load_map
from .mapfile import save_map as save_map
from .mapfile.check import check_map as check_map
from .metrics import compute_cost_history as compute_cost_history
from .metrics import find_settling_time as find_settling_time
from .metrics import summarize as summarize
from .metrics.results import Results as Results
from .metrics.results import read_results as read_results
from .metrics.run_metrics import RunMetrics as RunMetrics
from .metrics.run_metrics import compute_run_metrics as compute_run_metrics
from .observation import Decision as Decision
from .observation import Observations as Observations
from .observation import Snapshot as Snapshot
from .observation.neighbors import Neighbors as Neighbors
from .observation.region import Region as Region
from .optimum import Optimum as Optimum
from .optimum import find_optimum as find_optimum
from .record import Record as Record
from .scenario import Comparison as Comparison
from .scenario import Scenario as Scenario
from .scenario import compare as compare
from .scenario import run as run
from .sensor import RangeSensor as RangeSensor
from .simulation import Simulation as Simulation
from .simulation import SimulationBatch as SimulationBatch
from .simulation import TeamState as TeamState
from .team import Team as Team
from .team_files import read_team as read_team
from .voronoi import VoronoiPartition as VoronoiPartition
from .voronoi import WeightedCells as WeightedCells
from .voronoi import partition as partition
from .voronoi import partition_by_travel_time as partition_by_travel_time
from .world import World as World

__version__: str
__all__: list[str]
