"""Laws by which robots push each other apart: potential fields, and local dispersion."""

from dataclasses import dataclass, replace

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
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
from robocov.observation.neighbours import NeighbourPositions
from robocov.observation.region import Region
from robocov.potential import (
    CONTACT_DISTANCE,
    PotentialForces,
    PotentialGains,
    compute_potential_forces,
    compute_separations,
)
from robocov.team import Team
from robocov.voronoi.delaunay import Mesh

_TOGETHER = 1e-9  # metres at which robots in one place are taken to be
_NEAREST = 0.05  # metres below which Howard's forces no longer grow; robots that touch are farther apart
_WALL = 2.0 / (3.0 * np.pi)  # what a wall does by all its rays, in parts of what a point as near does
_STRETCHED = 0.999  # part of the range of a link beyond which the force that holds it no longer grows
_STILL = 0.01  # speed in m/s below which a robot has no direction in which it could go on


def _compute_potential_forces(
    seen: Observations, goals: Array, gains: PotentialGains, *, includes_robots: bool = True
) -> PotentialForces:
    """Return the forces of the potentials on all robots, from what they observe."""
    if includes_robots:
        neighbours = NeighbourPositions.from_graph(seen.neighbours, seen.reported_positions)
    else:
        neighbours = NeighbourPositions.build_empty(len(seen.positions))
    return compute_potential_forces(seen.positions, neighbours, seen.obstacle_points, goals, gains)


def _close_pairs(seen: Observations, reach: float) -> tuple[IntArray, IntArray, Array, Array]:
    """Return `find_near_neighbours`, with a direction apart for robots in one place, too."""
    robot, neighbour, offset, distance = seen.find_near_neighbours(reach)
    together = distance < _TOGETHER
    offset[together] = _TOGETHER * compute_separations(robot[together], neighbour[together])
    return robot, neighbour, offset, distance


@dataclass(frozen=True)
class Rpf(BaseController):
    """Repulsive potential field (Howard, Mataric and Sukhatme 2002), equations (23)-(25).

    Every robot is pushed away from the neighbours within `rho_0` and from the single closest
    obstacle point; viscosity brings the team to rest. The team often trembles there, because the
    single nearest obstacle point jumps, and the more the stronger the repulsion is, while it spreads
    hardly better. For the paper's protocol, which gives RPF and RAPF the same potential
    parameters, set `k_rep` and `rho_0` for both.
    """

    name = "rpf"
    label = "RPF"
    summary = "repulsion from robots and the nearest obstacle only, (23)-(25)"

    k_rep: float = gain(3.0, "N m³", "strength of the repulsion, (24)")
    rho_0: float = gain(4.0, "m", "range of the repulsion, (24)", low=0.01, high=1e4)

    def decide(self, seen: Observations, memory: object) -> Decision:
        gains = PotentialGains(float(self.k_rep), float(self.rho_0), k_att=0.0, max_attraction=np.inf)
        forces = _compute_potential_forces(seen, seen.positions, gains)
        terms = {"repulsion_robots": forces.robots, "repulsion_obstacle": forces.obstacle}
        return Decision(forces.total, terms=terms, memory=memory)


@dataclass(frozen=True)
class Rapf(BaseController):
    """Repulsive and attractive potential field (Renzaglia and Martinelli), equations (23)-(28).

    As RPF, but every robot is also drawn to the centroid of its Voronoi cell of the known convex
    region. The cells ignore the unknown obstacles; the repulsion keeps robots off them.
    Another `target` than the centroid is the optimum of the cell for another locational cost (4).
    The goal may lie in or behind an obstacle: then the robot rests where the forces balance. With `cells` by
    time, where robots are not equally fast, it may lie outside of the robot's own cell as well.

    With `attraction_limit` at viscosity x maximum speed (2 N by default) the attraction never
    exceeds what drives a robot at full speed, and no wall is touched; None is the paper's (27).
    """

    name = "rapf"
    label = "RAPF"
    summary = "the paper's law: short-range repulsion + attraction to the cell's centroid, (23)-(28)"

    k_rep: float = gain(0.3, "N m³", "strength of the repulsion, (24)")
    rho_0: float = gain(2.0, "m", "range of the repulsion, (24)", low=0.01, high=1e4)
    k_att: float = gain(30.0, "N/m³", "strength of the attraction, (27)")
    attraction_limit: float | None = gain(
        2.0, "N", "cap of the attraction; null is the paper's formula", low=1e-6, optional=True
    )
    cells: str = cells_choice()
    target: str = choice("centroid", TARGETS, TARGET_HELP)
    height: float = gain(1.0, "m", HEIGHT_HELP, low=1e-6)

    def begin(self, region: Region, team: Team) -> None:
        """Nothing is remembered yet; later, the triangulation from which the next cells start."""

    def decide(self, seen: Observations, memory: Mesh | None) -> Decision:
        cells = compute_known_cells(seen, self.cells, memory)
        goals = find_targets(cells, seen.density, self.target, self.height)
        max_attraction = np.inf if self.attraction_limit is None else float(self.attraction_limit)
        gains = PotentialGains(float(self.k_rep), float(self.rho_0), float(self.k_att), max_attraction)
        forces = _compute_potential_forces(seen, goals, gains)
        terms = {
            "attraction": forces.attraction,
            "repulsion_robots": forces.robots,
            "repulsion_obstacle": forces.obstacle,
        }
        return Decision(forces.total, goals, terms, cells, cells.triangulation)


