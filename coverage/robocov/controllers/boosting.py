"""Gradient ascent on the probability of detection in view, with boosts that lead out of local optima."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from robocov.arrays import copy_read_only
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
from robocov.controllers.gains import choice, gain, response_time_gain
from robocov.observation import Decision, NeighborPairs, Observations, Scanning, compute_ray_directions
from robocov.observation.scanned_view import (
    OcclusionEdges,
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

_SAMPLES_PER_RAY = 10
"""Number of samples for integrals along a ray."""
_SAMPLE_FRACTIONS = (np.arange(_SAMPLES_PER_RAY) + 0.5) / _SAMPLES_PER_RAY
"""Positions of the samples of each ray, as fractions of its length."""
_SETTLE_TIME_S = 2.0
"""Time at rest after which a robot is considered to be at an optimum."""
_REST_RADIUS_M = 0.1
"""A robot is at rest while it stays within this distance of one point."""
_TRAIL_SPACING_M = 0.2
"""Distance between the points of the trail on which a robot returns."""
_RETURN_GAIN = 2.0
"""Speed per meter of distance to the next point of the trail, 1/s."""
_MIN_DISTANCE_M = 1e-3
"""Minimum divisor; prevents division by zero."""
_MIN_DETECTION = 1e-3
"""Minimum probability of detection used as a divisor; prevents division by zero."""


class Mode(Enum):
    """Objective that a robot follows."""

    GRADIENT = "gradient"
    BOOSTED = "boosted gradient"
    RETURN = "trail back to the previous optimum"


class BoostLimits(NamedTuple):
    """Limits of the boosts of a robot."""

    max_boosts: int
    """Maximum number of boosts."""
    max_duration: float
    """Maximum time of one boost, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Ascent:
    """Ascent of one robot along its gradient, from one optimum to the next. Immutable."""

    rest_position: FloatArray
    """(2,) m, position near which the robot has been since `rest_start`."""
    rest_start: float
    """Time since which the robot has been near that position, s."""
    mode: Mode = Mode.GRADIENT
    boost_count: int = 0
    """Number of boosts so far."""
    best_value: float = -math.inf
    """Contribution of the robot at the optimum before the boost, m²."""
    trail: tuple[FloatArray, ...] = ()
    """Points from that optimum to the robot, (2,) m each."""
    boost_start: float = 0.0
    """Time at which the last boost began, s."""

    def update(self, position: FloatArray, time: float, value: float, limits: BoostLimits) -> Ascent:
        """Return the ascent after a scan, which may be in another mode.

        In mode `GRADIENT`, a robot that has come to rest is at a local optimum, and leaves it. In mode
        `BOOSTED`, it changes to `GRADIENT` when it has come to rest or the boost has lasted long enough. In
        mode `RETURN`, it goes back along its trail to the previous optimum.

        Parameters
        ----------
        position : (2,) array, m
        time : float, s
        value : float, m²
            Contribution of the robot to the objective at its position.
        limits : BoostLimits

        Returns
        -------
        Ascent
            The updated ascent.
        """
        ascent = self
        if math.dist(position, self.rest_position) > _REST_RADIUS_M:
            ascent = replace(ascent, rest_position=copy_read_only(position), rest_start=time)
        if ascent.mode is Mode.RETURN:
            return ascent._follow_trail(position)
        if ascent.trail and math.dist(position, ascent.trail[-1]) > _TRAIL_SPACING_M:
            ascent = replace(ascent, trail=(*ascent.trail, copy_read_only(position)))
        is_settled = time - ascent.rest_start >= _SETTLE_TIME_S
        if ascent.mode is Mode.BOOSTED:
            if is_settled or time - ascent.boost_start >= limits.max_duration:
                return replace(ascent, mode=Mode.GRADIENT, rest_start=time)
            return ascent
        if is_settled:
            return ascent._leave_optimum(position, time, value, limits.max_boosts)
        return ascent

    def _follow_trail(self, position: FloatArray) -> Ascent:
        """Return the ascent of a robot that goes back along its trail.

        A point at the end of the trail is removed when the robot reaches it. When none remains, the robot
        follows its gradient again.
        """
        trail = self.trail
        if math.dist(position, trail[-1]) < _TRAIL_SPACING_M:
            trail = trail[:-1]
        return replace(self, trail=trail, mode=Mode.RETURN if trail else Mode.GRADIENT)

    def _leave_optimum(self, position: FloatArray, time: float, value: float, max_boosts: int) -> Ascent:
        """Return the ascent of a robot that leaves a local optimum.

        It leaves with a boost, or returns to the previous optimum if that was better. A robot that has had
        its maximum number of boosts stays.
        """
        if self.trail and value < self.best_value:
            # A robot that returns is not boosted again.
            return replace(self, mode=Mode.RETURN, boost_count=max_boosts, rest_start=time)
        if self.boost_count >= max_boosts:
            return replace(self, trail=())
        return replace(
            self,
            mode=Mode.BOOSTED,
            boost_count=self.boost_count + 1,
            rest_start=time,
            boost_start=time,
            best_value=value,
            trail=(copy_read_only(position),),
        )


