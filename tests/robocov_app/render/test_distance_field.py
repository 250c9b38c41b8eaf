"""Distances to the nearest robot at every pixel, and their colors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from drawn_run import HALL, ROOMS
from hypothesis import given
from hypothesis import strategies as st

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath, WallObstacle
from robocov_app.look.colors import compute_contrast, compute_luminance
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.distance_map.colors import (
    MAX_LEVEL,
    build_palette,
    choose_color_limit,
    compute_color_levels,
    compute_line_opacities,
    list_color_ticks,
)
from robocov_app.render.distance_map.pixel_distances import BorderPixels, DistanceField, DistanceFields
from robocov_app.render.distance_map.site_lattice import FieldLattice

SEALED = Environment("sealed", ((0, 0), (10, 0), (10, 6), (0, 6)), (WallObstacle(((6, 0), (6, 6)), 0.3),))


THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])


def find_largest_free_part(environment):
    """Return the largest connected part of the free space."""
    return max(environment.free.geoms, key=lambda part: part.area)


def build_field(environment, n, seed, lattice=128):
    """Return the cost on a map, and the distances to n robots at random lattice points."""
    cost = CoverageCost(environment, lattice)
    is_connected = shapely.contains_xy(find_largest_free_part(environment), *cost.points.T)
    points = cost.points[is_connected]
    positions = points[np.random.default_rng(seed).choice(len(points), n, replace=False)]
    return cost, DistanceField(FieldLattice(cost.sites), cost(positions))


def list_pixel_centers(environment, width=331):
    """Return x and y of the centers of columns and rows of pixels in m, and the size of a pixel in m."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    pixel_size = (high_x - low_x) / width
    x = low_x + (np.arange(width) + 0.5) * pixel_size
    y = np.arange(high_y - 0.5 * pixel_size, low_y, -pixel_size)
    return x, y, pixel_size


def sample_reachable_pixels(environment, x, y, count, seed):
    """Return rows and columns of random pixels that robots can reach, (count,) each."""
    columns, rows = np.meshgrid(np.arange(len(x)), np.arange(len(y)))
    is_reachable = shapely.contains_xy(find_largest_free_part(environment), x[columns], y[rows])
    chosen = np.random.default_rng(seed).choice(is_reachable.sum(), count, replace=False)
    return rows[is_reachable][chosen], columns[is_reachable][chosen]


@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda environment: environment.name)
@pytest.mark.parametrize("seed", range(4))
def test_distances_are_exact_except_next_to_shadows_of_corners(environment, seed):
    cost, field = build_field(environment, 5, seed)
    x, y, _ = list_pixel_centers(environment)
    rows, columns = sample_reachable_pixels(environment, x, y, 150, seed)
    points = np.column_stack([x[columns], y[rows]])
    exact = cost.geodesics.compute_distances(points, field.result.positions).min(axis=1)
    errors = np.abs(field.compute_distances(x, y)[rows, columns] - exact)
    assert np.quantile(errors, 0.9) < 1e-9
    assert errors.max() < 0.3 * cost.spacing


@pytest.mark.parametrize("seed", range(4))
def test_the_owner_is_the_nearest_robot(seed):
    cost, field = build_field(ROOMS, 6, seed)
    x, y, pixel_size = list_pixel_centers(ROOMS)
    owners, _ = field.compute_cells(x, y, pixel_size)
    rows, columns = sample_reachable_pixels(ROOMS, x, y, 150, seed)
    points = np.column_stack([x[columns], y[rows]])
    exact = cost.geodesics.compute_distances(points, field.result.positions)
    distances_to_owners = exact[np.arange(150), owners[rows, columns]]
    assert (distances_to_owners - exact.min(axis=1)).max() < 0.2 * cost.spacing


@pytest.mark.parametrize("seed", range(4))
def test_borders_are_equally_far_from_two_robots(seed):
    cost, field = build_field(ROOMS, 6, seed)
    x, y, pixel_size = list_pixel_centers(ROOMS)
    borders = field.compute_borders(x, y, 0.5 * pixel_size)
    is_free = shapely.contains_xy(ROOMS.free, x[borders.columns], y[borders.rows])
    chosen = np.flatnonzero(is_free)[::7]
    assert len(chosen) > 30
    points = np.column_stack([x[borders.columns[chosen]], y[borders.rows[chosen]]])
    exact = np.sort(cost.geodesics.compute_distances(points, field.result.positions), axis=1)
    differences = exact[:, 1] - exact[:, 0]
    # Away from a border, the two distances differ by at most twice the distance from the border.
    max_difference = 2.0 * borders.distances[chosen].max()
    assert differences.max() < max_difference + 0.1 * cost.spacing


