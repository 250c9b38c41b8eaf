"""Seeded random maps of several kinds, each with what was asked for: obstacles, blocked area, gaps."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral
from typing import TypeAlias

import numpy as np
import shapely

from robocov.environment import DiscStart, Environment, Obstacle, StartSpec, UniformStart, find_narrowest_gap
from robocov.errors import MapError, ParameterError, describe_unknown_name, is_number, quote, require_number
from robocov.generator.blocks import city
from robocov.generator.caves import cave
from robocov.generator.mazes import maze
from robocov.generator.polygons import scattered
from robocov.generator.request import AREA_TOLERANCE, SIDES, Request
from robocov.generator.rooms import building
from robocov.mapfile.check import check_rules

Layout: TypeAlias = Callable[[Request, DiscStart, np.random.Generator], list[Obstacle] | None]
"""Returns obstacles that leave the disc of the start in the corner free; None where a draw leads nowhere."""

_ATTEMPTS = 40  # layouts that are drawn before the parameters count as impossible
_TEAM = 0.6  # radius in metres of a start in which some robots of the usual size find room
# radius of a start, in sides of a square per obstacle, and at most, in shorter sides of the map
_DISC, _LARGEST_DISC = 0.25, 0.1
_LEAST = 0.4  # part of that radius that is left at least where walls are near
_MARGIN, _OFF = 0.02, 0.3  # of the discs from the boundary, and from the middle at most, in shorter sides


@dataclass(frozen=True)
class Kind:
    """A kind of generated maps, with its usual number of obstacles, and of what, and its usual area."""

    layout: Layout
    description: str
    counted: str
    obstacles: int
    area: float
    about: bool = False
    """Whether a map has about as many obstacles as are asked for, not exactly."""


GENERATORS: dict[str, Kind] = {
    "polygons": Kind(scattered, "scattered obstacles: convex polygons, L and U shapes", "obstacles", 6, 0.2),
    "blocks": Kind(city, "a town: blocks between streets", "blocks", 12, 0.4),
    "rooms": Kind(building, "a building: rooms with doors, and some furniture", "rooms", 6, 0.12),
    "mazes": Kind(maze, "a maze: corridors, some dead ends, some ways round", "cells", 36, 0.12, True),
    "caves": Kind(
        cave, "a cave: chambers and tunnels with smooth walls, and pillars", "chambers", 12, 0.4, True
    ),
}
"""The kinds of maps by their names."""


def generate_map(
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
    """Return a random map; the same seed and parameters give the same one.

    Its free space is one piece without a passage narrower than `gap`, and the blocked part of its area is
    `area` to within `AREA_TOLERANCE`. The starts are ``corner``, a disc in one of the corners, ``centre``,
    one near the middle, and ``uniform``. What was asked for stands in the map's `extra`.

    Parameters
    ----------
    kind : str
        One of `GENERATORS`.
    obstacles : int
        How many obstacles, blocks or rooms; of mazes about how many cells, of caves chambers.
    area : float
        Blocked area as a part of the map's; this and their number are by default what suits the kind.
    gap, side, width, height : float, m
        A map is square, or a rectangle where width and height are given.

    Raises ParameterError when a parameter is out of range, or no layout is found that fulfils all of them.
    """
    if not is_number(seed, Integral) or seed < 0:
        raise ParameterError(f"seed: {quote(seed)}, but a whole number of at least 0 was wanted")
    if not isinstance(kind, str) or kind not in GENERATORS:
        raise ParameterError(describe_unknown_name("kind of map", str(kind), GENERATORS))
    of_kind = GENERATORS[kind]
    side = require_number("side", side, *SIDES)
    request = Request(
        of_kind.obstacles if obstacles is None else obstacles,
        of_kind.area if area is None else area,
        gap,
        side if width is None else width,
        side if height is None else height,
    )
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([int(seed), attempt])
        corner = _corner(request, rng)
        layout = of_kind.layout(request, corner, rng)
        environment = None if layout is None else _environment(int(seed), kind, request, layout, corner)
        if environment is not None:
            return environment
    raise ParameterError(
        f"area: {request.area:g}, but no layout of {request.obstacles} {of_kind.counted} was found that "
        f"blocks it on {request.width:g} x {request.height:g} m with gaps of {request.gap:g} m; "
        f"another area, a narrower gap or another number was wanted"
    )


def _corner(request: Request, rng: np.random.Generator) -> DiscStart:
    """Return a disc in one of the corners."""
    right, top = rng.integers(0, 2, 2).tolist()
    side = min(request.width, request.height)
    radius = request.floor(min(_LARGEST_DISC * side, max(_DISC * request.unit, _TEAM)))
    off = radius + _MARGIN * side
    x, y = (request.width - off if right else off), (request.height - off if top else off)
    return DiscStart((round(x, request.digits), round(y, request.digits)), radius)


def _environment(
    seed: int, kind: str, request: Request, layout: list[Obstacle], corner: DiscStart
) -> Environment | None:
    """Return the map with its starts; None if it is not valid, or not as it was asked for."""
    width, height, of_kind = float(request.width), float(request.height), GENERATORS[kind]
    words = {"kind": kind, "seed": seed, "obstacles": int(request.obstacles), "area": float(request.area)}
    words |= {"gap_m": float(request.gap), "width_m": width, "height_m": height}
    starts: dict[str, StartSpec] = {}
    environment = Environment(
        f"{kind} {seed}",
        ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height)),
        tuple(layout),
        starts,
        f"Generated with seed {seed}: {'about ' * of_kind.about}{request.obstacles} {of_kind.counted}, "
        f"{request.area:.3g} of the area blocked, every passage at least {request.gap:g} m wide.",
        {"generator": words},
    )
    try:
        if _fulfils(environment, request):
            within, centre = _within(environment, request, corner), _centre(environment, request, corner)
            if within is not None and centre is not None:
                # only now: they depend on the free space, which is to be derived once
                starts |= {"corner": within, "centre": centre, "uniform": UniformStart()}
                check_rules(environment, environment.name)
                return environment
    except (MapError, shapely.GEOSException):
        pass
    return None


def _within(environment: Environment, request: Request, corner: DiscStart) -> DiscStart | None:
    """Return the disc, smaller and nearer to its corner where walls are in its way; None for none."""
    middle, radius = np.array(corner.center), corner.radius
    away = np.sign(middle - request.size / 2.0)
    while radius >= _LEAST * corner.radius:
        x, y = request.rounded(middle + away * (corner.radius - radius)).tolist()
        if environment.free.contains(shapely.Point(x, y).buffer(radius)):
            return DiscStart((x, y), radius)
        radius = request.floor(0.9 * radius)
    return None


def _centre(environment: Environment, request: Request, corner: DiscStart) -> DiscStart | None:
    """Return a disc near the middle, at most about as large, with as much room as there is; None for none."""
    reach = _OFF * float(request.size.min())
    offset = np.stack(np.meshgrid(*[np.linspace(-reach, reach, 41)] * 2), axis=-1).reshape(-1, 2)
    place = request.rounded(offset + request.size / 2.0)
    inside = shapely.contains_xy(environment.free, place[:, 0], place[:, 1])
    if not inside.any():
        return None
    place, offset = place[inside], offset[inside]
    room = shapely.distance(environment.free.boundary, shapely.points(place))
    largest = 0.8 * corner.radius
    score = np.minimum(room, largest) - 0.2 * np.hypot(offset[:, 0], offset[:, 1])
    best = int(np.round(score, 9).argmax())
    radius = request.floor(min(max(float(room[best]), _LEAST * largest), largest))
    return DiscStart((float(place[best, 0]), float(place[best, 1])), radius)


def _fulfils(environment: Environment, request: Request) -> bool:
    free, share = environment.free, 1.0 - environment.free_area / environment.area
    if abs(share - request.area) > AREA_TOLERANCE or len(free.geoms) != 1:
        return False
    narrowest = find_narrowest_gap(free)
    wide = narrowest is None or narrowest.width >= request.gap - 1e-6
    # where a disc as wide as the gap may be must hang together
    return wide and isinstance(free.buffer(-request.gap / 2.0 + 1e-6, quad_segs=16), shapely.Polygon)
