"""Five families of random maps that differ in kind from all maps of the benchmark and of the study.

    spirals      round halls in which one or two corridors wind towards the center
    rings        nested walls, each with one opening, with a barrier between some of them
    honeycombs   hexagonal cells, of which some are connected by doors
    stars        halls whose tips, some behind a door, open to a round plaza
    rivers       winding channels with curved bays on both sides

Lengths are in meters, angles in radians. Coordinates are rounded to centimeters, so that the maps are the
same on every machine.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import LineString, Polygon
from shapely.ops import substring

from robocov import CircleObstacle, Environment, MapError, WallObstacle
from robocov.environment import Obstacle, find_narrowest_gap
from robocov.typing import FloatArray
from robocov_app.benchmark import suite
from robocov_app.benchmark.maps.plan_search import find_valid_map
from robocov_app.benchmark.maps.plan_shapes import FloorPlan, round_points

SEEDS = range(1, 5)
"""Seeds of the maps of each family."""
FIRST_KIND_NUMBER = 200
"""Number of the first family, chosen so that no family shares its random numbers with the benchmark."""
MIN_PASSAGE_M = 0.5
"""Minimum width of all passages."""
WALL_WIDTH_M = 0.12
WALL_OVERLAP_M = 0.3
"""Length by which walls continue beyond the boundary, so that they leave no gap."""
START_RADIUS_M = 0.6
"""Radius of the disc in which robots start, near the lower left corner."""
CIRCLE_SIDES = 60
"""Number of sides of a polygon that represents a circle."""

SPIRAL_RADII_M = (5.2, 6.3)
SPIRAL_STRETCHES = (1.0, 1.12)
"""Range of the ratio of the sides of the hall."""
SPIRAL_CORRIDOR_WIDTHS_M = (1.3, 1.7)
MAX_SPIRAL_ARMS = 2
SPIRAL_STEP = math.tau / 40
"""Angle between the points of a spiral."""

COURT_SIDES_M = (11.0, 14.0)
RING_SIDES = (5, 6, 8, CIRCLE_SIDES)
"""Numbers of sides that rings may have."""
OUTER_COURT_WIDTHS_M = (1.3, 1.8)
"""Range of the distance from the corners of the first ring to the boundary."""
RING_SPACINGS_M = (1.3, 1.7)
"""Range of the distance between the corners of consecutive rings."""
MIN_RING_RADIUS_M = 1.2
RING_OPENINGS_M = (0.8, 1.2)
BARRIER_PROBABILITY = 0.6
"""Probability of a barrier between two consecutive rings."""

CELL_SIDES_M = (1.4, 1.6)
CELL_ROWS = (4, 5)
CELL_COLUMNS = 4
MAX_REMOVED_CELLS = 3
CELL_DOORS_M = (0.7, 0.9)
EXTRA_DOOR_PROBABILITY = 0.2
"""Probability of a door in a wall that could be closed."""
MAX_CORNER_ERROR_M = 1e-6
"""Maximum distance between equal corners of neighboring cells, which differ by rounding errors."""
CELL_OUTLINE_TOLERANCE_M = 1e-3
"""Maximum distance by which the outline of all cells is moved when needless corners are removed."""

STAR_TIPS = (6, 7, 8, 9)
STAR_RADII_M = (5.6, 6.8)
STAR_INNER_RATIOS = (0.7, 0.82)
"""Range of the radius of the inner corners, relative to that of the tips."""
PLAZA_RADII_M = (2.2, 2.8)
FOUNTAIN_RADII_M = (0.4, 0.8)
STAR_DOORS_M = (0.7, 1.0)
STAR_DOOR_PROBABILITY = 0.5
"""Probability that a tip is behind a wall with a door, rather than open."""

RIVER_LENGTHS_M = (11.0, 12.0)
RIVER_WIDTHS_M = (1.6, 2.2)
MEANDER_AMPLITUDES_M = (0.8, 1.5)
MEANDER_LENGTHS_M = (6.5, 9.5)
BAY_DISTANCES_M = (2.4, 2.9)
"""Range of the distance between the mouths of neighboring bays."""
BAY_LENGTHS_M = (3.0, 5.0)
"""Range of the length of a bay from the middle of the river."""
BAY_WIDTHS_M = (1.3, 1.7)
BAY_TURNS = (0.4, 1.0)
"""Range of the angle by which the bays on one side of the river turn."""
BAY_TURN_VARIATION = 0.15
"""Maximum difference of the turn of a bay from that of the others on its side."""
BAY_POINTS = 10
"""Number of points on the center line of a bay."""
MEANDER_POINTS = 80
"""Number of points on the center line of a river."""
SHORE_TOLERANCE_M = 0.02
"""Maximum distance by which the shore is moved when needless corners are removed."""


def build_map(family: str, seed: int) -> Environment:
    """Build a map of a family. Its free space is connected, and its start is near its lower left corner."""
    environment = find_valid_map(
        family,
        seed,
        kind_number=FIRST_KIND_NUMBER + list(FAMILIES).index(family),
        sample_plan=FAMILIES[family],
        start_radius=START_RADIUS_M,
    )
    gap = find_narrowest_gap(environment.free)
    if gap is not None and gap.width < MIN_PASSAGE_M:
        raise MapError(
            f"{family}-{seed}: expected passages of at least {MIN_PASSAGE_M} m, got {gap.width:.2f} m"
        )
    return environment


def build_maps() -> dict[str, Environment]:
    """Build all maps, by their names."""
    return {f"{family}-{seed}": build_map(family, seed) for family in FAMILIES for seed in SEEDS}


def compute_hash(maps: Mapping[str, Environment]) -> str:
    """Return the SHA-256 of the content of maps."""
    hashes = [suite.compute_map_hash(environment) for environment in maps.values()]
    return hashlib.sha256(" ".join(hashes).encode()).hexdigest()


def draw_spiral(rng: np.random.Generator) -> FloorPlan:
    """Draw a round hall in which one or two corridors wind towards the center."""
    radius = rng.uniform(*SPIRAL_RADII_M)
    stretch = np.array([rng.uniform(*SPIRAL_STRETCHES), 1.0])
    corridor_width = rng.uniform(*SPIRAL_CORRIDOR_WIDTHS_M)
    arms = int(rng.integers(1, MAX_SPIRAL_ARMS + 1))
    direction = rng.choice([-1.0, 1.0])
    first_angle = rng.uniform(0.0, math.tau)
    # With several arms, the radius decreases by the widths of all corridors in a turn.
    total_turn = math.tau * (radius - 2.0 * corridor_width) / (arms * corridor_width)
    turns = np.linspace(0.0, total_turn, math.ceil(total_turn / SPIRAL_STEP) + 1)
    radii = radius - corridor_width * (1.0 + turns * arms / math.tau)
    # A straight piece connects the spiral to the boundary.
    turns = np.concatenate([[0.0], turns])
    radii = np.concatenate([[radius + WALL_OVERLAP_M], radii])
    walls = []
    for arm in range(arms):
        angles = first_angle + math.tau * arm / arms + direction * turns
        walls.append(to_cartesian(radii, angles) * stretch)
    boundary = build_regular_polygon(CIRCLE_SIDES, radius, 0.0) * stretch
    return build_plan(boundary, walls)


def draw_rings(rng: np.random.Generator) -> FloorPlan:
    """Draw nested walls in a rectangular court, each with one opening."""
    width, height = rng.uniform(*COURT_SIDES_M, 2)
    sides = int(rng.choice(RING_SIDES))
    rotation = rng.uniform(0.0, math.tau)
    ring_spacing = rng.uniform(*RING_SPACINGS_M)
    radius = min(width, height) / 2.0 - rng.uniform(*OUTER_COURT_WIDTHS_M)
    walls = []
    outer_ring: FloatArray | None = None
    outer_opening = 0.0
    while radius >= MIN_RING_RADIUS_M:
        ring = build_regular_polygon(sides, radius, rotation)
        opening_side = int(rng.integers(sides))
        opening_width = rng.uniform(*RING_OPENINGS_M)
        walls.append(cut_opening(ring, opening_side, opening_width))
        opening = rotation + (opening_side + 0.5) * math.tau / sides
        if outer_ring is not None and rng.random() < BARRIER_PROBABILITY:
            angle = find_middle_of_larger_arc(outer_opening, opening)
            walls.append(build_barrier(outer_ring, ring, angle))
        outer_ring = ring
        outer_opening = opening
        radius -= ring_spacing
    corner = np.array([width, height]) / 2.0
    boundary = corner * [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    return build_plan(boundary, walls)


def cut_opening(ring: FloatArray, opening_side: int, width: float) -> FloatArray:
    """Cut an opening in the middle of a side of a ring; return the points of the wall that remains, (k, 2) m.

    Side k leads from corner k of the ring to the next one.
    """
    corners = np.roll(ring, -opening_side - 1, axis=0)
    middle = (corners[-1] + corners[0]) / 2.0
    line = LineString([middle, *corners, middle])
    wall = substring(line, width / 2.0, line.length - width / 2.0)
    points: FloatArray = shapely.get_coordinates(wall)
    return points


def find_middle_of_larger_arc(first: float, second: float) -> float:
    """Return the middle of the larger of the two arcs between two angles."""
    difference = (second - first) % math.tau
    middle = first + difference / 2.0
    if difference < math.pi:
        middle += math.pi
    return middle


def build_barrier(outer_ring: FloatArray, inner_ring: FloatArray, angle: float) -> FloatArray:
    """Build a wall between two rings around the origin, in the given direction."""
    far_point = 2.0 * np.abs(outer_ring).max() * np.array([math.cos(angle), math.sin(angle)])
    ray = LineString([(0.0, 0.0), far_point])
    barrier = ray.intersection(Polygon(outer_ring) - Polygon(inner_ring))
    points: FloatArray = shapely.get_coordinates(barrier)
    return points


def draw_honeycomb(rng: np.random.Generator) -> FloorPlan:
    """Draw hexagonal cells, which are connected by the doors of a random spanning tree and a few more."""
    side_length = rng.uniform(*CELL_SIDES_M)
    cells = choose_cells(rng, int(rng.choice(CELL_ROWS)))
    rotation = rng.uniform(0.0, math.tau)
    hexagons = [build_cell(row, column, side_length) for row, column in cells]
    connected = DisjointSet(range(len(hexagons)))
    pairs = list(itertools.combinations(range(len(hexagons)), 2))
    walls = []
    for pair in rng.permutation(pairs).tolist():
        first, second = pair
        shared_side = find_shared_side(hexagons[first], hexagons[second])
        if shared_side is None:
            continue
        door_width = rng.uniform(*CELL_DOORS_M)
        is_extra_door = rng.random() < EXTRA_DOOR_PROBABILITY
        were_separate = connected.merge(first, second)
        if were_separate or is_extra_door:
            walls += build_wall_with_door(*shared_side, door_width)
        else:
            walls.append(extend_wall(*shared_side))
    # Sides of neighbors are equal only up to rounding errors.
    grown_hexagons = [Polygon(hexagon).buffer(MAX_CORNER_ERROR_M, join_style="mitre") for hexagon in hexagons]
    outline = shapely.simplify(shapely.union_all(grown_hexagons), CELL_OUTLINE_TOLERANCE_M)
    boundary = np.array(outline.exterior.coords[:-1])
    return build_plan(rotate(boundary, rotation), [rotate(wall, rotation) for wall in walls])


def choose_cells(rng: np.random.Generator, rows: int) -> list[tuple[int, int]]:
    """Choose the rows and columns of cells: a rectangle without some of the cells in its corners."""
    last_row = rows - 1
    last_column = CELL_COLUMNS - 1
    corners = [(0, 0), (0, last_column), (last_row, 0), (last_row, last_column)]
    removed_count = int(rng.integers(MAX_REMOVED_CELLS + 1))
    removed = rng.permutation(corners)[:removed_count].tolist()
    cells = itertools.product(range(rows), range(CELL_COLUMNS))
    return [cell for cell in cells if list(cell) not in removed]


def build_cell(row: int, column: int, side_length: float) -> FloatArray:
    """Build a hexagon. Every second row is shifted by half a cell."""
    x = math.sqrt(3.0) * side_length * (column + 0.5 * (row % 2))
    y = 1.5 * side_length * row
    return np.array([x, y]) + build_regular_polygon(6, side_length, math.pi / 6.0)


def find_shared_side(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return the ends of the side that two hexagons have in common, or None if they are not neighbors."""
    distances = np.linalg.norm(first[:, None] - second, axis=2)
    shared_corners = first[(distances < MAX_CORNER_ERROR_M).any(axis=1)]
    if len(shared_corners) < 2:
        return None
    return shared_corners[0], shared_corners[1]


