"""Maps of the kind `blocks`: a town, cut by streets into blocks."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import scale

from robocov.environment import DiscStart, Obstacle, PolygonObstacle
from robocov.generator.request import Request

_TILTS = 0.0, 0.05, 0.1  # streets of a town bend by about so much (standard deviation, radians)
_WIDEST = 1.2  # what the first street is wider than it must be at most, in gaps
_LEAST = 0.4  # what the last streets, and those along the boundary, get of what the first is wider
_CHAMFERED, _NOTCHED = 0.25, 0.2  # parts of the blocks with a corner cut off, and a yard cut out of one
_UNEVEN = 0.25  # a cut is off the even one by at most so much of one block's share
_THIN = 0.3  # least thickness of a block, as a part of the side of a square of its area
_HALVINGS = 16


class Edge(NamedTuple):
    """An edge of a cell, from (x, y) m; blocks keep `setback` off it, and `more` of what is to spare."""

    x: float
    y: float
    setback: float = 0.0
    more: float = 0.0


Cell: TypeAlias = list[Edge]
"""A convex polygon, counter-clockwise."""

Point: TypeAlias = tuple[float, float]

Trim: TypeAlias = tuple[int, float, float, bool]
"""Cut of a block's corner: its number, parts of the edges before and after it, and whether it is a yard."""


def cut(cell: Cell, origin: Point, normal: Point, setback: float = 0.0, more: float = 0.0) -> Cell:
    """Return the part of a cell that a normal points away from; the cut is its new edge."""
    side = [(edge.x - origin[0]) * normal[0] + (edge.y - origin[1]) * normal[1] for edge in cell]
    part = []
    for here, there, edge, after in zip(side, side[1:] + side[:1], cell, cell[1:] + cell[:1], strict=True):
        if here <= 0.0:
            part.append(edge)
        if (here <= 0.0) != (there <= 0.0):
            along = here / (here - there)
            x, y = edge.x + (after.x - edge.x) * along, edge.y + (after.y - edge.y) * along
            # where the outline leaves, the cut begins
            part.append(Edge(x, y, setback, more) if here <= 0.0 else Edge(x, y, edge.setback, edge.more))
    return part


def without_streets(cell: Cell, wider: float) -> Cell:
    """Return what is left of a cell beside streets that are so much wider than they must be, in metres."""
    block = cell
    for edge, after in zip(cell, cell[1:] + cell[:1], strict=True):
        length = math.hypot(after.x - edge.x, after.y - edge.y)
        normal = (after.y - edge.y) / length, (edge.x - after.x) / length
        off = edge.setback + wider * edge.more
        block = cut(block, (edge.x - normal[0] * off, edge.y - normal[1] * off), normal)
    return block