@dataclass(frozen=True)
class Howard(BaseController):
    """Potential field of Howard, Mataric and Sukhatme (DARS 2002).

    Every robot is an electric charge among charges: the potential is the sum of k / r over all that the
    robot's sensors see, so that each obstacle and each robot pushes with k / r², without a range of its
    own. The equation of motion is m q'' = F - nu q' with the law's own friction, which takes the energy
    out until the team is at rest.

    The obstacles are what the rays of the range sensor meet. Each ray carries its share of the charge,
    so that `k_obs` means the same however many rays there are. Where there has been no scan yet, the
    closest point stands for a straight wall across. Below 5 cm the forces no longer grow.

    Taken from what is generally known of the paper, not from its text: sum over all ranged obstacles
    and robots, inverse-square forces, viscous friction. Decided here: the share of a ray, the cap
    below 5 cm, and that the robots are those which are heard, as the range sensor does not see robots.
    """

    name = "howard"
    label = "Potential field"
    summary = "potential field: all ranged obstacles and robots repel by 1/r², friction (Howard et al. 2002)"
    scanning = Scanning(rays=72, period=0.1)

    k_robots: float = gain(3.0, "N m²", "charge of the other robots")
    k_obs: float = gain(1.0, "N m²", "charge of the obstacles, over a full turn of rays")
    friction: float = gain(2.0, "N s/m", "nu of the law, in place of the robots' own", high=20.0)

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Return the forces F - nu q', but for what the world's viscosity does already."""
        returns = update_returns(seen, memory.returns)
        robot, _, offset, _ = _close_pairs(seen, 2.0 * seen.region.diameter)
        robots = sum_by_robot(robot, self.k_robots * _inverse_square(offset), len(seen.positions))
        if returns is None:
            offset = np.nan_to_num(seen.positions - seen.obstacle_points)
            obstacle = self.k_obs * _WALL * _inverse_square(offset)
        else:
            # nan where a ray met nothing
            offset = np.nan_to_num(seen.positions[:, None] - returns)
            obstacle = self.k_obs / returns.shape[1] * _inverse_square(offset).sum(axis=1)
        friction = seen.velocities * (memory.team.viscosity - self.friction)[:, None]
        terms = {"repulsion_robots": robots, "repulsion_obstacle": obstacle, "friction": friction}
        return Decision(robots + obstacle + friction, terms=terms, memory=replace(memory, returns=returns))


def _inverse_square(offset: Array) -> Array:
    """Return (..., 2) vectors along the offsets, of length 1 / r²; zero where the offset is."""
    distance = np.sqrt(offset[..., 0] ** 2 + offset[..., 1] ** 2)
    scale = np.maximum(distance, _NEAREST) ** 2 * np.maximum(distance, 1e-300)
    return np.asarray(offset / scale[..., None])


@dataclass(frozen=True)
class Poduri(BaseController):
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

    name = "poduri"
    label = "Constrained coverage"
    summary = "spreads, but keeps at least K neighbours within R_c (Poduri and Sukhatme 2004)"

    neighbours: float = gain(2.0, "robots", "K, the neighbours that each robot keeps", high=100.0, whole=True)
    link_range: float = gain(6.0, "m", "R_c, or the communication range if that is less", low=0.01, high=1e5)
    k_cover: float = gain(10.0, "N m²", "strength of F_cover")
    eta: float = gain(0.9, "R_c", "distance at which the two forces are equal", low=0.1, high=0.99)
    k_obs: float = gain(0.1, "N m³", "strength of the repulsion from the closest obstacle point")
    rho_obs: float = gain(2.0, "m", "range of that repulsion", low=0.01, high=1e4)

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        """Return the forces F_cover + F_degree and the repulsion from the obstacle."""
        n, limit = len(seen.positions), np.minimum(memory.team.communication_range, self.link_range)
        robot, neighbour, offset, distance = _close_pairs(seen, float(limit.max()))
        reach = np.minimum(limit[robot], limit[neighbour])
        linked = distance <= reach
        robot, neighbour, reach = robot[linked], neighbour[linked], reach[linked]
        offset, distance = offset[linked], distance[linked]
        critical = self._critical(seen, robot, neighbour, distance, reach)
        way = offset / np.maximum(distance, _TOGETHER)[:, None]
        cover = self.k_cover / np.maximum(distance, CONTACT_DISTANCE) ** 2
        spare = reach - np.minimum(distance, _STRETCHED * reach)
        degree = np.where(critical, self.k_cover * (1.0 / self.eta - 1.0) ** 2 / spare**2, 0.0)
        apart = sum_by_robot(robot, way * cover[:, None], n)
        held = sum_by_robot(robot, way * -degree[:, None], n)
        gains = PotentialGains(float(self.k_obs), float(self.rho_obs), k_att=0.0, max_attraction=np.inf)
        obstacle = _compute_potential_forces(seen, seen.positions, gains, includes_robots=False).obstacle
        terms = {"repulsion_robots": apart, "attraction": held, "repulsion_obstacle": obstacle}
        return Decision(apart + held + obstacle, terms=terms, memory=memory)

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
        first, second = seen.neighbours.list_pairs()
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
            ids, places = seen.neighbours.list_neighbours(i), seen.get_neighbour_positions(i)
            here = int(np.flatnonzero(ids == j)[0])
            away = np.hypot(*(np.delete(places, here, axis=0) - places[here]).T)
            counts.append(((away <= self.eta * limit).sum() + (far <= self.eta * limit), (away < far).sum()))
        crowd, nearer = np.array(counts, dtype=np.intp).reshape(-1, 2).T
        return crowd, nearer


def _rank(robot: IntArray, distance: Array) -> IntArray:
    """Return for links, sorted by robot, how many of the robot's are shorter; of equal ones the first is."""
    rank = np.empty(len(robot), dtype=np.intp)
    rank[np.lexsort((distance, robot))] = np.arange(len(robot))
    return rank - np.searchsorted(robot, robot)


