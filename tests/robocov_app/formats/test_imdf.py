"""Indoor Mapping Data Format: levels, units, openings and fixtures, from a folder and from a zip."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyproj
import pytest
import shapely
from shapely import Point, box

from robocov.errors import MapError, ParameterError
from robocov_app.formats import IMPORTERS, ReadOptions, detect_format, import_map

# The outline includes the corners of the adjacent rooms.
WALKWAY = [(0, 8), (30, 8), (30, 12), (20, 12), (10, 12), (0, 12)]
PLANE = pyproj.Proj(proj="aeqd", lon_0=8.4, lat_0=49.0, ellps="WGS84")
GROUND = "11111111-0000"
UPSTAIRS = "11111111-0001"


def convert_to_degrees(points: list[tuple[float, float]]) -> list[list[float]]:
    return [[round(value, 9) for value in PLANE(x, y, inverse=True)] for x, y in points]


def build_feature(kind: str, geometry: Any, **properties: Any) -> dict[str, Any]:
    return {
        "id": f"{kind}-0",
        "type": "Feature",
        "feature_type": kind,
        "geometry": geometry,
        "properties": {"name": None, **properties},
    }


def build_polygon(*points: tuple[float, float]) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": [convert_to_degrees([*points, points[0]])]}


def build_area(x: float, y: float, right: float, top: float) -> dict[str, Any]:
    return build_polygon((x, y), (right, y), (right, top), (x, top))


def build_line(*points: tuple[float, float]) -> dict[str, Any]:
    return {"type": "LineString", "coordinates": convert_to_degrees([*points])}


def build_unit(category: str, *sides: float, level: str = GROUND, name: str | None = None) -> dict[str, Any]:
    names = None if name is None else {"en": name}
    return build_feature("unit", build_area(*sides), category=category, level_id=level, name=names)


def build_venue() -> dict[str, list[dict[str, Any]]]:
    """Return a walkway between rooms: A with an edge in common, B behind a wall, C without an opening."""
    levels = []
    for number, ordinal, short, name in ((GROUND, 0, "EG", "Ground"), (UPSTAIRS, 1, "OG", "Upper floor")):
        one = build_feature(
            "level", build_area(0, 0, 30, 20), ordinal=ordinal, short_name={"de": short}, name={"en": name}
        )
        levels.append({**one, "id": number})
    return {
        "venue": [
            build_feature("venue", build_area(0, 0, 30, 20), name={"en": "Old mill"}, category="museum")
        ],
        "level": levels,
        "unit": [
            build_feature("unit", build_polygon(*WALKWAY), category="walkway", level_id=GROUND),
            build_unit("office", 0, 12, 10, 20, name="A"),
            build_unit("office", 0, 0, 10, 7.8, name="B"),
            build_unit("office", 20, 12, 30, 20, name="C"),
            build_unit("stairs", 20, 0, 30, 8),
            build_unit("column", 14, 9, 15, 10),
            build_unit("walkway", 0, 0, 30, 20, level=UPSTAIRS),
        ],
        "opening": [
            build_feature("opening", build_line((4, 12), (5.5, 12)), category="pedestrian", level_id=GROUND),
            build_feature("opening", build_line((4, 7.8), (5, 7.8)), category="pedestrian", level_id=GROUND),
        ],
        "fixture": [build_feature("fixture", build_area(2, 16, 4, 18), category="desk", level_id=GROUND)],
    }


def write_folder(folder: Path, files: dict[str, list[dict[str, Any]]]) -> Path:
    folder.mkdir()
    for name, features in files.items():
        document = {"type": "FeatureCollection", "features": features}
        (folder / f"{name}.geojson").write_text(json.dumps(document))
    (folder / "manifest.json").write_text('{"version": "1.0.0"}')
    return folder


def write_zip(path: Path, files: dict[str, list[dict[str, Any]]], within: str = "") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, features in files.items():
            document = {"type": "FeatureCollection", "features": features}
            archive.writestr(f"{within}{name}.geojson", json.dumps(document))
    return path


def read(path: Path, **options: Any) -> Any:
    assert detect_format(path) is IMPORTERS["imdf"]
    return IMPORTERS["imdf"].read(path, ReadOptions(**options))


def move_to_corner(free: Any) -> Any:
    """Return free space with the lower left corner of the floor at [0, 0]: it is about the middle."""
    return shapely.transform(free, lambda points: points + [15, 10])


@pytest.mark.parametrize("kind", ["folder", "zip", "zip in a folder"])
def test_units_are_free_and_joined_through_openings(tmp_path: Path, kind: str) -> None:
    files = build_venue()
    if kind == "folder":
        path = write_folder(tmp_path / "mill", files)
    else:
        path = write_zip(tmp_path / "mill.zip", files, "mill/" if kind.endswith("folder") else "")
    foreign = read(path, thickness=0.1)
    free = move_to_corner(foreign.free)
    part = next(part for part in free.geoms if part.contains(Point(1, 10)))
    assert part.contains(Point(5, 15)), "A has an edge in common with the walkway, and an opening"
    assert part.contains(Point(5, 4)), "B is behind a wall of 20 cm, with an opening in it"
    assert not part.contains(Point(25, 16)), "C has no opening"
    assert not free.contains(Point(25, 4)), "nobody drives on stairs"
    assert not free.contains(Point(14.5, 9.5)) and not free.contains(Point(3, 17))
    assert not free.intersects(box(0.5, 11.99, 3.9, 12.01)), "the wall of A goes on beside the opening"
    assert free.contains(box(4.05, 11.8, 5.45, 12.2))
    assert foreign.name == "Old mill"
    assert "level 0 ('EG') of 0, 1 (--level)" in foreign.notes
    assert "stairs, elevators and openings to the floor below treated as solid: 1" in foreign.notes


def test_an_imported_venue_is_a_map(tmp_path: Path) -> None:
    environment, report, _ = import_map(write_folder(tmp_path / "mill", build_venue()))
    # Walls are centered on the outlines, half of them in each room.
    walkway = 30 * 4 - 1
    rooms = 10 * 8 + 10 * 7.8 - 4
    assert environment.free_area == pytest.approx(walkway + rooms, abs=8)
    assert report.format == "imdf"


@pytest.mark.parametrize("asked", ["1", "1.0", "OG", "upper floor", UPSTAIRS])
def test_a_level_is_chosen_by_number_or_name(tmp_path: Path, asked: str) -> None:
    foreign = read(write_folder(tmp_path / "mill", build_venue()), level=asked)
    assert foreign.free.area == pytest.approx(600, rel=1e-4)


def test_a_missing_level_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"level: expected 0, 1 or a name \(EG, OG\), got '7'"):
        read(write_folder(tmp_path / "mill", build_venue()), level="7")
    # A level without units cannot be read, so its name is not offered.
    venue = build_venue()
    attic = build_feature("level", build_area(0, 0, 30, 20), ordinal=2, short_name={"de": "DG"})
    venue["level"].append({**attic, "id": "attic"})
    with pytest.raises(ParameterError, match=r"level: expected 0, 1 or a name \(EG, OG\), got 'DG'"):
        read(write_folder(tmp_path / "house", venue), level="DG")


def test_a_level_number_takes_precedence_over_the_name_of_another_level(tmp_path: Path) -> None:
    venue = build_venue()
    for level, name in zip(venue["level"], ("1", "2"), strict=True):
        level["properties"]["short_name"] = {"en": name}
    folder = write_folder(tmp_path / "mill", venue)
    assert read(folder, level="1").free.area == pytest.approx(600, rel=1e-4)
    assert "level 1 ('2') of 0, 1 (--level)" in read(folder, level="1").notes
    assert "level 1 ('2') of 0, 1 (--level)" in read(folder, level="2").notes


def test_a_shared_name_selects_the_level_with_units(tmp_path: Path) -> None:
    venue = build_venue()
    attic = build_feature("level", build_area(0, 0, 30, 20), ordinal=2, short_name={"de": "OG"})
    venue["level"].insert(0, {**attic, "id": "attic"})
    foreign = read(write_folder(tmp_path / "mill", venue), level="OG")
    assert foreign.free.area == pytest.approx(600, rel=1e-4)


def test_only_stairs_that_become_obstacles_are_counted_as_solid(tmp_path: Path) -> None:
    venue = build_venue()
    venue["unit"].append(build_feature("unit", None, category="elevator", level_id=GROUND))
    folder = write_folder(tmp_path / "mill", venue)
    note = "stairs, elevators and openings to the floor below treated as solid"
    assert f"{note}: 1" in read(folder).notes
    assert not any(note in other for other in read(folder, skip=("stairs",)).notes)


def test_an_opening_that_is_not_a_line_is_left_out(tmp_path: Path) -> None:
    venue = build_venue()
    venue["opening"].append(build_feature("opening", build_area(14, 11.9, 15, 12.1), level_id=GROUND))
    foreign = read(write_folder(tmp_path / "mill", venue))
    assert "1 opening with a geometry other than a line" in foreign.dropped
    assert move_to_corner(foreign.free).contains(Point(14.5, 11.94)), "it is not an obstacle"


def test_units_without_openings_are_open_to_each_other(tmp_path: Path) -> None:
    files = build_venue()
    del files["opening"]
    foreign = read(write_folder(tmp_path / "mill", files))
    part = next(part for part in move_to_corner(foreign.free).geoms if part.contains(Point(1, 10)))
    assert part.contains(Point(5, 15)) and part.contains(Point(25, 16))
    assert "no door or opening on this level: 3 rooms are open to adjacent spaces" in foreign.notes


def build_bomb() -> bytes:
    """Return a zip of 100 kB that unpacks to 100 MB."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("unit.geojson", b" " * 100_000_000)
    return file.getvalue()


