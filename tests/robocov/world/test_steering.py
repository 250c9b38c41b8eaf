"""Unicycles: what their wheels do, and that points know nothing of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.conditions import Conditions, Failure, Join
from robocov.controllers import Atlas, Barrier, IndividualControllerAdapter, OwnView, Rapf
from robocov.environment import Environment
from robocov.errors import ParameterError, StartError
from robocov.mapfile import load_map
from robocov.simulation import Simulation, TeamState
from robocov.team import Team
from robocov.world import World
from robocov.world.obstacle_pieces import build_solid_pieces

DT = 1 / 60


def unicycles(environment: Environment, n: int, seed: int, **team: float) -> World:
    starts = environment.start("uniform").sample(n, seed)
    return World(build_solid_pieces(environment), Team.homogeneous(n, kinematics="unicycle", **team), starts)


@settings(max_examples=25)
@given(
    seed=st.integers(0, 1000),
    size=st.floats(0.01, 500.0),
    track=st.floats(0.02, 1.0),
    rate=st.floats(0.1, 20.0),
    fastest=st.floats(0.05, 3.0),
)
def test_wheels_and_turns_keep_their_limits_and_nobody_slips(
    empty: Environment, seed: int, size: float, track: float, rate: float, fastest: float
) -> None:
    rng, n = np.random.default_rng(seed), 5
    limits = {"track_width": track, "turning_rate": rate, "max_speed": fastest}
    team = unicycles(empty, n, seed, **limits)
    most, half = team.team.max_acceleration[0] * DT, 0.5 * track
    wheels = np.zeros((2, n))
    for _ in range(40):
        before, fast = team.positions, team.velocities
        forces = rng.normal(0.0, size, (n, 2)) * rng.integers(0, 2)
        team.step(forces, DT)
        assert team.steering is not None
        heading, turning = team.steering.T
        along = np.column_stack([np.cos(heading), np.sin(heading)])
        speed = (team.velocities * along).sum(axis=1)
        apart = np.hypot(*(team.positions[:, None] - team.positions).transpose(2, 0, 1)) + 9.0 * np.eye(n)
        free = (np.abs(team.positions - 5.0).max(axis=1) < 4.5) & (
            apart.min(axis=1) > 0.4
        )  # nobody is pushed
        slip = team.velocities - speed[:, None] * along
        assert np.abs(slip).max() < 1e-12 and speed.min() > -1e-12
        moved = team.positions - before - DT * fast  # pymunk moves bodies, then changes their velocities
        assert np.abs(moved[free]).max(initial=0.0) < 1e-12
        assert np.abs(turning).max() <= rate + 1e-12
        now = np.array([speed - turning * half, speed + turning * half])
        assert np.abs(now).max() <= fastest + 1e-9
        assert np.abs(now - wheels)[:, free].max(initial=0.0) <= most + 1e-9
        wheels = now


def test_a_unicycle_turns_in_place_before_it_drives(empty: Environment) -> None:
    team = World(
        build_solid_pieces(empty), Team.homogeneous(1, kinematics="unicycle"), np.array([[5.0, 5.0]])
    )
    for _ in range(12):
        team.step(np.array([[-1.0, 0.1]]), DT)
        np.testing.assert_array_equal(team.positions, [[5.0, 5.0]])
    for _ in range(240):
        team.step(np.array([[-1.0, 0.1]]), DT)
    assert team.steering is not None
    assert team.steering[0, 0] == pytest.approx(np.arctan2(0.1, -1.0), abs=0.01)
    # where it faces where it is driven to, it is a point: F / nu
    np.testing.assert_allclose(team.velocities, [[-0.5, 0.05]], atol=0.01)


@given(speed=st.floats(0.0, 1.0), heading=st.floats(-3.1, 3.1), force=st.floats(0.0, 50.0))
def test_it_brakes_as_hard_as_a_point(empty: Environment, speed: float, heading: float, force: float) -> None:
    along, place = np.array([[np.cos(heading), np.sin(heading)]]), np.array([[5.0, 5.0]])
    left = []
    for kind in ("point", "unicycle"):
        team = World(
            build_solid_pieces(empty), Team.homogeneous(1, kinematics=kind), place, speed * along,
            steering=np.array([[heading, 0.0]]),
        )  # fmt: skip
        team.step(-force * along, DT)
        left.append(team.velocities[0])
    # it may turn meanwhile
    assert np.hypot(*left[1]) == pytest.approx(max(float(left[0] @ along[0]), 0.0), abs=1e-9)


def test_points_beside_unicycles_move_as_among_points(empty: Environment) -> None:
    rng, n = np.random.default_rng(1), 6
    starts = np.array([[1.0 + 1.5 * k, 5.0] for k in range(n)])
    points = Team.homogeneous(n)
    mixed = replace(points, track_width=np.array([0.0, 0.2] * 3))
    one, other = (World(build_solid_pieces(empty), team, starts) for team in (points, mixed))
    assert one.steering is None
    for _ in range(60):
        forces = rng.normal(0.0, 1.0, (n, 2))
        one.step(forces, DT)
        other.step(forces, DT)
    assert (one.positions[::2] == other.positions[::2]).all()
    assert (one.velocities[::2] == other.velocities[::2]).all()
    assert (one.positions[1::2] != other.positions[1::2]).any(axis=1).all()


def test_a_hand_carries_a_unicycle(empty: Environment) -> None:
    team = World(
        build_solid_pieces(empty), Team.homogeneous(1, kinematics="unicycle"), np.array([[5.0, 5.0]])
    )
    for _ in range(30):
        team.step(np.zeros((1, 2)), DT, np.array([[0.0, 2.0]]))
    assert team.positions[0, 1] > 5.1 and team.steering is not None and not team.steering.any()
    team.step(np.zeros((1, 2)), DT)
    assert not team.velocities.any()  # it was carried sideways


@pytest.mark.parametrize(
    ("name", "law", "seconds"),
    [("rooms", Rapf(), 15.0), ("museum", Rapf(), 15.0), ("office", Rapf(), 15.0)],
    ids=lambda each: str(each),
)
def test_unicycles_touch_nothing_as_points_do(name: str, law: Rapf, seconds: float) -> None:
    _touch_nothing(name, law, seconds)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "museum"])
@pytest.mark.parametrize("law", [Rapf(), Atlas(), Barrier()], ids=lambda law: law.name)
def test_unicycles_touch_nothing_in_long_runs(name: str, law: Rapf | Atlas | Barrier) -> None:
    _touch_nothing(name, law, 40.0)


def _touch_nothing(name: str, law: Rapf | Atlas | Barrier, seconds: float) -> None:
    environment = load_map(name)
    starts, team = environment.start().sample(6, seed=2), Team.homogeneous(6, kinematics="unicycle")
    run = Simulation(environment, law, starts, team).run(seconds)
    assert np.hypot(*(run.positions[-1] - starts).T).max() > 1.0
    walls = shapely.distance(shapely.points(run.positions), environment.static.free.boundary)
    apart = np.hypot(*np.moveaxis(run.positions[:, :, None] - run.positions[:, None], -1, 0))
    assert walls.min() > 0.1 and apart[:, ~np.eye(6, dtype=bool)].min() > 0.2


def test_a_copy_goes_on_bit_for_bit() -> None:
    environment = load_map("rooms")
    starts, team = environment.start().sample(4, seed=0), Team.homogeneous(4, kinematics="unicycle")
    first = Simulation(environment, Rapf(), starts, team)
    first.run(2.0)
    twin = first.copy()
    state = TeamState(first.positions, first.velocities, first.steering, steps=120, is_computed=True)
    again = Simulation(environment, Rapf(), state, team)
    for each in (first, twin, again):
        each.run(2.0)
    assert first.positions.tobytes() == twin.positions.tobytes() == again.positions.tobytes()
    assert first.steering is not None and again.steering is not None
    assert first.steering.tobytes() == again.steering.tobytes()
    # another team: who moves faces where it moves
    moving = Simulation(environment, Rapf(), TeamState(starts, np.array([[0.0, 0.1]] * 4)))
    turned = moving.with_changes(team=team).steering
    assert turned is not None and turned.tolist() == [[np.pi / 2, 0.0]] * 4


def test_who_fails_keeps_its_heading_and_who_joins_faces_along_x() -> None:
    environment, team = load_map("rooms"), Team.homogeneous(4, kinematics="unicycle")
    starts = environment.start().sample(4, seed=0)
    conditions = Conditions(failures=(Failure(2, 1.0),), joins=(Join(4, 1.5),))
    run = Simulation(environment, Rapf(), starts, team, conditions=conditions).run(3.0)
    assert run.steering is not None
    heading, turning = np.moveaxis(run.steering, -1, 0)
    assert np.ptp(heading[61:, 1]) == 0.0 and heading[-1, 1] != 0.0 and not turning[61:, 1].any()
    assert not heading[:90, 3].any() and heading[-1, 3] != 0.0


@pytest.mark.parametrize(
    ("given_team", "message"),
    [
        ({"kinematics": "unicycl"}, r"team.kinematics: 'unicycl'.*unicycle|unknown kinematics"),
        ({"track_width": -0.1}, r"team.track_width: expected a number from 0 to 1000, got -0.1 m"),
        ({"kinematics": "unicycle", "turning_rate": 0.0}, r"team.turning_rate: expected .* got 0.0 rad/s"),
    ],
)
def test_what_is_no_unicycle_is_told(given_team: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Team.homogeneous(2, **given_team)  # type: ignore[arg-type]


def test_steering_has_to_be_finite(empty: Environment) -> None:
    with pytest.raises(StartError, match=r"steering: expected finite \[heading, turning rate\]"):
        TeamState(np.array([[2.0, 2.0]]), steering=np.array([[np.nan, 0.0]]))


class Counting:
    """Counts its steps, and goes where it faced when it had made ten."""

    def begin(self, number: int, team: Team) -> list[int]:
        return [number * len(team)]

    def force(self, own: OwnView) -> list[float]:
        own.memory.append(own.memory[-1] + 1)
        assert own.heading is not None
        return [1.0 if len(own.memory) > 10 else 0.0, 0.0]


def test_a_law_for_one_robot_remembers(empty: Environment) -> None:
    team = Team.homogeneous(2, kinematics="unicycle")
    run = Simulation(empty, Counting(), [[2.0, 2.0], [6.0, 6.0]], team)
    assert isinstance(run.controller, IndividualControllerAdapter)
    for _ in range(12):
        run.step()
        _ = run.observe_and_decide(), run.observe_and_decide()
    assert [memory[-1] for memory in run.memory.own] == [12, 14]
    twin = run.copy()
    run.step()
    twin.step()
    assert [memory[-1] for memory in twin.memory.own] == [13, 15]
    assert run.positions.tobytes() == twin.positions.tobytes()
    assert (run.velocities[:, 0] > 0).all()
