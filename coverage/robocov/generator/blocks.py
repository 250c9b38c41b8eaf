"""Maps of the kind `blocks`: a town, cut by streets into blocks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
import shapely.affinity

from robocov.arrays import Array
from robocov.environment import PolygonObstacle

if TYPE_CHECKING:
    from robocov.environment import Obstacle
    from robocov.environment.starts import DiscStart
    from robocov.generator.request import Request

_TILTS = 0.0, 0.05, 0.1
"""Streets of a town bend by about so much (standard deviation, radians): each is taken as often."""

_WIDEST = 1.2
"""What the first street is wider than it must be at most, in gaps."""

_LEAST = 0.4
"""What the last streets, and those along the boundary, get of the width that the first gets to spare."""

_CHAMFERED, _NOTCHED = 0.25, 0.2
"""Parts of the blocks that have a corner cut off, and a yard cut out of a corner."""

_UNEVEN = 0.25
"""A cut is off the even one by at most so much of one block's share."""

_THIN = 0.3
"""Least thickness of a block, as a part of the side of a square of its area."""

_HALVINGS = 16

_AXES = np.eye(2)


@dataclass(frozen=True, eq=False)
class _Cell:
    """A convex polygon, counter-clockwise, and how far a block in it keeps from each of its edges.

    Attributes
    ----------
    points : (k, 2) m
    setback : (k,) m
        At least so far, from the edge from each point to the next.
    more : (k,)
        And by so many times what streets are wider than they must be.
    """

    points: Array
    setback: Array
    more: Array

    def cut(self, origin: Array, normal: Array, setback: float, more: float) -> _Cell:
        """Return the part on the side that the normal points away from, with the cut as a new edge."""
        side = (self.points - origin) @ normal
        rows = []
        for i, (here, there) in enumerate(zip(side, np.roll(side, -1), strict=True)):
            one, other = self.points[i], self.points[(i + 1) % len(side)]
            if here <= 0.0:
                rows.append((*one, self.setback[i], self.more[i]))
            if (here <= 0.0) != (there <= 0.0):
                crossing = one + (other - one) * (here / (here - there))
                # where the outline leaves, the cut begins
                edge = (setback, more) if here <= 0.0 else (self.setback[i], self.more[i])
                rows.append((*crossing, *edge))
        table = np.array(rows).reshape(-1, 4)
        return _Cell(table[:, :2], table[:, 2], table[:, 3])

    def without_streets(self, wider: float) -> _Cell:
        """Return what is left of the cell beside its streets, without points where nothing is.

        Parameters
        ----------
        wider : float, m
            What streets are wider than they must be.
        """
        block = self
        along = np.roll(self.points, -1, axis=0) - self.points
        outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
        for origin, normal, off in zip(self.points, outward, self.setback + wider * self.more, strict=True):
            block = block.cut(origin - normal * off, normal, 0.0, 0.0)
        return block


@dataclass(frozen=True, eq=False)
class _Trim:
    """What is cut off a block's corner.

    Attributes
    ----------
    corner : int
        Which, of as many as there are in turn.
    parts : (2,)
        Of the edges before and after it.
    yard : bool
        Cut out a yard, not the corner alone.
    """

    corner: int
    parts: tuple[float, float]
    yard: bool

    def applied(self, block: Array) -> shapely.Polygon:
        """Return the polygon of an outline, (k, 2) m, without what is cut off, where that is possible."""
        at = self.corner % len(block)
        here = block[at]
        before = here + (block[at - 1] - here) * self.parts[0]
        after = here + (block[(at + 1) % len(block)] - here) * self.parts[1]
        fresh = [before, before + after - here, after] if self.yard else [before, after]
        trimmed = shapely.Polygon(np.concatenate([block[:at], fresh, block[at + 1 :]]))
        return trimmed if trimmed.is_valid else shapely.Polygon(block)


