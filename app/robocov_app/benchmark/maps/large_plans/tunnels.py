"""Networks of tunnels: mines, sewers, and the passages of a metro station, with loops and dead ends."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import shapely

from robocov.environment import Obstacle, Point, PolygonObstacle
from robocov.typing import FloatArray
from robocov_app.benchmark.maps.large_plans.drawing import build_octagon
from robocov_app.benchmark.maps.plan_shapes import FloorPlan, build_box, round_points

_MIN_PILLAR_AREA_M2 = 2.0
"""Minimum area of the rock between tunnels; smaller pieces are cut away."""
_SIMPLIFICATION_TOLERANCE_M = 0.08
"""Maximum distance by which the walls are moved when needless corners are removed."""
_SHAFT_RADIUS_M = 2.2
"""Radius of the chamber in which the robots start."""
_HEADING_PROBABILITY = 0.86
"""Probability that neighboring crossings inside a pillar mine are connected."""
_PLATFORM_WIDTH_M = 3.0
_TICKET_HALL_M = (10.0, 6.0)
"""Width and height of the ticket hall of a metro station."""


class _Network:
    """Tunnels and chambers, from which the plan is cut."""

    def __init__(self) -> None:
        self._spaces: list[shapely.Polygon] = []

    def dig(self, points: Sequence[Point] | Sequence[FloatArray] | FloatArray, width: float) -> None:
        """Add a tunnel of constant width along a polyline, with flat ends."""
        line = shapely.LineString(points)
        self._spaces.append(line.buffer(width / 2.0, cap_style="flat", join_style="mitre"))

    def add_chamber(self, center: FloatArray, radius: float) -> None:
        """Add an octagonal chamber."""
        x, y = center.tolist()
        self._spaces.append(shapely.Polygon(build_octagon(x, y, radius)))

    def add_hall(self, left: float, bottom: float, right: float, top: float) -> None:
        """Add a rectangular hall."""
        self._spaces.append(shapely.Polygon(build_box(left, bottom, right, top)))

    def cut(self, entrance: Point, furniture: Sequence[Obstacle] = ()) -> FloorPlan:
        """Build the plan; its obstacles are the furniture and the rock between the tunnels."""
        union = shapely.union_all(self._spaces)
        if not isinstance(union, shapely.Polygon):
            # Tunnels that are not connected to the others are left out.
            union = max(union.geoms, key=lambda part: part.area)
        space = shapely.simplify(union.normalize(), _SIMPLIFICATION_TOLERANCE_M)
        boundary = round_points(np.asarray(space.exterior.coords)[:-1])
        obstacles: list[Obstacle] = []
        for ring in space.interiors:
            if shapely.Polygon(ring).area < _MIN_PILLAR_AREA_M2:
                continue
            corners = round_points(np.asarray(ring.coords)[:-1])
            obstacles.append(PolygonObstacle(corners))
        return FloorPlan(boundary, [*obstacles, *furniture], entrance)


def draw_tunnels(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a mine with pillars, a mine with drifts and cross-cuts, sewers, or a metro station."""
    draw_layout = (_draw_pillar_mine, _draw_drift_mine, _draw_sewers, _draw_metro)[layout]
    return draw_layout(rng)


def _move(point: FloatArray, x: float, y: float) -> FloatArray:
    """Return a point moved by `x` and `y`, m."""
    moved: FloatArray = point + np.array([x, y])
    return moved


def _bend(rng: np.random.Generator, start: FloatArray, end: FloatArray, amount: float) -> FloatArray:
    """Return a line from start to end whose middle is shifted sideways by at most `amount`, m."""
    across = np.array([start[1] - end[1], end[0] - start[0]]) / np.hypot(*(end - start))
    middle = (start + end) / 2.0 + rng.uniform(-amount, amount) * across
    return np.array([start, middle, end])


