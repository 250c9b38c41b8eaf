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


def build_field(environment, n, seed, lattice=128):
    cost = CoverageCost(environment, lattice)
    hall = max(environment.free.geoms, key=lambda part: part.area)
    points = cost.points[shapely.contains_xy(hall, *cost.points.T)]
    positions = points[np.random.default_rng(seed).choice(len(points), n, replace=False)]
    return cost, DistanceField(FieldLattice(cost.sites), cost(positions))


def list_pixel_centers(environment, width=331):
    """Return the middles of pixels, x to the right and y down."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    step = (high_x - low_x) / width
    x = low_x + (np.arange(width) + 0.5) * step
    return x, np.arange(high_y - 0.5 * step, low_y, -step), step


def sample_free_pixels(environment, x, y, count, seed):
    """Return rows and columns of pixels that robots can reach."""
    columns, rows = np.meshgrid(np.arange(len(x)), np.arange(len(y)))
    hall = max(environment.free.geoms, key=lambda part: part.area)
    free = shapely.contains_xy(hall, x[columns], y[rows])
    chosen = np.random.default_rng(seed).choice(free.sum(), count, replace=False)
    return rows[free][chosen], columns[free][chosen]


@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda map_: map_.name)
@pytest.mark.parametrize("seed", range(4))
def test_distances_are_the_exact_ones(environment, seed):
    cost, field = build_field(environment, 5, seed)
    x, y, _ = list_pixel_centers(environment)
    row, column = sample_free_pixels(environment, x, y, 150, seed)
    places = np.column_stack([x[column], y[row]])
    exact = cost.geodesics.compute_distances(places, field.result.positions).min(axis=1)
    error = np.abs(field.compute_distances(x, y)[row, column] - exact)
    # nearly everywhere to rounding; beside shadows of corners by far less than the lattice's step
    assert np.quantile(error, 0.9) < 1e-9
    assert error.max() < 0.3 * cost.spacing


@pytest.mark.parametrize("seed", range(4))
def test_the_owner_is_the_nearest_robot(seed):
    cost, field = build_field(ROOMS, 6, seed)
    x, y, step = list_pixel_centers(ROOMS)
    owner, _ = field.compute_cells(x, y, step)
    row, column = sample_free_pixels(ROOMS, x, y, 150, seed)
    exact = cost.geodesics.compute_distances(np.column_stack([x[column], y[row]]), field.result.positions)
    chosen = exact[np.arange(150), owner[row, column]]
    assert (chosen - exact.min(axis=1)).max() < 0.2 * cost.spacing


@pytest.mark.parametrize("seed", range(4))
def test_borders_are_equally_far_from_two_robots(seed):
    cost, field = build_field(ROOMS, 6, seed)
    x, y, step = list_pixel_centers(ROOMS)
    borders = field.compute_borders(x, y, 0.5 * step)
    free = shapely.contains_xy(ROOMS.free, x[borders.columns], y[borders.rows])
    chosen = np.nonzero(free)[0][::7]
    places = np.column_stack([x[borders.columns[chosen]], y[borders.rows[chosen]]])
    exact = np.sort(cost.geodesics.compute_distances(places, field.result.positions), axis=1)
    # two distances grow apart by at most twice the way to the border
    assert len(chosen) > 30
    assert (exact[:, 1] - exact[:, 0]).max() < 2.0 * borders.distances[chosen].max() + 0.1 * cost.spacing


@pytest.mark.parametrize("seed", range(3))
def test_every_change_of_owner_in_the_open_has_a_border(seed):
    _, field = build_field(HALL, 7, seed)
    x, y, step = list_pixel_centers(HALL)
    owner, borders = field.compute_cells(x, y, 1.5 * step)
    marked = np.zeros(owner.shape, dtype=bool)
    marked[borders.rows, borders.columns] = True
    columns, rows = np.meshgrid(x, y)
    open_ = shapely.contains_xy(HALL.free.buffer(-0.2), columns, rows)
    changes = (owner[:, 1:] != owner[:, :-1]) & open_[:, 1:] & open_[:, :-1]
    assert changes.sum() > 50
    assert (marked[:, 1:] | marked[:, :-1])[changes].mean() > 0.99


def test_fields_with_moving_obstacles_depend_on_time():
    path = ObstaclePath(((2.0, 1.0), (2.0, 5.0)), 1.0)
    crossed = Environment("crossed", SEALED.boundary, (CircleObstacle((2.0, 1.0), 0.8, path=path),))
    fields = DistanceFields(CoverageCost(crossed, 64), 5.0)
    robots = np.array([[1.0, 3.0], [2.0, 5.0]])
    x = np.array([1.95, 2.05])
    y = np.array([1.05, 0.95])
    assert fields.compute_at(robots).result.owners.max() == 1
    # at four seconds it stands on the second robot, where the other cannot be either
    later = fields.compute_at(robots, 4.0)
    assert set(later.result.owners.tolist()) == {0}
    exact = np.hypot(*(np.array([1.95, 1.05]) - robots[0]))
    assert later.compute_distances(x, y)[0, 0] == pytest.approx(exact, abs=1e-9)
    assert fields.compute_at(robots[1:], 4.0) is None


def test_no_distance_leaks_through_a_wall():
    cost = CoverageCost(SEALED, 64)
    field = DistanceFields(cost, 5.0).compute_at(np.array([[1.0, 1.0], [3.0, 5.0]]))
    x, y, _ = list_pixel_centers(SEALED)
    distance = field.compute_distances(x, y)
    owner, borders = field.compute_cells(x, y, 0.1)
    closed = x > 6.15 + cost.spacing
    assert np.isinf(distance[:, closed]).all()
    assert (owner[:, closed] == -1).all()
    opened = x < 5.85 - cost.spacing
    assert np.isfinite(distance[:, opened]).all()
    assert not closed[borders.columns].any()
    reached = field.result.distances[field.result.owners >= 0]
    assert field.max_distance == reached.max() < 6.0


def test_one_robot_has_no_borders():
    _, field = build_field(ROOMS, 1, 0)
    x, y, _ = list_pixel_centers(ROOMS)
    owner, borders = field.compute_cells(x, y, 10.0)
    assert len(borders.distances) == 0
    row, column = sample_free_pixels(ROOMS, x, y, 100, 0)
    assert set(owner[row, column].tolist()) == {0}


@pytest.mark.parametrize("lattice", [2, 3, 5])
def test_coarse_lattices_and_single_pixels(lattice):
    _, field = build_field(HALL, 1, 0, lattice)
    for x, y in (([3.0], [3.0]), ([0.0, 14.0], [11.0, 0.0]), (np.linspace(-5, 20, 9), [2.0])):
        distance = field.compute_distances(np.array(x, dtype=float), np.array(y, dtype=float))
        assert distance.shape == (len(y), len(x))
        assert np.isfinite(distance).all()
        assert (
            field.compute_cells(np.array(x, dtype=float), np.array(y, dtype=float), 1.0)[0].shape
            == distance.shape
        )


THEMES = [LIGHT, DARK]


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
def test_colors_change_monotonically_away_from_the_background(theme):
    brightness = np.array([compute_luminance(tuple(color)) for color in theme.build_heat_table(254).tolist()])
    steps = np.diff(brightness) * (1 if theme is DARK else -1)
    assert (steps >= -1e-3).all()
    # every tenth of the scale can be told from the next
    tenths = [tuple(color) for color in theme.build_heat_table(11).tolist()]
    assert min(compute_contrast(one, two) for one, two in pairwise(tenths)) > 1.08
    assert compute_contrast(tenths[0], theme.background) < 1.1
    assert compute_contrast(tenths[-1], theme.background) > 7.0


@given(st.floats(1e-3, 1e5))
def test_scales_end_at_round_lengths_not_far_beyond(distance):
    limit = choose_color_limit(distance)
    assert distance * (1 - 1e-9) <= limit <= 1.51 * distance
    marks = list_color_ticks(limit)
    assert marks[0] == 0.0
    assert marks[-1] == pytest.approx(limit)
    assert 3 <= len(marks) <= 6
    assert np.ptp(np.diff(marks)) <= 1e-9 * limit


def test_levels_follow_the_distances_up_to_the_limit():
    cost = CoverageCost(ROOMS, 64)
    field = DistanceField(FieldLattice(cost.sites), cost(np.array([[2.0, 2.0]])))
    x = np.linspace(0.1, 15.9, 60)
    y = np.linspace(9.9, 0.1, 40)
    distance = field.compute_distances(x, y)
    level = compute_color_levels(field, x, y, 5.0, 9)
    assert (level[np.isfinite(distance)] <= MAX_LEVEL).all()
    assert (level[np.isfinite(distance) & (distance >= 5.0)] == MAX_LEVEL).all()
    near = distance < 5.0
    np.testing.assert_allclose(level[near] / MAX_LEVEL * 5.0, distance[near], atol=5.0 / MAX_LEVEL)


def test_unreachable_areas_are_hatched():
    cost = CoverageCost(ROOMS, 32)
    field = DistanceField(FieldLattice(cost.sites), cost(np.array([[2.0, 2.0]])))
    courtyard = compute_color_levels(field, np.linspace(1.8, 3.2, 50), np.linspace(8.6, 7.8, 30), 5.0, 9)
    assert set(np.unique(courtyard)) == {MAX_LEVEL + 1, MAX_LEVEL + 2}
    assert 0.05 < (courtyard == MAX_LEVEL + 2).mean() < 0.2
    for theme in THEMES:
        colors = build_palette(theme)
        assert colors.shape == (256, 3)
        assert tuple(colors[MAX_LEVEL + 1]) == theme.unreached


def test_lines_have_the_requested_width_and_are_smooth():
    gap = np.linspace(0.0, 0.1, 1001)
    none = np.zeros(1001, dtype=np.intp)
    part = compute_line_opacities(BorderPixels(none, none, none, gap), zoom=50.0, width=3.0)
    assert part[0] == 1.0
    assert part[gap * 50 > 2.0].max() == 0.0
    # half its width on this side
    assert part.sum() * (gap[1] * 50) == pytest.approx(1.5, abs=0.01)
