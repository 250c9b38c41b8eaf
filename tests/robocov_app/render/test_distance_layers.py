from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_pixels import list_legend_texts
from drawn_run import HALL, ROOMS, build_row_scene, record_walk

from robocov.cost import CoverageCost
from robocov.errors import ParameterError
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.distance_map.colors import MAX_LEVEL, build_palette
from robocov_app.render.distance_map.pixel_distances import DistanceField, DistanceFields
from robocov_app.render.distance_map.site_lattice import FieldLattice
from robocov_app.render.layer_catalog import check_layer_names
from robocov_app.render.layers import distances
from robocov_app.render.painter import Painter

SIZE = (560, 364)


def build_field_scene(environment=ROOMS, n=5, seed=0, limit=8.0):
    record = record_walk(environment, n, seed=seed)
    cost = CoverageCost(environment, 128)
    positions = environment.start("spread").sample(n, seed + 1000)
    field = DistanceField(FieldLattice(cost.sites), cost(positions))
    return cost, replace(build_row_scene(record), field=field, field_limit=limit)


def paint_layers(what, *names, theme=LIGHT, size=SIZE):
    painter = Painter(what.environment, size, theme)
    painter.show_only(names)
    return painter.render_frame(what).astype(int), painter


def sample_free_pixels(painter, environment, count, seed=0):
    """Return (count, 2) pixels well inside the free space, and their places."""
    rng = np.random.default_rng(seed)
    bounds = environment.region.bounds
    inside = environment.free.buffer(-0.15)
    found = []
    while len(found) < count:
        pixel = np.rint(painter.camera.to_pixels(rng.uniform(bounds[:2], bounds[2:])))
        place = painter.camera.to_world(pixel)
        if shapely.contains_xy(inside, *place):
            found.append((pixel, place))
    return np.array([pixel for pixel, _ in found]).astype(int), np.array([place for _, place in found])


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda map_: map_.name)
def test_colors_are_those_of_the_exact_distances(environment, theme):
    cost, what = build_field_scene(environment)
    frame, painter = paint_layers(what, "distances", theme=theme)
    pixels, places = sample_free_pixels(painter, environment, 150)
    exact = cost.geodesics.compute_distances(places, what.field.result.positions).min(axis=1)
    reached = np.isfinite(exact)
    wanted = build_palette(theme)[np.minimum(exact[reached] / 8.0 * MAX_LEVEL, MAX_LEVEL).astype(int)].astype(
        int
    )
    seen = frame[pixels[reached, 1], pixels[reached, 0]]
    assert reached.sum() > 100
    assert np.abs(seen - wanted).max(axis=1).max() <= 6
    assert np.median(np.abs(seen - wanted).max(axis=1)) <= 1


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
def test_no_color_leaves_the_free_space(theme):
    _, what = build_field_scene(HALL)
    frame, painter = paint_layers(what, "distances", "geodesic_cells", "obstacles", theme=theme)
    rows, columns = np.indices(frame.shape[:2])
    places = painter.camera.to_world(np.stack([columns, rows], axis=-1).astype(float))
    outside = ~shapely.contains_xy(HALL.region.polygon.buffer(0.1), places[..., 0], places[..., 1])
    assert (frame[outside] == theme.background).all()
    blocked = shapely.contains_xy(HALL.blocked.buffer(-0.1), places[..., 0], places[..., 1])
    assert blocked.sum() > 1000
    assert (frame[blocked] == theme.obstacle).all()


@pytest.mark.parametrize("n", [4, 14])
def test_geodesic_cells_have_the_tint_of_the_nearest_robot(n):
    cost, what = build_field_scene(n=n, seed=2)
    frame, painter = paint_layers(what, "geodesic_cells")
    pixels, places = sample_free_pixels(painter, ROOMS, 200)
    exact = cost.geodesics.compute_distances(places, what.field.result.positions)
    ordered = np.sort(exact, axis=1)
    reached = np.isfinite(ordered[:, 0])
    clear = reached.copy()
    clear[reached] = ordered[reached, 1] - ordered[reached, 0] > 0.3
    assert clear.sum() > 80
    for (x, y), robot in zip(pixels[clear], exact[clear].argmin(axis=1), strict=True):
        assert tuple(frame[y, x]) == LIGHT.get_cell_color(int(painter._hues[robot]))


