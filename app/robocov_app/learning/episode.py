"""One episode: a simulation that is driven by actions, and what came of each; environments of episodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.cost import CoverageCost, CoverageResult, TimeVaryingCost
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, StartError, describe_unknown_name, quote
from robocov.metrics import MAX_CONTACT_GAP_M
from robocov.observation import Decision, Observations, Scanning, Snapshot
from robocov.observation.close_pairs import find_close_pairs
from robocov.observation.region import Region
from robocov.record import Record
from robocov.scenario import Scenario
from robocov.simulation import Simulation, SimulationBatch
from robocov.team import Team
from robocov_app.learning import task as tasks
from robocov_app.learning.task import SEEDS, CoverageTask, Rows, Scenarios, changed_task, from_middle

if TYPE_CHECKING:
    from robocov_app.render.picture import Painter
    from robocov_app.runs.encoding import Frame


@dataclass(frozen=True)
class Learner:
    """Stands where a controller stands in a simulation that is driven from outside."""

    name: ClassVar[str] = "learner"
    label: ClassVar[str] = "learner"
    summary: ClassVar[str] = "whoever acts in a learning environment"

    scanning: Scanning | None = None

    @classmethod
    def of(cls, task: CoverageTask) -> Learner:
        rays = task.observation.rays
        return cls(Scanning(rays, task.period) if rays else None)

    def begin(self, region: Region, team: Team) -> None:
        """Nothing is remembered here."""

    def decide(self, seen: Observations, memory: None) -> Decision:
        """Return no forces; those of the actions are given at each step."""
        return Decision(np.zeros_like(seen.positions))


@dataclass(frozen=True, eq=False)
class Outcome:
    """Outcome of an action: rewards, (n,), and how long each robot touched something, (n,) s."""

    rewards: Array
    contact: Array


def drawn_episode(
    task: CoverageTask,
    scenarios: Scenarios,
    rng: np.random.Generator,
    options: Mapping[str, Any] | None = None,
    place: Place | None = None,
) -> Episode:
    """Return a new episode, by chance where the options leave it to chance.

    The options: ``map``: a map, its name or path. ``start``: the name of one of its starts. ``start_seed``:
    the seed of the positions, as that of `robocov run`. ``positions``: the positions themselves, (n, 2) m.
    ``conditions_seed``: the seed of the task's conditions. `place`: beside others on the same map.
    """
    options = options or {}
    environment = scenarios.draw(rng)
    if "map" in options:
        environment = tasks.map_of(options["map"], int(rng.integers(SEEDS)))
    name = options.get("start", task.start)
    starts = list(environment.starts) or ["uniform"]
    any_start, seed = starts[int(rng.integers(len(starts)))], int(rng.integers(SEEDS))
    start: dict[str, Any] = {"start": environment.start(any_start if name == "*" else name).name}
    start["seed"] = options.get("start_seed", seed)
    conditions, chance = task.conditions, int(rng.integers(SEEDS))
    if conditions is not None:
        conditions = replace(conditions, seed=options.get("conditions_seed", chance))
    cost = scenarios.cost(environment)
    if "positions" in options:
        try:
            positions = np.asarray(options["positions"], dtype=float)
        except (TypeError, ValueError):
            raise StartError(
                f"positions: expected an array of shape (n, 2), got {quote(options['positions'])}"
            ) from None
        start = {"starts": positions, "start": None, "seed": None}
    more: dict[str, Any] = {"duration": task.duration, "dt": task.dt, "conditions": conditions}
    return Episode(task, Scenario(environment, team=task.whole_team, **start, **more), cost, place)


class SharedSimulation:
    """One simulation for `count` ideal episodes on one map, in which nothing moves, moved on together."""

    def __init__(self, task: CoverageTask, environment: Environment, count: int) -> None:
        self.environment = environment
        self._task = task
        self._count = count
        self._joint_team = Team.concatenate([task.whole_team] * count)
        self._simulation: SimulationBatch | None = None
        self._observed: Observations | None = None
        self._rows: Rows = np.empty((0, 0, 0), dtype=np.float32)

    def begin(self, run: int, positions: Array) -> SimulationBatch:
        if self._simulation is None:
            # The other episodes take their own positions when they begin.
            self._simulation = SimulationBatch(
                self.environment,
                Learner.of(self._task),
                np.tile(positions, (self._count, 1, 1)),
                self._task.whole_team,
                self._task.dt,
            )
        self._simulation.restart(run, positions)
        return self._simulation

    def advance(self, actions: Array, episodes: Mapping[int, Episode]) -> dict[int, Outcome]:
        """Hold actions, (count, n, 2) N or m/s; return what came of those of some of the episodes."""
        assert self._simulation is not None
        contact = held(self._task, self._simulation, actions)
        due = [run for run, episode in episodes.items() if episode.due()]
        results: dict[int, CoverageResult] = {}
        if due:
            positions = self._simulation.positions[due]
            results = dict(zip(due, episodes[due[0]].cost.evaluate_teams(positions), strict=True))
        each = episodes.items()
        return {run: one.moved(contact[run], run in results, results.get(run)) for run, one in each}

    def rows(self) -> Rows:
        """Return what the robots of all episodes are told now, (count, n, size)."""
        assert self._simulation is not None
        observations = self._simulation.observe()
        if observations is not self._observed:
            rows = self._task.observation.rows(observations, self._joint_team)
            self._rows = rows.reshape(self._count, -1, rows.shape[1])
            self._observed = observations
        return self._rows


Place: TypeAlias = "tuple[SharedSimulation, int]"
"""A simulation, and the number of the episode in it."""


class Episode:
    """A team in one map, of which `cost` is the coverage cost, from the start of a run.

    `working`, (n,): who is there and has not failed; `result`, `initial`: their cost now and at first;
    `reference`, m: the unit of rewards; `trail`: positions, (n, 2) m, at each decision so far.
    """

    def __init__(
        self, task: CoverageTask, scenario: Scenario, cost: CoverageCost, place: Place | None = None
    ) -> None:
        environment, positions = scenario.environment, scenario.starts
        self.task = task
        self.team = scenario.team
        self.environment = environment
        self._scenario = scenario
        shared, run = place or (None, 0)
        self.shared: SharedSimulation | None = None
        self.simulation: Simulation | SimulationBatch
        # The index of the episode's robots in the arrays of the simulation.
        self._index: int | slice = slice(None)
        if shared is not None and shared.environment is environment:
            self.shared = shared
            self._index = run
            self.simulation = shared.begin(run, positions)
        else:
            self.simulation = scenario.build_simulation(Learner.of(task))
        self.working = self.simulation.working[self._index]
        self.cost, self._cost = cost, TimeVaryingCost(cost)
        self._all_count = scenario.conditions is None and not environment.has_moving_obstacles
        self._counted = self._cost.find_counted_robots(0.0, self.positions, self.working)
        result = self._cost(0.0, self.positions, self.working)
        if result is None or not result.mean_distance > 0.0:
            wanted = f"expected a finer lattice for map {environment.name!r}"
            raise ParameterError(f"lattice: {wanted}, got {task.lattice}")
        self.result = self.initial = result
        self.reference = tasks.reference_distance(
            environment.free_area - result.uncovered_area, scenario.robots
        )
        self.trail = [self.positions]
        self._rewarded = 0
        self._scans = self.simulation.observe().scans
        self._moments: list[Snapshot] = []

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m."""
        return self.simulation.positions[self._index]

    @property
    def time(self) -> float:
        return self.cycle * self.task.repeat * self.task.dt

    @property
    def cycle(self) -> int:
        return len(self.trail) - 1

    def observations(self) -> Rows:
        """Return what each robot is told now, (n, size)."""
        if self.shared is not None:
            return self.shared.rows()[self._index]
        return self.task.observation.rows(self.simulation.observe(), self.team, self._scans)

    def observe(self) -> Observations:
        """Return what the robots of this episode know now."""
        if isinstance(self.simulation, SimulationBatch):
            assert isinstance(self._index, int)
            return self.simulation.observe_run(self._index)
        return self.simulation.observe()

    def snapshot(self) -> Snapshot:
        """Return the present step of this episode, without forces."""
        if isinstance(self.simulation, Simulation):
            return self.simulation.observe_and_decide()
        return Snapshot(self.observe(), Decision(np.zeros_like(self.positions)))

    def state(self) -> Rows:
        """Return where all are, from the middle in diagonals, and how fast, (4 n,) from -1 to 1."""
        where = from_middle(self.positions, self.environment.region)
        speed = self.simulation.velocities[self._index] / self.team.max_speed[:, None]
        rows: Rows = np.clip(np.column_stack([where, speed]), -1.0, 1.0).astype(np.float32)
        return rows.ravel()

    def facts(self) -> dict[str, float]:
        facts = {"time_s": self.time, "mean_distance_m": self.result.mean_distance}
        return facts | {"uncovered_area_m2": self.result.uncovered_area}

    def advance(self, actions: Array, *, last: bool = False) -> Outcome:
        """Hold actions, (n, 2) N or m/s, for one decision; the last one is rewarded in any case."""
        moments = self._moments if self.task.recording else None
        contact = held(self.task, self.simulation, checked_actions(actions, len(self.team)), moments)
        self.working = self.simulation.working[self._index]
        self._scans = self.simulation.observe().scans
        return self.moved(contact, last or self.due())

    def due(self) -> bool:
        since = self.cycle + 1 - self._rewarded
        return since >= self.task.reward_every or self.cycle + 1 >= self.task.cycles

    def moved(self, contact: Array, rewarded: bool, result: CoverageResult | None = None) -> Outcome:
        """Return what came of an action that has been held, with so much contact, (n,) s."""
        self.trail.append(self.positions)
        gained = self._gained(rewarded, result) / self.reference
        return Outcome(np.asarray(gained - self.task.contact_penalty * contact), contact)

    def _gained(self, rewarded: bool, result: CoverageResult | None) -> Array:
        """Return what each robot gets for what became of the cost, (n,) m, and take the new cost.

        Who fails is nobody's doing: those who have counted all the time get what became of their own cost.
        """
        task, now, since = self.task, self.time, self.cycle - self._rewarded
        gained, stayed, before = np.zeros(len(self.team)), self._counted, self.result
        positions, earlier = self.trail[-1], self.trail[self._rewarded]
        changed = False
        if not self._all_count:
            counted = self._cost.find_counted_robots(now, positions, self.working)
            changed = not np.array_equal(counted, self._counted)
            stayed, self._counted = counted & self._counted, counted
        if not (rewarded or changed):
            return gained
        self._rewarded = self.cycle
        if self._counted.any():
            self.result = result or self._cost.get_cost(now)(positions[self._counted])
        after = self.result
        if not stayed.any():
            return gained
        if changed:
            before = self._cost.get_cost(now - since * task.period)(earlier[stayed])
            after = self._cost.get_cost(now)(positions[stayed])
        gained[stayed] = tasks.shares(task.reward, before, after, since / task.cycles)
        return gained

    def record(self) -> Record:
        """Return the episode so far as a record, without forces at its end; the task says `recording`."""
        if not self.task.recording or isinstance(self.simulation, SimulationBatch):
            raise ParameterError("record: expected a task with recording=True")
        recorder = self._scenario.build_recorder(self.simulation.controller)
        for moment in (*self._moments, self.snapshot()):
            recorder.add(moment)
        return recorder.record(self.simulation.joined)


