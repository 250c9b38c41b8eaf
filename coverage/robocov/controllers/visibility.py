"""Visibility-based coverage: robots climb the area that they see, each in its own cell."""

from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.controllers.base import BaseController, Memory
from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    collect_obstacle_points,
    compute_approach_velocities,
    compute_drive_forces,
    sum_by_robot,
    update_returns,
)
from robocov.controllers.gains import gain, response_time_gain
from robocov.observation import Decision, Observations, Scanning, compute_headings
from robocov.observation.scanned_view import (
    View,
    compute_step_fractions,
    compute_view,
    evaluate_density,
    find_windows,
    is_behind_wall,
    is_path_clear,
)

_RINGS = 12  # places along each ray at which the integrals are sampled
_PARTS = np.append((np.arange(_RINGS) + 0.5) / _RINGS, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class VisibilityMemory(Memory):
    """Memory of the robots, with what they see and where that draws them."""

    view: View | None = None
    gradient: Array | None = None  # (n, 2) m
    step: Array | None = None  # (n,), the part of full speed with which they follow it


@dataclass(frozen=True)
class Visibility(BaseController):
    """Coverage with visibility sensing constraints (Kantaros, Thanou and Tzes 2015).

    The robots maximise the area (weighted by the density) that anybody sees: what lies within its sensing
    range R_i and in its line of sight. Of those who see a place, the one with the least power
    |q - p_i|² - R_i² is in charge of it, the nearest where all see equally far. Robot i moves along the
    gradient of the area W_i of which it is in charge:

        u_i = k ( ∫ φ n ds over the free arcs of W_i + sum over the windows of ∫ φ (s - ρ)/ρ ds t )

    A free arc is a piece of the circle of radius R_i where the view ends for want of range, with the
    outward normal n. A window is a free edge that begins at a reflex corner of an obstacle, at the distance
    ρ; s is the distance along it, and t leads away from the obstacle (see `Windows`). Walls do not move, and
    what a border between two cells gives to one robot it takes from the other: neither is counted.

    Arcs and windows are those of the robot's own ray scan; between scans it goes on as it was. Who hears
    nobody is in charge of all that it sees. How far it is to a place by foot plays no part: robots that see
    all that they are in charge of rest, wherever they stand.

    Taken from the paper's abstract (Automatica 53, 195-207) and what is generally known of it, not from its
    text. There robots tell each other their views; here they tell positions, and a neighbour sees a place for
    all one knows unless the line between them passes behind something that the own scan has met. That
    obstacles and robots are kept off by slowing down is decided here.
    """

    name = "visibility"
    label = "Visibility"
    summary = "gradient of the area in view, each robot in its own cell (Kantaros, Thanou and Tzes 2015)"
    scanning = Scanning(rays=120, period=0.2)
    memory_type = VisibilityMemory

    k_area: float = gain(0.1, "1/s", "wanted speed per metre by which the area in view grows", high=100.0)
    jump: float = gain(0.3, "m", "depth of a step in the view that is a window", low=0.01)
    clearance: float = gain(0.05, "m", "distance kept from obstacles and robots, rim to rim", high=10.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: VisibilityMemory) -> Decision:
        team, gradient, step = memory.team, memory.gradient, memory.step
        reach = np.minimum(team.sensing_range, seen.region.diameter)
        view = compute_view(seen, memory.view, self.scanning, reach)
        if gradient is None or step is None or seen.scans is not None:
            before, gradient = gradient, self.gradient(seen, view, reach)
            step = compute_step_fractions(gradient, before, step)
        returns = update_returns(seen, memory.returns)
        wanted = compute_approach_velocities(gradient, self.k_area, team.max_speed) * step[:, None]
        keep = team.radius + self.clearance
        points, apart = collect_obstacle_points(seen, returns), keep + float(team.radius.max())
        wanted = avoid_collisions(wanted, seen, team, points, Margins(keep, apart, 4.0, 0.5))
        forces = compute_drive_forces(wanted, seen, team, self.response_time)
        memory = VisibilityMemory(team, returns, None, view, gradient, step)
        return Decision(forces, terms={"attraction": forces}, memory=memory)

    def gradient(self, seen: Observations, view: View, reach: Array) -> Array:
        """Return by how much the area in view grows per metre of each robot's way, (n, 2) m."""
        n, rays = view.distances.shape
        directions = compute_headings(rays)
        along = view.distances[..., None] * _PARTS  # (n, rays, rings + 1) m
        walls = np.where(view.hit, view.distances, np.inf)
        robot, other, offset, _ = seen.find_near_neighbours(2.0 * float(reach.max()))
        places = seen.positions[:, None, None] + along[..., None] * directions[:, None]
        weight = evaluate_density(seen.density, places)
        weight = weight * in_charge(along, walls, directions, robot, other, -offset, reach)
        arcs = ~view.hit * weight[..., -1] * reach[:, None] * (2.0 * np.pi / rays)

        edges = find_windows(view, directions, reach, self.jump)
        here = edges.robot, edges.ray
        past = np.maximum(along[here] - edges.corner[:, None], 0.0)[:, :-1]
        swept = (weight[here][:, :-1] * past).sum(axis=1) / np.maximum(edges.corner, 1e-3)
        swept *= view.distances[here] / _RINGS
        turning = sum_by_robot(edges.robot, swept[:, None] * edges.across, n)
        return np.asarray((arcs[..., None] * directions).sum(axis=1) + turning)


@kernel
def in_charge(
    along: Array,
    walls: Array,
    directions: Array,
    robot: IntArray,
    other: IntArray,
    towards: Array,
    reach: Array,
) -> BoolArray:
    """Return whether each robot is in charge of what is (n, rays, k) m along each ray, the same shape.

    Pairs, (m,), are of robots and their neighbours, (m, 2) m off, who see as far as they reach, (n,) m, and
    past the walls that the robot sees, (n, rays) m. Who sees a place with the smallest power is in charge.
    """
    mine = np.ones(along.shape, dtype=np.bool_)
    for m in range(len(robot)):
        i, far = robot[m], reach[other[m]]
        if is_behind_wall(towards[m, 0], towards[m, 1], walls[i]):
            continue
        for r in range(len(directions)):
            for c in range(along.shape[2]):
                x, y = along[i, r, c] * directions[r, 0], along[i, r, c] * directions[r, 1]
                dx, dy = towards[m, 0] - x, towards[m, 1] - y
                power = dx * dx + dy * dy - far * far
                if power <= 0.0 and power < along[i, r, c] ** 2 - reach[i] ** 2 and mine[i, r, c]:
                    mine[i, r, c] = not is_path_clear(x, y, dx, dy, walls[i])
    return mine
