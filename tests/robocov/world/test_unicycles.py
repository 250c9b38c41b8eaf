"""Unicycles: motion of their wheels, contacts, copies, and teams in which some robots are points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import Conditions, Failure, Join
from robocov.controllers import Atlas, Barrier, IndividualControllerAdapter, OwnView, Rapf
from robocov.environment import Environment
from robocov.errors import ParameterError, StartError
from robocov.mapfile import load_map
from robocov.simulation import Simulation, TeamState
from robocov.team import Team
from robocov.world import World
from robocov.world.obstacle_pieces import build_obstacles
from robocov.world.unicycles import remove_sideways_velocity

DT = 1 / 60


def build_world(environment: Environment, positions: np.ndarray, **team: float) -> World:
    unicycles = Team.homogeneous(len(positions), kinematics="unicycle", **team)
    return World(build_obstacles(environment), unicycles, positions)


def compute_distances(positions: np.ndarray) -> np.ndarray:
    """Return the distances between robots, (n, n) m; infinite from a robot to itself."""
    offsets = positions[:, None] - positions
    distances = np.hypot(offsets[:, :, 0], offsets[:, :, 1])
    np.fill_diagonal(distances, np.inf)
    return distances


@settings(max_examples=count_examples(25))
@given(
    seed=st.integers(0, 1000),
    max_force=st.floats(0.01, 500.0),
    track_width=st.floats(0.02, 1.0),
    turning_rate=st.floats(0.1, 20.0),
    max_speed=st.floats(0.05, 3.0),
)
def test_wheels_and_turns_keep_their_limits_without_sideways_slip(
    empty: Environment,
    seed: int,
    max_force: float,
    track_width: float,
    turning_rate: float,
    max_speed: float,
) -> None:
    rng = np.random.default_rng(seed)
    n = 5
    world = build_world(
        empty,
        empty.start("uniform").sample(n, seed),
        track_width=track_width,
        turning_rate=turning_rate,
        max_speed=max_speed,
    )
    max_change = world.team.max_acceleration[0] * DT
    previous_wheel_speeds = np.zeros((2, n))
    for _ in range(40):
        previous_positions = world.positions
        previous_velocities = world.velocities
        world.step(rng.normal(0.0, max_force, (n, 2)) * rng.integers(0, 2), DT)
        assert world.steering is not None
        heading, rate = world.steering.T
        direction = np.column_stack([np.cos(heading), np.sin(heading)])
        speed = (world.velocities * direction).sum(axis=1)
        slip = world.velocities - speed[:, None] * direction
        assert np.abs(slip).max() < 1e-12
        assert speed.min() > -1e-12
        assert np.abs(rate).max() <= turning_rate + 1e-12
        wheel_speeds = np.array([speed - rate * track_width / 2, speed + rate * track_width / 2])
        assert np.abs(wheel_speeds).max() <= max_speed + 1e-9
        is_far_from_walls = np.abs(world.positions - 5.0).max(axis=1) < 4.5
        is_untouched = is_far_from_walls & (compute_distances(world.positions).min(axis=1) > 0.4)
        # pymunk moves bodies first, and changes their velocities afterwards.
        displacement_error = world.positions - previous_positions - DT * previous_velocities
        assert np.abs(displacement_error[is_untouched]).max(initial=0.0) < 1e-12
        change = np.abs(wheel_speeds - previous_wheel_speeds)
        assert change[:, is_untouched].max(initial=0.0) <= max_change + 1e-9
        previous_wheel_speeds = wheel_speeds


def test_a_unicycle_turns_in_place_before_it_drives(empty: Environment) -> None:
    world = build_world(empty, np.array([[5.0, 5.0]]))
    for _ in range(12):
        world.step(np.array([[-1.0, 0.1]]), DT)
        np.testing.assert_array_equal(world.positions, [[5.0, 5.0]])
    for _ in range(240):
        world.step(np.array([[-1.0, 0.1]]), DT)
    assert world.steering is not None
    assert world.steering[0, 0] == pytest.approx(np.arctan2(0.1, -1.0), abs=0.01)
    # Once it faces the direction of the force it moves like a point, at F / nu.
    np.testing.assert_allclose(world.velocities, [[-0.5, 0.05]], atol=0.01)


@pytest.mark.parametrize("initial_speed", [0.0, 0.8])
def test_unicycles_turn_right_as_they_turn_left(empty: Environment, initial_speed: float) -> None:
    """Mirrored forces give mirrored motion."""
    team = Team.homogeneous(1, kinematics="unicycle")
    velocities = np.array([[initial_speed, 0.0]])
    worlds = [World(build_obstacles(empty), team, np.array([[2.0, 5.0]]), velocities) for _ in range(2)]
    left, right = worlds
    for _ in range(90):
        left.step(np.array([[1.0, 0.8]]), DT)
        right.step(np.array([[1.0, -0.8]]), DT)
        assert left.steering is not None
        assert right.steering is not None
        np.testing.assert_allclose(right.steering, -left.steering, atol=1e-12)
        np.testing.assert_allclose(right.velocities, left.velocities * [1.0, -1.0], atol=1e-12)
    assert left.steering[0, 0] > 0.4


def test_headings_stay_within_a_turn(empty: Environment) -> None:
    world = build_world(empty, np.array([[5.0, 5.0]]))
    headings = []
    for step in range(600):
        angle = 0.02 * step
        world.step(np.array([[np.cos(angle), np.sin(angle)]]), DT)
        assert world.steering is not None
        headings.append(world.steering[0, 0])
    assert np.ptp(np.unwrap(headings)) > 2.5 * np.pi
    assert np.abs(headings).max() <= np.pi


@given(speed=st.floats(0.0, 1.0), heading=st.floats(-3.1, 3.1), force=st.floats(0.0, 50.0))
def test_unicycles_brake_as_hard_as_points(
    empty: Environment, speed: float, heading: float, force: float
) -> None:
    direction = np.array([[np.cos(heading), np.sin(heading)]])
    final_velocities = {}
    for kinematics in ("point", "unicycle"):
        world = World(
            build_obstacles(empty),
            Team.homogeneous(1, kinematics=kinematics),
            np.array([[5.0, 5.0]]),
            speed * direction,
            steering=np.array([[heading, 0.0]]),
        )
        world.step(-force * direction, DT)
        final_velocities[kinematics] = world.velocities[0]
    # The unicycle does not drive backwards, and may turn while it brakes.
    expected_speed = max(float(final_velocities["point"] @ direction[0]), 0.0)
    assert np.hypot(*final_velocities["unicycle"]) == pytest.approx(expected_speed, abs=1e-9)


def test_only_the_forward_part_of_a_velocity_remains_after_a_contact() -> None:
    """A unicycle that is pushed backwards stops; a robot that is carried keeps its velocity."""
    velocities = np.array([[0.5, 0.3], [-0.5, 0.3], [0.9, 0.0], [-0.5, 0.3]])
    remaining = remove_sideways_velocity(
        velocities=velocities,
        steering=np.zeros((4, 2)),
        max_speed=np.array([1.0, 1.0, 0.6, 1.0]),
        is_rolling=np.array([True, True, True, False]),
    )
    np.testing.assert_array_equal(remaining, [[0.5, 0.0], [0.0, 0.0], [0.6, 0.0], [-0.5, 0.3]])


def test_points_next_to_unicycles_move_as_among_points(empty: Environment) -> None:
    rng = np.random.default_rng(1)
    n = 6
    starts = np.array([[1.0 + 1.5 * k, 5.0] for k in range(n)])
    points = Team.homogeneous(n)
    mixed_team = replace(points, track_width=np.array([0.0, 0.2] * 3))
    world_of_points = World(build_obstacles(empty), points, starts)
    mixed_world = World(build_obstacles(empty), mixed_team, starts)
    assert world_of_points.steering is None
    for _ in range(60):
        forces = rng.normal(0.0, 1.0, (n, 2))
        world_of_points.step(forces, DT)
        mixed_world.step(forces, DT)
    np.testing.assert_array_equal(world_of_points.positions[::2], mixed_world.positions[::2])
    np.testing.assert_array_equal(world_of_points.velocities[::2], mixed_world.velocities[::2])
    assert (world_of_points.positions[1::2] != mixed_world.positions[1::2]).any(axis=1).all()


@pytest.mark.parametrize("force", [[0.0, 2.0], [-2.0, 0.0]], ids=["sideways", "backwards"])
def test_a_unicycle_that_was_carried_stops_when_it_is_released(
    empty: Environment, force: list[float]
) -> None:
    world = build_world(empty, np.array([[5.0, 5.0]]))
    for _ in range(30):
        world.step(np.zeros((1, 2)), DT, np.array([force]))
    assert (world.positions[0] - 5.0) @ force > 0.1
    assert world.steering is not None
    assert not world.steering.any()
    world.step(np.zeros((1, 2)), DT)
    assert not world.velocities.any()


@pytest.mark.parametrize("angular_speed", [0.5, 2.0, 5.0])
def test_wheels_keep_their_speed_limit_in_curves(empty: Environment, angular_speed: float) -> None:
    """Strong forces, whose direction rotates now and then, ask for full speed and for turns at once."""
    world = build_world(empty, np.array([[5.0, 5.0]]), max_speed=0.3, turning_rate=10.0)
    for step in range(300):
        angle = angular_speed * max(0.0, step * DT % 2.0 - 1.0)
        world.step(20.0 * np.array([[np.cos(angle), np.sin(angle)]]), DT)
        assert world.steering is not None
        speed = np.hypot(*world.velocities[0])
        wheel_speed = abs(world.steering[0, 1]) * world.team.track_width[0] / 2
        assert speed + wheel_speed <= 0.3 + 1e-9


def test_faint_forces_turn_a_robot_at_rest_slowly(empty: Environment) -> None:
    """Otherwise noise would turn robots at rest about."""
    rates = {}
    for force in (1e-4, 1.0):
        world = build_world(empty, np.array([[5.0, 5.0]]))
        for _ in range(20):
            world.step(np.array([[-force, 0.1 * force]]), DT)
        assert world.steering is not None
        rates[force] = world.steering[0, 1]
    assert 0.0 < rates[1e-4] < 0.1 * rates[1.0]


def test_unicycles_brake_for_lateral_acceleration_that_turning_does_not_provide(empty: Environment) -> None:
    team = Team.homogeneous(1, kinematics="unicycle", viscosity=0.0, max_speed=3.0)
    world = World(build_obstacles(empty), team, np.array([[2.0, 5.0]]), np.array([[0.8, 0.0]]))
    world.step(np.array([[0.0, 50.0]]), DT)
    assert np.hypot(*world.velocities[0]) == pytest.approx(0.8 - team.max_acceleration[0] * DT)


def test_placed_unicycles_face_along_x(empty: Environment) -> None:
    """Robots of the other run keep their heading."""
    starts = np.array([[2.0, 2.0], [5.0, 5.0]])
    steering = np.array([[1.0, 0.5], [2.0, 0.25]])
    team = Team.homogeneous(2, kinematics="unicycle")
    world = World(build_obstacles(empty), team, starts, steering=steering, runs=2)
    world.place(1, np.array([[3.0, 3.0]]))
    assert world.steering is not None
    assert world.steering.tolist() == [[1.0, 0.5], [0.0, 0.0]]
    assert steering.tolist() == [[1.0, 0.5], [2.0, 0.25]]
    assert not world.steering.flags.writeable


def assert_nothing_is_touched(name: str, controller: Rapf | Atlas | Barrier, duration: float) -> None:
    environment = load_map(name)
    starts = environment.start().sample(6, seed=2)
    team = Team.homogeneous(6, kinematics="unicycle")
    record = Simulation(environment, controller, starts, team).run(duration)
    displacements = record.positions[-1] - starts
    assert np.hypot(displacements[:, 0], displacements[:, 1]).max() > 1.0
    wall_distances = shapely.distance(shapely.points(record.positions), environment.static.free.boundary)
    assert wall_distances.min() > 0.1
    assert min(compute_distances(positions).min() for positions in record.positions) > 0.2


@pytest.mark.parametrize("name", ["rooms", "museum", "office"])
def test_unicycles_have_no_contacts_where_points_have_none(name: str) -> None:
    assert_nothing_is_touched(name, Rapf(), 15.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "museum"])
@pytest.mark.parametrize("controller", [Rapf(), Atlas(), Barrier()], ids=lambda controller: controller.name)
def test_unicycles_have_no_contacts_in_long_runs(name: str, controller: Rapf | Atlas | Barrier) -> None:
    assert_nothing_is_touched(name, controller, 40.0)


def test_copies_of_unicycles_continue_bit_for_bit() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(4, seed=0)
    team = Team.homogeneous(4, kinematics="unicycle")
    original = Simulation(rooms, Rapf(), starts, team)
    original.run(2.0)
    twin = original.copy()
    state = TeamState(original.positions, original.velocities, original.steering, steps=120, is_computed=True)
    continued = Simulation(rooms, Rapf(), state, team)
    for simulation in (original, twin, continued):
        simulation.run(2.0)
    assert original.positions.tobytes() == twin.positions.tobytes() == continued.positions.tobytes()
    assert original.steering is not None
    assert continued.steering is not None
    assert original.steering.tobytes() == continued.steering.tobytes()


def test_points_that_become_unicycles_face_the_direction_of_their_motion() -> None:
    rooms = load_map("rooms")
    state = TeamState(rooms.start().sample(4, seed=0), np.array([[0.0, 0.1]] * 4))
    points = Simulation(rooms, Rapf(), state)
    unicycles = points.with_changes(team=Team.homogeneous(4, kinematics="unicycle"))
    assert unicycles.steering is not None
    assert unicycles.steering.tolist() == [[np.pi / 2, 0.0]] * 4


def test_failed_unicycles_keep_their_heading_and_new_ones_face_along_x() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(4, seed=0)
    team = Team.homogeneous(4, kinematics="unicycle")
    conditions = Conditions(failures=(Failure(2, 1.0),), joins=(Join(4, 1.5),))
    record = Simulation(rooms, Rapf(), starts, team, conditions=conditions).run(3.0)
    assert record.steering is not None
    headings = record.steering[:, :, 0]
    turning_rates = record.steering[:, :, 1]
    assert np.ptp(headings[61:, 1]) == 0.0
    assert headings[-1, 1] != 0.0
    assert not turning_rates[61:, 1].any()
    assert not headings[:90, 3].any()
    assert headings[-1, 3] != 0.0


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        ({"kinematics": "unicycl"}, r"^team\.kinematics: unknown kinematics 'unicycl': did you mean"),
        ({"track_width": -0.1}, r"team.track_width: expected a number from 0 to 1000, got -0.1 m"),
        ({"kinematics": "unicycle", "turning_rate": 0.0}, r"team.turning_rate: expected .* got 0.0 rad/s"),
    ],
)
def test_impossible_unicycles_are_rejected(properties: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Team.homogeneous(2, **properties)  # type: ignore[arg-type]


def test_steering_must_be_finite() -> None:
    with pytest.raises(StartError, match=r"steering: expected finite \[heading, turning rate\]"):
        TeamState(np.array([[2.0, 2.0]]), steering=np.array([[np.nan, 0.0]]))


class Counter:
    """Counts its steps, and drives along x after ten of them."""

    def begin(self, number: int, team: Team) -> list[int]:
        return [number * len(team)]

    def force(self, own: OwnView) -> list[float]:
        own.memory.append(own.memory[-1] + 1)
        assert own.heading is not None
        return [1.0 if len(own.memory) > 10 else 0.0, 0.0]


def test_a_controller_for_one_robot_keeps_its_memory(empty: Environment) -> None:
    team = Team.homogeneous(2, kinematics="unicycle")
    simulation = Simulation(empty, Counter(), [[2.0, 2.0], [6.0, 6.0]], team)
    assert isinstance(simulation.controller, IndividualControllerAdapter)
    for _ in range(12):
        simulation.step()
        simulation.observe_and_decide()
    assert [memory[-1] for memory in simulation.memory.by_robot] == [12, 14]
    twin = simulation.copy()
    simulation.step()
    twin.step()
    assert [memory[-1] for memory in twin.memory.by_robot] == [13, 15]
    assert simulation.positions.tobytes() == twin.positions.tobytes()
    assert (simulation.velocities[:, 0] > 0).all()
