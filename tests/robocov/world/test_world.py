from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.team import Team
from robocov.world import MAX_PENETRATION, World
from robocov.world.obstacle_pieces import build_solid_pieces

DT = 1 / 60


def world(
    environment: Environment, n: int = 6, seed: int = 0, start: str = "uniform", **team: float
) -> World:
    positions = environment.start(start).sample(n, seed)
    return World(build_solid_pieces(environment), Team.homogeneous(n, **team), positions)


def clearance(environment: Environment, positions: np.ndarray) -> float:
    points = shapely.points(positions)
    assert shapely.contains(environment.free, points).all()
    return float(shapely.distance(environment.free.boundary, points).min())


def test_viscous_motion_has_the_exact_solution(empty: Environment) -> None:
    """m v' = F - nu v: v(t) = F/nu (1 - exp(-nu t / m))."""
    one = World(
        build_solid_pieces(empty), Team.homogeneous(1, mass=2.0, viscosity=1.5), np.array([[2.0, 5.0]])
    )
    force = np.array([[0.6, 0.0]])
    for step in range(1, 121):
        one.step(force, DT)
        expected = 0.6 / 1.5 * (1 - np.exp(-1.5 / 2.0 * step * DT))
        assert one.velocities[0, 0] == pytest.approx(expected, rel=1e-12)


def test_without_viscosity_a_robot_coasts(empty: Environment) -> None:
    one = World(
        build_solid_pieces(empty),
        Team.homogeneous(1, viscosity=0.0),
        np.array([[2.0, 5.0]]),
        np.array([[0.5, 0.0]]),
    )
    for _ in range(60):
        one.step(np.zeros((1, 2)), DT)
    np.testing.assert_allclose(one.velocities, [[0.5, 0.0]], rtol=1e-12)
    np.testing.assert_allclose(one.positions, [[2.5, 5.0]], rtol=1e-12)


