"""Shapes without an area or a length: every format leaves them out and reports them, without a traceback."""

import json
from pathlib import Path

import pytest

from robocov.errors import MapError
from robocov_app.formats import ReadOptions, import_map

NODES = '<node id="1" lat="48" lon="11"/><node id="2" lat="48.001" lon="11"/>'


def build_geojson(kind: str, coordinates: object) -> str:
    return json.dumps({"type": kind, "units": "meters", "coordinates": coordinates})


def build_svg(body: str) -> str:
    return f'<svg xmlns="http://www.w3.org/2000/svg">{body}</svg>'


def build_dxf(*pairs: object) -> str:
    return "\n".join(map(str, [0, "SECTION", 2, "ENTITIES", *pairs, 0, "ENDSEC", 0, "EOF", ""]))


def build_osm(*nodes: int, **tags: str) -> str:
    refs = "".join(f'<nd ref="{number}"/>' for number in nodes)
    given = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
    return f'<osm version="0.6">{NODES}<way id="9">{refs}{given}</way></osm>'


def build_overpass(*nodes: int, **tags: str) -> str:
    points = [{"type": "node", "id": k, "lat": 48 + k / 1000, "lon": 11} for k in (1, 2)]
    way = {"type": "way", "id": 9, "nodes": nodes, "tags": tags}
    return json.dumps({"osm3s": {}, "elements": [*points, way]})


NONE = "expected at least one closed outline or line, got none"
CASES: list[tuple[str, str, str]] = [
    ("osm", build_osm(1, 1, 1, building="yes"), NONE),
    ("osm", build_osm(1, 2, 1, building="yes"), NONE),
    ("osm", build_osm(1, building="yes"), NONE),
    ("osm", build_osm(building="yes"), NONE),
    ("osm", build_osm(1, 1, barrier="wall"), NONE),
    ("osm", build_osm(1, 1, 1, indoor="room"), NONE),
    ("osm", build_osm(1, 1, indoor="wall"), NONE),
    ("json", build_overpass(1, 1, 1, building="yes"), NONE),
    ("json", build_overpass(1, 2, 1, indoor="room"), NONE),
    ("json", build_overpass(building="yes"), NONE),
    ("json", "[[[1, 1], [1, 1], [1, 1]]]", NONE),
    ("json", '{"vertices": [1, 1, 1, 1, 1, 1]}', NONE),
    ("json", '{"verts": [[1, 1], [1, 1], [1, 1]]}', "expected at least 3 different points, got 1"),
    ("geojson", build_geojson("Polygon", [[[1, 1], [1, 1], [1, 1]]]), NONE),
    ("geojson", build_geojson("Polygon", [[[0, 0], [2, 0], [0, 0]]]), NONE),
    ("geojson", build_geojson("Polygon", [[]]), "a list of at least 1 point"),
    ("geojson", build_geojson("MultiPolygon", [[]]), NONE),
    ("geojson", build_geojson("LineString", [[1, 1], [1, 1]]), NONE),
    ("wkt", "POLYGON((1 1, 1 1, 1 1))", NONE),
    ("wkt", "POLYGON((1 1, 2 1, 1 1), (1 1, 1 1, 1 1))", NONE),
    ("wkt", "LINESTRING(1 1, 1 1)", NONE),
    ("wkt", "MULTIPOLYGON(EMPTY, ((1 1)))", NONE),
    ("svg", build_svg('<path d="M1 1L1 1z"/>'), NONE),
    ("svg", build_svg('<polygon points="1,1"/>'), NONE),
    ("svg", build_svg('<ellipse rx="0" ry="1"/><rect width="1" height="0"/>'), NONE),
    ("svg", build_svg('<line x1="1" y1="1" x2="1" y2="1" stroke="red"/>'), NONE),
    ("dxf", build_dxf(0, "LINE", 8, 0, 10, 1, 20, 1, 11, 1, 21, 1), NONE),
    ("dxf", build_dxf(0, "CIRCLE", 8, 0, 10, 0, 20, 0, 40, 0), NONE),
    ("dxf", build_dxf(0, "SOLID", 8, 0, 10, 0, 20, 0, 11, 0, 21, 0, 12, 0, 22, 0), NONE),
    ("world", "model ( block ( points 1 point[0] [1 1] ) )", NONE),
    ("world", "model ( size [0 0 0] )", "size: expected a number"),
]


@pytest.mark.parametrize(("suffix", "text", "expected"), CASES)
def test_shapes_without_extent_are_omitted(tmp_path: Path, suffix: str, text: str, expected: str) -> None:
    path = tmp_path / f"plan.{suffix}"
    path.write_text(text)
    options = ReadOptions(scale=1.0) if suffix in ("svg", "dxf") else ReadOptions()
    with pytest.raises(MapError) as caught:
        import_map(path, options=options)
    assert expected in str(caught.value) and str(caught.value).isprintable()
