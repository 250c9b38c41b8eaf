"""Well-known text, compared with shapely's reader; additions of other programs; rejected texts."""

from pathlib import Path
from typing import Any

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import Polygon, box
from vector_files import read

from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ReadOptions, Shaping, import_map
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.vector.wkt.parser import WktParser

HALL = "POLYGON ((0 0, 10 0, 10 5, 0 5, 0 0), (1 1, 2 1, 2 2, 1 2, 1 1))"
LARGE_HALL = box(0, 0, 20, 10)
CORRIDORS = [box(-2, 4, 12, 6), box(9, -3, 11, 8), box(5, 2, 22, 3), box(3, 8, 4, 9)]
"""Corridors that overlap the large hall; the last one is inside it."""


def test_a_walkable_area_is_free_space_with_obstacles(tmp_path: Path) -> None:
    foreign = read(tmp_path, "wkt", HALL)
    assert foreign.free.equals(shapely.from_wkt(HALL))
    assert (foreign.boundary, foreign.vertices_read, foreign.notes) == (None, 10, ())
    environment, report, _ = import_map(tmp_path / "plan.wkt", shaping=Shaping(simplify=0.0))
    assert environment.free_area == pytest.approx(49.0)
    assert (len(environment.obstacles), report.repaired, report.dropped) == (1, (), ())


@pytest.mark.parametrize(
    "before",
    ["\ufeff", "# JuPedSim\r\n\r\n", "-- made by hand\n  ", "SRID=0;", "srid = 0 ;\n"],
    ids=["BOM", "comment", "SQL comment", "SRID", "loose SRID"],
)
def test_prefixes_of_programs_are_accepted(tmp_path: Path, before: str) -> None:
    assert read(tmp_path, "wkt", before + HALL.replace(", ", " ,\r\n")).free.area == pytest.approx(49.0)


def test_utf_16_is_read(tmp_path: Path) -> None:
    (tmp_path / "plan.wkt").write_bytes(HALL.encode("utf-16"))
    assert IMPORTERS["wkt"].read(tmp_path / "plan.wkt", ReadOptions()).free.area == pytest.approx(49.0)


@pytest.mark.parametrize("separator", ["\n", ";", ",\n", " "])
def test_several_geometries_are_read(tmp_path: Path, separator: str) -> None:
    parts = [
        HALL,
        "POLYGON((10 1, 14 1, 14 2, 10 2, 10 1))",
        "LINESTRING(5 0, 5 2)",
        "POINT(1 1)",
        "POLYGON EMPTY",
    ]
    foreign = read(tmp_path, "wkt", separator.join(parts), thickness=0.2)
    assert foreign.free.area == pytest.approx(49 + 4 - 0.4)
    assert foreign.dropped == (
        "1 geometry without coordinates",
        "1 point (--pillar RADIUS makes pillars of them)",
    )


def test_empty_points_are_omitted(tmp_path: Path) -> None:
    foreign = read(tmp_path, "wkt", f"{HALL} MULTIPOINT(EMPTY, EMPTY)", pillar=0.2)
    assert foreign.free.area == pytest.approx(49.0)
    assert foreign.notes == ()


@pytest.mark.parametrize(
    "points",
    ["1 1, EMPTY, 3 3", "EMPTY, 1 1, 3 3", "1 1, (3 3), EMPTY", "(1 1), EMPTY, 3 3", "1 1 , 3 3,EMPTY"],
)
def test_points_with_and_without_brackets_may_be_mixed_with_empty_ones(tmp_path: Path, points: str) -> None:
    foreign = read(tmp_path, "wkt", f"{HALL} MULTIPOINT({points})", pillar=0.2)
    assert foreign.notes == ("2 points treated as pillars",)