def city(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return blocks between streets, the first that are cut the widest; None if they block too little.

    Streets are made as wide as the blocked area allows, up to a limit; what is too much then is taken off
    the blocks all around. The corner of the start is a square.
    """
    cells = _cells(request, rng)
    if cells is None:
        return None
    narrow, wide = 0.0, _WIDEST * request.gap
    # not so wide that blocks become too thin
    while not all(_stout(_block(cell, wide, corner, None)) for cell in cells):
        if wide == 0.0:
            return None
        wide = wide / 2.0 if wide > request.step else 0.0
    trims = [_trim(rng) for _ in cells]
    for number, cell in enumerate(cells):
        ends = [_block(cell, wider, corner, trims[number]) for wider in (narrow, wide)]
        if not all(map(_stout, ends)):
            trims[number] = None

    def blocks(wider: float) -> list[shapely.Polygon]:
        return [_block(cell, wider, corner, trim) for cell, trim in zip(cells, trims, strict=True)]

    if _area(blocks(narrow)) < request.blocked:
        return None
    for _ in range(_HALVINGS):
        middle = (narrow + wide) / 2.0
        narrow, wide = (middle, wide) if _area(blocks(middle)) > request.blocked else (narrow, middle)
    found = blocks(narrow)
    part = math.sqrt(request.blocked / _area(found))
    found = [shapely.affinity.scale(block, part, part, origin="centroid") for block in found]
    if not all(map(_stout, found)):
        return None
    return [PolygonObstacle(request.ring(shapely.get_coordinates(block)[:-1])) for block in found]


def _block(cell: _Cell, wider: float, corner: DiscStart, trim: _Trim | None) -> shapely.Polygon:
    """Return the block of a cell beside the square of the start, empty where there is none."""
    block = cell.without_streets(wider)
    low, high = np.array(corner.center) - corner.radius, np.array(corner.center) + corner.radius
    if len(block.points) and shapely.box(*low, *high).intersects(shapely.Polygon(block.points)):
        # it ends at the side of the square that takes the least
        sides = [(low, normal) for normal in _AXES] + [(high, -normal) for normal in _AXES]
        beside = [block.cut(origin, normal, 0.0, 0.0) for origin, normal in sides]
        block = max(beside, key=lambda part: _area([shapely.Polygon(part.points)]))
    if not len(block.points):
        return shapely.Polygon()
    return shapely.Polygon(block.points) if trim is None else trim.applied(block.points)


def _cells(request: Request, rng: np.random.Generator) -> list[_Cell] | None:
    """Return the cells of as many blocks as are wanted, None where they become too small."""
    tilt = float(rng.choice(_TILTS))
    # rounding may bring corners nearer to each other
    street = request.gap + 3.0 * request.step
    # the street along the boundary counts half, as others do: else blocks beside it were small
    low, x, y = street / 2.0, request.width - street / 2.0, request.height - street / 2.0
    outline = np.array([(low, low), (x, low), (x, y), (low, y)])
    root = _Cell(outline, np.full(4, street / 2.0), np.full(4, _LEAST / 2.0))
    waiting = [(root, int(request.obstacles))]
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
        extent = np.ptp(cell.points, axis=0)
        if extent.max() < 2.0 * street:
            return None
        across = int(extent.argmax())
        angle = across * math.pi / 2.0 + tilt * float(np.clip(rng.normal(), -1.5, 1.5))
        normal = np.array([math.cos(angle), math.sin(angle)])
        along = cell.points @ normal
        # what is beside streets is divided
        origin = normal * (along.min() + street + part * (np.ptp(along) - 2.0 * street))
        # half of the street on either side
        waiting.append((cell.cut(origin, normal, street / 2.0, more / 2.0), some))
        waiting.append((cell.cut(origin, -normal, street / 2.0, more / 2.0), count - some))
    return cells


def _trim(rng: np.random.Generator) -> _Trim | None:
    kind, corner = rng.random(), int(rng.integers(0, 12))
    if kind < _CHAMFERED:
        part = rng.uniform(0.2, 0.45)
        return _Trim(corner, (part, part), yard=False)
    if kind < _CHAMFERED + _NOTCHED:
        first, second = rng.uniform(0.35, 0.6, 2)
        return _Trim(corner, (float(first), float(second)), yard=True)
    return None


def _area(blocks: list[shapely.Geometry]) -> float:
    return float(sum(block.area for block in blocks))


def _stout(block: shapely.Geometry) -> bool:
    """Return whether a block is one piece, and no part of it is thin."""
    if not isinstance(block, shapely.Polygon) or block.is_empty or block.interiors:
        return False
    thick = _THIN / 2.0 * math.sqrt(block.area)
    opened = block.buffer(-thick, join_style="mitre").buffer(thick, join_style="mitre")
    return isinstance(opened, shapely.Polygon) and opened.area > 0.97 * block.area
