"""Controllers that push robots apart: potential fields, and local dispersion.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from robocov.controllers.base import BaseController, Memory
from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    collect_obstacle_points,
    compute_drive_forces,
    sum_by_robot,
    update_returns,
)
from robocov.controllers.gains import choice, gain, response_time_gain
from robocov.controllers.known_cells import cells_choice, compute_known_cells
from robocov.locational_cost.best_points import HEIGHT_HELP, TARGET_HELP, TARGETS, find_targets
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.neighbors import NeighborPositions
from robocov.observation.observations import NeighborPairs
from robocov.observation.region import Region
from robocov.potential import (
    CONTACT_DISTANCE,
    PotentialForces,
    PotentialGains,
    compute_potential_forces,
    compute_separations,
)
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov.voronoi.delaunay import Mesh

_MIN_DISTANCE_M = 1e-9
"""Minimum divisor; prevents division by zero."""
_MIN_LENGTH = 1e-300
"""Minimum divisor; prevents division by zero."""
_MIN_CHARGE_DISTANCE_M = 0.05
"""Distance below which the forces of `Howard` are constant; robots in contact are farther apart."""
_WALL_FACTOR = 2.0 / (3.0 * math.pi)
"""Force of all rays that hit a straight wall, relative to that of a point charge at the same distance.

