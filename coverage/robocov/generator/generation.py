"""Generation of random maps.

The obstacles of a map are built by a function for its kind. A map whose blocked area, gaps or starts do not
meet the request is discarded, and the next attempt uses other random numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import shapely

from robocov.environment import (
    DiscStart,
    Environment,
    Obstacle,
    UniformStart,
    find_narrowest_gap,
)
from robocov.errors import (
    MapError,
    NoLayoutError,
    ParameterError,
    describe_unknown_name,
    require_number,
    require_whole_number,
)
from robocov.generator.blocks import build_town
from robocov.generator.caves import build_cave
from robocov.generator.mazes import build_maze
from robocov.generator.polygons import scatter_polygons
from robocov.generator.request import BLOCKED_FRACTION_TOLERANCE, MAX_SIDE_M, MIN_SIDE_M, MapRequest
from robocov.generator.rooms import build_building
from robocov.mapfile.rules import check_rules

ObstacleBuilder: TypeAlias = Callable[[MapRequest, DiscStart, np.random.Generator], list[Obstacle] | None]
"""Builds obstacles that do not overlap the start disc in the corner; returns None if an attempt fails."""

_MAX_ATTEMPTS = 40
"""Number of layouts that are tried before the parameters are considered impossible."""
_CORNER_DISC_SPACINGS = 0.25
"""Radius of the start disc in the corner, as a multiple of `MapRequest.mean_spacing`."""
_MIN_CORNER_DISC_M = 0.6
"""Minimum radius of this disc on maps that are large enough; some robots of the default size fit in it."""
_MAX_CORNER_DISC_SIDES = 0.1
"""Maximum radius of this disc, as a fraction of the shorter side of the map."""
_CORNER_DISC_MARGIN_SIDES = 0.02
"""Margin between this disc and the boundary, as a fraction of the shorter side."""
_DISC_SHRINKAGE = 0.9
"""Factor by which the radius of this disc is repeatedly multiplied until the disc fits between walls."""
_MIN_DISC_FRACTION = 0.4
"""Minimum radius of a start disc near walls, as a fraction of its radius without walls."""
_MAX_CENTER_OFFSET_SIDES = 0.3
"""Maximum offset of the center disc from the middle along x and y, as a fraction of the shorter side."""
_CENTER_CANDIDATES = 41
"""Number of points along x, and along y, that are compared as centers of this disc."""
_CENTER_DISC_FRACTION = 0.8
"""Maximum radius of this disc, as a fraction of the radius of the corner disc."""
_CENTER_OFFSET_WEIGHT = 0.2
"""Clearance, m, that outweighs one meter of distance from the middle."""
_SCORE_DECIMALS = 9
"""Decimal places to which scores are rounded, so that rounding errors do not decide between equal scores."""
_GAP_TOLERANCE_M = 1e-6
"""Maximum rounding error of a measured gap."""


@dataclass(frozen=True)
class MapKind:
    """A kind of generated maps.

    Attributes
    ----------
    build_obstacles : callable
        Builds the obstacles; see `ObstacleBuilder`.
    description : str
        Description of its maps on one line.
    obstacle_name : str
        Name of its obstacles in the plural, such as "rooms".
    default_obstacle_count : int
        Default number of obstacles.
    default_blocked_fraction : float
        Default fraction of the map's area that obstacles block.
    is_approximate : bool
        Whether the number of obstacles may differ from the requested number.
    """

    build_obstacles: ObstacleBuilder
    description: str
    obstacle_name: str
    default_obstacle_count: int
    default_blocked_fraction: float
    is_approximate: bool = False


GENERATORS: dict[str, MapKind] = {
    "polygons": MapKind(
        build_obstacles=scatter_polygons,
        description="scattered obstacles: convex polygons, L and U shapes",
        obstacle_name="obstacles",
        default_obstacle_count=6,
        default_blocked_fraction=0.2,
    ),
    "blocks": MapKind(
        build_obstacles=build_town,
        description="a town: blocks between streets",
        obstacle_name="blocks",
        default_obstacle_count=12,
        default_blocked_fraction=0.4,
    ),
    "rooms": MapKind(
        build_obstacles=build_building,
        description="a building: rooms with doors, and some furniture",
        obstacle_name="rooms",
        default_obstacle_count=6,
        default_blocked_fraction=0.12,
    ),
    "mazes": MapKind(
        build_obstacles=build_maze,
        description="a maze: corridors, some dead ends, some loops",
        obstacle_name="cells",
        default_obstacle_count=36,
        default_blocked_fraction=0.12,
        is_approximate=True,
    ),
    "caves": MapKind(
        build_obstacles=build_cave,
        description="a cave: chambers and tunnels with smooth walls, and pillars",
        obstacle_name="chambers",
        default_obstacle_count=12,
        default_blocked_fraction=0.4,
        is_approximate=True,
    ),
}
"""Kinds of generated maps by name, with their default numbers of obstacles and blocked fractions."""


def generate_map(  # noqa: PLR0913 - a keyword for each property of the map
    seed: int,
    *,
    kind: str = "polygons",
    obstacles: int | None = None,
    area: float | None = None,
    gap: float = 0.6,
    side: float = 10.0,
    width: float | None = None,
    height: float | None = None,
) -> Environment:
    """Generate a random map; the same seed and parameters give the same map.

    The free space of the map is connected and has no passage narrower than `gap`. The blocked fraction of the
    map's area differs from `area` by at most 0.005. The map has three starts: ``corner``, a disc in one of
    the corners, ``center``, a disc near the middle, and ``uniform``. Its attribute `extra` contains the
    parameters.

    Parameters
    ----------
    seed : int
        Seed of the random numbers, at least 0.
    kind : str
        Kind of the map: one of the names in `GENERATORS`.
    obstacles : int or None
        Number of obstacles, blocks or rooms; approximate number of cells of a maze or chambers of a cave. The
        default depends on the kind.
    area : float or None
        Fraction of the map's area that obstacles block. The default depends on the kind.
    gap : float, m
        Minimum width of a passage.
    side : float, m
        Side of a square map.
    width, height : float or None, m
        Sides of a rectangular map; `side` by default.

    Returns
    -------
    Environment
        The map, with its starts.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    NoLayoutError
        If no layout is found that meets all requirements. This is a subclass of ParameterError.

    See Also
    --------
    GENERATORS : The kinds of random maps, with their descriptions.
    save_map : Write a map to a file.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.generate_map(3, kind="polygons", obstacles=4)
    <Environment polygons 3, 10 x 10 m, 4 obstacles>
    """
    require_whole_number("seed", seed, 0)
    if not isinstance(kind, str) or kind not in GENERATORS:
        raise ParameterError(describe_unknown_name("kind of map", str(kind), GENERATORS))
    map_kind = GENERATORS[kind]
    side = require_number("side", side, MIN_SIDE_M, MAX_SIDE_M)
    obstacle_count = map_kind.default_obstacle_count if obstacles is None else obstacles
    blocked_fraction = map_kind.default_blocked_fraction if area is None else area
    width = side if width is None else width
    height = side if height is None else height
    request = MapRequest(
        obstacle_count=obstacle_count, blocked_fraction=blocked_fraction, gap=gap, width=width, height=height
    )
    for attempt in range(_MAX_ATTEMPTS):
        rng = np.random.default_rng([int(seed), attempt])
        corner_disc = _choose_corner_disc(request, rng)
        built_obstacles = map_kind.build_obstacles(request, corner_disc, rng)
        if built_obstacles is None:
            continue
        environment = _build_environment(int(seed), kind, request, built_obstacles)
        environment_with_starts = _add_starts(environment, request, corner_disc)
        if environment_with_starts is not None:
            return environment_with_starts
    raise NoLayoutError(
        f"area: found no {request.width:g} x {request.height:g} m layout of {request.obstacle_count} "
        f"{map_kind.obstacle_name} with a blocked fraction of {request.blocked_fraction:g} and gaps of "
        f"{request.gap:g} m. Try another area, a narrower gap or another number of {map_kind.obstacle_name}"
    )


def _choose_corner_disc(request: MapRequest, rng: np.random.Generator) -> DiscStart:
    """Choose the start disc in a random corner of the map."""
    is_right, is_top = rng.integers(0, 2, 2).tolist()
    side = min(request.width, request.height)
    radius = max(_CORNER_DISC_SPACINGS * request.mean_spacing, _MIN_CORNER_DISC_M)
    radius = request.round_down(min(_MAX_CORNER_DISC_SIDES * side, radius))
    offset = radius + _CORNER_DISC_MARGIN_SIDES * side
    x = request.width - offset if is_right else offset
    y = request.height - offset if is_top else offset
    return DiscStart((round(x, request.decimals), round(y, request.decimals)), radius)


def _build_environment(seed: int, kind: str, request: MapRequest, obstacles: list[Obstacle]) -> Environment:
    """Build a map without starts."""
    width = float(request.width)
    height = float(request.height)
    map_kind = GENERATORS[kind]
    qualifier = "about " if map_kind.is_approximate else ""
    obstacle_text = f"{qualifier}{request.obstacle_count} {map_kind.obstacle_name}"
    return Environment(
        name=f"{kind} {seed}",
        boundary=((0.0, 0.0), (width, 0.0), (width, height), (0.0, height)),
        obstacles=tuple(obstacles),
        description=(
            f"Generated with seed {seed}: {obstacle_text}, "
            f"{request.blocked_fraction:.3g} of the area blocked, "
            f"every passage at least {request.gap:g} m wide."
        ),
        extra={
            "generator": {
                "kind": kind,
                "seed": seed,
                "obstacles": int(request.obstacle_count),
                "area": float(request.blocked_fraction),
                "gap_m": float(request.gap),
                "width_m": width,
                "height_m": height,
            }
        },
    )


def _add_starts(environment: Environment, request: MapRequest, corner_disc: DiscStart) -> Environment | None:
    """Return a map with its starts; None if the map is not valid or does not fulfill the request."""
    try:
        if not _fulfills_request(environment, request):
            return None
        starts = _choose_starts(environment, request, corner_disc)
        if starts is None:
            return None
        environment = replace(environment, starts=starts)
        check_rules(environment, environment.name)
    except (MapError, shapely.GEOSException):
        # Obstacles overlap, or a start has too little space.
        return None
    return environment


def _choose_starts(
    environment: Environment, request: MapRequest, corner_disc: DiscStart
) -> dict[str, DiscStart | UniformStart] | None:
    """Return the starts of a map by name; None if there is not enough space for the discs."""
    start_disc = _shrink_corner_disc(environment, request, corner_disc)
    center_disc = _choose_center_disc(environment, request, corner_disc)
    if start_disc is None or center_disc is None:
        return None
    return {"corner": start_disc, "center": center_disc, "uniform": UniformStart()}


def _shrink_corner_disc(
    environment: Environment, request: MapRequest, corner_disc: DiscStart
) -> DiscStart | None:
    """Shrink the corner disc until it fits between walls; return None if it becomes too small.

    A smaller disc lies nearer to the corner: its distance from the sides of the map does not change.
    """
    center = np.array(corner_disc.center)
    # Signs of x and y in the direction of the corner.
    outward_signs = np.sign(center - request.size / 2.0)
    radius = corner_disc.radius
    while radius >= _MIN_DISC_FRACTION * corner_disc.radius:
        x, y = request.round_points(center + outward_signs * (corner_disc.radius - radius)).tolist()
        if environment.free.contains(shapely.Point(x, y).buffer(radius)):
            return DiscStart((x, y), radius)
        radius = request.round_down(_DISC_SHRINKAGE * radius)
    return None


def _choose_center_disc(
    environment: Environment, request: MapRequest, corner_disc: DiscStart
) -> DiscStart | None:
    """Choose a start disc near the middle of the map, with as much clearance as possible.

    The center of the disc is the point with the best score in a grid of points around the middle. The score
    of a point is its clearance, but at most the maximum radius of the disc, minus a fraction of its distance
    from the middle. Return None if no point of the grid is free.
    """
    max_offset = _MAX_CENTER_OFFSET_SIDES * float(request.size.min())
    axis_offsets = np.linspace(-max_offset, max_offset, _CENTER_CANDIDATES)
    offsets = np.stack(np.meshgrid(axis_offsets, axis_offsets), axis=-1).reshape(-1, 2)
    points = request.round_points(offsets + request.size / 2.0)
    is_free = shapely.contains_xy(environment.free, points[:, 0], points[:, 1])
    if not is_free.any():
        return None
    points = points[is_free]
    offsets = offsets[is_free]
    clearances = shapely.distance(environment.free.boundary, shapely.points(points))
    max_radius = _CENTER_DISC_FRACTION * corner_disc.radius
    distances = np.hypot(offsets[:, 0], offsets[:, 1])
    scores = np.minimum(clearances, max_radius) - _CENTER_OFFSET_WEIGHT * distances
    best = int(np.round(scores, _SCORE_DECIMALS).argmax())
    # If there is little clearance, the disc overlaps obstacles. Robots then start in the rest of the disc.
    radius = max(float(clearances[best]), _MIN_DISC_FRACTION * max_radius)
    center = (float(points[best, 0]), float(points[best, 1]))
    return DiscStart(center, request.round_down(min(radius, max_radius)))


def _fulfills_request(environment: Environment, request: MapRequest) -> bool:
    """Return whether a map has the requested blocked fraction and gaps, and connected free space."""
    free = environment.free
    blocked_fraction = 1.0 - environment.free_area / environment.area
    if abs(blocked_fraction - request.blocked_fraction) > BLOCKED_FRACTION_TOLERANCE or len(free.geoms) != 1:
        return False
    narrowest = find_narrowest_gap(free)
    if narrowest is not None and narrowest.width < request.gap - _GAP_TOLERANCE_M:
        return False
    # A disc as wide as the gap must be able to move between all positions where it fits: the area of its
    # possible centers, which is the free space eroded by its radius, must be connected.
    center_area = free.buffer(-request.gap / 2.0 + _GAP_TOLERANCE_M, quad_segs=16)
    return isinstance(center_area, shapely.Polygon)