@pytest.mark.parametrize(
    "layout", ["MULTIPOLYGON({})", "GEOMETRYCOLLECTION({})", "{}"], ids=["multi", "collection", "several"]
)
def test_accessible_areas_that_overlap_are_one_free_space(tmp_path: Path, layout: str) -> None:
    # Corridors that overlap a hall are not obstacles, and nothing between them is solid.
    areas = [LARGE_HALL, *CORRIDORS]
    parts = [area.wkt if "MULTI" not in layout else area.wkt.removeprefix("POLYGON ") for area in areas]
    foreign = read(tmp_path, "wkt", layout.format(",".join(parts)))
    assert foreign.free.equals(shapely.union_all(areas))
    environment, report, _ = import_map(tmp_path / "plan.wkt")
    assert environment.free_area == pytest.approx(shapely.union_all(areas).area)
    assert (len(environment.obstacles), report.dropped) == (0, ())


def test_areas_within_an_accessible_area_are_free_unless_outlines_are_solid(tmp_path: Path) -> None:
    text = ",".join(area.wkt for area in (LARGE_HALL, box(3, 8, 4, 9), box(6, 5, 7, 9)))
    assert read(tmp_path, "wkt", text).free.area == pytest.approx(200)
    assert read(tmp_path, "wkt", text, outlines="solid").free.area == pytest.approx(200 - 5)


def test_corridors_across_a_hall_are_solid_if_outlines_are(tmp_path: Path) -> None:
    text = ",".join(area.wkt for area in (LARGE_HALL, *CORRIDORS))
    free = read(tmp_path, "wkt", text, outlines="solid").free
    assert free.area == pytest.approx((LARGE_HALL - shapely.union_all(CORRIDORS)).area)


HOLED = Polygon(box(0, 0, 10, 10).exterior, [box(2, 2, 6, 6).exterior])


@pytest.mark.parametrize(
    ("others", "excluded"),
    [
        ([box(4, -2, 8, 8)], box(2, 2, 6, 6)),  # across the hole
        ([box(0, 0, 10, 10)], box(2, 2, 6, 6)),  # over all of it
        ([box(1, 1, 7, 7), box(3, 3, 4, 4)], box(2, 2, 6, 6) - box(3, 3, 4, 4)),  # and an island
        ([box(2, 2, 6, 6)], Polygon()),  # exactly in it
        (
            [HOLED, Polygon(box(8, 0, 20, 10).exterior, [box(9, 1, 12, 4).exterior])],
            box(2, 2, 6, 6) | box(9, 1, 12, 4),
        ),
    ],
    ids=["across", "over", "island", "filled", "two"],
)
def test_holes_are_excluded_from_the_union(tmp_path: Path, others: list[Polygon], excluded: Any) -> None:
    # As in JuPedSim, excluded areas are subtracted from the union of all accessible areas.
    areas = [HOLED, *others]
    expected = shapely.union_all([Polygon(area.exterior) for area in areas]) - excluded
    for text in (shapely.GeometryCollection(areas).wkt, "\n".join(area.wkt for area in areas[::-1])):
        free = read(tmp_path, "wkt", text).free
        assert free.symmetric_difference(expected).area < 1e-6


def test_many_holes_under_many_polygons_are_rejected(tmp_path: Path) -> None:
    hole = [box(x, y, x + 0.5, y + 0.5).exterior for x in range(1, 21) for y in range(1, 21)]
    areas = [
        Polygon(box(0, 0, 30, 30).exterior, hole),
        *(box(0.1, 0.1, 29, 28 + k / 1000) for k in range(200)),
    ]
    with pytest.raises(MapError, match="expected at most 50000 overlaps of holes and polygons, got more"):
        read(tmp_path, "wkt", shapely.GeometryCollection(areas).wkt)


