"""Poduri and Sukhatme's constrained coverage: spread, but keep at least K neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.controllers.driving import summed
from robocov.controllers.gains import WithGains, gain
from robocov.controllers.repulsion import forces_seen
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.potential import CONTACT_DISTANCE, separation
from robocov.robots import Team

_TOGETHER = 1e-9
"""Distance in metres at which robots in one place are taken to be."""

_STRETCHED = 0.999
"""Part of the range of a link beyond which the force that holds it no longer grows."""


@dataclass(frozen=True)
class Poduri(WithGains):
    """Constrained coverage (Poduri and Sukhatme, ICRA 2004): area, with a degree of at least K.

    Two robots have a link when they are at most R_c apart. F_cover pushes every linked pair apart with
    k_cover / d². F_degree pulls a pair whose link is critical together with k_degree / (R_c - d)², which
    no link survives to lose. At d = eta R_c the two are equal: k_degree = k_cover (1/eta - 1)². The
    viscosity of the robots brings the team to rest.

    Decided here: the links of a robot to its K nearest are critical for it as soon as no more than K
    robots are within eta R_c, that is, before they are in danger. A link is held from both its ends: as
    robots hear positions only, each also holds a link that, by what it hears, the other may need. That
    none is lost takes robots that can do what the forces ask for: two that part at full speed must be
    able to stop within (1 - eta) R_c. The closest obstacle point pushes as (24) does, within `rho_obs`.

    Taken from what is generally known of the paper, not from its text, are the two forces, their
    balance at eta R_c and the degree of at least K; the repulsion from obstacles is (24), as RAPF has it.
    """

    name: ClassVar[str] = "poduri"
    label: ClassVar[str] = "Constrained coverage"
    summary: ClassVar[str] = "spreads, but keeps at least K neighbours within R_c (Poduri and Sukhatme 2004)"

    neighbours: float = gain(2.0, "robots", "K, the neighbours that each robot keeps", high=100.0, whole=True)
    link_range: float = gain(6.0, "m", "R_c, or the communication range if that is less", low=0.01, high=1e5)
    k_cover: float = gain(10.0, "N m²", "strength of F_cover")
    eta: float = gain(0.9, "R_c", "distance at which the two forces are equal", low=0.1, high=0.99)
    k_obs: float = gain(0.1, "N m³", "strength of the repulsion from the closest obstacle point")
    rho_obs: float = gain(2.0, "m", "range of that repulsion", low=0.01, high=1e4)

    def begin(self, region: Region, team: Team) -> Array:
        """Return the range of each robot's links, (n,) m."""
        return np.minimum(team.communication_range, self.link_range)

    def decide(self, seen: Observations, memory: Array) -> Decision:
        """Return the forces F_cover + F_degree and the repulsion from the obstacle."""
        n = len(seen.positions)
        robot, neighbour, offset, distance = seen.neighbours_within(float(memory.max()))
        reach = np.minimum(memory[robot], memory[neighbour])
        linked = distance <= reach
        robot, neighbour, reach = robot[linked], neighbour[linked], reach[linked]
        offset, distance = offset[linked], distance[linked]
        together = distance < _TOGETHER
        offset[together] = _TOGETHER * separation(robot[together], neighbour[together])
        critical = self._critical(seen, robot, neighbour, distance, reach)
        way = offset / np.maximum(distance, _TOGETHER)[:, None]
        cover = self.k_cover / np.maximum(distance, CONTACT_DISTANCE) ** 2
        spare = reach - np.minimum(distance, _STRETCHED * reach)
        degree = np.where(critical, self.k_cover * (1.0 / self.eta - 1.0) ** 2 / spare**2, 0.0)
        apart, held = summed(robot, way * cover[:, None], n), summed(robot, way * -degree[:, None], n)
        obstacle = forces_seen(seen, seen.positions, self.k_obs, self.rho_obs, from_robots=False)[3]
        return Decision(
            forces=apart + held + obstacle,
            terms={"repulsion_robots": apart, "attraction": held, "repulsion_obstacle": obstacle},
            memory=memory,
        )

    def _critical(
        self, seen: Observations, robot: IntArray, neighbour: IntArray, distance: Array, reach: Array
    ) -> BoolArray:
        """Return for (m,) links whether the robot holds them, for its own sake or for the neighbour's."""
        n, most = len(seen.positions), self.neighbours
        near = np.zeros((n, n), dtype=bool)
        near[robot, neighbour] = distance <= self.eta * reach
        # for its own sake: one of its K nearest, while at most K are near
        critical: BoolArray = (near.sum(axis=1)[robot] <= most) & (_rank(robot, distance) < most)
        # for the neighbour's: by the same rule, on those of the neighbour's neighbours that the robot hears
        if seen.reported_positions is not None:
            ask = np.flatnonzero(~critical)
            crowd, nearer = self._counted(seen, robot[ask], neighbour[ask], distance[ask], reach[ask])
            critical[ask] = (crowd <= most) & (nearer < most)
            return critical
        knows = np.eye(n, dtype=bool)
        first, second = seen.neighbours.pairs()
        knows[first, second] = True
        known = knows.astype(np.float32) @ near.astype(np.float32).T
        ask = np.flatnonzero(~critical & (known[robot, neighbour] <= most))
        away = np.full((n, n), np.inf)
        away[robot, neighbour] = distance
        nearer = ((away[neighbour[ask]] < distance[ask, None]) & knows[robot[ask]]).sum(axis=1)
        critical[ask] = nearer < most
        return critical

    def _counted(
        self, seen: Observations, robot: IntArray, neighbour: IntArray, distance: Array, reach: Array
    ) -> tuple[IntArray, IntArray]:
        """Return for links how many robots are near the neighbour, and nearer to it, by what was heard."""
        counts = []
        for i, j, far, limit in zip(robot.tolist(), neighbour.tolist(), distance, reach, strict=True):
            ids, places = seen.neighbours.of(i), seen.neighbour_positions(i)
            here = int(np.flatnonzero(ids == j)[0])
            away = np.hypot(*(np.delete(places, here, axis=0) - places[here]).T)
            counts.append(((away <= self.eta * limit).sum() + (far <= self.eta * limit), (away < far).sum()))
        crowd, nearer = np.array(counts, dtype=np.intp).reshape(-1, 2).T
        return crowd, nearer


def _rank(robot: IntArray, distance: Array) -> IntArray:
    """Return for links, sorted by robot, how many of the robot's are shorter; of equal ones the first is."""
    order = np.lexsort((distance, robot))
    first = np.searchsorted(robot, robot)
    rank = np.empty(len(robot), dtype=np.intp)
    rank[order] = np.arange(len(robot))
    return rank - first
