"""Visibility-based coverage: robots maximize the area in view, each in its own cell."""

from dataclasses import dataclass

import numpy as np

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
from robocov.observation import Decision, Observations, Scanning, compute_ray_directions
from robocov.observation.observations import NeighborPairs
from robocov.observation.scanned_view import (
    View,
    compute_speed_fractions,
    compute_view,
    evaluate_density,
    find_occlusion_edges,
    integrate_over_edges,
    is_behind_wall,
    is_path_clear,
)
from robocov.typing import BoolArray, FloatArray

_SAMPLES_PER_RAY = 12
"""Number of samples for integrals along a ray."""
_SAMPLE_FRACTIONS = np.append((np.arange(_SAMPLES_PER_RAY) + 0.5) / _SAMPLES_PER_RAY, 1.0)
"""Positions of the samples of each ray, and of its end, as fractions of its length."""


@dataclass(frozen=True, slots=True, eq=False)
class VisibilityMemory(Memory):
    """Memory of the robots: the last view and gradient of each."""

    view: View | None = None
    gradient: FloatArray | None = None
    """(n, 2) m, gradient of the area in view."""
    speed_fraction: FloatArray | None = None
    """(n,) Fraction of full speed at which each robot follows the gradient."""


@dataclass(frozen=True)
class Visibility(BaseController):
    """Coverage with visibility sensing constraints (Kantaros, Thanou and Tzes 2015).

    The team maximizes the area, weighted by the density, that is in view of any robot: within its sensing
    range and its line of sight. Each robot moves along the gradient of the area of its own cell. Robots that
    see their whole cells are at rest; path lengths do not matter.

    Notes
    -----
    The cell W_i of robot i is the part of its view in which no other robot that sees the point q has a lower
    power |q - p_i|² - R_i², where R_i is the sensing range. With equal ranges, the nearest robot has the
    lowest power. The motion is

        u_i = k ( ∫ φ n ds over the free arcs of W_i + sum over the occlusion edges of ∫ φ (s - ρ)/ρ ds t )

    A free arc is a piece of the circle of radius R_i on the border of W_i, and n is its outward normal. An
    occlusion edge is a free edge of the view that begins at a reflex corner of an obstacle, at the distance ρ
    from the robot; s is the distance of a point of the edge from the robot, and t is normal to the edge, away
    from the obstacle (see `OcclusionEdges`). Walls do not move, and the gradients of two cells along their
    common border cancel.

    Arcs and occlusion edges are found in the robot's own scan; between scans, robots keep their velocities.
    The cell of a robot without neighbors in communication range is its whole view.

    We had only the paper's abstract (Automatica 53, 195-207), not its full text; details may differ. In the
    paper, robots send each other their views. Here they send positions, and a robot assumes that a neighbor
    sees a point unless its own scan shows an obstacle in the line between the two. The sensing ranges of the
    others are assumed to be known. Robots also slow down to avoid collisions, which is our own addition.
    """

    name = "visibility"
    label = "Visibility"
    summary = "gradient of the area in view, each robot in its own cell (Kantaros, Thanou and Tzes 2015)"
    scanning = Scanning(rays=120, period=0.2)
    memory_type = VisibilityMemory

    k_area: float = gain(
        0.1, "1/s", "desired speed per square meter of visible area gained per meter", high=100.0
    )
    jump: float = gain(0.3, "m", "minimum jump of the measured distance at an occlusion", low=0.01)
    clearance: float = gain(0.05, "m", "minimum gap to obstacles and other robots", high=10.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: VisibilityMemory) -> Decision:
        """Compute the forces that drive each robot along the gradient of its area in view."""
        team = memory.team
        gradient = memory.gradient
        speed_fraction = memory.speed_fraction
        max_distances = np.minimum(team.sensing_range, seen.region.diameter)
        view = compute_view(seen, memory.view, self.scanning, max_distances)
        # Robots follow the same gradient until the next scan.
        if gradient is None or speed_fraction is None or seen.scans is not None:
            gradient = self.compute_gradient(seen, view, max_distances)
            speed_fraction = compute_speed_fractions(gradient, memory.gradient, speed_fraction)
        returns = update_returns(seen, memory.returns)
        velocities = (
            compute_approach_velocities(gradient, self.k_area, team.max_speed) * speed_fraction[:, None]
        )
        margins = Margins.build_with_gap(team, self.clearance)
        obstacle_points = collect_obstacle_points(seen, returns)
        velocities = avoid_collisions(velocities, seen, team, obstacle_points, margins)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(
            forces=forces,
            terms={"attraction": forces},
            memory=VisibilityMemory(
                team=team, returns=returns, view=view, gradient=gradient, speed_fraction=speed_fraction
            ),
        )

    def compute_gradient(self, seen: Observations, view: View, max_distances: FloatArray) -> FloatArray:
        """Compute the gradient of the area of each robot's cell.

        Parameters
        ----------
        seen : Observations
        view : View
        max_distances : (n,) array, m
            Maximum distance of each robot's view.

        Returns
        -------
        (n, 2) array, m
            Growth of the area, weighted by φ, per meter of the robot's motion.
        """
        robot_count, ray_count = view.distances.shape
        directions = compute_ray_directions(ray_count)
        depths = view.distances[..., None] * _SAMPLE_FRACTIONS
        wall_distances = np.where(view.is_hit, view.distances, np.inf)
        # A point can only be within range of two robots if these are no farther apart than twice the range.
        pairs = seen.find_neighbors(2.0 * float(max_distances.max()))
        points = seen.positions[:, None, None] + depths[..., None] * directions[:, None]
        weight = evaluate_density(seen.density, points)
        weight = weight * find_points_in_own_cell(depths, wall_distances, directions, pairs, max_distances)
        # The weight at the sensing range, times the length of the arc there, for rays that hit no obstacle.
        arcs = ~view.is_hit * weight[..., -1] * max_distances[:, None] * (2.0 * np.pi / ray_count)
        edges = find_occlusion_edges(view, directions, max_distances, self.jump)
        # The last sample is the end of the ray, which only the arcs need.
        growth = integrate_over_edges(edges, view, depths[..., :-1], weight[..., :-1])
        edge_terms = sum_by_robot(edges.robots, growth, robot_count)
        return np.asarray((arcs[..., None] * directions).sum(axis=1) + edge_terms)


