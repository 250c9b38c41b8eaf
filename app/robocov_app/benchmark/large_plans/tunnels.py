"""Networks of tunnels: mines, sewers, and the passages of a metro station, with loops and dead ends."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.environment import Obstacle, Point, PolygonObstacle
from robocov_app.benchmark.large_plans.drawing import build_octagon
from robocov_app.benchmark.plan_shapes import FloorPlan, build_box, round_points

_MIN_PILLAR_AREA_M2 = 2.0
"""Minimum area of the rock between tunnels; smaller pieces are cut away."""
_SIMPLIFICATION_M = 0.08
"""Maximum distance by which the walls are moved when needless corners are removed."""
_SHAFT_RADIUS_M = 2.2
"""Radius of the chamber in which the robots start."""


class _Network:
    """Tunnels and chambers, from which the plan is cut."""

    def __init__(self) -> None:
        self._spaces: list[shapely.Polygon] = []

    def dig(self, points: Sequence[Point] | Array, width: float) -> None:
        """Add a tunnel of constant width along a polyline, with flat ends."""
        line = shapely.LineString(points)
        self._spaces.append(line.buffer(width / 2.0, cap_style="flat", join_style="mitre"))

    def add_chamber(self, x: float, y: float, radius: float) -> None:
        """Add an octagonal chamber."""
        self._spaces.append(shapely.Polygon(build_octagon(x, y, radius)))

    def add_hall(self, left: float, bottom: float, right: float, top: float) -> None:
        """Add a rectangular hall."""
        self._spaces.append(shapely.Polygon(build_box(left, bottom, right, top)))

    def cut(self, entrance: Point, furniture: Sequence[Obstacle] = ()) -> FloorPlan:
        """Return the plan, whose obstacles are the rock between the tunnels, and some furniture."""
        union = shapely.union_all(self._spaces)
        if not isinstance(union, shapely.Polygon):
            # The plan is not connected, and therefore rejected.
            union = max(union.geoms, key=lambda part: part.area)
        space = shapely.simplify(union.normalize(), _SIMPLIFICATION_M)
        boundary = round_points(np.asarray(space.exterior.coords)[:-1])
        obstacles: list[Obstacle] = []
        for ring in space.interiors:
            if shapely.Polygon(ring).area >= _MIN_PILLAR_AREA_M2:
                obstacles.append(PolygonObstacle(round_points(np.asarray(ring.coords)[:-1])))
        return FloorPlan(boundary, [*obstacles, *furniture], entrance)


def draw_tunnels(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a mine with pillars, a mine with drifts and cross-cuts, sewers, or a metro station."""
    draw = (_draw_pillar_mine, _draw_drift_mine, _draw_sewers, _draw_metro)[layout]
    return draw(rng)


def _bend(rng: np.random.Generator, start: Array, end: Array, amount: float) -> Array:
    """Return a line from start to end with a bend near its middle."""
    across = np.array([start[1] - end[1], end[0] - start[0]]) / np.hypot(*(end - start))
    middle = (start + end) / 2.0 + rng.uniform(-amount, amount) * across
    return np.array([start, middle, end])


