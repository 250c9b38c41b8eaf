"""A controller as a policy: to be compared with what is learned, or imitated."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from robocov.arrays import Array
from robocov.controllers import informed
from robocov.controllers.base import Controller
from robocov.observation import Scanning, Scans
from robocov_app.learning.driving import actions_of
from robocov_app.learning.episode import Episode


class ControllerPolicy:
    """Says what a controller would do in the present state of a learning environment.

    It knows what the controller knows, not the observations that learners get. Where actions are held for
    longer than a control period the controller decides less often than in `robocov run`; with
    ``repeat=1`` an episode is the same as a run, bit for bit. Scans that it wants are taken for it, without
    the noise of any conditions.

    ::

        expert = ControllerPolicy(rc.Rapf())
        observations, infos = env.reset(seed=0)
        while env.agents:
            observations, rewards, *_ = env.step(expert(env))
    """

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self._episode: Episode | None = None
        self._law: Any = None
        self._memory: Any = None
        self._asked_at = self._scanned_at = -1
        self._actions: Array | None = None

    def __call__(self, env: Any) -> Any:
        """Return the actions of a team: by agent for a parallel environment, else (n, 2) N or m/s.

        What the controller remembers begins anew with each episode. Asked twice about the same moment it
        says the same. The environment, `CoverageParallelEnv` or `CoverageEnv`, may be wrapped.
        """
        bare = env.unwrapped
        actions = self._decided(bare.episode)
        agents = getattr(bare, "agents", None)
        if agents is None:
            return actions.copy()
        rows = dict(zip(bare.possible_agents, actions.copy(), strict=True))
        return {agent: rows[agent] for agent in agents}

    def _decided(self, episode: Episode) -> Array:
        if self._episode is not episode:
            self._episode, self._asked_at, self._scanned_at = episode, -1, -1
            self._law = informed(self.controller, episode.environment)
            self._memory = self._law.begin(episode.environment.region, episode.team)
        if self._asked_at != episode.cycle or self._actions is None:
            seen = replace(episode.simulation.snapshot.seen, scans=self._scanned(episode))
            decision = self._law.decide(seen, self._memory)
            self._memory, self._asked_at = decision.memory, episode.cycle
            self._actions = actions_of(episode.task.action, decision.forces, seen.velocities, episode.team)
        return self._actions

    def _scanned(self, episode: Episode) -> Scans | None:
        """Return a scan where the controller wants one, as often as in a run or at each decision."""
        scanning: Scanning | None = getattr(self._law, "scanning", None)
        if scanning is None:
            return None
        step, every = episode.cycle * episode.task.repeat, scanning.every(episode.task.dt)
        if self._scanned_at >= 0 and step // every == self._scanned_at // every:
            return None
        self._scanned_at = step
        simulation = episode.simulation
        scans = simulation.sensor.scans(simulation.positions, scanning.rays, episode.team.sensing_range)
        return Scans(*scans)
