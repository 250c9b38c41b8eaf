from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robocov as rc
from robocov.record import ARRAYS


def same(many: list[rc.Record], alone: list[rc.Record]) -> None:
    for one, other in zip(many, alone, strict=True):
        for name in ARRAYS:
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
        assert (one.seed, one.start, one.conditions) == (other.seed, other.start, other.conditions)
        assert one.team.to_dict() == other.team.to_dict()


@pytest.mark.parametrize("name", ["rapf", "rpf", "lloyd", "range-limited", "howard"])
@pytest.mark.parametrize("hearing", [np.inf, 2.5])
def test_each_run_is_what_it_is_alone(name: str, hearing: float) -> None:
    """Bit for bit, also where robots of several runs are in one place, and lean on walls and each other."""
    rooms = rc.load_map("rooms")
    controller = rc.make_controller(name)
    starts = [rooms.start().sample(4, seed=seed % 3, radius=0.15) for seed in range(4)]
    team = rc.Team.homogeneous(4, radius=0.15, communication_range=hearing)
    team = replace(team, max_speed=np.array([1.0, 0.5, 1.0, 0.8]))
    many = rc.simulate_many(rooms, controller, starts, 4.0, team, 0.05, start="door", seeds=[0, 1, 2, 0])
    alone = [
        rc.Simulation(rooms, controller, places, team, 0.05).run(4.0, start="door", seed=seed % 3)
        for seed, places in enumerate(starts)
    ]
    same(many, alone)


def test_runs_of_any_kind_are_simulated() -> None:
    """Teams of several sizes, and one under conditions."""
    museum = rc.load_map("museum")
    starts = [museum.start().sample(n, seed=n) for n in (3, 5, 3, 17, 15)]
    loss = rc.Conditions(seed=3, loss=0.5)
    conditions = [None, None, loss, rc.Conditions(), None]
    many = rc.simulate_many(museum, rc.Rapf(), starts, 0.5, conditions=conditions)
    alone = [
        rc.Simulation(museum, rc.Rapf(), places, conditions=each).run(0.5)
        for places, each in zip(starts, conditions, strict=True)
    ]
    same(many, alone)
    assert many[2].conditions == loss


def test_a_run_begun_again_is_what_it_is_alone() -> None:
    rooms = rc.load_map("rooms")
    first, second, third = (rooms.start().sample(3, seed=seed) for seed in range(3))
    both = rc.Simulation(rooms, rc.Lloyd(), np.concatenate([first, second]), runs=2)
    for _ in range(60):
        both.step()
    both.restart(0, third)
    one, other = rc.Simulation(rooms, rc.Lloyd(), third), rc.Simulation(rooms, rc.Lloyd(), second)
    for _ in range(60):
        other.step()
    for _ in range(60):
        for each in (both, one, other):
            each.step()
    assert both.positions.tobytes() == one.positions.tobytes() + other.positions.tobytes()


def test_what_cannot_be_moved_together_is_told() -> None:
    rooms = rc.load_map("rooms")
    places = rooms.start().sample(3, seed=0)
    with pytest.raises(rc.ParameterError, match="runs: 2 of 3 robots, but equal teams"):
        rc.Simulation(rooms, rc.Rapf(), places, runs=2)
    both = rc.Simulation(rooms, rc.Rapf(), np.concatenate([places, places]), runs=2)
    with pytest.raises(rc.StartError, match="the robots overlap"):
        both.restart(1, np.repeat(places[:1], 3, axis=0))
