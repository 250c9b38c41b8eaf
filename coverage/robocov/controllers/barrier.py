"""Lloyd's algorithm with safety barrier certificates: no robot comes closer than the safe distance."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.controllers.base import BaseController, Memory
from robocov.controllers.driving import (
    arrange_in_rows,
    clip_lengths,
    collect_obstacle_points,
    compute_approach_velocities,
    find_nearest_allowed_points,
    update_returns,
)
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.known_cells import cells_choice, compute_known_cells
from robocov.observation import Decision, NeighborPairs, Observations, Scanning
from robocov.potential import compute_separations
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

_ROUNDING_M = 1e-3
"""Length over which the square root in h, which is vertical at the safe distance, is rounded."""
_MIN_DISTANCE_M = 1e-9
"""Minimum divisor; prevents division by zero."""
_MIN_PASSING_CLEARANCE_M = 1e-3
"""Length added to the safe gap, which may be 0, to obtain the minimum divisor d in the limit v²/d of robots
that move past each other."""
_MIN_NORM = 1e-300
"""Minimum divisor; prevents division by zero."""


class NeighborReports(NamedTuple):
    """Reported positions of near robots at one time."""

    time: float
    """Simulation time, s."""
    pairs: IntArray
    """(k,) One number for each pair of a robot and a neighbor: robot * n + neighbor, ascending."""
    positions: FloatArray
    """(k, 2) Reported position of the neighbor in each pair, m."""


class HalfPlanes(NamedTuple):
    """Half planes that contain the allowed accelerations a of each robot: normals · a <= limits."""

    normals: FloatArray
    """(n, k, 2) Unit normals; nan for no constraint."""
    limits: FloatArray
    """(n, k) Maximum acceleration along each normal, m/s²."""


@dataclass(frozen=True, slots=True, eq=False)
class BarrierMemory(Memory):
    """Memory of the robots, with the reports of near neighbors at the last step."""

    reports: NeighborReports | None = None


@dataclass(frozen=True)
class Barrier(BaseController):
    """Lloyd's algorithm, filtered by safety barrier certificates (Wang, Ames and Egerstedt 2017).

    Two robots that brake as hard as they can must come to rest at the safe distance D_s or before it:

        h_ij = sqrt(2 (alpha_i + alpha_j) (|dp| - D_s)) + dp · dv / |dp| >= 0

    This is ensured by dh_ij/dt >= -gamma h_ij³, which is linear in the accelerations. Robot i is responsible
    for the fraction alpha_i / (alpha_i + alpha_j) of this constraint, so that both robots decide
    independently. The desired acceleration, here Lloyd's, is changed as little as these half planes require:
    one quadratic program for each robot, solved exactly. If no acceleration is allowed, the robot brakes. An
    obstacle point does not brake: alpha_j = 0. The closest point of a wall moves along the wall when a robot
    passes, so the term for moving sideways past a single point is left out.

    Robots do not know the velocities of others: each derives them from two reported positions. Obstacle
    points are the closest one and those of the last scan. The bodies and limits of the others are assumed to
    be known. The square root is rounded over the last millimeter, and continued as an odd function within the
    safe distance, so robots that start too close to each other separate.

    We had only summaries of the paper (IEEE T-RO 33, 661-674), not its full text; details may differ. h_ij is
    taken from the documentation of MathWorks' barrier certificate block.
    """

    name = "barrier"
    label = "Lloyd, barrier"
    summary = "Lloyd's algorithm with safety barrier certificates (Wang, Ames and Egerstedt 2017)"
    scanning = Scanning(rays=72, period=0.1)
    memory_type = BarrierMemory

    safe_gap: float = gain(0.05, "m", "minimum distance between surfaces: D_s minus the radii", high=100.0)
    gamma: float = gain(20.0, "s/m²", "rate at which h may decrease, as gamma h³", low=1e-3)
    braking: float = gain(
        0.8,
        "a_max",
        "α, fraction of the maximum acceleration assumed available for braking",
        low=0.05,
        high=1.0,
    )
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()

    def decide(self, seen: Observations, memory: BarrierMemory) -> Decision:
        """Compute the forces of the certified accelerations that are nearest to Lloyd's."""
        team = memory.team
        cells = compute_known_cells(seen, self.cells, memory.triangulation)
        offsets = cells.centroids - seen.positions
        velocities = compute_approach_velocities(offsets, self.k_prop, team.max_speed)
        desired = (velocities - seen.velocities) / self.response_time
        accelerations, memory = self.certify(seen, memory, desired)
        forces = accelerations * team.mass[:, None] + seen.velocities * team.viscosity[:, None]
        # The correction by the barriers is the difference from the attainable part of Lloyd's acceleration.
        scale = team.max_acceleration / np.maximum(np.hypot(*desired.T), _MIN_NORM)
        attainable = desired * np.minimum(1.0, scale)[:, None]
        corrections = (accelerations - attainable) * team.mass[:, None]
        return Decision(
            forces=forces,
            goals=cells.centroids,
            terms={"attraction": forces - corrections, "barrier": corrections},
            cells=cells,
            memory=replace(memory, triangulation=cells.triangulation),
        )

    def certify(
        self, seen: Observations, memory: BarrierMemory, desired: FloatArray
    ) -> tuple[FloatArray, BarrierMemory]:
        """Return the certified accelerations that are nearest to the desired ones.

        Parameters
        ----------
        seen : Observations
        memory : BarrierMemory
        desired : (n, 2) array, m/s²

        Returns
        -------
        accelerations : (n, 2) array, m/s²
        memory : BarrierMemory
        """
        team = memory.team
        returns = update_returns(seen, memory.returns)
        near = self._find_near_neighbors(seen, team)
        reports = _collect_reports(near, seen)
        neighbor_velocities = _derive_velocities(reports, memory.reports, team.max_speed[near.neighbors])
        robot_planes = self._build_robot_planes(seen, team, near, neighbor_velocities)
        obstacle_points = collect_obstacle_points(seen, returns)
        obstacle_planes = self._build_obstacle_planes(seen, team, obstacle_points)
        nearest, is_feasible = find_nearest_allowed_points(
            desired,
            np.concatenate([robot_planes.normals, obstacle_planes.normals], axis=1),
            np.concatenate([robot_planes.limits, obstacle_planes.limits], axis=1),
            team.max_acceleration,
        )
        # A robot that is allowed no acceleration brakes within the response time, or as hard as possible.
        speed = np.hypot(*seen.velocities.T)
        rate = -np.minimum(1.0 / self.response_time, team.max_acceleration / np.maximum(speed, _MIN_NORM))
        accelerations = np.where(is_feasible[:, None], nearest, seen.velocities * rate[:, None])
        return accelerations, replace(memory, reports=reports, returns=returns)

    def _find_near_neighbors(self, seen: Observations, team: Team) -> NeighborPairs:
        """Find the neighbors that are close enough to constrain a robot."""
        min_distance = 2.0 * float(team.radius.max()) + self.safe_gap
        # Upper bound on the distance that two robots need to stop if they meet at full speed.
        stopping_distance = (
            2.0 * float(team.max_speed.max()) ** 2 / float(self._compute_braking_limits(team).min())
        )
        # At twice that distance, gamma h³ is so large that the constraint has no effect.
        return seen.find_neighbors(min_distance + 2.0 * stopping_distance)

    def _compute_braking_limits(self, team: Team) -> FloatArray:
        """Return alpha, the deceleration that each robot is assumed to be capable of, (n,) m/s²."""
        return np.asarray(self.braking * team.max_acceleration)

    def _build_robot_planes(
        self, seen: Observations, team: Team, near: NeighborPairs, neighbor_velocities: FloatArray
    ) -> HalfPlanes:
        """Return the half planes that keep robots apart.

        Two robots may accelerate toward each other by at most the limit of `_compute_approach_limit` plus
        v²/d. The second term is due to their motion past each other, at the sideways speed v and the distance
        d, which turns the direction from one to the other. Robot i takes the fraction
        alpha_i / (alpha_i + alpha_j) of this limit.
        """
        n = len(seen.positions)
        robot, neighbor, offset, distance = near
        alpha = self._compute_braking_limits(team)
        relative_velocities = seen.velocities[robot] - neighbor_velocities
        is_at_same_position = distance < _MIN_DISTANCE_M
        normal = offset / np.maximum(distance, _MIN_DISTANCE_M)[:, None]
        normal[is_at_same_position] = compute_separations(
            robot[is_at_same_position], neighbor[is_at_same_position]
        )
        total_alpha = alpha[robot] + alpha[neighbor]
        gap = distance - team.radius[robot] - team.radius[neighbor] - self.safe_gap
        speed_away = (normal * relative_velocities).sum(axis=1)
        squared_speed = (relative_velocities * relative_velocities).sum(axis=1)
        squared_sideways_speed = np.maximum(squared_speed - speed_away**2, 0.0)
        min_passing_distance = self.safe_gap + _MIN_PASSING_CLEARANCE_M
        limit = self._compute_approach_limit(gap, speed_away, total_alpha)
        limit += squared_sideways_speed / np.maximum(distance, min_passing_distance)
        limit *= alpha[robot] / total_alpha
        return HalfPlanes(
            normals=arrange_in_rows(robot, n, -normal, np.nan),
            limits=arrange_in_rows(robot, n, limit, np.inf),
        )

    def _build_obstacle_planes(self, seen: Observations, team: Team, points: FloatArray) -> HalfPlanes:
        """Return the half planes that keep robots away from obstacle points, (n, k, 2) m.

        Points may be nan. Their half planes constrain nothing.
        """
        offset = seen.positions[:, None] - points
        distance = np.sqrt(offset[..., 0] ** 2 + offset[..., 1] ** 2)
        normal = offset / np.where(distance > 0.0, distance, np.nan)[..., None]
        speed_away = (normal * seen.velocities[:, None]).sum(axis=2)
        gap = distance - (team.radius + self.safe_gap)[:, None]
        alpha = self._compute_braking_limits(team)[:, None]
        limit = self._compute_approach_limit(np.nan_to_num(gap), np.nan_to_num(speed_away), alpha)
        return HalfPlanes(normals=-normal, limits=np.where(np.isnan(speed_away), np.inf, limit))

    def _compute_approach_limit(
        self, gap: FloatArray, speed_away: FloatArray, alpha: FloatArray
    ) -> FloatArray:
        """Return the maximum acceleration of two robots, or of a robot and an obstacle, toward each other.

        The barrier function is h = sqrt(2 α (d - D_s)) + v, for the distance d, the safe distance D_s and the
        speed v at which the distance grows. The limit γ h³ + α v / sqrt(2 α (d - D_s)) keeps h from becoming
        negative. For d < D_s, the root is continued by its negative mirror image; it is rounded near D_s.

        Parameters
        ----------
        gap : array, m
            d - D_s.
        speed_away : array, m/s
            v.
        alpha : array, m/s²
            α, sum of the braking limits of both robots; that of the robot alone at an obstacle.

        Returns
        -------
        array, m/s²
            At least -α: harder braking is not required if h >= 0, and not possible otherwise.
        """
        rounded = np.sqrt(np.abs(gap) + _ROUNDING_M)
        root = np.sqrt(2.0 * alpha)
        h = root * np.copysign(rounded - np.sqrt(_ROUNDING_M), gap) + speed_away
        return np.asarray(np.maximum(self.gamma * h**3 + 0.5 * root / rounded * speed_away, -alpha))


def _collect_reports(near: NeighborPairs, seen: Observations) -> NeighborReports:
    """Return the reported positions of near neighbors."""
    pairs = near.robots * len(seen.positions) + near.neighbors
    return NeighborReports(seen.time, pairs, seen.positions[near.robots] - near.offsets)


def _derive_velocities(
    reports: NeighborReports, previous: NeighborReports | None, max_speed: FloatArray
) -> FloatArray:
    """Derive the velocities of neighbors from two reported positions; unknown velocities are zero.

    Parameters
    ----------
    reports : NeighborReports
    previous : NeighborReports or None
        The reports at the last step.
    max_speed : (m,) array, m/s
        Maximum speeds of the neighbors. They limit the result, because reported positions jump after a late
        message.

    Returns
    -------
    (m, 2) array, m/s
    """
    velocities = np.zeros_like(reports.positions)
    if previous is not None and reports.time > previous.time:
        _, rows, previous_rows = np.intersect1d(
            reports.pairs, previous.pairs, assume_unique=True, return_indices=True
        )
        moves = reports.positions[rows] - previous.positions[previous_rows]
        velocities[rows] = moves / (reports.time - previous.time)
    return clip_lengths(velocities, max_speed)
