"""Free positions of robots: in changed maps, and for robots that join."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from random_maps import KINDS, build_random_map

from robocov.controllers import Rapf
from robocov.environment import CircleObstacle, Environment
from robocov.errors import StartError
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.world.free_positions import find_free_position, relocate_robots

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
EMPTY = Environment("empty", SQUARE)


def compute_distances(positions):
    """Return the distances between robots, (n, n) m; infinite from a robot to itself."""
    offsets = positions[:, None] - positions
    distances = np.hypot(offsets[:, :, 0], offsets[:, :, 1])
    np.fill_diagonal(distances, np.inf)
    return distances


@settings(max_examples=count_examples(80))
@given(
    kind=st.sampled_from(sorted(KINDS)),
    obstacles=st.integers(1, 12),
    seed=st.integers(0, 2**32),
    robots=st.integers(1, 15),
    is_crowded=st.booleans(),
)
def test_all_robots_fit_and_those_that_did_before_stay(kind, obstacles, seed, robots, is_crowded):
    environment = build_random_map(kind, obstacles, seed)
    assume(environment is not None)
    positions = np.random.default_rng(seed).uniform(0.0, 8.0, (robots, 2))
    if is_crowded:
        positions = 4.0 + 0.1 * positions
    team = Team.homogeneous(robots, radius=0.05)
    relocated = relocate_robots(environment, positions, team)
    # The simulation accepts them as starts.
    Simulation(environment, Rapf(), relocated, team)
    wall_distances = shapely.distance(environment.free.boundary, shapely.points(positions))
    is_inside = shapely.contains_properly(environment.free, shapely.points(positions))
    is_far_from_others = compute_distances(positions).min(axis=1) > 2.0
    stays = is_inside & (wall_distances >= 0.05) & is_far_from_others
    np.testing.assert_array_equal(relocated[stays], positions[stays])


def test_a_robot_leaves_an_obstacle_by_the_shortest_path():
    pillar = Environment("pillar", SQUARE, (CircleObstacle((4.0, 4.0), 1.0),))
    team = Team.homogeneous(1, radius=0.1)
    for angle in np.linspace(0.0, 6.0, 7):
        direction = np.array([[np.cos(angle), np.sin(angle)]])
        relocated = relocate_robots(pillar, 4.0 + 0.7 * direction, team)
        np.testing.assert_allclose(relocated, 4.0 + 1.1 * direction, atol=0.03)


def test_robots_at_one_position_are_moved_apart():
    relocated = relocate_robots(EMPTY, np.full((12, 2), 4.0), Team.homogeneous(12, radius=0.2))
    assert compute_distances(relocated).min() >= 0.4
    assert np.hypot(*(relocated - 4.0).T).max() < 2.0


def test_robots_outside_the_map_move_inside():
    relocated = relocate_robots(EMPTY, np.array([[-5.0, 4.0], [20.0, 20.0]]), Team.homogeneous(2))
    np.testing.assert_allclose(relocated, [[0.1, 4.0], [7.9, 7.9]], atol=0.01)


def test_errors_name_a_robot_without_space():
    team = replace(Team.homogeneous(2), radius=np.array([0.1, 5.0]))
    with pytest.raises(StartError, match=r"robot 2 of radius 5 m fits nowhere in map 'empty'"):
        relocate_robots(EMPTY, np.ones((2, 2)), team)
    with pytest.raises(StartError, match="have no space next to each other"):
        relocate_robots(EMPTY, np.full((40, 2), 4.0), Team.homogeneous(40, radius=1.0))


@pytest.mark.parametrize(("radius", "other_radius"), [(0.1, 0.5), (0.5, 0.1)])
def test_a_robot_that_joins_keeps_clear_of_robots_of_another_size(radius, other_radius):
    others = np.array([[4.0, 4.0]])
    radii = np.array([other_radius])
    min_distance = radius + other_radius
    too_close = (4.0 + min_distance - 0.05, 4.0)
    x, y = find_free_position(EMPTY, radius, others, too_close, radii)
    assert min_distance <= np.hypot(x - 4.0, y - 4.0) < min_distance + 0.01
    far_enough = (4.0 + min_distance + 0.01, 4.0)
    assert find_free_position(EMPTY, radius, others, far_enough, radii) == far_enough