@pytest.mark.parametrize("seed", range(3))
def test_every_change_of_owner_in_free_space_has_a_border(seed):
    _, field = build_field(HALL, 7, seed)
    x, y, pixel_size = list_pixel_centers(HALL)
    owners, borders = field.compute_cells(x, y, 1.5 * pixel_size)
    is_border = np.zeros(owners.shape, dtype=bool)
    is_border[borders.rows, borders.columns] = True
    points_x, points_y = np.meshgrid(x, y)
    is_open = shapely.contains_xy(HALL.free.buffer(-0.2), points_x, points_y)
    is_change = (owners[:, 1:] != owners[:, :-1]) & is_open[:, 1:] & is_open[:, :-1]
    has_border = is_border[:, 1:] | is_border[:, :-1]
    assert is_change.sum() > 50
    assert has_border[is_change].mean() > 0.99


class TestMovingObstacles:
    """An obstacle moves from (2, 1) onto the second robot, which it reaches at 4 s."""

    ROBOTS = np.array([[1.0, 3.0], [2.0, 5.0]])

    @pytest.fixture
    def fields(self):
        path = ObstaclePath(((2.0, 1.0), (2.0, 5.0)), 1.0)
        obstacle = CircleObstacle((2.0, 1.0), 0.8, path=path)
        return DistanceFields(CoverageCost(Environment("crossed", SEALED.boundary, (obstacle,)), 64), 5.0)

    def test_at_the_start_both_robots_own_points(self, fields):
        assert fields.compute_at(self.ROBOTS).result.owners.max() == 1

    def test_a_robot_inside_an_obstacle_owns_nothing(self, fields):
        field = fields.compute_at(self.ROBOTS, 4.0)
        assert set(field.result.owners.tolist()) == {0}

    def test_distances_do_not_lead_around_the_obstacle_after_it_has_moved(self, fields):
        field = fields.compute_at(self.ROBOTS, 4.0)
        distances = field.compute_distances(np.array([1.95, 2.05]), np.array([1.05, 0.95]))
        expected = np.hypot(*(np.array([1.95, 1.05]) - self.ROBOTS[0]))
        assert distances[0, 0] == pytest.approx(expected, abs=1e-9)

    def test_without_a_free_robot_there_is_no_field(self, fields):
        assert fields.compute_at(self.ROBOTS[1:], 4.0) is None


def test_no_distance_leaks_through_a_wall():
    cost = CoverageCost(SEALED, 64)
    field = DistanceFields(cost, 5.0).compute_at(np.array([[1.0, 1.0], [3.0, 5.0]]))
    x, y, _ = list_pixel_centers(SEALED)
    distances = field.compute_distances(x, y)
    owners, borders = field.compute_cells(x, y, 0.1)
    is_left_of_wall = x < 5.85 - cost.spacing
    is_right_of_wall = x > 6.15 + cost.spacing
    assert np.isfinite(distances[:, is_left_of_wall]).all()
    assert np.isinf(distances[:, is_right_of_wall]).all()
    assert (owners[:, is_right_of_wall] == -1).all()
    assert not is_right_of_wall[borders.columns].any()


def test_the_maximum_distance_is_that_of_reachable_points():
    field = DistanceFields(CoverageCost(SEALED, 64), 5.0).compute_at(np.array([[1.0, 1.0], [3.0, 5.0]]))
    is_reachable = field.result.owners >= 0
    assert field.max_distance == field.result.distances[is_reachable].max()
    assert field.max_distance < 6.0


def test_one_robot_has_no_borders():
    _, field = build_field(ROOMS, 1, 0)
    x, y, _ = list_pixel_centers(ROOMS)
    owners, borders = field.compute_cells(x, y, 10.0)
    assert len(borders.distances) == 0
    rows, columns = sample_reachable_pixels(ROOMS, x, y, 100, 0)
    assert set(owners[rows, columns].tolist()) == {0}


