"""Controllers: the rules by which robots move, and their gains.

- `base`: the interface of controllers, and the base class of the built-in ones
- `individual`: controllers of one robot, called for each robot in turn
- `gains`: gains as dataclass fields, with units and ranges
- `registry`: controllers by name
- `user_modules`: controllers in files of users
- `repulsion`, `lloyd`, `barrier`, `tangentbug`, `visibility`, `boosting`, `adaptive`, `exploring_lloyd`:
  controllers without a map of the region
- `geodesic_lloyd`, `diffeomorphism`: controllers that know the whole map
- `atlas`, `frontier_median`, `greedy_submodular`, `voronoi_graph`: controllers that discover the map
- `shared_map`, `teammates`, `localization`: common parts of the controllers that discover the map
- `scan_exchange`: the messages from which robots with shared maps build their maps
- `atlas_memory`: what robots with `Atlas` remember from one plan to the next
- `density_exchange`, `sightings`: messages with measurements, and with last known positions
- `known_cells`, `driving`, `route_following`: cells, velocities and forces, for several controllers
"""

from robocov.controllers.adaptive import Adaptive
from robocov.controllers.atlas import Atlas, AtlasShared
from robocov.controllers.barrier import Barrier
from robocov.controllers.base import Controller, get_information, inform_controller
from robocov.controllers.boosting import Boosting
from robocov.controllers.diffeomorphism import Diffeomorphism
from robocov.controllers.exploring_lloyd import ExploringLloyd
from robocov.controllers.frontier_median import FrontierMedian
from robocov.controllers.gains import get_gain_values, get_gains
from robocov.controllers.geodesic_lloyd import GeodesicLloyd
from robocov.controllers.greedy_submodular import GreedySubmodular
from robocov.controllers.individual import IndividualController, IndividualControllerAdapter, OwnView
from robocov.controllers.lloyd import Lloyd, RangeLimited
from robocov.controllers.registry import (
    CONTROLLERS,
    RECOMMENDED_CONTROLLERS,
    get_controller_label,
    has_memory,
    list_controller_classes,
    load_controller_class,
    make_controller,
)
from robocov.controllers.repulsion import Dispersion, Howard, Poduri, Rapf, Rpf
from robocov.controllers.tangentbug import TangentBug
from robocov.controllers.visibility import Visibility
from robocov.controllers.voronoi_graph import VoronoiGraphCoverage

__all__ = [
    "CONTROLLERS",
    "RECOMMENDED_CONTROLLERS",
    "Adaptive",
    "Atlas",
    "AtlasShared",
    "Barrier",
    "Boosting",
    "Controller",
    "Diffeomorphism",
    "Dispersion",
    "ExploringLloyd",
    "FrontierMedian",
    "GeodesicLloyd",
    "GreedySubmodular",
    "Howard",
    "IndividualController",
    "IndividualControllerAdapter",
    "Lloyd",
    "OwnView",
    "Poduri",
    "RangeLimited",
    "Rapf",
    "Rpf",
    "TangentBug",
    "Visibility",
    "VoronoiGraphCoverage",
    "get_controller_label",
    "get_gain_values",
    "get_gains",
    "get_information",
    "has_memory",
    "inform_controller",
    "list_controller_classes",
    "load_controller_class",
    "make_controller",
]