@settings(max_examples=25)
@given(seed=st.integers(0, 1000), size=st.floats(0.1, 500.0))
def test_limits_hold_under_any_forces(cluttered: Environment, seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    team = world(cluttered, 8, seed)
    before = team.velocities
    for _ in range(40):
        team.step(rng.normal(scale=size, size=(8, 2)), DT)
        speed = np.hypot(*team.velocities.T)
        assert speed.max() <= 1.0 + 1e-12
        before = team.velocities
    assert clearance(cluttered, team.positions) > 0.1 - MAX_PENETRATION
    assert before is team.velocities


def test_acceleration_is_limited_where_nothing_is_touched(empty: Environment) -> None:
    rng = np.random.default_rng(4)
    one = World(build_solid_pieces(empty), Team.homogeneous(1), np.array([[5.0, 5.0]]))
    before = one.velocities
    for _ in range(200):
        one.step(rng.normal(scale=50.0, size=(1, 2)), DT)
        assert np.hypot(*(one.velocities - before).T).max() <= 2.0 * DT * (1 + 1e-9)
        before = one.velocities


@pytest.mark.parametrize("dt", [pytest.param(1 / 240, marks=pytest.mark.slow), 1 / 60, 0.05, 0.2, 1.0])
def test_no_robot_enters_a_wall_however_it_is_driven(cluttered: Environment, dt: float) -> None:
    """Driven against walls at full force and speed, straight and into corners, at any control period."""
    for angle in np.linspace(0, 2 * np.pi, 7):
        team = world(cluttered, 8, 3, max_speed=2.0, max_acceleration=50.0, viscosity=0.5)
        force = np.tile([1000 * np.cos(angle), 1000 * np.sin(angle)], (8, 1))
        for _ in range(int(6 / dt)):
            team.step(force, dt)
            assert clearance(cluttered, team.positions) > 0.1 - MAX_PENETRATION


@pytest.mark.parametrize(
    ("ratio", "speed", "radii"),
    [
        (1, 2, (0.1,)),
        (10, 5, (0.1,)),
        (1, 20, (0.3, 0.5)),
        pytest.param(100, 2, (0.05, 0.1), marks=pytest.mark.slow),
        pytest.param(1000, 20, (0.1, 0.15), marks=pytest.mark.slow),
    ],
)
def test_a_pressed_crowd_neither_overlaps_nor_sinks_into_walls(
    empty: Environment, ratio: float, speed: float, radii: tuple[float, ...]
) -> None:
    """Robots of any mass driven into the middle and into a corner, where light ones are between."""
    n = 16
    everyone = Team.homogeneous(n, max_speed=speed, max_acceleration=20.0 * speed)
    mass = np.geomspace(1.0, ratio, n)
    radius = np.resize(radii, n)
    team = replace(everyone, mass=mass, radius=radius)
    places = empty.start("uniform").sample(n, 1, radius=float(radius.max()))
    for target in ([5.0, 5.0], [-2.0, -1.0]):
        crowd = World(build_solid_pieces(empty), team, places)
        for _ in range(int(600 / speed)):
            crowd.step(50.0 * speed * mass[:, None] * (np.array(target) - crowd.positions), DT)
            apart = np.hypot(*(crowd.positions[:, None] - crowd.positions[None]).transpose(2, 0, 1))
            overlap = radius[:, None] + radius - apart - 10.0 * np.eye(n)
            assert overlap.max() <= MAX_PENETRATION
            room = shapely.distance(empty.free.boundary, shapely.points(crowd.positions))
            assert shapely.contains_xy(empty.free, crowd.positions).all()
            assert (radius - room).max() <= MAX_PENETRATION
    assert overlap.max() > 0.0


def test_masses_whose_contacts_cannot_be_resolved_are_refused(empty: Environment) -> None:
    """The team itself is read all the same, as that of a record is."""
    team = Team.concatenate([Team.homogeneous(1, mass=0.5), Team.homogeneous(1, mass=501.0)])
    message = r"team.mass: expected .* 1000 times as heavy .* got 0.5 to 501 kg"
    with pytest.raises(ParameterError, match=message):
        World(build_solid_pieces(empty), team, np.array([[2.0, 2.0], [2.0, 6.0]]))


def test_energy_never_grows_without_forces(cluttered: Environment) -> None:
    """With the sign of (28) as printed it would; contacts must not add any either."""
    rng = np.random.default_rng(0)
    for viscosity in (0.0, 0.3, 2.0):
        positions = cluttered.start("uniform").sample(30, 5)
        velocities = rng.normal(size=(30, 2))
        velocities /= np.maximum(np.hypot(*velocities.T), 1.0)[:, None]
        team = World(
            build_solid_pieces(cluttered), Team.homogeneous(30, viscosity=viscosity), positions, velocities
        )
        energy = 0.5 * (velocities**2).sum()
        for _ in range(300):
            team.step(np.zeros((30, 2)), DT)
            now = 0.5 * (team.velocities**2).sum()
            assert now <= energy * (1 + 1e-12)
            energy = now
        if viscosity == 2.0:
            assert energy < 1e-6


@settings(max_examples=12)
@given(seed=st.integers(0, 10_000), branch=st.integers(0, 150))
def test_a_copy_goes_on_identically_even_in_contact(cluttered: Environment, seed: int, branch: int) -> None:
    def drive(step: int) -> np.ndarray:
        return np.random.default_rng([seed, step // 20]).normal(scale=20.0, size=(12, 2))

    original = world(cluttered, 12, seed, start="corner")
    undisturbed = original.copy()
    for step in range(branch):
        original.step(drive(step), DT)
        undisturbed.step(drive(step), DT)
    twin = original.copy()
    touched = 0
    for step in range(branch, branch + 60):
        for each in (original, twin, undisturbed):
            each.step(drive(step), DT)
        touched += bool(original._list_touching())
        assert (original.positions == twin.positions).all()
        assert (original.velocities == twin.velocities).all()
        assert (original.positions == undisturbed.positions).all()
    # also in threads
    assert twin._spaces is not original._spaces
    assert twin._contact_solver is None or twin._contact_solver is not original._contact_solver


def test_the_copy_test_is_about_contacts(cluttered: Environment) -> None:
    """The test above would prove little if the robots never touched anything."""
    team = world(cluttered, 12, 0, start="corner")
    touched = 0
    for step in range(200):
        team.step(np.random.default_rng([0, step // 20]).normal(scale=20.0, size=(12, 2)), DT)
        touched += bool(team._list_touching())
    assert touched > 20


def test_heterogeneous_teams_keep_their_own_limits(empty: Environment) -> None:
    team = Team(
        radius=np.array([0.1, 0.2]),
        mass=np.array([1.0, 3.0]),
        max_speed=np.array([1.0, 0.4]),
        max_acceleration=np.array([2.0, 0.5]),
        viscosity=np.array([2.0, 1.0]),
        sensing_range=np.array([3.0, 3.0]),
        communication_range=np.array([np.inf, np.inf]),
    )
    pair = World(build_solid_pieces(empty), team, np.array([[2.0, 2.0], [2.0, 6.0]]))
    for _ in range(120):
        pair.step(np.full((2, 2), [100.0, 0.0]), DT)
    np.testing.assert_allclose(np.hypot(*pair.velocities.T), [1.0, 0.4], rtol=1e-9)


FAR = np.array([[90.0, 90.0], [91.0, 90.0], [91.0, 91.0]])
"""Somewhere there is always a wall."""


def test_a_thrown_robot_brakes_as_hard_as_it_can() -> None:
    team = Team.homogeneous(1, max_speed=1.0, max_acceleration=2.0, viscosity=0.5)
    world = World((FAR,), team, np.zeros((1, 2)), np.array([[5.0, 0.0]]))
    speeds = [5.0]
    for _ in range(180):
        # the controller would go on
        world.step(np.array([[50.0, 0.0]]), 1 / 60)
        speeds.append(float(world.velocities[0, 0]))
    np.testing.assert_allclose(-np.diff(speeds)[:119], 2.0 / 60, rtol=1e-9)
    np.testing.assert_allclose(speeds[121:], 1.0, rtol=1e-12)


@pytest.mark.parametrize("mass", [1.0, 2.5])
def test_pushes_know_no_limits(mass: float) -> None:
    team = Team.homogeneous(2, mass=mass)
    world = World((FAR,), team, np.array([[0.0, 0.0], [5.0, 0.0]]))
    push = np.array([[0.0, 60.0], [0.0, 0.0]])
    world.step(np.zeros((2, 2)), 0.01, push)
    np.testing.assert_allclose(world.velocities, push / mass * 0.01, rtol=1e-12)


def test_without_pushes_nothing_is_different() -> None:
    team = Team.homogeneous(3)
    places = np.array([[0.0, 0.0], [0.35, 0.0], [5.0, 5.0]])
    forces = np.array([[1.5, 0.3], [-1.0, 0.2], [0.4, -2.0]])
    one, other = World((FAR,), team, places), World((FAR,), team, places)
    for _ in range(120):
        one.step(forces, 1 / 60)
        other.step(forces, 1 / 60, np.zeros((3, 2)))
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.velocities, other.velocities)


@pytest.mark.parametrize("force", [30.0, 300.0, 3000.0])
def test_no_push_drives_a_robot_through_a_thin_wall(force: float) -> None:
    wall = np.array([[1.0, -1.0], [1.02, -1.0], [1.02, 1.0], [1.0, 1.0]])
    world = World((wall,), Team.homogeneous(1, radius=0.1), np.zeros((1, 2)))
    for _ in range(60):
        world.step(np.zeros((1, 2)), 1 / 60, np.array([[force, 0.0]]))
        assert world.positions[0, 0] < 0.95


def test_a_robot_on_a_spring_follows_the_hand_and_is_thrown() -> None:
    world = World((FAR,), Team.homogeneous(1), np.zeros((1, 2)))
    hand = np.array([[4.0, 1.0]])
    for _ in range(120):
        stretch = hand - world.positions
        world.step(np.zeros((1, 2)), 1 / 60, 40.0 * stretch - 12.0 * world.velocities)
    np.testing.assert_allclose(world.positions, hand, atol=0.05)
    world.step(np.zeros((1, 2)), 1 / 60, np.array([[0.0, 240.0]]))
    speed = float(world.velocities[0, 1])
    assert speed > 3.0
    for _ in range(int(speed / 2.0 * 60) + 60):
        world.step(np.zeros((1, 2)), 1 / 60)
    assert np.hypot(*world.velocities[0]) < 0.5


def test_a_robot_that_is_pushed_is_no_faster_than_its_limit(empty: Environment) -> None:
    heavy = Team.homogeneous(1, max_speed=2.0, mass=50.0)
    slow = Team.homogeneous(1, max_speed=0.5)
    team = Team.concatenate([heavy, slow])
    pair = World(
        build_solid_pieces(empty),
        team,
        np.array([[3.0, 5.0], [3.5, 5.0]]),
        np.array([[2.0, 0.0], [0.0, 0.0]]),
    )
    for _ in range(60):
        pair.step(np.array([[500.0, 0.0], [0.0, 0.0]]), DT)
        assert (np.hypot(*pair.velocities.T) <= team.max_speed + 1e-12).all()
    assert pair.positions[1, 0] > 3.6, "it was pushed"
