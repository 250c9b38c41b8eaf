"""Gradient ascent on what is detected in view, with boosting functions that lead out of local optima."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from robocov.arrays import Array, IntArray, freeze
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

_RINGS = 10  # places along each ray at which the integrals are sampled
_SETTLED = 2.0  # seconds in which a robot that is at an optimum
_STILL = 0.1  # moves less than this, m
_CRUMB = 0.2  # metres between the places by which a robot goes back the way that it came


class Mode(Enum):
    """Objective that a robot follows."""

    GRADIENT = "its gradient"
    BOOSTED = "its boosted gradient"
    BACK = "the way that it came, to the optimum before"


@dataclass(frozen=True, slots=True, eq=False)
class Climb:
    """Memory of one robot's ascent; places are (2,) m."""

    place: Array  # where it was
    since: float  # at this time, s; it has hardly moved since
    mode: Mode = Mode.GRADIENT
    boosts: int = 0  # how often it was boosted
    best: float = -math.inf  # m², what it added at the optimum before the boost
    trail: tuple[Array, ...] = ()  # from that optimum to where it is
    began: float = 0.0  # when the boost began, s

    def after(self, here: Array, time: float, added: float, most: int, longest: float) -> Climb:
        """Return the climb when the robot is here at a time (s), and adds so much (m²) to what is detected.

        It is boosted so often at `most`, and no longer than so many seconds at once.
        """
        climb = self
        if math.dist(here, self.place) > _STILL:
            climb = replace(climb, place=freeze(here), since=time)
        if self.mode is Mode.BACK:
            trail = self.trail[:-1] if math.dist(here, self.trail[-1]) < _CRUMB else self.trail
            return replace(climb, trail=trail, mode=Mode.BACK if trail else Mode.GRADIENT)
        if self.trail and math.dist(here, self.trail[-1]) > _CRUMB:
            climb = replace(climb, trail=(*self.trail, freeze(here)))
        settled = time - climb.since >= _SETTLED
        if self.mode is Mode.BOOSTED:
            done = settled or time - self.began >= longest
            return replace(climb, mode=Mode.GRADIENT, since=time) if done else climb
        if not settled:
            return climb
        if self.trail and added < self.best:
            return replace(climb, mode=Mode.BACK, boosts=most, since=time)
        if self.boosts >= most:
            return replace(climb, trail=())
        begun = replace(climb, mode=Mode.BOOSTED, boosts=self.boosts + 1, since=time, began=time)
        return replace(begun, best=added, trail=(freeze(here),))


@dataclass(frozen=True, slots=True, eq=False)
class BoostingMemory(Memory):
    """Memory of the robots, with what they see, where that draws them, and their ascents."""

    view: View | None = None
    gradient: Array | None = None  # (n, 2) m, the one that each follows
    step: Array | None = None  # (n,), the part of full speed with which it does
    climbs: tuple[Climb, ...] = ()


