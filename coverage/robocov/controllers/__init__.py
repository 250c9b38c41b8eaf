"""Controllers: the rules by which robots move, and their gains.

- `base`: the interface of controllers, and the base class of the built-in ones
- `individual`: controllers of one robot, called for each robot in turn
- `gains`: gains as dataclass fields, with units and ranges
- `registry`: controllers by name
- `user_modules`: controllers in files of users
- `repulsion`, `lloyd`, `barrier`, `tangentbug`, `visibility`, `boosting`, `adaptive`, `gp_ucb`:
  controllers without a map of the region
- `geodesic_lloyd`, `diffeomorphism`: controllers that know the whole map
- `placement`: controllers that place the whole team on the known map
- `exploration`: controllers that build the map while they cover the region
- `known_cells`, `known_map`, `convex_chart`, `driving`: cells, maps, velocities and forces, for several
  controllers
- `gaussian_process`, `square_grid`: a Gaussian process of the density, given measurements, and the squares in
  which robots measure it
- `density_exchange`: messages with measurements of the density
"""

from robocov.controllers.adaptive import Adaptive
from robocov.controllers.barrier import Barrier
from robocov.controllers.base import Controller, get_information, inform_controller
from robocov.controllers.boosting import Boosting
from robocov.controllers.diffeomorphism import Diffeomorphism
from robocov.controllers.exploration.atlas import Atlas
from robocov.controllers.exploration.atlas_shared import AtlasShared
from robocov.controllers.exploration.exploring_lloyd import ExploringLloyd
from robocov.controllers.exploration.frontier_median import FrontierMedian
from robocov.controllers.exploration.greedy_submodular import GreedySubmodular
from robocov.controllers.exploration.voronoi_graph import VoronoiGraphCoverage
from robocov.controllers.gains import get_gain_values, get_gains
from robocov.controllers.geodesic_lloyd import GeodesicLloyd
from robocov.controllers.gp_ucb import GpUcb
from robocov.controllers.individual import IndividualController, IndividualControllerAdapter, OwnView
from robocov.controllers.lloyd import Lloyd, RangeLimited
from robocov.controllers.placement.exemplar import Exemplar
from robocov.controllers.placement.local_search import LocalSearch
from robocov.controllers.registry import (
    CONTROLLERS,
    RECOMMENDED_CONTROLLERS,
    get_controller_label,
    get_recorded_name,
    has_memory,
    list_controller_classes,
    load_controller_class,
    make_controller,
)
from robocov.controllers.repulsion import Dispersion, Howard, Poduri, Rapf, Rpf
from robocov.controllers.tangentbug import TangentBug
from robocov.controllers.visibility import Visibility

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
    "Exemplar",
    "ExploringLloyd",
    "FrontierMedian",
    "GeodesicLloyd",
    "GpUcb",
    "GreedySubmodular",
    "Howard",
    "IndividualController",
    "IndividualControllerAdapter",
    "Lloyd",
    "LocalSearch",
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
    "get_recorded_name",
    "has_memory",
    "inform_controller",
    "list_controller_classes",
    "load_controller_class",
    "make_controller",
]