def held(
    task: CoverageTask,
    simulation: Simulation | SimulationBatch,
    actions: Array,
    moments: list[Snapshot] | None = None,
) -> Array:
    """Hold actions for the time of one decision.

    Parameters
    ----------
    task : CoverageTask
    simulation : Simulation or SimulationBatch
    actions : (n, 2) or (runs, n, 2) array, N or m/s
    moments : list of Snapshot, or None
        Where to append the snapshots of the steps of a single simulation.

    Returns
    -------
    (n,) or (runs, n) array, s
        Time in contact.
    """
    contact = np.zeros(actions.shape[:-1])
    for _ in range(task.repeat):
        forces = tasks.driving_forces(task.action, actions, simulation.velocities, simulation.team)
        forces = np.where(simulation.working[..., None], forces, 0.0)
        if moments is not None and isinstance(simulation, Simulation):
            moments.append(replace(simulation.observe_and_decide(), decision=Decision(forces)))
        simulation.step(forces=forces)
        contact += task.dt * _find_touching(simulation)
    return contact


def _find_touching(simulation: Simulation | SimulationBatch) -> BoolArray:
    """Return which working robots touch a wall or another robot now, (n,) or (runs, n)."""
    shape = simulation.working.shape
    robots = len(simulation.team)
    positions = simulation.positions.reshape(-1, 2)
    working = simulation.working.ravel()
    radius = np.broadcast_to(simulation.team.radius, shape).ravel()
    nearest = simulation.sensor.find_nearest_points(positions, radius + MAX_CONTACT_GAP_M)
    touching = working & ~np.isnan(nearest[:, 0])
    reach = 2.0 * float(radius.max()) + MAX_CONTACT_GAP_M
    # Robots of different runs are moved far apart, so that only pairs of one run are close.
    run = np.arange(len(positions)) // robots
    moved_apart = positions + (2.0 * (simulation.environment.region.diameter + reach) * run)[:, None]
    first, second, _ = find_close_pairs(moved_apart, 1.001 * reach)
    if len(first) > 0:
        x, y = (positions[first] - positions[second]).T
        is_contact = np.sqrt(x * x + y * y) <= radius[first] + radius[second] + MAX_CONTACT_GAP_M
        touching[first[is_contact & working[first] & working[second]]] = True
    return touching.reshape(shape)