A ray at the angle θ hits a wall at the distance r / cos θ, so that its force across the wall is cos³ θ / r².
The factor is the integral of cos³ θ over half a turn, divided by the angle of a full turn.
"""
_MAX_LINK_STRETCH = 0.999
"""Fraction of the range of a link beyond which the force that maintains the link is constant."""
_MIN_EXPLORING_SPEED = 0.01
"""Speed in m/s below which a robot has no well-defined direction of motion."""
_BRAKING_FRACTION = 0.5
"""Fraction of the maximum acceleration that is assumed to be available to avoid collisions."""


def _compute_potential_forces(
    seen: Observations, goals: FloatArray, gains: PotentialGains, *, includes_robots: bool = True
) -> PotentialForces:
    """Return the forces of the potentials on all robots, optionally without those of other robots."""
    if includes_robots:
        neighbors = NeighborPositions.from_graph(seen.neighbors, seen.reported_positions)
    else:
        neighbors = NeighborPositions.build_empty(len(seen.positions))
    return compute_potential_forces(seen.positions, neighbors, seen.obstacle_points, goals, gains)


def _find_separated_neighbors(seen: Observations, max_distance: float) -> NeighborPairs:
    """Find near neighbors, and give robots at the same position a small offset from each other."""
    pairs = seen.find_neighbors(max_distance)
    is_same = pairs.distances < _MIN_DISTANCE_M
    directions = compute_separations(pairs.robots[is_same], pairs.neighbors[is_same])
    pairs.offsets[is_same] = _MIN_DISTANCE_M * directions
    return pairs


@dataclass(frozen=True)
class Rpf(BaseController):
    """Repulsive potential field (Howard, Mataric and Sukhatme 2002), equations (23)-(25).

    Each robot is pushed away from all neighbors within `rho_0` and from the closest obstacle point;
    viscosity brings the team to rest. The team often oscillates there, because the closest obstacle point
    jumps: the stronger the repulsion, the larger the oscillation. To follow the paper's protocol, which gives
    RPF and RAPF the same parameters, set `k_rep` and `rho_0` of both.

    Parameters
    ----------
    k_rep : float, N m³
        Strength of the repulsion (24).
    rho_0 : float, m
        Range of the repulsion (24).

    See Also
    --------
    Rapf : The same repulsion, and attraction to the centroid of the cell.

    Notes
    -----
    The force on a robot at q from a robot or an obstacle point at q_i, at a distance ρ below ρ0, is (24)::

        F_rep = k_rep (1/ρ - 1/ρ0) (q - q_i) / ρ³

    Below `robocov.potential.CONTACT_DISTANCE`, its magnitude is constant. The forces are summed over the
    neighbors and the closest obstacle point (25).

    Examples
    --------
    >>> import robocov as rc
    >>> rc.run("rooms", rc.Rpf(k_rep=1.0), robots=4, duration=1.0)
    <Record rpf on Rooms, 4 robots, 1.0 s>
    """

    name = "rpf"
    label = "RPF"
    summary = "repulsion only: by robots and by the nearest obstacle point, equations (23) to (25)"

    k_rep: float = gain(3.0, "N m³", "strength of the repulsion, (24)")
    rho_0: float = gain(4.0, "m", "range of the repulsion, (24)", low=0.01, high=1e4)

    def decide(self, seen: Observations, memory: object) -> Decision:
        """Compute the forces (24) of all neighbors and of the closest obstacle point.

        Parameters
        ----------
        seen : Observations
        memory : object
            From `begin` or the previous decision.

        Returns
        -------
        Decision
        """
        gains = PotentialGains(
            k_rep=float(self.k_rep), rho_0=float(self.rho_0), k_att=0.0, max_attraction=np.inf
        )
        forces = _compute_potential_forces(seen, seen.positions, gains)
        return Decision(
            forces=forces.total,
            terms={"repulsion_robots": forces.robots, "repulsion_obstacle": forces.obstacle},
            memory=memory,
        )


@dataclass(frozen=True)
class Rapf(BaseController):
    """Repulsive and attractive potential field (Renzaglia and Martinelli), equations (23)-(28).

    As with `Rpf`, but each robot is also attracted by the centroid of its Voronoi cell. The cells divide the
    known convex region and ignore the unknown obstacles; the repulsion keeps robots away from these. A
    centroid may lie in or behind an obstacle: the robot then comes to rest where the forces balance.

    A `target` other than the centroid is the optimum of the cell for another performance function f of the
    locational cost (4). With `cells` divided by time, and unequal maximum speeds, the target may lie outside
    the robot's own cell.

    An `attraction_limit` of at most the viscosity times the maximum speed (2 N for default robots) never
    drives a robot faster than its maximum speed, and robots stay clear of walls. None is the paper's (27),
    without a limit.

    Parameters
    ----------
    k_rep : float, N m³
        Strength of the repulsion (24).
    rho_0 : float, m
        Range of the repulsion (24).
    k_att : float, N/m³
        Strength of the attraction (27).
    attraction_limit : float or None, N
        Limit of the attraction; None is the paper's formula.
    cells : {"distance", "time"}
        Owner of a point: the nearest robot, or the one that reaches it first at its own maximum speed.
    target : {"centroid", "sensing", "median"}
        Goal of a robot in its cell: the optimum for f = r², for 1 / (r² + h²), or for r.
    height : float, m
        Height h of the sensor in (14), for the target "sensing".

    See Also
    --------
    Rpf : The repulsion alone.
    Lloyd : The goals alone.

    Notes
    -----
    The force is the repulsion (25) of `Rpf` plus the attraction (27) to the goal::

        F_att = k_att (q_goal - q) |q_goal - q|²

    The robots move by (28), m q'' = F - ν q', where ν is the `viscosity` of the team.

    Examples
    --------
    >>> import robocov as rc
    >>> room = rc.Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = rc.Simulation(room, rc.Rapf(), [[1.0, 1.0]])
    >>> simulation.run(20.0).positions[-1].round(1)
    array([[4., 3.]])
    """

    name = "rapf"
    label = "RAPF"
    summary = "the paper's controller: attraction to the centroid and repulsion, equations (23) to (28)"

    k_rep: float = gain(0.3, "N m³", "strength of the repulsion, (24)")
    rho_0: float = gain(2.0, "m", "range of the repulsion, (24)", low=0.01, high=1e4)
    k_att: float = gain(30.0, "N/m³", "strength of the attraction, (27)")
    attraction_limit: float | None = gain(
        2.0, "N", "limit of the attraction; null is the paper's formula", low=1e-6, optional=True
    )
    cells: str = cells_choice()
    target: str = choice("centroid", TARGETS, TARGET_HELP)
    height: float = gain(1.0, "m", HEIGHT_HELP, low=1e-6)

    def begin(self, region: Region, team: Team) -> None:
        """Return None, because the memory is the triangulation of the last cells, and there is none yet.

        Parameters
        ----------
        region : Region
            The known outer boundary.
        team : Team
        """

    def decide(self, seen: Observations, memory: Mesh | None) -> Decision:
        """Compute the forces (24) of neighbors and of the closest obstacle point, and (27) of the target.

        Parameters
        ----------
        seen : Observations
        memory : Mesh or None
            From `begin` or the previous decision.

        Returns
        -------
        Decision
        """
        cells = compute_known_cells(seen, self.cells, memory)
        goals = find_targets(cells, seen.density, self.target, self.height)
        gains = PotentialGains(
            k_rep=float(self.k_rep),
            rho_0=float(self.rho_0),
            k_att=float(self.k_att),
            max_attraction=np.inf if self.attraction_limit is None else float(self.attraction_limit),
        )
        forces = _compute_potential_forces(seen, goals, gains)
        terms = {
            "attraction": forces.attraction,
            "repulsion_robots": forces.robots,
            "repulsion_obstacle": forces.obstacle,
        }
        return Decision(
            forces=forces.total, goals=goals, terms=terms, cells=cells, memory=cells.triangulation
        )


@dataclass(frozen=True)
class Howard(BaseController):
    """Potential field of Howard, Mataric and Sukhatme (DARS 2002).

    Each robot is an electric charge among charges: each obstacle and each other robot in view repels it with
    k / r², without a limited range. Friction dissipates the energy until the team is at rest.

    Notes
    -----
    The equation of motion is m q'' = F - ν q', where ν is the gain `friction`, which replaces the viscosity
    of the robots.

    Obstacles are the points that the rays of the range sensor hit. Each ray carries an equal fraction of the
    charge `k_obs`, so that the force does not depend on the number of rays. Before the first scan, a straight
    wall through the closest obstacle point is assumed.

    We did not have the full text of the paper; details may differ. Three choices are our own: each ray
    carries a fraction of the charge; forces do not grow below 5 cm; and robots repel all others within
    communication range, because the range sensor does not detect robots.
    """

    name = "howard"
    label = "Potential field"
    summary = "potential field: obstacles in range and robots repel by 1/r², friction (Howard et al. 2002)"
    scanning = Scanning(rays=72, period=0.1)

    k_robots: float = gain(3.0, "N m²", "charge of the other robots")
    k_obs: float = gain(1.0, "N m²", "charge of the obstacles, summed over all rays")
    friction: float = gain(2.0, "N s/m", "ν, which replaces the robots' own viscosity", high=20.0)

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Compute the forces F - ν q', without the viscosity that the simulation adds."""
        returns = update_returns(seen, memory.returns)
        pairs = _find_separated_neighbors(seen, 2.0 * seen.region.diameter)
        robot_forces = sum_by_robot(
            pairs.robots, self.k_robots * _compute_inverse_squares(pairs.offsets), len(seen.positions)
        )
        if returns is None:
            offsets = np.nan_to_num(seen.positions - seen.obstacle_points)
            obstacle_forces = self.k_obs * _WALL_FACTOR * _compute_inverse_squares(offsets)
        else:
            # A ray that hits nothing has the offset nan, and exerts no force.
            offsets = np.nan_to_num(seen.positions[:, None] - returns)
            k_ray = self.k_obs / returns.shape[1]
            obstacle_forces = k_ray * _compute_inverse_squares(offsets).sum(axis=1)
        # The simulation subtracts the viscosity of the robots. It is added here, so that only ν remains.
        friction = seen.velocities * (memory.team.viscosity - self.friction)[:, None]
        return Decision(
            forces=robot_forces + obstacle_forces + friction,
            terms={
                "repulsion_robots": robot_forces,
                "repulsion_obstacle": obstacle_forces,
                "friction": friction,
            },
            memory=replace(memory, returns=returns),
        )