def _draw_pillar_mine(rng: np.random.Generator) -> FloorPlan:
    """Draw a room-and-pillar mine: headings that cross each other around pillars, some not yet cut through."""
    columns = int(rng.integers(6, 8))
    rows = int(rng.integers(4, 6))
    pitch_x = rng.uniform(6.6, 7.4)
    pitch_y = rng.uniform(6.4, 7.2)
    skew = rng.uniform(0.08, 0.22)
    nodes = np.empty((rows, columns, 2))
    for row, column in itertools.product(range(rows), range(columns)):
        shift = rng.uniform(-0.8, 0.8, 2)
        nodes[row, column] = (column * pitch_x + row * pitch_y * skew + shift[0], row * pitch_y + shift[1])
    network = _Network()
    for row, column in itertools.product(range(rows), range(columns)):
        node = nodes[row, column]
        if column + 1 < columns and (row == 0 or rng.random() < 0.86):
            network.dig([node, nodes[row, column + 1]], rng.uniform(2.2, 3.0))
        if row + 1 < rows and (column in (0, columns - 1) or rng.random() < 0.86):
            network.dig([node, nodes[row + 1, column]], rng.uniform(2.2, 3.0))
        network.add_chamber(*node, rng.uniform(1.6, 2.0))
    # Headings at the face of the mine end in the rock.
    for column in range(columns):
        node = nodes[-1, column]
        network.dig([node, node + (rng.uniform(-0.5, 0.9), rng.uniform(2.5, 5.5))], rng.uniform(2.0, 2.8))
    for row in range(1, rows):
        if rng.random() < 0.6:
            node = nodes[row, -1]
            network.dig([node, node + (rng.uniform(2.5, 5.0), rng.uniform(-0.6, 0.6))], 2.2)
    shaft = nodes[0, columns // 2] - (0.0, 3.6)
    network.dig([shaft, nodes[0, columns // 2]], 3.0)
    network.add_chamber(*shaft, _SHAFT_RADIUS_M)
    return network.cut(tuple(shaft))


def _draw_drift_mine(rng: np.random.Generator) -> FloorPlan:
    """Draw a vein mine: two long drifts, cross-cuts between them, and stopes that end in the rock."""
    length = rng.uniform(42.0, 49.0)
    stations = int(rng.integers(7, 9))
    spacing = length / (stations - 1)
    lower = np.column_stack([np.arange(stations) * spacing, rng.uniform(-1.6, 1.6, stations)])
    upper = lower + np.column_stack([rng.uniform(-1.5, 1.5, stations), rng.uniform(8.5, 11.5, stations)])
    network = _Network()
    network.dig(lower, 3.0)
    network.dig(upper, 2.6)
    crossed = {0, stations - 1, *rng.choice(np.arange(1, stations - 1), 3, replace=False).tolist()}
    for station in range(stations):
        network.add_chamber(*lower[station], rng.uniform(1.7, 2.1))
        if station in crossed:
            line = _bend(rng, lower[station], upper[station], 1.2)
            network.dig(line, rng.uniform(1.8, 2.4))
            network.add_chamber(*line[1], 1.4)
        else:
            reach = rng.uniform(3.0, 5.0)
            network.dig([lower[station], lower[station] + (rng.uniform(-1.0, 1.0), reach)], 1.8)
    for station in range(0, stations, 2):
        # A stope: a drift off the vein that ends in a chamber, on alternating sides of the mine.
        above = upper[station] + (rng.uniform(-2.0, 2.0), rng.uniform(7.0, 10.0))
        line = _bend(rng, upper[station], above, 1.2)
        network.dig(line, rng.uniform(1.4, 1.8))
        network.add_chamber(*line[1], 1.2)
        network.add_chamber(*above, rng.uniform(2.0, 2.8))
    for station in range(1, stations, 2):
        below = lower[station] + (rng.uniform(-2.5, 2.5), rng.uniform(-9.5, -7.0))
        line = _bend(rng, lower[station], below, 1.2)
        network.dig(line, rng.uniform(1.4, 1.8))
        network.add_chamber(*line[1], 1.2)
        network.add_chamber(*below, rng.uniform(1.8, 2.6))
        if station + 2 < stations and rng.random() < 0.6:
            # A sublevel drift that ends before the next stope.
            network.dig([below, below + (rng.uniform(5.0, 8.0), rng.uniform(-1.0, 1.0))], 1.6)
    adit = lower[0] - (4.5, 0.0)
    network.dig([adit, lower[0]], 3.0)
    network.add_chamber(*adit, _SHAFT_RADIUS_M)
    return network.cut(tuple(adit))


def _draw_sewers(rng: np.random.Generator) -> FloorPlan:
    """Draw sewers: a trunk below the main street, laterals below the side streets, and manhole chambers."""
    blocks = int(rng.integers(4, 6))
    spacing = rng.uniform(9.2, 10.0)
    trunk = np.column_stack([np.arange(blocks + 1) * spacing, rng.uniform(-1.8, 1.8, blocks + 1)])
    network = _Network()
    network.dig(trunk, rng.uniform(2.6, 3.0))
    ends: dict[int, list[Array]] = {1: [], -1: []}
    for number, node in enumerate(trunk[1:]):
        network.add_chamber(*node, 2.0)
        for side in (1, -1):
            # Laterals are staggered, and join the trunk in the direction of its flow.
            lean = rng.uniform(1.0, 3.0) + 1.5 * (side < 0)
            manhole = node + (lean, side * rng.uniform(6.5, 8.5))
            end = manhole + (rng.uniform(-0.8, 1.2), side * rng.uniform(5.0, 8.0))
            width = rng.uniform(1.3, 1.6)
            network.dig([node, manhole], width)
            network.dig([manhole, end], width)
            network.add_chamber(*manhole, 1.2)
            network.add_chamber(*end, 1.1)
            ends[side].append(manhole)
            if rng.random() < 0.55:
                # A house connection.
                direction = -1.0 if number % 2 else 1.0
                network.dig([end, end + (direction * rng.uniform(3.0, 4.2), rng.uniform(-0.6, 0.6))], 1.2)
    for side, manholes in ends.items():
        skipped = int(rng.integers(0, len(manholes) - 1))
        for number, (first, second) in enumerate(itertools.pairwise(manholes)):
            if number == skipped:
                network.dig([first, first + 0.55 * (second - first)], 1.2)
                continue
            line = _bend(rng, first, second, 1.0)
            network.dig(line, 1.3)
            network.add_chamber(*line[1], 0.9)
        if side > 0:
            overflow = trunk[0] + (rng.uniform(2.0, 3.0), rng.uniform(8.0, 10.0))
            network.dig([trunk[0], overflow, manholes[0]], 1.5)
            network.add_chamber(*overflow, 1.3)
    network.add_chamber(*trunk[0], _SHAFT_RADIUS_M)
    return network.cut(tuple(trunk[0]))


def _draw_metro(rng: np.random.Generator) -> FloorPlan:
    """Draw a metro station: platforms of two lines, cross passages, corridors, and a ticket hall."""
    length = rng.uniform(46.0, 54.0)
    gap = rng.uniform(9.0, 11.0)
    network = _Network()
    # The platforms of the first line, on both sides of a concourse.
    network.dig([(0.0, 0.0), (length, 0.0)], 3.0)
    network.dig([(0.0, gap), (length, gap)], 3.0)
    middle = gap / 2.0
    network.dig([(length * 0.2, middle), (length * 0.8, middle)], 2.8)
    passages = np.linspace(length * 0.2 + 0.8, length * 0.8 - 0.8, int(rng.integers(5, 7)))
    for x in passages.tolist():
        network.dig([(x, 0.0), (x, gap)], 1.6)
    for x in (length * 0.06, length * 0.94):
        network.dig([(x, 0.0), (x, gap)], 1.2)
    # A corridor with an escalator leads to the ticket hall, and a second one leads back.
    hall_x = length * rng.uniform(0.24, 0.34)
    hall_y = gap + rng.uniform(13.0, 15.0)
    network.add_hall(hall_x - 5.0, hall_y - 3.0, hall_x + 5.0, hall_y + 3.0)
    network.dig(
        [(passages[1], gap), (passages[1], gap + 5.5), (hall_x + 1.5, gap + 5.5), (hall_x + 1.5, hall_y)], 2.6
    )
    network.dig([(length * 0.06, gap), (length * 0.06, hall_y - 1.2), (hall_x, hall_y - 1.2)], 1.8)
    # Exits from the hall end at the stairs to the street.
    network.dig([(hall_x, hall_y), (hall_x - 2.0, hall_y + 8.0), (hall_x - 8.0, hall_y + 8.0)], 2.4)
    network.dig([(hall_x + 3.0, hall_y + 1.0), (hall_x + 11.0, hall_y + 5.5)], 2.4)
    # The platforms of the second line cross above the first, and are reached by a winding corridor.
    line_x = length * rng.uniform(0.72, 0.78)
    start = np.array([line_x, gap + 7.0])
    direction = np.array([0.42, 0.91])
    across = np.array([0.91, -0.42])
    platform_length = rng.uniform(19.0, 23.0)
    for offset in (0.0, 8.0):
        platform_start = start + offset * across
        network.dig([platform_start, platform_start + platform_length * direction], 3.0)
    for distance in (0.15, 0.5, 0.85):
        first = start + distance * platform_length * direction
        network.dig([first, first + 8.0 * across], 1.6)
    network.dig([(passages[-2], gap), (passages[-2], gap + 4.0), start + 2.0 * direction], 2.2)
    link = start + 0.62 * platform_length * direction
    network.dig([(hall_x + 3.0, hall_y - 1.5), (link[0] - 8.0, hall_y - 1.5), link], 2.0)
    gates = [
        PolygonObstacle(build_box(hall_x + x, hall_y + 1.0, hall_x + x + 0.4, hall_y + 2.2))
        for x in (-3.0, -1.6)
    ]
    booth = PolygonObstacle(build_box(hall_x - 5.0, hall_y - 3.0, hall_x - 3.0, hall_y - 2.2))
    return network.cut((hall_x - 2.5, hall_y), [*gates, booth])
