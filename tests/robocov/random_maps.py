"""Random maps of many kinds, for tests of properties that hold on any map."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle

SIDE = 8.0
SQUARE = ((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE))
BAYS = ((0, 0), (8, 0), (8, 4), (4, 4), (4, 6), (8, 6), (8, 8), (0, 8), (2, 4))


def build_box(x0, y0, x1, y1):
    return PolygonObstacle(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


def build_polygons(rng, count):
    """Return quadrilaterals in any orientation that may overlap."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, (count, 4)), axis=1)
    radius = rng.uniform(0.2, 1.0, (count, 1)) * np.sqrt(10.0 / count)
    offsets = (radius * np.exp(1j * angle)).view(float).reshape(count, 4, 2)
    rings = rng.uniform(0.0, SIDE, (count, 1, 2)) + offsets
    has_area = shapely.area(shapely.polygons(rings)) > 0.01
    return [PolygonObstacle(tuple(map(tuple, ring))) for ring in rings[has_area].tolist()]


def build_blocks(rng, count):
    """Return boxes on a coarse grid that share lines, edges and corners."""
    low = rng.integers(0, 16, (count, 2)) / 2
    high = low + rng.integers(1, 4, (count, 2)) / 2
    return [build_box(*pair) for pair in np.hstack([low, high]).tolist()]


def build_maze(rng, count):
    """Return thin walls between the rooms of a perfect maze."""
    side = max(2, int(np.sqrt(count)))
    step = SIDE / side
    width = 0.02
    linked = set()
    stack = [(0, 0)]
    visited = {(0, 0)}
    while stack:
        i, j = stack[-1]
        neighbors = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        rooms = [room for room in neighbors if room not in visited and min(room) >= 0 and max(room) < side]
        if not rooms:
            stack.pop()
            continue
        room = rooms[rng.integers(len(rooms))]
        linked.add(frozenset(((i, j), room)))
        visited.add(room)
        stack.append(room)
    walls = []
    for i in range(side):
        for j in range(side):
            if i + 1 < side and frozenset(((i, j), (i + 1, j))) not in linked:
                walls.append(
                    WallObstacle((((i + 1) * step, j * step), ((i + 1) * step, (j + 1) * step)), width)
                )
            if j + 1 < side and frozenset(((i, j), (i, j + 1))) not in linked:
                walls.append(
                    WallObstacle(((i * step, (j + 1) * step), ((i + 1) * step, (j + 1) * step)), width)
                )
    return walls


def build_comb(rng, count):
    """Return long teeth with narrow slits between them."""
    count = min(count, 12)
    edges = np.linspace(0.5, 7.5, count + 1)
    slit = rng.choice([1e-5, 1e-3, 0.1])
    teeth = [build_box(a, 1.0, b - slit, 7.0) for a, b in itertools.pairwise(edges)]
    return [*teeth, build_box(0.5, 6.5, 7.5 - slit, 7.0)][: count + int(rng.integers(2))]


def build_needles(rng, count):
    """Return thin triangles."""
    tip = rng.uniform(0.0, SIDE, (count, 2))
    length = rng.normal(size=(count, 2))
    width = length[:, ::-1] * [-1, 1] * 0.01
    rings = np.stack([tip, tip + length, tip + length + width], axis=1)
    has_area = np.abs(shapely.area(shapely.polygons(rings))) > 1e-4
    return [PolygonObstacle(tuple(map(tuple, ring))) for ring in rings[has_area].tolist()]


def build_circles(rng, count):
    count = max(count // 8, 1)
    x, y = rng.uniform(0.0, SIDE, (2, count))
    radius = rng.uniform(0.05, 0.8, count)
    return [CircleObstacle((x[k], y[k]), radius[k]) for k in range(count)]


def build_rooms(rng, count):
    """Return walls across the map with and without doors, and polygons between them."""
    walls = [build_box(x, 0.0, x + 0.2, SIDE - rng.choice([0.0, 0.6])) for x in (2.0, 4.0, 6.0)]
    return [*walls, *build_polygons(rng, max(count - 3, 1))]


KINDS = {
    "polygons": build_polygons,
    "blocks": build_blocks,
    "maze": build_maze,
    "comb": build_comb,
    "needles": build_needles,
    "circles": build_circles,
    "rooms": build_rooms,
}


def build_random_map(kind, count, seed, scale=1.0, shift=(0.0, 0.0)):
    """Return a map of a kind with about `count` obstacles, or None if there is little free space."""
    rng = np.random.default_rng(seed)
    boundary = SQUARE if seed % 3 else BAYS
    plain = Environment("drawn", boundary, tuple(KINDS[kind](rng, count)))
    if plain.free_area < 4.0:
        return None
    if scale == 1.0 and shift == (0.0, 0.0):
        return plain

    def transform(points):
        return tuple((x * scale + shift[0], y * scale + shift[1]) for x, y in points)

    obstacles = []
    for obstacle in plain.obstacles:
        if isinstance(obstacle, PolygonObstacle):
            obstacles.append(PolygonObstacle(transform(obstacle.vertices)))
        elif isinstance(obstacle, WallObstacle):
            obstacles.append(WallObstacle(transform(obstacle.points), obstacle.width * scale))
        else:
            obstacles.append(CircleObstacle(transform([obstacle.center])[0], obstacle.radius * scale))
    return Environment("drawn", transform(boundary), tuple(obstacles))


def draw_positions(environment, count, seed):
    """Return free positions, (n, 2) m: anywhere, at vertices, on walls, in line with them, or coincident."""
    rng = np.random.default_rng(seed)
    low_x, low_y, high_x, high_y = environment.region.bounds
    size = max(high_x - low_x, high_y - low_y)
    vertices = shapely.get_coordinates(environment.free)
    first, second = rng.integers(0, len(vertices), (2, 8 * count))
    fraction = rng.random((8 * count, 1))
    # Successive vertices are mostly the ends of a wall.
    start = first % (len(vertices) - 1)
    on_walls = vertices[:-1][start] * fraction + vertices[1:][start] * (1 - fraction)
    kinds = [
        rng.uniform((low_x, low_y), (high_x, high_y), (8 * count, 2)),
        vertices[first],
        on_walls,
        np.column_stack([vertices[first, 0], vertices[second, 1]]),
        (low_x, low_y) + (rng.integers(0, 32, (8 * count, 2)) + 0.5) / 32 * size,
    ]
    points = np.choose(rng.integers(0, len(kinds), (8 * count, 1)), kinds)
    shapely.prepare(environment.free)
    free_points = points[shapely.intersects_xy(environment.free, *points.T)]
    if len(free_points) == 0:
        free_points = vertices[:1]
    return free_points[rng.integers(0, min(len(free_points), 4 * count), count)]