@dataclass(frozen=True, slots=True, eq=False)
class BoostingMemory(Memory):
    """Memory of the robots: the last view, gradient and ascent of each."""

    view: View | None = None
    gradient: FloatArray | None = None
    """(n, 2) m, gradient that each robot follows."""
    speed_fraction: FloatArray | None = None
    """(n,) Fraction of full speed at which each robot follows the gradient."""
    ascents: tuple[Ascent, ...] = ()
    is_driven: BoolArray | None = None
    """(n,) Whether the last force on each robot was not zero."""


class Contributions(NamedTuple):
    """Contribution of each robot to the objective H, and its gradients."""

    value: FloatArray
    """(n,) m², part of H that the team would lose without the robot."""
    gradient: FloatArray
    """(n, 2) m, gradient of `value` with respect to the position of the robot."""
    boosted_gradient: FloatArray
    """(n, 2) m, gradient of the boosted objective, which leads out of local optima."""


class _ViewSamples(NamedTuple):
    """Samples of the views, (n, rays, k) each."""

    depths: FloatArray
    """Distance from the robot, m."""
    areas: FloatArray
    """Area that each sample represents, m²."""
    undetected: FloatArray
    """Φ, probability that no other robot detects the sample."""
    detection: FloatArray
    """p, probability that the robot itself detects it."""
    weight: FloatArray
    """w = φ Φ."""