def test_collections_are_read(tmp_path: Path) -> None:
    text = (
        "GEOMETRYCOLLECTION(POLYGON((0 0,20 0,20 10,0 10,0 0)),MULTIPOLYGON(((1 1,2 1,2 2,1 2,1 1)),"
        "((3 3,4 3,4 4,3 4,3 3),(3.2 3.2,3.4 3.2,3.4 3.4,3.2 3.4,3.2 3.2)), EMPTY),"
        "GEOMETRYCOLLECTION(TRIANGLE((6 6,8 6,8 8,6 6)),"
        "TIN(((10 1,11 1,11 2,10 1)),((12 1,13 1,13 2,12 1)))),MULTILINESTRING((5 0,5 2),EMPTY,(5 2,7 2)),"
        "MULTIPOINT((15 5),(16 5)),MULTIPOINT(17 5,18 5))"
    )
    foreign = read(tmp_path, "wkt", text, pillar=0.25, outlines="solid")
    solid = 1 + 0.96 + 2 + 0.5 + 0.5 + 0.1 * 4
    pillars = foreign.notes[-1]
    assert pillars == "4 points treated as pillars"
    assert foreign.free.area == pytest.approx(200 - solid - 4 * 3.1416 / 16, abs=0.01)


@pytest.mark.parametrize(
    "text", ["POLYGON Z ((0 0 1, 4 0 1, 4 3 2, 0 3 2, 0 0 1))", "polygonz((0 0 1,4 0 1,4 3 2,0 3 2,0 0 1))"]
)
def test_heights_are_reported(tmp_path: Path, text: str) -> None:
    foreign = read(tmp_path, "wkt", text)
    assert foreign.free.equals(box(0, 0, 4, 3))
    assert foreign.dropped == ("5 third coordinates, z from 1 to 2",)


def test_measures_are_not_heights(tmp_path: Path) -> None:
    assert read(tmp_path, "wkt", "POLYGON M ((0 0 9, 4 0 9, 4 3 9, 0 0 9))").dropped == ()
    assert (
        read(tmp_path, "wkt", "POLYGON ZM ((0 0 1 9, 4 0 1 9, 4 3 1 9, 0 0 1 9))")
        .dropped[0]
        .startswith("4 third")
    )


def test_rings_that_do_not_close_are_closed(tmp_path: Path) -> None:
    foreign = read(tmp_path, "wkt", "POLYGON((0 0, 4 0, 4 3, 0 3))")
    assert foreign.free.area == pytest.approx(12.0)
    assert foreign.repaired == ("1 ring closed: the last point was not the first",)


def test_a_reference_system_is_projected(tmp_path: Path) -> None:
    foreign = read(tmp_path, "wkt", "SRID=4326;POLYGON((8.4 49, 8.401 49, 8.401 49.001, 8.4 49.001, 8.4 49))")
    assert foreign.free.area == pytest.approx(73.17 * 111.2, rel=1e-3)
    text = "SRID=25832;POLYGON((456000 5430000,456100 5430000,456100 5430050,456000 5430050,456000 5430000))"
    assert read(tmp_path, "wkt", text).free.area == pytest.approx(5000, rel=2e-3)
    plain = read(tmp_path, "wkt", text, units="meters")
    assert plain.free.bounds == (456000, 5430000, 456100, 5430050)


