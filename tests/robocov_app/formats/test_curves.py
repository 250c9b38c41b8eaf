"""Flattened curves, compared with much finer ones."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.formats.geometry.curves import (
    MAX_POINTS,
    flatten_arc,
    flatten_arcs,
    flatten_beziers,
    sample_curve,
)

_FINE = np.linspace(0.0, 1.0, 2001)[:, None]
_NUMBER = st.integers(-5000, 5000).map(lambda number: number / 100)
_POINT = st.tuples(_NUMBER, _NUMBER)


def measure_max_distance(exact: np.ndarray, points: np.ndarray) -> float:
    """Return the largest distance between points of a curve and the line that approximates it."""
    line = shapely.LineString(points) if len(np.unique(points, axis=0)) > 1 else shapely.Point(points[0])
    return float(shapely.distance(line, shapely.points(exact)).max())


def flatten_single(control: np.ndarray, tolerance: float) -> np.ndarray:
    return flatten_beziers(control[None], tolerance)[0]


@given(st.lists(_POINT, min_size=4, max_size=4), st.sampled_from([1e-3, 0.1, 5.0]))
def test_bezier_curves_stay_within_the_tolerance(
    control: list[tuple[float, float]], tolerance: float
) -> None:
    points = np.array(control)
    weights = [(1 - _FINE) ** 3, 3 * _FINE * (1 - _FINE) ** 2, 3 * _FINE**2 * (1 - _FINE), _FINE**3]
    exact = sum(weight * point for weight, point in zip(weights, points, strict=True))
    points = np.concatenate([points[:1], flatten_single(points, tolerance)])
    assert measure_max_distance(exact, points) <= tolerance * (1 + 1e-6) + 1e-12
    assert (points[-1] == points[-1]).all()


@given(
    _POINT,
    _POINT,
    _POINT,
    st.floats(-10, 10),
    st.floats(-math.tau, math.tau),
    st.sampled_from([1e-3, 0.1, 5.0]),
)
def test_arcs_stay_within_the_tolerance(
    center: tuple[float, float],
    u: tuple[float, float],
    v: tuple[float, float],
    begin: float,
    sweep: float,
    tolerance: float,
) -> None:
    c = np.array(center)
    p = np.array(u)
    q = np.array(v)
    angle = begin + sweep * _FINE
    exact = c + np.cos(angle) * p + np.sin(angle) * q
    points = np.concatenate([exact[:1], flatten_arc(c, p, q, start=begin, sweep=sweep, tolerance=tolerance)])
    assert measure_max_distance(exact, points) <= tolerance * (1 + 1e-6) + 1e-9
    assert np.allclose(points[-1], exact[-1])


def flatten_circle(radius: float, sweep: float) -> np.ndarray:
    u = np.array([radius, 0.0])
    v = np.array([0.0, radius])
    return flatten_arc(np.zeros(2), u, v, start=0.0, sweep=sweep, tolerance=1e-3)


def test_no_more_points_than_a_circle_needs() -> None:
    for radius in (0.5, 5.0, 500.0):
        points = flatten_circle(radius, sweep=math.tau)
        needed = math.pi / math.acos(1.0 - 1e-3 / radius)
        assert needed <= len(points) <= needed + 1
    straight = flatten_single(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]), 1e-3)
    assert straight.tolist() == [[3.0, 0.0]]


def test_batches_agree_with_single_curves() -> None:
    curves = np.random.default_rng(2).random((7, 4, 2)) * 10
    points, count = flatten_beziers(curves, 1e-2)
    assert len(set(count.tolist())) > 2
    for k, part in enumerate(np.split(points, np.cumsum(count)[:-1])):
        assert (part == flatten_single(curves[k], 1e-2)).all()
    center, u, v = np.random.default_rng(3).random((3, 7, 2)) * 10
    angle, sweep = np.random.default_rng(4).random((2, 7)) * 6 - 3
    points, count = flatten_arcs(center, u, v, angle, sweep, tolerance=1e-2)
    for k, part in enumerate(np.split(points, np.cumsum(count)[:-1])):
        single = flatten_arc(center[k], u[k], v[k], start=angle[k], sweep=sweep[k], tolerance=1e-2)
        assert (part == single).all()


@pytest.mark.parametrize("radius", [1e8, 1e12, 1e30, math.nan])
def test_huge_curves_are_rejected(radius: float) -> None:
    with pytest.raises(ValueError, match=f"expected at most {MAX_POINTS} points, got more"):
        flatten_circle(radius, sweep=math.tau)
    with pytest.raises(ValueError, match="expected at most 250000 points"):
        flatten_single(np.array([[0.0, 0.0], [1e5 * radius, 1.0], [0.0, 2.0], [0.0, 0.0]]), 1e-3)
    if radius < 1e40:
        part = flatten_circle(radius, sweep=1 / radius)
        assert len(part) == 1


def test_a_sampled_curve_stays_within_the_tolerance() -> None:
    def wave(t: np.ndarray) -> np.ndarray:
        return np.column_stack([t, np.sin(3 * t) + np.maximum(t - 2, 0)])

    points = sample_curve(wave, np.array([0.0, 2.0, 5.0]), 1e-3)
    assert measure_max_distance(wave(np.linspace(0, 5, 5001)), points) <= 1e-3
    assert len(points) < 200
    assert len(sample_curve(lambda t: np.column_stack([t, 0 * t]), np.array([0.0, 1.0]), 1e-3)) == 9