def draw_star(rng: np.random.Generator) -> FloorPlan:
    """Draw a star-shaped hall with a plaza in its center, and walls between its tips."""
    tips = int(rng.choice(STAR_TIPS))
    radius = rng.uniform(*STAR_RADII_M)
    inner_radius = radius * rng.uniform(*STAR_INNER_RATIOS)
    plaza_radius = rng.uniform(*PLAZA_RADII_M)
    rotation = rng.uniform(0.0, math.tau)
    wall_angles = rotation + math.tau * np.arange(tips) / tips
    tip_angles = wall_angles + math.pi / tips
    boundary = np.empty((2 * tips, 2))
    boundary[::2] = to_cartesian(inner_radius, wall_angles)
    boundary[1::2] = to_cartesian(radius, tip_angles)
    plaza_corners = to_cartesian(plaza_radius, wall_angles)
    wall_starts = to_cartesian(inner_radius + WALL_OVERLAP_M, wall_angles)
    walls = [np.array(ends) for ends in zip(wall_starts, plaza_corners, strict=True)]
    for tip in range(tips):
        door_width = rng.uniform(*STAR_DOORS_M)
        if rng.random() < STAR_DOOR_PROBABILITY:
            next_corner = plaza_corners[(tip + 1) % tips]
            walls += build_wall_with_door(plaza_corners[tip], next_corner, door_width)
    fountain = CircleObstacle((0.0, 0.0), round(rng.uniform(*FOUNTAIN_RADII_M), 2))
    return build_plan(boundary, walls, fountain)


