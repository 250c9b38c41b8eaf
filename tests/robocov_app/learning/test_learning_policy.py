"""Policies as controllers, and controllers as policies."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.controllers import Lloyd, Rapf, make_controller
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov_app.cli import main
from robocov_app.learning import (
    ControllerPolicy,
    CoverageEnv,
    CoverageParallelEnv,
    ObservationLayout,
    PolicyController,
)

REGION = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0]]))


def build_linear_policy(layout: ObservationLayout, seed: int = 0) -> Any:
    weights = np.random.default_rng(seed).normal(size=(layout.size, 2))
    return lambda observation: observation @ weights


@dataclass(frozen=True)
class OpenSpaceSeeker:
    """Moves in the direction of the longest ray of the last scan."""

    name = label = summary = "seeker"
    scanning = Scanning(rays=16, period=0.25)

    def begin(self, region: Region, team: Team) -> np.ndarray:
        return np.zeros((len(team), 2))

    def decide(self, seen: Observations, memory: np.ndarray) -> Decision:
        if seen.scans is not None:
            memory = seen.scans.directions[seen.scans.distances.argmax(axis=1)]
        return Decision(memory.copy(), memory=memory)


@pytest.mark.parametrize(("controller_class", "min_contacts"), [(Rapf, 0), (Lloyd, 1), (OpenSpaceSeeker, 0)])
def test_a_controller_as_a_policy_has_the_record_of_its_run(
    cluttered: Environment, controller_class: Any, min_contacts: int
) -> None:
    """Every state and force of `Simulation.run`, bit for bit, contacts with walls included."""
    env = CoverageParallelEnv(
        maps=cluttered, robots=5, repeat=1, duration=6.0, lattice=8, reward_every=999, recording=True
    )
    env.reset(options={"start": "corner", "start_seed": 3})
    expert = ControllerPolicy(controller_class())
    while env.agents:
        env.step(expert(env))
    record = env.episode.record()
    starts = cluttered.start("corner").sample(5, seed=3)
    expected = Simulation(cluttered, controller_class(), starts).run(6.0)
    assert len(record.time) == 361
    for name in ("time", "positions", "velocities", "obstacle_points"):
        assert getattr(record, name).tobytes() == getattr(expected, name).tobytes(), name
    assert record.forces[:-1].tobytes() == expected.forces[:-1].tobytes()
    assert count_contacts(record, compute_clearances(record)) >= min_contacts


def test_a_controller_as_a_policy_of_velocities_has_nearly_the_same_run(cluttered: Environment) -> None:
    """Forces computed from velocities differ only by rounding."""
    env = CoverageEnv(maps=cluttered, robots=3, repeat=1, duration=2.0, lattice=8, action="velocity")
    env.reset(options={"start": "corner", "start_seed": 3})
    expert = ControllerPolicy(Rapf())
    truncated = False
    while not truncated:
        truncated = env.step(expert(env))[3]
    expected = Simulation(cluttered, Rapf(), cluttered.start("corner").sample(3, seed=3)).run(2.0)
    np.testing.assert_allclose(env.episode.simulation.positions, expected.positions[-1], atol=1e-9)


def test_a_policy_repeats_its_actions_and_restarts_with_each_episode(cluttered: Environment) -> None:
    env = CoverageEnv(maps=cluttered, robots=3, lattice=8)
    expert = ControllerPolicy(Rapf())
    other = ControllerPolicy(Rapf())
    for seed in (0, 1):
        env.reset(seed=seed)
        first = expert(env)
        first[:] = 0.0  # The caller may change the actions.
        assert expert(env).any()
        assert np.array_equal(expert(env), other(env))
        env.step(expert(env))
        assert np.array_equal(expert(env), other(env))


@dataclass(frozen=True)
class CountingController:
    """Increases its forces with each decision."""

    name = label = summary = "counting"

    def begin(self, region: Region, team: Team) -> int:
        return 1

    def decide(self, seen: Observations, memory: int) -> Decision:
        return Decision(np.full_like(seen.positions, 0.1 * memory), memory=memory + 1)


def test_a_policy_keeps_the_memory_of_its_controller(empty: Environment) -> None:
    env = CoverageParallelEnv(maps=empty, robots=2, lattice=8)
    expert = ControllerPolicy(CountingController())
    for seed in (0, 1):
        env.reset(seed=seed)
        actions = []
        for _ in range(3):
            expert(env)
            actions.append(expert(env)["robot_2"].tolist())
            env.step(expert(env))
        np.testing.assert_allclose(actions, [[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]])


@pytest.mark.parametrize("action", ["force", "velocity"])
@pytest.mark.parametrize("layout", [ObservationLayout(2), ObservationLayout(1, 8, True)])
def test_a_policy_moves_as_in_training(
    cluttered: Environment, layout: ObservationLayout, action: Any
) -> None:
    """A simulation with the policy as its controller has the same positions, bit for bit."""
    act = build_linear_policy(layout)
    env = CoverageParallelEnv(
        maps=cluttered, robots=4, duration=3.0, lattice=8, observation=layout, action=action, recording=True
    )
    rows, _ = env.reset(options={"start": "corner", "start_seed": 1})
    while env.agents:
        rows, *_ = env.step({agent: act(rows[agent]) for agent in env.agents})
    starts = cluttered.start("corner").sample(4, seed=1)
    controller = PolicyController(act, layout, action)
    record = Simulation(cluttered, controller, starts).run(3.0)
    assert record.positions.tobytes() == env.episode.record().positions.tobytes()
    assert np.abs(record.positions[-1] - starts).max() > 0.3


@settings(max_examples=count_examples(30))
@given(seed=st.integers(0, 2**32), n=st.integers(2, 30), communication_range=st.floats(0.5, 6.0))
def test_a_policy_uses_only_the_knowledge_of_the_robot(seed: int, n: int, communication_range: float) -> None:
    """Changes beyond the ranges of robot i do not change its forces, not one bit."""
    layout = ObservationLayout(3, centroid=True)
    controller = PolicyController(build_linear_policy(layout), layout)
    team = Team.homogeneous(n, communication_range=communication_range)
    rng = np.random.default_rng(seed)
    positions = rng.uniform((0, 0), (8, 6), size=(n, 2))
    points = np.where(rng.random((n, 1)) < 0.4, np.nan, positions + 0.5)
    velocities = rng.normal(size=(n, 2))
    i = int(rng.integers(n))

    def compute_force(positions: np.ndarray) -> bytes:
        """Return the force of robot i; everything that it does not know is random."""
        is_own = np.arange(n)[:, None] == i
        seen = Observations(
            positions,
            np.where(is_own, velocities, rng.normal(size=(n, 2))),
            Neighbors.from_ranges(positions, np.full(n, communication_range)),
            np.where(is_own, points, positions + rng.normal(size=(n, 2))),
            REGION,
        )
        return controller.decide(seen, controller.begin(REGION, team)).forces[i].tobytes()

    is_known = np.linalg.norm(positions - positions[i], axis=1) <= communication_range
    moved = positions.copy()
    for k in np.flatnonzero(~is_known):
        position = rng.uniform((0, 0), (8, 6))
        if np.hypot(*(position - positions[i])) > communication_range:
            moved[k] = position
    assert compute_force(positions) == compute_force(moved)


def test_actions_are_held_for_a_period(empty: Environment) -> None:
    observed: list[float] = []

    def act(observation: np.ndarray) -> tuple[float, float]:
        observed.append(float(observation[0]))
        return 0.5, 0.0

    simulation = Simulation(empty, PolicyController(act, period=0.25), [[2.0, 2.0]], dt=0.01)
    simulation.run(1.0)
    assert len(observed) == 5
    assert len(set(observed)) == 5


POLICY_MODULE = '''
from dataclasses import dataclass

import numpy as np

from robocov_app.learning import ObservationLayout, PolicyController


@dataclass(frozen=True)
class Outwards(PolicyController):
    """Moves away from the nearest neighbor."""

    layout: ObservationLayout = ObservationLayout(neighbors=1)
    action: str = "velocity"

    def act(self, observation):
        return -8.0 * observation[self.layout.blocks["neighbor"]][:2]
'''


@pytest.mark.slow
def test_the_command_line_accepts_a_policy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(POLICY_MODULE)
    name = f"{tmp_path / 'mine.py'}:Outwards"
    options = "--robots 3 --duration 2 --lattice 16 --set period=0.2 --json".split()
    out = tmp_path / "out"
    assert main(["run", "square", "--controller", name, *options, "--out", str(out)]) == 0
    run = json.loads((out / "run.json").read_text())
    assert run["controller"]["name"] == name
    assert run["controller"]["gains"] == {"period": 0.2}
    policy_class = type(make_controller(name))
    assert policy_class.name == policy_class.label == "Outwards"
    assert policy_class.summary == "learned policy"


def test_invalid_policies_are_rejected(empty: Environment) -> None:
    def run(controller: PolicyController) -> None:
        Simulation(empty, controller, [[2.0, 2.0]]).step()

    with pytest.raises(ParameterError, match=r"policy: expected a policy or a method act\(observation\)"):
        run(PolicyController())
    with pytest.raises(ParameterError, match=r"policy: expected an action of shape \(2,\), got \(3,\)"):
        run(PolicyController(lambda observation: (1.0, 2.0, 3.0)))
    with pytest.raises(
        ParameterError, match=r"controller 'policy': ZeroDivisionError: .*test_learning_policy.py"
    ):
        run(PolicyController(lambda observation: (1 / 0, 2.0)))
    with pytest.raises(ParameterError, match="expected two finite numbers in newtons"):
        run(PolicyController(lambda observation: (np.nan, 0.0)))
    with pytest.raises(ParameterError, match="action: unknown kind of action 'steer'"):
        PolicyController(action="steer")
    with pytest.raises(ParameterError, match="layout: expected an ObservationLayout, got 3"):
        PolicyController(layout=3)
    with pytest.raises(ParameterError, match=r"policy.period: expected a number from .* got -1"):
        PolicyController(period=-1.0)
