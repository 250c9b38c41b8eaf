"""The map check: exact measures, and a warning for each likely mistake."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment
from robocov.errors import ParameterError, StartError
from robocov.mapfile import from_json
from robocov.mapfile.check import MapReport, check_map, describe_vertex_count


def build_room(*obstacles: dict[str, Any], boundary: Any = None, starts: Any = None) -> Environment:
    return from_json(
        {
            "format": "robocov-map",
            "version": 1,
            "name": "room",
            "boundary": boundary or [[0, 0], [10, 0], [10, 6], [0, 6]],
            "obstacles": list(obstacles),
            "starts": starts or {},
        }
    )


def build_block(x: float, y: float, width: float, height: float) -> dict[str, Any]:
    ring = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
    return {"kind": "polygon", "vertices": ring}


def test_the_measures_of_a_map_are_exact() -> None:
    environment = build_room(
        build_block(4, 2, 2, 2) | {"holes": [[[4.5, 2.5], [5.5, 2.5], [5.5, 3.5], [4.5, 3.5]]]},
        {"kind": "wall", "points": [[8, 0], [8, 2]], "width": 0.5},
        {"kind": "circle", "center": [2, 1], "radius": 0.2},
    )
    report = check_map(environment)
    assert report.area == 60.0
    assert report.vertex_count == 4 + 4 + 4 + 2
    assert report.obstacle_count == 3
    assert report.components == pytest.approx((60 - 4 - 1 - 0.1253, 1.0), abs=1e-3)
    assert report.free_area == pytest.approx(sum(report.components))
    assert report.free_fraction == pytest.approx(report.free_area / 60)
    assert report.narrowest_gap is not None
    assert report.narrowest_gap.width == pytest.approx(0.8, abs=1e-3)


@pytest.mark.parametrize("radius", [0.0, -1.0, float("nan"), "wide"])
def test_invalid_radii_are_rejected(radius: Any) -> None:
    with pytest.raises(ParameterError, match=r"radius: expected a number from 0\.001 to 1000 m, got "):
        check_map(build_room(), radius)


@pytest.mark.parametrize(
    ("count", "expected"), [(5000, "about 2 seconds"), (10_891, "7 seconds"), (50_000, "about 3 minutes")]
)
def test_the_warning_about_many_vertices_has_the_time(count: int, expected: str) -> None:
    assert expected in describe_vertex_count(count)


def test_many_vertices_are_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robocov.mapfile.check.MANY_VERTICES", 7)
    report = check_map(build_room(build_block(4, 2, 2, 2)))
    assert report.vertex_count == 8
    assert report.warnings[0].startswith("This map has many vertices (8): ")


def test_a_clean_map_has_no_warnings() -> None:
    assert check_map(build_room(build_block(4, 2, 2, 2))).warnings == ()


def list_warnings(environment: Environment) -> list[str]:
    return list(check_map(environment).warnings)


def test_a_gap_that_no_robot_can_pass_is_a_warning() -> None:
    environment = build_room(build_block(4, 0, 1, 2.9), build_block(4, 3.05, 1, 3))
    assert list_warnings(environment) == [
        "the gap between [4, 2.9] and [4, 3.05] is 0.15 m wide: a robot of radius 0.1 m cannot pass"
    ]
    assert check_map(environment, radius=0.07).warnings == ()


def test_positions_far_from_the_origin_are_written_in_full() -> None:
    x = 385000.0
    y = 5819000.0
    boundary = [[x, y], [x + 100, y], [x + 100, y + 50], [x, y + 50]]
    environment = build_room(build_block(x + 40, y, 1, 50), boundary=boundary)
    assert list_warnings(environment) == ["sealed room of 2000 m² around [385020, 5819025]"]


def test_sealed_rooms_and_pockets_are_warnings() -> None:
    # The wall leaves 24 m² in the west and 30 m² in the east. Half of the pocket of 0.05 m by 1 m is filled.
    environment = build_room(
        build_block(4, 0, 1, 6),
        build_block(0.05, 0, 1, 1),
        build_block(0, 1, 1.05, 1),
        build_block(0, 0, 0.05, 0.5),
    )
    first, second = list_warnings(environment)
    assert first.startswith("sealed room of 21.9 m² around [")
    assert second == "1 sealed pocket smaller than a robot, 0.025 m² in total"


def test_an_obstacle_outside_the_boundary_is_a_warning() -> None:
    outside = {"kind": "circle", "center": [20, 2], "radius": 0.5, "name": "tree"}
    assert list_warnings(build_room(build_block(4, 2, 1, 1), outside)) == [
        "obstacles[1] (tree) is entirely outside the boundary"
    ]
    assert list_warnings(build_room(build_block(10, 2, 1, 1))) == [
        "obstacles[0] is entirely outside the boundary"
    ]
    assert list_warnings(build_room(build_block(9.5, 2, 1, 1))) == []


def test_paths_through_fixed_obstacles_are_warnings() -> None:
    def build_moving_circle(*points: tuple[float, float], **others: Any) -> dict[str, Any]:
        path = {"points": points, "speed": 0.5, **others}
        return {"kind": "circle", "center": [1, 1], "radius": 0.3, "name": "cart", "path": path}

    racks = [build_block(3, 0.5, 0.5, 1), build_block(5, 0.5, 0.5, 1) | {"name": "rack"}]
    assert list_warnings(build_room(*racks, build_moving_circle((1, 1), (1, 5)))) == []
    # This path ends before the first rack.
    assert list_warnings(build_room(*racks, build_moving_circle((1, 1), (2.6, 1)))) == []
    assert list_warnings(build_room(*racks, build_moving_circle((1, 1), (9, 1)))) == [
        "obstacles[2] (cart) moves through obstacles[0], obstacles[1] (rack)"
    ]
    # A loop goes straight back from the last point.
    around = build_moving_circle((1, 1), (1, 3), (9, 3), (9, 1))
    assert list_warnings(build_room(*racks, around)) == [
        "obstacles[2] (cart) moves through obstacles[0], obstacles[1] (rack)"
    ]
    around_the_racks = build_moving_circle((1, 1), (1, 3), (9, 3), (9, 1), repeat="back-and-forth")
    assert list_warnings(build_room(*racks, around_the_racks)) == []
    assert list_warnings(build_room(build_moving_circle((1, 1), (9.8, 1)))) == [
        "obstacles[0] (cart) moves through the boundary"
    ]
    many = [build_block(x, 0.5, 0.5, 1) for x in (2, 3, 4, 5, 6)]
    assert list_warnings(build_room(*many, build_moving_circle((1, 1), (9, 1)))) == [
        "obstacles[5] (cart) moves through obstacles[0], obstacles[1], obstacles[2] and 2 more"
    ]
    # Another moving obstacle may be elsewhere at that time.
    circles = [build_moving_circle((1, 1), (9, 1)), build_moving_circle((1, 1), (8, 1))]
    assert list_warnings(build_room(*circles)) == []


def test_duplicate_vertices_are_warnings() -> None:
    block = build_block(4, 2, 1, 1)
    block["vertices"].insert(2, list(block["vertices"][2]))
    closed = [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]
    assert list_warnings(build_room(block, boundary=closed)) == [
        "boundary[4] and the next vertex are at the same position",
        "obstacles[0].vertices[2] and the next vertex are at the same position",
    ]
    loop = {"kind": "wall", "points": [[4, 2], [5, 2], [5, 3], [4, 2]], "width": 0.1}
    assert not any("same position" in line for line in list_warnings(build_room(loop)))


def test_positions_that_are_too_close_are_a_warning() -> None:
    starts = {"tight": {"kind": "points", "positions": [[1, 1], [1.1, 1]]}}
    (line,) = list_warnings(build_room(starts=starts))
    assert "start 'tight': positions[0] and positions[1] are 0.1 m apart" in line


def test_capacities_are_close_to_the_number_of_robots_that_fit() -> None:
    starts = {
        "disc": {"kind": "disc", "center": [2, 2], "radius": 0.8},
        "half": {"kind": "disc", "center": [0, 2], "radius": 0.8},
        "given": {"kind": "points", "positions": [[1, 1], [2, 1], [3, 1]]},
    }
    environment = build_room(starts=starts)
    capacity = {start.name: start.capacity for start in check_map(environment).starts}
    assert capacity["given"] == 3
    assert capacity["half"] < 0.6 * capacity["disc"]
    for name in ("disc", "half"):
        environment.start(name).sample(int(0.8 * capacity[name]))
        with pytest.raises(StartError):
            environment.start(name).sample(int(1.5 * capacity[name]) + 2)


def test_the_report_is_json() -> None:
    report = check_map(build_room(build_block(4, 1, 2, 2), starts={"all": {"kind": "uniform"}}))
    document = json.loads(json.dumps(report.to_dict()))
    assert document["free_area_m2"] == 56.0
    assert document["narrowest_gap_m"] == 1.0
    assert document["starts"]["all"]["kind"] == "uniform"
    assert isinstance(report, MapReport)
    assert json.loads(json.dumps(check_map(build_room()).to_dict()))["narrowest_gap_m"] is None


def test_the_range_of_overlapping_peaks_ends_at_their_largest_value():
    overlapping = Gaussians((Gaussian((3.0, 3.0), 2.0, sigma=1.0), Gaussian((4.0, 3.0), 2.0, sigma=1.0)), 0.5)
    x = np.linspace(0.0, 10.0, 1001)
    points = np.column_stack([x, np.full(1001, 3.0)])
    ring = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    report = check_map(Environment("overlapping", ring, density=overlapping))
    max_value = overlapping.evaluate(points).max()
    assert report.density_bounds == pytest.approx((0.5, max_value), abs=1e-5)
    single = Gaussians(overlapping.peaks[:1], 0.5)
    report = check_map(Environment("single", ring, density=single))
    assert report.density_bounds == pytest.approx((0.5, 2.5), abs=1e-5)


def test_the_unreachable_area_depends_on_the_radius() -> None:
    environment = build_room(build_block(4, 0, 1, 2.9), build_block(4, 3.05, 1, 2.95))
    free_area = environment.free_area
    assert check_map(environment, radius=0.07).unreachable_area == 0.0
    report = check_map(environment, radius=0.1)
    assert len(report.components) == 1
    assert report.unreachable_area == pytest.approx(4 * 6, abs=0.08)
    assert check_map(environment, radius=4.0).unreachable_area == pytest.approx(free_area)
    assert report.to_dict()["unreachable_area_m2"] == report.unreachable_area


def test_the_unreachable_area_is_computed_when_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    radii = []
    monkeypatch.setattr(
        "robocov.mapfile.check.compute_unreachable_area", lambda _, radius: radii.append(radius)
    )
    report = check_map(build_room(), radius=0.2)
    assert radii == []
    report.to_dict()
    report.to_dict()
    assert radii == [0.2]


@pytest.mark.parametrize("environment", [None, "rooms", 3])
def test_a_value_that_is_no_map_is_rejected(environment: object) -> None:
    with pytest.raises(ParameterError, match="environment: expected a map"):
        check_map(environment)  # type: ignore[arg-type]