def draw_river(rng: np.random.Generator) -> FloorPlan:
    """Draw a winding channel with curved bays on both sides."""
    length = rng.uniform(*RIVER_LENGTHS_M)
    width = rng.uniform(*RIVER_WIDTHS_M)
    amplitude = rng.uniform(*MEANDER_AMPLITUDES_M)
    wave_number = math.tau / rng.uniform(*MEANDER_LENGTHS_M)
    phase = rng.uniform(0.0, math.tau)
    bay_distance = rng.uniform(*BAY_DISTANCES_M)
    x = np.linspace(0.0, length, MEANDER_POINTS)
    y = amplitude * np.sin(wave_number * x + phase)
    spaces = [LineString(np.column_stack([x, y])).buffer(width / 2.0, quad_segs=6)]
    for bank in (-1.0, 1.0):
        turn = rng.choice([-1.0, 1.0]) * rng.uniform(*BAY_TURNS)
        first_mouth = rng.uniform(0.0, 0.6) * bay_distance
        for mouth_x in np.arange(first_mouth, length, bay_distance):
            bay_turn = turn + rng.uniform(-BAY_TURN_VARIATION, BAY_TURN_VARIATION)
            bay_length = rng.uniform(*BAY_LENGTHS_M)
            bay_width = rng.uniform(*BAY_WIDTHS_M)
            mouth_y = amplitude * math.sin(wave_number * mouth_x + phase)
            bay = np.array([mouth_x, mouth_y]) + bend_line(bay_length, bay_turn) * [1.0, bank]
            spaces.append(LineString(bay).buffer(bay_width / 2.0, quad_segs=4))
    water = shapely.simplify(shapely.union_all(spaces), SHORE_TOLERANCE_M)
    # Rock that is enclosed by bays that meet is left out.
    return build_plan(np.array(water.exterior.coords[:-1]), [])


