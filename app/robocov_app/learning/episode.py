"""One episode: a simulation that is driven by actions, and the rewards of these actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from robocov.cost import CoverageCost, CoverageResult, TimeVaryingCost
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Scanning, Snapshot
from robocov.observation.region import Region
from robocov.record import Record
from robocov.scenario import Scenario
from robocov.simulation import Simulation, SimulationBatch
from robocov.team import Team
from robocov.typing import BoolArray, Float32Array, FloatArray
from robocov_app.learning.actions import check_actions
from robocov_app.learning.motion import execute_actions
from robocov_app.learning.observation_layout import normalize_positions
from robocov_app.learning.rewards import compute_reference_distance, share_reward
from robocov_app.learning.task import CoverageTask


@dataclass(frozen=True)
class ExternalController:
    """Placeholder controller of a simulation that receives its forces from a learner.

    Parameters
    ----------
    scanning : Scanning, optional
        Scans that the observations need.
    """

    name: ClassVar[str] = "learner"
    label: ClassVar[str] = "learner"
    summary: ClassVar[str] = "the learner that acts in a learning environment"

    scanning: Scanning | None = None

    @classmethod
    def from_task(cls, task: CoverageTask) -> ExternalController:
        """Build the controller with the scans that the observations of a task need."""
        rays = task.observation.rays
        return cls(Scanning(rays, task.period) if rays else None)

    def begin(self, region: Region, team: Team) -> None:
        """Return None, because the controller needs no memory."""

    def decide(self, seen: Observations, memory: None) -> Decision:
        """Return zero forces. The forces of the actions are passed to each simulation step instead."""
        return Decision(np.zeros_like(seen.positions))


@dataclass(frozen=True, eq=False)
class ActionOutcome:
    """Rewards and contact times of one action of each robot.

    Parameters
    ----------
    rewards : (n,) array
        In units of the reference distance of the episode.
    contact_time : (n,) array, s
        Time in contact with a wall or another robot.
    """

    rewards: FloatArray
    contact_time: FloatArray


class SharedSimulation:
    """One batch simulation of several episodes on the same map, which are advanced together.

    The episodes have no conditions, and the map has no moving obstacles.

    Parameters
    ----------
    task : CoverageTask
    environment : Environment
    count : int
        Number of episodes.
    """

    def __init__(self, task: CoverageTask, environment: Environment, count: int) -> None:
        self.environment = environment
        self._task = task
        self._count = count
        self._joint_team = Team.concatenate([task.whole_team] * count)
        self._simulation: SimulationBatch | None = None
        self._observed: Observations | None = None
        self._rows: Float32Array = np.empty((0, 0, 0), dtype=np.float32)

    def start_episode(self, run: int, positions: FloatArray) -> SimulationBatch:
        """Start an episode, and return the simulation of all episodes.

        Parameters
        ----------
        run : int
            Index of the episode in the simulation.
        positions : (n, 2) array, m
            Initial positions.
        """
        if self._simulation is None:
            # The other episodes set their own positions when they start.
            self._simulation = SimulationBatch(
                self.environment,
                ExternalController.from_task(self._task),
                np.tile(positions, (self._count, 1, 1)),
                self._task.whole_team,
                self._task.dt,
            )
        self._simulation.restart(run, positions)
        return self._simulation

    def step(self, actions: FloatArray, episodes: Mapping[int, Episode]) -> dict[int, ActionOutcome]:
        """Advance all episodes by one action period.

        Parameters
        ----------
        actions : (count, n, 2) array, N or m/s
        episodes : Mapping
            Episodes for which outcomes are computed, by index.

        Returns
        -------
        dict
            Outcomes of these episodes, by index.
        """
        assert self._simulation is not None
        contact_time = execute_actions(self._task, self._simulation, actions)
        due = [run for run, episode in episodes.items() if episode.is_reward_due()]
        coverage_by_run: dict[int, CoverageResult] = {}
        if due:
            # All episodes are on the same map, so the cost of any of them can be used.
            cost = episodes[due[0]].cost
            results = cost.evaluate_teams(self._simulation.positions[due])
            coverage_by_run = dict(zip(due, results, strict=True))
        outcomes = {}
        for run, episode in episodes.items():
            coverage = coverage_by_run.get(run)
            outcomes[run] = episode.finish_action(
                contact_time[run], is_rewarded=coverage is not None, coverage=coverage
            )
        return outcomes

    def build_rows(self) -> Float32Array:
        """Return the current observation rows of all episodes, (count, n, size)."""
        assert self._simulation is not None
        observations = self._simulation.observe()
        # The simulation returns the same object until it advances, so the rows are computed only once.
        if observations is not self._observed:
            rows = self._task.observation.build_rows(observations, self._joint_team)
            self._rows = rows.reshape(self._count, -1, rows.shape[1])
            self._observed = observations
        return self._rows


class SharedRun(NamedTuple):
    """Position of an episode in a shared simulation."""

    simulation: SharedSimulation
    run: int
    """Index of the episode in the simulation."""


class Episode:
    """An episode of a team on one map.

    Parameters
    ----------
    task : CoverageTask
    scenario : Scenario
        Map, start, team and conditions of the episode.
    cost : CoverageCost
        Coverage cost of the map.
    shared_run : SharedRun, optional
        Position in a shared simulation, which is used if it is on the same map.

    Attributes
    ----------
    is_working : (n,) array of bool
        Which robots have joined and not failed.
    coverage, initial_coverage : CoverageResult
        Coverage cost when it was last evaluated, and at the start.
    reference_distance : float
        Unit of rewards, m.
    trail : list of (n, 2) arrays, m
        Positions at each decision so far.
    shared : SharedSimulation or None
        The shared simulation, if one is used.

    Raises
    ------
    ParameterError
        If the lattice of the cost is too coarse for the map.
    """

    def __init__(
        self,
        task: CoverageTask,
        scenario: Scenario,
        cost: CoverageCost,
        shared_run: SharedRun | None = None,
    ) -> None:
        self.task = task
        self.team = scenario.team
        self.environment = scenario.environment
        self._scenario = scenario
        self.shared: SharedSimulation | None = None
        self.simulation: Simulation | SimulationBatch
        # Selects the robots of this episode in the arrays of the simulation: all, or those of one run.
        self._index: int | slice = slice(None)
        if shared_run is not None and shared_run.simulation.environment is scenario.environment:
            self.shared = shared_run.simulation
            self._index = shared_run.run
            self.simulation = self.shared.start_episode(shared_run.run, scenario.starts)
        else:
            self.simulation = scenario.build_simulation(ExternalController.from_task(task))
        self.is_working = self.simulation.is_working[self._index]
        self.cost = cost
        self._cost_over_time = TimeVaryingCost(cost)
        self._has_constant_team = scenario.conditions is None and not self.environment.has_moving_obstacles
        self._available = self._cost_over_time.find_available_robots(0.0, self.positions, self.is_working)
        coverage = self._cost_over_time(0.0, self.positions, self.is_working)
        if coverage is None or not coverage.mean_distance > 0.0:
            raise ParameterError(
                f"lattice: expected a finer lattice for map {self.environment.name!r}, got {task.lattice}"
            )
        self.initial_coverage = coverage
        self.coverage = coverage
        covered_area = self.environment.free_area - coverage.uncovered_area
        self.reference_distance = compute_reference_distance(covered_area, scenario.robots)
        self.trail = [self.positions]
        self._rewarded_cycle = 0
        self._scans = self.simulation.observe().scans
        self._snapshots: list[Snapshot] = []

    @property
    def positions(self) -> FloatArray:
        """Centers of the robots, (n, 2) m."""
        return self.simulation.positions[self._index]

    @property
    def time(self) -> float:
        """Simulation time, s."""
        return self.cycle * self.task.repeat * self.task.dt

    @property
    def cycle(self) -> int:
        """Number of finished actions."""
        return len(self.trail) - 1

    def build_rows(self) -> Float32Array:
        """Return the current observations for learners, one row for each robot, (n, size)."""
        if self.shared is not None:
            return self.shared.build_rows()[self._index]
        return self.task.observation.build_rows(self.simulation.observe(), self.team, self._scans)

    def observe(self) -> Observations:
        """Return the current observations of all robots, as controllers receive them."""
        if isinstance(self.simulation, SimulationBatch):
            assert isinstance(self._index, int)
            return self.simulation.observe_run(self._index)
        return self.simulation.observe()

    def take_snapshot(self) -> Snapshot:
        """Return a snapshot of the current state, with zero forces."""
        if isinstance(self.simulation, Simulation):
            return self.simulation.observe_and_decide()
        return Snapshot(self.observe(), Decision(np.zeros_like(self.positions)))

    def build_state(self) -> Float32Array:
        """Return the normalized positions and velocities of all robots, (4 n,) from -1 to 1.

        Each robot has four values: its position from the center of the region's bounding box, divided by the
        diagonal, and its velocity, divided by its maximum speed.
        """
        positions = normalize_positions(self.positions, self.environment.region)
        velocities = self.simulation.velocities[self._index] / self.team.max_speed[:, None]
        rows: Float32Array = np.clip(np.column_stack([positions, velocities]), -1.0, 1.0).astype(np.float32)
        return rows.ravel()

    def summarize(self) -> dict[str, float]:
        """Return time, mean distance and uncovered area for the info dictionary of an environment."""
        return {
            "time_s": self.time,
            "mean_distance_m": self.coverage.mean_distance,
            "uncovered_area_m2": self.coverage.uncovered_area,
        }

    def advance(self, actions: FloatArray, *, is_last: bool = False) -> ActionOutcome:
        """Execute one action of each robot, held for one action period.

        Parameters
        ----------
        actions : (n, 2) array, N or m/s
        is_last : bool
            Whether this is the last action of the episode, which is always rewarded.
        """
        snapshots = self._snapshots if self.task.recording else None
        checked = check_actions(actions, len(self.team))
        contact_time = execute_actions(self.task, self.simulation, checked, snapshots)
        self.is_working = self.simulation.is_working[self._index]
        self._scans = self.simulation.observe().scans
        return self.finish_action(contact_time, is_rewarded=is_last or self.is_reward_due())

    def is_reward_due(self) -> bool:
        """Return whether the next action is rewarded."""
        actions = self.cycle + 1 - self._rewarded_cycle
        return actions >= self.task.reward_every or self.cycle + 1 >= self.task.cycles

    def finish_action(
        self, contact_time: FloatArray, *, is_rewarded: bool, coverage: CoverageResult | None = None
    ) -> ActionOutcome:
        """Record the positions after an action, and compute its rewards.

        Parameters
        ----------
        contact_time : (n,) array, s
            Time in contact during the action.
        is_rewarded : bool
            Whether the cost is evaluated and its change rewarded.
        coverage : CoverageResult, optional
            The current cost, if it has been computed already.
        """
        self.trail.append(self.positions)
        shares = self._share_cost_change(coverage, is_rewarded=is_rewarded) / self.reference_distance
        penalties = self.task.contact_penalty * contact_time
        return ActionOutcome(np.asarray(shares - penalties), contact_time)

    def _share_cost_change(self, coverage: CoverageResult | None, *, is_rewarded: bool) -> FloatArray:
        """Evaluate the cost, and split its change since the last reward among the robots, (n,) m.

        Robots must not be rewarded or punished because others join or fail. When this happens, the cost is
        evaluated at once, and its change is computed for only those robots that were available both before
        and after. All other robots get 0.
        """
        previously_available = self._available
        self._update_available_robots()
        has_changed = not np.array_equal(self._available, previously_available)
        shares = np.zeros(len(self.team))
        if not (is_rewarded or has_changed):
            return shares
        previous_coverage = self.coverage
        if self._available.any():
            self.coverage = coverage or self._evaluate_cost(self.time, self.cycle, self._available)
        remaining = self._available & previously_available
        if remaining.any():
            before = previous_coverage
            after = self.coverage
            if has_changed:
                before, after = self._compare_costs(remaining)
            shares[remaining] = self._share_change(before, after)
        self._rewarded_cycle = self.cycle
        return shares

    def _update_available_robots(self) -> None:
        """Determine the robots that count in the cost now."""
        if not self._has_constant_team:
            self._available = self._cost_over_time.find_available_robots(
                self.time, self.positions, self.is_working
            )

    def _evaluate_cost(self, time: float, cycle: int, robots: BoolArray) -> CoverageResult:
        """Evaluate the cost at a time, in s, for some robots at their positions after a number of actions."""
        return self._cost_over_time.get_cost(time)(self.trail[cycle][robots])

    def _compare_costs(self, robots: BoolArray) -> tuple[CoverageResult, CoverageResult]:
        """Evaluate the costs at the last reward and now for the same robots, so that they are comparable."""
        elapsed_time = (self.cycle - self._rewarded_cycle) * self.task.period
        before = self._evaluate_cost(self.time - elapsed_time, self._rewarded_cycle, robots)
        after = self._evaluate_cost(self.time, self.cycle, robots)
        return before, after

    def _share_change(self, before: CoverageResult, after: CoverageResult) -> FloatArray:
        """Share the change in the cost since the last reward among the robots of both costs, m."""
        elapsed_fraction = (self.cycle - self._rewarded_cycle) / self.task.cycles
        return share_reward(self.task.reward, before, after, elapsed_fraction)

    def record(self) -> Record:
        """Build a record of the episode so far; the forces of its last step are zero.

        Raises
        ------
        ParameterError
            If the task does not have ``recording=True``.
        """
        if not self.task.recording or isinstance(self.simulation, SimulationBatch):
            raise ParameterError("record: expected a task with recording=True")
        recorder = self._scenario.build_recorder(self.simulation.controller)
        for snapshot in (*self._snapshots, self.take_snapshot()):
            recorder.add(snapshot)
        return recorder.record(self.simulation.joined)
