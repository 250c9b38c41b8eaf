"""HouseExpo plans, on small examples: kept, repaired and rejected plans."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import Polygon, box

from robocov.environment import DiscStart, Environment, PolygonObstacle, UniformStart
from robocov.errors import MapError, ParameterError
from robocov.mapfile import from_json, load_map, save_map, to_json
from robocov_app.formats import Shaping, detect_format, import_map
from robocov_app.formats.geometry.cells.corners import sharpen_corners
from robocov_app.formats.reports import ImportReport

# Two rooms of 4 m x 3 m and a door of 0.9 m in a wall of 0.1 m; as in real plans, corners are cut by 1 cm.
PLAN = [
    [0.01, 0], [4, 0], [4, 0.99], [4.01, 1], [4.09, 1], [4.1, 0.99], [4.1, 0], [8.1, 0], [8.1, 3], [4.1, 3],
    [4.1, 1.91], [4.09, 1.9], [4.01, 1.9], [4, 1.91], [4, 3], [0, 3], [0, 0.01],
]  # fmt: skip


def write(folder: Path, document: Any, name: str = "plan.json") -> Path:
    path = folder / name
    path.write_text(json.dumps(document))
    return path


def build_plan(verts: Any, **others: Any) -> dict[str, Any]:
    return {"verts": verts, "id": "abc", "room_num": 2, "room_category": {}, "bbox": {}} | others


def import_plan(path: Path, **shaping: Any) -> tuple[Environment, ImportReport]:
    environment, report, foreign = import_map(path, format="houseexpo", shaping=Shaping(**shaping))
    assert foreign.format == report.format == "houseexpo"
    return environment, report


def test_a_plan_becomes_a_map_that_saves_and_loads(tmp_path: Path) -> None:
    path = write(tmp_path, build_plan(PLAN))
    assert detect_format(path).name == "houseexpo"
    environment, report = import_plan(path)
    assert environment.name == "HouseExpo abc"
    assert environment.free_area == pytest.approx(12 + 12 + 0.09, abs=1e-3)
    assert len(environment.free.geoms) == 1
    assert (report.vertices_read, report.repaired, report.dropped) == (17, (), ())
    assert report.area_kept == environment.free_area
    save_map(environment, tmp_path / "out.json")
    assert load_map(tmp_path / "out.json") == environment
    assert json.loads(json.dumps(report.to_dict()))["area_read_m2"] == report.area_read
    assert report.format_lines()[0].startswith(
        "houseexpo: 17 vertices read, 12 kept; free area 24.09 m² read"
    )


def test_cut_corners_are_completed(tmp_path: Path) -> None:
    environment, report = import_plan(write(tmp_path, build_plan(PLAN)))
    assert report.vertices_kept == 12
    assert set(environment.boundary) == {
        (0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (4.1, 1.0), (4.1, 0.0), (8.1, 0.0),
        (8.1, 3.0), (4.1, 3.0), (4.1, 1.9), (4.0, 1.9), (4.0, 3.0), (0.0, 3.0),
    }  # fmt: skip
    untouched, report = import_plan(write(tmp_path, build_plan(PLAN)), simplify=0.0)
    assert report.vertices_kept == 17
    assert set(untouched.boundary) == {(float(x), float(y)) for x, y in PLAN}


def test_a_closed_ring_with_repeated_vertices_is_read(tmp_path: Path) -> None:
    verts = [[0, 0], [5, 0], [5, 0], [5, 3], [0, 3], [0, 0]]
    environment, report = import_plan(write(tmp_path, build_plan(verts)))
    assert len(environment.boundary) == 4
    assert environment.area == 15.0
    assert report.repaired == ("1 repeated vertex removed",)
    _, report = import_plan(write(tmp_path, build_plan([*verts[:3], *verts[2:]])))
    assert report.repaired == ("2 repeated vertices removed",)


def test_a_closed_ring_needs_no_repair(tmp_path: Path) -> None:
    verts = [[0, 0], [5, 0], [5, 3], [0, 3], [0, 0]]
    _, report = import_plan(write(tmp_path, build_plan(verts)))
    assert report.repaired == ()


def test_a_self_crossing_ring_is_repaired(tmp_path: Path) -> None:
    # A bow tie of 8 m² and 2 m².
    verts = [[0, 0], [0, 4], [6, -2], [6, 0]]
    environment, report = import_plan(write(tmp_path, build_plan(verts)))
    assert environment.area == pytest.approx(8.0)
    assert report.area_read == pytest.approx(10.0)
    assert report.area_kept == pytest.approx(8.0)
    assert report.repaired[0].startswith("the outline crossed or touched itself: Self-intersection[4 0")
    assert report.dropped == ("1 separate part of the free space, 2 m²",)


def test_a_ring_around_a_block_gives_an_obstacle(tmp_path: Path) -> None:
    # The outline leads to a block, around it, and back along the same line.
    verts = [[0, 0], [6, 0], [6, 6], [0, 6], [0, 3], [2, 3], [2, 4], [4, 4], [4, 2], [2, 2], [2, 3], [0, 3]]
    environment, report = import_plan(write(tmp_path, build_plan(verts)))
    assert environment.free_area == pytest.approx(36 - 4)
    assert [type(obstacle) for obstacle in environment.obstacles] == [PolygonObstacle]
    assert report.repaired


def test_starts_are_added(tmp_path: Path) -> None:
    path = write(tmp_path, build_plan(PLAN))
    environment, _ = import_plan(path)
    assert [type(spec) for spec in environment.starts.values()] == [DiscStart, UniformStart]
    assert len(environment.start("room").sample(6)) == 6
    assert list(import_plan(path, default_start="uniform")[0].starts) == ["uniform", "room"]
    room = environment.starts["room"]
    assert isinstance(room, DiscStart)
    assert room.radius == pytest.approx(1.39, abs=0.02)


@pytest.mark.parametrize(
    ("document", "expected"),
    [
        ([], "not a HouseExpo plan"),
        ({"vertices": []}, 'expected an object with "verts"'),
        (build_plan([]), "verts: expected a list of at least 3 points"),
        (build_plan("many"), "verts: expected a list"),
        (build_plan([[0, 0], [1, 0], [1, "1"]]), "verts[2]: expected a point [x, y] in meters"),
        (build_plan([[0, 0], [1, True], [1, 1]]), "verts[1]: expected a point"),
        (build_plan([[0, 0], [1, 0, 0], [1, 1]]), "verts[1]: expected a point"),
        (build_plan([[0, 0], [1, 0], [1e9, 1]]), "verts[2]: expected a point"),
        (build_plan([[0, 0], [1, 1], [0, 0], [1, 1], [1, 1]]), "expected at least 3 different points, got 2"),
        (build_plan([[0, 0], [0, 0], [1, 1]]), "verts: expected at least 3 different points, got 2"),
        (build_plan([[0, 0], [1, 1], [3, 3]]), "verts: expected an outline with an area"),
        (build_plan([[0, 0], [0.15, 0], [0.15, 9], [0, 9]]), "no position has enough clearance for a robot"),
        (build_plan([[0, 0], [20000, 0], [20000, 9], [0, 9]]), "boundary: expected at most 10 km"),
    ],
)
def test_invalid_plans_are_rejected_in_one_line(tmp_path: Path, document: Any, expected: str) -> None:
    path = write(tmp_path, document)
    with pytest.raises(MapError) as caught:
        import_plan(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert expected in message
    assert "\n" not in message


def test_only_cut_corners_are_completed() -> None:
    cut = Polygon([(0, 0.02), (0.02, 0), (6, 0), (6, 3), (0, 3)])
    assert sharpen_corners(cut, 0.02).symmetric_difference(box(0, 0, 6, 3)).area < 1e-12
    assert sharpen_corners(cut, 0.0).equals(cut)
    # A bevel of 10 cm is not a cut corner, and nearly parallel lines have no clear intersection.
    bevel = Polygon([(0.1, 0), (6, 0), (6, 3), (0, 3), (0, 0.1)])
    assert sharpen_corners(bevel, 0.02).equals(bevel)
    bent = Polygon([(0, 0), (3, 0), (3.02, 0.001), (6, 0.2), (6, 3), (0, 3)])
    assert sharpen_corners(bent, 0.02).equals(bent)
    holed = Polygon(box(0, 0, 6, 3).exterior, [[(1, 1.01), (1.01, 1), (2, 1), (2, 2), (1, 2)]])
    assert sharpen_corners(holed, 0.02).area == pytest.approx(17.0)


def test_options_out_of_range_are_rejected(tmp_path: Path) -> None:
    path = write(tmp_path, build_plan(PLAN))
    for tolerance in (-1.0, math.nan, 11.0):
        with pytest.raises(ParameterError, match="simplify"):
            import_plan(path, simplify=tolerance)
    with pytest.raises(ParameterError, match="default_start: expected one of room, uniform, got 'door'"):
        import_plan(path, default_start="door")  # type: ignore[arg-type]


def test_other_files_are_not_recognized(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"unknown format .*, expected one of .*houseexpo"):
        detect_format(write(tmp_path, {"rooms": []}))
    with pytest.raises(MapError, match="no such file"):
        detect_format(tmp_path / "none.json")


@settings(deadline=None, max_examples=count_examples(150))
@given(
    st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), min_size=3, max_size=14),
    st.sampled_from([0.0, 0.02, 0.5]),
)
def test_any_ring_is_imported_or_rejected(
    tmp_path_factory: pytest.TempPathFactory, verts: list[tuple[int, int]], tolerance: float
) -> None:
    path = write(tmp_path_factory.getbasetemp(), build_plan([[x / 4, y / 4] for x, y in verts]))
    message = None
    try:
        environment, report = import_plan(path, simplify=tolerance)
    except MapError as error:
        message = str(error)
    if message is not None:
        assert message.startswith(str(path))
        assert "\n" not in message
        return
    assert from_json(to_json(environment)) == environment
    assert report.area_kept == environment.free_area
    if tolerance == 0.0:
        assert report.area_kept <= report.area_read + 1e-3