@dataclass(frozen=True)
class Boosting(BaseController):
    """Coverage by joint detection, with boosting functions (Sun, Cassandras and Gokbayrak, CDC 2014).

    A robot detects an event at x, in line of sight and at a distance d within its sensing range, with the
    probability p_i = exp(-λ d); the team maximises

        H = ∫ φ(x) (1 - Π_i (1 - p_i(x))) dx

    Robot i adds to it ∫ φ Φ_i p_i over what it sees, where Φ_i is the probability that none of the others
    detects x. The gradient of that has three parts: w λ p_i towards each place in view, with w = φ Φ_i;
    for each corner that hides something the integral of w p_i (s - ρ)/ρ along the edge of the view (see
    `sight.Windows`); and, where the view ends for want of range, w p_i along that arc.

    At an optimum, where a robot comes to rest, the weight w is boosted, which makes another gradient:

        phi         κ Φ_i^γ w: what nobody else detects counts more
        p           κ (1 - Π (1 - p))^-γ w: so does what the whole team hardly detects
        neighbours  w, and each neighbour in range pushes with κ / d^γ

    A robot follows it until it rests again, or for `patience`, and then its own gradient to the next
    optimum. If it adds less there than before, it goes back the way it came, and stays; so the process
    ends no worse, but for what the others have changed meanwhile.

    The objective is not the coverage cost: it counts detections in sight, decays exponentially and ends at
    the sensing range, and nobody has to travel; robots gather where much is in view.

    Taken from the paper's abstract and what is generally known of it (arXiv 1409.0776) and of its sequel by
    Welikala and Cassandras (arXiv 1903.04133), not from their texts. Theirs know the map; here a robot goes
    by its own scan, and a neighbour sees x for all it knows unless the line between them passes behind
    something that the scan has met. Everybody boosts itself when it rests, without a
    common beat. Decided here: the way back, the times, and that obstacles and robots are kept off. The
    gains of the boost are of the kinds known, with values of ours.
    """

    name = "boosting"
    label = "Boosting"
    summary = "gradient of joint detection in sight, boosted at local optima (Sun and Cassandras 2014)"
    scanning = Scanning(rays=72, period=0.2)
    memory_type = BoostingMemory

    decay: float = gain(0.1, "1/m", "λ, how fast detection falls with distance", low=1e-3, high=100.0)
    boost: str = choice("phi", ("phi", "p", "neighbours"), "the boosting function")
    kappa: float = gain(1.0, "1", "κ, its size; for neighbours in m^(1+γ)")
    gamma: float = gain(2.0, "1", "γ, its exponent", high=20.0)
    boosts: float = gain(3.0, "times", "how often a robot is boosted at most", whole=True, high=1e3)
    patience: float = gain(8.0, "s", "longest time for which it is boosted at once")
    k_grad: float = gain(0.3, "1/s", "wanted speed per metre of the gradient", high=100.0)
    jump: float = gain(0.3, "m", "depth of a step in the view that is a window", low=0.01)
    clearance: float = gain(0.05, "m", "distance kept from obstacles and robots, rim to rim", high=10.0)
    response_time: float = response_time_gain()

    def decide(self, seen: Observations, memory: BoostingMemory) -> Decision:
        team, gradient, step, climbs = memory.team, memory.gradient, memory.step, memory.climbs
        reach = np.minimum(team.sensing_range, seen.region.diameter)
        view = compute_view(seen, memory.view, self.scanning, reach)
        if gradient is None or step is None or seen.scans is not None:
            before = gradient
            climbs = climbs or tuple(Climb(freeze(place), seen.time) for place in seen.positions)
            added, gradient, boosted = self.slopes(seen, view, reach)
            now = zip(climbs, seen.positions, added.tolist(), strict=True)
            often, longest = int(self.boosts), self.patience
            climbs = tuple(own.after(here, seen.time, value, often, longest) for own, here, value in now)
            follows = np.array([climb.mode is Mode.BOOSTED for climb in climbs])
            gradient = np.where(follows[:, None], boosted, gradient)
            step = compute_step_fractions(gradient, before, step)
        wanted = compute_approach_velocities(gradient, self.k_grad, team.max_speed) * step[:, None]
        for i, climb in enumerate(climbs):
            if climb.mode is Mode.BACK:
                wanted[i] = compute_approach_velocities(
                    (climb.trail[-1] - seen.positions[i])[None], 2.0, team.max_speed[i]
                )[0]
        returns, keep = update_returns(seen, memory.returns), team.radius + self.clearance
        points, apart = collect_obstacle_points(seen, returns), keep + float(team.radius.max())
        wanted = avoid_collisions(wanted, seen, team, points, Margins(keep, apart, 4.0, 0.5))
        forces = compute_drive_forces(wanted, seen, team, self.response_time)
        memory = BoostingMemory(team, returns, None, view, gradient, step, climbs)
        return Decision(forces, terms={"attraction": forces}, memory=memory)

    def slopes(self, seen: Observations, view: View, reach: Array) -> tuple[Array, Array, Array]:
        """Return what each robot adds to H, (n,) m², and its gradient and its boosted one, (n, 2) m each."""
        n, rays = view.distances.shape
        directions, turn = compute_headings(rays), 2.0 * np.pi / rays
        robot, other, offset, distance = seen.find_near_neighbours(2.0 * float(reach.max()))
        middle = (np.arange(_RINGS) + 0.5) / _RINGS
        along = view.distances[..., None] * middle  # (n, rays, rings) m
        places = seen.positions[:, None, None] + along[..., None] * directions[:, None]
        walls = np.where(view.hit, view.distances, np.inf)
        alone = undetected(along, walls, directions, robot, other, -offset, reach, self.decay)
        own = np.exp(-self.decay * along)
        weight = evaluate_density(seen.density, places) * alone
        area = along * (view.distances / _RINGS * turn)[..., None]
        added = (weight * own * area).sum(axis=(1, 2))
        boosted = weight
        if self.boost == "phi":
            boosted = self.kappa * alone**self.gamma * weight
        elif self.boost == "p":
            detected = 1.0 - alone * (1.0 - own)
            boosted = self.kappa * np.maximum(detected, 1e-3) ** -self.gamma * weight

        edges = find_windows(view, directions, reach, self.jump)
        ends = ~view.hit * np.exp(-self.decay * reach)[:, None] * reach[:, None] * turn
        gradients = []
        for each in (weight, boosted):
            density = each * own
            towards = self.decay * (density * area).sum(axis=2) + each[..., -1] * ends
            past = np.maximum(along[edges.robot, edges.ray] - edges.corner[:, None], 0.0)
            swept = (density[edges.robot, edges.ray] * past).sum(axis=1) / np.maximum(edges.corner, 1e-3)
            swept *= view.distances[edges.robot, edges.ray] / _RINGS
            gradients.append(
                (towards[..., None] * directions).sum(axis=1)
                + sum_by_robot(edges.robot, swept[:, None] * edges.across, n)
            )
        if self.boost == "neighbours":
            push = self.kappa / np.maximum(distance, 1e-3) ** (self.gamma + 1.0)
            gradients[1] = gradients[1] + sum_by_robot(robot, push[:, None] * offset, n)
        return added, gradients[0], gradients[1]


@kernel
def undetected(
    along: Array, walls: Array, directions: Array, robot: IntArray, other: IntArray, towards: Array,
    reach: Array, decay: float,
) -> Array:  # fmt: skip
    """Return the probability that no neighbour detects what is (n, rays, k) m along each ray, the same shape.

    Pairs, (m,), are of robots and their neighbours, (m, 2) m off. A neighbour detects within its reach,
    (n,) m, what is joined to it by a line in front of the walls that the robot sees, (n, rays) m.
    """
    result = np.ones(along.shape)
    for m in range(len(robot)):
        i, far = robot[m], reach[other[m]]
        if is_behind_wall(towards[m, 0], towards[m, 1], walls[i]):
            continue
        for r in range(len(directions)):
            for c in range(along.shape[2]):
                x, y = along[i, r, c] * directions[r, 0], along[i, r, c] * directions[r, 1]
                dx, dy = towards[m, 0] - x, towards[m, 1] - y
                distance = math.sqrt(dx * dx + dy * dy)
                if distance <= far and is_path_clear(x, y, dx, dy, walls[i]):
                    result[i, r, c] *= 1.0 - math.exp(-decay * distance)
    return result
