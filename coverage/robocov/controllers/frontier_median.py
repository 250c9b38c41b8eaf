"""First explore, then place: coordinated frontier exploration and the k-median of the map that it leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from robocov.arrays import Array
from robocov.controllers.gains import gain
from robocov.controllers.shared_map import Candidates, SharedMapLaw, Situation, assigned
from robocov.k_median import choose_greedily, improve_sources
from robocov.planning.discovered_map import FREE, UNKNOWN

_LOOKED, _THERE = 0.5, 0.3  # metres around a place from where somebody has looked, and to it when he does
_STUCK = 0.05  # who gets on by less than so many metres between two plans is not going to get there
_BLOCK = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True)
class FrontierMedian(SharedMapLaw):
    """The two phases of the obvious solution: explore all of the building, then solve the k-median problem.

    *Exploration.* Frontiers are the borders of what is known to be free with what is unknown (Yamauchi 1997,
    and 1998 for several robots, which share their maps). Who goes to which is by Burgard, Moors, Stachniss
    and Schneider (IEEE T-RO 21, 2005): of all robots i and targets t that pair comes first for which

        U_t - beta V_t^i

    is the largest, where V is the length of the way and the utility U is 1 at first. It is then lowered for
    targets t' within sensing range R in view of t, which will be seen from there, by 1 - |t - t'| / R; so on
    for the other robots.

    *Placement.* When no frontier is left they go to the k-median of what is known to be free: the greedy
    solution, improved by Lloyd's iteration and interchange (`robocov.k_median`), then on a finer lattice.

    Decided here: targets are as far apart as the nodes of the lattice of ways. Specks that rays have missed
    are no frontier, nor are frontiers shorter than `shortest`, or that robots cannot get through. A frontier
    that stays though somebody has looked there, or does not get on towards it, is left alone. A robot for
    which no target has any utility left stays where it is; in the paper it would go all the same.

    Taken from the abstracts of the papers and what is generally known of them, not from their text.
    """

    name = "frontier-median"
    label = "Frontiers, then k-median"
    summary = "explores by frontiers (Yamauchi 1997, Burgard et al. 2005), then goes to the map's k-median"

    period: float = gain(1.0, "s", "between two plans", low=0.05, high=60.0)
    beta: float = gain(0.05, "1/m", "utility that a metre of way is worth", high=1e3)
    shortest: float = gain(0.15, "m", "length of a frontier that is worth going to", high=100.0)
    threshold: float = gain(0.01, "1", "part of the cost that another placement must save", high=1.0)

    def placed(self, now: Situation) -> tuple[Array, bool, Array]:
        looked = self._looked(now)
        targets = self._targets(now, looked)
        if len(targets):
            return self._shares(now, targets), False, looked
        return self._median(now), True, looked

    def _looked(self, now: Situation) -> Array:
        """Return the targets that nobody has to go to any more, (m, 2) m."""
        if now.former is None or now.former.final:
            return np.empty((0, 2)) if now.former is None else now.former.notes
        former = now.former
        there = np.sqrt(((now.at - now.begin) ** 2).sum(axis=1)) < _THERE
        before = np.sqrt(((now.at[:, None] - former.group.at) ** 2).sum(axis=2)).min(axis=1)
        done = now.begin[there | (np.isfinite(now.begin[:, 0]) & (before < _STUCK))]
        return np.unique(np.vstack([former.notes, done]), axis=0)

    def _targets(self, now: Situation, looked: Array) -> Array:
        """Return places on the frontiers, (t, 2) m."""
        raster, ways, window = now.known.raster, now.ways, now.ways.window
        state = window.crop(now.known.state, np.uint8(FREE))
        unknown = (state == UNKNOWN) & ~window.crop(raster.is_outside, True)
        # between two rays that are just as far apart there is nothing to look for
        inside = ndimage.binary_opening(unknown, _BLOCK) & ~ways.is_tight
        frontier = (state == FREE) & ~ways.is_tight & ndimage.binary_dilation(inside)
        part, _ = ndimage.label(frontier, _BLOCK)
        row, column = np.nonzero(
            frontier & (np.bincount(part.ravel()) * raster.cell_size >= self.shortest)[part]
        )
        block = row // window.stride * window.columns + column // window.stride
        _, first = np.unique(part[row, column] * len(ways.nodes) + block, return_index=True)
        targets = raster.compute_centers(row[first] + window.first_row, column[first] + window.first_column)
        square = ((targets[:, None] - looked) ** 2).sum(axis=2).min(axis=1, initial=np.inf)
        return np.asarray(targets[square > _LOOKED**2])

    def _shares(self, now: Situation, targets: Array) -> Array:
        """Return where each robot is to look, (k, 2) m."""
        ways, goals = now.ways, now.at.copy()
        roomy = np.flatnonzero(ways.is_roomy)
        nodes = roomy[((targets[:, None] - ways.nodes[roomy]) ** 2).sum(axis=2).argmin(axis=1)]
        cost = np.array([ways.compute_distances_from(at[None])[nodes] for at in now.at])
        utility, left = np.ones(len(targets)), np.ones(len(goals), dtype=bool)
        for _ in range(len(goals)):
            worth = np.where(left[:, None] & (utility > 0.0), utility - self.beta * cost, -np.inf)
            robot, target = np.unravel_index(worth.argmax(), worth.shape)
            if worth[robot, target] == -np.inf:
                break
            goals[robot], left[robot] = targets[target], False
            away = np.sqrt(((targets - targets[target]) ** 2).sum(axis=1))
            in_view = (away < now.reach) & ways.find_clear_lines(targets[target], targets, ways.is_blocked)
            utility -= np.where(in_view, 1.0 - away / now.reach, 0.0)
        return goals

    def _median(self, now: Situation) -> Array:
        """Return where each robot is to be at last, (k, 2) m."""
        weights = now.weights(now.known.state == FREE)
        among = Candidates.at_nodes(now, weights, now.ways.sources)
        if len(among.places) < len(now.at):
            return now.at
        kept = now.former is not None and now.former.final and np.isfinite(now.begin).all()
        begin = among.nearest(now.begin) if kept else choose_greedily(among.table, len(now.at))
        chosen = improve_sources(among.table, begin, np.zeros(len(begin), dtype=bool), self.threshold * kept)
        return assigned(now, among.refined(now, weights, chosen))
