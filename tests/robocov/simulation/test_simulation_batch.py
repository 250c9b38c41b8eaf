"""Runs that are simulated together equal separate simulations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocov.controllers import Controller, Howard, Lloyd, OwnView, Rapf, Visibility, make_controller
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.errors import ParameterError, StartError
from robocov.mapfile import load_map
from robocov.record import ARRAYS, Record
from robocov.simulation import Simulation, SimulationBatch
from robocov.team import Team

ROOMS = load_map("rooms")


def assert_equal_records(first: list[Record], second: list[Record]) -> None:
    for one, other in zip(first, second, strict=True):
        for name in ARRAYS:
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
        assert (one.seed, one.start, one.conditions) == (other.seed, other.start, other.conditions)
        assert one.team.to_dict() == other.team.to_dict()


@pytest.mark.parametrize("name", ["rapf", "rpf", "lloyd", "range-limited", "howard"])
@pytest.mark.parametrize("communication_range", [np.inf, 2.5])
def test_each_run_is_the_same_as_alone(name: str, communication_range: float) -> None:
    """Robots of several runs start at the same positions, and lean on walls and on each other."""
    controller = make_controller(name)
    seeds = [0, 1, 2, 0]
    starts = [ROOMS.start().sample(4, seed=seed, radius=0.15) for seed in seeds]
    team = Team.homogeneous(4, radius=0.15, communication_range=communication_range)
    team = replace(team, max_speed=np.array([1.0, 0.5, 1.0, 0.8]))
    together = SimulationBatch(ROOMS, controller, starts, team, 0.05).run(4.0, start="door", seeds=seeds)
    alone = [
        Simulation(ROOMS, controller, positions, team, 0.05).run(4.0, start="door", seed=seed)
        for seed, positions in zip(seeds, starts, strict=True)
    ]
    assert_equal_records(together, alone)


@pytest.mark.parametrize("robots", [15, 17])
def test_teams_of_any_size_are_the_same_as_alone(robots: int) -> None:
    museum = load_map("museum")
    starts = [museum.start().sample(robots, seed=seed) for seed in range(2)]
    together = SimulationBatch(museum, Rapf(), starts).run(0.5)
    alone = [Simulation(museum, Rapf(), positions).run(0.5) for positions in starts]
    assert_equal_records(together, alone)


class StepCounter:
    """Drives along x with a force that grows by the number of steps that it remembers."""

    def begin(self, number: int, team: Team) -> int:
        return 10 * number

    def force(self, own: OwnView) -> list[float]:
        own.memory += 1
        return [0.01 * own.memory, 0.0]


def test_memory_belongs_to_one_run() -> None:
    starts = [ROOMS.start().sample(2, seed=seed) for seed in range(3)]
    together = SimulationBatch(ROOMS, StepCounter(), starts).run(0.5)
    alone = [Simulation(ROOMS, StepCounter(), positions).run(0.5) for positions in starts]
    assert_equal_records(together, alone)


def test_individual_controllers_without_begin_keep_numbers_and_memory_within_a_run() -> None:
    class Counter:
        def force(self, own: OwnView) -> list[float]:
            own.memory = (own.memory or 0) + 1
            return [0.01 * own.memory, 0.01 * own.number]

    starts = [ROOMS.start().sample(2, seed=seed) for seed in range(2)]
    batch = SimulationBatch(ROOMS, Counter(), starts)
    alone = [Simulation(ROOMS, Counter(), positions) for positions in starts]
    for _ in range(5):
        batch.step()
        for simulation in alone:
            simulation.step()
    batch.restart(1, starts[1])
    alone[1] = Simulation(ROOMS, Counter(), starts[1])
    for _ in range(5):
        batch.step()
        for simulation in alone:
            simulation.step()
    for run, simulation in enumerate(alone):
        assert batch.positions[run].tobytes() == simulation.positions.tobytes()


@pytest.mark.parametrize("controller", [Lloyd(), Howard(), Visibility()], ids=lambda value: value.name)
def test_a_restarted_run_is_the_same_as_alone(controller: Controller) -> None:
    """With range scans, the restarted run scans in other steps than the other run."""
    first = ROOMS.start().sample(3, seed=0)
    second = ROOMS.start().sample(3, seed=1)
    third = ROOMS.start().sample(3, seed=2)
    batch = SimulationBatch(ROOMS, controller, [first, second])
    other = Simulation(ROOMS, controller, second)
    for _ in range(31):
        batch.step()
        other.step()
    batch.restart(0, third)
    restarted = Simulation(ROOMS, controller, third)
    for _ in range(60):
        for simulation in (batch, restarted, other):
            simulation.step()
    assert batch.positions[0].tobytes() == restarted.positions.tobytes()
    assert batch.positions[1].tobytes() == other.positions.tobytes()


def test_a_restarted_run_starts_with_new_memory() -> None:
    starts = [ROOMS.start().sample(2, seed=seed) for seed in range(2)]
    batch = SimulationBatch(ROOMS, StepCounter(), starts)
    for _ in range(10):
        batch.step()
    batch.restart(0, starts[1])
    restarted = Simulation(ROOMS, StepCounter(), starts[1])
    for _ in range(10):
        batch.step()
        restarted.step()
    assert batch.positions[0].tobytes() == restarted.positions.tobytes()


def test_a_restart_keeps_the_memory_of_other_runs() -> None:
    starts = [ROOMS.start().sample(3, seed=seed) for seed in range(2)]
    batch = SimulationBatch(ROOMS, Howard(), starts)
    other = Simulation(ROOMS, Howard(), starts[1])
    for _ in range(20):
        batch.step()
        other.step()
    batch.restart(0, starts[0])
    for _ in range(20):
        batch.step()
        other.step()
    assert batch.positions[1].tobytes() == other.positions.tobytes()


@pytest.mark.parametrize("run", [-1, 2, 0.5, None])
@pytest.mark.parametrize("controller", [Lloyd(), StepCounter()], ids=["lloyd", "step-counter"])
def test_a_run_that_does_not_exist_is_rejected(controller: Lloyd | StepCounter, run: object) -> None:
    starts = np.array([ROOMS.start().sample(2, seed=seed) for seed in range(2)])
    batch = SimulationBatch(ROOMS, controller, starts)
    with pytest.raises(ParameterError, match="run: expected a whole number from 0 to 1, got"):
        batch.restart(run, starts[0])  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="run: expected a whole number from 0 to 1, got"):
        batch.observe_run(run)  # type: ignore[arg-type]
    batch.step()


def test_robots_observe_their_own_run_only() -> None:
    starts = [ROOMS.start().sample(3, seed=seed) for seed in range(2)]
    batch = SimulationBatch(ROOMS, Howard(), starts)
    for run, positions in enumerate(starts):
        expected = Simulation(ROOMS, Howard(), positions).observe()
        observations = batch.observe_run(run)
        assert observations.positions.tobytes() == expected.positions.tobytes()
        assert observations.obstacle_points.tobytes() == expected.obstacle_points.tobytes()
        assert (
            observations.neighbors.list_neighbors(0).tolist()
            == expected.neighbors.list_neighbors(0).tolist()
            == [1, 2]
        )
        assert observations.scans is not None and expected.scans is not None
        assert observations.scans.distances.tobytes() == expected.scans.distances.tobytes()
    robot, neighbor = batch.observe().neighbors.list_pairs()
    assert (robot // 3 == neighbor // 3).all()


def test_given_forces_replace_those_of_the_controller() -> None:
    starts = [ROOMS.start().sample(2, seed=seed) for seed in range(2)]
    batch = SimulationBatch(ROOMS, Rapf(), starts)
    alone = Simulation(ROOMS, Rapf(), starts[1])
    forces = np.array([[[0.0, 0.0], [0.0, 0.0]], [[0.1, 0.2], [0.3, 0.0]]])
    for _ in range(3):
        batch.step(forces=forces)
        alone.step(forces=forces[1])
    assert batch.positions[0].tobytes() == starts[0].tobytes()
    assert batch.positions[1].tobytes() == alone.positions.tobytes()
    with pytest.raises(ParameterError, match=r"array of shape \(2, 2, 2\), got shape \(4, 2\)"):
        batch.step(forces=forces.reshape(4, 2))
    for values in ("east", [[[0.0, 0.0], [0.0]], [[0.0, 0.0], [0.0, 0.0]]]):
        with pytest.raises(ParameterError, match=r"^forces: expected numbers of shape \(2, 2, 2\), got "):
            batch.step(forces=values)  # type: ignore[arg-type]


def test_a_batch_has_runs_of_equal_size_that_fit() -> None:
    positions = ROOMS.start().sample(3, seed=0)
    for starts in (positions, np.zeros((0, 3, 2)), np.zeros((2, 0, 2))):
        with pytest.raises(StartError, match=r"starts: expected an array of shape \(runs, n, 2\)"):
            SimulationBatch(ROOMS, Rapf(), starts)
    with pytest.raises(StartError, match="starts: "):
        SimulationBatch(ROOMS, Rapf(), [positions, positions[:2]])
    with pytest.raises(ParameterError, match="team: expected 3 robots, one for each start, got 2"):
        SimulationBatch(ROOMS, Rapf(), [positions], Team.homogeneous(2))
    batch = SimulationBatch(ROOMS, Rapf(), [positions, positions])
    with pytest.raises(StartError, match="the robots overlap"):
        batch.restart(1, np.repeat(positions[:1], 3, axis=0))
    with pytest.raises(StartError, match="starts: expected one for each of 3 robots, got 1"):
        batch.restart(1, positions[:1])
    with pytest.raises(ParameterError, match="seeds: expected 2, one for each run, got 1"):
        batch.run(0.1, seeds=[1])
    with pytest.raises(ParameterError, match=r"seeds\[1\]: expected a whole number of at least 0, got 'x'"):
        batch.run(0.1, seeds=[1, "x"])  # type: ignore[list-item]
    assert batch.time == 0.0
    assert len(batch) == 2
    assert repr(batch) == "<SimulationBatch rapf on Rooms, 2 runs of 3 robots, at 0.00 s>"


def test_each_record_has_its_own_seed() -> None:
    positions = ROOMS.start().sample(3, seed=0)
    records = SimulationBatch(ROOMS, Rapf(), [positions] * 3).run(0.0, seeds=[7, 8, 9])
    assert [record.seed for record in records] == [7, 8, 9]


def test_obstacles_of_a_batch_stand_still() -> None:
    cart = CircleObstacle((2, 1), 0.6, "cart", ObstaclePath(((2, 1), (8, 1)), 0.5))
    busy = Environment("busy", ((0, 0), (10, 0), (10, 6), (0, 6)), (cart,))
    with pytest.raises(ParameterError, match="environment: expected a map without moving obstacles"):
        SimulationBatch(busy, Rapf(), [[[4.0, 4.0]]])
