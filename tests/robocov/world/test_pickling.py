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


def pickle_and_load(simulation: Any) -> Any:
    return pickle.loads(pickle.dumps(simulation))


COPY_METHODS: dict[str, Callable[[Any], Any]] = {"pickle": pickle_and_load, "deepcopy": copy.deepcopy}


def build_ideal() -> Simulation:
    return Simulation(HALL, Rapf(), STARTS)


def build_with_moving_obstacle() -> Simulation:
    return Simulation(MOVING, Rapf(), STARTS)


def build_unicycles() -> Simulation:
    return Simulation(HALL, Rapf(), STARTS, Team.homogeneous(4, kinematics="unicycle"))


def build_with_conditions() -> Simulation:
    events = {"failures": [(2, 0.2)], "joins": [(3, 0.5, (8.0, 6.0))]}
    conditions = Conditions(loss=0.2, delay=0.1, position_noise=0.02, seed=3, **events)
    return Simulation(MOVING, Rapf(), STARTS, conditions=conditions)


def simulate(simulation: Simulation | SimulationBatch, steps: int) -> bytes:
    """Simulate some steps, and return the bytes of all positions and velocities."""
    states = []
    for _ in range(steps):
        simulation.step()
        states.append(np.concatenate([simulation.positions, simulation.velocities]))
    return np.array(states).tobytes()


@pytest.mark.parametrize("method", COPY_METHODS)
@pytest.mark.parametrize(
    "build", [build_ideal, build_with_moving_obstacle, build_unicycles, build_with_conditions]
)
def test_copies_continue_bit_for_bit_and_independently(build: Callable[[], Simulation], method: str) -> None:
    simulation = build()
    simulate(simulation, 20)
    simulation.observe_and_decide()
    twin = COPY_METHODS[method](simulation)
    assert twin.time == simulation.time
    assert twin.joined == simulation.joined
    for array in (twin.positions, twin.velocities, twin.team.radius):
        assert not array.flags.writeable
    expected = simulate(simulation, 25)
    assert simulate(twin, 25) == expected
    assert twin.joined == simulation.joined


@pytest.mark.parametrize("method", COPY_METHODS)
def test_copies_of_batches_continue_bit_for_bit(method: str) -> None:
    batch = SimulationBatch(HALL, Rapf(), [STARTS, STARTS - 0.3])
    simulate(batch, 20)
    batch.observe()
    twin = COPY_METHODS[method](batch)
    assert twin.time == batch.time
    assert simulate(twin, 25) == simulate(batch, 25)


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
def test_pickled_simulations_continue_under_every_controller(name: str) -> None:
    simulation = Simulation(HALL, CONTROLLERS[name](), STARTS)
    simulate(simulation, 3)
    twin = pickle_and_load(simulation)
    assert simulate(twin, 3) == simulate(simulation, 3)


def test_pickled_simulations_continue_in_another_process(tmp_path: Path) -> None:
    simulation = build_with_conditions()
    simulate(simulation, 20)
    (tmp_path / "simulation.pickle").write_bytes(pickle.dumps(simulation))
    script = (
        "import pickle, sys; from pathlib import Path; folder = Path(sys.argv[1])\n"
        "simulation = pickle.loads((folder / 'simulation.pickle').read_bytes())\n"
        "for _ in range(20): simulation.step()\n"
        "(folder / 'positions').write_bytes(simulation.positions.tobytes())\n"
    )
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=True, timeout=120)
    simulate(simulation, 20)
    assert (tmp_path / "positions").read_bytes() == simulation.positions.tobytes()


def test_pickles_contain_the_state_and_no_pymunk_objects() -> None:
    simulation = build_ideal()
    initial_size = len(pickle.dumps(simulation))
    simulate(simulation, 50)
    assert len(pickle.dumps(simulation)) < 2 * initial_size < 100_000