@kernel
def find_points_in_own_cell(
    depths: FloatArray,
    wall_distances: FloatArray,
    directions: FloatArray,
    pairs: NeighborPairs,
    max_distances: FloatArray,
) -> BoolArray:
    """Find the points of each robot's view that belong to its cell.

    Parameters
    ----------
    depths : (n, rays, k) array, m
        Distances of the points along each ray.
    wall_distances : (n, rays) array, m
        Distances of the walls in view; infinite where there is none.
    directions : (rays, 2) array
        Unit vectors along the rays.
    pairs : NeighborPairs
        The neighbors that may see points of the view.
    max_distances : (n,) array, m
        Maximum distance of each robot's view: R in the power below.

    Returns
    -------
    (n, rays, k) bool array
        Whether no neighbor that sees the point has a lower power |q - p|² - R² there.
    """
    is_own = np.ones(depths.shape, dtype=np.bool_)
    for pair in range(len(pairs.robots)):
        robot = pairs.robots[pair]
        # All coordinates are relative to the robot. `pairs.offsets` leads from the neighbor to the robot,
        # hence the minus signs.
        neighbor_x = -pairs.offsets[pair, 0]
        neighbor_y = -pairs.offsets[pair, 1]
        neighbor_range = max_distances[pairs.neighbors[pair]]
        # `is_path_clear` does not test the end of the path, which is the neighbor's position for every point.
        if is_behind_wall(neighbor_x, neighbor_y, wall_distances[robot]):
            continue
        for ray in range(len(directions)):
            for k in range(depths.shape[2]):
                x = depths[robot, ray, k] * directions[ray, 0]
                y = depths[robot, ray, k] * directions[ray, 1]
                dx = neighbor_x - x
                dy = neighbor_y - y
                # The neighbor can only see points within its sensing range, where the power is at most 0.
                power = dx * dx + dy * dy - neighbor_range * neighbor_range
                own_power = depths[robot, ray, k] ** 2 - max_distances[robot] ** 2
                if power <= 0.0 and power < own_power and is_own[robot, ray, k]:
                    is_own[robot, ray, k] = not is_path_clear(x, y, dx, dy, wall_distances[robot])
    return is_own
