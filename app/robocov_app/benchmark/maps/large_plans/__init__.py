"""Plans of large buildings and tunnels, 30 to 60 m long, modeled on real kinds of places.

Each module draws one kind of plan in four layouts, which consecutive seeds select in turn.
"""

from collections.abc import Callable

import numpy as np

from robocov.environment import Environment
from robocov_app.benchmark.maps.large_plans.depots import draw_depot
from robocov_app.benchmark.maps.large_plans.museums import draw_museum
from robocov_app.benchmark.maps.large_plans.office_floors import draw_office_floor
from robocov_app.benchmark.maps.large_plans.schools import draw_school
from robocov_app.benchmark.maps.large_plans.tunnels import draw_tunnels
from robocov_app.benchmark.maps.large_plans.wards import draw_ward
from robocov_app.benchmark.maps.plan_search import find_valid_map
from robocov_app.benchmark.maps.plan_shapes import FloorPlan

_FIRST_KIND_NUMBER = 100
"""Number of the first kind, chosen so that no kind shares its random numbers with the smaller maps."""
_LAYOUTS = 4
"""Number of layouts of each kind."""
_START_RADIUS_M = 1.2
"""Radius of the start disc, in which 50 robots fit."""

LARGE_PLANS: dict[str, Callable[[np.random.Generator, int], FloorPlan]] = {
    "office-floors": draw_office_floor,
    "wards": draw_ward,
    "depots": draw_depot,
    "museums": draw_museum,
    "schools": draw_school,
    "tunnels": draw_tunnels,
}
"""Functions that draw a plan with a given layout, by the name of the kind.

The order determines the random numbers; append new kinds, so that existing maps do not change.
"""


def build_large_plan(kind: str, seed: int) -> Environment:
    """Build a random plan of a large building or of tunnels.

    Parameters
    ----------
    kind : str
        Name of a kind in `LARGE_PLANS`.
    seed : int
        Seed of the random numbers, which also selects the layout.

    Returns
    -------
    Environment
        The map, with a start named "entry" near its entrance.

    Raises
    ------
    NoLayoutError
        If no suitable plan is found with this seed.
    """
    layout = seed % _LAYOUTS
    return find_valid_map(
        kind,
        seed,
        kind_number=_FIRST_KIND_NUMBER + list(LARGE_PLANS).index(kind),
        sample_plan=lambda rng: LARGE_PLANS[kind](rng, layout),
        start_radius=_START_RADIUS_M,
    )
