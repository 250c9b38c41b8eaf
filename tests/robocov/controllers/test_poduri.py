from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.controllers import Poduri, make_controller
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.simulation import Simulation
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (60, 0), (60, 60), (0, 60)))


def seen_from(positions: np.ndarray, reach: float = np.inf) -> Observations:
    n = len(positions)
    return Observations(
        positions,
        np.zeros((n, 2)),
        Neighbours.from_ranges(positions, np.full(n, reach)),
        np.full((n, 2), np.nan),
        HALL.region,
    )


def degrees(positions: np.ndarray, reach: float) -> np.ndarray:
    away = np.hypot(*(positions[:, None] - positions).T)
    return np.asarray((away <= reach).sum(axis=1) - 1)


@pytest.mark.parametrize("k", [1, 3])
def test_every_robot_keeps_k_neighbours_and_the_team_spreads_as_far_as_that_lets_it(k: int) -> None:
    """The claim of the paper, in a hall without walls near: never less than K, and no closer than needed."""
    starts = HALL.start().sample(1, seed=0) * 0 + 30.0 + 0.3 * np.mgrid[-2:2, -2:2].reshape(2, -1).T
    simulation = Simulation(HALL, Poduri(neighbours=float(k), link_range=3.0, k_cover=1.0), starts)
    least = 16
    for _ in range(60 * 15):
        simulation.step()
        least = min(least, int(degrees(simulation.positions, 3.0).min()))
    assert least >= k
    apart = np.hypot(*(simulation.positions[:, None] - simulation.positions).T) + 99 * np.eye(16)
    assert apart.min() > {1: 2.0, 3: 1.4}[k]


@pytest.mark.parametrize("name", ["rooms", "blocks-a"])
def test_with_its_defaults(name: str) -> None:
    environment = load_map(name)
    simulation = Simulation(environment, Poduri(), environment.start().sample(6, seed=1))
    for _ in range(60 * 8):
        simulation.step()
        assert degrees(simulation.positions, 6.0).min() >= 2


def test_less_neighbours_cover_more() -> None:
    starts = 30.0 + 0.3 * np.mgrid[-2:2, -2:2].reshape(2, -1).T
    spread = []
    for k in (1.0, 6.0):
        simulation = Simulation(HALL, Poduri(neighbours=k, link_range=3.0, k_cover=1.0), starts)
        for _ in range(60 * 6):
            simulation.step()
        spread.append(float(simulation.positions.std()))
    assert spread == sorted(spread, reverse=True)


@pytest.mark.parametrize("seed", [0, 1])
def test_among_walls(seed: int) -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(8, seed=seed)
    assert degrees(starts, 3.0).min() >= 2
    simulation = Simulation(rooms, Poduri(neighbours=2.0, link_range=3.0, k_cover=1.0), starts)
    for _ in range(60 * 8):
        simulation.step()
        assert degrees(simulation.positions, 3.0).min() >= 2


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32), k=st.integers(0, 4), reach=st.floats(1.0, 6.0))
def test_forces_are_those_of_the_rule_written_down_robot_by_robot(seed: int, k: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.uniform(0, 8, size=(9, 2))
    law = Poduri(neighbours=float(k), link_range=3.5, eta=0.8, k_cover=0.5)
    range_of_links = min(reach, 3.5)
    seen = seen_from(positions, reach)
    decision = law.decide(seen, law.begin(HALL.region, Team.homogeneous(9, communication_range=reach)))

    def needs(i: int, j: int, known: set[int]) -> bool:
        """Whether i needs its link to j, for all that somebody knows who knows `known`."""
        away = {m: np.hypot(*(positions[i] - positions[m])) for m in known if m != i}
        near = [m for m, far in away.items() if far <= 0.8 * range_of_links]
        return len(near) <= k and sum(far < away[j] for far in away.values()) < k

    for i in range(9):
        known = {i, *seen.neighbours.list_neighbours(i).tolist()}
        expected = np.zeros(2)
        for j in known - {i}:
            away = positions[i] - positions[j]
            far = float(np.hypot(*away))
            if far > range_of_links:
                continue
            expected += 0.5 * away / far**3
            if needs(i, j, known) or needs(j, i, known):
                pull = 0.5 * (1 / 0.8 - 1) ** 2 / (range_of_links - min(far, 0.999 * range_of_links)) ** 2
                expected -= pull * away / far
        np.testing.assert_allclose(decision.forces[i], expected, rtol=1e-9, atol=1e-9)
    # with what was heard, which is the truth here, the same by the other way
    ranges = np.full(9, min(reach, 100.0))
    _, neighbour = Neighbours.from_ranges(positions, ranges).list_pairs()
    heard = replace(seen_from(positions, min(reach, 100.0)), reported_positions=positions[neighbour])
    again = law.decide(heard, law.begin(HALL.region, Team.homogeneous(9, communication_range=reach)))
    np.testing.assert_allclose(again.forces, decision.forces, rtol=1e-9, atol=1e-9)


def test_the_two_forces_are_equal_where_the_paper_says() -> None:
    """At d = eta R_c a critical pair neither attracts nor repels."""
    law = Poduri(neighbours=1.0, link_range=2.0, eta=0.75)
    team = law.begin(HALL.region, Team.homogeneous(2))
    for distance, sign in ((1.4, -1), (1.5, 0), (1.6, 1)):
        seen = seen_from(np.array([[20.0, 20.0], [20.0 + distance, 20.0]]))
        force = law.decide(seen, team).forces[0, 0]
        assert np.sign(round(force, 9)) == sign


def test_k_is_a_whole_number() -> None:
    with pytest.raises(ParameterError, match=r"poduri.neighbours: expected a whole number from 0 to 100"):
        make_controller("poduri", {"neighbours": 2.5})


def test_the_same_run_twice() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(6, seed=1)
    one, other = (Simulation(rooms, Poduri(), starts).run(3.0) for _ in range(2))
    assert one.positions.tobytes() == other.positions.tobytes()
