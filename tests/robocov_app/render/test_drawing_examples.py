"""Examples of small drawing functions."""

import numpy as np
import pygame

from robocov_app.look.colors import mix, parse_hex_color
from robocov_app.look.lengths import format_scale_length
from robocov_app.render.canvas import clip_polygon, clip_segment
from robocov_app.render.crowding import (
    compute_nearest_distances,
    fit_mark_size,
    fit_radii,
)
from robocov_app.render.density_text import format_cost
from robocov_app.render.distance_map.colors import choose_color_limit, list_color_ticks
from robocov_app.render.surface_cache import LatestValue, cache_surfaces


def test_a_hex_color_is_parsed() -> None:
    assert parse_hex_color("88CCEE") == (136, 204, 238)


def test_two_colors_are_mixed() -> None:
    assert mix((0, 0, 0), (200, 100, 50), 0.5) == (100, 50, 25)


def test_lengths_of_scale_bars_have_a_unit_of_their_size() -> None:
    lengths = [format_scale_length(meters) for meters in (0.05, 0.5, 2.0, 5000.0)]
    assert lengths == ["5 cm", "0.5 m", "2 m", "5 km"]


def test_limits_of_color_scales_are_round() -> None:
    limits = [choose_color_limit(distance) for distance in (0.93, 1.0, 4.2, 13.0)]
    assert limits == [1.0, 1.0, 5.0, 15.0]


def test_an_unknown_distance_has_a_color_limit() -> None:
    assert choose_color_limit(float("nan")) == 1.0


def test_ticks_of_color_scales_are_round() -> None:
    assert list_color_ticks(5.0) == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert list_color_ticks(1.5) == [0.0, 0.5, 1.0, 1.5]
    assert list_color_ticks(8.0) == [0.0, 2.0, 4.0, 6.0, 8.0]


def test_a_small_polygon_is_not_clipped() -> None:
    triangle = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    assert len(clip_polygon(triangle)) == 1


def test_segments_are_clipped_at_20000_pixels() -> None:
    assert clip_segment((0.0, 0.0), (40000.0, 20000.0)) == [[0.0, 0.0], [20000.0, 10000.0]]
    assert clip_segment((40000.0, 20000.0), (0.0, 0.0)) == [[20000.0, 10000.0], [0.0, 0.0]]
    assert clip_segment((0.0, 30000.0), (9.0, 30000.0)) == []
    assert clip_segment((1.0, 2.0), (3.0, 4.0)) == ((1.0, 2.0), (3.0, 4.0))


def test_costs_are_formatted_with_their_names() -> None:
    assert format_cost("mean distance", 1.25) == "mean distance 1.250 m"
    text = format_cost("mean distance weighted by φ", 1.25, 3.0)
    assert text == "mean distance weighted by φ 1.250 m, mean time 3.000 s"


def test_nearest_distances() -> None:
    points = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]])
    assert compute_nearest_distances(points).tolist() == [3.0, 1.0, 1.0]


def test_discs_near_each_other_are_smaller() -> None:
    centers = np.array([[0.0, 0.0], [8.0, 0.0], [99.0, 0.0]])
    assert fit_radii(centers, np.ones(3), 2.0, 9.0).tolist() == [4.0, 4.0, 9.0]


def test_marks_near_each_other_are_smaller() -> None:
    centers = np.array([[0.0, 0.0], [5.0, 0.0], [10.0, 0.0], [90.0, 0.0]])
    assert fit_mark_size(centers, 2.0, 9.0) == 5.0


@cache_surfaces(1000)
def render_square(side: int) -> pygame.Surface:
    return pygame.Surface((side, side), 0, 32)


def test_small_surfaces_are_cached() -> None:
    assert render_square(9) is render_square(9)


def test_surfaces_larger_than_the_cache_are_not_cached() -> None:
    assert render_square(99) is not render_square(99)


def test_the_latest_value_is_cached_for_each_source_and_key() -> None:
    latest = LatestValue[object]()
    source = [1, 2]
    value = latest.get_or_compute(source, "light", object)
    assert latest.get_or_compute(source, "light", object) is value
    assert latest.get_or_compute(source, "dark", object) is not value
