"""Where the robots of a team should be, for all that one of them knows: plans on a lattice of ways.

The cost is (22) on the nodes of `Ways`, weighted with the area (times the density) that each stands for:

    J(P) = sum over q of w_q min_j d(q, p_j)

with geodesic distances d. An unknown cell counts by how likely it is free (see `openness`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.optimize import linear_sum_assignment

from robocov.arrays import Array, BoolArray, IntArray
from robocov.k_median import improved, moved
from robocov.planning.discovered import FREE, UNKNOWN
from robocov.planning.openness import BLOCKS, openness

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.density import Density
    from robocov.planning.discovered import DiscoveredMap
    from robocov.planning.wayfinding import Ways, Window

MOST_SOURCES = 180
"""A plan for a team chooses among at most so many nodes; its own goal each robot then finds among all."""

_FAR = 1e9
"""Metres that stand for "nobody is there"."""

_SEEN_ENOUGH = 0.6
"""Metres around a place from where somebody has looked: it is not gone to again."""


@dataclass(frozen=True, eq=False)
class CoverageDemand:
    """What there is to be covered in a window of a discovered map.

    Attributes
    ----------
    known : DiscoveredMap
    window : Window
    density : Density or None
    sure : bool
        Whether only what is known to be free counts.
    """

    known: DiscoveredMap
    window: Window
    density: Density | None = None
    sure: bool = False

    def __deepcopy__(self, memo: object) -> CoverageDemand:
        return self

    @cached_property
    def _state(self) -> NDArray[np.uint8]:
        return self.window.cut(self.known.state, np.uint8(UNKNOWN))

    @cached_property
    def _outside(self) -> BoolArray:
        return self.window.cut(self.known.raster.outside, True)

    @cached_property
    def _openness(self) -> Array:
        blocks = min(BLOCKS, self.window.rows * self.window.columns)
        return openness(self._state, self._outside, blocks)

    @cached_property
    def weights(self) -> Array:
        """How many cells each node stands for, (m,); unknown ones count by their openness."""
        window = self.window
        worth = np.where(self._state == FREE, 1.0, 0.0 if self.sure else self._openness)
        worth[self._outside] = 0.0
        blocks = worth.reshape(window.rows, window.stride, window.columns, window.stride)
        weights = blocks.sum(axis=(1, 3)).ravel()
        if self.density is not None and not self.density.uniform:
            row, column = np.mgrid[: window.rows, : window.columns] * window.stride + window.stride // 2
            places = self.known.raster.middles(row.ravel() + window.row, column.ravel() + window.column)
            weights = weights * self.density.value(places)
        return np.asarray(weights)

    def viewpoint(
        self, mine: Array, home: Array, tight: BoolArray, least: float, former: tuple[Array, ...]
    ) -> Array | None:
        """Return where to look at what may matter most, of the unknown patches in a robot's own cell.

        At stake is what a patch is expected to add to the cost: an inside of an obstacle hardly adds
        anything. The place is a free cell on the border of the patch, chosen by stake over one metre plus
        the way.

        Parameters
        ----------
        mine : (m,) m
            Distance of each node of the robot's own cell from its goal, 0 for others.
        home : (m,) m
            Distance of each node from where it is.
        tight : (h, w)
            Cells where it cannot be.
        least : float, m
            Stakes below are not worth it, as the cost in cells times metres.
        former : places, (2,) m each
            From where it has looked already.

        Returns
        -------
        (2,) m, or None
            When there is nothing to look at.
        """
        state = self._state
        patch, _ = ndimage.label((state == UNKNOWN) & ~self._outside)
        row, column = patch.nonzero()
        label = patch[row, column]
        node = row // self.window.stride * self.window.columns + column // self.window.stride
        stake = np.bincount(label, mine[node] * self._openness[row, column])
        good = stake[label] > least
        row, column, label = row[good], column[good], label[good]
        if not len(label):
            return None
        high, wide = state.shape
        best, chosen = 0.0, None
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            beside, along = (row + down).clip(0, high - 1), (column + right).clip(0, wide - 1)
            there = (state[beside, along] == FREE) & ~tight[beside, along]
            beside, along, which = beside[there], along[there], label[there]
            if not len(which):
                continue
            node = beside // self.window.stride * self.window.columns + along // self.window.stride
            place = self.known.raster.middles(beside + self.window.row, along + self.window.column)
            worth = stake[which] / (1.0 + home[node])
            for spot in former:
                worth[((place - spot) ** 2).sum(axis=1) < _SEEN_ENOUGH**2] = 0.0
            k = int(worth.argmax())
            if worth[k] > best:
                best, chosen = float(worth[k]), place[k]
        return chosen


@dataclass(frozen=True, eq=False)
class Table:
    """Distances from some nodes, among which a plan for a team chooses, to all.

    Attributes
    ----------
    ways : Ways
    sources : (c,)
    distance : (c, m) m
    """

    ways: Ways
    sources: IntArray
    distance: Array

    def __deepcopy__(self, memo: object) -> Table:
        return self

    @classmethod
    def of(cls, ways: Ways) -> Table:
        """Return the table of every k-th node in both directions, as many as are allowed."""
        row, column = np.divmod(np.arange(len(ways.nodes)), ways.window.columns)
        k = 1
        while True:
            chosen = ways.roomy & (row % k == k // 2) & (column % k == k // 2)
            if np.count_nonzero(chosen) <= MOST_SOURCES:
                break
            k += 1
        sources = chosen.nonzero()[0]
        return cls(ways, sources, ways.table(sources))


def team_places(
    table: Table,
    weights: Array,
    now: Array,
    begin: Array,
    given: BoolArray,
    threshold: float,
    nearby: float,
) -> Array:
    """Return where the robots of a team should be, (k, 2) m: a low sum of distances, by few relocations.

    From `begin` on, Lloyd's iteration in turn with interchange (see `medians.improved`); where all others are
    given, who plans then goes to the best place of its own cell. Who goes to which of the places is such that
    the sum of the squared ways is least: then the choice stays the same while the robots are on their way,
    and their ways do not cross.

    Parameters
    ----------
    table : Table
    weights : (m,)
    now : (k, 2) m
        Where the robots are. The first one plans; it is never given.
    begin : (k, 2) m
        Where the plan begins: the former one.
    given : (k,)
        Who stays where `begin` says.
    threshold : float
        Part of the cost that a relocation must save.
    nearby : float
        Part of the cost that one in the own cell must save.
    """
    ways = table.ways
    home = ways.standing(now[0])
    if home < 0:
        return begin
    reached = np.isfinite(ways.distances(home))
    usable = reached[table.sources]
    sources = table.sources[usable]
    target = reached & (weights > 0.0)
    if len(sources) < len(now) or not target.any():
        return begin
    distance = table.distance[usable]
    nodes = ways.nodes[sources]

    chosen = np.full(len(now), -1, dtype=np.intp)
    taken = np.zeros(len(sources), dtype=bool)
    for k in np.argsort(~given, kind="stable").tolist():
        away = ((nodes - begin[k]) ** 2).sum(axis=1)
        away[taken] = np.inf
        chosen[k] = away.argmin()
        taken[chosen[k]] = True
    weighed = np.ascontiguousarray((distance[:, target] * weights[target]).T)
    # in an order that does not depend on who plans: of two equal plans all take the same
    order = np.lexsort(begin.T)
    chosen[order] = improved(weighed, chosen[order], given[order], threshold)

    if given[1:].all():
        own = distance[:, sources[chosen]].argmin(axis=1) == 0
        chosen = moved(weighed, chosen, own, nearby)

    places = nodes[chosen]
    mobile = (~given).nonzero()[0]
    entry = [int(((nodes - now[k]) ** 2).sum(axis=1).argmin()) for k in mobile.tolist()]
    square = np.minimum(distance[entry][:, sources[chosen[mobile]]] ** 2, _FAR)
    _, column = linear_sum_assignment(square)
    result = np.where(given[:, None], begin, places)
    result[mobile] = places[mobile[column]]
    return np.asarray(result)


@dataclass(frozen=True, eq=False)
class OwnPlace:
    """The best place for one robot, the others being where they are.

    Attributes
    ----------
    goal : (2,) m
    node : int
        The node nearest to it.
    mine : (m,) m
        The distance of each node that is nearer to this node than to any other robot; 0 for the others.
    cost : float, cells times metres
        J with the robot there.
    """

    goal: Array
    node: int
    mine: Array
    cost: float


def own_place(
    ways: Ways, weights: Array, others: Array, begin: int, former: Array, rest: float, steps: int = 6
) -> OwnPlace:
    """Return a local minimum of the cost by the place of one robot alone, for given places of the others.

    From a node on, as long as a neighbouring node is better; then the minimum of the parabolas, in x and
    in y, through the costs of the node and those beside it. The former goal is kept where the new one is
    better by less than a part `rest` of what its own cell costs.

    Parameters
    ----------
    ways : Ways
    weights : (m,)
    others : (k, 2) m
    begin : int
        A node.
    former : (2,) m
        nan for none.
    rest : float
    steps : int
        Nodes that the place may move on.
    """
    first = ways.distances(begin)
    target = (np.isfinite(first) & (weights > 0.0)).nonzero()[0]
    worth = weights[target]
    near = np.minimum(ways.from_places(others)[target], _FAR)
    away = first[target]
    cell = away < near
    limit = 1.5 * float(away[cell].max(initial=0.0)) + 4.0 * ways.spacing
    known: dict[int, float] = {begin: float((worth * np.minimum(near, away)).sum())}

    tables: dict[int, Array] = {}

    def look_at(nodes: list[int]) -> None:
        fresh = [k for k in nodes if k not in tables]
        for k, table in zip(fresh, ways.near(fresh, limit), strict=True):
            tables[k] = table[target]
            known.setdefault(k, float((worth * np.minimum(near, tables[k])).sum()))

    node = begin
    for _ in range(steps):
        beside = [k for k in _beside(ways, node) if k >= 0]
        look_at(beside)
        best = min(beside, key=known.__getitem__, default=node)
        if not known[best] < known[node]:
            break
        node = best
    mine = np.zeros(len(weights))
    look_at([node, *(k for k in _beside(ways, node) if k >= 0)])
    away = tables[node]
    mine[target] = np.where(away < near, np.minimum(away, limit), 0.0)
    goal, fall = _refined(ways, node, known, former)
    if np.isfinite(former).all() and fall < rest * float((worth * mine[target]).sum()):
        goal = former.copy()
    return OwnPlace(goal, node, mine, known[node])


def _beside(ways: Ways, node: int) -> list[int]:
    """Return the nodes right of, above, left of and below a node, -1 where there is none to go to."""
    row, column = divmod(node, ways.window.columns)
    found = []
    for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        at, along = row + down, column + right
        inside = 0 <= at < ways.window.rows and 0 <= along < ways.window.columns
        k = at * ways.window.columns + along
        found.append(k if inside and ways.roomy[k] else -1)
    return found


def _refined(ways: Ways, node: int, cost: Mapping[int, float], former: Array) -> tuple[Array, float]:
    """Return the minimum of the parabolas round a node, and how far the former goal is above it."""
    right, up, left, down = _beside(ways, node)
    goal = ways.nodes[node].copy()
    fall = 0.0
    for axis, (ahead, behind) in enumerate(((right, left), (up, down))):
        off = (former[axis] - ways.nodes[node][axis]) / ways.spacing
        if abs(off) > 1.0:
            fall = np.inf
        if ahead < 0 or behind < 0:
            continue
        slope = 0.5 * (cost[ahead] - cost[behind])
        bend = cost[ahead] + cost[behind] - 2.0 * cost[node]
        if not bend > 0.0:
            continue
        shift = float(np.clip(-slope / bend, -0.5, 0.5))
        goal[axis] += shift * ways.spacing
        fall += (slope * off + 0.5 * bend * off * off) - (slope * shift + 0.5 * bend * shift * shift)
    return goal, fall
