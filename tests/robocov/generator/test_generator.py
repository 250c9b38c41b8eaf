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

from robocov import generator
from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.errors import ParameterError
from robocov.generator import GENERATORS, generate_map
from robocov.generator.request import AREA_TOLERANCE
from robocov.mapfile import dump_map, load_map, save_map, to_json
from robocov.mapfile.check import check_map

SIDES = st.sampled_from([8.0, 10, 12.5, 20.0])
ASKED = {
    # what there is always a layout for
    "polygons": (st.integers(1, 8), st.floats(0.03, 0.18)),
    "blocks": (st.integers(1, 16), st.floats(0.1, 0.3)),
    "rooms": (st.integers(1, 9), st.floats(0.04, 0.15)),
    "mazes": (st.integers(8, 49), st.floats(0.03, 0.18)),
    "caves": (st.integers(1, 16), st.floats(0.3, 0.6)),
}


@st.composite
def draw_requests(draw):
    kind = draw(st.sampled_from(list(GENERATORS)))
    count, area = ASKED[kind]
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
    for start in ("corner", "centre"):
        spec = environment.starts[start]
        yield from (*spec.center, spec.radius)


@settings(max_examples=160)
@given(draw_requests())
@example({"seed": 3, "kind": "polygons", "obstacles": 6, "area": 0.2, "gap": 0.6, "side": 10.0})
@example({"seed": 3, "kind": "blocks", "obstacles": 12, "area": 0.45, "gap": 0.5, "side": 10})
@example({"seed": 3, "kind": "rooms", "obstacles": 12, "area": 0.15, "gap": 0.6, "side": 10.0})
@example({"seed": 1, "kind": "polygons", "obstacles": 3, "area": 0.1, "gap": 0.25, "side": 1.5})
def test_maps_have_the_requested_properties(words):
    environment = generate_map(**words)
    gap = words["gap"]
    width, height = words.get("width", words.get("side")), words.get("height", words.get("side"))
    whole = shapely.box(0, 0, width, height)
    assert environment.boundary_polygon.equals(whole)

    solid = shapely.union_all([obstacle.polygon for obstacle in environment.obstacles]) & whole
    assert solid.area / whole.area == pytest.approx(words["area"], abs=AREA_TOLERANCE + 1e-6)

    # a disc as wide as the gap gets everywhere, and round every obstacle: nothing closes as it grows
    (free,) = environment.free.geoms
    for radius in (0.102, gap / 2 - 1e-5):
        room = free.buffer(-radius)
        assert isinstance(room, shapely.Polygon)
        assert len(room.interiors) == len(free.interiors)
    if words["kind"] in ("polygons", "blocks"):
        assert len(environment.obstacles) == words["obstacles"]
        shapes = [obstacle.polygon for obstacle in environment.obstacles]
        assert all(one.distance(other) >= gap - 1e-9 for one, other in combinations(shapes, 2))
        assert all(shape.distance(whole.exterior) >= gap - 1e-9 for shape in shapes)
        assert all(whole.contains(shape) for shape in shapes)

    report = check_map(environment)
    assert report.warnings == ()
    assert report.narrowest_gap is None or report.narrowest_gap.width >= gap - 1e-6
    assert list(environment.starts) == ["corner", "centre", "uniform"]
    digits = 2 if gap >= 0.5 else 3
    assert all(value == round(value, digits) for value in list_coordinates(environment))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["polygons", "blocks", "rooms", "mazes"])
def test_maps_may_be_large(kind):
    environment = generate_map(0, kind=kind, obstacles=250, side=50.0)
    assert len(environment.free.geoms) == 1
    assert len(environment.obstacles) > 50


@settings(max_examples=20)
@given(draw_requests())
def test_saved_maps_are_the_same(tmp_path_factory, words):
    environment = generate_map(**words)
    path = tmp_path_factory.mktemp("maps") / "generated.json"
    save_map(environment, path)
    assert load_map(path) == environment
    assert environment.extra["generator"] == {
        **{key: words[key] for key in ("kind", "seed", "obstacles", "area")},
        **{f"{key}_m": words[key] for key in ("gap", "width", "height")},
    }
    assert str(words["seed"]) in environment.name
    for word in (words["kind"], f"seed {words['seed']}", f"{words['gap']:g} m"):
        assert word in f"{environment.name} {environment.description}"


@pytest.mark.slow
@pytest.mark.parametrize("kind", GENERATORS)
def test_starts_have_room_for_a_team(kind):
    for seed in range(12):
        environment = generate_map(seed, kind=kind)
        corner = environment.starts["corner"]
        assert environment.free.contains(shapely.Point(corner.center).buffer(corner.radius))
        off = np.abs(np.array(corner.center) - [[0, 0], [10, 0], [0, 10], [10, 10]]).max(axis=1)
        assert corner.radius < off.min() <= 1.3
        middle = np.hypot(*(np.array(environment.starts["centre"].center) - 5.0))
        assert middle <= 3.0 * np.sqrt(2.0) + 0.01
        for name in environment.starts:
            assert environment.start(name).sample(8, seed=seed).shape == (8, 2)


