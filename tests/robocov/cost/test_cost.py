"""The coverage cost: known values, sites, components without a robot, gradients and messages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from cost_cases import CUP, L_ROOM, OFFICE, PILLAR, build_environment, build_ring
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle, WallObstacle
from robocov.errors import InputError, ParameterError


@pytest.mark.parametrize(
    ("environment", "positions", "expected"),
    [
        (PILLAR, [[1 / 8, 1 / 2]], 0.485117942024),
        (PILLAR, [[1 / 8, 1 / 2], [7 / 8, 1 / 2]], 0.298875152962),
        (CUP, [[1 / 2, 1 / 2]], 0.576781074789),
    ],
)
def test_distances_add_up_to_known_sums(environment, positions, expected):
    cost = CoverageCost(environment, lattice=64)
    assert cost(positions).distances.sum() * cost.spacing**2 == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("environment", "position", "expected"),
    [
        (build_environment(), [1 / 2, 1 / 2], 0.382597858232),
        (L_ROOM, [1 / 2, 1 / 2], 0.286948393674),
        (L_ROOM, [1 / 2, 1], 0.517266172593),
    ],
)
def test_the_value_tends_to_the_integral_with_the_square_of_the_spacing(environment, position, expected):
    errors = [abs(CoverageCost(environment, lattice=n)([position]).value - expected) for n in (32, 64, 128)]
    assert errors[-1] < 1e-5
    assert errors[0] > 3 * errors[1] > 9 * errors[2]


def test_sites_are_the_free_cell_centers_of_the_square_over_the_bounding_box():
    environment = build_environment(build_ring(2, 1, 4, 2), boundary=((1, 1), (5, 1), (5, 3), (1, 3)))
    cost = CoverageCost(environment, lattice=8)
    assert cost.spacing == 0.5
    expected = [
        (x, y)
        for y in np.arange(1.25, 5, 0.5)
        for x in np.arange(1.25, 5, 0.5)
        if y < 3 and not (2 < x < 4 and y < 2)
    ]
    np.testing.assert_array_equal(cost.points, expected)
    np.testing.assert_array_equal(cost.cells, [round((x - 1.25) * 2 + (y - 1.25) * 16) for x, y in expected])


def test_sites_on_walls_are_left_out():
    environment = build_environment(build_ring(1, 0, 3, 2), boundary=build_ring(0, 0, 4, 4))
    assert CoverageCost(environment, lattice=4).points.tolist() == [
        *([0.5, 0.5], [3.5, 0.5], [0.5, 1.5], [3.5, 1.5]),
        *([x, y] for y in (2.5, 3.5) for x in (0.5, 1.5, 2.5, 3.5)),
    ]
    shifted = build_environment(build_ring(0.5, 0, 3, 2.5), boundary=build_ring(0, 0, 4, 4))
    assert CoverageCost(shifted, lattice=4).points.tolist() == [
        *([3.5, 0.5], [3.5, 1.5], [3.5, 2.5]),
        *([x, 3.5] for x in (0.5, 1.5, 2.5, 3.5)),
    ]


def test_rooms_without_a_robot_are_reported_as_uncovered():
    environment = build_environment(build_ring(3, 0, 4, 8), boundary=build_ring(0, 0, 8, 8))
    cost = CoverageCost(environment, lattice=16)
    left = cost([[1.0, 1.0]])
    both = cost([[1.0, 1.0], [6.0, 6.0]])
    assert left.uncovered_area == pytest.approx(32.0)
    assert both.uncovered_area == 0.0
    in_left = cost.points[:, 0] < 3.0
    np.testing.assert_array_equal(np.isfinite(left.distances), in_left)
    np.testing.assert_array_equal(left.owners, np.where(in_left, 0, -1))
    assert (left.first_corners[~in_left] == -1).all()
    assert left.mean_distance == left.distances[in_left].mean()
    assert left.value == pytest.approx(left.mean_distance * 24.0)
    assert both.value == pytest.approx(both.distances.mean() * 56.0)


def test_a_room_too_small_for_a_site_has_no_mean():
    environment = build_environment(
        build_ring(0.5, 0.5, 3, 8), build_ring(0, 0.5, 1, 1), boundary=build_ring(0, 0, 8, 8)
    )
    tiny = Environment(
        "tiny", environment.boundary, (*environment.obstacles, PolygonObstacle(build_ring(0.125, 0, 1, 1)))
    )
    cost = CoverageCost(tiny, lattice=4)
    result = cost([[0.05, 0.05]])
    assert np.isnan(result.mean_distance)
    assert np.isnan(result.value)
    assert (result.owners == -1).all()
    assert result.gradient.tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_owner_and_distance_agree_with_the_matrix_of_all_distances(n):
    cost = CoverageCost(OFFICE, lattice=24)
    robots = cost.points[np.random.default_rng(n).choice(len(cost.points), n)]
    result = cost(robots)
    distances = cost.geodesics.compute_distances(robots, cost.points)
    np.testing.assert_allclose(result.distances, distances.min(axis=0), rtol=0, atol=1e-12)
    distances_of_owners = distances[result.owners, np.arange(len(cost.points))]
    np.testing.assert_allclose(distances_of_owners, result.distances, rtol=0, atol=1e-12)


def test_first_waypoints_are_those_of_the_shortest_paths():
    cost = CoverageCost(OFFICE, lattice=12)
    robots = np.array([[1.0, 1.0], [11.0, 1.0]])
    result = cost(robots)
    for site in range(len(cost.points)):
        path = cost.find_path(robots, cost.points[site])
        np.testing.assert_allclose(path[-1], robots[result.owners[site]], atol=1e-12)
        np.testing.assert_allclose(path[-2], result.first_waypoints[site], atol=1e-12)


@pytest.mark.parametrize(
    ("point", "robot", "bends"),
    [
        ([1.0, 3.0], [4.0, 4.0], []),
        ([4.0, 4.0], [1.0, 3.0], []),
        ([5.0, 4.0], [6.0, 4.0], []),
        ([1.0, 3.0], [6.0, 4.0], [[4.0, 4.0]]),
        ([4.0, 4.0], [4.0, 4.0], []),
    ],
)
def test_each_waypoint_occurs_once_if_an_end_of_a_path_is_a_corner(point, robot, bends):
    square = PolygonObstacle(((4.0, 2.0), (6.0, 2.0), (6.0, 4.0), (4.0, 4.0)))
    hall = Environment("hall", ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)), (square,))
    path = CoverageCost(hall, lattice=4).find_path(np.array([robot]), np.array(point))
    assert path.tolist() == [point, *bends, robot]


def test_the_gradient_is_that_of_the_value():
    cost = CoverageCost(OFFICE, lattice=40)
    rng = np.random.default_rng(8)
    robots = rng.uniform((0, 0), (12, 8), (60, 2))
    robots = robots[shapely.contains_xy(OFFICE.free.buffer(-0.05), *robots.T)][:6]
    gradient = cost(robots).gradient
    step = 1e-6
    for i in range(len(robots)):
        for k in range(2):
            shift = np.zeros_like(robots)
            shift[i, k] = step
            slope = (cost(robots + shift).value - cost(robots - shift).value) / (2 * step)
            assert slope == pytest.approx(gradient[i, k], abs=1e-5 * cost(robots).value)
    assert np.abs(gradient).max() > 1.0


positions = st.lists(
    st.tuples(st.integers(0, 48), st.integers(0, 32)).map(lambda p: (p[0] / 4, p[1] / 4)),
    min_size=1,
    max_size=8,
).map(lambda points: [p for p in points if shapely.intersects_xy(OFFICE.free, *p)])


@settings(max_examples=count_examples(40), deadline=None)
@given(positions.filter(bool), st.randoms(use_true_random=False))
def test_order_and_repetition_of_robots_do_not_matter(robots, random):
    cost = CoverageCost(OFFICE, lattice=10)
    result = cost(robots)
    shuffled = [*robots, *robots]
    random.shuffle(shuffled)
    np.testing.assert_array_equal(cost(shuffled).distances, result.distances)
    if len(robots) > 1:
        assert (cost(robots[1:]).distances >= result.distances - 1e-12).all()


def test_results_do_not_depend_on_earlier_calls():
    rng = np.random.default_rng(0)
    cost = CoverageCost(OFFICE, lattice=32)
    teams = [cost.points[rng.choice(len(cost.points), 5)] for _ in range(6)]
    results = [cost(team) for team in teams]
    other_cost = CoverageCost(OFFICE, lattice=32)
    other_results = [other_cost(team) for team in reversed(teams)]
    for result, other in zip(results, reversed(other_results), strict=True):
        assert result.value == other.value
        for name in ("distances", "owners", "first_waypoints", "gradient"):
            np.testing.assert_array_equal(getattr(result, name), getattr(other, name))


@pytest.mark.parametrize(("scale", "shift"), [(1e-2, (0, 0)), (1e3, (5e5, -4e6)), (1.0, (-77.7, 31.1))])
def test_the_cost_scales_and_moves_with_the_map(scale, shift):
    rings = [build_ring(2, 0, 3, 5), ((4.03, 8), (5.01, 3), (6.1, 8))]
    robots = np.array([[1.0, 1.0], [7.0, 7.0], [3.5, 2.0]])
    original = CoverageCost(build_environment(*rings, boundary=build_ring(0, 0, 8, 8)), lattice=32)(robots)

    def transform(ring):
        return tuple(map(tuple, (np.array(ring) * scale + shift).tolist()))

    transformed = build_environment(*map(transform, rings), boundary=transform(build_ring(0, 0, 8, 8)))
    result = CoverageCost(transformed, lattice=32)(robots * scale + shift)
    # Coordinates are rounded to a grid of a micrometer.
    assert result.mean_distance == pytest.approx(
        original.mean_distance * scale, rel=1e-4 if scale < 1 else 1e-7
    )


def test_coincident_robots_give_the_site_to_the_first():
    result = CoverageCost(PILLAR, lattice=16)([[0.1, 0.1], [0.9, 0.9], [0.1, 0.1], [0.9, 0.9]])
    assert set(result.owners.tolist()) == {0, 1}


def test_errors_name_robots_outside_the_free_space():
    cost = CoverageCost(PILLAR, lattice=8)
    with pytest.raises(
        InputError, match=r"positions\[1\]: .*, got \[0.5, 0.5\], 0.125 m outside the free space"
    ):
        cost([[0.1, 0.1], [0.5, 0.5]])


def test_a_cost_and_a_path_require_a_robot():
    cost = CoverageCost(PILLAR, lattice=8)
    for positions in ([], np.empty((0, 2))):
        with pytest.raises(InputError, match="positions: expected at least one robot, got none"):
            cost(positions)
        with pytest.raises(InputError, match="positions: expected at least one robot, got none"):
            cost.find_path(positions, np.array([0.1, 0.1]))


def test_a_path_requires_a_point():
    with pytest.raises(InputError, match=r"point: expected \[x, y\] in meters, got 'x'"):
        CoverageCost(PILLAR, lattice=8).find_path([[0.1, 0.1]], "x")


@pytest.mark.parametrize("lattice", [0, -3, 1.5, True, 5000, "64", None])
def test_the_lattice_must_be_a_whole_number_in_range(lattice):
    with pytest.raises(ParameterError, match=r"lattice: .* whole number from 1 to 4096"):
        CoverageCost(PILLAR, lattice=lattice)


def test_building_reports_progress_and_can_be_canceled():
    fractions = []
    CoverageCost(OFFICE, lattice=64, progress=fractions.append)
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] <= fractions[-1] < 1.0

    def cancel(fraction):
        raise InterruptedError

    with pytest.raises(InterruptedError):
        CoverageCost(OFFICE, lattice=64, progress=cancel)


def test_sealed_rooms_without_a_corner():
    """The robot that is nearest in a straight line may be behind the wall, and no path bends."""
    environment = build_environment(build_ring(3, 0, 5, 8), boundary=((0, 0), (8, 0), (8, 8), (0, 8)))
    cost = CoverageCost(environment, lattice=16)
    assert len(cost.corners) == 0
    robots = np.array([[2.9, 4.0], [7.0, 7.0]])
    result = cost(robots)
    is_left = cost.points[:, 0] < 4.0
    np.testing.assert_array_equal(result.owners, np.where(is_left, 0, 1))
    expected = np.hypot(*(cost.points - robots[result.owners]).T)
    np.testing.assert_allclose(result.distances, expected, rtol=0, atol=1e-12)
    result = cost(robots[:1])
    assert result.uncovered_area == pytest.approx(24.0)
    np.testing.assert_array_equal(result.owners, np.where(is_left, 0, -1))


def test_results_have_a_short_repr(empty: Environment) -> None:
    result = CoverageCost(empty, 16)([[5.0, 5.0]])
    assert repr(result) == f"<CoverageResult 1 robot, mean distance {result.mean_distance:.3f} m>"
    split = replace(empty, obstacles=(WallObstacle(((5.0, -1.0), (5.0, 11.0)), 0.1),))
    result = CoverageCost(split, 16)([[1.0, 5.0]])
    assert repr(result).endswith(f" m, {result.uncovered_area:.3f} m² uncovered>")
