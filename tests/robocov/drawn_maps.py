"""Maps of many kinds, made from seeds, for tests of all that must hold on any map."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle

SIDE = 8.0
SQUARE = ((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE))
BAYS = ((0, 0), (8, 0), (8, 4), (4, 4), (4, 6), (8, 6), (8, 8), (0, 8), (2, 4))


def box(x0, y0, x1, y1):
    return PolygonObstacle(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


def polygons(rng, count):
    """Slanted quadrilaterals that may overlap."""
    turn = np.sort(rng.uniform(0.0, 2.0 * np.pi, (count, 4)), axis=1)
    radius = rng.uniform(0.2, 1.0, (count, 1)) * np.sqrt(10.0 / count)
    rings = rng.uniform(0.0, SIDE, (count, 1, 2)) + (radius * np.exp(1j * turn)).view(float).reshape(
        count, 4, 2
    )
    good = shapely.area(shapely.polygons(rings)) > 0.01
    return [PolygonObstacle(tuple(map(tuple, ring))) for ring in rings[good].tolist()]


def blocks(rng, count):
    """Boxes on a coarse grid: many lines in common, shared edges, touching corners."""
    low = rng.integers(0, 16, (count, 2)) / 2
    high = low + rng.integers(1, 4, (count, 2)) / 2
    return [box(*pair) for pair in np.hstack([low, high]).tolist()]


def maze(rng, count):
    """Thin walls between the rooms of a perfect maze."""
    side = max(2, int(np.sqrt(count)))
    step, width = SIDE / side, 0.02
    linked = set()
    stack, seen = [(0, 0)], {(0, 0)}
    while stack:
        i, j = stack[-1]
        ways = [(i + a, j + b) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        ways = [way for way in ways if way not in seen and min(way) >= 0 and max(way) < side]
        if not ways:
            stack.pop()
            continue
        way = ways[rng.integers(len(ways))]
        linked.add(frozenset(((i, j), way)))
        seen.add(way)
        stack.append(way)
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


def comb(rng, count):
    """Long teeth with narrow slits between them."""
    count = min(count, 12)
    edges = np.linspace(0.5, 7.5, count + 1)
    slit = rng.choice([1e-5, 1e-3, 0.1])
    teeth = [box(a, 1.0, b - slit, 7.0) for a, b in itertools.pairwise(edges)]
    return [*teeth, box(0.5, 6.5, 7.5 - slit, 7.0)][: count + int(rng.integers(2))]


def needles(rng, count):
    """Thin triangles."""
    tip = rng.uniform(0.0, SIDE, (count, 2))
    along = rng.normal(size=(count, 2))
    across = along[:, ::-1] * [-1, 1] * 0.01
    rings = np.stack([tip, tip + along, tip + along + across], axis=1)
    good = np.abs(shapely.area(shapely.polygons(rings))) > 1e-4
    return [PolygonObstacle(tuple(map(tuple, ring))) for ring in rings[good].tolist()]


def circles(rng, count):
    count = max(count // 8, 1)
    return [
        CircleObstacle((x, y), radius)
        for x, y, radius in zip(
            *rng.uniform(0.0, SIDE, (2, count)), rng.uniform(0.05, 0.8, count), strict=True
        )
    ]


def rooms(rng, count):
    """Walls across the whole map, some sealed, some with a door."""
    walls = [box(x, 0.0, x + 0.2, SIDE - rng.choice([0.0, 0.6])) for x in (2.0, 4.0, 6.0)]
    return [*walls, *polygons(rng, max(count - 3, 1))]


KINDS = {maker.__name__: maker for maker in (polygons, blocks, maze, comb, needles, circles, rooms)}


def drawn_map(kind, count, seed, scale=1.0, shift=(0.0, 0.0)):
    """Return a map of a kind with about so many obstacles, None where hardly anything is free."""
    rng = np.random.default_rng(seed)
    boundary = SQUARE if seed % 3 else BAYS
    plain = Environment("drawn", boundary, tuple(KINDS[kind](rng, count)))
    if plain.free_area < 4.0:
        return None
    if scale == 1.0 and shift == (0.0, 0.0):
        return plain

    def moved(points):
        return tuple((x * scale + shift[0], y * scale + shift[1]) for x, y in points)

    obstacles = []
    for obstacle in plain.obstacles:
        if isinstance(obstacle, PolygonObstacle):
            obstacles.append(PolygonObstacle(moved(obstacle.vertices)))
        elif isinstance(obstacle, WallObstacle):
            obstacles.append(WallObstacle(moved(obstacle.points), obstacle.width * scale))
        else:
            obstacles.append(CircleObstacle(moved([obstacle.center])[0], obstacle.radius * scale))
    return Environment("drawn", moved(boundary), tuple(obstacles))


def drawn_places(environment, count, seed):
    """Return (n, 2) m free places: anywhere, at vertices, on walls, in line with them, several in one."""
    rng = np.random.default_rng(seed)
    low_x, low_y, high_x, high_y = environment.region.bounds
    size = max(high_x - low_x, high_y - low_y)
    vertices = shapely.get_coordinates(environment.free)
    here, there = rng.integers(0, len(vertices), (2, 8 * count))
    part = rng.random((8 * count, 1))
    kinds = [
        rng.uniform((low_x, low_y), (high_x, high_y), (8 * count, 2)),
        vertices[here],
        # on a wall, where the two follow each other
        vertices[:-1][here % (len(vertices) - 1)] * part
        + vertices[1:][here % (len(vertices) - 1)] * (1 - part),
        np.column_stack([vertices[here, 0], vertices[there, 1]]),
        (low_x, low_y) + (rng.integers(0, 32, (8 * count, 2)) + 0.5) / 32 * size,
    ]
    mixed = np.choose(rng.integers(0, len(kinds), (8 * count, 1)), kinds)
    shapely.prepare(environment.free)
    free = mixed[shapely.intersects_xy(environment.free, *mixed.T)]
    if not len(free):
        free = vertices[:1]
    return free[rng.integers(0, min(len(free), 4 * count), count)]