def test_the_same_seed_gives_the_same_map_and_another_seed_another():
    for kind in GENERATORS:
        maps = [generate_map(seed, kind=kind) for seed in range(3)]
        assert [generate_map(seed, kind=kind) for seed in range(3)] == maps
        assert len({environment.obstacles for environment in maps}) == 3


def compute_digest(environment):
    return hashlib.sha256(json.dumps(to_json(environment)).encode()).hexdigest()[:16]


@pytest.mark.parametrize(
    ("words", "expected"),
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
def test_maps_of_earlier_studies_do_not_change(words, expected):
    """Bit for bit: a seed in a paper must give the same map in every version."""
    assert compute_digest(generate_map(**words)) == expected


@pytest.mark.slow
def test_maps_do_not_depend_on_the_process():
    script = (
        "import sys\n"
        "from robocov.generator import GENERATORS, generate_map\n"
        "from robocov.mapfile import dump_map\n"
        "sys.stdout.write(''.join(dump_map(generate_map(5, kind=kind)) for kind in GENERATORS))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "".join(dump_map(generate_map(5, kind=kind)) for kind in GENERATORS)


def test_parameters_may_be_numpy_scalars():
    plain = generate_map(4, obstacles=5, area=0.125, gap=0.5, side=8.0)
    assert (
        generate_map(
            np.int64(4), obstacles=np.int32(5), area=np.float64(0.125), gap=np.float32(0.5), side=np.int64(8)
        )
        == plain
    )


@pytest.mark.slow
def test_the_shapes_of_polygons_are_mixed():
    counts = {"convex": 0, 6: 0, 8: 0}
    for seed in range(60):
        for obstacle in generate_map(seed, obstacles=5, area=0.2).obstacles:
            convex = obstacle.polygon.convex_hull.area - obstacle.polygon.area < 0.05
            counts["convex" if convex else len(obstacle.vertices)] += 1
    # of 300, with chances of 0.6, 0.2 and 0.2
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
    ("words", "message"),
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
def test_parameters_out_of_range_are_named(words, message):
    with pytest.raises(ParameterError) as caught:
        generate_map(**{"seed": 0, **words})
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    "words",
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
def test_impossible_requests_are_rejected(words):
    with pytest.raises(ParameterError) as caught:
        generate_map(0, **words)
    assert str(caught.value).startswith(
        f"area: no layout of {words['obstacles']} {GENERATORS[words['kind']].counted} was found "
        f"that blocks {words['area']:g} of "
    )


def square(x, y, side=1.0):
    return PolygonObstacle(((x, y), (x + side, y), (x + side, y + side), (x, y + side)))


@pytest.mark.parametrize(
    ("layout", "area", "good"),
    [
        ([square(3, 3), square(4.6, 3)], 0.02, True),
        ([square(3, 3), square(4.5, 3)], 0.02, False),  # a narrow gap
        ([square(3, 3), square(6, 3, 1.3)], 0.02, False),  # too much
        ([square(3, 3), square(6, 3, 0.5)], 0.02, False),  # too little
        ([square(3, 3), square(3.5, 3), square(3, 3.5)], 0.03, False),  # overlaps do not count twice
        ([square(3, 3), square(3.5, 3), square(3, 3.5)], 0.0175, True),
        ([square(3, 3), PolygonObstacle(((6, 6), (7, 7), (7, 6), (6, 7)))], 0.015, False),  # not valid
        ([WallObstacle(((4.8, 0), (4.8, 10)), 0.2)], 0.02, False),  # two components
        ([WallObstacle(((4.8, 0), (4.8, 9.41)), 0.2)], 0.02, False),
        ([WallObstacle(((4.8, 0), (4.8, 9.39)), 0.2)], 0.02, True),
        (None, 0.02, False),
    ],
)
def test_layouts_of_registered_kinds_are_checked(layout, area, good, monkeypatch):
    drawn = []

    def build_layout(request, corner, rng):
        drawn.append(rng.random())
        return layout

    mine = replace(GENERATORS["polygons"], layout=build_layout, counted="things")
    monkeypatch.setitem(generator.GENERATORS, "mine", mine)
    if good:
        environment = generate_map(0, kind="mine", area=area)
        assert environment.obstacles == tuple(layout)
        assert environment.name == "mine 0"
    else:
        with pytest.raises(ParameterError, match="of 6 things was found"):
            generate_map(0, kind="mine", area=area)
        # every attempt has random numbers of its own
        assert len(set(drawn)) == len(drawn) > 1


def test_every_kind_has_a_description_of_one_line():
    for kind in GENERATORS.values():
        assert 10 < len(kind.description) < 100
        assert "\n" not in kind.description
