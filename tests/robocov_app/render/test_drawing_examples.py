"""Examples of small drawing functions."""

import numpy as np
import pygame
import pytest

from robocov_app.look.colors import mix, parse_hex_color
from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.render.canvas import clip_polygon, clip_segment
from robocov_app.render.crowding import (
    choose_width_factor,
    compute_nearest_distances,
    fit_mark_size,
    fit_radii,
)
from robocov_app.render.density_text import format_cost
from robocov_app.render.distance_map.colors import choose_color_limit, list_color_ticks
from robocov_app.render.panel_grid import choose_column_count
from robocov_app.render.surface_cache import LatestValue, cache_surfaces


def test_colors_are_parsed_and_mixed() -> None:
    assert parse_hex_color("88CCEE") == (136, 204, 238)
    assert mix((0, 0, 0), (200, 100, 50), 0.5) == (100, 50, 25)


def test_limits_and_ticks_of_color_scales_are_round() -> None:
    assert [round_down(x) for x in (0.7, 1.0, 3.9, 49.0)] == [0.5, 1.0, 2.0, 20.0]
    assert [format_scale_length(x) for x in (0.05, 0.5, 2.0, 5000.0)] == ["5 cm", "0.5 m", "2 m", "5 km"]
    limits = [choose_color_limit(x) for x in (0.93, 1.0, 4.2, 13.0, float("nan"))]
    assert limits == [1.0, 1.0, 5.0, 15.0, 1.0]
    assert list_color_ticks(5.0) == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert list_color_ticks(1.5) == [0.0, 0.5, 1.0, 1.5]
    assert list_color_ticks(8.0) == [0.0, 2.0, 4.0, 6.0, 8.0]


def test_huge_coordinates_are_clipped() -> None:
    assert len(clip_polygon(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]]))) == 1
    assert clip_segment((0.0, 0.0), (40000.0, 20000.0)) == [[0.0, 0.0], [20000.0, 10000.0]]
    assert clip_segment((40000.0, 20000.0), (0.0, 0.0)) == [[20000.0, 10000.0], [0.0, 0.0]]
    assert clip_segment((0.0, 30000.0), (9.0, 30000.0)) == []
    assert clip_segment((1.0, 2.0), (3.0, 4.0)) == ((1.0, 2.0), (3.0, 4.0))


def test_costs_are_formatted_with_their_names() -> None:
    assert format_cost("mean distance", 1.25) == "mean distance 1.250 m"
    text = "mean distance weighted by φ 1.250 m, mean time 3.000 s"
    assert format_cost("mean distance weighted by φ", 1.25, 3.0) == text


def test_marks_are_smaller_in_a_crowd() -> None:
    points = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]])
    assert compute_nearest_distances(points).tolist() == [3.0, 1.0, 1.0]
    centers = np.array([[0.0, 0.0], [8.0, 0.0], [99.0, 0.0]])
    assert fit_radii(centers, np.ones(3), 2.0, 9.0).tolist() == [4.0, 4.0, 9.0]
    assert fit_mark_size(np.array([[0.0, 0.0], [5.0, 0.0], [10.0, 0.0], [90.0, 0.0]]), 2.0, 9.0) == 5.0
    assert [choose_width_factor(n) for n in (6, 20, 80, 1000)] == [1.0, 1.0, 0.5, 0.5]


@pytest.mark.parametrize(("aspect", "columns"), [(1.4, 3), (10.0, 1)])
def test_panels_are_arranged_in_columns(aspect: float, columns: int) -> None:
    assert choose_column_count(3, aspect, (1920, 1080)) == columns


def test_surfaces_and_latest_values_are_cached() -> None:
    @cache_surfaces(1000)
    def render_page(side: int) -> pygame.Surface:
        return pygame.Surface((side, side), 0, 32)

    assert render_page(9) is render_page(9)
    assert render_page(99) is not render_page(99)
    latest = LatestValue[object]()
    source = [1, 2]
    assert latest.get(source, "light", object) is latest.get(source, "light", object)
    assert latest.get(source, "light", object) is not latest.get(source, "dark", object)