def test_borders_are_drawn_only_between_owners():
    cost, what = build_field_scene(seed=4)
    frame, painter = paint_layers(what, "geodesic_cells", "distances")
    plain, _ = paint_layers(what, "distances")
    line = np.abs(frame - plain).max(axis=2) > 60
    rows, columns = np.nonzero(line)
    assert len(rows) > 200
    chosen = slice(None, None, len(rows) // 60)
    places = painter.camera.to_world(np.column_stack([columns, rows])[chosen].astype(float))
    free = shapely.contains_xy(ROOMS.free, *places.T)
    exact = np.sort(cost.geodesics.compute_distances(places[free], what.field.result.positions), axis=1)
    assert (exact[:, 1] - exact[:, 0]).max() < 3.0 / painter.camera.zoom


def test_cells_below_colors_are_lines_only():
    _, what = build_field_scene()
    with_cells, _ = paint_layers(what, "distances", "cells")
    without, _ = paint_layers(what, "distances")
    differs = np.abs(with_cells - without).max(axis=2) > 0
    assert 0.001 < differs.mean() < 0.05


def test_without_a_field_nothing_is_drawn():
    _, what = build_field_scene()
    frame, painter = paint_layers(
        replace(what, field=None), "distances", "geodesic_cells", "color_bar", "legend"
    )
    assert (frame == LIGHT.background).all()
    assert list_legend_texts(painter, replace(what, field=None)) == []


def test_the_legend_explains_the_distance_layers():
    _, what = build_field_scene()
    painter = Painter(ROOMS, SIZE)
    painter.change_visible(["distances", "geodesic_cells"], ["cells"])
    words = list_legend_texts(painter, what)
    assert words[:3] == ["distance to the nearest robot", "unreachable", "geodesic cell border"]
    assert "Voronoi cell" not in words


@pytest.mark.parametrize(
    "size", [(480, 360), *(pytest.param(size, marks=pytest.mark.slow) for size in ((900, 600), (1920, 1080)))]
)
@pytest.mark.parametrize("limit", [0.8, 8.0, 15.0, 2500.0])
def test_the_color_scale_is_complete_and_next_to_the_map(size, limit):
    _, what = build_field_scene(limit=limit)
    frame, painter = paint_layers(what, "distances", "color_bar", "boundary", "status", size=size)
    corner = painter.camera.to_pixels(np.array([16.0, 0.0]))
    beside = frame[:, int(np.ceil(corner[0])) + 3 :]
    ink = (beside != LIGHT.background).any(axis=2)
    assert ink.any()
    # nothing touches the edge of the page
    assert not ink[:, -1].any()
    # the farthest color is above the nearest
    table = LIGHT.build_heat_table(256).astype(int)
    far = np.nonzero(np.abs(beside - table[-1]).max(axis=2) < 4)[0]
    assert len(far)
    assert far.mean() < size[1] / 2


def test_the_color_scale_marks_values_beyond_its_end(monkeypatch):
    from robocov_app.render import canvas

    said = []
    monkeypatch.setattr(canvas.Canvas, "draw_text", lambda self, text, at, **style: said.append(text) or 0)
    for limit, last in ((50.0, "50 m"), (2.0, "≥ 2 m"), (2500.0, "2.5 km")):
        said.clear()
        _, what = build_field_scene(limit=limit)
        paint_layers(what, "distances", "color_bar")
        assert said[-1] == last
        assert said[0] == "0"


@pytest.mark.parametrize("layer", ["distances", "geodesic_cells"])
def test_an_unchanged_picture_is_cached(layer, monkeypatch):
    _, what = build_field_scene()
    made = []
    name = f"render_{layer}"
    real = getattr(distances, name)
    monkeypatch.setattr(distances, name, lambda *args: made.append(1) or real(*args))
    painter = Painter(ROOMS, SIZE)
    painter.change_visible([layer], [])
    first = painter.render_frame(what).copy()
    np.testing.assert_array_equal(painter.render_frame(what), first)
    assert len(made) == 1
    painter.camera = painter.camera.pan(10, 0)
    painter.render_frame(what)
    _, other = build_field_scene(seed=1)
    painter.render_frame(other)
    assert len(made) == 3


@pytest.mark.parametrize("zoom", [0.05, 4.0, 300.0])
def test_any_zoom_shows_the_same_colors(zoom):
    cost, what = build_field_scene()
    painter = Painter(ROOMS, (300, 200))
    painter.show_only(["distances"])
    place = np.array([9.0, 8.0])
    painter.camera = replace(painter.camera, center=(9.0, 8.0), zoom=painter.camera.zoom * zoom)
    frame = painter.render_frame(what).astype(int)
    x, y = np.rint(painter.camera.to_pixels(place)).astype(int)
    exact = cost.geodesics.compute_distances(place[None], what.field.result.positions).min()
    wanted = build_palette(LIGHT)[int(exact / 8.0 * MAX_LEVEL)]
    assert np.abs(frame[y, x] - wanted).max() <= (60 if zoom < 1 else 6)


def test_fields_follow_the_robots():
    cost = CoverageCost(ROOMS, 64)
    fields = DistanceFields(cost, 7.0)
    place = np.array([[2.0, 2.0]])
    assert fields.limit == 7.0
    np.testing.assert_array_equal(fields.compute_at(place).result.distances, cost(place).distances)


def test_names_of_layers_are_checked():
    assert check_layer_names("--show", ["geodesic-cells", "grid"]) == {"geodesic_cells", "grid"}
    with pytest.raises(ParameterError, match="--show: unknown layer 'distance': did you mean 'distances'"):
        check_layer_names("--show", ["distance"])
