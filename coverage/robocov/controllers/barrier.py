"""Lloyd's algorithm behind safety barrier certificates: nobody comes closer than the safe distance."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers.base import BaseController, Memory
from robocov.controllers.driving import (
    arrange_in_rows,
    collect_obstacle_points,
    compute_approach_velocities,
    find_nearest_allowed,
    update_returns,
)
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.known_cells import cells_choice, compute_known_cells
from robocov.observation import Decision, Observations, Scanning
from robocov.potential import compute_separations
from robocov.team import Team

_ROUNDING = 1e-3  # metres over which the braking curve, vertical at the safe distance, is rounded
_TOGETHER = 1e-9  # distance in metres at which robots in one place are taken to be


class Heard(NamedTuple):
    """Reported positions of the robots that were near."""

    time: float  # s
    pair: IntArray  # (m,), robot * n + neighbour, ascending
    positions: Array  # (m, 2) m, of the neighbour


@dataclass(frozen=True, slots=True, eq=False)
class BarrierMemory(Memory):
    """Memory of the robots, with the neighbours heard."""

    heard: Heard | None = None


@dataclass(frozen=True)
class Barrier(BaseController):
    """Lloyd's algorithm, filtered by safety barrier certificates (Wang, Ames and Egerstedt 2017).

    Two robots that brake as hard as they can must come to rest at the safe distance D_s or before:

        h_ij = sqrt(2 (alpha_i + alpha_j) (|dp| - D_s)) + dp · dv / |dp| >= 0

    is kept by dh_ij/dt >= -gamma h_ij³, which is linear in the accelerations. Each of the two takes the
    part alpha_i / (alpha_i + alpha_j) of it, so that everybody decides alone. What is wanted, here
    Lloyd's acceleration, is changed as little as these half planes demand: one quadratic programme for
    each robot, solved exactly. Where nothing is allowed, the robot brakes. An obstacle point does not
    move and takes no part: alpha_j = 0; that it is a point of a wall, along which the closest point moves
    on, is granted by leaving out what passing a lone point by would allow.

    Robots do not hear velocities: each derives its neighbours' from two positions that it heard. Obstacle
    points are the closest one and the last scan's. That the bodies and limits of the others are known is
    taken for granted. Decided here: the root is rounded over the last millimetre, and inside the safe
    distance continued as an odd function, so that who begins too near is led out.

    Taken from what is generally known of the paper (IEEE T-RO 33, 661-674), not from its text; h_ij as
    the documentation of MathWorks' barrier certificate block has it.
    """

    name = "barrier"
    label = "LA, safe"
    summary = "Lloyd's algorithm with safety barrier certificates (Wang, Ames and Egerstedt 2017)"
    scanning = Scanning(rays=72, period=0.1)
    memory_type = BarrierMemory

    safe_gap: float = gain(0.05, "m", "least distance between surfaces: D_s less the radii", high=100.0)
    gamma: float = gain(20.0, "s/m²", "how fast h may fall, as gamma h³", low=1e-3)
    braking: float = gain(0.8, "a_max", "alpha: the part of the acceleration counted on", low=0.05, high=1.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()
    cells: str = cells_choice()

    def decide(self, seen: Observations, memory: BarrierMemory) -> Decision:
        """Return the forces of the nearest accelerations to Lloyd's that are certified."""
        team = memory.team
        cells = compute_known_cells(seen, self.cells, memory.triangulation)
        wanted = compute_approach_velocities(cells.centroid - seen.positions, self.k_prop, team.max_speed)
        wanted = (wanted - seen.velocities) / self.response_time
        chosen, memory = self.certified(seen, memory, wanted)
        forces = chosen * team.mass[:, None] + seen.velocities * team.viscosity[:, None]
        limit = team.max_acceleration / np.maximum(np.hypot(*wanted.T), 1e-300)
        changed = (chosen - wanted * np.minimum(1.0, limit)[:, None]) * team.mass[:, None]
        terms = {"attraction": forces - changed, "barrier": changed}
        memory = replace(memory, triangulation=cells.triangulation)
        return Decision(forces, cells.centroid, terms, cells, memory)

    def certified(
        self, seen: Observations, memory: BarrierMemory, wanted: Array
    ) -> tuple[Array, BarrierMemory]:
        """Return the certified accelerations nearest to the wanted ones, (n, 2) m/s², and the new memory."""
        team = memory.team
        returns = update_returns(seen, memory.returns)
        robots, heard = self._robots(seen, memory)
        obstacles = self._obstacles(seen, team, collect_obstacle_points(seen, returns))
        normals, levels = (np.concatenate(both, axis=1) for both in zip(robots, obstacles, strict=True))
        chosen, feasible = find_nearest_allowed(wanted, normals, levels, team.max_acceleration)
        # to rest within the response time, or as hard as possible
        speed = np.hypot(*seen.velocities.T)
        brake = -np.minimum(1.0 / self.response_time, team.max_acceleration / np.maximum(speed, 1e-300))
        chosen = np.where(feasible[:, None], chosen, seen.velocities * brake[:, None])
        return chosen, replace(memory, heard=heard, returns=returns)

    def _robots(self, seen: Observations, memory: BarrierMemory) -> tuple[tuple[Array, Array], Heard]:
        """Return the half planes that keep robots apart, and what was heard."""
        n, team = len(seen.positions), memory.team
        alpha = self.braking * team.max_acceleration
        # from farther away two robots at full speed can stop, and gamma h³ is not yet small
        stopping = 2.0 * float(team.max_speed.max()) ** 2 / float(alpha.min())
        reach = 2.0 * float(team.radius.max()) + self.safe_gap + 2.0 * stopping
        robot, neighbour, offset, distance = seen.find_near_neighbours(reach)
        heard = Heard(seen.time, robot * n + neighbour, seen.positions[robot] - offset)
        closing = seen.velocities[robot] - _derived(heard, memory.heard, team.max_speed[neighbour])
        together = distance < _TOGETHER
        normal = offset / np.maximum(distance, _TOGETHER)[:, None]
        normal[together] = compute_separations(robot[together], neighbour[together])
        power = alpha[robot] + alpha[neighbour]
        gap = distance - team.radius[robot] - team.radius[neighbour] - self.safe_gap
        along = (normal * closing).sum(axis=1)
        passing = np.maximum((closing * closing).sum(axis=1) - along**2, 0.0)
        level = self._level(gap, along, power) + passing / np.maximum(distance, self.safe_gap + 1e-3)
        level *= alpha[robot] / power
        return (arrange_in_rows(robot, n, -normal, np.nan), arrange_in_rows(robot, n, level, np.inf)), heard

    def _obstacles(self, seen: Observations, team: Team, points: Array) -> tuple[Array, Array]:
        """Return the half planes that keep robots off (n, k, 2) obstacle points; nan where none."""
        offset = seen.positions[:, None] - points
        distance = np.sqrt(offset[..., 0] ** 2 + offset[..., 1] ** 2)
        normal = offset / np.where(distance > 0.0, distance, np.nan)[..., None]
        along = (normal * seen.velocities[:, None]).sum(axis=2)
        gap = distance - (team.radius + self.safe_gap)[:, None]
        alpha = (self.braking * team.max_acceleration)[:, None]
        level = self._level(np.nan_to_num(gap), np.nan_to_num(along), alpha)
        return -normal, np.where(np.isnan(along), np.inf, level)

    def _level(self, gap: Array, along: Array, power: Array) -> Array:
        """Return how much acceleration towards each other is allowed, m/s²: gamma h³ + d/dt of the root.

        Where h >= 0 it never asks for more than `power`; where it is not, no more could be asked for.
        """
        rounded = np.sqrt(np.abs(gap) + _ROUNDING)
        root = np.sqrt(2.0 * power)
        h = root * np.copysign(rounded - np.sqrt(_ROUNDING), gap) + along
        return np.asarray(np.maximum(self.gamma * h**3 + 0.5 * root / rounded * along, -power))


def _derived(heard: Heard, before: Heard | None, fastest: Array) -> Array:
    """Return the velocities of neighbours, (m, 2) m/s, from where they were heard to be; unknown ones zero.

    Where a message was late, the next one makes a leap: nobody is faster than `fastest`, (m,) m/s.
    """
    velocities = np.zeros_like(heard.positions)
    if before is not None and heard.time > before.time:
        _, now, then = np.intersect1d(heard.pair, before.pair, assume_unique=True, return_indices=True)
        velocities[now] = (heard.positions[now] - before.positions[then]) / (heard.time - before.time)
    return compute_approach_velocities(velocities, 1.0, fastest)