def _compute_inverse_squares(offsets: FloatArray) -> FloatArray:
    """Return vectors of length 1 / r² along offsets of length r, (..., 2); zero for an offset of zero."""
    distance = np.sqrt(offsets[..., 0] ** 2 + offsets[..., 1] ** 2)
    cube = np.maximum(distance, _MIN_CHARGE_DISTANCE_M) ** 2 * np.maximum(distance, _MIN_LENGTH)
    return np.asarray(offsets / cube[..., None])


@dataclass(frozen=True)
class Poduri(BaseController):
    """Constrained coverage (Poduri and Sukhatme, ICRA 2004): spread, but keep at least K neighbors.

    Robots at most R_c apart have a link. They repel each other along all links; along critical links, which
    keep the number of neighbors from falling below K, they also attract each other. Viscosity brings the
    team to rest.

    Notes
    -----
    Along a link of length d,

    - F_cover = k_cover / d² pushes the two robots apart, and
    - F_degree = k_degree / (R_c - d)² pulls the two robots of a critical link together. It grows without
      bound before the link breaks.

    At d = η R_c the two are equal: k_degree = k_cover (1/η - 1)².

    We did not have the full text of the paper; details may differ. The following choices are our own. If at
    most K robots are within η R_c of a robot, the links to its K nearest neighbors are critical for it, even
    if they are not about to break. Each robot also keeps a link that is critical for the neighbor, according
    to the positions that it knows. The R_c of a link is the smaller one of its two robots, because the link
    breaks there; the communication ranges of the others are assumed to be known. The closest obstacle point
    repels with (24), within `rho_obs`.

    Links are never lost if robots can exert these forces: two robots that move apart at full speed have to be
    able to stop within (1 - η) R_c.
    """

    name = "poduri"
    label = "Constrained coverage"
    summary = "spreads, but keeps at least K neighbors within R_c (Poduri and Sukhatme 2004)"

    neighbors: float = gain(
        2.0, "robots", "K, number of neighbors that each robot keeps", high=100.0, whole=True
    )
    link_range: float = gain(6.0, "m", "R_c, or the communication range if that is less", low=0.01, high=1e5)
    k_cover: float = gain(10.0, "N m²", "strength of F_cover")
    eta: float = gain(0.9, "R_c", "distance at which the two forces are equal", low=0.1, high=0.99)
    k_obs: float = gain(0.1, "N m³", "strength of the repulsion from the closest obstacle point")
    rho_obs: float = gain(2.0, "m", "range of the repulsion from obstacles", low=0.01, high=1e4)

    @property
    def _min_degree(self) -> float:
        """Minimum number of neighbors, K. The `neighbors` of links, in contrast, are robots."""
        return self.neighbors

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Compute the forces F_cover + F_degree and the repulsion of the closest obstacle point."""
        n = len(seen.positions)
        links, link_ranges = self._find_links(seen, memory.team)
        is_critical = self._find_critical_links(seen, links, link_ranges)
        directions = links.offsets / np.maximum(links.distances, _MIN_DISTANCE_M)[:, None]
        cover = self.k_cover / np.maximum(links.distances, CONTACT_DISTANCE) ** 2
        slack = link_ranges - np.minimum(links.distances, _MAX_LINK_STRETCH * link_ranges)
        k_degree = self.k_cover * (1.0 / self.eta - 1.0) ** 2
        degree = np.where(is_critical, k_degree / slack**2, 0.0)
        repulsion = sum_by_robot(links.robots, directions * cover[:, None], n)
        attraction = sum_by_robot(links.robots, directions * -degree[:, None], n)
        gains = PotentialGains(
            k_rep=float(self.k_obs), rho_0=float(self.rho_obs), k_att=0.0, max_attraction=np.inf
        )
        potential = _compute_potential_forces(seen, seen.positions, gains, includes_robots=False)
        terms = {
            "repulsion_robots": repulsion,
            "attraction": attraction,
            "repulsion_obstacle": potential.obstacle,
        }
        return Decision(forces=repulsion + attraction + potential.obstacle, terms=terms, memory=memory)

    def _find_links(self, seen: Observations, team: Team) -> tuple[NeighborPairs, FloatArray]:
        """Return the links of all robots, and the range R_c of each link, (k,) in meters."""
        max_ranges = np.minimum(team.communication_range, self.link_range)
        pairs = _find_separated_neighbors(seen, float(max_ranges.max()))
        link_ranges = np.minimum(max_ranges[pairs.robots], max_ranges[pairs.neighbors])
        is_linked = pairs.distances <= link_ranges
        links = NeighborPairs(
            robots=pairs.robots[is_linked],
            neighbors=pairs.neighbors[is_linked],
            offsets=pairs.offsets[is_linked],
            distances=pairs.distances[is_linked],
        )
        return links, link_ranges[is_linked]

    def _find_critical_links(
        self, seen: Observations, links: NeighborPairs, link_ranges: FloatArray
    ) -> BoolArray:
        """Return a mask of the links that are critical for one of their ends.

        A link is critical for the robot itself or, as far as the robot knows, for the neighbor.
        """
        n = len(seen.positions)
        # Entry (i, j) says whether robot j is within η R_c of robot i.
        is_near = np.zeros((n, n), dtype=bool)
        is_near[links.robots, links.neighbors] = links.distances <= self.eta * link_ranges
        rank = _rank_by_distance(links.robots, links.distances)
        has_few_near = is_near.sum(axis=1) <= self._min_degree
        is_critical: BoolArray = has_few_near[links.robots] & (rank < self._min_degree)
        # Only the other links have to be tested from the neighbor's point of view.
        others = np.flatnonzero(~is_critical)
        if seen.reported_positions is None:
            # Without reports, all robots use the same positions, so that all links can be tested together.
            is_critical[others] = self._is_critical_for_neighbor(seen, links, is_near, others)
        else:
            is_critical[others] = self._is_critical_by_reports(seen, links, link_ranges, others)
        return is_critical

    def _is_critical_for_neighbor(
        self, seen: Observations, links: NeighborPairs, is_near: BoolArray, selected: IntArray
    ) -> BoolArray:
        """Return whether the selected links are critical for the neighbor, as far as the robot can tell.

        A link is critical for the neighbor if at most K robots are near it, within η R_c, and fewer than K
        are nearer to it than the robot is. Only robots known to the robot count: itself and its neighbors.
        """
        knows = _find_known_robots(seen)
        # Entry (i, j) is the number of robots near j that robot i knows. Products of float matrices are much
        # faster than those of integers.
        near_counts = knows.astype(np.float32) @ is_near.astype(np.float32).T
        has_few_near = near_counts[links.robots, links.neighbors][selected] <= self._min_degree
        # The second condition needs n distances for each link, so it is tested only for these links.
        candidates = selected[has_few_near]
        distances = np.full(knows.shape, np.inf)
        distances[links.robots, links.neighbors] = links.distances
        # In all (c, n) arrays, row c belongs to candidate c, and column k to robot k.
        neighbor_distances = distances[links.neighbors[candidates]]
        own_distance = links.distances[candidates, None]
        is_nearer = neighbor_distances < own_distance
        is_known = knows[links.robots[candidates]]
        nearer_counts = (is_nearer & is_known).sum(axis=1)
        is_critical = np.zeros(len(selected), dtype=bool)
        is_critical[has_few_near] = nearer_counts < self._min_degree
        return is_critical

    def _is_critical_by_reports(
        self, seen: Observations, links: NeighborPairs, link_ranges: FloatArray, selected: IntArray
    ) -> BoolArray:
        """Return whether links are critical for the neighbor, according to the received positions.

        The conditions are those of `_is_critical_for_neighbor`. Here the robot knows its neighbors only from
        messages, so that each link is tested with the positions that this robot has received.
        """
        is_critical = np.zeros(len(selected), dtype=bool)
        for k, link in enumerate(selected.tolist()):
            robot = links.robots[link]
            neighbor_positions = seen.get_neighbor_positions(robot)
            index = int(np.flatnonzero(seen.neighbors.list_neighbors(robot) == links.neighbors[link])[0])
            # The distances of the robot's other neighbors from this one. The robot itself is near it as well
            # if the link is short enough.
            offsets = np.delete(neighbor_positions, index, axis=0) - neighbor_positions[index]
            distances = np.hypot(*offsets.T)
            near_range = self.eta * link_ranges[link]
            near_count = (distances <= near_range).sum() + (links.distances[link] <= near_range)
            nearer_count = (distances < links.distances[link]).sum()
            is_critical[k] = near_count <= self._min_degree and nearer_count < self._min_degree
        return is_critical


def _find_known_robots(seen: Observations) -> BoolArray:
    """Return whether robot i knows the position of robot j, (n, n): its own and those of its neighbors."""
    knows = np.eye(len(seen.positions), dtype=bool)
    robot, neighbor = seen.neighbors.list_pairs()
    knows[robot, neighbor] = True
    return knows


def _rank_by_distance(robot: IntArray, distance: FloatArray) -> IntArray:
    """Return the rank of each link, (m,), among those of its robot: 0 is the shortest.

    Links are sorted by robot; of links of equal length the first one has the lower rank.
    """
    rank_among_all = np.empty(len(robot), dtype=np.intp)
    rank_among_all[np.lexsort((distance, robot))] = np.arange(len(robot))
    first_link_of_robot = np.searchsorted(robot, robot)
    return rank_among_all - first_link_of_robot


@dataclass(frozen=True)
class Dispersion(BaseController):
    """Local dispersion, the anonymous variant (Batalin and Sukhatme 2002, "Spreading out").

    Three behaviors have priorities in this order:

    - *Avoid*: a robot approaches obstacle points and robots only so fast that the distance decreases
      exponentially to `clearance`, and slides along them.
    - *Disperse*: it moves away from all robots within `reach`, the faster the nearer they are, but at most at
      its maximum speed.
    - *Explore*: without robots within `reach` it moves straight on at `explore_speed`.

    Robots need neither identities nor communication.

    Notes
    -----
    We had only the paper's abstract, not its full text; details may differ. The formulas are our own. In the
    paper, robots move at constant speed and never come to rest. To make placements comparable,
    `explore_speed` is 0 by default, and the speed falls to zero at `reach`, so that robots do not oscillate
    there. Each robot assumes that others may be as large as the largest of the team.
    """

    name = "dispersion"
    label = "Dispersion"
    summary = "local dispersion: away from nearby robots, along obstacles (Batalin and Sukhatme 2002)"
    scanning = Scanning(rays=36, period=0.1)

    reach: float = gain(5.0, "m", "distance up to which a robot moves away from others", low=0.01, high=1e4)
    k_disperse: float = gain(1.0, "1/s", "desired speed per meter by which another robot is too close")
    explore_speed: float = gain(0.0, "m/s", "speed of a robot without others in reach", high=1e3)
    clearance: float = gain(
        0.2, "m", "minimum distance from the center of a robot to other surfaces", high=1e3
    )
    k_avoid: float = gain(2.0, "1/s", "maximum approach speed per meter beyond the clearance", high=60.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Compute the forces that track the velocities of the behavior with the highest priority."""
        team = memory.team
        returns = update_returns(seen, memory.returns)
        clearance = np.full(len(team), self.clearance)
        margins = Margins(
            clearance=clearance,
            separation=clearance + float(team.radius.max()),
            rate=self.k_avoid,
            braking=_BRAKING_FRACTION,
        )
        velocities = avoid_collisions(
            self._compute_velocities(seen, team), seen, team, collect_obstacle_points(seen, returns), margins
        )
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(forces=forces, terms={"attraction": forces}, memory=replace(memory, returns=returns))

    def _compute_velocities(self, seen: Observations, team: Team) -> FloatArray:
        """Return the velocities of the behaviors disperse and explore, (n, 2) m/s."""
        n = len(seen.positions)
        pairs = _find_separated_neighbors(seen, self.reach)
        rate = self.k_disperse * (self.reach / np.maximum(pairs.distances, _MIN_DISTANCE_M) - 1.0)
        velocities = sum_by_robot(pairs.robots, pairs.offsets * rate[:, None], n)
        if self.explore_speed > 0.0:
            current_speed = np.hypot(*seen.velocities.T)
            is_alone = np.bincount(pairs.robots, minlength=n) == 0
            is_exploring = is_alone & (current_speed > _MIN_EXPLORING_SPEED)
            speed_factor = self.explore_speed / current_speed[is_exploring]
            velocities[is_exploring] = seen.velocities[is_exploring] * speed_factor[:, None]
        speed = np.hypot(*velocities.T)
        clip_factor = np.minimum(1.0, team.max_speed / np.maximum(speed, _MIN_LENGTH))
        return np.asarray(velocities * clip_factor[:, None])