@pytest.mark.parametrize("lattice", [2, 3, 5])
@pytest.mark.parametrize(
    ("x", "y"),
    [
        pytest.param(np.array([3.0]), np.array([3.0]), id="one pixel"),
        pytest.param(np.array([0.0, 14.0]), np.array([11.0, 0.0]), id="corners"),
        pytest.param(np.linspace(-5, 20, 9), np.array([2.0]), id="beyond the map"),
    ],
)
def test_coarse_lattices_and_few_pixels_are_possible(lattice, x, y):
    _, field = build_field(HALL, 1, 0, lattice)
    distances = field.compute_distances(x, y)
    owners, _ = field.compute_cells(x, y, 1.0)
    assert distances.shape == owners.shape == (len(y), len(x))
    assert np.isfinite(distances).all()


@THEMES
def test_colors_become_stronger_with_the_distance(theme):
    luminance = np.array([compute_luminance(tuple(color)) for color in theme.build_heat_table(254).tolist()])
    sign = 1 if theme is DARK else -1
    assert (sign * np.diff(luminance) >= -1e-3).all()


@THEMES
def test_tenths_of_the_color_scale_can_be_told_apart(theme):
    tenths = [tuple(color) for color in theme.build_heat_table(11).tolist()]
    assert min(compute_contrast(one, other) for one, other in pairwise(tenths)) > 1.08


@THEMES
def test_the_color_scale_begins_near_the_background_and_ends_far_from_it(theme):
    tenths = [tuple(color) for color in theme.build_heat_table(11).tolist()]
    assert compute_contrast(tenths[0], theme.background) < 1.1
    assert compute_contrast(tenths[-1], theme.background) > 7.0


@given(st.floats(1e-3, 1e5))
def test_color_scales_end_not_far_beyond_the_maximum_distance(distance):
    limit = choose_color_limit(distance)
    assert distance * (1 - 1e-9) <= limit <= 1.51 * distance


@given(st.floats(1e-3, 1e5))
def test_color_scales_have_few_equidistant_ticks_with_one_at_each_end(distance):
    limit = choose_color_limit(distance)
    ticks = list_color_ticks(limit)
    assert ticks[0] == 0.0
    assert ticks[-1] == pytest.approx(limit)
    assert 3 <= len(ticks) <= 6
    assert np.ptp(np.diff(ticks)) <= 1e-9 * limit


def test_color_levels_are_proportional_to_distances_up_to_the_limit():
    limit = 5.0
    cost = CoverageCost(ROOMS, 64)
    field = DistanceField(FieldLattice(cost.sites), cost(np.array([[2.0, 2.0]])))
    x = np.linspace(0.1, 15.9, 60)
    y = np.linspace(9.9, 0.1, 40)
    distances = field.compute_distances(x, y)
    levels = compute_color_levels(field, x, y, limit, 9)
    is_near = distances < limit
    is_far = np.isfinite(distances) & ~is_near
    expected = distances[is_near] / limit * MAX_LEVEL
    np.testing.assert_allclose(levels[is_near], expected, atol=1.0)
    assert levels[is_near].max() <= MAX_LEVEL
    assert is_far.any()
    assert (levels[is_far] == MAX_LEVEL).all()


def test_unreachable_areas_are_hatched():
    cost = CoverageCost(ROOMS, 32)
    field = DistanceField(FieldLattice(cost.sites), cost(np.array([[2.0, 2.0]])))
    x_in_courtyard = np.linspace(1.8, 3.2, 50)
    y_in_courtyard = np.linspace(8.6, 7.8, 30)
    levels = compute_color_levels(field, x_in_courtyard, y_in_courtyard, 5.0, 9)
    is_hatch_line = levels == MAX_LEVEL + 2
    assert set(np.unique(levels)) == {MAX_LEVEL + 1, MAX_LEVEL + 2}
    assert 0.05 < is_hatch_line.mean() < 0.2


@THEMES
def test_the_palette_contains_the_color_of_unreachable_areas(theme):
    palette = build_palette(theme)
    assert palette.shape == (256, 3)
    assert tuple(palette[MAX_LEVEL + 1]) == theme.unreached


def test_border_lines_have_the_requested_width_and_are_smooth():
    zoom = 50.0
    width_px = 3.0
    distances = np.linspace(0.0, 0.1, 1001)
    indices = np.zeros(1001, dtype=np.intp)
    borders = BorderPixels(indices, indices, indices, distances)
    opacities = compute_line_opacities(borders, zoom=zoom, width=width_px)
    assert opacities[0] == 1.0
    assert opacities[distances * zoom > 2.0].max() == 0.0
    pixels_per_sample = distances[1] * zoom
    assert opacities.sum() * pixels_per_sample == pytest.approx(width_px / 2, abs=0.01)