def _draw_pillar_mine(rng: np.random.Generator) -> FloorPlan:
    """Draw a room-and-pillar mine: headings that cross around pillars, some not yet cut through."""
    columns = int(rng.integers(6, 8))
    rows = int(rng.integers(4, 6))
    crossings = _choose_crossings(rng, rows, columns)
    network = _Network()
    for row, column in itertools.product(range(rows), range(columns)):
        crossing = crossings[row, column]
        # The lowest heading and those on both sides are complete, so that the network is connected.
        if column + 1 < columns and (row == 0 or rng.random() < _HEADING_PROBABILITY):
            network.dig([crossing, crossings[row, column + 1]], rng.uniform(2.2, 3.0))
        if row + 1 < rows and (column in (0, columns - 1) or rng.random() < _HEADING_PROBABILITY):
            network.dig([crossing, crossings[row + 1, column]], rng.uniform(2.2, 3.0))
        network.add_chamber(crossing, rng.uniform(1.6, 2.0))
    # Headings at the face of the mine end in the rock.
    for crossing in crossings[-1]:
        face = _move(crossing, rng.uniform(-0.5, 0.9), rng.uniform(2.5, 5.5))
        network.dig([crossing, face], rng.uniform(2.0, 2.8))
    for crossing in crossings[1:, -1]:
        if rng.random() < 0.6:
            face = _move(crossing, rng.uniform(2.5, 5.0), rng.uniform(-0.6, 0.6))
            network.dig([crossing, face], 2.2)
    shaft = _move(crossings[0, columns // 2], 0.0, -3.6)
    network.dig([shaft, crossings[0, columns // 2]], 3.0)
    network.add_chamber(shaft, _SHAFT_RADIUS_M)
    return network.cut((shaft[0], shaft[1]))


def _choose_crossings(rng: np.random.Generator, rows: int, columns: int) -> FloatArray:
    """Choose the crossings of headings, (rows, columns, 2) m: a skewed grid with random shifts."""
    pitch_x = rng.uniform(6.6, 7.4)
    pitch_y = rng.uniform(6.4, 7.2)
    skew = rng.uniform(0.08, 0.22)
    crossings = np.empty((rows, columns, 2))
    for row, column in itertools.product(range(rows), range(columns)):
        shift_x, shift_y = rng.uniform(-0.8, 0.8, 2)
        x = column * pitch_x + row * pitch_y * skew + shift_x
        y = row * pitch_y + shift_y
        crossings[row, column] = (x, y)
    return crossings


def _draw_drift_mine(rng: np.random.Generator) -> FloorPlan:
    """Draw a vein mine: two long drifts, cross-cuts between them, and stopes that end in the rock."""
    length = rng.uniform(42.0, 49.0)
    stations = int(rng.integers(7, 9))
    lower_x = np.arange(stations) * (length / (stations - 1))
    lower = np.column_stack([lower_x, rng.uniform(-1.6, 1.6, stations)])
    shifts = [rng.uniform(-1.5, 1.5, stations), rng.uniform(8.5, 11.5, stations)]
    upper = lower + np.column_stack(shifts)
    network = _Network()
    network.dig(lower, 3.0)
    network.dig(upper, 2.6)
    _dig_cross_cuts(rng, network, lower, upper)
    for station in range(0, stations, 2):
        end = _move(upper[station], rng.uniform(-2.0, 2.0), rng.uniform(7.0, 10.0))
        _dig_stope(rng, network, upper[station], end, max_radius=2.8)
    for station in range(1, stations, 2):
        end = _move(lower[station], rng.uniform(-2.5, 2.5), rng.uniform(-9.5, -7.0))
        _dig_stope(rng, network, lower[station], end, max_radius=2.6)
        if station + 2 < stations and rng.random() < 0.6:
            # A drift toward the next stope, which ends before reaching it.
            network.dig([end, _move(end, rng.uniform(5.0, 8.0), rng.uniform(-1.0, 1.0))], 1.6)
    adit = _move(lower[0], -4.5, 0.0)
    network.dig([adit, lower[0]], 3.0)
    network.add_chamber(adit, _SHAFT_RADIUS_M)
    return network.cut((adit[0], adit[1]))


def _dig_cross_cuts(
    rng: np.random.Generator, network: _Network, lower: FloatArray, upper: FloatArray
) -> None:
    """Dig cross-cuts from the lower drift; those at both ends and three others reach the upper drift."""
    stations = len(lower)
    chosen = rng.choice(np.arange(1, stations - 1), 3, replace=False).tolist()
    connected = {0, stations - 1, *chosen}
    for station in range(stations):
        start = lower[station]
        network.add_chamber(start, rng.uniform(1.7, 2.1))
        if station in connected:
            line = _bend(rng, start, upper[station], 1.2)
            network.dig(line, rng.uniform(1.8, 2.4))
            network.add_chamber(line[1], 1.4)
        else:
            height = rng.uniform(3.0, 5.0)
            network.dig([start, _move(start, rng.uniform(-1.0, 1.0), height)], 1.8)


def _dig_stope(
    rng: np.random.Generator, network: _Network, start: FloatArray, end: FloatArray, *, max_radius: float
) -> None:
    """Dig a bent drift that ends in a chamber."""
    line = _bend(rng, start, end, 1.2)
    network.dig(line, rng.uniform(1.4, 1.8))
    network.add_chamber(line[1], 1.2)
    network.add_chamber(end, rng.uniform(max_radius - 0.8, max_radius))


def _draw_sewers(rng: np.random.Generator) -> FloorPlan:
    """Draw sewers: a trunk below the main street, laterals below the side streets, and manhole chambers."""
    blocks = int(rng.integers(4, 6))
    spacing = rng.uniform(9.2, 10.0)
    trunk = np.column_stack([np.arange(blocks + 1) * spacing, rng.uniform(-1.8, 1.8, blocks + 1)])
    network = _Network()
    network.dig(trunk, rng.uniform(2.6, 3.0))
    upper_manholes = []
    lower_manholes = []
    for number, node in enumerate(trunk[1:]):
        network.add_chamber(node, 2.0)
        upper_manholes.append(_dig_lateral(rng, network, node, 1, number))
        lower_manholes.append(_dig_lateral(rng, network, node, -1, number))
    _connect_manholes(rng, network, upper_manholes)
    # An overflow leads from the inlet to the first manhole.
    overflow = _move(trunk[0], rng.uniform(2.0, 3.0), rng.uniform(8.0, 10.0))
    network.dig([trunk[0], overflow, upper_manholes[0]], 1.5)
    network.add_chamber(overflow, 1.3)
    _connect_manholes(rng, network, lower_manholes)
    network.add_chamber(trunk[0], _SHAFT_RADIUS_M)
    return network.cut((trunk[0, 0], trunk[0, 1]))


def _dig_lateral(
    rng: np.random.Generator, network: _Network, node: FloatArray, side: int, number: int
) -> FloatArray:
    """Dig a lateral from a node of the trunk to one side (1 or -1), and return its manhole."""
    # Laterals join the trunk in the direction of its flow; those on both sides are staggered.
    lean = rng.uniform(1.0, 3.0)
    if side < 0:
        lean += 1.5
    manhole = _move(node, lean, side * rng.uniform(6.5, 8.5))
    end = _move(manhole, rng.uniform(-0.8, 1.2), side * rng.uniform(5.0, 8.0))
    width = rng.uniform(1.3, 1.6)
    network.dig([node, manhole], width)
    network.dig([manhole, end], width)
    network.add_chamber(manhole, 1.2)
    network.add_chamber(end, 1.1)
    if rng.random() < 0.55:
        # A connection to a house.
        direction = -1.0 if number % 2 else 1.0
        house = _move(end, direction * rng.uniform(3.0, 4.2), rng.uniform(-0.6, 0.6))
        network.dig([end, house], 1.2)
    return manhole


def _connect_manholes(rng: np.random.Generator, network: _Network, manholes: list[FloatArray]) -> None:
    """Connect the manholes on one side of the trunk; one connection ends halfway."""
    unfinished = int(rng.integers(0, len(manholes) - 1))
    for number, (first, second) in enumerate(itertools.pairwise(manholes)):
        if number == unfinished:
            network.dig([first, first + 0.55 * (second - first)], 1.2)
            continue
        line = _bend(rng, first, second, 1.0)
        network.dig(line, 1.3)
        network.add_chamber(line[1], 0.9)


def _draw_metro(rng: np.random.Generator) -> FloorPlan:
    """Draw a metro station: platforms of two lines, cross passages, corridors, and a ticket hall."""
    length = rng.uniform(46.0, 54.0)
    gap = rng.uniform(9.0, 11.0)
    network = _Network()
    passages = _dig_first_line(rng, network, length, gap)
    hall_x = length * rng.uniform(0.24, 0.34)
    hall_y = gap + rng.uniform(13.0, 15.0)
    _dig_ticket_hall(network, hall_x, hall_y)
    # Two corridors lead from the first line to the hall.
    turn_y = gap + 5.5
    gate_x = hall_x + 1.5
    network.dig([(passages[1], gap), (passages[1], turn_y), (gate_x, turn_y), (gate_x, hall_y)], 2.6)
    end_x = length * 0.06
    side_y = hall_y - 1.2
    network.dig([(end_x, gap), (end_x, side_y), (hall_x, side_y)], 1.8)
    start, link = _dig_second_line(rng, network, length * rng.uniform(0.72, 0.78), gap + 7.0)
    # Two corridors lead to the second line: from the first one, and from the hall.
    bend = (passages[-2], gap + 4.0)
    network.dig([(passages[-2], gap), bend, start], 2.2)
    link_y = hall_y - 1.5
    network.dig([(hall_x + 3.0, link_y), (link[0] - 8.0, link_y), (link[0], link[1])], 2.0)
    return network.cut((hall_x - 2.5, hall_y), _build_ticket_hall_furniture(hall_x, hall_y))


def _dig_first_line(rng: np.random.Generator, network: _Network, length: float, gap: float) -> list[float]:
    """Dig platforms at y = 0 and y = `gap` and a concourse between them; return the x of its passages."""
    network.dig([(0.0, 0.0), (length, 0.0)], _PLATFORM_WIDTH_M)
    network.dig([(0.0, gap), (length, gap)], _PLATFORM_WIDTH_M)
    network.dig([(length * 0.2, gap / 2.0), (length * 0.8, gap / 2.0)], 2.8)
    count = int(rng.integers(5, 7))
    passages: list[float] = np.linspace(length * 0.2 + 0.8, length * 0.8 - 0.8, count).tolist()
    for x in passages:
        network.dig([(x, 0.0), (x, gap)], 1.6)
    for x in (length * 0.06, length * 0.94):
        network.dig([(x, 0.0), (x, gap)], 1.2)
    return passages


def _dig_ticket_hall(network: _Network, x: float, y: float) -> None:
    """Dig a ticket hall around a point, and two exits, which end at the stairs to the street."""
    half_width = _TICKET_HALL_M[0] / 2.0
    half_height = _TICKET_HALL_M[1] / 2.0
    network.add_hall(x - half_width, y - half_height, x + half_width, y + half_height)
    network.dig([(x, y), (x - 2.0, y + 8.0), (x - 8.0, y + 8.0)], 2.4)
    network.dig([(x + 3.0, y + 1.0), (x + 11.0, y + 5.5)], 2.4)


def _dig_second_line(rng: np.random.Generator, network: _Network, x: float, y: float) -> tuple[Point, Point]:
    """Dig two slanted platforms with cross passages, the first from (x, y).

    Returns
    -------
    start, link : (2,) sequence, m
        Points on the first platform, near its start and beyond its middle.
    """
    first = np.array([x, y])
    direction = np.array([0.42, 0.91])
    across = np.array([0.91, -0.42])
    length = rng.uniform(19.0, 23.0)
    distance = 8.0
    for offset in (0.0, distance):
        platform = first + offset * across
        network.dig([platform, platform + length * direction], _PLATFORM_WIDTH_M)
    for fraction in (0.15, 0.5, 0.85):
        passage = first + fraction * length * direction
        network.dig([passage, passage + distance * across], 1.6)
    start = first + 2.0 * direction
    link = first + 0.62 * length * direction
    return (start[0], start[1]), (link[0], link[1])


def _build_ticket_hall_furniture(x: float, y: float) -> list[Obstacle]:
    """Build two ticket gates and a booth in the ticket hall around a point."""
    boxes = [
        build_box(x - 3.0, y + 1.0, x - 2.6, y + 2.2),
        build_box(x - 1.6, y + 1.0, x - 1.2, y + 2.2),
        build_box(x - 5.0, y - 3.0, x - 3.0, y - 2.2),
    ]
    return [PolygonObstacle(box) for box in boxes]
