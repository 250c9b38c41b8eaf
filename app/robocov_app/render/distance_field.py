"""Distances to the nearest robot at every pixel of a picture, and their colors."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from robocov.arrays import Array, BoolArray, IntArray
from robocov.cost import CoverageCost, CoverageResult, Sites, TimeVaryingCost
from robocov_app.look.theme import Theme

_SHALLOW = 0.05  # least angle, rad, at which two distances are taken to grow apart: borders stay thin
# the squares beside a square: rows up and columns right, and the corners that the two share
_BESIDE = (((1, 0), (2, 3)), ((-1, 0), (0, 1)), ((0, 1), (1, 3)), ((0, -1), (0, 2)))
_BLOCK = 4  # pixels along the side of blocks that are looked at as a whole first
_RIVALS = 5  # different ways that a place may choose from


class FieldLattice:
    """Interpolation lattice of a map: the sites around each place, the same for all results on it."""

    def __init__(self, sites: Sites) -> None:
        side = sites.lattice
        self.spacing = sites.spacing
        number = sites.to_grid(np.arange(len(sites.points)))
        self.origin = sites.points[0] - np.array(np.divmod(sites.cells[0], side)[::-1]) * sites.spacing
        # squares between four cells' middles, low left, low right, high left, high right; the rim's stick out
        rows = np.clip(np.arange(-1, side + 1), 0, side - 1)
        lower, upper = rows[:-1], rows[1:]
        around = np.stack([number[np.ix_(y, x)] for y in (lower, upper) for x in (lower, upper)], axis=-1)
        # a site that is not free speaks as another one of the square, and where none is, as the nearest
        some = around.max(axis=-1)
        row, column = distance_transform_edt(number < 0, return_distances=False, return_indices=True)
        some = np.where(some < 0, number[row, column][np.ix_(upper, upper)], some)
        self.around: IntArray = np.where(around < 0, some[..., None], around)
        self.free: BoolArray = around >= 0

    def squares(self, x: Array, y: Array) -> tuple[IntArray, IntArray]:
        """Return the columns and the rows of the squares that hold coordinates, (w,) and (h,) m."""
        cells = [(at - low) / self.spacing for at, low in zip((x, y), self.origin, strict=True)]
        column, row = (np.clip(np.floor(at) + 1, 0, len(self.around) - 1).astype(np.intp) for at in cells)
        return column, row


@dataclass(frozen=True, eq=False)
class Borders:
    """Pixels (row, column) near which the owner changes, (k,) each, and how far the border is, m."""

    row: IntArray
    column: IntArray
    owner: IntArray
    gap: Array

    def within(self, gap: float) -> "Borders":
        near = (self.gap <= gap).nonzero()[0]
        return Borders(self.row[near], self.column[near], self.owner[near], self.gap[near])


# Squares whose places may choose from several ways: number of each (s, s), -1 for none; sites (k, r); whether
# no wall is between a way's end and a square's corner, to which none is shorter, (k, 4, r).
_Rivals: TypeAlias = tuple[IntArray, IntArray, BoolArray]


class Field:
    """The distance to the nearest robot, and who that is, for one set of positions."""

    def __init__(self, lattice: FieldLattice, result: CoverageResult) -> None:
        self.lattice = lattice
        self.result = result
        owner, last = result.owner, result.last_corner
        way = result.positions[owner]
        bent = (last >= 0).nonzero()[0]
        way[bent] = result.corners[last[bent]]
        start = np.maximum(result.distances - np.hypot(*(result.points - way).T), 0.0)
        start[(last < 0) & (owner >= 0)] = 0.0
        self._way_x, self._way_y = np.ascontiguousarray(way.T)
        self._start, self._owner = start, owner
        # sites whose ways come from the same way-point of the same robot give the same distances
        source = np.where(last >= 0, last, -2 - owner)
        around = lattice.around
        mixed = (source[around[..., 1:]] != source[around[..., :1]]).any(axis=-1)
        self._inside = self._rivals(mixed, around[mixed])
        divided = (owner[around[..., 1:]] != owner[around[..., :1]]).any(axis=-1)
        beside, others = _with_neighbors(lattice, divided)
        self._around = self._rivals(beside, _first_different(others, source[others]))

    def _rivals(self, squares: BoolArray, site: IntArray) -> _Rivals:
        number = np.full(squares.shape, -1, dtype=np.intp)
        number[squares] = np.arange(len(site))
        corner = self.lattice.around[squares]
        points = self.result.points[corner]
        length = self._distance(site[:, None], points[..., 0, None], points[..., 1, None])
        return number, site, length >= self.result.distances[corner][..., None] - 1e-9 * self.lattice.spacing

    @property
    def largest(self) -> float:
        """The largest distance of a site that a robot can reach, m; nan if there is none."""
        reached = self.result.distances[self._owner >= 0]
        return float(reached.max()) if len(reached) else float("nan")

    def distances(self, x: Array, y: Array) -> Array:
        """Return distances at (w,) x and (h,) y as (h, w) m; inf where no robot can come beside obstacles."""
        column, row = self.lattice.squares(x, y)
        site = self.lattice.around[..., 0][row[:, None], column]
        distance = self._distance(site, np.broadcast_to(x, site.shape), y[:, None])
        number = self._inside[0][row[:, None], column]
        high, wide = (number >= 0).nonzero()
        distance[high, wide] = self._asked(self._inside, number[high, wide], x[wide], y[high]).min(axis=1)
        return distance

    def cells(self, x: Array, y: Array, within: float) -> tuple[IntArray, Borders]:
        """Return the nearest robot of every pixel, (h, w), -1 where none can come; and `borders`."""
        column, row = self.lattice.squares(x, y)
        owner = self._owner[self.lattice.around[..., 0]].take(row, axis=0).take(column, axis=1)
        blocks, pixels = self._coarse_and_fine(x, y, within)
        for part in (blocks, pixels):
            owner[part.row, part.column] = part.owner
        return owner, pixels.within(within)

    def borders(self, x: Array, y: Array, within: float) -> Borders:
        """Return the places at even (w,) x and (h,) y, at most `within` m from a change of owner."""
        return self._coarse_and_fine(x, y, within)[1].within(within)

    def _coarse_and_fine(self, x: Array, y: Array, within: float) -> tuple[Borders, Borders]:
        """Return what is near a border by blocks, each as its middle is, then by pixels."""
        # blocks with a corner in a square with rivals
        column, row = self.lattice.squares(x, y)
        numbered = self._around[0] >= 0

        def ends(square: IntArray) -> tuple[IntArray, IntArray]:
            first = np.arange(0, len(square), _BLOCK)
            return square[first], square[np.minimum(first + _BLOCK - 1, len(square) - 1)]

        some = [numbered[np.ix_(high, wide)] for high in ends(row) for wide in ends(column)]
        high, wide = np.logical_or.reduce(some).nonzero()
        middle_x, middle_y = (middles(places, _BLOCK) for places in (x, y))
        column, row = self.lattice.squares(middle_x, middle_y)
        known = numbered[row[high], column[wide]]
        blocks = self._bordering(high[known], wide[known], middle_x, middle_y)
        step = abs(x[1] - x[0]) if len(x) > 1 else self.lattice.spacing
        # half a block's diagonal, and as much again because gaps are taken as if borders were straight
        near = (blocks.gap <= within + 1.5 * _BLOCK * step).nonzero()[0]
        coarse = _spread(blocks.row, blocks.column, len(y), len(x))
        coarse_owner, coarse_gap = blocks.owner[coarse[2]], blocks.gap[coarse[2]]
        high, wide = np.append(blocks.row[near], high[~known]), np.append(blocks.column[near], wide[~known])
        row, column, _ = _spread(high, wide, len(y), len(x))
        return Borders(*coarse[:2], coarse_owner, coarse_gap), self._bordering(row, column, x, y)

    def _bordering(self, high: IntArray, wide: IntArray, x: Array, y: Array) -> Borders:
        """Return who is nearest, and how far the border is, at chosen rows and columns; inf for no border."""
        column, row = self.lattice.squares(x, y)
        number = self._around[0][row[high], column[wide]]
        some = (number >= 0).nonzero()[0]
        number, high, wide = number[some], high[some], wide[some]
        px, py = x[wide], y[high]
        around = self._around[1][number]
        distance = self._asked(self._around, number, px, py)
        owner = self._owner[around]
        each = np.arange(len(around))
        first = distance.argmin(axis=1)
        others = np.where(owner == owner[each, first][:, None], np.inf, distance)
        second = others.argmin(axis=1)
        sites = around[each, first], around[each, second]
        ways = [np.stack([px - self._way_x[site], py - self._way_y[site]]) for site in sites]
        u, v = (way / np.maximum(np.hypot(*way), 1e-12) for way in ways)
        apart = np.maximum(np.hypot(*(u - v)), _SHALLOW)
        # between places that robots reach and such that none does, there is a wall
        with np.errstate(invalid="ignore"):
            gap = (others[each, second] - distance[each, first]) / apart
        gap = np.nan_to_num(gap, nan=np.inf, posinf=np.inf)
        return Borders(high, wide, owner[each, first], gap)

    def _asked(self, rivals: _Rivals, number: IntArray, x: Array, y: Array) -> Array:
        """Return what the rivals of (k,) places in numbered squares say, (k, r), inf behind a wall."""
        _, site, right_way = rivals
        distance = self._distance(site[number], x[:, None], y[:, None])
        # the square's corner beside the place
        spacing, origin = self.lattice.spacing, self.lattice.origin
        cells = [(at - low) / spacing for at, low in zip((x, y), origin, strict=True)]
        right, upper = ((np.floor(at - 0.5) - np.floor(at)).astype(np.intp) + 1 for at in cells)
        return np.where(right_way[number, 2 * upper + right], distance, np.inf)

    def _distance(self, site: IntArray, x: Array, y: Array) -> Array:
        dx, dy = x - self._way_x[site], y - self._way_y[site]
        return np.asarray(np.sqrt(dx * dx + dy * dy) + self._start[site])


class Fields:
    """The fields of one map at any positions and time; their scale of colors ends at `limit`, m."""

    def __init__(self, cost: CoverageCost, limit: float) -> None:
        self.limit = limit
        self._momentary = TimeVaryingCost(cost)
        self._lattices = cost, FieldLattice(cost.sites)

    def at(self, positions: Array, time: float = 0.0) -> Field | None:
        """Return the field of robots at (n, 2) m at a time, s, without those below moving obstacles.

        None where all are. Raises InputError when a robot is in an obstacle that stands, or outside the map.
        """
        result = self._momentary.evaluate_all_robots(time, positions)
        if result is None:
            return None
        cost = self._momentary.get_cost(time)
        if cost is not self._lattices[0]:
            self._lattices = cost, FieldLattice(cost.sites)
        return Field(self._lattices[1], result)


def middles(places: Array, count: int) -> Array:
    """Return the middles of `count` pixels each; the last of them may stick out."""
    step = places[1] - places[0] if len(places) > 1 else 0.0
    return np.asarray(places[::count] + 0.5 * (count - 1) * step)


def _spread(row: IntArray, column: IntArray, height: int, width: int) -> tuple[IntArray, IntArray, IntArray]:
    """Return rows and columns of all pixels of (k,) blocks, and which block each is of."""
    inner_row, inner_column = np.divmod(np.arange(_BLOCK**2), _BLOCK)
    rows = (row[:, None] * _BLOCK + inner_row).ravel()
    columns = (column[:, None] * _BLOCK + inner_column).ravel()
    inside = ((rows < height) & (columns < width)).nonzero()[0]
    return rows[inside], columns[inside], inside // _BLOCK**2


def _with_neighbors(lattice: FieldLattice, divided: BoolArray) -> tuple[BoolArray, IntArray]:
    """Return divided squares, those across their open sides, and the (k, 20) sites of each, its own first.

    A border may cut a corner off a square whose own four sites are of one robot.
    """
    found = divided.copy()
    rows, columns = divided.shape
    asked = []
    for (up, right), shared in _BESIDE:
        at = np.ix_(*(np.clip(np.arange(n) + by, 0, n - 1) for n, by in ((rows, up), (columns, right))))
        open_ = ~divided & divided[at] & lattice.free[..., shared].all(axis=-1)
        found |= open_
        asked.append(np.where(open_[..., None], lattice.around[at], lattice.around))
    return found, np.concatenate([lattice.around, *asked], axis=-1)[found]


def _first_different(site: IntArray, source: IntArray) -> IntArray:
    """Return for each row of (k, m) sites the first few of different sources, else the first."""
    fresh = np.ones(site.shape, dtype=bool)
    for j in range(1, site.shape[1]):
        fresh[:, j] = (source[:, j, None] != source[:, :j]).all(axis=1)
    order = np.argsort(~fresh, axis=1, kind="stable")[:, :_RIVALS]
    chosen = np.take_along_axis(site, order, axis=1)
    return np.where(np.take_along_axis(fresh, order, axis=1), chosen, site[:, :1])


_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
FARTHEST = 253  # number of the color at the limit of the scale and beyond


def round_limit(distance: float) -> float:
    """Return a round length not below a distance, m, to which a scale of colors may reach."""
    if not np.isfinite(distance) or distance <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(distance))
    return next(float(f"{step * power:.12g}") for step in _STEPS if step * power >= distance * (1.0 - 1e-9))


def ticks(limit: float) -> list[float]:
    """Return round lengths from zero to a limit, m, for a scale of colors."""
    power = 10.0 ** np.floor(np.log10(limit))
    for step in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0):
        count = limit / (step * power)
        if count <= 5 + 1e-9 and abs(count - round(count)) < 1e-9:
            break
    return [float(f"{k * step * power:.12g}") for k in range(round(count) + 1)]


def palette(theme: Theme) -> NDArray[np.uint8]:
    """Return the colors of `levels`, (256, 3): from near to far, then of where no robot can come."""
    closed = np.array([theme.unreached, theme.obstacle_edge], dtype=np.uint8)
    return np.concatenate([theme.build_heat_table(FARTHEST + 1), closed])


def levels(field: Field, x: Array, y: Array, limit: float, hatch: int) -> NDArray[np.uint8]:
    """Return distances at (w,) x and (h,) y as numbers in the `palette`; unreachable places are hatched."""
    distance = field.distances(x, y)
    reached = np.isfinite(distance)
    np.multiply(distance, FARTHEST / limit, out=distance)
    np.minimum(distance, FARTHEST, out=distance)
    level = distance.astype(np.uint8)
    if not reached.all():
        row, column = np.indices(reached.shape)
        line = np.asarray((row + column) % hatch < max(hatch // 9, 1))
        level[~reached] = FARTHEST + 1 + line[~reached]
    return level


def strength(borders: Borders, zoom: float, width: float) -> Array:
    """Return how much of each pixel a line of `width` px along borders covers, 0 to 1; `zoom` is in px/m."""
    return np.asarray(np.clip(0.5 * width + 0.5 - borders.gap * zoom, 0.0, 1.0))
