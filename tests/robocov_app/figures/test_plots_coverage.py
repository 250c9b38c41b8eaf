"""Figures of the coverage cost: curves and maps of distances."""

from dataclasses import replace
from itertools import chain, combinations, product

import numpy as np
import pytest
from drawn_run import CORRIDOR, HALL, ROOMS, SHAFT, record_walk
from page_layout import boxes_overlap
from PIL import Image

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.errors import ParameterError
from robocov_app.figures.coverage import DistanceSnapshot, plot_coverage
from robocov_app.figures.curves import DISTANCE, TimeCurve
from robocov_app.figures.curves import TIME as TIME_LABEL
from robocov_app.figures.files import save_figure
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.distance_map.colors import MAX_LEVEL, build_palette, choose_color_limit
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.distance_map.site_lattice import FieldLattice

TIME = np.linspace(0.0, 60.0, 61)
COSTS = {environment.name: CoverageCost(environment, 64) for environment in (ROOMS, HALL, CORRIDOR, SHAFT)}


def build_snapshot(environment, n=5, seed=0):
    """Return the distances to n robots at random positions, as at the end of a run."""
    cost = COSTS[environment.name]
    record = record_walk(environment, n, seed=seed)
    positions = environment.start("spread").sample(n, seed)
    field = DistanceField(FieldLattice(cost.sites), cost(positions))
    return DistanceSnapshot.build_final(record, field, 1.234)


def build_snapshots(environment, count):
    return [build_snapshot(environment, seed=seed) for seed in range(count)]


def build_curve(k):
    """Return the cost curve of run k."""
    return TimeCurve(f"Controller {k}", "rapf", TIME, 1.0 + k + np.exp(-TIME / 9))


def build_curves(count):
    return [build_curve(k) for k in range(count)]


def list_maps(figure):
    return [axes for axes in figure.axes if not axes.axison]


def get_color_scale(figure):
    """Return the axes of the color scale in a figure without curves."""
    (axes,) = [axes for axes in figure.axes if axes.axison]
    return axes


def list_legend_texts(figure):
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def list_elements(figure):
    """List the extents of each text, legend and map, and of each plot with its labels."""
    renderer = figure.canvas.get_renderer()
    texts = [text for text in figure.texts if text.get_text()]
    elements = [[part.get_window_extent(renderer)] for part in (*texts, *figure.legends)]
    for axes in figure.axes:
        parts = [axes.get_window_extent(renderer)]
        if axes.axison:
            parts += [axis.get_tightbbox(renderer) for axis in (axes.xaxis, axes.yaxis)]
            parts += [text.get_window_extent(renderer) for text in axes.texts]
        elements.append([part for part in parts if part is not None])
    return elements


def check_layout(figure):
    """Check that no element is cut off by the page or covers another one."""
    page = figure.bbox
    elements = list_elements(figure)
    for box in chain.from_iterable(elements):
        assert box.x0 >= -1
        assert box.y0 >= -1
        assert box.x1 <= page.x1 + 1
        assert box.y1 <= page.y1 + 1
    for boxes, other_boxes in combinations(elements, 2):
        for box, other_box in product(boxes, other_boxes):
            assert not boxes_overlap(box, other_box)


def check_aspect(axes):
    """Check that a map is not distorted."""
    box = axes.get_window_extent()
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    assert box.width / (right - left) == pytest.approx(box.height / (top - bottom), rel=1e-4)


