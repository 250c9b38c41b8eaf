"""Path data and transforms, compared with the equations of the standard."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from robocov_app.formats.geometry.frames import transform_points
from robocov_app.formats.vector.svg.numbers import parse_length, parse_numbers
from robocov_app.formats.vector.svg.path_data import parse_path
from robocov_app.formats.vector.svg.transforms import (
    build_affine,
    compose,
    compute_stretch,
    fit_view_box,
    parse_transform,
)


def list_points(text: str, tolerance: float = 1e-3) -> list[list[float]]:
    [(found, _)], _ = parse_path(text, tolerance, 10_000)
    return [[round(x, 9) + 0.0, round(y, 9) + 0.0] for x, y in found.tolist()]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("M1 2L3 4", [[1, 2], [3, 4]]),
        ("m1,2 2,2", [[1, 2], [3, 4]]),
        ("M1 2 3 4-5.5.5", [[1, 2], [3, 4], [-5.5, 0.5]]),
        ("M0 0h4v3H0V1", [[0, 0], [4, 0], [4, 3], [0, 3], [0, 1]]),
        ("M1e1 0l+.5-1E-1", [[10, 0], [10.5, -0.1]]),
        ("M0 0 0 1\n\t1 1", [[0, 0], [0, 1], [1, 1]]),
        ("M0 0C1 0 2 0 3 0S5 0 6 0", [[0, 0], [3, 0], [6, 0]]),
        ("M0 0Q1 0 2 0T4 0t2 0", [[0, 0], [2, 0], [4, 0], [6, 0]]),
        ("M0 0A0 5 0 0 1 4 4", [[0, 0], [4, 4]]),
    ],
)
def test_path_commands_are_parsed(text: str, expected: list[list[float]]) -> None:
    assert list_points(text) == expected


def test_subpaths_start_where_the_previous_one_started() -> None:
    found, draws = parse_path("M1 1h2v2z l1 0 M5 5zh1m1 1", 1e-3, 100)
    assert draws == 7
    assert [(part.tolist(), closed) for part, closed in found] == [
        ([[1, 1], [3, 1], [3, 3]], True),
        ([[1, 1], [2, 1]], False),
        ([[5, 5], [6, 5]], False),
    ]
    assert parse_path("", 1e-3, 10) == ([], 0)
    assert parse_path("M1 1", 1e-3, 10) == ([], 1)


def test_smooth_curves_mirror_the_previous_handle() -> None:
    smooth = list_points("M0 0C0 3 2 3 3 0S6-3 6 0", 1e-2)
    assert smooth == list_points("M0 0C0 3 2 3 3 0C4-3 6-3 6 0", 1e-2)
    assert list_points("M0 0Q2 4 4 0T8 0", 1e-2) == list_points("M0 0Q2 4 4 0Q6-4 8 0", 1e-2)
    # After another command, there is no control point to reflect.
    straight = list_points("M0 0L4 0T8 4")[1:]
    assert straight[-1] == [8, 4]
    assert all(x - y == pytest.approx(4.0) for x, y in straight)


_COORDINATE = st.integers(-100, 100).map(lambda n: n / 4)


@given(*[_COORDINATE] * 4, *[st.integers(1, 60).map(float)] * 2, st.integers(-180, 360), *[st.booleans()] * 2)
def test_arcs_satisfy_the_equation_of_their_ellipse(
    x1: float, y1: float, x2: float, y2: float, rx: float, ry: float, turn: int, large: bool, clockwise: bool
) -> None:
    assume((x1, y1) != (x2, y2))
    flags = f"{int(large)}{int(clockwise)}"  # without separators, as optimizers write them
    [(found, _)], _ = parse_path(f"M{x1} {y1}A{rx} {ry} {turn} {flags}{x2} {y2}", 1e-3, 100_000)
    assert found[0].tolist() == [x1, y1]
    assert found[-1].tolist() == [x2, y2]
    # Transform to coordinates in which the ellipse is a unit circle.
    angle = math.radians(turn)
    to_circle = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]) / [
        [rx],
        [ry],
    ]
    flat = found @ to_circle.T
    chord = math.dist(flat[0], flat[-1])
    if chord >= 2.0:  # it has to grow
        flat = flat * (2.0 / chord)
        chord = 2.0
    a = flat[0]
    b = flat[-1]
    height = math.sqrt(max(1.0 - chord**2 / 4, 0.0))
    across = np.array([a[1] - b[1], b[0] - a[0]]) / chord
    center = (a + b) / 2 + across * height * (1 if large != clockwise else -1)
    assert np.linalg.norm(flat - center, axis=1) == pytest.approx(1.0, abs=1e-6)
    turned = np.diff(np.unwrap(np.arctan2(*(flat - center).T[::-1])))
    assert (turned > -1e-6).all() if clockwise else (turned < 1e-6).all()
    if chord < 1.9999:
        assert (abs(turned.sum()) > math.pi) == large


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("L1 1", "character 1: expected M, got L first"),
        ("M1", "character 3: expected a number"),
        ("M0 0 L 10 x", "character 10: expected a number"),
        ("M0 0 X 1", "character 5: expected a command"),
        ("M0 0 A 1 1 0 2 0 3 3", "character 13: expected a number"),
        ("M0 0 L 1e300 0", "expected a number up to 1e+30"),
        ("M0 0 L nan 0", "expected a number"),
        ("?", "character 1: expected a command"),
        ("M" + "1 1 " * 200, "expected at most 100 points, got more"),
        ("M0 0 A 1e20 1e20 0 1 1 5 5", "expected at most 100 points, got more"),
    ],
)
def test_invalid_paths_are_reported_with_the_position(text: str, expected: str) -> None:
    with pytest.raises(ValueError, match="expected") as caught:
        parse_path(text, 1e-3, 100)
    assert expected in str(caught.value)


def test_arcs_without_extent_are_omitted_and_tiny_radii_are_lines() -> None:
    assert parse_path("M1 1A5 5 0 1 1 1 1", 1e-3, 100) == ([], 2)
    assert list_points("M0 0A1e-40 1e-40 0 1 1 3 0") == [[0, 0], [3, 0]]
    huge = list_points("M0 0A1e25 1e25 0 0 1 3 0")
    assert huge == [[0, 0], [3, 0]]


@pytest.mark.parametrize(
    ("text", "point", "expected"),
    [
        ("translate(2)", (1, 1), (3, 1)),
        ("translate(2, 3)", (1, 1), (3, 4)),
        ("scale(2)", (1, 3), (2, 6)),
        ("scale(2 -1)", (1, 3), (2, -3)),
        ("rotate(90)", (1, 0), (0, 1)),
        ("rotate(90 1 1)", (2, 1), (1, 2)),
        ("skewX(45)", (0, 1), (1, 1)),
        ("skewY(45)", (1, 0), (1, 1)),
        ("matrix(1 2 3 4 5 6)", (1, 1), (9, 12)),
        ("translate(10)scale(2) , rotate(90)", (1, 0), (10, 2)),
        ("translate(3px, 4px) rotate(90deg)", (1, 0), (3, 5)),
        ("translate(3PX, 4Px) rotate(90DEG)", (1, 0), (3, 5)),
        ("none", (1, 2), (1, 2)),
        ("", (1, 2), (1, 2)),
    ],
)
def test_transforms_are_parsed(text: str, point: tuple[float, float], expected: tuple[float, float]) -> None:
    assert transform_points(parse_transform(text), np.array([point], dtype=float))[0] == pytest.approx(
        expected
    )


@pytest.mark.parametrize(
    "text", ["spin(3)", "rotate(1 2)", "matrix(1 2 3)", "scale(x)", "translate(1) oops", "scale(1e99)"]
)
def test_invalid_transforms_are_rejected(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_transform(text)


def test_huge_transforms_are_rejected() -> None:
    with pytest.raises(ValueError, match="beyond 1e"):
        parse_transform("scale(1e20) scale(1e20)")
    with pytest.raises(ValueError, match="beyond"):
        compose(build_affine(a=1e29, d=1e29), build_affine(a=1e29, d=1e29))


def test_stretch_is_the_largest_scale_of_a_circle() -> None:
    matrix = parse_transform("rotate(30) scale(2 5) skewX(20)")
    angle = np.linspace(0, math.tau, 100_000)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    lengths = np.linalg.norm(transform_points(matrix, circle), axis=1)
    assert compute_stretch(matrix) == pytest.approx((lengths.min(), lengths.max()), rel=1e-6)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10", 10),
        ("10px", 10),
        ("1in", 96),
        ("2.54cm", 96),
        ("25.4mm", 96),
        ("72pt", 96),
        ("6pc", 96),
        ("50%", 40),
        (" 1e1 ", 10),
    ],
)
def test_lengths_are_parsed(text: str, expected: float) -> None:
    assert parse_length(text, 80.0) == pytest.approx(expected)


@pytest.mark.parametrize("text", ["", "x", "10em", "10 px x", "%", "1e99px", "nan"])
def test_invalid_lengths_are_rejected(text: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse_length(text, 80.0)
    with pytest.raises(ValueError, match="expected"):
        parse_length("50%")


def test_lists_of_numbers_are_parsed() -> None:
    assert parse_numbers("1,2 3-4.5.5e1,") == [1, 2, 3, -4.5, 5]
    assert parse_numbers("") == []
    with pytest.raises(ValueError, match="expected a number"):
        parse_numbers("1 two")


@pytest.mark.parametrize(
    ("how", "corner", "center"),
    [
        ("", (0, 50), (50, 100)),
        ("xMinYMin", (0, 0), (50, 50)),
        ("xMaxYMax meet", (0, 100), (50, 150)),
        ("none", (0, 0), (50, 100)),
        ("xMidYMid slice", (-50, 0), (50, 100)),
    ],
)
def test_view_boxes_are_fitted(how: str, corner: tuple[float, float], center: tuple[float, float]) -> None:
    matrix = fit_view_box((10.0, 10.0, 20.0, 20.0), 100.0, 200.0, how)
    places = transform_points(matrix, np.array([[10.0, 10.0], [20.0, 20.0]]))
    assert places.tolist() == [list(map(float, corner)), list(map(float, center))]
