"""Maps of the benchmark that are drawn after real kinds: homes, offices, yards, plants, traffic.

Lengths are in metres, and coordinates whole centimetres, which are the same on every processor.
"""

import itertools
from collections.abc import Callable
from contextlib import suppress
from typing import TypeAlias

import numpy as np
import shapely

from robocov import environment as world
from robocov.arrays import Array
from robocov.environment import CircleObstacle, Environment, Obstacle, PolygonObstacle, Ring, WallObstacle
from robocov.errors import MapError, ParameterError
from robocov.mapfile import from_json, to_json

Plan: TypeAlias = tuple[Ring, list[Obstacle]]  # the boundary, and what stands in it
_ORDER = ("homes", "offices", "plants", "traffic", "yards")  # new kinds come last: seeds depend on it
_ATTEMPTS = 400  # plans that are drawn before a seed counts as impossible
_PASSAGE = 0.6  # least width of a passage
_WALL = 0.12  # thickness of inner walls
_START = 0.6  # radius of the start
_LEAST = 0.04  # part of the area that is blocked at least


def drawn_map(kind: str, seed: int) -> Environment:
    """Return the first plan of a kind and seed in one piece without narrow gaps; ParameterError for none."""
    for attempt in range(_ATTEMPTS):
        boundary, obstacles = KINDS[kind](np.random.default_rng([_ORDER.index(kind), seed, attempt]))
        plan = Environment(f"{kind} {seed}", boundary, tuple(obstacles))
        room = plan.free.buffer(-_PASSAGE / 2.0, quad_segs=16)
        blocked = sum(each.polygon.area for each in plan.obstacles)
        whole = len(plan.free.geoms) == 1 and isinstance(room, shapely.Polygon)
        if not whole or blocked < _LEAST * plan.area:  # no way everywhere, or too little that is in the way
            continue
        start = plan.static.free.buffer(-_START - 0.01)
        if start.is_empty:
            continue
        lower_left = shapely.Point(plan.region.bounds[:2])
        at = shapely.shortest_line(start, lower_left).coords[0]
        disc = world.DiscStart((round(at[0], 2), round(at[1], 2)), _START)
        document = to_json(Environment(plan.name, plan.boundary, plan.obstacles, {"entry": disc}))
        with suppress(MapError):
            return from_json(document, plan.name)
    none = f"no plan of {_ATTEMPTS} is in one piece"
    raise ParameterError(f"map {kind}-{seed}: {none}; expected another seed")


def _rounded(points: Array | list[tuple[float, float]]) -> Ring:
    return tuple((round(float(x), 2), round(float(y), 2)) for x, y in points)


def _box(left: float, bottom: float, right: float, top: float) -> Ring:
    return _rounded([(left, bottom), (right, bottom), (right, top), (left, top)])


def _block(x: float, y: float, width: float, height: float) -> Obstacle:
    return PolygonObstacle(_box(x, y, x + width, y + height))


def _turned(middle: Array, width: float, height: float, angle: float) -> Obstacle:
    corners = np.array([(-width, -height), (width, -height), (width, height), (-width, height)]) / 2.0
    along = np.array([np.cos(angle), np.sin(angle)])
    return PolygonObstacle(_rounded(middle + corners @ np.array([along, [-along[1], along[0]]])))


def _circle(middle: Array, radius: float) -> Obstacle:
    return CircleObstacle(_rounded(middle[None])[0], round(radius, 2))


def _doorway(across: bool, at: float, begin: float, end: float, door: float, width: float) -> list[Obstacle]:
    """Return the two pieces of a wall beside its door, upright if `across`; short pieces are left out."""
    pieces = [(begin, door - width / 2.0), (door + width / 2.0, end)]
    ends = [[(at, a), (at, b)] if across else [(a, at), (b, at)] for a, b in pieces if b - a > 0.15]
    return [WallObstacle(_rounded(each), _WALL) for each in ends]


