"""Projection of longitudes and latitudes to meters, compared with geodesics."""

import sys
from typing import Any

import numpy as np
import pyproj
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import MapError
from robocov_app.formats import ReadOptions
from robocov_app.formats.geodata.georeference import convert_to_meters
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry

PLAIN = ReadOptions()
_GLOBE = pyproj.Geod(ellps="WGS84")


def project_points(
    points: Any, options: ReadOptions = PLAIN, **defaults: Any
) -> tuple[np.ndarray, list[str]]:
    shapes = Shapes("plan", options)
    defaults = {"crs": None, **defaults}
    (figure,) = convert_to_meters(
        [SourceGeometry("line", (np.array(points, dtype=float),))], shapes, **defaults
    )
    return figure.rings[0], shapes.notes


@settings(max_examples=count_examples(100))
@given(
    st.floats(-180, 180),
    st.floats(-84, 84),
    st.lists(st.tuples(*[st.floats(0, 1)] * 2), min_size=2, max_size=6),
)
def test_lengths_are_those_on_the_ellipsoid(longitude: float, latitude: float, places: Any) -> None:
    narrow = max(np.cos(np.radians(latitude)), 0.05)
    degrees = np.array([(longitude + 0.02 / narrow * x, latitude + 0.02 * y) for x, y in places])
    degrees[:, 0] = (degrees[:, 0] + 180.0) % 360.0 - 180.0  # also across the antimeridian
    meters, (note,) = project_points(degrees, may_be_degrees=True)
    assert note.startswith("degrees projected to meters about longitude")
    azimuth, _, length = _GLOBE.inv(*degrees[:-1].T, *degrees[1:].T)
    step = np.diff(meters, axis=0)
    # PROJ puts points that are about a millimeter from the origin onto it.
    assert np.linalg.norm(step, axis=1) == pytest.approx(length, rel=1e-6, abs=2e-3)
    # North is up in the middle; elsewhere, meridians are inclined toward the pole.
    long = np.asarray(length) > 1.0
    lean = (np.degrees(np.arctan2(*step.T)) - azimuth + 180.0) % 360.0 - 180.0
    assert (np.abs(lean[long]) < 0.06 / narrow).all()


def test_wide_coordinates_are_meters() -> None:
    meters, (note,) = project_points([[0, 0], [20, 10]], may_be_degrees=True)
    assert meters.tolist() == [[0, 0], [20, 10]]
    assert note == "coordinates treated as meters, because in degrees the map would exceed 10 km"
    assert project_points([[500, 0], [520, 10]], may_be_degrees=True)[0][0, 0] == 500.0
    assert project_points([[0, 0], [20, 10]])[1] == []
    assert project_points([[0, 0], [20, 10]], ReadOptions(scale=0.1))[0].tolist() == [[0, 0], [2, 1]]
    scaled = ReadOptions(scale=0.01)
    assert project_points([[0, 0], [2000, 10]], scaled, may_be_degrees=True)[1] == ["a unit is 0.01 m"]
    # Near the pole, ten kilometers are more degrees of longitude.
    assert "degrees projected" in project_points([[10, 85], [10.9, 85.05]], may_be_degrees=True)[1][0]
    assert (
        "degrees projected" in project_points([[8, 49], [8.001, 49.001]], ReadOptions(units="degrees"))[1][0]
    )


def test_a_given_reference_system_is_used() -> None:
    degrees = np.array([[8.4, 49.0], [8.41, 49.005]])
    to_utm = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:25832", always_xy=True)
    utm = np.column_stack(to_utm.transform(*degrees.T))
    location = {"origin": (8.4, 49.0)}
    direct, _ = project_points(degrees, may_be_degrees=True, **location)
    assert direct[0] == pytest.approx([0, 0], abs=1e-9)
    for name in ("EPSG:25832", "urn:ogc:def:crs:EPSG::25832", "http://www.opengis.net/def/crs/EPSG/0/25832"):
        meters, (note,) = project_points(utm, crs=name, **location)
        assert meters == pytest.approx(direct, abs=1e-3)
        assert note.startswith("EPSG:25832 projected")
    for name in ("EPSG:4326", "urn:ogc:def:crs:OGC:1.3:CRS84"):
        assert project_points(degrees, crs=name, **location)[0] == pytest.approx(direct)
    plain, notes = project_points(utm, ReadOptions(units="meters"), crs="EPSG:25832")
    assert (plain == utm).all()
    assert notes == ["coordinates of EPSG:25832 used without conversion"]
    # Mercator's meters are not meters
    mercator = np.column_stack(pyproj.Transformer.from_crs(4326, 3857, always_xy=True).transform(*degrees.T))
    assert project_points(mercator, crs="EPSG:3857", **location)[0] == pytest.approx(direct, abs=1e-3)


@pytest.mark.parametrize(
    ("crs", "points", "expected"),
    [
        ("EPSG:99999", [[0, 0]], "reference system EPSG:99999 is unknown"),
        (
            "+proj=utm +zone=32",
            [[0, 0]],
            r"expected a code such as EPSG:25832",
        ),
        ("FILE:123", [[0, 0]], "expected a code"),
        ("EPSG:4326", [[0, 0], [5, 91]], r"expected longitude and latitude in degrees"),
        ("EPSG:25832", [[1e300, 0]], r"expected coordinates of EPSG:25832"),
        ("EPSG:4326", [[0, 0], [np.nan, 1]], r"expected longitude and latitude"),
    ],
)
def test_impossible_coordinates_are_rejected(crs: str, points: Any, expected: str) -> None:
    with pytest.raises(MapError, match=rf"^plan: {expected}.*--units meters") as caught:
        project_points(points, crs=crs)
    assert "\n" not in str(caught.value)


def test_a_missing_pyproj_is_reported_with_the_command_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyproj", None)
    with pytest.raises(MapError, match=r'^plan: coordinates in degrees: .*pip install "robocov\[geo\]"'):
        project_points([[8, 49], [8.001, 49.001]], may_be_degrees=True)
    assert (
        project_points([[8, 49], [8.001, 49.001]], ReadOptions(units="meters"), may_be_degrees=True)[0][0, 0]
        == 8.0
    )


def test_projected_geometries_keep_their_rings() -> None:
    figures = [
        SourceGeometry("polygon", (np.zeros((4, 2)), np.ones((3, 2))), ("hall",), "geometry 1"),
        SourceGeometry("point", (np.full((1, 2), 5.0),)),
    ]
    scaled = convert_to_meters(figures, Shapes("plan", ReadOptions(scale=2.0)), None)
    assert [[len(ring) for ring in figure.rings] for figure in scaled] == [[4, 3], [1]]
    assert (scaled[0].rings[1] == 2.0).all()
    assert (scaled[0].labels, scaled[0].location, scaled[1].rings[0].tolist()) == (
        ("hall",),
        "geometry 1",
        [[10.0, 10.0]],
    )
    nothing = Shapes("plan", ReadOptions(units="degrees"))
    assert (convert_to_meters([], nothing, None, may_be_degrees=True), nothing.notes) == ([], [])