@dataclass(frozen=True)
class Dispersion(BaseController):
    """Local dispersion, the anonymous variant (Batalin and Sukhatme 2002, "Spreading out").

    Three behaviours, the first that has something to say before the others. *Avoid*: whatever is
    wanted, towards obstacle points and robots one goes only so fast that the distance falls
    exponentially to `clearance`; along them, it slides. *Disperse*: away from all robots within `reach`,
    by the sum of how much each is too near, at full speed at most. *Explore*: with nobody near, straight
    on at `explore_speed`. Robots need neither to be told apart nor to say anything.

    The paper's robots go at constant speed, and never rest. For placements to compare, a robot that is
    alone rests by default, and the speed falls to zero at `reach`, so that nobody trembles there.

    Taken from the paper's abstract and what is generally known of it, not from its text, are the
    behaviours and their order; the formula of each is made here. That others may be as large as the
    largest of the team is taken for granted.
    """

    name = "dispersion"
    label = "Dispersion"
    summary = "local dispersion: away from robots that are near, along obstacles (Batalin and Sukhatme 2002)"
    scanning = Scanning(rays=36, period=0.1)

    reach: float = gain(5.0, "m", "distance up to which others are fled", low=0.01, high=1e4)
    k_disperse: float = gain(1.0, "1/s", "wanted speed per metre that another robot is too near")
    explore_speed: float = gain(0.0, "m/s", "speed of a robot that nobody is near", high=1e3)
    clearance: float = gain(0.2, "m", "distance from others' surfaces, to the centre", high=1e3)
    k_avoid: float = gain(
        2.0, "1/s", "approach speed per metre that the closest one is farther away", high=60.0
    )
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: Memory) -> Decision:
        team, returns = memory.team, update_returns(seen, memory.returns)
        keep, points = np.full(len(team), self.clearance), collect_obstacle_points(seen, returns)
        wanted, apart = self._dispersing(seen, team), keep + float(team.radius.max())
        wanted = avoid_collisions(wanted, seen, team, points, Margins(keep, apart, self.k_avoid, 0.5))
        forces = compute_drive_forces(wanted, seen, team, self.response_time)
        return Decision(forces, terms={"attraction": forces}, memory=replace(memory, returns=returns))

    def _dispersing(self, seen: Observations, team: Team) -> Array:
        n = len(seen.positions)
        robot, _, offset, distance = _close_pairs(seen, self.reach)
        flight = offset * (self.k_disperse * (self.reach / np.maximum(distance, _TOGETHER) - 1.0))[:, None]
        wanted = sum_by_robot(robot, flight, n)
        if self.explore_speed > 0.0:
            speed = np.hypot(*seen.velocities.T)
            alone = (np.bincount(robot, minlength=n) == 0) & (speed > _STILL)
            wanted[alone] = seen.velocities[alone] * (self.explore_speed / speed[alone])[:, None]
        speed = np.hypot(*wanted.T)
        return np.asarray(wanted * np.minimum(1.0, team.max_speed / np.maximum(speed, 1e-300))[:, None])