def checked_actions(actions: Any, count: int) -> Array:
    """Return the actions of so many robots, (count, 2), or raise ParameterError that names the robot."""
    array = np.asarray(actions, dtype=np.float64)
    if array.shape != (count, 2):
        raise ParameterError(f"expected actions of shape {(count, 2)}, got {array.shape}")
    if not np.isfinite(array).all():
        robot = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        told = f"expected finite numbers, got {quote(array[robot].tolist())}"
        raise ParameterError(f"action of robot_{robot + 1}: {told}")
    return array


RENDER_MODES = ("rgb_array", "human")


class EpisodeEnv:
    """An environment with `changes` of a task, whose `episode` is drawn as runs are drawn everywhere.

    `render_mode` is ``rgb_array``, ``human``, which opens a window and needs a display, or None; `size` is
    width and height in pixels, `theme` light or dark. Several may share the `scenarios` of their task. Raises
    InputError when the task makes no sense or a map cannot be read.
    """

    # of films of the usual task, one picture for each action
    metadata: ClassVar[dict[str, Any]] = {"render_modes": list(RENDER_MODES), "render_fps": 10}

    def __init__(
        self,
        task: CoverageTask | None = None,
        *,
        render_mode: str | None = None,
        size: tuple[int, int] = (640, 480),
        theme: str = "light",
        scenarios: Scenarios | None = None,
        **changes: Any,
    ) -> None:
        self.task = changed_task(task, changes)
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ParameterError(
                f"render_mode: {describe_unknown_name('mode', str(render_mode), RENDER_MODES)}"
            )
        if len(size) != 2 or not all(64 <= side <= 8192 for side in size):
            raise ParameterError(f"size: expected width and height from 64 to 8192 pixels, got {size}")
        if theme not in ("light", "dark"):
            raise ParameterError(f"theme: {describe_unknown_name('theme', str(theme), ('light', 'dark'))}")
        self.render_mode, self._theme, self._size = render_mode, theme, (int(size[0]), int(size[1]))
        self._scenarios = Scenarios(self.task.maps, self.task.lattice) if scenarios is None else scenarios
        self.episode: Episode | None = None
        self._painter: Painter | None = None
        self._window: Any = None
        self._clock: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle or to copy: without the window, and what is drawn on, if any."""
        return {**vars(self), "_painter": None, "_window": None, "_clock": None}

    def _present(self) -> Episode:
        if self.episode is None:
            raise RobocovError("environment: call reset() first")
        return self.episode

    def render(self) -> Frame | None:
        """Return a picture, (height, width, 3) of 0 to 255, with ``rgb_array``; else None."""
        episode = self._present()
        if self.render_mode != "rgb_array":
            return None
        painter, scene = self._drawn(episode)
        return painter.frame(scene).copy()

    def close(self) -> None:
        if self._window is not None:
            import pygame

            pygame.display.quit()
            self._window = self._clock = None

    def _drawn(self, episode: Episode) -> tuple[Painter, Any]:
        from robocov_app.render.picture import Painter
        from robocov_app.render.scene import Scene
        from robocov_app.render.theme import theme_named

        if self._painter is None or self._painter.environment is not episode.environment:
            self._painter = Painter(episode.environment, self._size, theme_named(self._theme))
        drawn, trail = (episode.environment, episode.team), np.array(episode.trail)
        ways = {"starts": trail[0], "trail": trail}
        ways["trail_time"] = np.arange(float(len(trail))) * episode.task.period
        label = f"action {episode.cycle} of {episode.task.cycles}"
        cost = f"mean distance {episode.result.mean_distance:.3f} m"
        scene = Scene.of(*drawn, episode.snapshot(), **ways, label=label, cost=cost)
        return self._painter, scene

    def _show(self) -> None:
        if self.render_mode != "human":
            return
        import pygame

        if self._window is None:
            try:
                pygame.display.init()
                self._window = pygame.display.set_mode(self._size)
            except pygame.error as error:
                raise RobocovError(f"render_mode: 'human', but there is no display ({error})") from error
            pygame.display.set_caption("robocov")
            self._clock = pygame.time.Clock()
        pygame.event.pump()
        painter, scene = self._drawn(self._present())
        painter.draw(self._window, scene)
        pygame.display.flip()
        self._clock.tick(1.0 / self.task.period)
