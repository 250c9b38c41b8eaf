"""GeoJSON, compared with shapely's reader; degrees and meters; names; rejected files."""

import json
from pathlib import Path
from typing import Any

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from vector_files import build_square, read

from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ReadOptions, detect_format, import_map


def build_feature(geometry: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def build_polygon(*rings: Any) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": list(rings)}


def build_collection(*features: Any, **members: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", **members, "features": list(features)}


HALL = build_polygon(build_square(0, 0, 20, 10), build_square(1, 1, 2, 2))


@pytest.mark.parametrize(
    "document",
    [
        HALL,
        build_feature(HALL),
        build_collection(build_feature(HALL)),
        {"type": "GeometryCollection", "geometries": [HALL]},
    ],
)
def test_polygons_are_found_in_every_container(tmp_path: Path, document: Any) -> None:
    foreign = read(tmp_path, "geojson", document)
    assert foreign.free.equals(shapely.from_geojson(json.dumps(HALL)))
    assert detect_format(tmp_path / "plan.geojson").name == "geojson"


def test_a_floor_that_reaches_to_the_middle_of_the_walls_is_the_boundary(tmp_path: Path) -> None:
    document = build_collection(
        build_feature(build_polygon(build_square(0, 0, 10, 10), build_square(1, 1, 8, 8)), name="walls"),
        build_feature(build_polygon(build_square(0.2, 0.2, 9.6, 9.6)), name="floor"),
    )
    foreign = read(tmp_path, "geojson", document)
    assert foreign.boundary_source == "the largest closed outline, 'floor', of 92.16 m²"
    assert foreign.free.equals(shapely.box(1, 1, 9, 9))


def test_footprints_in_a_boundary_are_obstacles(tmp_path: Path) -> None:
    document = build_collection(
        build_feature(build_polygon(build_square(0, 0, 20, 10)), name="yard"),
        build_feature(build_polygon(build_square(1, 1, 2, 2)), name="shed"),
        build_feature(
            {"type": "MultiPolygon", "coordinates": [[build_square(5, 1, 2, 2)], [build_square(9, 1, 2, 2)]]}
        ),
        build_feature({"type": "LineString", "coordinates": [[15, 0], [15, 5]]}, kind="fence"),
        build_feature({"type": "Point", "coordinates": [1, 8, 3]}),
        build_feature(None),
        name="the yard",
        description="With\nsheds.",
    )
    foreign = read(tmp_path, "geojson", document, thickness=0.2)
    assert (foreign.name, foreign.description) == ("the yard", "With\\nsheds.")
    assert foreign.free.area == pytest.approx(200 - 12 - 1)
    assert foreign.boundary_source == "the largest closed outline, 'yard', of 200 m²"
    assert foreign.dropped == (
        "1 feature without a geometry",
        "1 point (--pillar RADIUS makes pillars of them)",
        "1 third coordinate, z from 3 to 3",
    )
    assert read(tmp_path, "geojson", document, skip=("fence", "shed")).free.area == pytest.approx(200 - 8)
    with_pillar = read(tmp_path, "geojson", document, pillar=0.3)
    assert with_pillar.free.area == pytest.approx(200 - 12 - 0.5 - 0.2827, abs=0.01)


def test_a_line_with_the_name_of_the_boundary_is_a_wall(tmp_path: Path) -> None:
    document = build_collection(
        build_feature(build_polygon(build_square(0, 0, 20, 10)), kind="boundary"),
        build_feature(build_polygon(build_square(1, 1, 2, 2)), kind="obstacle", name="boundary"),
    )
    assert read(tmp_path, "geojson", document).free.area == pytest.approx(196.0)


def test_degrees_are_projected(tmp_path: Path) -> None:
    foreign = read(tmp_path, "geojson", build_polygon(build_square(8.4, 49, 0.001, 0.0005)))
    assert foreign.free.area == pytest.approx(73.17 * 55.6, rel=1e-3)
    assert foreign.notes[0].startswith(
        "degrees projected to meters about longitude 8.40050, latitude 49.00025"
    )
    line = [[179.9999, 10], [-179.9999, 10], [-179.9999, 10.0001], [179.9999, 10.0001]]
    across = read(tmp_path, "geojson", build_polygon(line))
    assert across.free.area == pytest.approx(21.93 * 11.06, rel=1e-3)
    assert across.repaired == ("1 ring closed: the last point was not the first",)


def test_coordinate_systems_in_the_file_are_used(tmp_path: Path) -> None:
    utm = build_polygon(build_square(456000, 5430000, 100, 50))
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    assert read(tmp_path, "geojson", {**utm, "crs": crs}).free.area == pytest.approx(5000, rel=2e-3)
    small = build_polygon(build_square(0, 0, 0.05, 0.05))
    assert read(tmp_path, "geojson", small).free.area > 1e6
    assert read(tmp_path, "geojson", {**small, "units": "meters"}).free.area == pytest.approx(0.0025)
    assert read(tmp_path, "geojson", {**small, "units": "metres"}).free.area == pytest.approx(0.0025)
    here = read(tmp_path, "geojson", {**small, "origin": [0.0, 0.0]})
    assert here.free.bounds[0] == pytest.approx(0.0, abs=1e-9)
    assert read(tmp_path, "geojson", small, units="meters", scale=100.0).free.area == pytest.approx(25.0)


@pytest.mark.parametrize(
    ("document", "expected"),
    [
        (
            '{"type":"Polygon",\n"coordinates":[[[0,0],[1,"a"]]]}',
            ":2:23: coordinates[0][1]: expected a point",
        ),
        (
            '{"type":"Polygon",\n"coordinates":[[[0,0],[1,NaN]]]}',
            ":2:26: coordinates[0][1][1]: expected a finite",
        ),
        (build_polygon([[0, 0], [1, True]]), "coordinates[0][1]: expected a point"),
        (build_polygon([[0, 0], [1, 1, 1, 1, 1]]), "coordinates[0][1]: expected a point"),
        (build_polygon([[0, 0], [1e200, 1]]), "coordinates[0][1]: expected a point"),
        (build_polygon(7), "coordinates[0]: expected a list of at least 1 point"),
        ({"type": "Polygon"}, "coordinates: expected a list of rings"),
        ({"type": "MultiPolygon", "coordinates": {}}, "coordinates: expected a list, got {}"),
        (
            {"type": "LineString", "coordinates": [[0, 0]]},
            "coordinates: expected a list of at least 2 points",
        ),
        ({"type": "Topology"}, "type: expected GeoJSON, not TopoJSON"),
        ({"type": "Curve"}, "type: expected one of Point, LineString"),
        ([], "expected one of Point"),
        (build_collection(7), "features[0]: expected a Feature, got 7"),
        (build_collection(features=1), None),
        ({"type": "FeatureCollection"}, "features: expected a list of features"),
        (
            build_collection(build_feature(HALL) | {"properties": 3}),
            "features[0].properties: expected an object",
        ),
        ({"type": "GeometryCollection"}, "geometries: expected a list of geometries"),
        ({**HALL, "crs": {"type": "link"}}, "crs: expected the name of a reference system"),
        ({**HALL, "units": "feet"}, "units: expected meters or degrees"),
        ({**HALL, "origin": [0]}, "origin: expected longitude and latitude"),
        ({**HALL, "origin": [0, 95]}, "origin: expected longitude and latitude"),
        ("{", "not JSON"),
    ],
)
def test_invalid_geojson_is_reported_with_its_path(
    tmp_path: Path, document: Any, expected: str | None
) -> None:
    path = tmp_path / "plan.geojson"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    with pytest.raises(MapError) as caught:
        IMPORTERS["geojson"].read(path, ReadOptions())
    message = str(caught.value)
    assert message.startswith(f"{path}:")
    assert "\n" not in message
    assert expected is None or expected in message


def test_two_reference_systems_are_rejected(tmp_path: Path) -> None:
    first = build_feature(HALL) | {"crs": {"properties": {"name": "EPSG:25832"}}}
    second = build_feature(HALL) | {"crs": {"properties": {"name": "EPSG:25833"}}}
    with pytest.raises(MapError, match=r"features\[1\]\.crs: expected the same system as before, EPSG:25832"):
        read(tmp_path, "geojson", build_collection(first, second))


_COORDINATE = st.floats(-4e3, 4e3).map(lambda value: round(value, 4))
_POINT = st.tuples(_COORDINATE, _COORDINATE)


@settings(max_examples=count_examples(60))
@given(st.lists(st.lists(_POINT, min_size=3, max_size=6).map(shapely.Polygon), min_size=1, max_size=4))
def test_free_space_is_what_shapely_reads(tmp_path_factory: pytest.TempPathFactory, polygons: Any) -> None:
    text = shapely.to_geojson(shapely.MultiPolygon(polygons))
    try:
        found = read(tmp_path_factory.getbasetemp(), "geojson", text, units="meters", outlines="free").free
    except MapError as error:
        assert "without an area" in str(error)
        return
    # A grid is needed, because without it GEOS may lose parts.
    valid = shapely.make_valid(polygons, method="structure", keep_collapsed=False)
    expected = shapely.union_all(valid, grid_size=1e-7)
    length = max(sum(polygon.length for polygon in polygons), 1.0)
    assert shapely.symmetric_difference(found, expected, grid_size=1e-7).area <= 2e-6 * length


# Sequences


FEATURE = '{"type": "Feature", "properties": {"name": "hall"}, "geometry": %s}'
WEST = '{"type": "Polygon", "coordinates": [[[0, 0], [400, 0], [400, 400], [0, 400], [0, 0]]]}'
EAST = '{"type": "Polygon", "coordinates": [[[400, 0], [900, 0], [900, 400], [400, 400], [400, 0]]]}'


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("plan.geojsonl", f"{FEATURE % WEST}\n{FEATURE % EAST}\n"),
        ("plan.ndjson", f"\ufeff{WEST}\r\n\r\n  {FEATURE % EAST}"),
        ("plan.geojson", f"{FEATURE % WEST}\n{EAST}\n"),
        ("plan.geojson", f"\x1e{FEATURE % WEST}\n\x1e{EAST}\n"),
        ("plan.json", f"\x1e\x1e{FEATURE % WEST}".replace(", ", ",\n") + f"\n\x1e{EAST}"),
        ("plan.geojsonl", f'{{"type": "FeatureCollection", "features": [{FEATURE % WEST}]}}\n{EAST}'),
    ],
    ids=["lines", "mark", "unnamed", "separators", "pretty", "collection"],
)
def test_a_sequence_of_texts_is_read_as_one_map(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_bytes(text.encode())
    assert detect_format(path) is IMPORTERS["geojson"]
    environment, _, _ = import_map(path, options=ReadOptions(units="meters"))
    assert environment.free_area == pytest.approx(900 * 400)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            f"{WEST}\n\n" + '{"type": "Point", "coordinates": [1, "x"]}',
            r"plan\.geojsonl:3:35: \[1\]\.coordinates",
        ),
        (f"{WEST}\n{EAST[:-1]}\n", r"plan\.geojsonl:3:"),
        (f"{WEST}\n3\n", r"plan\.geojsonl:2:1: \[1\]: expected one of Point, "),
        (f"\x1e{WEST}\n\x1e{WEST[:40]}\n\x1e{EAST}\n", r"plan\.geojsonl:3:1: .*not JSON"),
    ],
    ids=["value", "cut", "number", "separated"],
)
def test_mistakes_in_a_sequence_are_reported_with_the_line(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "plan.geojsonl"
    path.write_text(text)
    with pytest.raises(MapError, match=expected):
        import_map(path)