def _home(rng: np.random.Generator) -> Plan:
    """Draw a flat: a rectangle that is divided again and again, a door in each wall, some furniture."""
    width, height = rng.uniform(10.0, 14.0), rng.uniform(8.0, 11.0)
    walls: list[Obstacle] = []
    furniture: list[Obstacle] = []

    def divided(left: float, bottom: float, right: float, top: float) -> None:
        across = right - left > top - bottom
        low, high = (left, right) if across else (bottom, top)
        if high - low < rng.uniform(4.6, 6.4):
            wide, deep = rng.uniform(0.5, 1.6), rng.uniform(0.4, 0.9)
            if right - left > wide + 2.2 and top - bottom > deep + 2.2:
                x = left + 0.06 if rng.random() < 0.5 else right - 0.06 - wide
                y = bottom + 0.06 if rng.random() < 0.5 else top - 0.06 - deep
                furniture.append(_block(x, y, wide, deep))
            return
        at = low + (high - low) * rng.uniform(0.38, 0.62)
        begin, end = (bottom, top) if across else (left, right)
        door = rng.uniform(begin + 0.8, end - 0.8)
        walls.extend(_doorway(across, at, begin, end, door, rng.uniform(0.8, 1.1)))
        divided(left, bottom, *((at, top) if across else (right, at)))
        divided(*((at, bottom) if across else (left, at)), right, top)

    divided(0.0, 0.0, width, height)
    return _box(0.0, 0.0, width, height), [*walls, *furniture]


def _office(rng: np.random.Generator) -> Plan:
    """Draw an office floor: cells on one side of a corridor, an open room with desks on the other."""
    width, height = rng.uniform(16.0, 20.0), rng.uniform(10.0, 12.0)
    low = height * rng.uniform(0.48, 0.56)
    high = low + rng.uniform(1.4, 1.9)
    obstacles: list[Obstacle] = []
    cuts = np.linspace(0.0, width, int(rng.integers(5, 8)))
    cuts[1:-1] += rng.uniform(-0.4, 0.4, len(cuts) - 2)
    for left, right in itertools.pairwise(cuts.tolist()):
        obstacles += _doorway(False, high, left, right, rng.uniform(left + 0.7, right - 0.7), 0.9)
        if right < width:
            obstacles.append(WallObstacle(_rounded([(right, high), (right, height)]), _WALL))
        if rng.random() < 0.6:
            obstacles.append(PolygonObstacle(_box(left + 0.06, height - 0.7, left + 1.2, height)))
    ways = width * rng.uniform(0.15, 0.35), width * rng.uniform(0.65, 0.85)
    obstacles += _doorway(False, low, 0.0, width / 2.0, ways[0], 1.2)
    obstacles += _doorway(False, low, width / 2.0, width, ways[1], 1.2)
    for x in np.arange(2.2, width - 2.5, rng.uniform(2.9, 3.6)):
        for y in (1.3, low - 1.9):
            if rng.random() < 0.85:
                obstacles.append(_block(x, y, 1.6, 0.8))
    return _box(0.0, 0.0, width, height), obstacles


def _spaced(shapes: list[Obstacle], gap: float) -> list[Obstacle]:
    kept: list[Obstacle] = []
    for shape in shapes:
        if all(shape.polygon.distance(other.polygon) >= gap for other in kept):
            kept.append(shape)
    return kept


