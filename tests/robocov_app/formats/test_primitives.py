"""Circles and walls of drawings are kept where possible, and the free space does not change."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
import shapely
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import MultiPolygon, Polygon, box

from robocov.environment import CircleObstacle, Environment, Obstacle, PolygonObstacle, WallObstacle
from robocov_app.formats import ReadOptions, import_map
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.conversion.conversion_options import Shaping
from robocov_app.formats.geometry.conversion.environment import build_environment

ROOM = box(0, 0, 20, 16)
ARC = tuple((10 + 4 * math.cos(k / 100), 5 + 4 * math.sin(k / 100)) for k in range(314))

_POINT = st.tuples(*(st.floats(0.0, far).map(lambda value: round(value, 3)) for far in (20.0, 16.0)))
_CIRCLE = st.builds(CircleObstacle, _POINT, st.floats(0.05, 2.0))
_WALL = st.builds(
    WallObstacle, st.lists(_POINT, min_size=2, max_size=4, unique=True).map(tuple), st.floats(0.05, 0.6)
)
_BLOCK = st.builds(
    lambda at, width, height: box(*at, at[0] + width, at[1] + height),
    _POINT,
    st.floats(0.1, 3.0),
    st.floats(0.1, 3.0),
)


def read_shapes(primitives: list[Any], blocks: list[Polygon]) -> ForeignMap:
    solid = shapely.union_all([*blocks, *(one.polygon for one in primitives)])
    free = MultiPolygon([p for p in shapely.get_parts(ROOM - solid).tolist() if p.area > 0])
    return ForeignMap("plan", "", free, "test", boundary=ROOM, primitives=tuple(primitives))


def build_map(primitives: list[Any], *blocks: Polygon, **shaping: Any) -> Environment:
    return build_environment(read_shapes(primitives, list(blocks)), Shaping(**shaping), "plan")[0]


@settings(deadline=None, max_examples=count_examples(60), suppress_health_check=[HealthCheck.too_slow])
@example(
    # The first circle ends at the boundary, and extends from it by a little more than the tolerance.
    [CircleObstacle((0.0, 1.0), 0.21875), CircleObstacle((2.0, 2.0), 1.0)],
    [],
    [],
    0.2,
)
@example(
    # The first circle would leave a pocket in the corner, which was a part of its own and left out.
    [CircleObstacle((1.0, 1.0), 1.25), CircleObstacle((2.0, 4.0), 1.0)],
    [],
    [],
    0.2,
)
@example(
    # The second circle would leave out the block that extends from it by more than the tolerance.
    [CircleObstacle((2.0, 2.0), 1.0), CircleObstacle((5.5, 0.25), 1.25)],
    [],
    [box(5.0, 0.0, 6.0, 1.75)],
    0.2,
)
@given(
    st.lists(_CIRCLE, max_size=5),
    st.lists(_WALL, max_size=5),
    st.lists(_BLOCK, max_size=3),
    st.sampled_from([0.0, 0.02, 0.2]),
)
def test_primitives_preserve_the_free_space(
    circles: list[CircleObstacle], walls: list[WallObstacle], blocks: list[Polygon], tolerance: float
) -> None:
    foreign = read_shapes([*circles, *walls], blocks)
    parts = sorted(foreign.free.geoms, key=lambda part: -part.area)
    if not parts or not shapely.maximum_inscribed_circle(parts[0], tolerance=0.01).length > 0.5:
        return
    environment, report = build_environment(foreign, Shaping(simplify=tolerance), "plan")
    difference = shapely.symmetric_difference(environment.free, parts[0])
    # Twice the tolerance: both the drawing and the primitives may have moved.
    assert difference.area <= 2 * (tolerance + 2e-4) * parts[0].length
    assert report.obstacles == len(environment.obstacles)
    # A circle at the boundary may cut off a part of the free space. It is a polygon then.
    others = [ROOM.exterior, *blocks, *(one.polygon for one in (*circles, *walls))]
    for circle in circles:
        # What is nearer than that may be drawn over the circle.
        alone = sum(shapely.dwithin(circle.polygon, other, 1e-3 + tolerance) for other in others) == 1
        if alone and parts[0].buffer(1e-9).covers(circle.polygon.exterior) and circle.radius > 2 * tolerance:
            near = [o for o in environment.obstacles if isinstance(o, CircleObstacle)]
            assert any(abs(o.radius - circle.radius) < 1e-3 for o in near)


def test_primitives_keep_their_names_and_others_are_polygons() -> None:
    pillar = CircleObstacle((4.0, 4.0), 0.5, "pillar")
    wall = WallObstacle(((10.0, -1.0), (10.0, 6.0), (12.0, 6.0)), 0.2, "wall")
    environment = build_map([pillar, wall], box(15, 10, 17, 12))
    assert environment.obstacles[1:] == (pillar, wall)
    assert isinstance(environment.obstacles[0], PolygonObstacle)
    assert environment.free_area == pytest.approx(320 - 4 - pillar.polygon.area - 1.6)


@pytest.mark.parametrize(
    ("primitives", "blocks"),
    [
        pytest.param([CircleObstacle((4, 4), 0.5)], [box(4, 3.8, 6, 4.2)], id="a part of something else"),
        pytest.param([CircleObstacle((4, 4), 0.5)], [box(3, 3, 5, 5)], id="within something else"),
        pytest.param(
            [WallObstacle(((2, 4), (6, 4)), 0.2)], [box(1.975, 3.875, 6.025, 4.125)], id="a little larger"
        ),
        pytest.param([WallObstacle(ARC, 0.2)], [], id="of more points than the polygon has"),
        pytest.param([CircleObstacle((4, 4), 1)], [box(4, 3.98, 5.4, 4.02)], id="with a thin spike"),
        pytest.param(
            [WallObstacle(((4, 4), (8, 4), (8, 8), (4, 8), (4, 4)), 0.2)], [], id="around what is cut off"
        ),
    ],
)
def test_combined_shapes_stay_polygons(primitives: list[Obstacle], blocks: list[Polygon]) -> None:
    environment = build_map(primitives, *blocks)
    assert all(isinstance(one, PolygonObstacle) for one in environment.obstacles)


def test_a_circle_is_kept_if_its_rounded_polygon_has_more_sides() -> None:
    circle = CircleObstacle((4.0, 4.0), 0.50676)
    assert len(circle.polygon.exterior.coords) != len(CircleObstacle((4, 4), 0.5068).polygon.exterior.coords)
    assert build_map([circle], simplify=0.0).obstacles == (CircleObstacle((4.0, 4.0), 0.5068),)


def test_filled_gaps_stay_filled() -> None:
    # The wedge below the wall is so flat that both results are within the tolerance.
    circles = [CircleObstacle((1.0, 2.0), 1.0), CircleObstacle((3.0, 0.0), 1.0)]
    environment = build_map([*circles, WallObstacle(((0, 0), (3, 1)), 0.5)], simplify=0.2)
    assert len(environment.free.geoms) == 1
    assert [one for one in environment.obstacles if isinstance(one, CircleObstacle)] == circles[:1]


# fmt: off
DXF = [
    *(0, "SECTION", 2, "HEADER", 9, "$ACADVER", 1, "AC1015", 9, "$INSUNITS", 70, 6, 0, "ENDSEC", 0,
        "SECTION", 2, "ENTITIES"),
    *(0, "LWPOLYLINE", 100, "AcDbEntity", 8, "boundary", 100, "AcDbPolyline", 90, 4, 70, 1, 10, 0, 20, 0,
        10, 9, 20, 0, 10, 9, 20, 6, 10, 0, 20, 6),
    *(0, "CIRCLE", 8, "pillars", 10, 3, 20, 3, 40, 0.5),
    *(0, "LINE", 8, "walls", 10, 5, 20, 0, 11, 5, 21, 2.5),
    *(0, "LWPOLYLINE", 100, "AcDbEntity", 8, "walls", 100, "AcDbPolyline", 43, 0.3, 90, 3, 70, 0, 10, 7,
        20, 2, 10, 8, 20, 2, 10, 8, 20, 5),
    *(0, "ENDSEC", 0, "EOF"),
]
# fmt: on
SVG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 6"><rect id="boundary" width="9" height="6"/>
<circle id="pillars" cx="3" cy="3" r="0.5"/><path id="walls" d="M5 6V3.5" stroke="#000" stroke-width=".1"/>
<polyline id="walls" points="7,4 8,4 8,1" fill="none" stroke="#000" stroke-width=".3"/>
<line x1="1" y1="1" x2="2" y2="1" stroke="#000" stroke-width=".2" stroke-linecap="square"/>
<line x1="1" y1="2" x2="2" y2="2" stroke="#000" stroke-width=".2" stroke-linecap="round"/></svg>"""
GEOJSON = {
    "type": "GeometryCollection",
    "geometries": [
        {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 6], [0, 6], [0, 0]]]},
        {"type": "Point", "coordinates": [3, 3]},
        {"type": "LineString", "coordinates": [[5, 0], [5, 2.5]]},
    ],
}
WKT = "POLYGON ((0 0, 9 0, 9 6, 0 6, 0 0))\nPOINT (3 3)\nLINESTRING (5 0, 5 2.5)"


