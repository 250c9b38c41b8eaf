"""Maps exported to vector formats and read again have the same free space up to rounding."""

import json
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pyproj
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
from robocov.errors import OutputError, ParameterError
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.formats import (
    ForeignMap,
    ReadOptions,
    Shaping,
    WriteOptions,
    build_environment,
    detect_format,
    export_map,
    import_map,
)
from robocov_app.formats.geometry.polygons import format_decimal, list_rings, snap_to_grid

FORMATS = [("svg", {}), ("wkt", {}), ("geojson", {}), ("geojson", {"origin": (180.0, -75.0)})]
AS_IT_IS = Shaping(simplify=0.0, keep="all")


def export_and_read(environment: Environment, path: Path, **options: Any) -> ForeignMap:
    """Export and read a map, and compare the free space."""
    report = export_map(environment, path, options=WriteOptions(**options))
    foreign = detect_format(path).read(path, ReadOptions())
    edge = environment.free.length
    assert report.files == (path,)
    assert report.area == environment.free_area
    # Coordinates have six decimals, so crossings of walls move by a micrometer.
    assert report.area_written == pytest.approx(foreign.free.area, abs=1e-6 * edge)
    assert foreign.free.symmetric_difference(environment.free).area <= 1e-6 * edge
    return foreign


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "options"), FORMATS)
@pytest.mark.parametrize("name", list_bundled_maps())
def test_bundled_maps_survive_every_format(
    tmp_path: Path, name: str, kind: str, options: dict[str, Any]
) -> None:
    environment = load_map(name)
    foreign = export_and_read(environment, tmp_path / f"{name}.{kind}", **options)
    again, _ = build_environment(foreign, AS_IT_IS, name)
    # Imported maps are rounded to tenths of millimeters.
    assert again.free.symmetric_difference(environment.free).area <= 1e-4 * environment.free.length
    first = (tmp_path / f"{name}.{kind}").read_bytes()
    export_map(environment, tmp_path / f"{name}.{kind}", options=WriteOptions(**options))
    assert (tmp_path / f"{name}.{kind}").read_bytes() == first


_X = st.integers(0, 2000).map(lambda n: n / 100)
_Y = st.integers(0, 1000).map(lambda n: n / 100)
_SIZE = st.integers(10, 300).map(lambda n: n / 100)


def _build_block(x: float, y: float, width: float, height: float, hole: bool) -> PolygonObstacle:
    outer = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
    a = x + width / 4
    b = y + height / 4
    inner = ((a, b), (a + width / 2, b), (a + width / 2, b + height / 2))
    return PolygonObstacle(outer, (inner,) if hole else (), "<desk> & 'chair'")


_OBSTACLE = st.one_of(
    st.builds(_build_block, _X, _Y, _SIZE, _SIZE, st.booleans()),
    st.builds(lambda x, y, radius: CircleObstacle((x, y), radius, "boundary"), _X, _Y, _SIZE),
    st.lists(st.tuples(_X, _Y), min_size=2, max_size=4, unique=True).map(
        lambda points: WallObstacle(tuple(points), 0.1)
    ),
)
_OUTLINE = st.sampled_from(
    [
        ((0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0)),
        ((-3.3, -1.1), (20.0, 0.0), (24.7, 11.3), (9.0, 7.0), (0.1, 10.0)),
        ((0.0, 10.0), (9.0, 6.0), (20.0, 10.0), (20.0, 0.0), (0.0, 0.0)),
    ]
)


@settings(max_examples=count_examples(40))
@given(_OUTLINE, st.lists(_OBSTACLE, max_size=6), st.sampled_from(FORMATS))
def test_any_map_survives_every_format(
    tmp_path_factory: pytest.TempPathFactory, outline: Any, obstacles: Any, how: tuple[str, dict[str, Any]]
) -> None:
    environment = Environment("drawn", outline, tuple(obstacles))
    if environment.free_area < 1.0 or environment.free.buffer(-0.12).is_empty:
        return
    kind, options = how
    export_and_read(environment, tmp_path_factory.getbasetemp() / f"drawn.{kind}", **options)


def test_few_digits_round_with_a_note(tmp_path: Path, cluttered: Environment) -> None:
    for kind, digits in (("wkt", 1), ("geojson", 1), ("svg", 0)):
        path = tmp_path / f"plan.{kind}"
        report = export_map(cluttered, path, options=WriteOptions(digits=digits))
        _, _, foreign = import_map(path, shaping=AS_IT_IS)
        assert report.area_written == pytest.approx(foreign.free.area, abs=1e-4)
        grid = 0.1 if digits else 0.001
        assert foreign.free.symmetric_difference(cluttered.free).area <= grid * cluttered.free.length


def test_wkt_is_jupedsims_walkable_area(tmp_path: Path, cluttered: Environment) -> None:
    path = tmp_path / "plan.wkt"
    report = export_map(cluttered, path)
    text = path.read_text()
    assert text.startswith("POLYGON ((")
    assert shapely.from_wkt(text).equals_exact(cluttered.free.geoms[0].normalize(), 1e-6, normalize=True)
    assert report.dropped[0] == "starts: corner, uniform"
    wall = Environment(
        "two", cluttered.boundary, (*cluttered.obstacles, WallObstacle(((5, 2), (12, 2)), 0.2))
    )
    report = export_map(wall, path)
    assert path.read_text().startswith("MULTIPOLYGON (((")
    assert any("parts: some programs accept only one polygon" in note for note in report.notes)


