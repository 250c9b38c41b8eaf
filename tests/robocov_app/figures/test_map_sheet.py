"""Sheets of several maps."""

from dataclasses import replace
from itertools import combinations

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.environment import Environment
from robocov_app.figures.map_sheets import MAX_MAPS, plot_maps


def list_texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.texts]


def compute_zooms(axes: Axes) -> tuple[float, float]:
    """Return the zoom of axes in x and in y, px/m."""
    box = axes.get_window_extent()
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    return box.width / (right - left), box.height / (top - bottom)


@pytest.fixture
def maps(empty: Environment, cluttered: Environment) -> list[Environment]:
    """Three maps, of which the last one is wide and does not begin at the origin."""
    wide = replace(empty, name="wide", boundary=((5.0, 5.0), (25.0, 5.0), (25.0, 12.0), (5.0, 12.0)))
    return [empty, cluttered, wide]


def test_maps_have_the_same_scale_and_their_own_origin(maps: list[Environment]) -> None:
    panels = plot_maps(maps).axes
    assert len(panels) == 3
    zoom = panels[0].get_window_extent().width / 20.0
    for axes in panels:
        assert compute_zooms(axes) == pytest.approx((zoom, zoom))
    assert panels[2].get_xlim() == (5.0, 25.0)


def test_maps_do_not_overlap(maps: list[Environment]) -> None:
    boxes = [axes.get_window_extent() for axes in plot_maps(maps).axes]
    for box, other in combinations(boxes, 2):
        assert not box.overlaps(other)


def test_a_sheet_has_the_names_of_its_maps(maps: list[Environment]) -> None:
    assert list_texts(plot_maps(maps))[:3] == ["empty", "cluttered", "wide"]


def test_all_maps_are_on_the_page(empty: Environment) -> None:
    figure = plot_maps([empty] * 7)
    assert round(figure.bbox.width) == 1600
    for axes in figure.axes:
        box = axes.get_window_extent()
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= 1600
        assert box.y1 <= figure.bbox.height


def test_a_sheet_in_the_dark_theme_is_dark(empty: Environment) -> None:
    red, green, blue, _ = plot_maps([empty], "dark").get_facecolor()
    assert red + green + blue < 0.6


@pytest.mark.slow
def test_only_the_first_of_many_maps_are_drawn(empty: Environment) -> None:
    figure = plot_maps([empty] * (MAX_MAPS + 5))
    assert len(figure.axes) == MAX_MAPS
    assert f"{MAX_MAPS} of {MAX_MAPS + 5}" in list_texts(figure)