def build_many_files() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for k in range(1001):
            archive.writestr(f"{k}/unit.geojson", b"")
    return file.getvalue()


def cut_archive() -> bytes:
    return build_bomb()[:50_000]


def mix_archives() -> bytes:
    """Return an archive that begins like another one."""
    return build_many_files()[:300] + build_bomb()[300:]


@pytest.mark.parametrize(
    ("build_content", "expected"),
    [
        (build_bomb, "expected at most 50 MB when unpacked, got more"),
        (build_many_files, "expected an archive of at most 1000 files, got more"),
        (cut_archive, "expected a complete zip archive, got a broken one: File is not a zip file"),
        (mix_archives, "expected a complete zip archive, got a broken one"),
    ],
)
def test_invalid_archives_are_rejected(
    tmp_path: Path, build_content: Callable[[], bytes], expected: str
) -> None:
    path = tmp_path / "mill.zip"
    path.write_bytes(build_content())
    with pytest.raises(MapError) as caught:
        read(path)
    assert expected in str(caught.value)
    assert str(caught.value).startswith(str(path)) and str(caught.value).isprintable()


def test_invalid_content_is_rejected(tmp_path: Path) -> None:
    cases: list[tuple[str, Any, str]] = [
        ("level", [], "expected units on its levels, got none"),
        ("unit", [], "expected units on its levels, got none"),
        ("unit", [3], "unit.geojson:1:44: features[0]: expected a feature with properties, got 3"),
        ("unit", [{**build_unit("office", 0, 0, 9, 9), "properties": {"level_id": []}}], "got none"),
        (
            "level",
            [build_feature("level", None)],
            "features[0].properties.ordinal: expected a floor number, got null",
        ),
        ("unit", [build_unit("office", 0, 0, 0, 0)], "expected spaces with an area on this level, got none"),
        ("unit", [build_unit("column", 0, 0, 1, 1)], "expected spaces with an area on this level, got none"),
    ]
    for k, (name, features, expected) in enumerate(cases):
        path = write_folder(tmp_path / f"mill{k}", {**build_venue(), name: features})
        with pytest.raises(MapError) as caught:
            read(path)
        assert expected in str(caught.value)


def test_other_folders_and_archives_are_not_imdf(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(MapError, match="expected a file, got a folder"):
        detect_format(tmp_path / "empty")
    other = tmp_path / "other.zip"
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("readme.txt", b"hello")
    with pytest.raises(MapError, match="zip archive"):
        detect_format(other)
    half = write_zip(tmp_path / "half.zip", {"unit": build_venue()["unit"]})
    with pytest.raises(MapError, match=r"expected a file level\.geojson"):
        read(half)


def test_hairlines_between_units_are_closed(tmp_path: Path) -> None:
    files = build_venue()
    del files["opening"]
    # Rotated, and without the corners of adjacent rooms: edges miss each other by some micrometers.
    files["unit"][0]["geometry"] = build_polygon((0, 8), (30, 8.1), (30, 12.1), (0, 12))
    files["unit"][1]["geometry"] = build_polygon((0, 12), (10, 12 + 0.1 / 3), (10, 20), (0, 20))
    foreign = read(write_folder(tmp_path / "mill", files))
    assert any(part.contains(Point(-10, 0)) and part.contains(Point(-10, 5)) for part in foreign.free.geoms)
    assert "1 gap between outlines closed" in foreign.repaired[-1]