def test_geojson_has_features_with_names(tmp_path: Path) -> None:
    environment = load_map("office")
    path = tmp_path / "office.geojson"
    export_map(environment, path)
    document = json.loads(path.read_text())
    assert (document["type"], document["units"], document["name"]) == (
        "FeatureCollection",
        "meters",
        environment.name,
    )
    kinds = [feature["properties"]["kind"] for feature in document["features"]]
    assert kinds == ["boundary"] + ["obstacle"] * len(environment.obstacles)
    named = {feature["properties"].get("name") for feature in document["features"]} - {None}
    assert named == {obstacle.name for obstacle in environment.obstacles} - {None}
    for feature in document["features"]:
        shape = shapely.from_geojson(json.dumps(feature["geometry"]))
        assert shape.is_valid
        for part in shapely.get_parts(shape):
            assert part.exterior.is_ccw  # RFC 7946, section 3.1.6


def test_geojson_in_degrees_keeps_its_origin(tmp_path: Path, empty: Environment) -> None:
    path = tmp_path / "plan.geojson"
    export_map(empty, path, options=WriteOptions(origin=(8.4, 49.0)))
    ring = json.loads(path.read_text())["features"][0]["geometry"]["coordinates"][0]
    globe = pyproj.Geod(ellps="WGS84")
    east = [8.4, 49.0] in ring
    north = max(ring, key=lambda point: point[1])
    assert east
    assert globe.inv(8.4, 49.0, 8.4, north[1])[2] == pytest.approx(10.0, abs=1e-3)
    assert abs(globe.geometry_area_perimeter(shapely.Polygon(ring))[0]) == pytest.approx(100.0, abs=1e-4)


def test_svg_is_xml_at_true_scale(tmp_path: Path) -> None:
    environment = load_map("museum")
    path = tmp_path / "museum.svg"
    export_map(environment, path)
    root = ET.parse(path).getroot()
    space = {"s": "http://www.w3.org/2000/svg"}
    low_x, _, high_x, _ = environment.region.bounds
    wide = float(root.get("width", "").removesuffix("mm"))
    assert wide == pytest.approx(1000 * (high_x - low_x) * 1.06)
    assert float(root.get("viewBox", "").split()[2]) == wide
    assert root.findtext("s:title", namespaces=space) == environment.name
    assert root.find("s:path[@id='boundary']", space) is not None
    layer = root.find("s:g[@id='obstacles']", space)
    assert layer is not None
    assert len(layer) == len(environment.obstacles)
    titles = [title.text for title in layer.iterfind("*/s:title", space)]
    assert titles == [obstacle.name for obstacle in environment.obstacles if obstacle.name]


def test_svg_is_written_at_a_smaller_scale(tmp_path: Path, cluttered: Environment) -> None:
    path = tmp_path / "plan.svg"
    report = export_map(cluttered, path, options=WriteOptions(scale=0.05))
    assert report.notes == (
        "1 mm in the drawing is 0.05 m; the drawing measures 212 x 212 mm",
        "import it again with --scale 0.05",
    )
    again, _, _ = import_map(path, options=ReadOptions(scale=0.05), shaping=AS_IT_IS)
    assert again.free.symmetric_difference(cluttered.free).area < 1e-2
    with pytest.raises(Exception, match=r"expected at least 1 m, got .* at its own scale"):
        import_map(path)


def test_impossible_exports_are_rejected(
    tmp_path: Path, empty: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        export_map(empty, tmp_path / "none" / "plan.wkt")
    with pytest.raises(ParameterError, match="cell: not supported by the format wkt"):
        export_map(empty, tmp_path / "plan.wkt", options=WriteOptions(cell=0.1))
    with pytest.raises(ParameterError, match=r"origin: expected a longitude from -180 to 180"):
        WriteOptions(origin=(200, 0))
    monkeypatch.setitem(sys.modules, "pyproj", None)
    with pytest.raises(ParameterError, match=r'origin: degrees need more: .*pip install "robocov\[geo\]"'):
        export_map(empty, tmp_path / "plan.geojson", options=WriteOptions(origin=(8.4, 49.0)))
    assert list(tmp_path.iterdir()) == []


@given(st.floats(-1e6, 1e6), st.integers(0, 9))
def test_numbers_have_no_needless_decimals(value: float, digits: int) -> None:
    text = format_decimal(value, digits)
    assert float(text) == pytest.approx(round(value, digits), abs=1e-12 + abs(value) * 1e-15)
    assert "e" not in text
    assert text != "-0"
    if "." in text:
        assert not text.endswith(("0", "."))
        assert len(text.split(".")[1]) <= digits


def test_areas_are_written_on_the_grid() -> None:
    area = shapely.union_all(
        [shapely.box(0, 0, 4, 4) - shapely.box(1, 1, 2, 2), shapely.box(9, 9, 9.01, 9.01)]
    )
    (part,) = snap_to_grid(area, 1)
    outer, inner = list_rings(part)
    assert outer[0] == outer[-1]
    assert part.exterior.is_ccw
    assert not part.interiors[0].is_ccw
    assert len(inner) == 5
