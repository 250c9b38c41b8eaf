"""The task that is to be learned: maps, team, time, observations, actions and reward."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.conditions import Conditions
from robocov.controllers.known_cells import compute_known_cells
from robocov.cost import CoverageCost, CoverageResult
from robocov.defaults import DEFAULT_DT_S, DEFAULT_DURATION_S, DEFAULT_ROBOTS
from robocov.environment import Environment
from robocov.errors import (
    ParameterError,
    describe_unknown_name,
    format_count,
    quote,
    require_number,
    require_type,
)
from robocov.mapfile import load_map
from robocov.observation import MAX_RAYS, Observations, Scans
from robocov.observation.region import Region
from robocov.simulation import check_dt
from robocov.team import Team

Action: TypeAlias = Literal["force", "velocity"]
"""A force in N, or a velocity in m/s."""
ACTIONS: tuple[Action, ...] = get_args(Action)
FOLLOWING = 0.1  # time constant in seconds with which a robot follows a velocity that it is told
Reward: TypeAlias = Literal["shared", "own", "level"]
"""Sharing of rewards among robots; see `shares`."""
REWARDS: tuple[Reward, ...] = get_args(Reward)
MapSource: TypeAlias = str | Path | Environment | Callable[[int], Environment]
"""A map, its name or path, or what makes one of a seed."""
SEEDS = 2**31  # a maker of maps is given a seed below this
_KEPT = 64  # maps with their costs that are kept at most
Rows: TypeAlias = NDArray[np.float32]
"""(n, size): one row for each robot."""
MOST_NEIGHBOURS = 1000  # most neighbours that a row has room for
MOST_ROBOTS = 10_000


def checked_kind(what: str, given: str, known: Sequence[str]) -> None:
    if given not in known:
        raise ParameterError(f"{what}: {describe_unknown_name(f'kind of {what}', str(given), known)}")


def action_limit(action: Action, team: Team) -> Array:
    """Return the largest component of an action that makes sense, (n,) N or m/s.

    A force of m a + nu v is what it takes to go at the largest speed v and be accelerated by the largest
    acceleration a all the same; what is more has no effect. Larger actions are no mistake: the world limits
    speed and acceleration, for learners as for all controllers.
    """
    if action == "velocity":
        return team.max_speed
    return np.asarray(team.mass * team.max_acceleration + team.viscosity * team.max_speed)


def driving_forces(action: Action, values: Array, velocities: Array, team: Team) -> Array:
    """Return the forces of actions, (n, 2) N.

    A velocity u of `values`, (n, 2), asks for ``F = nu u + m (u - q') / FOLLOWING``, where q' are the
    `velocities` now, (n, 2) m/s: against the viscosity of (28), and towards u.
    """
    if action == "force":
        return values
    nu, stiffness = team.viscosity[:, None], team.mass[:, None] / FOLLOWING
    return np.asarray(nu * values + stiffness * (values - velocities))


def actions_of(action: Action, forces: Array, velocities: Array, team: Team) -> Array:
    """Return the actions that give forces now: the other way of `driving_forces`, (n, 2) N or m/s."""
    if action == "force":
        return forces
    nu, stiffness = team.viscosity[:, None], team.mass[:, None] / FOLLOWING
    return np.asarray((forces + stiffness * velocities) / (nu + stiffness))


def reference_distance(area: float, robots: int) -> float:
    """Return a mean distance in metres that no placement of so many robots in so much area goes below.

    The mean distance to the middle of a disc, 2/3 of its radius, is the least among all shapes of its
    area; with n equal parts of the area A it is ``2/3 sqrt(A / (pi n))``. It makes costs of maps and teams of
    different sizes comparable.
    """
    return 2.0 / 3.0 * float(np.sqrt(area / (np.pi * robots)))


def shares(reward: Reward, before: CoverageResult, after: CoverageResult, part: float) -> Array:
    """Return what each robot gets for what became of the mean distance, (n,) m.

    ``shared``: the decrease, the same for all; summed over a run it is the whole decrease. ``own``: the part
    that the robot's own move made, by the gradients before and after (the trapezoidal rule), and an equal
    part of the rest. ``level``: less the mean distance itself, times the `part` of the run in between.
    """
    n = len(after.positions)
    if reward == "level":
        return np.full(n, -after.mean_distance * part)
    decrease = before.mean_distance - after.mean_distance
    if reward == "shared":
        return np.full(n, decrease)
    slope = np.zeros_like(after.positions)  # of the mean distance, before and after together
    for result in (before, after):
        if result.value:
            slope += result.gradient * (result.mean_distance / result.value)
    own = -0.5 * (slope * (after.positions - before.positions)).sum(axis=1)
    return np.asarray(own + (decrease - own.sum()) / n)


@dataclass(frozen=True)
class GeneratedMaps:
    """Makes a map of a seed by `robocov.generate_map`, to learn on many.

    The `seeds` are the maps that there are, as in ``range(1000)``; others can then be kept for the test.
    None: any. The `parameters` are further ones of `robocov.generate_map`: ``obstacles``, ``area``, ``gap``,
    ...

    Examples
    --------
    >>> GeneratedMaps("rooms", seeds=range(100))(742).name
    'rooms 42'
    """

    kind: str = "polygons"
    seeds: Sequence[int] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.seeds is not None and not len(self.seeds):
            raise ParameterError("maps: seeds: expected at least one, got none")

    def __call__(self, seed: int) -> Environment:
        """Return the map of a seed, or where `seeds` are given that of ``seeds[seed % len(seeds)]``.

        Raises ParameterError as `robocov.generate_map`.
        """
        from robocov.generator import generate_map

        number = seed if self.seeds is None else self.seeds[seed % len(self.seeds)]
        return generate_map(number, kind=self.kind, **self.parameters)


class Scenarios:
    """Draws maps, and keeps the coverage costs of some; raises InputError when one cannot be read."""

    def __init__(self, maps: MapSource | Sequence[MapSource], lattice: int) -> None:
        several = isinstance(maps, Sequence) and not isinstance(maps, str)
        given: Any = maps if several else (maps,)
        if not given:
            raise ParameterError("maps: expected at least one, got none")
        self._sources = [_source(each, f"maps[{k}]" if several else "maps") for k, each in enumerate(given)]
        self._lattice, self._costs = lattice, dict[Environment, CoverageCost]()

    @property
    def only(self) -> Environment | None:
        source = self._sources[0]
        return source if len(self._sources) == 1 and isinstance(source, Environment) else None

    def draw(self, rng: np.random.Generator) -> Environment:
        return map_of(self._sources[int(rng.integers(len(self._sources)))], int(rng.integers(SEEDS)))

    def cost(self, environment: Environment) -> CoverageCost:
        # the last one is the last that was asked for
        cost = self._costs.pop(environment, None) or CoverageCost(environment, self._lattice)
        self._costs[environment] = cost
        if len(self._costs) > _KEPT:
            del self._costs[next(iter(self._costs))]
        return cost


def map_of(given: object, seed: int) -> Environment:
    """Return a map: itself, that of a name or path, or what somebody's function makes of the seed."""
    source = _source(given, "map")
    environment = source if isinstance(source, Environment) else source(seed)
    if not isinstance(environment, Environment):
        raise ParameterError(f"maps: expected an Environment for seed {seed}, got {quote(environment)}")
    return environment


def _source(given: object, where: str) -> Environment | Callable[[int], Environment]:
    if isinstance(given, (str, Path)):
        return load_map(given)
    if isinstance(given, Environment) or callable(given):
        return given
    wanted = "a map, its name or path, or a function from a seed to one"
    raise ParameterError(f"{where}: expected {wanted}, got {quote(given)}")


@dataclass(frozen=True)
class ObservationLayout:
    """Layout of an observation: its numbers and their order.

    Row i holds only what robot i knows (see `robocov.observation`); all are from -1 to 1. The unit of
    ``D`` is the diagonal of the known region's bounding box, that of ``S`` the robot's sensing range, or
    ``D`` where that is shorter.

    =============  ==================  =====================================================================
    block          numbers             content
    =============  ==================  =====================================================================
    ``position``   2                   from the middle of the region's bounding box, D
    ``velocity``   2                   in the robot's largest speed
    ``obstacle``   3                   offset of the nearest sensed obstacle point, S; then 1; all 0 for none
    ``neighbour``  3 x `neighbours`    the nearest robots that are heard, nearest first: offset, D; then 1;
                                       all 0 where there is none
    ``rays``       `rays`              distance along each ray, evenly round from +x, S; 1 where it is free
    ``centroid``   2, if `centroid`    offset of the centroid (2) of the robot's Voronoi cell, by φ, D
    =============  ==================  =====================================================================

    Each ray costs a query of the physics. The centroid is the one number that a robot has to compute of the
    others: what Lloyd's algorithm steers to. Raises ParameterError when a number is out of range.

    Examples
    --------
    >>> layout = ObservationLayout(neighbours=2)
    >>> layout.size, layout.blocks["neighbour"]
    (13, slice(7, 13, None))
    """

    neighbours: int = 4
    rays: int = 0
    centroid: bool = False

    def __post_init__(self) -> None:
        for name, most in (("neighbours", MOST_NEIGHBOURS), ("rays", MAX_RAYS)):
            require_number(f"observation.{name}", getattr(self, name), 0, most, whole=True)
        require_type("observation.centroid", self.centroid, bool, "true or false")

    @cached_property
    def blocks(self) -> dict[str, slice]:
        """Slices of the blocks of a row, in their order; only those that it has."""
        counts = {"position": 2, "velocity": 2, "obstacle": 3, "neighbour": 3 * self.neighbours}
        counts |= {"rays": self.rays, "centroid": 2 * self.centroid}
        ends = zip(counts.items(), accumulate(counts.values()), strict=True)
        return {name: slice(end - count, end) for (name, count), end in ends if count}

    @property
    def size(self) -> int:
        return 7 + 3 * self.neighbours + self.rays + 2 * self.centroid

    @property
    def bounds(self) -> tuple[Rows, Rows]:
        """Least and largest values of a row, (size,) each."""
        low = np.full(self.size, -1.0, dtype=np.float32)
        rays = 7 + 3 * self.neighbours
        low[6:rays:3] = low[rays : rays + self.rays] = 0.0  # whether a point is there; distances
        return low, np.ones(self.size, dtype=np.float32)

    def rows(self, seen: Observations, team: Team, scans: Scans | None = None) -> Rows:
        """Return what each robot is told, (n, size), with the latest scans, by default those of `seen`."""
        n, unit = len(seen.positions), seen.region.diameter
        reach = np.clip(team.sensing_range, 1e-9, unit)[:, None]
        places, rows = self.blocks, np.zeros((n, self.size))
        rows[:, places["position"]] = from_middle(seen.positions, seen.region)
        rows[:, places["velocity"]] = seen.velocities / team.max_speed[:, None]
        sensed = ~np.isnan(seen.obstacle_points[:, 0])
        obstacle = rows[:, places["obstacle"]]
        obstacle[sensed, :2] = ((seen.obstacle_points - seen.positions) / reach)[sensed]
        obstacle[:, 2] = sensed
        if self.neighbours:
            robot, _, offset, distance = seen.find_near_neighbors(4.0 * unit)
            nearest = np.zeros((n, self.neighbours, 3))
            farthest = np.full((n, self.neighbours), np.inf)
            _nearest(robot, offset, distance, unit, farthest, nearest)
            rows[:, places["neighbour"]] = nearest.reshape(n, -1)
        if self.rays:
            scans = seen.scans if scans is None else scans
            if scans is None or scans.rays != self.rays:
                found, wanted = (
                    "none" if scans is None else scans.rays,
                    f"expected {self.rays} rays in a scan",
                )
                raise ParameterError(f"observation.rays: {wanted}, got {found}")
            rows[:, places["rays"]] = np.where(scans.hit, scans.distances / reach, 1.0)
        if self.centroid:
            centroid = compute_known_cells(seen, "distance", None).centroid
            rows[:, places["centroid"]] = (centroid - seen.positions) / unit
        # what is believed of places may be off by more than there is
        return np.minimum(np.maximum(rows, -1.0), 1.0).astype(np.float32)


def from_middle(positions: Array, region: Region) -> Array:
    """Return positions from the middle of a region's bounding box, in its diagonals, (n, 2)."""
    low_x, low_y, high_x, high_y = region.bounds
    middle = np.array([(low_x + high_x) / 2.0, (low_y + high_y) / 2.0])
    return np.asarray((positions - middle) / region.diameter)


@kernel
def _nearest(robot: IntArray, offset: Array, distance: Array, unit: float, best: Array, found: Array) -> None:
    """Put the nearest neighbours of robots into `found`, (n, count, 3), their distances into `best`."""
    for k in range(len(robot)):
        i, place = robot[k], best.shape[1]
        # what is equally far stays in the order of the numbers
        while place > 0 and distance[k] < best[i, place - 1]:
            place -= 1
        for later in range(best.shape[1] - 1, place, -1):
            best[i, later] = best[i, later - 1]
            for c in range(3):
                found[i, later, c] = found[i, later - 1, c]
        if place < best.shape[1]:
            best[i, place], found[i, place, 2] = distance[k], 1.0
            for c in range(2):
                # from the robot to its neighbour
                found[i, place, c] = -offset[k, c] / unit


@dataclass(frozen=True, eq=False)
class CoverageTask:
    """All that makes a learning environment, for one learner or many; all in SI units.

    With several `maps` one is drawn for each episode, each as likely; a function, such as `GeneratedMaps`, is
    given a new seed each time. The exact cost takes about as long as ten control periods of six robots.

    Raises ParameterError when a value is out of range.

    Examples
    --------
    >>> task = CoverageTask(robots=4, duration=30.0)
    >>> task.cycles, round(task.period, 3)
    (300, 0.1)
    """

    maps: MapSource | Sequence[MapSource] = "rooms"
    start: str | None = None  # None: each map's first; "*": any of its starts
    robots: int = DEFAULT_ROBOTS
    team: Team | None = None  # None: equal robots; its size goes before `robots`
    duration: float = DEFAULT_DURATION_S  # after which an episode is truncated
    dt: float = DEFAULT_DT_S  # control period of the physics, s
    repeat: int = 6  # so many control periods long an action is held
    action: Action = "force"  # N, or "velocity", m/s
    reward: Reward = "shared"  # see `shares`; in units of `reference_distance` of the whole team
    contact_penalty: float = 0.1  # for each second in contact with a wall or another robot
    lattice: int = 32  # of the coverage cost that is rewarded: exact distances, from few sites
    reward_every: int = 1  # after so many actions, and the last, the cost is evaluated and rewarded
    observation: ObservationLayout = field(default_factory=ObservationLayout)
    conditions: Conditions | None = None  # their seed is drawn anew for each episode
    recording: bool = False  # keep what `Episode.record` needs: some 2 MB a minute for six robots

    def __post_init__(self) -> None:
        check_dt(self.dt)
        for name, most in (("robots", MOST_ROBOTS), ("repeat", 100_000), ("reward_every", 100_000)):
            require_number(name, getattr(self, name), 1, most, whole=True)
        if not np.isfinite(self.duration) or self.duration < self.period - 5e-7:
            wanted = f"expected at least the time of one action, {self.period:g} s"
            raise ParameterError(f"duration: {wanted}, got {quote(self.duration)} s")
        if not 0.0 <= self.contact_penalty < np.inf:
            found = quote(self.contact_penalty)
            raise ParameterError(f"contact_penalty: expected a finite number from 0, got {found}")
        checked_kind("reward", self.reward, REWARDS)
        checked_kind("action", self.action, ACTIONS)
        if self.action == "velocity" and self.dt > FOLLOWING:
            wanted = f"expected at most {FOLLOWING:g} s for robots to follow velocities"
            raise ParameterError(f"dt: {wanted}, got {self.dt:g} s")
        for name, kind in (("team", Team), ("observation", ObservationLayout), ("conditions", Conditions)):
            if getattr(self, name) is not None or name == "observation":
                require_type(name, getattr(self, name), kind, f"a {kind.__name__}")
        if self.conditions is not None:
            self.conditions.check_team(len(self.whole_team))
        object.__setattr__(self, "team", self.whole_team)
        object.__setattr__(self, "robots", len(self.whole_team))

    @property
    def whole_team(self) -> Team:
        return Team.homogeneous(self.robots) if self.team is None else self.team

    @property
    def period(self) -> float:
        """Seconds for which an action is held."""
        return self.repeat * self.dt

    @property
    def cycles(self) -> int:
        return max(1, round(self.duration / self.period))

    @property
    def agents(self) -> list[str]:
        return [f"robot_{number}" for number in range(1, self.robots + 1)]

    def __repr__(self) -> str:
        robots = format_count(self.robots, "robot")
        actions = format_count(self.cycles, "action")
        return f"<CoverageTask {robots}, {self.duration:g} s, {actions}, {self.action}, reward {self.reward}>"


def changed_task(task: CoverageTask | None, changes: Mapping[str, Any]) -> CoverageTask:
    """Return a task, by default the usual one, with some of its attributes changed; raises ParameterError."""
    known = [each.name for each in fields(CoverageTask)]
    for name in changes:
        if name not in known:
            raise ParameterError(describe_unknown_name("part of a task", name, known))
    # the number of robots goes with the team, and would else be that of the old one
    team: dict[str, Any] = {"team": None} if "robots" in changes else {}
    return replace(task or CoverageTask(), **(team | dict(changes)))
