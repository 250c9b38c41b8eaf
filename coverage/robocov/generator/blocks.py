"""Maps of the kind `blocks`: a town, divided by streets into blocks.

The map is divided into convex cells by one cut after another. Each cut is the middle line of a street. The
part of a cell that remains when the streets along its edges are removed is a block.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import scale

from robocov.environment import DiscStart, Obstacle, PolygonObstacle
from robocov.generator.request import MapRequest

_TILT_DEVIATIONS_RAD = (0.0, 0.05, 0.1)
"""Possible standard deviations of the tilts of the streets of a town."""
_MAX_TILT_DEVIATIONS = 1.5
"""Maximum tilt of a street, in standard deviations."""
_MAX_WIDENING_PER_GAP = 1.2
"""Maximum widening of the first street beyond its minimum width, as a multiple of the requested gap."""
_MIN_WIDENING_SHARE = 0.4
"""Widening of the narrowest streets, which divide only two blocks or lie along the boundary, relative to the
widening of the first street."""
_CHAMFER_PROBABILITY = 0.25
"""Probability that a corner of a block is cut off by a line."""
_NOTCH_PROBABILITY = 0.2
"""Probability that a corner of a block is cut out as a parallelogram."""
_CHAMFER_FRACTIONS = (0.2, 0.45)
"""Minimum and maximum fraction of an edge that a chamfer cuts off; see `Trim`."""
_NOTCH_FRACTIONS = (0.35, 0.6)
"""Minimum and maximum fraction of an edge that a notch cuts off; see `Trim`."""
_CORNER_CHOICES = 12
"""Number of possible values of `Trim.corner`. It is a multiple of 3, 4 and 6, so that all corners of a block
with that many corners are equally probable. The number of corners is not yet known when a trim is sampled."""
_MAX_UNEVENNESS = 0.25
"""Maximum offset of a cut from an even division, relative to the width of one block."""
_MIN_THICKNESS = 0.3
"""Minimum thickness of a block, relative to the side of a square of its area."""
_MIN_THICK_FRACTION = 0.97
"""Minimum fraction of a block's area that must be at least that thick; acute corners are always thinner."""
_WIDENING_BISECTIONS = 16
"""Number of bisections by which the width of the streets is chosen."""


class Edge(NamedTuple):
    """An edge of a cell, from a corner to the next.

    Attributes
    ----------
    x, y : float, m
        The first corner.
    setback : float, m
        Distance of the block from the edge if streets are as narrow as possible: half of the street's width.
    widening_share : float
        Increase of the setback per unit of widening, where the widening is that of the first street.
    """

    x: float
    y: float
    setback: float = 0.0
    widening_share: float = 0.0


Cell: TypeAlias = list[Edge]
"""A convex polygon, counter-clockwise."""

Point: TypeAlias = tuple[float, float]
"""A point (x, y) in m, or a vector."""


class Trim(NamedTuple):
    """A cut at a corner of a block.

    Attributes
    ----------
    corner : int
        Whole number whose remainder, divided by the number of corners, is the index of the corner.
    before, after : float
        Fractions of the edges before and after the corner that are cut off.
    is_notch : bool
        Whether the cut removes a parallelogram, rather than a triangle.
    """

    corner: int
    before: float
    after: float
    is_notch: bool