def test_obstacles_are_read_on_request(tmp_path: Path) -> None:
    text = "POLYGON((0 0,1 0,1 1,0 1,0 0))\nPOLYGON((5 0,6 0,6 1,5 1,5 0))"
    assert read(tmp_path, "wkt", text).free.area == pytest.approx(2.0)
    assert read(tmp_path, "wkt", text, outlines="solid").free.area == pytest.approx(8 * 3 - 2)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ": expected at least one closed outline or line, got none"),
        ("PLOYGON((0 0, 1 1))", ":1:1: expected one of POINT, LINESTRING"),
        ("POLYGON\n((0 0, 1 0, 1 x, 0 0))", ":2:13: expected a point such as 1.5 2"),
        ("POLYGON((0 0, 10 0, 10 5, 0 nan))", ":1:27: expected a point"),
        ("POLYGON((0 0, 10 0, 10 inf, 0 1))", ":1:21: expected a point"),
        ("POLYGON((0 0, 10 0, 10, 0 1))", ":1:21: expected a point"),
        ("POLYGON((0 0, 10 0 3, 10 5, 0 1))", ":1:15: expected a point such as 1.5 2, with as many"),
        ("POLYGON((0 0, 10 0, 10 5, 0 1e999))", ":1:10: expected finite numbers"),
        ("POLYGON((0 0, 10 0, 10 5, 0 1e308))", ":1:10: expected finite numbers"),
        ("POLYGON((0 0, 10 0, 10 5, 0 1e99))", ": geometry 1: expected coordinates"),
        ("POLYGON((0 0, 10 0, 10 5, 0 1..5))", "expected a point"),
        ("POLYGON((0 0, 10 0, 10 5, 0 1", ":1:30: expected a point or ), got the end"),
        ("POLYGON((0 0, 10 0, 10 5, 0 1)", ":1:31: expected ), got the end"),
        ("POLYGON(0 0, 10 0, 10 5, 0 1)", ":1:9: expected (, got '0 0, 10 0, 10 5, 0 1)'"),
        ("POLYGON", ":1:8: expected (, got the end"),
        ("POINT(1 1, 2 2)", ":1:1: expected one point, got 2"),
        ("MULTIPOINT(1 1, EMPTY, 2)", ":1:24: expected a point such as 1.5 2"),
        ("MULTIPOINT(1 1, EMPTY, x)", ":1:24: expected a point such as 1.5 2"),
        ("MULTIPOINT(1 1, EMPTY, 2 1e999)", ":1:24: expected finite numbers"),
        ("LINESTRING(1 1)", ":1:11: expected at least 2 points, got 1"),
        ("CURVEPOLYGON((0 0, 1 0, 1 1, 0 0))", ":1:1: expected a geometry with straight edges"),
        ("GEOMETRYCOLLECTION(" * 40, "nested too deeply, expected at most 32 levels"),
        ("SRID=1;POINT(0 0);SRID=2;POINT(0 0)", ":1:19: expected one SRID for all geometries"),
        ("SRID=99999;POINT(0 0)", ": reference system EPSG:99999 is unknown"),
        (
            "POLYGON((0 0, 1 1, 2 2, 0 0))",
            ": expected at least one closed outline or line, got none (1 outline without",
        ),
        ("POLYGON((0 0, 1_0 1, 2 2, 0 0))", ":1:15: expected a point"),
        ("POLYGON((٠ 0, 1 1, 2 2, 0 0))", ":1:10: expected a point"),
    ],
)
def test_invalid_text_is_reported_with_its_position(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "plan.wkt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MapError) as caught:
        IMPORTERS["wkt"].read(path, ReadOptions())
    assert str(caught.value).startswith(str(path))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_invalid_bytes_are_rejected(tmp_path: Path) -> None:
    (tmp_path / "plan.wkt").write_bytes(b"POLYGON((0 0, 1\xff 0))")
    with pytest.raises(MapError, match="byte 15: not UTF-8, expected text"):
        IMPORTERS["wkt"].read(tmp_path / "plan.wkt", ReadOptions())


_NUMBER = st.floats(-1e6, 1e6, allow_subnormal=False)
_POINT = st.tuples(_NUMBER, _NUMBER)
_GEOMETRY = st.recursive(
    st.one_of(
        _POINT.map(shapely.Point),
        st.lists(_POINT, min_size=2, max_size=5).map(shapely.LineString),
        st.lists(_POINT, min_size=3, max_size=5).map(shapely.Polygon),
        st.lists(_POINT, min_size=1, max_size=4).map(shapely.MultiPoint),
        st.lists(st.lists(_POINT, min_size=2, max_size=4), min_size=1, max_size=3).map(
            shapely.MultiLineString
        ),
    ),
    lambda inner: st.lists(inner, max_size=3).map(shapely.GeometryCollection),
    max_leaves=6,
)


@settings(max_examples=count_examples(150))
@given(_GEOMETRY, st.booleans())
def test_coordinates_agree_with_shapely(geometry: Any, flat: bool) -> None:
    text = shapely.to_wkt(geometry, rounding_precision=-1)
    shapes = Shapes("plan", ReadOptions())
    figures = WktParser(text, "plan", shapes).parse()
    found = [tuple(point) for figure in figures for ring in figure.rings for point in ring.tolist()]
    assert found == [tuple(point) for point in shapely.get_coordinates(shapely.from_wkt(text)).tolist()]
