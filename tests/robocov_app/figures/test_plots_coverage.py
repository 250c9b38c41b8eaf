import itertools
from dataclasses import replace

import numpy as np
import pytest
from drawn_run import CORRIDOR, HALL, ROOMS, SHAFT, record_walk
from page_layout import boxes_overlap
from PIL import Image

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.errors import ParameterError
from robocov_app.figures.coverage import DistanceSnapshot, plot_coverage
from robocov_app.figures.curves import DISTANCE, TIME, TimeCurve
from robocov_app.figures.files import save_figure
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.distance_map.colors import MAX_LEVEL, build_palette, choose_color_limit
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.distance_map.site_lattice import FieldLattice

T = np.linspace(0.0, 60.0, 61)
COSTS = {map_.name: CoverageCost(map_, 64) for map_ in (ROOMS, HALL, CORRIDOR, SHAFT)}


def build_snapshot(environment, n=5, seed=0):
    cost = COSTS[environment.name]
    record = record_walk(environment, n, seed=seed)
    positions = environment.start("spread").sample(n, seed)
    return DistanceSnapshot.build_final(
        record, DistanceField(FieldLattice(cost.sites), cost(positions)), 1.234
    )


def build_curves(count):
    return [TimeCurve(f"Controller {k}", "rapf", T, 1.0 + k + np.exp(-T / 9)) for k in range(count)]


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
    for k, boxes in enumerate(elements):
        for box in boxes:
            assert box.x0 >= -1 and box.y0 >= -1 and box.x1 <= page.x1 + 1 and box.y1 <= page.y1 + 1
            for other in itertools.chain.from_iterable(elements[:k]):
                assert not boxes_overlap(box, other)


@pytest.mark.parametrize(
    ("count", "with_curves"),
    [
        (1, True),
        pytest.param(2, False, marks=pytest.mark.slow),
        pytest.param(3, True, marks=pytest.mark.slow),
        (5, True),
    ],
)
@pytest.mark.parametrize(
    "size",
    [None, (720, 400), *(pytest.param(size, marks=pytest.mark.slow) for size in ((900, 600), (2560, 1440)))],
)
@pytest.mark.parametrize(
    "environment",
    [ROOMS, *(pytest.param(each, marks=pytest.mark.slow) for each in (HALL, CORRIDOR, SHAFT))],
    ids=lambda map_: map_.name,
)
def test_no_element_is_cut_or_covered(environment, size, count, with_curves):
    snapshots = [build_snapshot(environment, seed=k) for k in range(count)]
    figure = plot_coverage(build_curves(count if with_curves else 0), snapshots, size=size)
    check_layout(figure)
    maps = [axes for axes in figure.axes if not axes.axison]
    assert len(maps) == count
    for axes in maps:
        box = axes.get_window_extent()
        left, right = axes.get_xlim()
        low, high = axes.get_ylim()
        assert box.width / (right - left) == pytest.approx(box.height / (high - low), rel=1e-4)


@pytest.mark.parametrize("size", [None, (720, 400), (900, 600), (2560, 1440)])
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.slow
def test_mean_times_are_next_to_or_below_the_mean_distances(size, count):
    figure = plot_coverage(
        build_curves(count),
        [build_snapshot(HALL, seed=k) for k in range(count)],
        size=size,
        times=build_curves(count),
    )
    labels = [axes.get_ylabel() for axes in figure.axes if axes.get_ylabel()]
    assert labels == [DISTANCE, TIME]
    check_layout(figure)