def _yard(rng: np.random.Generator) -> Plan:
    """Draw a park: a convex piece of land with houses, a pond, hedges and trees."""
    angle = np.sort((np.arange(7) + rng.uniform(-0.25, 0.25, 7)) * 2.0 * np.pi / 7.0)
    corners = np.column_stack([10.0 + 9.0 * np.cos(angle), 8.0 + 7.5 * np.sin(angle)])
    hull = shapely.orient_polygons(shapely.convex_hull(shapely.MultiPoint(corners)))
    boundary = _rounded(np.asarray(hull.exterior.coords)[:-1])

    def place() -> Array:
        return np.array([rng.uniform(3.0, 17.0), rng.uniform(2.5, 13.5)])

    def house() -> Obstacle:
        at, width, depth = place(), rng.uniform(2.0, 3.6), rng.uniform(1.6, 2.6)
        return _turned(at, width, depth, rng.uniform(0.0, np.pi))

    def pond() -> Obstacle:
        around = np.linspace(0.0, 2.0 * np.pi, 14, endpoint=False)
        radius = rng.uniform(0.9, 1.5) * (1.0 + 0.2 * np.sin(2.0 * around + rng.uniform(0.0, 6.0)))
        shore = radius[:, None] * np.column_stack([1.4 * np.cos(around), np.sin(around)])
        return PolygonObstacle(_rounded(place() + shore))

    def hedge() -> Obstacle:
        begin, angle = place(), rng.uniform(0.0, np.pi)
        along, across = np.array([(np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))])
        corner = np.array([0.0 * along, along, along + across])
        return WallObstacle(_rounded(begin + rng.uniform(1.4, 2.4) * corner), 0.3)

    def tree() -> Obstacle:
        return _circle(place(), rng.uniform(0.2, 0.45))

    shapes = [draw() for draw in (*5 * [house], pond, *6 * [hedge], *14 * [tree])]
    land = shapely.Polygon(boundary)
    inside = [each for each in shapes if land.contains(each.polygon)]
    return boundary, _spaced([each for each in inside if land.exterior.distance(each.polygon) > 0.7], 0.7)


def _plant(rng: np.random.Generator) -> Plan:
    """Draw a factory hall: rows of racks, machines, a partition with a gate, columns."""
    width, height = rng.uniform(15.0, 19.0), rng.uniform(10.0, 13.0)
    split = width * rng.uniform(0.48, 0.58)
    gate = rng.uniform(2.0, height - 2.0)
    obstacles = _doorway(True, split, 0.0, height, gate, rng.uniform(1.4, 2.2))
    for y in np.arange(2.0, height - 1.4, rng.uniform(1.9, 2.4)):
        left = rng.uniform(1.2, 2.2)
        obstacles.append(PolygonObstacle(_box(left, y, split - rng.uniform(1.2, 1.8), y + 0.7)))
    shapes: list[Obstacle] = []
    for _ in range(30):
        at = np.array([rng.uniform(split + 1.6, width - 1.4), rng.uniform(1.4, height - 1.4)])
        if len(shapes) % 3 == 2:
            shapes.append(_circle(at, rng.uniform(0.2, 0.7)))
        else:
            wide, deep = rng.uniform(0.8, 2.0), rng.uniform(0.6, 1.2)
            shapes.append(_turned(at, wide, deep, rng.choice([0.0, 0.6, 1.2])))
    return _box(0.0, 0.0, width, height), [*obstacles, *_spaced(shapes, 0.9)[:7]]


def _traffic(rng: np.random.Generator) -> Plan:
    """Draw a hall with shelves, through whose aisles two or three vehicles go to and fro."""
    width, height = 16.0, 11.0
    obstacles: list[Obstacle] = []
    left, right = rng.uniform(4.2, 5.0), width - rng.uniform(2.2, 3.0)
    for y in (3.0, 7.2):
        middle = rng.uniform(8.2, 9.8)
        for begin, end in ((left, middle - 0.8), (middle + 0.8, right)):
            obstacles.append(PolygonObstacle(_box(begin, y, end, y + rng.uniform(0.8, 1.3))))
    for y in (5.7, 9.6, 1.5)[: int(rng.integers(2, 4))]:
        ends = _rounded([(rng.uniform(4.0, 5.0), y), (rng.uniform(11.5, 14.0), y)])
        path = world.ObstaclePath(ends, round(rng.uniform(0.2, 0.4), 2), "back-and-forth")
        obstacles.append(CircleObstacle(ends[0], round(rng.uniform(0.3, 0.45), 2), path=path))
    return _box(0.0, 0.0, width, height), obstacles


KINDS: dict[str, Callable[[np.random.Generator], Plan]] = {
    "homes": _home, "offices": _office, "yards": _yard, "plants": _plant, "traffic": _traffic
}  # fmt: skip
"""The kinds of drawn maps by their names."""