@dataclass(frozen=True)
class Boosting(BaseController):
    """Coverage by joint detection, with boosting functions (Sun, Cassandras and Gokbayrak, CDC 2014).

    The team maximizes the probability that events are detected:

        H = ∫ φ(x) (1 - Π_i (1 - p_i(x))) dx

    Robot i detects an event at distance d with the probability p_i = exp(-λ d), if the event is in its line
    of sight and within its sensing range. Each robot follows its gradient of H to a local optimum. There it
    follows a boosted gradient for a while, which leads out of the optimum, and then its own gradient to
    another optimum. If it contributes less there, it returns on its trail.

    This objective differs from the coverage cost: path lengths do not matter, and robots gather where much is
    in view.

    The gains are the fields of the dataclass; `get_gains` returns their meanings, units and ranges.

    Notes
    -----
    Robot i contributes ∫ w p_i over its view to H, where w = φ Φ_i, and Φ_i is the probability that no other
    robot detects x. The gradient of the contribution is the sum of three terms:

    - w λ p_i toward each point in view,
    - the integral of w p_i (s - ρ)/ρ along each edge behind a corner (see `OcclusionEdges`), and
    - w p_i along the arcs where the view ends at the sensing range.

    The gain `boost` selects the boosted gradient:

    - ``phi``: the weight κ Φ_i^γ w, larger for points that no other robot detects
    - ``p``: the weight κ (1 - Π (1 - p))^-γ w, larger for points that the whole team barely detects
    - ``neighbors``: the weight w; in addition, each neighbor at a distance d of at most twice the largest
      sensing range repels with κ / d^γ

    A robot follows it until it comes to rest, or for at most `patience`. A robot that has returned on its
    trail is not boosted again, so the result is no worse than without boosts, apart from changes by
    other robots in the meantime.

    We had only summaries and the abstracts of the paper (arXiv 1409.0776) and of its sequel by Welikala and
    Cassandras (arXiv 1903.04133), not the full texts; details may differ. Known differences: the map is not
    known: a robot uses its own scan, and assumes that a neighbor sees a point unless the scan shows an
    obstacle in the line between them. Each robot is boosted when it comes to rest, without synchronization.
    The trail, the durations, the values of the gains, and the avoidance of obstacles and robots are our own.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> from robocov.simulation import Simulation
    >>> room = Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = Simulation(room, Boosting(), [[4.0, 1.0]])
    >>> simulation.run(15.0).positions[-1].round(1)
    array([[4., 3.]])
    """

    name = "boosting"
    label = "Boosting"
    summary = "gradient of joint detection in sight, boosted at local optima (Sun and Cassandras 2014)"
    scanning = Scanning(rays=72, period=0.2)
    memory_type = BoostingMemory

    decay: float = gain(
        0.1, "1/m", "λ, rate at which detection decreases with distance", low=1e-3, high=100.0
    )
    boost: str = choice("phi", ("phi", "p", "neighbors"), "boosting function")
    kappa: float = gain(1.0, "1", "κ, factor of the boosting function; for neighbors in m^(1+γ)")
    gamma: float = gain(2.0, "1", "γ, exponent of the boosting function", high=20.0)
    boosts: float = gain(3.0, "times", "maximum number of boosts of a robot", whole=True, high=1e3)
    patience: float = gain(8.0, "s", "maximum duration of a boost")
    k_grad: float = gain(0.3, "1/s", "desired speed per meter of the gradient", high=100.0)
    jump: float = gain(0.3, "m", "minimum jump of the measured distance at an occlusion", low=0.01)
    clearance: float = gain(0.05, "m", "minimum gap to obstacles and other robots", high=10.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: BoostingMemory) -> Decision:
        """Compute the forces that drive each robot along its gradient, boosted gradient or trail."""
        team = memory.team
        max_distances = np.minimum(team.sensing_range, seen.region.diameter)
        view = compute_view(seen, memory.view, self.scanning, max_distances)
        gradient = memory.gradient
        speed_fraction = memory.speed_fraction
        ascents = memory.ascents
        # Robots follow the same gradient until the next scan.
        if gradient is None or speed_fraction is None or seen.scans is not None:
            contributions = self.compute_contributions(seen, view, max_distances)
            is_absent = _find_absent_robots(seen, memory.is_driven)
            ascents = self._update_ascents(ascents, seen, contributions.value, is_absent)
            is_boosted = np.array([ascent.mode is Mode.BOOSTED for ascent in ascents])
            gradient = np.where(is_boosted[:, None], contributions.boosted_gradient, contributions.gradient)
            speed_fraction = compute_speed_fractions(gradient, memory.gradient, speed_fraction)
        velocities = (
            compute_approach_velocities(gradient, self.k_grad, team.max_speed) * speed_fraction[:, None]
        )
        returning = [robot for robot, ascent in enumerate(ascents) if ascent.mode is Mode.RETURN]
        if returning:
            trail_ends = np.array([ascents[robot].trail[-1] for robot in returning])
            velocities[returning] = compute_approach_velocities(
                trail_ends - seen.positions[returning], _RETURN_GAIN, team.max_speed[returning]
            )
        returns = update_returns(seen, memory.returns)
        margins = Margins.build_with_gap(team, self.clearance)
        obstacle_points = collect_obstacle_points(seen, returns)
        velocities = avoid_collisions(velocities, seen, team, obstacle_points, margins)
        forces = compute_drive_forces(velocities, seen, team, self.response_time)
        return Decision(
            forces=forces,
            terms={"attraction": forces},
            memory=BoostingMemory(
                team=team,
                returns=returns,
                view=view,
                gradient=gradient,
                speed_fraction=speed_fraction,
                ascents=ascents,
                is_driven=(forces != 0.0).any(axis=1),
            ),
        )

    def _update_ascents(
        self, ascents: tuple[Ascent, ...], seen: Observations, values: FloatArray, is_absent: BoolArray
    ) -> tuple[Ascent, ...]:
        """Return the ascents after a scan. Those of absent robots start when the robots join."""
        new_ascents = tuple(Ascent(copy_read_only(position), seen.time) for position in seen.positions)
        if not ascents:
            ascents = new_ascents
        limits = BoostLimits(int(self.boosts), self.patience)
        updated = []
        for robot, value in enumerate(values.tolist()):
            if is_absent[robot]:
                updated.append(new_ascents[robot])
            else:
                updated.append(ascents[robot].update(seen.positions[robot], seen.time, value, limits))
        return tuple(updated)

    def compute_contributions(
        self, seen: Observations, view: View, max_distances: FloatArray
    ) -> Contributions:
        """Compute the contribution of each robot to H, with its gradient and its boosted gradient.

        Parameters
        ----------
        seen : Observations
        view : View
        max_distances : (n,) array, m
            Maximum distance of each robot's view.

        Returns
        -------
        Contributions
        """
        directions = compute_ray_directions(view.distances.shape[1])
        # A point can only be within range of two robots if these are no farther apart than twice the range.
        pairs = seen.find_neighbors(2.0 * float(max_distances.max()))
        samples = self._sample_views(seen, view, pairs, directions, max_distances)
        edges = find_occlusion_edges(view, directions, max_distances, self.jump)
        boosted_weight = self._compute_boosted_weight(samples)
        boosted_gradient = self._compute_gradient(boosted_weight, samples, view, edges, max_distances)
        if self.boost == "neighbors":
            # The offsets have the length d, hence the exponent γ + 1 for a repulsion of κ / d^γ.
            repulsion = self.kappa / np.maximum(pairs.distances, _MIN_DISTANCE_M) ** (self.gamma + 1.0)
            boosted_gradient = boosted_gradient + sum_by_robot(
                pairs.robots, repulsion[:, None] * pairs.offsets, len(max_distances)
            )
        return Contributions(
            value=(samples.weight * samples.detection * samples.areas).sum(axis=(1, 2)),
            gradient=self._compute_gradient(samples.weight, samples, view, edges, max_distances),
            boosted_gradient=boosted_gradient,
        )

    def _sample_views(
        self,
        seen: Observations,
        view: View,
        pairs: NeighborPairs,
        directions: FloatArray,
        max_distances: FloatArray,
    ) -> _ViewSamples:
        """Sample the views of all robots for numerical integration.

        A view consists of narrow sectors, one around each ray. A ray ends at a wall or at the sensing range,
        and is sampled at k equally spaced points. Each sample represents a piece of the sector, as long as
        the spacing of the samples and as wide as the sector is there. `max_distances` contains the length of
        each robot's rays, (n,) m, and `pairs` the neighbors that may detect points of its view.
        """
        sector_angle = 2.0 * np.pi / len(directions)
        # The axes of an array of samples are robot, ray and sample; points have one more, for x and y.
        depths = view.distances[:, :, None] * _SAMPLE_FRACTIONS
        offsets = depths[:, :, :, None] * directions[None, :, None, :]
        points = seen.positions[:, None, None, :] + offsets
        spacings = view.distances / _SAMPLES_PER_RAY
        areas = depths * (spacings * sector_angle)[:, :, None]
        wall_distances = np.where(view.is_hit, view.distances, np.inf)
        undetected = compute_miss_probabilities(
            depths, wall_distances, directions, pairs, max_distances, self.decay
        )
        return _ViewSamples(
            depths=depths,
            areas=areas,
            undetected=undetected,
            detection=np.exp(-self.decay * depths),
            weight=evaluate_density(seen.density, points) * undetected,
        )

    def _compute_boosted_weight(self, samples: _ViewSamples) -> FloatArray:
        """Return the boosted weight of the samples, (n, rays, k)."""
        if self.boost == "phi":
            return np.asarray(self.kappa * samples.undetected**self.gamma * samples.weight)
        if self.boost == "p":
            detected = 1.0 - samples.undetected * (1.0 - samples.detection)
            factor = self.kappa * np.maximum(detected, _MIN_DETECTION) ** -self.gamma
            return np.asarray(factor * samples.weight)
        return samples.weight

    def _compute_gradient(
        self,
        weight: FloatArray,
        samples: _ViewSamples,
        view: View,
        edges: OcclusionEdges,
        max_distances: FloatArray,
    ) -> FloatArray:
        """Return the gradient of the integral of a weight times p over the views, (n, 2) m.

        Its three terms are those in the notes of `Boosting`.
        """
        directions = compute_ray_directions(view.distances.shape[1])
        sector_angle = 2.0 * np.pi / len(directions)
        integrand = weight * samples.detection
        # p at the sensing range, times the length of the arc there, for each ray that hits no obstacle.
        range_detection = np.exp(-self.decay * max_distances)[:, None]
        arcs = ~view.is_hit * range_detection * max_distances[:, None] * sector_angle
        ray_terms = self.decay * (integrand * samples.areas).sum(axis=2) + weight[..., -1] * arcs
        growth = integrate_over_edges(edges, view, samples.depths, integrand)
        edge_terms = sum_by_robot(edges.robots, growth, len(max_distances))
        return np.asarray((ray_terms[..., None] * directions).sum(axis=1) + edge_terms)


