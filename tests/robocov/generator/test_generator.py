"""Generated maps: requested properties, seeds, and maps of earlier versions."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov import generator
from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.errors import NoLayoutError, ParameterError
from robocov.generator import GENERATORS, generate_map
from robocov.generator.request import BLOCKED_FRACTION_TOLERANCE
from robocov.mapfile import dump_map, load_map, save_map, to_json
from robocov.mapfile.check import check_map

SIDES = st.sampled_from([8.0, 10, 12.5, 20.0])
REQUEST_RANGES = {
    # A layout exists for all numbers of obstacles and areas in these ranges.
    "polygons": (st.integers(1, 8), st.floats(0.03, 0.18)),
    "blocks": (st.integers(1, 16), st.floats(0.1, 0.3)),
    "rooms": (st.integers(1, 9), st.floats(0.04, 0.15)),
    "mazes": (st.integers(8, 49), st.floats(0.03, 0.18)),
    "caves": (st.integers(1, 16), st.floats(0.3, 0.6)),
}


@st.composite
def draw_requests(draw):
    kind = draw(st.sampled_from(list(GENERATORS)))
    count, area = REQUEST_RANGES[kind]
    return {
        "seed": draw(st.integers(0, 2**40)),
        "kind": kind,
        "obstacles": draw(count),
        "area": draw(area),
        "gap": draw(st.sampled_from([0.25, 0.3, 0.437, 0.6, 0.7])),
        "width": draw(SIDES),
        "height": draw(SIDES),
    }


def list_coordinates(environment):
    for obstacle in environment.obstacles:
        if isinstance(obstacle, PolygonObstacle):
            for ring in (obstacle.vertices, *obstacle.holes):
                yield from np.ravel(ring)
        elif isinstance(obstacle, WallObstacle):
            yield from (*np.ravel(obstacle.points), obstacle.width)
        else:
            yield from (*obstacle.center, obstacle.radius)
    for start in ("corner", "center"):
        disc = environment.starts[start]
        yield from (*disc.center, disc.radius)


def assert_obstacles_are_apart(environment, gap):
    """Assert that obstacles keep a distance from each other and from the boundary."""
    boundary = environment.boundary_polygon
    shapes = [obstacle.polygon for obstacle in environment.obstacles]
    assert all(first.distance(second) >= gap - 1e-9 for first, second in combinations(shapes, 2))
    assert all(shape.distance(boundary.exterior) >= gap - 1e-9 for shape in shapes)
    assert all(boundary.contains(shape) for shape in shapes)


@settings(max_examples=count_examples(80))
@given(draw_requests())
@example({"seed": 3, "kind": "polygons", "obstacles": 6, "area": 0.2, "gap": 0.6, "side": 10.0})
@example({"seed": 3, "kind": "blocks", "obstacles": 12, "area": 0.45, "gap": 0.5, "side": 10})
@example({"seed": 3, "kind": "rooms", "obstacles": 12, "area": 0.15, "gap": 0.6, "side": 10.0})
@example({"seed": 1, "kind": "polygons", "obstacles": 3, "area": 0.1, "gap": 0.25, "side": 1.5})
def test_maps_have_the_requested_properties(request_parameters):
    environment = generate_map(**request_parameters)
    gap = request_parameters["gap"]
    side = request_parameters.get("side")
    width = request_parameters.get("width", side)
    height = request_parameters.get("height", side)
    boundary = shapely.box(0, 0, width, height)
    assert environment.boundary_polygon.equals(boundary)

    solid = shapely.union_all([obstacle.polygon for obstacle in environment.obstacles]) & boundary
    area = request_parameters["area"]
    assert solid.area / boundary.area == pytest.approx(area, abs=BLOCKED_FRACTION_TOLERANCE + 1e-6)

    # A disc as wide as the gap can move everywhere and around every obstacle.
    (free,) = environment.free.geoms
    for radius in (0.102, gap / 2 - 1e-5):
        room = free.buffer(-radius)
        assert isinstance(room, shapely.Polygon)
        assert len(room.interiors) == len(free.interiors)
    if request_parameters["kind"] in ("polygons", "blocks"):
        assert len(environment.obstacles) == request_parameters["obstacles"]
        assert_obstacles_are_apart(environment, gap)

    report = check_map(environment)
    assert report.warnings == ()
    assert report.narrowest_gap is None or report.narrowest_gap.width >= gap - 1e-6
    assert list(environment.starts) == ["corner", "center", "uniform"]
    digits = 2 if gap >= 0.5 else 3
    assert all(value == round(value, digits) for value in list_coordinates(environment))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["polygons", "blocks", "rooms", "mazes"])
def test_large_maps_with_many_obstacles_are_connected(kind):
    environment = generate_map(0, kind=kind, obstacles=250, side=50.0)
    assert len(environment.free.geoms) == 1
    assert len(environment.obstacles) > 50


@settings(max_examples=count_examples(20))
@given(draw_requests())
def test_saved_maps_are_loaded_unchanged(tmp_path_factory, request_parameters):
    environment = generate_map(**request_parameters)
    path = tmp_path_factory.mktemp("maps") / "generated.json"
    save_map(environment, path)
    assert load_map(path) == environment
    assert environment.extra["generator"] == {
        **{key: request_parameters[key] for key in ("kind", "seed", "obstacles", "area")},
        **{f"{key}_m": request_parameters[key] for key in ("gap", "width", "height")},
    }
    seed = request_parameters["seed"]
    assert str(seed) in environment.name
    for text in (request_parameters["kind"], f"seed {seed}", f"{request_parameters['gap']:g} m"):
        assert text in f"{environment.name} {environment.description}"


@pytest.mark.slow
@pytest.mark.parametrize("kind", GENERATORS)
def test_starts_have_space_for_a_team(kind):
    for seed in range(12):
        environment = generate_map(seed, kind=kind)
        corner = environment.starts["corner"]
        assert environment.free.contains(shapely.Point(corner.center).buffer(corner.radius))
        offsets = np.array(corner.center) - [[0, 0], [10, 0], [0, 10], [10, 10]]
        assert corner.radius < np.abs(offsets).max(axis=1).min() <= 1.3
        center_distance = np.hypot(*(np.array(environment.starts["center"].center) - 5.0))
        assert center_distance <= 3.0 * np.sqrt(2.0) + 0.01
        for name in environment.starts:
            assert environment.start(name).sample(8, seed=seed).shape == (8, 2)


def test_equal_seeds_give_equal_maps_and_different_seeds_different_ones():
    for kind in GENERATORS:
        maps = [generate_map(seed, kind=kind) for seed in range(3)]
        assert [generate_map(seed, kind=kind) for seed in range(3)] == maps
        assert len({environment.obstacles for environment in maps}) == 3


def compute_digest(environment):
    """Return the start of the hash of a map. The hashes were computed when "center" was spelled "centre"."""
    text = json.dumps(to_json(environment)).replace('"center": {', '"centre": {')
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"seed": 3, "kind": "polygons"}, "0ab3e86eeef56acd"),
        ({"seed": 11, "kind": "polygons"}, "dec3ebd69dcb27a0"),
        ({"seed": 3, "kind": "blocks"}, "ca4eca377a810a59"),
        ({"seed": 11, "kind": "blocks"}, "bbff0f655df515a4"),
        ({"seed": 3, "kind": "rooms"}, "27de218024ba005e"),
        ({"seed": 3, "kind": "mazes"}, "496a9bb5f15dd023"),
        ({"seed": 11, "kind": "rooms"}, "8670d5db995527a2"),
        (
            {
                "seed": 5,
                "kind": "polygons",
                "obstacles": 4,
                "area": 0.1,
                "gap": 0.3,
                "width": 12.5,
                "height": 8,
            },
            "fdb63a94b63989f7",
        ),
        (
            {
                "seed": 5,
                "kind": "blocks",
                "obstacles": 9,
                "area": 0.3,
                "gap": 0.437,
                "width": 20,
                "height": 8,
            },
            "afcb1d5a5f1ea9be",
        ),
        (
            {"seed": 5, "kind": "rooms", "obstacles": 9, "area": 0.1, "gap": 0.7, "width": 20, "height": 12},
            "babdb2a72dbd4d51",
        ),
    ],
)
def test_maps_of_earlier_studies_do_not_change(parameters, expected):
    """A seed in a paper must give the same map in every version, bit for bit."""
    assert compute_digest(generate_map(**parameters)) == expected


@pytest.mark.slow
def test_maps_do_not_depend_on_the_process():
    script = (
        "import sys\n"
        "from robocov.generator import GENERATORS, generate_map\n"
        "from robocov.mapfile import dump_map\n"
        "sys.stdout.write(''.join(dump_map(generate_map(5, kind=kind)) for kind in GENERATORS))"
    )
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert process.stdout == "".join(dump_map(generate_map(5, kind=kind)) for kind in GENERATORS)


def test_parameters_may_be_numpy_scalars():
    plain = generate_map(4, obstacles=5, area=0.125, gap=0.5, side=8.0)
    environment = generate_map(
        np.int64(4), obstacles=np.int32(5), area=np.float64(0.125), gap=np.float32(0.5), side=np.int64(8)
    )
    assert environment == plain


@pytest.mark.slow
def test_the_shapes_of_polygons_are_mixed():
    counts = {"convex": 0, 6: 0, 8: 0}
    for seed in range(60):
        for obstacle in generate_map(seed, obstacles=5, area=0.2).obstacles:
            is_convex = obstacle.polygon.convex_hull.area - obstacle.polygon.area < 0.05
            counts["convex" if is_convex else len(obstacle.vertices)] += 1
    # The probabilities for each of 300 polygons are 0.6, 0.2 and 0.2.
    assert 150 < counts["convex"] < 210
    assert 35 < counts[6] < 95
    assert 30 < counts[8] < 85


def test_rooms_have_walls_doors_and_furniture():
    environment = generate_map(0, kind="rooms", obstacles=7, area=0.14)
    walls = [obstacle for obstacle in environment.obstacles if isinstance(obstacle, WallObstacle)]
    furniture = [obstacle for obstacle in environment.obstacles if not isinstance(obstacle, WallObstacle)]
    assert {obstacle.name for obstacle in furniture} <= {"cabinet", "table", "round table"}
    assert len(furniture) >= 7
    assert len(walls) >= 6
    for circle in furniture:
        if isinstance(circle, CircleObstacle):
            assert min(circle.polygon.distance(wall.polygon) for wall in walls) >= 0.6


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"seed": 1.5}, "seed: expected a whole number of at least 0, got 1.5"),
        ({"seed": True}, "seed: expected a whole number of at least 0, got True"),
        ({"kind": "polygon"}, "unknown kind of map 'polygon': did you mean 'polygons'?"),
        ({"kind": ["rooms"]}, "unknown kind of map"),
        ({"obstacles": 0}, "obstacles: expected a whole number from 1 to 100000, got 0"),
        ({"obstacles": 2.5}, "obstacles: expected a whole number from 1 to 100000, got 2.5"),
        ({"area": 0.95}, "area: expected a number from 0.01 to 0.9, got 0.95"),
        ({"area": float("nan")}, "area: expected a number from 0.01 to 0.9, got nan"),
        ({"area": "much"}, "area: expected a number from 0.01 to 0.9, got 'much'"),
        ({"gap": 0.2}, "gap: expected a number from 0.21 to 3.33333, got 0.2"),
        ({"gap": 5}, "gap: expected a number from 0.21 to 3.33333, got 5"),
        ({"side": 0.5}, "side: expected a number from 1 to 1000, got 0.5"),
        ({"width": float("inf")}, "width: expected a number from 1 to 1000, got inf"),
        ({"height": None, "side": True}, "side: expected a number from 1 to 1000, got True"),
    ],
)
def test_parameters_out_of_range_are_named(parameters, message):
    with pytest.raises(ParameterError) as caught:
        generate_map(**{"seed": 0, **parameters})
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    "parameters",
    [
        {"kind": "polygons", "obstacles": 200, "area": 0.5},
        pytest.param({"kind": "polygons", "obstacles": 12, "area": 0.35}, marks=pytest.mark.slow),
        {"kind": "blocks", "obstacles": 6, "area": 0.85},
        {"kind": "blocks", "obstacles": 200, "area": 0.2},
        {"kind": "rooms", "obstacles": 100, "area": 0.1},
        {"kind": "rooms", "obstacles": 4, "area": 0.6},
        {"kind": "mazes", "obstacles": 100, "area": 0.5},
        {"kind": "mazes", "obstacles": 1, "area": 0.1},
        {"kind": "caves", "obstacles": 4, "area": 0.02},
    ],
)
def test_impossible_requests_are_rejected(parameters):
    with pytest.raises(NoLayoutError) as caught:
        generate_map(0, **parameters)
    obstacle_name = GENERATORS[parameters["kind"]].obstacle_name
    assert str(caught.value).startswith(
        f"area: found no 10 x 10 m layout of {parameters['obstacles']} {obstacle_name} "
        f"with a blocked fraction of {parameters['area']:g} and "
    )


def build_square(x, y, side=1.0):
    return PolygonObstacle(((x, y), (x + side, y), (x + side, y + side), (x, y + side)))


@pytest.mark.parametrize(
    ("layout", "area", "is_valid"),
    [
        ([build_square(3, 3), build_square(4.6, 3)], 0.02, True),
        ([build_square(3, 3), build_square(4.5, 3)], 0.02, False),  # a narrow gap
        ([build_square(3, 3), build_square(6, 3, 1.3)], 0.02, False),  # too much
        ([build_square(3, 3), build_square(6, 3, 0.5)], 0.02, False),  # too little
        (
            [build_square(3, 3), build_square(3.5, 3), build_square(3, 3.5)],
            0.03,
            False,
        ),  # overlaps count once
        ([build_square(3, 3), build_square(3.5, 3), build_square(3, 3.5)], 0.0175, True),
        ([build_square(3, 3), PolygonObstacle(((6, 6), (7, 7), (7, 6), (6, 7)))], 0.015, False),  # not valid
        ([WallObstacle(((4.8, 0), (4.8, 10)), 0.2)], 0.02, False),  # two components
        ([WallObstacle(((4.8, 0), (4.8, 9.41)), 0.2)], 0.02, False),
        ([WallObstacle(((4.8, 0), (4.8, 9.39)), 0.2)], 0.02, True),
        (None, 0.02, False),
    ],
)
def test_layouts_of_registered_kinds_are_checked(layout, area, is_valid, monkeypatch):
    numbers = []

    def build_layout(request, corner, rng):
        numbers.append(rng.random())
        return layout

    custom_kind = replace(GENERATORS["polygons"], build_obstacles=build_layout, obstacle_name="blocks")
    monkeypatch.setitem(generator.GENERATORS, "custom", custom_kind)
    if is_valid:
        environment = generate_map(0, kind="custom", area=area)
        assert environment.obstacles == tuple(layout)
        assert environment.name == "custom 0"
    else:
        with pytest.raises(NoLayoutError, match="layout of 6 blocks with a blocked fraction"):
            generate_map(0, kind="custom", area=area)
        # Each attempt has different random numbers.
        assert len(set(numbers)) == len(numbers) > 1


def test_every_kind_has_a_description_of_one_line():
    for kind in GENERATORS.values():
        assert 10 < len(kind.description) < 100
        assert "\n" not in kind.description
