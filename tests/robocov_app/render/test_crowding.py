"""Sizes in a crowd, grids of panels, and one legend for several pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import render_layers
from drawn_run import build_scene
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robocov_app.look.legend import merge_legends
from robocov_app.render.camera import Camera
from robocov_app.render.crowding import (
    MAX_MARKED_ROBOTS,
    choose_width_factor,
    compute_nearest_distances,
    fit_mark_size,
    fit_radii,
    is_crowd,
)
from robocov_app.render.dashes import cut_into_dashes
from robocov_app.render.panel_grid import choose_column_count

points = arrays(np.float64, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(0, 100, width=32))


def compute_all_distances(centers):
    distances = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    np.fill_diagonal(distances, np.inf)
    return distances


@settings(deadline=None, max_examples=60)
@given(points)
def test_nearest_distances_are_those_of_all_pairs(centers):
    assert compute_nearest_distances(centers) == pytest.approx(
        compute_all_distances(centers).min(axis=1), abs=1e-9
    )


@settings(deadline=None, max_examples=100)
@given(points, st.floats(0, 2), st.floats(0.1, 3))
def test_discs_overlap_only_if_they_cannot_be_smaller(centers, true_radius, low):
    radii = fit_radii(centers, np.full(len(centers), true_radius), low, 9.0)
    smallest = max(true_radius, low)
    assert (radii >= smallest).all() and (radii <= max(9.0, true_radius)).all()
    free = radii > smallest
    overlaps = radii[:, None] + radii[None] > compute_all_distances(centers) + 1e-9
    assert not overlaps[free][:, free].any()


def test_a_single_mark_has_the_largest_size():
    assert fit_radii(np.zeros((1, 2)), np.ones(1), 2.0, 9.0).tolist() == [9.0]
    assert fit_mark_size(np.zeros((1, 2)), 2.0, 9.0) == fit_mark_size(np.empty((0, 2)), 2.0, 9.0) == 9.0


def test_many_lines_are_thinner_but_not_invisible():
    widths = [choose_width_factor(n) for n in (1, 6, 20, 40, 80, 200, 10000)]
    assert widths[:3] == [1.0, 1.0, 1.0]
    assert 1.0 > widths[3] > widths[4] == widths[-1] == 0.5


@pytest.mark.parametrize(
    ("count", "aspect", "columns"),
    [(1, 1.0, 1), (2, 1.0, 2), (2, 3.0, 1), (3, 1.4, 3), (3, 4.0, 1), (4, 1.5, 2), (4, 0.2, 4), (6, 1.2, 3)],
)
def test_panels_are_as_large_as_possible(count, aspect, columns):
    assert choose_column_count(count, aspect, (1920, 1080)) == columns


ENTRIES = st.lists(st.integers(0, 8), unique=True)


def merge(*legends: str) -> str:
    return "".join(merge_legends([list(legend) for legend in legends], str))


def test_entries_of_later_legends_keep_their_position() -> None:
    assert merge("abe", "abcde") == "abcde"
    assert merge("abcde", "ace") == "abcde"
    assert merge("bc", "abd") == "abdc"
    assert merge("", "ab", "ab") == "ab"


@given(st.lists(ENTRIES, max_size=4))
def test_each_entry_appears_once_and_the_first_legend_keeps_its_order(legends: list[list[int]]) -> None:
    merged = merge_legends(legends, lambda entry: entry)
    assert len(merged) == len(set(merged))
    assert set(merged) == {entry for legend in legends for entry in legend}
    if legends:
        assert [entry for entry in merged if entry in legends[0]] == legends[0]


def test_a_crowd_is_more_robots_in_view_than_can_be_marked():
    camera = Camera.fit((0.0, 0.0, 20.0, 10.0), (0.0, 0.0, 400.0, 200.0), margin=0.0)
    positions = np.column_stack(
        [np.linspace(0.1, 19.9, MAX_MARKED_ROBOTS + 1), np.full(MAX_MARKED_ROBOTS + 1, 5.0)]
    )
    assert is_crowd(positions, camera)
    assert not is_crowd(positions[1:], camera)
    assert not is_crowd(positions, camera.zoom_at(2.0, (0.0, 100.0)))


def place_robots(count: int) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0.5, 7.5, 12), np.linspace(0.5, 7.5, 12))
    return np.column_stack([x.ravel(), y.ravel()])[:count]


@pytest.mark.parametrize("layer", ["starts", "centroids"])
def test_a_crowd_has_no_starts_and_no_centroids_until_zoomed(layer):
    few = place_robots(MAX_MARKED_ROBOTS)
    many = place_robots(MAX_MARKED_ROBOTS + 1)
    for positions, is_marked in ((few, True), (many, False)):
        scene = replace(build_scene(positions, goals=positions + 0.3), starts=positions - 0.1)
        frame, painter = render_layers(scene, layer)
        blank, _ = render_layers(scene)
        assert (frame != blank).any() == is_marked
    painter.camera = painter.camera.zoom_at(3.0, painter.camera.middle)
    zoomed = painter.render_frame(scene).copy()
    painter.show_only([])
    assert (zoomed != painter.render_frame(scene)).any()


@settings(deadline=None, max_examples=60)
@given(st.integers(2, 40), st.integers(0, 10_000))
def test_dashes_cover_their_share_of_a_curve(count, seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(0.5, 30.0, (count, 2)), axis=0)
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    segments = cut_into_dashes(points, [6.0, 2.0])
    drawn = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]).sum()
    assert 6.0 * (length // 8.0) - 1e-6 <= drawn <= 6.0 * (length // 8.0 + 1) + 1e-6
    whole = cut_into_dashes(points, [])
    assert len(whole) == count - 1
