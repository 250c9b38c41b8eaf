"""Simulations are pickled and copied by their state: they go on identically, bit for bit."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, Rapf
from robocov.environment import Environment, ObstaclePath, PolygonObstacle
from robocov.simulation import Simulation, SimulationBatch
from robocov.team import Team

WALL = PolygonObstacle(((4, 3), (6, 3), (6, 5), (4, 5)))
HALL = Environment("hall", ((0, 0), (10, 0), (10, 8), (0, 8)), (WALL,))
PATH = ObstaclePath(((0.0, 0.0), (2.0, 0.0)), 0.5)
MOVING = Environment("moving", HALL.boundary, (WALL, PolygonObstacle(((1, 6), (2, 6), (2, 7)), path=PATH)))
STARTS = np.array([[1.0, 1.0], [1.21, 1.0], [3.8, 4.0], [3.0, 2.5]])


def pickled(simulation: Any) -> Any:
    return pickle.loads(pickle.dumps(simulation))


WAYS: dict[str, Callable[[Any], Any]] = {"pickle": pickled, "deepcopy": copy.deepcopy}


def ideal() -> Simulation:
    return Simulation(HALL, Rapf(), STARTS)


def moving() -> Simulation:
    return Simulation(MOVING, Rapf(), STARTS)


def unicycles() -> Simulation:
    return Simulation(HALL, Rapf(), STARTS, Team.homogeneous(4, kinematics="unicycle"))


def changing() -> Simulation:
    events = {"failures": [(2, 0.2)], "joins": [(3, 0.5, (8.0, 6.0))]}
    conditions = Conditions(loss=0.2, delay=0.1, position_noise=0.02, seed=3, **events)
    return Simulation(MOVING, Rapf(), STARTS, conditions=conditions)


def steps_of(simulation: Simulation | SimulationBatch, count: int) -> bytes:
    found = []
    for _ in range(count):
        simulation.step()
        found.append(np.concatenate([simulation.positions, simulation.velocities]))
    return np.array(found).tobytes()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("make", [ideal, moving, unicycles, changing])
def test_it_goes_on_bit_for_bit_and_by_itself(make: Callable[[], Simulation], way: str) -> None:
    simulation = make()
    steps_of(simulation, 20)
    _ = simulation.observe_and_decide()
    twin = WAYS[way](simulation)
    assert twin.time == simulation.time and twin.joined == simulation.joined
    for array in (twin.positions, twin.velocities, twin.team.radius):
        assert not array.flags.writeable
    expected = steps_of(simulation, 25)
    assert steps_of(twin, 25) == expected
    assert twin.joined == simulation.joined


@pytest.mark.parametrize("way", WAYS)
def test_a_batch_continues_bit_for_bit(way: str) -> None:
    batch = SimulationBatch(HALL, Rapf(), [STARTS, STARTS - 0.3])
    steps_of(batch, 20)
    batch.observe()
    twin = WAYS[way](batch)
    assert twin.time == batch.time
    assert steps_of(twin, 25) == steps_of(batch, 25)


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
def test_under_every_controller(name: str) -> None:
    simulation = Simulation(HALL, CONTROLLERS[name](), STARTS)
    steps_of(simulation, 3)
    twin = pickled(simulation)
    assert steps_of(twin, 3) == steps_of(simulation, 3)


def test_it_goes_on_in_another_process(tmp_path: Path) -> None:
    simulation = changing()
    steps_of(simulation, 20)
    (tmp_path / "simulation.pickle").write_bytes(pickle.dumps(simulation))
    script = (
        "import pickle, sys; from pathlib import Path; folder = Path(sys.argv[1])\n"
        "simulation = pickle.loads((folder / 'simulation.pickle').read_bytes())\n"
        "for _ in range(20): simulation.step()\n"
        "(folder / 'positions').write_bytes(simulation.positions.tobytes())\n"
    )
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=True, timeout=120)
    steps_of(simulation, 20)
    assert (tmp_path / "positions").read_bytes() == simulation.positions.tobytes()


def test_a_pickle_holds_the_state_and_not_the_engine() -> None:
    simulation = ideal()
    before = len(pickle.dumps(simulation))
    steps_of(simulation, 50)
    assert len(pickle.dumps(simulation)) < 2 * before < 100_000