@pytest.mark.parametrize(
    ("n_maps", "n_curves"),
    [
        (1, 1),
        pytest.param(2, 0, marks=pytest.mark.slow),
        pytest.param(3, 3, marks=pytest.mark.slow),
        (5, 5),
    ],
)
@pytest.mark.parametrize(
    "size",
    [
        None,
        (720, 400),
        pytest.param((900, 600), marks=pytest.mark.slow),
        pytest.param((2560, 1440), marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(
    "environment",
    [
        ROOMS,
        pytest.param(HALL, marks=pytest.mark.slow),
        pytest.param(CORRIDOR, marks=pytest.mark.slow),
        pytest.param(SHAFT, marks=pytest.mark.slow),
    ],
    ids=lambda environment: environment.name,
)
def test_no_element_is_cut_off_covered_or_distorted(environment, size, n_maps, n_curves):
    figure = plot_coverage(build_curves(n_curves), build_snapshots(environment, n_maps), size=size)
    check_layout(figure)
    maps = list_maps(figure)
    assert len(maps) == n_maps
    for axes in maps:
        check_aspect(axes)


@pytest.mark.slow
@pytest.mark.parametrize("size", [None, (720, 400), (900, 600), (2560, 1440)])
@pytest.mark.parametrize("count", [1, 3])
def test_mean_times_are_plotted_after_mean_distances(size, count):
    figure = plot_coverage(
        build_curves(count), build_snapshots(HALL, count), size=size, times=build_curves(count)
    )
    labels = [axes.get_ylabel() for axes in figure.axes if axes.get_ylabel()]
    assert labels == [DISTANCE, TIME_LABEL]
    check_layout(figure)


@pytest.mark.parametrize("theme", [LIGHT, pytest.param(DARK, marks=pytest.mark.slow)], ids=["light", "dark"])
def test_colors_are_those_of_exact_distances(theme, tmp_path):
    """Points near robots and near borders of cells are not checked, since marks are drawn there."""
    snapshot = build_snapshot(HALL)
    figure = plot_coverage([], [snapshot], theme=theme, size=(800, 640))
    save_figure(figure, tmp_path / "coverage.png")
    pixels = np.array(Image.open(tmp_path / "coverage.png").convert("RGB")).astype(int)
    (axes,) = list_maps(figure)
    limit = choose_color_limit(snapshot.field.max_distance)
    points = COSTS["hall"].points[::97]
    distances = COSTS["hall"].geodesics.compute_distances(points, snapshot.field.result.positions)
    nearest, second_nearest = np.sort(distances, axis=1)[:, :2].T
    is_clear = (nearest > 0.8) & (second_nearest - nearest > 0.3)
    assert is_clear.sum() > 10
    for point, distance in zip(points[is_clear], nearest[is_clear], strict=True):
        x, y_from_bottom = axes.transData.transform(point).astype(int)
        y = len(pixels) - 1 - y_from_bottom
        patch = pixels[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3)
        expected = build_palette(theme)[int(distance / limit * MAX_LEVEL)].astype(int)
        assert np.abs(patch - expected).max(axis=1).min() <= 4


def test_the_color_scale_ends_at_a_labeled_limit():
    snapshot = build_snapshot(HALL)
    scale = get_color_scale(plot_coverage([], [snapshot], size=(800, 640)))
    limit = choose_color_limit(snapshot.field.max_distance)
    assert scale.get_xlim() == (0.0, limit)
    assert scale.get_xticklabels()[-1].get_text() == f"{limit:g} m"


def test_all_maps_have_the_same_color_scale():
    near = build_snapshot(ROOMS, n=12)
    far = build_snapshot(ROOMS, n=1)
    _, limit = get_color_scale(plot_coverage([], [near, far])).get_xlim()
    assert limit == choose_color_limit(far.field.max_distance)
    assert limit > near.field.max_distance


def test_a_figure_has_a_title_a_cost_and_a_label_of_its_color_scale():
    figure = plot_coverage(build_curves(1), [build_snapshot(ROOMS)], title="Coverage cost  ·  rooms")
    texts = [text.get_text() for text in figure.texts]
    assert "Coverage cost  ·  rooms" in texts
    assert "distance to the nearest robot" in texts
    assert any(text.startswith("mean distance 1.234 m after") for text in texts)


@pytest.mark.parametrize(
    ("environment", "legend"),
    [
        pytest.param(ROOMS, ["robot", "geodesic cell border", "obstacle", "unreachable"], id="rooms"),
        pytest.param(SHAFT, ["robot", "geodesic cell border"], id="shaft"),
    ],
)
def test_the_legend_lists_what_the_map_has(environment, legend):
    figure = plot_coverage(build_curves(1), [build_snapshot(environment)])
    assert list_legend_texts(figure) == legend


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["svg", "png"])
def test_the_same_plot_gives_the_same_bytes(tmp_path, suffix):
    paths = [tmp_path / f"{name}.{suffix}" for name in ("first", "second")]
    for path in paths:
        save_figure(plot_coverage(build_curves(1), [build_snapshot(HALL)]), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("size", [(320, 240), (719, 900), (1200, 399)])
def test_a_small_page_has_curves_but_no_maps(size):
    figure = plot_coverage(build_curves(2), [build_snapshot(HALL)], size=size)
    (axes,) = figure.axes
    assert axes.get_xlabel() == "time (s)"
    assert tuple(figure.canvas.get_width_height()) == size


def test_a_plot_without_snapshots_is_rejected():
    with pytest.raises(ParameterError, match="snapshots: expected at least one, got none"):
        plot_coverage(build_curves(1), [])


def test_moving_obstacles_have_a_path_and_a_legend_entry():
    cart = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    snapshot = build_snapshot(ROOMS)
    rooms_with_cart = replace(ROOMS, obstacles=(*ROOMS.obstacles, cart))
    snapshot_with_cart = replace(snapshot, environment=rooms_with_cart, time=1.0)
    figure = plot_coverage([], [snapshot], size=(900, 600))
    figure_with_cart = plot_coverage([], [snapshot_with_cart], size=(900, 600))
    texts = list_legend_texts(figure)
    assert "obstacle" in texts
    assert set(list_legend_texts(figure_with_cart)) - set(texts) == {"moving obstacle and its path"}
    n_paths = len(figure_with_cart.axes[-1].lines) - len(figure.axes[-1].lines)
    assert n_paths == 1


@pytest.mark.parametrize("environment", [ROOMS, SHAFT, HALL])
def test_the_scale_bar_is_below_the_left_edge_of_the_map(environment):
    figure = plot_coverage(build_curves(1), [build_snapshot(environment)])
    map_box = figure.axes[-1].get_window_extent()
    (legend,) = figure.legends
    renderer = figure.canvas.get_renderer()
    legend_box = legend.get_window_extent(renderer)
    scale_bar_box = figure.artists[0].get_window_extent(renderer)
    assert scale_bar_box.x0 == pytest.approx(map_box.x0)
    assert scale_bar_box.y1 < map_box.y0
    assert scale_bar_box.x1 < legend_box.x0 or legend_box.y1 < scale_bar_box.y0
    assert legend_box.y0 > 0.0


def test_curves_next_to_a_tall_map_take_more_than_half_of_the_page():
    figure = plot_coverage(build_curves(1), [build_snapshot(SHAFT)])
    curves = next(axes for axes in figure.axes if axes.get_xlabel() == "time (s)")
    assert curves.get_position().width > 0.5
