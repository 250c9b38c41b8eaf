from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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


def linear(layout: ObservationLayout, seed: int = 0) -> Any:
    weights = np.random.default_rng(seed).normal(size=(layout.size, 2))
    return lambda observation: observation @ weights


@dataclass(frozen=True)
class Shying:
    """Goes where the last scan was longest."""

    name = label = summary = "shying"
    scanning = Scanning(rays=16, period=0.25)

    def begin(self, region: Region, team: Team) -> np.ndarray:
        return np.zeros((len(team), 2))

    def decide(self, seen: Observations, memory: np.ndarray) -> Decision:
        if seen.scans is not None:
            memory = seen.scans.directions[seen.scans.distances.argmax(axis=1)]
        return Decision(memory.copy(), memory=memory)


@pytest.mark.parametrize(("kind", "touches"), [(Rapf, 0), (Lloyd, 1), (Shying, 0)])
def test_a_controller_through_the_environment_makes_its_record_again(
    cluttered: Environment, kind: Any, touches: int
) -> None:
    """Every state and force of `Simulation.run`, bit for bit, contacts with walls included."""
    env = CoverageParallelEnv(
        maps=cluttered, robots=5, repeat=1, duration=6.0, lattice=8, reward_every=999, recording=True
    )
    env.reset(options={"start": "corner", "start_seed": 3})
    expert = ControllerPolicy(kind())
    while env.agents:
        env.step(expert(env))
    record = env.episode.record()
    starts = cluttered.start("corner").sample(5, seed=3)
    expected = Simulation(cluttered, kind(), starts).run(6.0)
    assert len(record.time) == 361
    for name in ("time", "positions", "velocities", "obstacle_points"):
        assert getattr(record, name).tobytes() == getattr(expected, name).tobytes(), name
    assert record.forces[:-1].tobytes() == expected.forces[:-1].tobytes()
    assert count_contacts(record, compute_clearances(record)) >= touches


def test_an_expert_can_be_asked_in_velocities(cluttered: Environment) -> None:
    """They give its forces up to rounding, and so nearly its way."""
    env = CoverageEnv(maps=cluttered, robots=3, repeat=1, duration=2.0, lattice=8, action="velocity")
    env.reset(options={"start": "corner", "start_seed": 3})
    expert = ControllerPolicy(Rapf())
    over = False
    while not over:
        over = env.step(expert(env))[3]
    expected = Simulation(cluttered, Rapf(), cluttered.start("corner").sample(3, seed=3)).run(2.0)
    np.testing.assert_allclose(env.episode.simulation.positions, expected.positions[-1], atol=1e-9)


def test_an_expert_says_the_same_twice_and_begins_anew(cluttered: Environment) -> None:
    env = CoverageEnv(maps=cluttered, robots=3, lattice=8)
    expert, fresh = ControllerPolicy(Rapf()), ControllerPolicy(Rapf())
    for seed in (0, 1):
        env.reset(seed=seed)
        first = expert(env)
        first[:] = 0.0  # what it said is the caller's own
        assert expert(env).any() and np.array_equal(expert(env), fresh(env))
        env.step(expert(env))
        assert np.array_equal(expert(env), fresh(env))


@dataclass(frozen=True)
class Counting:
    """Pushes harder each time that it is asked."""

    name = label = summary = "counting"

    def begin(self, region: Region, team: Team) -> int:
        return 1

    def decide(self, seen: Observations, memory: int) -> Decision:
        return Decision(np.full_like(seen.positions, 0.1 * memory), memory=memory + 1)


def test_what_an_expert_remembers(empty: Environment) -> None:
    env = CoverageParallelEnv(maps=empty, robots=2, lattice=8)
    expert = ControllerPolicy(Counting())
    for seed in (0, 1):
        env.reset(seed=seed)
        said = []
        for _ in range(3):
            expert(env)
            said.append(expert(env)["robot_2"].tolist())
            env.step(expert(env))
        np.testing.assert_allclose(said, [[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]])


@pytest.mark.parametrize("action", ["force", "velocity"])
@pytest.mark.parametrize("layout", [ObservationLayout(2), ObservationLayout(1, 8, True)])
def test_a_policy_moves_as_in_training(
    cluttered: Environment, layout: ObservationLayout, action: Any
) -> None:
    """The environment and the ordinary simulation with the policy as its controller, bit for bit."""
    act = linear(layout)
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


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32), n=st.integers(2, 30), reach=st.floats(0.5, 6.0))
def test_a_robot_uses_only_what_it_knows(seed: int, n: int, reach: float) -> None:
    """Changing anything outside robot i's ranges changes nothing in row i, not one bit."""
    layout = ObservationLayout(3, centroid=True)
    controller, team = (
        PolicyController(linear(layout), layout),
        Team.homogeneous(n, communication_range=reach),
    )
    rng = np.random.default_rng(seed)
    positions = rng.uniform((0, 0), (8, 6), size=(n, 2))
    points = np.where(rng.random((n, 1)) < 0.4, np.nan, positions + 0.5)
    velocities = rng.normal(size=(n, 2))
    i = int(rng.integers(n))

    def force(places: np.ndarray) -> bytes:
        own = np.arange(n)[:, None] == i
        seen = Observations(
            places,
            np.where(own, velocities, rng.normal(size=(n, 2))),
            Neighbors.from_ranges(places, np.full(n, reach)),
            np.where(own, points, places + rng.normal(size=(n, 2))),
            REGION,
        )
        return controller.decide(seen, controller.begin(REGION, team)).forces[i].tobytes()

    heard = np.hypot(*(positions - positions[i]).T) <= reach
    moved = positions.copy()
    for k in np.flatnonzero(~heard):
        place = rng.uniform((0, 0), (8, 6))
        if np.hypot(*(place - positions[i])) > reach:
            moved[k] = place
    assert force(positions) == force(moved)


def test_actions_are_held(empty: Environment) -> None:
    asked: list[float] = []

    def act(observation: np.ndarray) -> tuple[float, float]:
        asked.append(float(observation[0]))
        return 0.5, 0.0

    simulation = Simulation(empty, PolicyController(act, period=0.25), [[2.0, 2.0]], dt=0.01)
    simulation.run(1.0)
    assert len(asked) == 5 and len(set(asked)) == 5


MINE = '''
from dataclasses import dataclass

import numpy as np

from robocov_app.learning import ObservationLayout, PolicyController


@dataclass(frozen=True)
class Outwards(PolicyController):
    """Goes away from the nearest neighbor."""

    layout: ObservationLayout = ObservationLayout(neighbors=1)
    action: str = "velocity"

    def act(self, observation):
        return -8.0 * observation[self.layout.blocks["neighbor"]][:2]
'''


@pytest.mark.slow
def test_the_command_line_takes_a_policy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    name = f"{tmp_path / 'mine.py'}:Outwards"
    command = [
        "run",
        "square",
        "--controller",
        name,
        "--duration",
        "2",
        "--lattice",
        "16",
        "--robots",
        "3",
        "--json",
    ]
    assert main([*command, "--set", "period=0.2", "--out", str(tmp_path / "out")]) == 0
    run = json.loads((tmp_path / "out" / "run.json").read_text())
    assert run["controller"]["name"] == name and run["controller"]["gains"] == {"period": 0.2}
    kind = type(make_controller(name))
    assert (kind.name, kind.label, kind.summary) == ("Outwards", "Outwards", "a policy that was learned")


def test_what_is_no_policy(empty: Environment) -> None:
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
