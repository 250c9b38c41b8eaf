"""Moving obstacles: positions on their paths, map files and rejected paths."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.environment import (
    CircleObstacle,
    Environment,
    ObstaclePath,
    PolygonObstacle,
    Repeat,
    WallObstacle,
)
from robocov.errors import MapError, ParameterError
from robocov.mapfile import build_map_schema, dump_map, from_json, parse_map, to_json

HALL = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
points = st.tuples(st.floats(-50, 50), st.floats(-50, 50))
lines = st.lists(points, min_size=2, max_size=6, unique=True).filter(
    lambda points: np.ptp(np.array(points), axis=0).max() > 0.1
)
repeats = st.sampled_from(["loop", "back-and-forth"])


def test_a_loop_closes_and_a_path_back_and_forth_returns() -> None:
    square = ObstaclePath(((0, 0), (2, 0), (2, 1), (0, 1)), 0.5)
    assert square.period == 12.0
    assert square.compute_displacement(0.0).tolist() == [0, 0]
    assert square.compute_displacement(5.0).tolist() == [2, 0.5]
    assert square.compute_displacement(11.0).tolist() == [0, 0.5]
    assert square.compute_displacement(12.0).tolist() == [0, 0]
    line = ObstaclePath(((1, 1), (4, 5)), 1.0, "back-and-forth")
    assert line.period == 10.0
    assert line.compute_displacement(5.0).tolist() == [3, 4]
    np.testing.assert_allclose(line.compute_displacement(7.5), [1.5, 2.0])


@given(lines, st.floats(0.01, 5), repeats, st.floats(0, 1e4), st.floats(0, 10))
def test_obstacles_keep_their_speed_and_return_after_a_period(
    points: list[tuple[float, float]], speed: float, repeat: Repeat, time: float, later: float
) -> None:
    path = ObstaclePath(tuple(points), speed, repeat)
    moved = path.compute_displacement(time + later) - path.compute_displacement(time)
    assert math.hypot(*moved) <= speed * later + 1e-8
    np.testing.assert_allclose(
        path.compute_displacement(time + path.period), path.compute_displacement(time), atol=1e-6
    )
    # The obstacle is on its path.
    position = path.compute_displacement(time) + points[0]
    vertices = [*points, points[0]] if repeat == "loop" else points
    distances = [
        compute_distance_to_segment(position, np.array(a), np.array(b)) for a, b in pairwise(vertices)
    ]
    assert min(distances) < 1e-8


def compute_distance_to_segment(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    along = b - a
    fraction = np.clip(((point - a) @ along) / max(float(along @ along), 1e-300), 0, 1)
    return float(np.hypot(*(point - a - fraction * along)))


def build_moving_hall() -> Environment:
    path = ObstaclePath(((2, 1), (8, 1)), 0.5, "back-and-forth")
    return Environment(
        "hall",
        HALL,
        (
            WallObstacle(((5, 2), (5, 6)), 0.1),
            CircleObstacle((2, 1), 0.5, "cart", path),
            PolygonObstacle(((1, 4), (2, 4), (2, 5)), (), None, ObstaclePath(((0, 0), (1, 0)), 1.0)),
            WallObstacle(((8, 4), (9, 4)), 0.2, None, ObstaclePath(((0, 0), (0, 1)), 0.25)),
        ),
    )


def test_the_map_at_a_time_has_obstacles_at_their_current_positions() -> None:
    environment = build_moving_hall()
    assert environment.has_moving_obstacles
    now = environment.at(4.0)
    assert not now.has_moving_obstacles
    assert now.obstacles[0] == environment.obstacles[0]
    cart = now.obstacles[1]
    assert isinstance(cart, CircleObstacle)
    assert (cart.center, cart.name) == ((4.0, 1.0), "cart")
    desk, wall = now.obstacles[2:]
    assert isinstance(desk, PolygonObstacle)
    assert isinstance(wall, WallObstacle)
    # After two periods the desk is back at its initial position.
    assert desk.vertices == ((1, 4), (2, 4), (2, 5))
    assert wall.points == ((8, 5), (9, 5))
    for time in (0.0, 1.3, 4.0):
        assert environment.at(time).free_area == pytest.approx(environment.free_area, abs=1e-4)
    assert environment.at(3.0).free.wkb == environment.at(3.0 + 24.0).free.wkb
    assert environment.static.obstacles == environment.obstacles[:1]


@pytest.mark.parametrize("time", [math.inf, math.nan, "soon"])
def test_there_is_no_map_at_a_time_that_is_not_a_finite_number(time: object) -> None:
    disc = CircleObstacle((3.0, 2.0), 0.5, path=ObstaclePath(((0, 0), (4, 0)), 1.0))
    hall = Environment("hall", HALL, obstacles=(disc,))
    with pytest.raises(ParameterError, match="time: expected a finite number, got"):
        hall.at(time)  # type: ignore[arg-type]


def test_periodic_obstacles_return_exactly_including_holes() -> None:
    frame = ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0))
    hole = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0))
    path = ObstaclePath(((0.0, 0.0), (0.7, 0.3)), 0.37)
    hall = Environment("hall", HALL, (PolygonObstacle(frame, (hole,), None, path),))
    for turns in range(1, 30):
        assert hall.at(1.0 + turns * path.period) == hall.at(1.0)
    (shape,) = hall.at(1.0).obstacles
    dx, dy = np.round(path.compute_displacement(1.0), 9)
    assert shape.holes == (tuple((x + dx, y + dy) for x, y in hole),)


@given(lines, st.floats(0.01, 5), repeats, st.floats(0, 100), st.floats(0, 100))
def test_an_advanced_path_continues_in_the_same_way(
    line: list[tuple[float, float]], speed: float, repeat: Repeat, start_time: float, time: float
) -> None:
    path = ObstaclePath(line, speed, repeat)
    advanced = path.advance(start_time)
    displacement = path.compute_displacement(start_time) + advanced.compute_displacement(time)
    np.testing.assert_allclose(displacement, path.compute_displacement(start_time + time), atol=1e-9)
    assert advanced.period == pytest.approx(path.period)


def test_a_path_that_is_advanced_to_a_vertex_starts_there() -> None:
    square = ObstaclePath(((0, 0), (2, 0), (2, 1), (0, 1)), 0.5)
    assert square.advance(4.0) == ObstaclePath(((2, 0), (2, 1), (0, 1), (0, 0)), 0.5)
    assert square.advance(12.0) == square
    line = ObstaclePath(((1, 1), (4, 5)), 1.0, "back-and-forth")
    assert line.advance(5.0) == ObstaclePath(((4, 5), (1, 1)), 1.0)


def test_an_advanced_map_continues_in_the_same_way() -> None:
    environment = build_moving_hall()
    advanced = environment.advance(3.7)
    assert environment.advance(0.0) is environment
    assert advanced.has_moving_obstacles
    assert advanced.obstacles[0] == environment.obstacles[0]
    for time in (0.0, 1.3, 20.0):
        now = advanced.at(time).obstacles
        expected = environment.at(3.7 + time).obstacles
        assert [obstacle.name for obstacle in now] == [obstacle.name for obstacle in expected]
        for obstacle, other in zip(now, expected, strict=True):
            np.testing.assert_allclose(obstacle.polygon.bounds, other.polygon.bounds, atol=1e-8)


def test_maps_without_moving_obstacles_do_not_depend_on_time() -> None:
    hall = Environment("hall", HALL, (CircleObstacle((2, 1), 0.5),))
    assert not hall.has_moving_obstacles
    assert hall.at(7.0) is hall
    assert hall.advance(7.0) is hall
    assert hall.static is hall


def test_written_paths_are_read_unchanged() -> None:
    environment = build_moving_hall()
    assert parse_map(dump_map(environment), "m.json") == environment
    assert to_json(environment)["obstacles"][1]["path"] == {
        "points": [[2, 1], [8, 1]],
        "speed": 0.5,
        "repeat": "back-and-forth",
    }


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (3, r"obstacles\[0\].path: expected an object with points and speed, got 3"),
        (
            {"points": [[0, 0], [1, 0]]},
            r"path.speed: missing, expected a number from 0.001 to 10 \(m/s\)",
        ),
        ({"points": [[0, 0], [1, 0]], "speed": 0}, r"path.speed: expected .*, got 0"),
        ({"points": [[0, 0], [1, 0]], "speed": 11}, r"path.speed: expected .*, got 11"),
        ({"points": [[0, 0], [1, 0]], "speed": "1"}, r'path.speed: expected .*, got "1"'),
        ({"points": [[0, 0]], "speed": 1}, r"path.points: expected a list of at least 2 points"),
        (
            {"points": [[0, 0], [1]], "speed": 1},
            r"path.points\[1\]: expected a point \[x, y\] in meters, got \[1\]",
        ),
        ({"points": [[0, 0], [1, 1e9]], "speed": 1}, r"path.points\[1\]\[1\]: expected .*, got 1000000000"),
        ({"points": [[0, 0], [0, 0]], "speed": 1}, r"path.points: expected a path of at least 1 mm, got 0 m"),
        (
            {"points": [[0, 0], [20000, 0]], "speed": 1},
            r"path.points: expected at most 10 km, got 20000 x 0 m",
        ),
        (
            {"points": [[0, 0], [1, 0]], "speed": 1, "repeat": "twice"},
            r'path.repeat: expected "loop" or "back-and-forth", got "twice"',
        ),
        ({"points": [[0, 0], [1, 0]], "spede": 1}, r"path: unknown key 'spede': did you mean 'speed'\?"),
    ],
)
def test_mistakes_in_a_path_are_reported(path: object, message: str) -> None:
    obstacle = {"kind": "circle", "center": [5, 3], "radius": 0.5, "path": path}
    document = {"format": "robocov-map", "version": 1, "name": "m", "boundary": [*map(list, HALL)]}
    with pytest.raises(MapError, match=message) as caught:
        from_json({**document, "obstacles": [obstacle]}, "m.json")
    assert "\n" not in str(caught.value)


def test_the_schema_checks_paths() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = jsonschema.Draft202012Validator(build_map_schema())
    document = to_json(build_moving_hall())
    schema.validate(document)
    document["obstacles"][1]["path"]["speed"] = 0
    assert not schema.is_valid(document)
