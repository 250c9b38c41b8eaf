"""The motion of a team: forces, limits, walls and contacts."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.team import Team
from robocov.world import MAX_PENETRATION_M, World
from robocov.world.obstacle_pieces import Obstacles, build_obstacles

DT = 1 / 60


def build_world(
    environment: Environment, n: int = 6, seed: int = 0, start: str = "uniform", **team: float
) -> World:
    positions = environment.start(start).sample(n, seed)
    return World(build_obstacles(environment), Team.homogeneous(n, **team), positions)


def compute_wall_distance(environment: Environment, positions: np.ndarray) -> float:
    """Return the distance of the robot closest to a wall, m; all must be in the free space."""
    points = shapely.points(positions)
    assert shapely.contains(environment.free, points).all()
    return float(shapely.distance(environment.free.boundary, points).min())


def test_viscous_motion_has_the_exact_solution(empty: Environment) -> None:
    """m v' = F - nu v: v(t) = F/nu (1 - exp(-nu t / m))."""
    team = Team.homogeneous(1, mass=2.0, viscosity=1.5)
    world = World(build_obstacles(empty), team, np.array([[2.0, 5.0]]))
    force = np.array([[0.6, 0.0]])
    for step in range(1, 121):
        world.step(force, DT)
        expected = 0.6 / 1.5 * (1 - np.exp(-1.5 / 2.0 * step * DT))
        assert world.velocities[0, 0] == pytest.approx(expected, rel=1e-12)


def test_without_viscosity_a_robot_coasts(empty: Environment) -> None:
    team = Team.homogeneous(1, viscosity=0.0)
    world = World(build_obstacles(empty), team, np.array([[2.0, 5.0]]), np.array([[0.5, 0.0]]))
    for _ in range(60):
        world.step(np.zeros((1, 2)), DT)
    np.testing.assert_allclose(world.velocities, [[0.5, 0.0]], rtol=1e-12)
    np.testing.assert_allclose(world.positions, [[2.5, 5.0]], rtol=1e-12)


@settings(max_examples=count_examples(25))
@given(seed=st.integers(0, 1000), max_force=st.floats(0.1, 500.0))
def test_limits_hold_under_any_forces(cluttered: Environment, seed: int, max_force: float) -> None:
    rng = np.random.default_rng(seed)
    world = build_world(cluttered, 8, seed)
    for _ in range(40):
        world.step(rng.normal(scale=max_force, size=(8, 2)), DT)
        assert np.hypot(*world.velocities.T).max() <= 1.0 + 1e-12
    assert compute_wall_distance(cluttered, world.positions) > 0.1 - MAX_PENETRATION_M


def test_acceleration_is_limited_without_contacts(empty: Environment) -> None:
    rng = np.random.default_rng(4)
    world = World(build_obstacles(empty), Team.homogeneous(1), np.array([[5.0, 5.0]]))
    for _ in range(200):
        previous_velocities = world.velocities
        world.step(rng.normal(scale=50.0, size=(1, 2)), DT)
        change = np.hypot(*(world.velocities - previous_velocities)[0])
        assert change <= 2.0 * DT * (1 + 1e-9)


@pytest.mark.parametrize("dt", [pytest.param(1 / 240, marks=pytest.mark.slow), 1 / 60, 0.05, 0.2, 1.0])
def test_no_robot_enters_a_wall_however_it_is_driven(cluttered: Environment, dt: float) -> None:
    """Robots drive against walls at full force, straight and into corners, at any control period."""
    for angle in np.linspace(0, 2 * np.pi, 7):
        world = build_world(cluttered, 8, 3, max_speed=2.0, max_acceleration=50.0, viscosity=0.5)
        force = np.tile([1000 * np.cos(angle), 1000 * np.sin(angle)], (8, 1))
        for _ in range(int(6 / dt)):
            world.step(force, dt)
            assert compute_wall_distance(cluttered, world.positions) > 0.1 - MAX_PENETRATION_M


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
    """Robots of any mass drive to the center and into a corner, with light ones between heavy ones."""
    n = 16
    equal_team = Team.homogeneous(n, max_speed=speed, max_acceleration=20.0 * speed)
    mass = np.geomspace(1.0, ratio, n)
    radius = np.resize(radii, n)
    team = replace(equal_team, mass=mass, radius=radius)
    starts = empty.start("uniform").sample(n, 1, radius=float(radius.max()))
    for target in ([5.0, 5.0], [-2.0, -1.0]):
        world = World(build_obstacles(empty), team, starts)
        for _ in range(int(600 / speed)):
            world.step(50.0 * speed * mass[:, None] * (np.array(target) - world.positions), DT)
            offsets = world.positions[:, None] - world.positions
            distances = np.hypot(offsets[:, :, 0], offsets[:, :, 1])
            np.fill_diagonal(distances, np.inf)
            overlap = radius[:, None] + radius - distances
            assert overlap.max() <= MAX_PENETRATION_M
            wall_distances = shapely.distance(empty.free.boundary, shapely.points(world.positions))
            assert shapely.contains_xy(empty.free, world.positions).all()
            assert (radius - wall_distances).max() <= MAX_PENETRATION_M
    assert overlap.max() > 0.0


