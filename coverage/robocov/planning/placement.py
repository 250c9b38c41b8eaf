"""Target placement of a team by the knowledge of one robot: k-median on a road lattice.

The cost is (22) on the nodes of `GridPlanner`, each weighted with its area (times the density):

    J(P) = sum over q of w_q min_j d(q, p_j)

with geodesic distances d. An unknown cell counts by how likely it is free (see `openness`).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import scipy

from robocov.arrays import Array, BoolArray
from robocov.density import Density
from robocov.k_median import improve_sources, move_first_source
from robocov.planning.wayfinding import GridPlanner

_FAR = 1e9  # metres that stand for "nobody is there"
_FEW = 8  # robots up to which plans are also looked for by taking two or three places away
_STEPS = 6  # of nodes that a plan moves an own place by, at most
_SEEN_ENOUGH = 0.6  # metres around a place from where somebody has looked: it is not gone to again


def demand(ways: GridPlanner, density: Density | None = None, *, sure: bool = False) -> Array:
    """Return the weights w of the nodes, (m,), in cells: for so many each stands, times the density.

    Unknown cells count by their openness; if `sure`, not at all.
    """
    weights = ways.free_cells if sure else ways.expected_cells
    if density is not None and not density.is_uniform:
        weights = weights * density.evaluate(ways.nodes)
    return weights


def viewpoint(
    ways: GridPlanner, mine: Array, home: Array, least: float, former: tuple[Array, ...]
) -> Array | None:
    """Return where to look at what may matter most, of the unknown patches in a robot's own cell.

    At stake is what a patch is expected to add to the cost: an inside of an obstacle hardly adds
    anything. The place is a free cell on its border, chosen by stake over one metre plus the way.

    Distances, (m,) m, are those of the nodes of its own cell from its goal, 0 for others (`mine`), and
    of all nodes from where it is (`home`). From the `former` places it has looked already. None: no stake
    is above the `least`, in cells times metres.
    """
    stride, columns, raster = ways.window.stride, ways.window.columns, ways.known.raster
    patch, node, cells = ways.unseen
    row, column, patches, beside = ways.border
    stake = np.bincount(patch, mine[node] * cells, minlength=1 + patches.max(initial=0))[patches]
    some = stake > least
    if not some.any():
        return None
    # the cells right of, above, left of and below those of the patch
    a, b = row[some, None] + [0, 1, 0, -1], column[some, None] + [1, 0, -1, 0]
    node = np.clip(a // stride * columns + b // stride, 0, len(home) - 1)
    worth = beside[some] * stake[some, None] / (1.0 + home[node])
    first = raster.middles(*np.array(ways.window[:2]))
    for x, y in (np.array(former).reshape(-1, 2) - first) / raster.cell:
        worth[(x - b) ** 2 + (y - a) ** 2 < (_SEEN_ENOUGH / raster.cell) ** 2] = 0.0
    best = worth.argmax()
    if not worth.flat[best] > 0.0:
        return None
    return np.asarray(first + np.array([b.flat[best], a.flat[best]]) * raster.cell)


def team_places(
    ways: GridPlanner, weights: Array, now: Array, begin: Array,
    fixed: BoolArray, others: Array, threshold: float, nearby: float, swapping: float = 0.0,
) -> Array:  # fmt: skip
    """Return where the robots of a team should be, (k, 2) m: a low sum of distances, by few relocations.

    From `begin` (k, 2) m on, the former plan, Lloyd's iteration in turn with interchange
    (`k_median.improve_sources`). The robots are at `now`; the first one plans. Those that are `fixed`, (k,),
    never the first, stay where `begin` says, and `others`, (o, 2) m, where they are; where all but the first
    stay, it goes to the best place of its own cell. What a relocation must save is the part `threshold` of
    the cost, one in the own cell the part `nearby`. Who goes to which of the places is such that the sum of
    the squared ways is least: then the choice stays the same while the robots are on their way, and their
    ways do not cross. As they go elsewhere too, to look, they swap places only where that saves the part
    `swapping` of the sum.
    """
    home = ways.standing(now[0])
    if home < 0:
        return begin
    reached = np.isfinite(ways.distances(home))
    usable = reached[ways.sources]
    sources = ways.sources[usable]
    target = reached & (weights > 0.0)
    if len(sources) < len(now) or not target.any():
        return begin
    distance = ways.source_distances[usable]
    nodes = ways.nodes[sources]

    chosen = np.full(len(now), -1, dtype=np.intp)
    for k in np.argsort(~fixed, kind="stable").tolist():
        away = ((nodes - begin[k]) ** 2).sum(axis=1)
        away[chosen[chosen >= 0]] = np.inf
        chosen[k] = away.argmin()
    # all others are one more source, that stays
    away = np.minimum(ways.from_places(others), _FAR)
    weighted = np.ascontiguousarray((np.vstack([distance[:, target], away[target]]) * weights[target]).T)
    # in an order that does not depend on who plans: of two equal plans all take the same
    order, outside = np.lexsort(begin.T), len(sources)
    team = np.append(chosen[order], outside), np.append(fixed[order], True)
    chosen[order] = improve_sources(weighted, *team, threshold, removals=len(now) <= _FEW)[:-1]
    if fixed[1:].all():
        from_team = np.column_stack([distance[:, sources[chosen]], away[sources]])
        own = np.append(from_team.argmin(axis=1) == 0, False)
        chosen = move_first_source(weighted, np.append(chosen, outside), own, nearby)[:-1]

    mobile = np.flatnonzero(~fixed)
    entry = [int(((nodes - now[k]) ** 2).sum(axis=1).argmin()) for k in mobile]
    square = np.minimum(distance[entry][:, sources[chosen[mobile]]] ** 2, _FAR)
    _, column = scipy.optimize.linear_sum_assignment(square)
    stay = np.arange(len(mobile))
    if swapping and square[stay, column].sum() > (1.0 - swapping) * square[stay, stay].sum():
        column = stay
    places = begin.copy()
    places[mobile] = nodes[chosen[mobile[column]]]
    return places


class OwnPlace(NamedTuple):
    """The best place for one robot, the others being where they are."""

    goal: Array  # (2,) m
    node: int  # nearest to it
    mine: Array  # (m,) m, distances from there to the nodes of the robot's own cell, 0 for the others
    cost: float  # J, in cells times metres


def own_place(
    ways: GridPlanner, weights: Array, others: Array, begin: int, former: Array, rest: float
) -> OwnPlace:
    """Return a local minimum of the cost by the place of one robot alone, the others being at (k, 2) m.

    From the node `begin` on, by at most `_STEPS` nodes, as long as a neighbouring one is better; then the
    minimum of the parabolas, in x and in y, through the costs of the node and those beside it. The former
    goal, (2,) m, nan for none, is kept where the new one is better by less than a part `rest` of what its own
    cell costs.
    """
    first = ways.distances(begin)
    target = np.flatnonzero(np.isfinite(first) & (weights > 0.0))
    worth, away = weights[target], first[target]
    near = np.minimum(ways.from_places(others)[target], _FAR)
    limit = 1.5 * float(away[away < near].max(initial=0.0)) + 4.0 * ways.spacing
    costs: dict[int, float] = {}
    tables: dict[int, Array] = {}

    def beside(node: int) -> list[int]:
        nodes = _neighbours(ways, node)
        fresh = [k for k in (node, *nodes) if k >= 0 and k not in tables]
        for k, table in zip(fresh, ways.near(fresh, limit), strict=True):
            tables[k] = table[target]
            costs[k] = float((worth * np.minimum(near, tables[k])).sum())
        return nodes

    node, around = begin, beside(begin)
    for _ in range(_STEPS):
        best = min((k for k in around if k >= 0), key=costs.__getitem__, default=node)
        if not costs[best] < costs[node]:
            break
        node, around = best, beside(best)
    mine = np.zeros(len(weights))
    mine[target] = np.where(tables[node] < near, np.minimum(tables[node], limit), 0.0)
    goal, fall = _refined(ways, node, around, costs, former)
    if np.isfinite(former).all() and fall < rest * float((worth * mine[target]).sum()):
        goal = former.copy()
    return OwnPlace(goal, node, mine, costs[node])


def _neighbours(ways: GridPlanner, node: int) -> list[int]:
    """Return the nodes right of, above, left of and below a node, -1 where there is none to go to."""
    high, wide = ways.window.rows, ways.window.columns
    row, column = divmod(node, wide)
    inside = column + 1 < wide, row + 1 < high, column > 0, row > 0
    nodes = node + 1, node + wide, node - 1, node - wide
    return [k if there and ways.roomy[k] else -1 for k, there in zip(nodes, inside, strict=True)]


def _refined(
    ways: GridPlanner, node: int, around: list[int], cost: Mapping[int, float], former: Array
) -> tuple[Array, float]:
    """Return the minimum of the parabolas round a node, and how far the former goal is above it."""
    right, up, left, down = around
    goal, fall = ways.nodes[node].copy(), 0.0
    for axis, (ahead, behind) in enumerate(((right, left), (up, down))):
        off = (former[axis] - ways.nodes[node][axis]) / ways.spacing
        if abs(off) > 1.0:
            fall = np.inf
        if ahead < 0 or behind < 0:
            continue
        slope, bend = 0.5 * (cost[ahead] - cost[behind]), cost[ahead] + cost[behind] - 2.0 * cost[node]
        if bend > 0.0:
            shift = min(max(-slope / bend, -0.5), 0.5)
            goal[axis] += shift * ways.spacing
            fall += (slope * off + 0.5 * bend * off * off) - (slope * shift + 0.5 * bend * shift * shift)
    return goal, fall
