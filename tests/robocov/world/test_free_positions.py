from __future__ import annotations

import numpy as np
import pytest
import shapely
from drawn_maps import KINDS, drawn_map
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robocov.controllers import Rapf
from robocov.environment import CircleObstacle, Environment
from robocov.errors import StartError
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.world.free_positions import find_free_position, relocate_robots

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
EMPTY = Environment("empty", SQUARE)


@settings(max_examples=80)
@given(
    st.sampled_from(sorted(KINDS)),
    st.integers(1, 12),
    st.integers(0, 2**32),
    st.integers(1, 15),
    st.booleans(),
)
def test_all_robots_fit_and_whoever_did_stays(kind, count, seed, robots, crowded):
    environment = drawn_map(kind, count, seed)
    assume(environment is not None)
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.0, 8.0, (robots, 2)) * (0.1 if crowded else 1.0) + (4.0 if crowded else 0.0)
    team = Team.homogeneous(robots, radius=0.05)
    moved = relocate_robots(environment, places, team)
    # the simulation takes them as they are
    Simulation(environment, Rapf(), moved, team)
    wall = shapely.distance(environment.free.boundary, shapely.points(places))
    inside = shapely.contains_properly(environment.free, shapely.points(places))
    table = np.hypot(*(places[:, None] - places).transpose(2, 0, 1)) + 10.0 * np.eye(robots)
    alone = inside & (wall >= 0.05) & (table.min(axis=1) > 2.0)
    np.testing.assert_array_equal(moved[alone], places[alone])


def test_a_robot_leaves_an_obstacle_by_the_shortest_way():
    where = Environment("pillar", SQUARE, (CircleObstacle((4.0, 4.0), 1.0),))
    team = Team.homogeneous(1, radius=0.1)
    for angle in np.linspace(0.0, 6.0, 7):
        along = np.array([np.cos(angle), np.sin(angle)])
        (moved,) = relocate_robots(where, (4.0 + 0.7 * along)[None], team)
        np.testing.assert_allclose(moved, 4.0 + 1.1 * along, atol=0.03)


def test_robots_in_one_place_make_room_for_each_other():
    moved = relocate_robots(EMPTY, np.full((12, 2), 4.0), Team.homogeneous(12, radius=0.2))
    table = np.hypot(*(moved[:, None] - moved).transpose(2, 0, 1)) + 10.0 * np.eye(12)
    assert table.min() >= 0.4
    assert np.hypot(*(moved - 4.0).T).max() < 2.0


def test_robots_outside_come_in():
    moved = relocate_robots(EMPTY, np.array([[-5.0, 4.0], [20.0, 20.0]]), Team.homogeneous(2))
    np.testing.assert_allclose(moved, [[0.1, 4.0], [7.9, 7.9]], atol=0.01)


def test_where_there_is_no_room_a_robot_is_named():
    with pytest.raises(StartError, match=r"robot 2 of radius 5 m fits nowhere in map 'empty'"):
        relocate_robots(EMPTY, np.ones((2, 2)), Team(**_radii([0.1, 5.0])))
    with pytest.raises(StartError, match="have no room next to each other"):
        relocate_robots(EMPTY, np.full((40, 2), 4.0), Team.homogeneous(40, radius=1.0))


@pytest.mark.parametrize(("radius", "other_radius"), [(0.1, 0.5), (0.5, 0.1)])
def test_a_robot_that_joins_keeps_clear_of_robots_of_another_size(radius, other_radius):
    others = np.array([[4.0, 4.0]])
    radii = np.array([other_radius])
    expected_distance = radius + other_radius
    too_close = (4.0 + expected_distance - 0.05, 4.0)
    x, y = find_free_position(EMPTY, radius, others, too_close, radii)
    assert expected_distance <= np.hypot(x - 4.0, y - 4.0) < expected_distance + 0.01
    far_enough = (4.0 + expected_distance + 0.01, 4.0)
    assert find_free_position(EMPTY, radius, others, far_enough, radii) == far_enough


def _radii(radii):
    team = Team.homogeneous(len(radii))
    return {**{name: getattr(team, name) for name in team.__dataclass_fields__}, "radius": np.array(radii)}