def city(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return blocks between streets, the first that are cut the widest; None if they block too little.

    Streets are as wide as the blocked area allows, up to a limit; then blocks become smaller all around.
    """
    cells = town_cells(request, rng)
    if cells is None:
        return None
    narrow, wide = 0.0, _WIDEST * request.gap
    # not so wide that blocks become too thin
    while not all(_stout(_block(cell, wide, corner, None)) for cell in cells):
        if wide == 0.0:
            return None
        wide = wide / 2.0 if wide > request.step else 0.0
    trims = [(cell, _trim(rng)) for cell in cells]
    for number, (cell, trim) in enumerate(trims):
        if not all(_stout(_block(cell, wider, corner, trim)) for wider in (narrow, wide)):
            trims[number] = cell, None

    def blocks(wider: float) -> tuple[list[Polygon], float]:
        found = [_block(cell, wider, corner, trim) for cell, trim in trims]
        return found, sum(block.area for block in found)

    if blocks(narrow)[1] < request.blocked:
        return None
    for _ in range(_HALVINGS):
        middle = (narrow + wide) / 2.0
        narrow, wide = (middle, wide) if blocks(middle)[1] > request.blocked else (narrow, middle)
    found, area = blocks(narrow)
    part = math.sqrt(request.blocked / area)
    found = [scale(block, part, part, origin="centroid") for block in found]
    if not all(map(_stout, found)):
        return None
    return [PolygonObstacle(request.build_ring(shapely.get_coordinates(block)[:-1])) for block in found]


def town_cells(request: Request, rng: np.random.Generator) -> list[Cell] | None:
    """Return the cells of as many blocks as are wanted, None where they become too small."""
    tilt = float(rng.choice(_TILTS))
    # rounding may bring corners nearer to each other
    street = request.gap + 3.0 * request.step
    # the street along the boundary counts half, as others do: else blocks beside it were small
    low, x, y = street / 2.0, request.width - street / 2.0, request.height - street / 2.0
    outline = (low, low), (x, low), (x, y), (low, y)
    waiting = [([Edge(*point, street / 2.0, _LEAST / 2.0) for point in outline], int(request.obstacles))]
    cells = []
    while waiting:
        cell, count = waiting.pop()
        if count == 1:
            cells.append(cell)
            continue
        # streets that separate more are wider
        more = _LEAST + (1.0 - _LEAST) * math.log(count) / math.log(request.obstacles)
        some = count // 2 if rng.random() < 0.5 else count - count // 2
        part = some / count + rng.uniform(-_UNEVEN, _UNEVEN) / count
        width, height = np.ptp([edge[:2] for edge in cell], axis=0).tolist()
        if max(width, height) < 2.0 * street:
            return None
        angle = (height > width) * math.pi / 2.0 + tilt * float(np.clip(rng.normal(), -1.5, 1.5))
        normal = math.cos(angle), math.sin(angle)
        along = [edge.x * normal[0] + edge.y * normal[1] for edge in cell]
        # what is beside streets is divided
        off = min(along) + street + part * (max(along) - min(along) - 2.0 * street)
        origin = normal[0] * off, normal[1] * off
        # half of the street on either side
        waiting.append((cut(cell, origin, normal, street / 2.0, more / 2.0), some))
        opposite = -normal[0], -normal[1]
        waiting.append((cut(cell, origin, opposite, street / 2.0, more / 2.0), count - some))
    return cells


def _block(cell: Cell, wider: float, corner: DiscStart, trim: Trim | None) -> Polygon:
    """Return the block of a cell beside the square of the start, empty where there is none."""
    block = without_streets(cell, wider)
    (x, y), radius = corner.center, corner.radius
    low, high = (x - radius, y - radius), (x + radius, y + radius)
    if block and shapely.box(*low, *high).intersects(_polygon(block)):
        # it ends at the side of the square that takes the least
        sides = (low, (1.0, 0.0)), (low, (0.0, 1.0)), (high, (-1.0, 0.0)), (high, (0.0, -1.0))
        block = max((cut(block, *side) for side in sides), key=lambda part: _polygon(part).area)
    return _polygon(block) if trim is None or not block else _trimmed(block, *trim)


def _polygon(cell: Cell) -> Polygon:
    return Polygon([edge[:2] for edge in cell])


def _trimmed(block: Cell, corner: int, before: float, after: float, yard: bool) -> Polygon:
    """Return the polygon of a block without what is cut off, where that is possible."""
    points = np.array(block)[:, :2]
    at = corner % len(points)
    here, previous, following = points[at], points[at - 1], points[(at + 1) % len(points)]
    first, last = here + (previous - here) * before, here + (following - here) * after
    inner = [first + last - here] if yard else []
    trimmed = Polygon([*points[:at], first, *inner, last, *points[at + 1 :]])
    return trimmed if trimmed.is_valid else _polygon(block)


def _trim(rng: np.random.Generator) -> Trim | None:
    kind, corner = rng.random(), int(rng.integers(0, 12))
    if kind < _CHAMFERED:
        part = rng.uniform(0.2, 0.45)
        return corner, part, part, False
    if kind < _CHAMFERED + _NOTCHED:
        before, after = rng.uniform(0.35, 0.6, 2).tolist()
        return corner, before, after, True
    return None


def _stout(block: shapely.Geometry) -> bool:
    """Return whether a block is one piece, and no part of it is thin."""
    if not isinstance(block, Polygon) or block.is_empty or block.interiors:
        return False
    thick = _THIN / 2.0 * math.sqrt(block.area)
    opened = block.buffer(-thick, join_style="mitre").buffer(thick, join_style="mitre")
    return isinstance(opened, Polygon) and opened.area > 0.97 * block.area
