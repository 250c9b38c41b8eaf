"""Search for a random plan that is a valid map: in one piece, with wide passages, and with space for a start.

Lengths are in meters. Coordinates are rounded to centimeters, so that they are the same on every processor.
"""

from collections.abc import Callable
from contextlib import suppress

import numpy as np
import shapely

from robocov.environment import DiscStart, Environment, Point
from robocov.errors import MapError, ParameterError
from robocov.mapfile import from_json, to_json
from robocov_app.benchmark.plan_shapes import FloorPlan

_MAX_ATTEMPTS = 400
"""Maximum number of plans that are drawn for a map."""
_MIN_PASSAGE_M = 0.6
"""Minimum width of the passages that connect the free space."""
_START_MARGIN_M = 0.01
"""Distance of the start disc from walls, so that the disc stays free when its center is rounded."""


def search_map(
    kind: str,
    seed: int,
    *,
    kind_number: int,
    draw: Callable[[np.random.Generator], FloorPlan],
    start_radius: float,
    min_blocked_fraction: float = 0.0,
) -> Environment:
    """Draw plans until one has enough obstacles, and a free space that is connected by wide passages.

    Parameters
    ----------
    kind : str
        Name of the kind of plan.
    seed : int
        Seed of the random numbers.
    kind_number : int
        Number of the kind, so that different kinds have different random numbers.
    draw : callable
        Function that draws a plan from a random number generator.
    start_radius : float, m
        Radius of the start disc.
    min_blocked_fraction : float
        Minimum area of the obstacles divided by the area of the map.

    Returns
    -------
    Environment
        The map, with a start named "entry" as near as possible to the entrance of the plan.

    Raises
    ------
    ParameterError
        If no suitable plan is found with this seed.
    """
    for attempt in range(_MAX_ATTEMPTS):
        rng = np.random.default_rng([kind_number, seed, attempt])
        floor_plan = draw(rng)
        plan = Environment(f"{kind} {seed}", floor_plan.boundary, tuple(floor_plan.obstacles))
        if not _is_connected(plan) or not _has_enough_obstacles(plan, min_blocked_fraction):
            continue
        start = _find_entry(plan, floor_plan.entrance, start_radius)
        if start is None:
            continue
        document = to_json(Environment(plan.name, plan.boundary, plan.obstacles, {"entry": start}))
        # Reading the plan as a map file checks it. If it is not a valid map, another plan is drawn.
        with suppress(MapError):
            return from_json(document, plan.name)
    raise ParameterError(
        f"map {kind}-{seed}: none of {_MAX_ATTEMPTS} random plans is suitable. Try another seed."
    )


def _is_connected(plan: Environment) -> bool:
    """Return whether the free space is connected, and stays so without its narrow passages."""
    wide_space = plan.free.buffer(-_MIN_PASSAGE_M / 2.0, quad_segs=16)
    return len(plan.free.geoms) == 1 and isinstance(wide_space, shapely.Polygon)


def _has_enough_obstacles(plan: Environment, min_fraction: float) -> bool:
    """Return whether the obstacles cover at least a given fraction of the map."""
    blocked_area = sum(obstacle.polygon.area for obstacle in plan.obstacles)
    return bool(blocked_area >= min_fraction * plan.area)


def _find_entry(plan: Environment, entrance: Point | None, radius: float) -> DiscStart | None:
    """Return the free start disc nearest to the entrance, or None if there is no space for one."""
    centers = plan.static.free.buffer(-radius - _START_MARGIN_M)
    if centers.is_empty:
        return None
    target = shapely.Point(entrance or plan.region.bounds[:2])
    x, y = shapely.shortest_line(centers, target).coords[0]
    return DiscStart((round(x, 2), round(y, 2)), radius)