def bend_line(length: float, turn: float) -> FloatArray:
    """Return points of an arc that starts at the origin in the direction of +y and turns by an angle."""
    distances = np.linspace(0.0, length, BAY_POINTS)
    radius = length / turn
    angles = distances / radius
    return radius * np.column_stack([1.0 - np.cos(angles), np.sin(angles)])


def build_wall_with_door(start: FloatArray, end: FloatArray, door_width: float) -> list[FloatArray]:
    """Build the two pieces of a wall with a door in its middle."""
    start, end = extend_wall(start, end)
    along = (end - start) / np.linalg.norm(end - start)
    middle = (start + end) / 2.0
    half_door = along * door_width / 2.0
    return [np.array([start, middle - half_door]), np.array([middle + half_door, end])]


def extend_wall(start: FloatArray, end: FloatArray) -> FloatArray:
    """Extend a wall at both ends by half its width, so that walls that meet leave no notch."""
    extension = (end - start) / np.linalg.norm(end - start) * (WALL_WIDTH_M / 2.0)
    return np.array([start - extension, end + extension])


def build_regular_polygon(sides: int, radius: float, rotation: float) -> FloatArray:
    """Build the corners of a regular polygon around the origin, (sides, 2) m."""
    return to_cartesian(radius, rotation + math.tau * np.arange(sides) / sides)


def to_cartesian(radii: FloatArray | float, angles: FloatArray) -> FloatArray:
    """Convert polar to Cartesian coordinates, (k, 2) m."""
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def rotate(points: FloatArray, angle: float) -> FloatArray:
    """Rotate points around the origin, counter-clockwise."""
    rotation = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    rotated: FloatArray = points @ rotation
    return rotated


def build_plan(
    boundary: FloatArray, walls: Sequence[FloatArray], fountain: CircleObstacle | None = None
) -> FloorPlan:
    """Build a plan, moved so that the lower left corner of its bounding box is the origin."""
    corner = boundary.min(axis=0)
    obstacles: list[Obstacle] = [WallObstacle(round_points(wall - corner), WALL_WIDTH_M) for wall in walls]
    if fountain is not None:
        (center,) = round_points(np.array([fountain.center]) - corner)
        obstacles.append(CircleObstacle(center, fountain.radius))
    return FloorPlan(round_points(boundary - corner), obstacles)


FAMILIES: Mapping[str, Callable[[np.random.Generator], FloorPlan]] = {
    "spirals": draw_spiral,
    "rings": draw_rings,
    "honeycombs": draw_honeycomb,
    "stars": draw_star,
    "rivers": draw_river,
}
"""Functions that draw a plan, by family. The order determines the random numbers."""
