"""Circular arcs: moments, chords and rings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss

from robocov.voronoi.arcs import compute_moments, link_rings, split_into_chords

seeds = st.integers(0, 2**32 - 1)


def build_circle(
    radius: float, pieces: int, *, turns: int = 1, center: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """Return a circle as arcs of cell 0, counter-clockwise or, for `turns` -1, clockwise."""
    turn = turns * np.linspace(0.0, 2.0 * np.pi, pieces + 1)
    ends = np.array(center) + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    return build_arcs(ends[:-1], ends[1:], turns * np.pi / pieces)


def build_arcs(start: np.ndarray, end: np.ndarray, half_angle: float) -> np.ndarray:
    return np.column_stack([start, end, np.full(len(start), half_angle), np.zeros(len(start))])


@given(seeds, st.floats(-8.0, 0.0), st.sampled_from([-1.0, 1.0]))
def test_moments_of_an_arc_agree_with_quadrature(seed: int, log_size: float, sign: float) -> None:
    rng = np.random.default_rng(seed)
    start, end = rng.normal(size=(2, 2))
    half = sign * np.pi / 2 * 10.0**log_size
    along = end - start
    length = np.hypot(*along)
    tangent = along / length
    normal = np.array([along[1], -along[0]]) / length
    nodes, weights = leggauss(40)
    angle = half * nodes
    radius = length / (2.0 * np.sin(half))
    rise = 2.0 * np.sin((half - angle) / 2) * np.sin((half + angle) / 2)
    points = (start + end) / 2 + radius * (np.sin(angle)[:, None] * tangent + rise[:, None] * normal)
    speed = radius * (np.cos(angle)[:, None] * tangent - np.sin(angle)[:, None] * normal)
    cross = weights * half * (points[:, 0] * speed[:, 1] - points[:, 1] * speed[:, 0])
    ((area, *first, polar),) = compute_moments(build_arcs(start[None], end[None], half), 1)
    size = 1.0 + np.abs(points).max()
    assert area == pytest.approx(cross.sum() / 2, abs=1e-13 * size**2)
    np.testing.assert_allclose(first, cross @ points / 3, atol=1e-13 * size**3)
    assert polar == pytest.approx((cross * (points**2).sum(axis=1)).sum() / 4, abs=1e-13 * size**4)


@pytest.mark.parametrize("pieces", [2, 3, 7, 40])
def test_arcs_of_a_whole_circle_have_the_moments_of_the_disc(pieces: int) -> None:
    ((area, *first, polar),) = compute_moments(build_circle(2.0, pieces, center=(5.0, 1.0)), 1)
    assert area == pytest.approx(4 * np.pi, rel=1e-14)
    np.testing.assert_allclose(first, 4 * np.pi * np.array([5.0, 1.0]), rtol=1e-13)
    # The moment is pi r⁴ / 2 about the center of the circle, plus the term of the parallel axis theorem.
    assert polar == pytest.approx(8 * np.pi + 4 * np.pi * 26.0, rel=1e-13)


def test_almost_straight_arcs_keep_all_digits() -> None:
    """The closed form of the area, r² (x - sin x cos x), loses all digits here."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    half = 1e-9
    area = compute_moments(build_arcs(square, np.roll(square, -1, axis=0), half), 1)[0, 0]
    assert area - 1.0 == pytest.approx(4 * half / 6, rel=1e-6)


@given(st.floats(0.01, 50.0), st.integers(2, 9), st.floats(1e-4, 0.5))
def test_chords_deviate_by_at_most_the_allowed_distance(radius: float, pieces: int, sagitta: float) -> None:
    arcs = build_circle(radius, pieces)
    for line, arc in zip(split_into_chords(arcs, sagitta), arcs, strict=True):
        np.testing.assert_array_equal(line[[0, -1]].ravel(), arc[:4])
        np.testing.assert_allclose(np.hypot(*line.T), radius, rtol=1e-9)
        middles = (line[1:] + line[:-1]) / 2
        assert (np.hypot(*middles.T) >= radius - sagitta * (1 + 1e-6)).all()


def test_segments_are_not_split() -> None:
    line = split_into_chords(build_arcs(np.zeros((1, 2)), np.ones((1, 2)), 0.0), 1e-9)[0]
    np.testing.assert_array_equal(line, [[0.0, 0.0], [1.0, 1.0]])


def test_rings_are_linked_from_pieces_in_any_order() -> None:
    outer = build_circle(3.0, 5)
    hole = build_circle(1.0, 3, turns=-1, center=(0.5, 0.5))
    order = np.random.default_rng(0).permutation(8)
    rings = link_rings(np.concatenate([outer, hole])[order], 1e-5)
    areas = [compute_area(ring) for ring in rings]
    assert sorted(areas) == pytest.approx([-np.pi, 9 * np.pi], rel=1e-4)


def compute_area(ring: np.ndarray) -> float:
    x, y = ring.T
    u, v = np.roll(ring, -1, axis=0).T
    return float((x * v - u * y).sum() / 2)