def test_masses_whose_contacts_cannot_be_resolved_are_rejected(empty: Environment) -> None:
    """The team itself can be loaded, for example with a record."""
    team = Team.concatenate([Team.homogeneous(1, mass=0.5), Team.homogeneous(1, mass=501.0)])
    message = r"team.mass: expected .* 1000 times as heavy .* got 0.5 to 501 kg"
    with pytest.raises(ParameterError, match=message):
        World(build_obstacles(empty), team, np.array([[2.0, 2.0], [2.0, 6.0]]))


def test_a_step_can_be_repeated_after_an_interruption(
    cluttered: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = build_world(cluttered)
    forces = np.ones((6, 2))
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("robocov.world.world.ContactDetector", Mock(side_effect=KeyboardInterrupt))
        world.step(forces, DT)
    uninterrupted = build_world(cluttered)
    for repeated in (world, uninterrupted):
        repeated.step(forces, DT)
    assert world.positions.tobytes() == uninterrupted.positions.tobytes()


def test_energy_never_grows_without_forces(cluttered: Environment) -> None:
    """With the printed sign of (28) it would grow; contacts must not add any energy either."""
    rng = np.random.default_rng(0)
    for viscosity in (0.0, 0.3, 2.0):
        positions = cluttered.start("uniform").sample(30, 5)
        velocities = rng.normal(size=(30, 2))
        velocities /= np.maximum(np.hypot(*velocities.T), 1.0)[:, None]
        team = Team.homogeneous(30, viscosity=viscosity)
        world = World(build_obstacles(cluttered), team, positions, velocities)
        energy = 0.5 * (velocities**2).sum()
        for _ in range(300):
            previous_energy = energy
            world.step(np.zeros((30, 2)), DT)
            energy = 0.5 * (world.velocities**2).sum()
            assert energy <= previous_energy * (1 + 1e-12)
        if viscosity == 2.0:
            assert energy < 1e-6


@settings(max_examples=count_examples(12))
@given(seed=st.integers(0, 10_000), branch=st.integers(0, 150))
def test_copies_continue_identically_even_in_contact(cluttered: Environment, seed: int, branch: int) -> None:
    original = build_world(cluttered, 12, seed, start="corner")
    undisturbed = original.copy()
    for step in range(branch):
        original.step(draw_forces(seed, step), DT)
        undisturbed.step(draw_forces(seed, step), DT)
    twin = original.copy()
    for step in range(branch, branch + 60):
        for world in (original, twin, undisturbed):
            world.step(draw_forces(seed, step), DT)
        assert (original.positions == twin.positions).all()
        assert (original.velocities == twin.velocities).all()
        assert (original.positions == undisturbed.positions).all()
    # Copies share no pymunk objects, and may be used in other threads.
    assert twin._spaces is not original._spaces
    assert twin._contact_solver is None or twin._contact_solver is not original._contact_solver


def draw_forces(seed: int, step: int) -> np.ndarray:
    """Return forces on 12 robots, which change every 20 steps."""
    return np.random.default_rng([seed, step // 20]).normal(scale=20.0, size=(12, 2))


def test_robots_of_the_copy_test_touch_each_other(cluttered: Environment) -> None:
    """The test above would prove little if the robots never touched anything."""
    world = build_world(cluttered, 12, 0, start="corner")
    steps_with_contact = 0
    for step in range(200):
        world.step(draw_forces(0, step), DT)
        steps_with_contact += bool(world._list_touching_robots())
    assert steps_with_contact > 20


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
    world = World(build_obstacles(empty), team, np.array([[2.0, 2.0], [2.0, 6.0]]))
    for _ in range(120):
        world.step(np.full((2, 2), [100.0, 0.0]), DT)
    np.testing.assert_allclose(np.hypot(*world.velocities.T), [1.0, 0.4], rtol=1e-9)


DISTANT_WALL = np.array([[90.0, 90.0], [91.0, 90.0], [91.0, 91.0]])
"""A wall that no robot reaches."""


def test_a_thrown_robot_brakes_as_hard_as_it_can() -> None:
    team = Team.homogeneous(1, max_speed=1.0, max_acceleration=2.0, viscosity=0.5)
    world = World(Obstacles((DISTANT_WALL,)), team, np.zeros((1, 2)), np.array([[5.0, 0.0]]))
    speeds = [5.0]
    for _ in range(180):
        # The controller asks for full speed.
        world.step(np.array([[50.0, 0.0]]), DT)
        speeds.append(float(world.velocities[0, 0]))
    np.testing.assert_allclose(-np.diff(speeds)[:119], 2.0 / 60, rtol=1e-9)
    np.testing.assert_allclose(speeds[121:], 1.0, rtol=1e-12)


@pytest.mark.parametrize("mass", [1.0, 2.5])
def test_external_forces_are_not_limited(mass: float) -> None:
    team = Team.homogeneous(2, mass=mass)
    world = World(Obstacles((DISTANT_WALL,)), team, np.array([[0.0, 0.0], [5.0, 0.0]]))
    push = np.array([[0.0, 60.0], [0.0, 0.0]])
    world.step(np.zeros((2, 2)), 0.01, push)
    np.testing.assert_allclose(world.velocities, push / mass * 0.01, rtol=1e-12)


def test_external_forces_of_zero_change_nothing() -> None:
    team = Team.homogeneous(3)
    starts = np.array([[0.0, 0.0], [0.35, 0.0], [5.0, 5.0]])
    forces = np.array([[1.5, 0.3], [-1.0, 0.2], [0.4, -2.0]])
    free = World(Obstacles((DISTANT_WALL,)), team, starts)
    unpushed = World(Obstacles((DISTANT_WALL,)), team, starts)
    for _ in range(120):
        free.step(forces, DT)
        unpushed.step(forces, DT, np.zeros((3, 2)))
    np.testing.assert_array_equal(unpushed.positions, free.positions)
    np.testing.assert_array_equal(unpushed.velocities, free.velocities)


@pytest.mark.parametrize("force", [30.0, 300.0, 3000.0])
def test_external_forces_push_no_robot_through_a_thin_wall(force: float) -> None:
    wall = np.array([[1.0, -1.0], [1.02, -1.0], [1.02, 1.0], [1.0, 1.0]])
    world = World(Obstacles((wall,)), Team.homogeneous(1, radius=0.1), np.zeros((1, 2)))
    for _ in range(60):
        world.step(np.zeros((1, 2)), DT, np.array([[force, 0.0]]))
        assert world.positions[0, 0] < 0.95


def test_a_dragged_robot_follows_the_pointer_and_can_be_thrown() -> None:
    world = World(Obstacles((DISTANT_WALL,)), Team.homogeneous(1), np.zeros((1, 2)))
    pointer = np.array([[4.0, 1.0]])
    for _ in range(120):
        spring_force = 40.0 * (pointer - world.positions)
        world.step(np.zeros((1, 2)), DT, spring_force - 12.0 * world.velocities)
    np.testing.assert_allclose(world.positions, pointer, atol=0.05)
    world.step(np.zeros((1, 2)), DT, np.array([[0.0, 240.0]]))
    speed = float(world.velocities[0, 1])
    assert speed > 3.0
    for _ in range(int(speed / 2.0 * 60) + 60):
        world.step(np.zeros((1, 2)), DT)
    assert np.hypot(*world.velocities[0]) < 0.5


def test_pushed_robots_keep_their_speed_limit(empty: Environment) -> None:
    heavy = Team.homogeneous(1, max_speed=2.0, mass=50.0)
    slow = Team.homogeneous(1, max_speed=0.5)
    team = Team.concatenate([heavy, slow])
    starts = np.array([[3.0, 5.0], [3.5, 5.0]])
    velocities = np.array([[2.0, 0.0], [0.0, 0.0]])
    world = World(build_obstacles(empty), team, starts, velocities)
    for _ in range(60):
        world.step(np.array([[500.0, 0.0], [0.0, 0.0]]), DT)
        assert (np.hypot(*world.velocities.T) <= team.max_speed + 1e-12).all()
    assert world.positions[1, 0] > 3.6


def test_external_forces_move_robots_along_walls_without_limits() -> None:
    """The limit after a contact takes the external force into account."""
    wall = np.array([[1.0, -20.0], [2.0, -20.0], [2.0, 20.0], [1.0, 20.0]])
    push = np.array([[1.0, 20.0]])
    speeds = []
    for obstacle in (wall, DISTANT_WALL):
        world = World(Obstacles((obstacle,)), Team.homogeneous(1), np.array([[0.9, 0.0]]))
        for _ in range(30):
            world.step(np.zeros((1, 2)), DT, push)
        speeds.append(world.velocities[0, 1])
    assert speeds[0] == pytest.approx(speeds[1], rel=0.01)
    assert speeds[0] > 5.0


def test_robots_that_hit_a_wall_end_the_step_at_its_surface() -> None:
    """At 1 m/s, the robot hits the wall at any time within a step."""
    wall = np.array([[1.0, -5.0], [2.0, -5.0], [2.0, 5.0], [1.0, 5.0]])
    for gap in np.linspace(0.0, DT, 40):
        start = np.array([[0.9 - gap, 0.0]])
        world = World(Obstacles((wall,)), Team.homogeneous(1), start, np.array([[1.0, 0.0]]))
        world.step(np.array([[100.0, 0.0]]), DT)
        assert 0.899 <= world.positions[0, 0] <= 0.9 + 2e-4
