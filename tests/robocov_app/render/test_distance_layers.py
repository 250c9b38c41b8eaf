"""Layers that show geodesic distances and cells, and their color scale."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
import shapely
from drawn_pixels import list_legend_texts
from drawn_run import HALL, ROOMS, build_row_scene, record_walk

from robocov.cost import CoverageCost
from robocov.errors import ParameterError
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.canvas import Canvas
from robocov_app.render.distance_map.colors import MAX_LEVEL, build_palette
from robocov_app.render.distance_map.pixel_distances import DistanceField, DistanceFields
from robocov_app.render.distance_map.site_lattice import FieldLattice
from robocov_app.render.layer_catalog import check_layer_names
from robocov_app.render.layers import distances
from robocov_app.render.painter import Painter

SIZE = (560, 364)


def build_field_scene(environment=ROOMS, n=5, seed=0, limit=8.0):
    """Return the cost on a map, and a scene with the distances of n robots up to a limit, m."""
    record = record_walk(environment, n, seed=seed)
    cost = CoverageCost(environment, 128)
    positions = environment.start("spread").sample(n, seed + 1000)
    field = DistanceField(FieldLattice(cost.sites), cost(positions))
    return cost, replace(build_row_scene(record), field=field, field_limit=limit)


def paint_layers(scene, *names, theme=LIGHT, size=SIZE):
    """Return the image of some layers of a scene, and its painter."""
    painter = Painter(scene.environment, size, theme)
    painter.show_only(names)
    return painter.render_frame(scene).astype(int), painter


def sample_free_pixels(painter, environment, count, seed=0):
    """Return random pixels well inside the free space, (count, 2), and their positions, (count, 2) m."""
    rng = np.random.default_rng(seed)
    bounds = environment.region.bounds
    interior = environment.free.buffer(-0.15)
    pixels = []
    points = []
    while len(pixels) < count:
        pixel = np.rint(painter.camera.to_pixels(rng.uniform(bounds[:2], bounds[2:])))
        point = painter.camera.to_world(pixel)
        if shapely.contains_xy(interior, *point):
            pixels.append(pixel)
            points.append(point)
    return np.array(pixels).astype(int), np.array(points)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda environment: environment.name)
def test_colors_are_those_of_the_exact_distances(environment, theme):
    cost, scene = build_field_scene(environment)
    frame, painter = paint_layers(scene, "distances", theme=theme)
    pixels, points = sample_free_pixels(painter, environment, 150)
    exact = cost.geodesics.compute_distances(points, scene.field.result.positions).min(axis=1)
    is_reachable = np.isfinite(exact)
    levels = np.minimum(exact[is_reachable] / 8.0 * MAX_LEVEL, MAX_LEVEL).astype(int)
    expected = build_palette(theme)[levels].astype(int)
    colors = frame[pixels[is_reachable, 1], pixels[is_reachable, 0]]
    assert is_reachable.sum() > 100
    assert np.abs(colors - expected).max(axis=1).max() <= 6
    assert np.median(np.abs(colors - expected).max(axis=1)) <= 1


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
def test_no_color_leaves_the_free_space(theme):
    _, scene = build_field_scene(HALL)
    frame, painter = paint_layers(scene, "distances", "geodesic_cells", "obstacles", theme=theme)
    rows, columns = np.indices(frame.shape[:2])
    points = painter.camera.to_world(np.stack([columns, rows], axis=-1).astype(float))
    is_outside = ~shapely.contains_xy(HALL.region.polygon.buffer(0.1), points[..., 0], points[..., 1])
    assert (frame[is_outside] == theme.background).all()
    is_blocked = shapely.contains_xy(HALL.blocked.buffer(-0.1), points[..., 0], points[..., 1])
    assert is_blocked.sum() > 1000
    assert (frame[is_blocked] == theme.obstacle).all()


@pytest.mark.parametrize("n", [4, 14])
def test_geodesic_cells_have_the_tint_of_the_nearest_robot(n):
    cost, scene = build_field_scene(n=n, seed=2)
    frame, painter = paint_layers(scene, "geodesic_cells")
    pixels, points = sample_free_pixels(painter, ROOMS, 200)
    exact = cost.geodesics.compute_distances(points, scene.field.result.positions)
    nearest, second_nearest = np.sort(exact, axis=1)[:, :2].T
    # Pixels that no robot can reach have infinite distances, which are not greater than themselves.
    is_far_from_borders = second_nearest > nearest + 0.3
    assert is_far_from_borders.sum() > 80
    owners = exact[is_far_from_borders].argmin(axis=1)
    for (x, y), robot in zip(pixels[is_far_from_borders], owners, strict=True):
        assert tuple(frame[y, x]) == LIGHT.get_cell_color(int(painter._hues[robot]))


def test_borders_are_drawn_only_between_owners():
    cost, scene = build_field_scene(seed=4)
    frame, painter = paint_layers(scene, "geodesic_cells", "distances")
    frame_without_borders, _ = paint_layers(scene, "distances")
    is_line = np.abs(frame - frame_without_borders).max(axis=2) > 60
    rows, columns = np.nonzero(is_line)
    assert len(rows) > 200
    every_few = slice(None, None, len(rows) // 60)
    points = painter.camera.to_world(np.column_stack([columns, rows])[every_few].astype(float))
    is_free = shapely.contains_xy(ROOMS.free, *points.T)
    exact = np.sort(cost.geodesics.compute_distances(points[is_free], scene.field.result.positions), axis=1)
    # The two nearest robots are equally far from a border.
    assert (exact[:, 1] - exact[:, 0]).max() < 3.0 / painter.camera.zoom


def test_voronoi_cells_are_only_lines_on_top_of_distances():
    _, scene = build_field_scene()
    frame_with_cells, _ = paint_layers(scene, "distances", "cells")
    frame, _ = paint_layers(scene, "distances")
    is_different = np.abs(frame_with_cells - frame).max(axis=2) > 0
    assert 0.001 < is_different.mean() < 0.05


def test_without_a_field_nothing_is_drawn():
    _, scene_with_field = build_field_scene()
    scene = replace(scene_with_field, field=None)
    frame, painter = paint_layers(scene, "distances", "geodesic_cells", "color_bar", "legend")
    assert (frame == LIGHT.background).all()
    assert list_legend_texts(painter, scene) == []


def test_the_legend_explains_the_distance_layers():
    _, scene = build_field_scene()
    painter = Painter(ROOMS, SIZE)
    painter.change_visible(["distances", "geodesic_cells"], ["cells"])
    labels = list_legend_texts(painter, scene)
    assert labels[:3] == ["distance to the nearest robot", "unreachable", "geodesic cell border"]
    assert "Voronoi cell" not in labels


@pytest.mark.parametrize(
    "size", [(480, 360), *(pytest.param(size, marks=pytest.mark.slow) for size in ((900, 600), (1920, 1080)))]
)
@pytest.mark.parametrize("limit", [0.8, 8.0, 15.0, 2500.0])
def test_the_color_scale_is_complete_and_next_to_the_map(size, limit):
    _, scene = build_field_scene(limit=limit)
    frame, painter = paint_layers(scene, "distances", "color_bar", "boundary", "status", size=size)
    right_edge, _ = painter.camera.to_pixels(np.array([16.0, 0.0]))
    right_of_map = frame[:, int(np.ceil(right_edge)) + 3 :]
    is_drawn = (right_of_map != LIGHT.background).any(axis=2)
    assert is_drawn.any()
    assert not is_drawn[:, -1].any(), "nothing touches the edge of the image"
    farthest_color = LIGHT.build_heat_table(256).astype(int)[-1]
    rows, _ = np.nonzero(np.abs(right_of_map - farthest_color).max(axis=2) < 4)
    assert len(rows)
    assert rows.mean() < size[1] / 2, "the color of the largest distance is at the top"


@pytest.mark.parametrize(("limit", "last_label"), [(50.0, "50 m"), (2.0, "≥ 2 m"), (2500.0, "2.5 km")])
def test_the_color_scale_marks_values_beyond_its_end(limit, last_label, monkeypatch):
    labels = []
    monkeypatch.setattr(Canvas, "draw_text", lambda self, text, at, **style: labels.append(text) or 0)
    _, scene = build_field_scene(limit=limit)
    paint_layers(scene, "distances", "color_bar")
    assert labels[0] == "0"
    assert labels[-1] == last_label


@pytest.mark.parametrize("layer", ["distances", "geodesic_cells"])
def test_an_unchanged_layer_is_not_rendered_again(layer, monkeypatch):
    _, scene = build_field_scene()
    render_layer = Mock(wraps=getattr(distances, f"render_{layer}"))
    monkeypatch.setattr(distances, f"render_{layer}", render_layer)
    painter = Painter(ROOMS, SIZE)
    painter.change_visible([layer], [])
    frame = painter.render_frame(scene).copy()
    np.testing.assert_array_equal(painter.render_frame(scene), frame)
    assert render_layer.call_count == 1
    painter.camera = painter.camera.pan(10, 0)
    painter.render_frame(scene)
    _, other_scene = build_field_scene(seed=1)
    painter.render_frame(other_scene)
    assert render_layer.call_count == 3


@pytest.mark.parametrize(("zoom", "max_error"), [(0.05, 60), (4.0, 6), (300.0, 6)])
def test_colors_do_not_depend_on_the_zoom(zoom, max_error):
    cost, scene = build_field_scene()
    painter = Painter(ROOMS, (300, 200))
    painter.show_only(["distances"])
    point = np.array([9.0, 8.0])
    painter.camera = replace(painter.camera, center=(9.0, 8.0), zoom=painter.camera.zoom * zoom)
    frame = painter.render_frame(scene).astype(int)
    x, y = np.rint(painter.camera.to_pixels(point)).astype(int)
    exact = cost.geodesics.compute_distances(point[None], scene.field.result.positions).min()
    expected = build_palette(LIGHT)[int(exact / 8.0 * MAX_LEVEL)]
    assert np.abs(frame[y, x] - expected).max() <= max_error


def test_fields_follow_the_robots():
    cost = CoverageCost(ROOMS, 64)
    fields = DistanceFields(cost, 7.0)
    point = np.array([[2.0, 2.0]])
    assert fields.limit == 7.0
    np.testing.assert_array_equal(fields.compute_at(point).result.distances, cost(point).distances)


def test_names_of_layers_are_checked():
    assert check_layer_names("--show", ["geodesic-cells", "grid"]) == {"geodesic_cells", "grid"}
    with pytest.raises(ParameterError, match="--show: unknown layer 'distance': did you mean 'distances'"):
        check_layer_names("--show", ["distance"])
