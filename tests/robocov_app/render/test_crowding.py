"""Sizes of marks in a crowd, dashes, and grids of panels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import render_layers
from drawn_run import build_scene
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from property_examples import count_examples

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
    """Return the distance of each center from each other one, inf on the diagonal, (n, n)."""
    distances = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    np.fill_diagonal(distances, np.inf)
    return distances


@settings(deadline=None, max_examples=count_examples(60))
@given(points)
def test_nearest_distances_are_those_of_all_pairs(centers):
    expected = compute_all_distances(centers).min(axis=1)
    assert compute_nearest_distances(centers) == pytest.approx(expected, abs=1e-9)


@settings(deadline=None, max_examples=count_examples(100))
@given(points, st.floats(0, 2), st.floats(0.1, 3))
def test_radii_are_within_their_limits(centers, true_radius, low):
    radii = fit_radii(centers, np.full(len(centers), true_radius), low, 9.0)
    assert (radii >= max(true_radius, low)).all()
    assert (radii <= max(true_radius, 9.0)).all()


@settings(deadline=None, max_examples=count_examples(100))
@given(points, st.floats(0, 2), st.floats(0.1, 3))
def test_discs_overlap_only_if_they_cannot_be_smaller(centers, true_radius, low):
    radii = fit_radii(centers, np.full(len(centers), true_radius), low, 9.0)
    could_shrink = radii > max(true_radius, low)
    is_overlap = radii[:, None] + radii > compute_all_distances(centers) + 1e-9
    assert not is_overlap[could_shrink][:, could_shrink].any()


def test_a_single_mark_has_the_maximum_size():
    center = np.zeros((1, 2))
    assert fit_radii(center, np.ones(1), 2.0, 9.0).tolist() == [9.0]
    assert fit_mark_size(center, 2.0, 9.0) == 9.0


def test_no_marks_have_the_maximum_size():
    assert fit_mark_size(np.empty((0, 2)), 2.0, 9.0) == 9.0


def test_many_lines_are_thinner_but_not_invisible():
    assert [choose_width_factor(n) for n in (1, 6, 20)] == [1.0, 1.0, 1.0]
    assert 0.5 < choose_width_factor(40) < 1.0
    assert [choose_width_factor(n) for n in (80, 200, 10000)] == [0.5, 0.5, 0.5]


@pytest.mark.parametrize(
    ("n_panels", "aspect", "n_columns"),
    [
        (1, 1.0, 1),
        (2, 1.0, 2),
        (2, 3.0, 1),
        (3, 1.4, 3),
        (3, 4.0, 1),
        (3, 10.0, 1),
        (4, 1.5, 2),
        (4, 0.2, 4),
        (6, 1.2, 3),
    ],
)
def test_panels_are_as_large_as_possible(n_panels, aspect, n_columns):
    assert choose_column_count(n_panels, aspect, (1920, 1080)) == n_columns


def test_a_crowd_is_more_robots_in_view_than_can_be_marked():
    camera = Camera.fit((0.0, 0.0, 20.0, 10.0), (0.0, 0.0, 400.0, 200.0), margin=0.0)
    x = np.linspace(0.1, 19.9, MAX_MARKED_ROBOTS + 1)
    positions = np.column_stack([x, np.full(len(x), 5.0)])
    assert is_crowd(positions, camera)
    assert not is_crowd(positions[1:], camera)
    assert not is_crowd(positions, camera.zoom_at(2.0, (0.0, 100.0)))


def build_marked_scene(n_robots):
    """Return a scene of robots in a lattice, with starts and goals next to them."""
    x, y = np.meshgrid(np.linspace(0.5, 7.5, 12), np.linspace(0.5, 7.5, 12))
    positions = np.column_stack([x.ravel(), y.ravel()])[:n_robots]
    return replace(build_scene(positions, goals=positions + 0.3), starts=positions - 0.1)


@pytest.mark.parametrize("layer", ["starts", "centroids"])
@pytest.mark.parametrize(
    ("n_robots", "is_marked"), [(MAX_MARKED_ROBOTS, True), (MAX_MARKED_ROBOTS + 1, False)]
)
def test_starts_and_centroids_of_a_crowd_are_not_drawn(layer, n_robots, is_marked):
    scene = build_marked_scene(n_robots)
    frame, _ = render_layers(scene, layer)
    frame_without_layers, _ = render_layers(scene)
    assert (frame != frame_without_layers).any() == is_marked


@pytest.mark.parametrize("layer", ["starts", "centroids"])
def test_starts_and_centroids_of_a_crowd_are_drawn_at_high_zoom(layer):
    scene = build_marked_scene(MAX_MARKED_ROBOTS + 1)
    _, painter = render_layers(scene, layer)
    painter.camera = painter.camera.zoom_at(3.0, painter.camera.middle)
    frame = painter.render_frame(scene).copy()
    painter.show_only([])
    assert (frame != painter.render_frame(scene)).any()


def build_random_curve(n_points, seed):
    """Return a curve of random steps to the upper right, (n_points, 2) px."""
    steps = np.random.default_rng(seed).uniform(0.5, 30.0, (n_points, 2))
    return np.cumsum(steps, axis=0)


@settings(deadline=None, max_examples=count_examples(60))
@given(st.integers(2, 40), st.integers(0, 10_000))
def test_dashes_cover_their_fraction_of_a_curve(n_points, seed):
    points = build_random_curve(n_points, seed)
    curve_length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    segments = cut_into_dashes(points, [6.0, 2.0])
    dash_length = np.linalg.norm(segments[:, 2:] - segments[:, :2], axis=1).sum()
    n_whole_periods = curve_length // 8.0
    assert dash_length >= 6.0 * n_whole_periods - 1e-6
    assert dash_length <= 6.0 * (n_whole_periods + 1) + 1e-6


@given(st.integers(2, 40), st.integers(0, 10_000))
def test_a_solid_curve_has_one_segment_between_two_points(n_points, seed):
    points = build_random_curve(n_points, seed)
    expected = np.hstack([points[:-1], points[1:]])
    assert cut_into_dashes(points, []).tolist() == expected.tolist()
