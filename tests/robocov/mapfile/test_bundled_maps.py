"""Bundled maps have no warnings, readable descriptions and space for teams."""

from __future__ import annotations

import json
import re

import jsonschema
import pytest
import shapely

from robocov.environment import CircleObstacle, PointsStart, PolygonObstacle, UniformStart, WallObstacle
from robocov.mapfile import build_map_schema, dump_map, list_bundled_maps, load_map
from robocov.mapfile.check import check_map

NAMES = sorted(list_bundled_maps())
MIN_GAPS = {"gaps": 0.3}
"""Widths of the narrowest gaps of maps with narrow gaps on purpose, m."""


def test_all_maps_in_the_documentation_are_bundled() -> None:
    assert {
        "square", "pentagon", "blocks-a", "blocks-b", "rooms", "office", "city", "trap", "warehouse",
        "l-shape", "courtyard", "corridor", "gaps", "campus",
    } <= set(NAMES)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_bundled_maps_have_no_warnings(name: str) -> None:
    report = check_map(load_map(name))
    assert report.warnings == ()
    assert len(report.components) == 1
    if report.narrowest_gap is not None:
        assert report.narrowest_gap.width >= MIN_GAPS.get(name, 0.5) - 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_bundled_maps_have_names_descriptions_and_starts(name: str) -> None:
    environment = load_map(name)
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", name)
    assert environment.name.lower().replace(" ", "-") == name
    assert re.fullmatch(r"[A-Z][^\n]+\.", environment.description)
    assert len(environment.starts) >= 2
    assert list(environment.starts)[-1] == "uniform"
    assert isinstance(environment.starts["uniform"], UniformStart)


@pytest.mark.parametrize("name", NAMES)
def test_bundled_maps_are_formatted_like_written_maps(name: str) -> None:
    text = list_bundled_maps()[name].read_text(encoding="utf-8")
    assert dump_map(load_map(name)) == text
    assert max(len(line) for line in text.splitlines()) < 1000
    jsonschema.Draft202012Validator(build_map_schema()).validate(json.loads(text))


@pytest.mark.parametrize("name", NAMES)
def test_six_robots_fit_at_every_start_clear_of_walls(name: str) -> None:
    environment = load_map(name)
    for start in environment.starts:
        points = shapely.points(environment.start(start).sample(6, seed=1))
        assert shapely.contains_properly(environment.free, points).all()
        assert shapely.distance(environment.free.boundary, points).min() >= 0.1


def test_the_default_start_is_a_cluster() -> None:
    for name in NAMES:
        environment = load_map(name)
        positions = environment.start().sample(6)
        spread = float((positions.max(axis=0) - positions.min(axis=0)).max())
        assert spread <= 0.25 * environment.region.diameter, name


def test_every_kind_of_obstacle_occurs() -> None:
    obstacles = [obstacle for name in NAMES for obstacle in load_map(name).obstacles]
    assert {type(obstacle) for obstacle in obstacles} == {CircleObstacle, PolygonObstacle, WallObstacle}
    assert any(isinstance(obstacle, PolygonObstacle) and obstacle.holes for obstacle in obstacles)


def test_only_two_maps_are_convex() -> None:
    for name in NAMES:
        environment = load_map(name)
        is_convex = environment.region.area - environment.free_area < 1e-9
        assert is_convex == (name in {"square", "pentagon"}), name
    assert load_map("l-shape").area < load_map("l-shape").region.area


def test_the_two_block_maps_share_their_given_starts() -> None:
    first = load_map("blocks-a")
    second = load_map("blocks-b")
    for name in ("paper", "other"):
        start = first.starts[name]
        assert isinstance(start, PointsStart)
        assert len(start.positions) == 6
        assert second.starts[name] == start
    assert first.starts["paper"] != first.starts["other"]
    assert first.region.bounds == second.region.bounds == (0.0, 0.0, 10.0, 10.0)
    for environment in (first, second):
        assert any(
            obstacle.polygon.convex_hull.area > obstacle.polygon.area + 0.1
            for obstacle in environment.obstacles
        )


def test_two_hundred_robots_fit_on_the_campus() -> None:
    campus = load_map("campus")
    for start in campus.starts:
        assert len(campus.start(start).sample(200)) == 200