@pytest.mark.parametrize(
    "theme", [LIGHT, pytest.param(DARK, marks=pytest.mark.slow)], ids=lambda theme: theme.name
)
def test_the_colors_are_those_of_the_scale(theme, tmp_path):
    snapshot = build_snapshot(HALL)
    figure = plot_coverage([], [snapshot], theme=theme, size=(800, 640))
    save_figure(figure, tmp_path / "a.png")
    pixels = np.array(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    (axes,) = [axes for axes in figure.axes if not axes.axison]
    limit = choose_color_limit(snapshot.field.max_distance)
    geodesics = COSTS["hall"].geodesics
    hits = 0
    for place in COSTS["hall"].points[::97]:
        exact = geodesics.compute_distances(place[None], snapshot.field.result.positions)[0]
        column, height = axes.transData.transform(place)
        row = len(pixels) - 1 - int(height)
        around = pixels[row - 3 : row + 4, int(column) - 3 : int(column) + 4].reshape(-1, 3)
        wanted = build_palette(theme)[int(exact.min() / limit * MAX_LEVEL)].astype(int)
        first, second = np.sort(exact)[:2]
        if first > 0.8 and second - first > 0.3:
            hits += 1
            assert np.abs(around - wanted).max(axis=1).min() <= 4
    assert hits > 10
    (bar,) = [axes for axes in figure.axes if axes.axison]
    assert bar.get_xlim() == (0.0, limit)
    assert bar.get_xticklabels()[-1].get_text() == f"{limit:g} m"


def test_all_maps_are_in_one_scale_of_colors():
    near = build_snapshot(ROOMS, n=12)
    far = build_snapshot(ROOMS, n=1)
    figure = plot_coverage([], [near, far])
    (bar,) = [axes for axes in figure.axes if axes.axison]
    assert bar.get_xlim()[1] == choose_color_limit(far.field.max_distance) > near.field.max_distance


def test_the_texts_describe_the_coverage():
    figure = plot_coverage(build_curves(1), [build_snapshot(ROOMS)], title="Coverage cost  ·  rooms")
    words = [text.get_text() for text in figure.texts]
    assert "Coverage cost  ·  rooms" in words
    assert "distance to the nearest robot" in words
    assert any(text.startswith("mean distance 1.234 m after") for text in words)
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said == ["robot", "geodesic cell border", "obstacle", "unreachable"]
    (legend,) = plot_coverage(build_curves(1), [build_snapshot(SHAFT)]).legends
    assert [text.get_text() for text in legend.get_texts()] == ["robot", "geodesic cell border"]


@pytest.mark.slow
def test_the_same_plot_gives_the_same_bytes(tmp_path):
    for name in ("a.svg", "b.svg", "a.png", "b.png"):
        save_figure(plot_coverage(build_curves(1), [build_snapshot(HALL)]), tmp_path / name)
    for suffix in (".svg", ".png"):
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("size", [(320, 240), (719, 900), (1200, 399)])
def test_a_small_page_has_the_curves_alone(size):
    figure = plot_coverage(build_curves(2), [build_snapshot(HALL)], size=size)
    (axes,) = figure.axes
    assert axes.get_xlabel() == "time (s)"
    assert tuple(figure.canvas.get_width_height()) == size


def test_a_plot_without_snapshots_is_rejected():
    with pytest.raises(ParameterError, match="snapshots: expected at least one, got none"):
        plot_coverage(build_curves(1), [])


def test_moving_obstacles_have_a_path_and_a_legend_entry_of_their_own():
    cart = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    plain = build_snapshot(ROOMS)
    moving = replace(plain, environment=replace(ROOMS, obstacles=(*ROOMS.obstacles, cart)), time=1.0)
    drawn = {}
    for name, snapshot in (("plain", plain), ("moving", moving)):
        figure = plot_coverage([], [snapshot], size=(900, 600))
        drawn[name] = [text.get_text() for text in figure.legends[0].get_texts()], figure.axes[-1].lines
    assert "obstacle" in drawn["plain"][0]
    assert set(drawn["moving"][0]) - set(drawn["plain"][0]) == {"moving obstacle and its path"}
    assert len(drawn["moving"][1]) == len(drawn["plain"][1]) + 1


def test_the_scale_bar_and_a_legend_of_four_entries_are_in_one_line():
    figure = plot_coverage(build_curves(1), [build_snapshot(ROOMS)])
    (legend,) = figure.legends
    assert len(legend.get_texts()) == 4
    renderer = figure.canvas.get_renderer()
    box = legend.get_window_extent(renderer)
    bar = figure.artists[0].get_window_extent(renderer)
    assert bar.x1 < box.x0
    assert box.y0 < bar.y0 < box.y1