def _find_absent_robots(seen: Observations, is_driven: BoolArray | None) -> BoolArray:
    """Return which robots do not react to a force: they have not joined yet, or have failed, (n,).

    Without this distinction, a robot that joins late would have used up its boosts before.
    """
    if is_driven is None:
        return np.zeros(len(seen.positions), dtype=bool)
    is_still = (seen.velocities == 0.0).all(axis=1)
    if seen.steering is not None:
        # A unicycle that turns in place reacts as well.
        is_still &= seen.steering[:, 1] == 0.0
    return np.asarray(is_driven & is_still)


@kernel
def compute_miss_probabilities(
    depths: FloatArray,
    wall_distances: FloatArray,
    directions: FloatArray,
    pairs: NeighborPairs,
    max_distances: FloatArray,
    decay: float,
) -> FloatArray:
    """Compute the probability that no neighbor detects a point, for sampled points in each robot's view.

    Parameters
    ----------
    depths : (n, rays, k) array, m
        Distances of the points along each ray.
    wall_distances : (n, rays) array, m
        Distances of the walls in view; infinite where there is none.
    directions : (rays, 2) array
        Unit vectors along the rays.
    pairs : NeighborPairs
        Pairs of a robot and a neighbor. The neighbor detects points within its own maximum distance, unless a
        wall in the robot's view blocks the line of sight from the neighbor to the point.
    max_distances : (n,) array, m
        Maximum distance at which each robot detects points.
    decay : float, 1/m
        λ in the probability exp(-λ d) of detecting a point at distance d.

    Returns
    -------
    (n, rays, k) array
        Probability that no neighbor detects the point; 1 without neighbors.
    """
    undetected = np.ones(depths.shape)
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
                distance = math.sqrt(dx * dx + dy * dy)
                if distance <= neighbor_range and is_path_clear(x, y, dx, dy, wall_distances[robot]):
                    undetected[robot, ray, k] *= 1.0 - math.exp(-decay * distance)
    return undetected