def build_town(
    request: MapRequest, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Build blocks between streets; streets that separate more blocks are wider.

    The streets are widened until the blocks have the requested area. If the streets reach their maximum width
    first, the blocks are scaled down.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    corner_disc : DiscStart
        Disc that stays free.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of Obstacle or None
        The blocks. None if they cannot fill the requested area, or if some would be too small or too thin.
    """
    cells = divide_into_cells(request, rng)
    if cells is None:
        return None
    feasible_widening = _find_feasible_widening(cells, request, corner_disc)
    if feasible_widening is None:
        return None
    trims = _sample_trims(cells, feasible_widening, corner_disc, rng)

    def build_blocks(widening: float) -> list[Polygon]:
        """Return the blocks between streets of the given widening, m."""
        return [
            _build_block(cell, widening, corner_disc, trim) for cell, trim in zip(cells, trims, strict=True)
        ]

    if _sum_areas(build_blocks(0.0)) < request.blocked_area:
        return None
    # Widen the streets until the blocks take the requested area.
    low = 0.0
    high = feasible_widening
    for _ in range(_WIDENING_BISECTIONS):
        middle = (low + high) / 2.0
        if _sum_areas(build_blocks(middle)) > request.blocked_area:
            low = middle
        else:
            high = middle
    blocks = build_blocks(low)
    # The blocks are still larger than requested: slightly after the bisection, or more if the streets have
    # reached their maximum width. Scaling makes their total area exact.
    factor = math.sqrt(request.blocked_area / _sum_areas(blocks))
    blocks = [scale(block, factor, factor, origin="centroid") for block in blocks]
    if not all(_is_thick(block) for block in blocks):
        return None
    return [PolygonObstacle(request.build_ring(shapely.get_coordinates(block)[:-1])) for block in blocks]


def divide_into_cells(request: MapRequest, rng: np.random.Generator) -> list[Cell] | None:
    """Divide a map into one cell for each block.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of Cell or None
        Cells, with the streets along their edges. None if some would be too small.
    """
    tilt_deviation = float(rng.choice(_TILT_DEVIATIONS_RAD))
    street_width = request.gap_before_rounding
    # The middle line of a street along the boundary is half a width away from the boundary.
    half_width = street_width / 2.0
    right = request.width - half_width
    top = request.height - half_width
    outline = [(half_width, half_width), (right, half_width), (right, top), (half_width, top)]
    whole_map = [Edge(x, y, setback=half_width, widening_share=_MIN_WIDENING_SHARE / 2.0) for x, y in outline]
    # Cells that may have to be divided, and the number of blocks in each.
    waiting = [(whole_map, int(request.obstacle_count))]
    cells = []
    while waiting:
        cell, block_count = waiting.pop()
        if block_count == 1:
            cells.append(cell)
            continue
        # If the number of blocks is odd, either part may get one more.
        first_count = block_count // 2 if rng.random() < 0.5 else block_count - block_count // 2
        unevenness = rng.uniform(-_MAX_UNEVENNESS, _MAX_UNEVENNESS)
        fraction = first_count / block_count + unevenness / block_count
        # `np.ptp` is the difference between maximum and minimum.
        width, height = np.ptp([(edge.x, edge.y) for edge in cell], axis=0).tolist()
        if max(width, height) < 2.0 * street_width:
            return None
        street = _Street(
            normal=_sample_normal(rng, tilt_deviation, is_upright=height > width),
            width=street_width,
            widening_share=_compute_widening_share(block_count, request.obstacle_count),
        )
        first, second = _divide_cell(cell, fraction, street)
        waiting.append((first, first_count))
        waiting.append((second, block_count - first_count))
    return cells


class _Street(NamedTuple):
    """A street that divides a cell.

    Attributes
    ----------
    normal : (x, y)
        Unit vector across the street.
    width : float, m
        Minimum width.
    widening_share : float
        Widening share of the edges on either side; see `Edge`.
    """

    normal: Point
    width: float
    widening_share: float


def _sample_normal(rng: np.random.Generator, tilt_deviation: float, *, is_upright: bool) -> Point:
    """Sample the normal of a street that divides a cell, with a random tilt.

    Without the tilt, the normal is parallel to the longer side of the cell, so that the street divides this
    side. `is_upright` says that the longer side is the vertical one.
    """
    deviations = float(np.clip(rng.normal(), -_MAX_TILT_DEVIATIONS, _MAX_TILT_DEVIATIONS))
    tilt = tilt_deviation * deviations
    angle = tilt + math.pi / 2.0 if is_upright else tilt
    return math.cos(angle), math.sin(angle)


def _compute_widening_share(block_count: int, total_block_count: int) -> float:
    """Return the widening share of the edges along a street that divides a cell of `block_count` blocks.

    The share grows with the logarithm of the number of blocks. The first street, which divides all blocks,
    is widened most.
    """
    rank = math.log(block_count) / math.log(total_block_count)
    street_share = _MIN_WIDENING_SHARE + (1.0 - _MIN_WIDENING_SHARE) * rank
    # Half of a street lies on either side of its middle line.
    return street_share / 2.0


def _divide_cell(cell: Cell, fraction: float, street: _Street) -> tuple[Cell, Cell]:
    """Divide a convex cell by a street; the first part gets the given fraction of the cell.

    The fraction refers to the extent of the cell in the direction of the street's normal, without streets.
    Both parts get a new edge along the middle line of the street.
    """
    normal_x, normal_y = street.normal
    # Coordinates of the corners along the normal.
    coordinates = [edge.x * normal_x + edge.y * normal_y for edge in cell]
    # Two widths are subtracted: that of the new street, and half of the width of the street at either end.
    free_extent = max(coordinates) - min(coordinates) - 2.0 * street.width
    street_coordinate = min(coordinates) + street.width + fraction * free_extent
    street_point = (normal_x * street_coordinate, normal_y * street_coordinate)
    setback = street.width / 2.0
    first = cut_cell(cell, street_point, (normal_x, normal_y), setback, street.widening_share)
    second = cut_cell(cell, street_point, (-normal_x, -normal_y), setback, street.widening_share)
    return first, second


def cut_cell(
    cell: Cell, origin: Point, normal: Point, setback: float = 0.0, widening_share: float = 0.0
) -> Cell:
    """Cut a cell along a line.

    Parameters
    ----------
    cell : Cell
        The cell to cut.
    origin : (x, y), m
        A point on the line.
    normal : (x, y)
        Vector across the line, toward the side that is removed.
    setback : float, m
        Setback of the new edge; see `Edge`.
    widening_share : float
        Widening share of the new edge; see `Edge`.

    Returns
    -------
    Cell
        The remaining part; empty if nothing remains.
    """
    # Signed distances of the corners from the line, positive on the side that is removed.
    distances = [(edge.x - origin[0]) * normal[0] + (edge.y - origin[1]) * normal[1] for edge in cell]
    remaining = []
    for k, edge in enumerate(cell):
        following = cell[(k + 1) % len(cell)]
        distance = distances[k]
        following_distance = distances[(k + 1) % len(cell)]
        if distance <= 0.0:
            remaining.append(edge)
        if (distance <= 0.0) == (following_distance <= 0.0):
            continue
        # The edge crosses the line. The crossing is a new corner.
        fraction = distance / (distance - following_distance)
        x = edge.x + (following.x - edge.x) * fraction
        y = edge.y + (following.y - edge.y) * fraction
        if distance <= 0.0:
            # The outline enters the side that is removed. The new edge along the line starts here.
            remaining.append(Edge(x, y, setback, widening_share))
        else:
            # The outline leaves the side that is removed. The rest of the edge starts here.
            remaining.append(edge._replace(x=x, y=y))
    return remaining


def remove_streets(cell: Cell, widening: float) -> Cell:
    """Return the block that remains of a cell without the streets along its edges.

    Parameters
    ----------
    cell : Cell
        A cell, with the streets along its edges.
    widening : float, m
        Widening of the first street beyond its minimum width.

    Returns
    -------
    Cell
        The block; empty if nothing remains.
    """
    block = cell
    for k, edge in enumerate(cell):
        following = cell[(k + 1) % len(cell)]
        length = math.hypot(following.x - edge.x, following.y - edge.y)
        # The outward normal: cells are counter-clockwise.
        normal = ((following.y - edge.y) / length, (edge.x - following.x) / length)
        distance = edge.setback + widening * edge.widening_share
        origin = (edge.x - normal[0] * distance, edge.y - normal[1] * distance)
        block = cut_cell(block, origin, normal)
    return block


def _find_feasible_widening(cells: list[Cell], request: MapRequest, corner_disc: DiscStart) -> float | None:
    """Find a widening of the first street, m, at which no block is too thin; return None if there is none."""
    widening = _MAX_WIDENING_PER_GAP * request.gap
    while True:
        blocks = [_build_block(cell, widening, corner_disc, trim=None) for cell in cells]
        if all(_is_thick(block) for block in blocks):
            return widening
        if widening == 0.0:
            return None
        # Halve the widening down to one rounding step, then try none at all.
        widening = widening / 2.0 if widening > request.rounding_step else 0.0


def _build_block(cell: Cell, widening: float, corner_disc: DiscStart, trim: Trim | None) -> Polygon:
    """Build the block of a cell; return an empty polygon if nothing remains of the cell.

    The block is the cell without the streets along its edges, whose widths follow from the widening of the
    first street. It is outside the square around the corner disc. A trim cuts off one of its corners.
    """
    block = remove_streets(cell, widening)
    if not block:
        return Polygon()
    x, y = corner_disc.center
    low = (x - corner_disc.radius, y - corner_disc.radius)
    high = (x + corner_disc.radius, y + corner_disc.radius)
    if shapely.box(*low, *high).intersects(_to_polygon(block)):
        # Cut the block along one side of the square. Of the four results, take the largest.
        remaining_parts = [
            cut_cell(block, low, (1.0, 0.0)),
            cut_cell(block, low, (0.0, 1.0)),
            cut_cell(block, high, (-1.0, 0.0)),
            cut_cell(block, high, (0.0, -1.0)),
        ]
        block = max(remaining_parts, key=lambda part: _to_polygon(part).area)
    if trim is None or not block:
        return _to_polygon(block)
    return _trim_block(block, trim)


def _to_polygon(cell: Cell) -> Polygon:
    """Convert a cell to a polygon."""
    return Polygon([(edge.x, edge.y) for edge in cell])


def _trim_block(block: Cell, trim: Trim) -> Polygon:
    """Trim a block; return the whole block if the trimmed one is not a valid polygon."""
    points = np.array([(edge.x, edge.y) for edge in block])
    index = trim.corner % len(points)
    corner = points[index]
    start = corner + (points[index - 1] - corner) * trim.before
    end = corner + (points[(index + 1) % len(points)] - corner) * trim.after
    # A notch is a parallelogram, in which the inner corner is opposite to the corner of the block.
    inner_corner = start + end - corner
    cut = [start, inner_corner, end] if trim.is_notch else [start, end]
    trimmed = Polygon([*points[:index], *cut, *points[index + 1 :]])
    return trimmed if trimmed.is_valid else _to_polygon(block)


def _sample_trims(
    cells: list[Cell], feasible_widening: float, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Trim | None]:
    """Sample a trim for each block; None if the block stays whole or the trimmed block would be too thin."""
    trims: list[Trim | None] = []
    sampled_trims = [_sample_trim(rng) for _ in cells]
    for cell, trim in zip(cells, sampled_trims, strict=True):
        largest_block = _build_block(cell, 0.0, corner_disc, trim)
        smallest_block = _build_block(cell, feasible_widening, corner_disc, trim)
        is_feasible = _is_thick(largest_block) and _is_thick(smallest_block)
        trims.append(trim if is_feasible else None)
    return trims


def _sample_trim(rng: np.random.Generator) -> Trim | None:
    """Sample a chamfer or a notch; None for neither."""
    choice = rng.random()
    corner = int(rng.integers(0, _CORNER_CHOICES))
    if choice < _CHAMFER_PROBABILITY:
        fraction = rng.uniform(*_CHAMFER_FRACTIONS)
        return Trim(corner, before=fraction, after=fraction, is_notch=False)
    if choice < _CHAMFER_PROBABILITY + _NOTCH_PROBABILITY:
        before, after = rng.uniform(*_NOTCH_FRACTIONS, size=2).tolist()
        return Trim(corner, before=before, after=after, is_notch=True)
    return None


def _is_thick(block: shapely.Geometry) -> bool:
    """Return whether a block is one polygon without holes and without thin parts.

    Eroding a block and dilating it again (an opening) removes its thin parts; it must not lose much area.
    """
    if not isinstance(block, Polygon) or block.is_empty or block.interiors:
        return False
    radius = _MIN_THICKNESS / 2.0 * math.sqrt(block.area)
    opened = block.buffer(-radius, join_style="mitre").buffer(radius, join_style="mitre")
    return isinstance(opened, Polygon) and opened.area > _MIN_THICK_FRACTION * block.area


def _sum_areas(blocks: list[Polygon]) -> float:
    """Return the total area of blocks, m²."""
    return float(sum(block.area for block in blocks))