@pytest.mark.parametrize(
    ("name", "text", "options", "has_names", "other_count"),
    [
        ("plan.dxf", "\n".join(map(str, DXF)) + "\n", {}, True, 1),
        ("plan.svg", SVG, {"scale": 1.0}, True, 3),
        ("plan.geojson", json.dumps(GEOJSON), {"pillar": 0.5, "units": "meters"}, False, 0),
        ("plan.wkt", WKT, {"pillar": 0.5}, False, 0),
    ],
    ids=["dxf", "svg", "geojson", "wkt"],
)
def test_primitives_of_a_file_are_kept(
    tmp_path: Path, name: str, text: str, options: dict[str, Any], has_names: bool, other_count: int
) -> None:
    path = tmp_path / name
    path.write_text(text)
    environment, _, _ = import_map(path, options=ReadOptions(**options))
    circle = CircleObstacle((3.0, 3.0), 0.5, "pillars" if has_names else None)
    wall = WallObstacle(((5.0, 0.0), (5.0, 2.5)), 0.1, "walls" if has_names else None)
    assert circle in environment.obstacles
    walls = [obstacle for obstacle in environment.obstacles if isinstance(obstacle, WallObstacle)]
    assert wall in walls or WallObstacle(wall.points[::-1], 0.1, wall.name) in walls
    assert len(environment.obstacles) == 2 + other_count
    if other_count:
        assert any(wall.width == 0.3 and len(wall.points) == 3 for wall in walls)
    if name == "plan.svg":
        # A square cap lengthens the wall by half its width; a line with round caps becomes a polygon.
        assert WallObstacle(((0.9, 5.0), (2.1, 5.0)), 0.2) in walls
        assert sum(isinstance(obstacle, PolygonObstacle) for obstacle in environment.obstacles) == 1
