"""Search for a random plan that is a valid map: in one piece, with wide passages, and with space for a start.

Lengths are in meters. Coordinates are rounded to centimeters, so that they are the same on every machine.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import shapely

from robocov.environment import DiscStart, Environment, Point
from robocov.errors import MapError, NoLayoutError
from robocov.mapfile import from_json, to_json
from robocov_app.benchmark.maps.plan_shapes import FloorPlan

_MAX_ATTEMPTS = 400
"""Maximum number of plans that are sampled for a map."""
_MIN_PASSAGE_M = 0.6
"""Minimum width of the passages that connect the free space."""
_START_MARGIN_M = 0.01
"""Distance of the start disc from walls, so that the disc stays free when its center is rounded."""


def find_valid_map(
    kind: str,
    seed: int,
    *,
    kind_number: int,
    sample_plan: Callable[[np.random.Generator], FloorPlan],
    start_radius: float,
    min_blocked_fraction: float = 0.0,
) -> Environment:
    """Sample plans until one has enough obstacles, and a free space that is connected by wide passages.

    Parameters
    ----------
    kind : str
        Name of the kind of plan.
    seed : int
        Seed of the random numbers.
    kind_number : int
        Number of the kind, so that different kinds have different random numbers.
    sample_plan : callable
        Function that takes a random number generator and returns a random plan.
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
    NoLayoutError
        If no suitable plan is found with this seed.
    """
    for attempt in range(_MAX_ATTEMPTS):
        rng = np.random.default_rng([kind_number, seed, attempt])
        plan = sample_plan(rng)
        candidate = Environment(f"{kind} {seed}", plan.boundary, tuple(plan.obstacles))
        if not _is_connected(candidate) or not _has_enough_obstacles(candidate, min_blocked_fraction):
            continue
        start = _find_entry(candidate, plan.entrance, start_radius)
        if start is None:
            continue
        document = to_json(replace(candidate, starts={"entry": start}))
        # Reading the candidate as a map file checks it. If it is not valid, another plan is sampled.
        with suppress(MapError):
            return from_json(document, candidate.name)
    raise NoLayoutError(
        f"map {kind}-{seed}: none of {_MAX_ATTEMPTS} random plans is suitable. Try another seed."
    )


def _is_connected(candidate: Environment) -> bool:
    """Return whether the free space is connected, and stays so without its narrow passages."""
    wide_space = candidate.free.buffer(-_MIN_PASSAGE_M / 2.0, quad_segs=16)
    return len(candidate.free.geoms) == 1 and isinstance(wide_space, shapely.Polygon)


def _has_enough_obstacles(candidate: Environment, min_fraction: float) -> bool:
    """Return whether the summed area of the obstacles is at least a fraction of the area of the map.

    Overlaps of obstacles count twice, and areas outside the boundary count as well.
    """
    blocked_area = sum(obstacle.polygon.area for obstacle in candidate.obstacles)
    return bool(blocked_area >= min_fraction * candidate.area)


def _find_entry(candidate: Environment, entrance: Point | None, radius: float) -> DiscStart | None:
    """Return the free start disc nearest to the entrance, or None if there is no space for one."""
    centers = candidate.static.free.buffer(-radius - _START_MARGIN_M)
    if centers.is_empty:
        return None
    target = shapely.Point(entrance or candidate.region.bounds[:2])
    x, y = shapely.shortest_line(centers, target).coords[0]
    return DiscStart((round(x, 2), round(y, 2)), radius)
