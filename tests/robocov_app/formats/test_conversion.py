"""Conversion of foreign free space to a map: cleaning, notes, starts, and saving the result."""

import math
from typing import Any

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import MultiPolygon, Polygon, box

from robocov.environment import DiscStart, UniformStart
from robocov.errors import MapError, ParameterError
from robocov.mapfile import from_json, to_json
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.conversion.conversion_options import Shaping
from robocov_app.formats.geometry.conversion.environment import build_environment
from robocov_app.formats.geometry.conversion.map_layout import build_boundary
from robocov_app.formats.geometry.conversion.starts import find_widest_point
from robocov_app.formats.geometry.polygons import round_polygons

ROOM = box(0, 0, 10, 8) - box(4, 3, 6, 5) - box(1, 1, 1.05, 1.05)
CLOSET = box(20, 0, 23, 3)


def build_foreign_map(*free: Polygon, **others: Any) -> ForeignMap:
    given = {"name": "plan", "description": "A plan.", "format": "test", "vertices_read": 12} | others
    return ForeignMap(free=MultiPolygon(list(free)), **given)


def join_lines(report: Any) -> str:
    return "\n".join(report.format_lines())


def test_the_largest_part_is_kept_with_its_obstacles() -> None:
    environment, report = build_environment(build_foreign_map(CLOSET, ROOM), Shaping(), "plan.wkt")
    assert (environment.name, environment.description) == ("plan", "A plan.")
    assert environment.boundary == ((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0))
    assert [shape.polygon.area for shape in environment.obstacles] == pytest.approx([4, 0.0025])
    assert report.dropped == ("1 separate part of the free space, 9 m²",)
    assert (report.area_read, report.area_kept) == (pytest.approx(84.9975), pytest.approx(75.9975))
    assert (report.size, report.obstacles, report.vertices_kept) == ((10.0, 8.0), 2, 12)
    assert join_lines(report).splitlines()[:2] == [
        "test: 12 vertices read, 12 kept; free area 85 m² read, 76 m² kept",
        "10 x 8 m, 2 obstacles",
    ]
    assert report.to_dict()["size_m"] == [10.0, 8.0]


def test_inside_keeps_the_part_around_a_position() -> None:
    track = box(30, 0, 60, 20) - box(32, 2, 58, 18)
    whole = build_foreign_map(ROOM, CLOSET, track, boundary=box(-1, -1, 61, 21), has_named_boundary=True)
    environment, report = build_environment(whole, Shaping(inside=(21.0, 1.0)), "plan")
    # The boundary of the file surrounds everything, not only this part.
    assert environment.boundary_polygon.equals(CLOSET)
    edge, note = report.notes
    assert edge == "the boundary is the inner edge of the walls around the free space"
    assert note.startswith("only 3.3% of the free area is kept: --inside ")
    assert note.endswith("keeps another part, --keep all keeps every part")
    assert len(report.others) == 2
    for x, y in report.others:
        assert f"--inside {x:g} {y:g} (" in note
        assert build_environment(whole, Shaping(inside=(x, y)), "plan")[1].area_kept > 50
    expected = r"plan: inside: 45 10 is solid, .*; 31 \S+ is one in the nearest part, 8 m away"
    with pytest.raises(MapError, match=expected):
        build_environment(whole, Shaping(inside=(45.0, 10.0)), "plan")


def test_a_large_omitted_part_is_noted() -> None:
    _, report = build_environment(build_foreign_map(CLOSET, ROOM), Shaping(), "plan")
    assert report.notes[0].startswith(
        "89% of the free area is kept: --inside 21.5 1.5 (9 m²) keeps another part"
    )
    assert build_environment(build_foreign_map(box(20, 0, 22, 3), ROOM), Shaping(), "plan")[1].notes == ()
    # A speck next to it, such as the inside of a letter, is not offered.
    _, report = build_environment(build_foreign_map(CLOSET, ROOM, box(30, 0, 30.2, 0.2)), Shaping(), "plan")
    assert len(report.others) == 1
    _, report = build_environment(build_foreign_map(CLOSET, ROOM), Shaping(keep="all"), "plan")
    assert "is kept" not in join_lines(report)


def test_parts_that_are_too_small_are_not_offered_if_all_parts_are_requested() -> None:
    shaping = Shaping(keep="all", specks=10.0)
    _, report = build_environment(build_foreign_map(CLOSET, box(20, 10, 24, 13)), shaping, "plan")
    assert report.dropped == ("1 separate part of the free space, 9 m²",)
    assert "--keep all" not in join_lines(report)
    assert report.others == ()


def test_positions_offered_in_narrow_parts_are_free() -> None:
    slit = box(20.0012, 0, 20.0048, 6000)
    whole = build_foreign_map(ROOM, slit)
    expected = r"20\.003 \S+ is one in the nearest part, 5 m away"
    with pytest.raises(MapError, match=expected):
        build_environment(whole, Shaping(inside=(25.0048, 1.0)), "plan")


@pytest.mark.parametrize("tiny", [1e-320, -1e-310, 1e-160])
def test_coordinates_near_zero_become_zero(tiny: float) -> None:
    environment, _ = build_environment(
        build_foreign_map(Polygon([(0, 0), (6, 7), (0, 7), (0, tiny)])), Shaping(), "plan"
    )
    assert sorted(environment.boundary) == [(0, 0), (0, 7), (6, 7)]


def test_all_parts_lie_in_their_convex_hull() -> None:
    environment, report = build_environment(build_foreign_map(CLOSET, ROOM), Shaping(keep="all"), "plan")
    assert environment.free_area == pytest.approx(ROOM.area + 9)
    assert len(environment.free.geoms) == 2
    assert environment.boundary_polygon.equals(shapely.union(ROOM, CLOSET).convex_hull)
    assert (
        "note: the free space consists of 2 separate parts: robots cannot pass between them"
        in report.format_lines()
    )


def test_specks_are_removed() -> None:
    environment, report = build_environment(build_foreign_map(ROOM), Shaping(specks=0.01), "plan")
    assert len(environment.obstacles) == 1
    assert report.dropped == ("1 obstacle smaller than 0.01 m², 0.0025 m² (--specks 0 keeps them)",)
    parts = [box(20 + k, 0, 20.05 + k, 0.05) for k in range(3)]
    environment, _ = build_environment(
        build_foreign_map(ROOM, *parts), Shaping(specks=0.01, keep="all"), "plan"
    )
    assert len(environment.free.geoms) == 1
    many = ROOM
    for k in range(12):
        many -= box(2 + k / 4, 7, 2.04 + k / 4, 7.04)
    _, report = build_environment(build_foreign_map(many), Shaping(), "plan")
    assert report.notes == ("13 obstacles are smaller than 0.01 m² (--specks 0.01 drops them)",)
    crumb = ROOM - box(7, 7, 7.001, 7.02)
    environment, report = build_environment(build_foreign_map(crumb), Shaping(), "plan")
    assert len(environment.obstacles) == 2
    assert report.dropped == ("1 hole, 0.00002 m², due to rounding",)


def test_noise_depends_on_the_format() -> None:
    noisy = build_foreign_map(ROOM, specks=0.003)
    assert len(build_environment(noisy, Shaping(), "plan")[0].obstacles) == 1
    assert len(build_environment(noisy, Shaping(specks=0.0), "plan")[0].obstacles) == 2


def test_hull_and_margin_are_applied() -> None:
    corner = box(0, 0, 10, 8) - box(5, 4, 10, 8)
    environment, _ = build_environment(build_foreign_map(corner), Shaping(hull=True), "plan")
    assert environment.boundary_polygon.equals(corner.convex_hull)
    assert environment.free.equals(corner)
    environment, _ = build_environment(build_foreign_map(corner), Shaping(margin=0.5), "plan")
    assert environment.boundary_polygon.bounds == (-0.5, -0.5, 10.5, 8.5)
    assert environment.free.equals(corner)
    assert len(environment.obstacles) == 1
    environment, _ = build_environment(build_foreign_map(corner), Shaping(margin=0.25, hull=True), "plan")
    assert environment.free.equals(corner)
    assert environment.region.area == pytest.approx(environment.area)


def test_a_given_boundary_is_kept() -> None:
    outer = box(-1, -1, 11, 9)
    named = build_foreign_map(
        ROOM, boundary=outer, has_named_boundary=True, boundary_source="the shape called 'hall'"
    )
    environment, report = build_environment(named, Shaping(), "plan")
    assert report.notes == ("the boundary is the shape called 'hall'",)
    assert environment.boundary_polygon.equals(outer)
    assert environment.free_area == pytest.approx(ROOM.area)
    assert [len(shape.holes) for shape in environment.obstacles if hasattr(shape, "holes")] == [1, 0, 0]
    environment, report = build_environment(
        build_foreign_map(ROOM, boundary=box(0, 0, 10, 7)), Shaping(), "plan"
    )
    assert environment.area == 70
    assert report.dropped == ("10 m² of free space outside the boundary",)
    crossed = Polygon([(-1, -1), (11, -1), (11, 9), (-1, 9), (-1, 3), (-2, 4), (-2, 3), (-1, 4)])
    environment, report = build_environment(build_foreign_map(ROOM, boundary=crossed), Shaping(), "plan")
    assert report.repaired[0].startswith("the boundary crossed or touched itself: self-intersection at [")
    assert environment.free_area == pytest.approx(ROOM.area)


def test_walls_replace_a_boundary_behind_them() -> None:
    outer = box(-1, -1, 11, 9)
    environment, report = build_environment(build_foreign_map(ROOM, boundary=outer), Shaping(), "plan")
    assert environment.boundary_polygon.equals(box(0, 0, 10, 8))
    assert report.notes == ("the boundary is the inner edge of the walls around the free space",)
    # A boundary that the free space reaches is kept.
    door = ROOM | box(4, 7, 6, 9)
    environment, report = build_environment(build_foreign_map(door, boundary=outer), Shaping(), "plan")
    assert environment.boundary_polygon.equals(outer)
    # A boundary is also kept if several parts stay, because there are walls between them.
    environment, _ = build_environment(
        build_foreign_map(ROOM, CLOSET, boundary=box(-1, -1, 24, 9)), Shaping(keep="all"), "plan"
    )
    assert environment.boundary_polygon.equals(box(-1, -1, 24, 9))


def test_no_slivers_along_a_boundary_that_the_free_space_touches() -> None:
    # The free space extends along the boundary, and the walls of both are straightened differently.
    wavy = [(x / 10, 0.008 * math.sin(x)) for x in range(101)]
    outer = Polygon([*wavy, (10, 8), (0, 8)])
    room = outer - box(3, -1, 4, 2) - box(5, 5, 6, 6)
    environment, _ = build_environment(build_foreign_map(room, boundary=outer), Shaping(), "plan")
    assert len(environment.obstacles) == 2
    assert environment.free_area == pytest.approx(room.area, abs=0.2)


def test_self_crossing_outlines_are_repaired() -> None:
    bow = Polygon([(0, 0), (0, 4), (6, -2), (6, 0)])
    environment, report = build_environment(build_foreign_map(bow), Shaping(), "plan")
    assert environment.area == pytest.approx(8.0)
    assert report.repaired == (
        "outlines crossed or touched themselves or each other: self-intersection at [4, 0]",
    )
    assert report.area_read == pytest.approx(10.0)
    overlapping = build_foreign_map(box(0, 0, 4, 4), box(3, 3, 6, 6))
    environment, report = build_environment(overlapping, Shaping(), "plan")
    assert environment.area == pytest.approx(16 + 9 - 1)
    assert len(report.repaired) == 1


def test_starts_are_added() -> None:
    environment, _ = build_environment(build_foreign_map(ROOM), Shaping(), "plan")
    assert [type(spec) for spec in environment.starts.values()] == [DiscStart, UniformStart]
    assert len(environment.start().sample(6)) == 6
    environment, _ = build_environment(build_foreign_map(ROOM), Shaping(default_start="uniform"), "plan")
    assert list(environment.starts) == ["uniform", "room"]
    narrow, _ = build_environment(build_foreign_map(box(0, 0, 9, 0.21)), Shaping(), "plan")
    assert list(narrow.starts) == ["uniform"]


def test_cells_larger_than_robots_are_noted() -> None:
    _, report = build_environment(build_foreign_map(ROOM, cell=1.0), Shaping(), "plan")
    assert report.tolerance == 0.2
    assert (
        "cells are larger than robots: walls move by at most 0.2 m instead of one cell (--simplify 1)"
        in report.notes
    )
    assert build_environment(build_foreign_map(ROOM, cell=0.05), Shaping(), "plan")[1].tolerance == 0.05
    assert build_environment(build_foreign_map(ROOM), Shaping(), "plan")[1].tolerance == 0.02
    assert build_environment(build_foreign_map(ROOM), Shaping(simplify=0.0), "plan")[1].tolerance == 0.0


CORRIDOR = box(0, 0, 5.15, 0.3) | box(4.85, 0, 5.15, 3)
"""An L. Its widest point is in the corner, 0.176 m from the walls."""


def test_unreachable_regions_are_noted() -> None:
    rooms = box(0, 0, 4, 4) | box(4, 1, 5, 1.15) | box(5, 0, 7, 4)
    _, report = build_environment(build_foreign_map(rooms), Shaping(), "plan")
    (note,) = report.notes
    assert note.startswith("1 part of 6.8")
    assert note.endswith("m² cannot be reached by a robot of radius 0.1 m from the largest one")
    assert build_environment(build_foreign_map(rooms), Shaping(radius=0.05), "plan")[1].notes == ()


def test_a_map_that_is_barely_wide_enough_is_not_rejected() -> None:
    """The search for a position with enough clearance is less accurate than the one for the message."""
    environment, _ = build_environment(build_foreign_map(CORRIDOR), Shaping(radius=0.1715), "plan")
    assert environment.free_area == pytest.approx(CORRIDOR.area)
    assert "uniform" in environment.starts


@pytest.mark.parametrize(
    ("parts", "shaping", "expected"),
    [
        ((), {}, "plan: there is no free space"),
        ((Polygon([(0, 0), (1, 1), (2, 2)]),), {}, "plan: there is no free space"),
        ((box(0, 0, 9, 0.15),), {}, "(the widest is for one of 0.0735 m): is the scale right?"),
        ((CORRIDOR,), {"radius": 0.2}, "(the widest is for one of 0.172 m): is the scale right?"),
        ((CORRIDOR,), {"radius": 1.0}, "(the widest is for one of 0.172 m): is the scale right?"),
        ((ROOM,), {"radius": 30.0}, "plan: no position has enough clearance for a robot of radius 30 m"),
        ((box(0, 0, 1e-4, 1e-4),), {}, "is the scale right?"),
        ((box(0, 0, 20_000, 9),), {}, "boundary: expected at most 10 km"),
        ((box(0, 0, 1, 1),), {"keep": "all", "specks": 5.0}, "1 m², expected one of at least 5 m²"),
        ((Polygon([(0, 0), (math.inf, 0), (1, 1)]),), {}, "expected finite coordinates"),
    ],
    ids=map(str, range(99)),
)  # fmt: skip
def test_unusable_maps_are_rejected(
    parts: tuple[Polygon, ...], shaping: dict[str, Any], expected: str
) -> None:
    with pytest.raises(MapError) as caught:
        build_environment(build_foreign_map(*parts), Shaping(**shaping), "plan")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"simplify": -1.0}, r"simplify: expected a number from 0 to 10 m"),
        ({"simplify": math.nan}, "simplify: expected a number from 0 to 10 m, got nan"),
        ({"specks": math.inf}, "specks: expected a number from 0 to 1000000 m², got inf"),
        ({"margin": 200.0}, "margin: expected a number from 0 to 100 m, got 200.0"),
        ({"radius": 0.0}, "radius: expected a number from 0.001 to 100 m, got 0.0"),
        ({"keep": "some"}, "keep: expected one of largest, all"),
        ({"inside": (math.nan, 1.0)}, r"inside: expected two numbers from -10000000 to"),
        ({"inside": (0.0, 1.0), "keep": "all"}, "keep: expected largest with the option inside, got all"),
        ({"default_start": "door"}, "default_start: expected one of room, uniform"),
    ],
)
def test_options_out_of_range_are_rejected(options: dict[str, Any], expected: str) -> None:
    with pytest.raises(ParameterError, match=expected):
        Shaping(**options)


def test_rounding_keeps_polygons_valid() -> None:
    sharp = Polygon([(0, 0), (1, 0.00004), (2, 0), (2, 1), (1, 0.00006), (0, 1)])
    for digits in (4, 3, 2):
        result = round_polygons(sharp, digits)
        assert result.is_valid
        assert result.area == pytest.approx(1.0, abs=0.05)
    assert "-0" not in round_polygons(box(-1e-9, 0, 1, 1), 4).wkt


def test_a_hole_that_leaves_its_outline_is_rounded_too() -> None:
    crossed = Polygon(box(0, 0, 9, 9).exterior, [[(-1, 4), (5, 4.00001), (5, 5), (-1, 5)]])
    assert shapely.equals(round_polygons(crossed, 4), box(0, 0, 9, 9) - box(0, 4, 5, 5))


points = st.tuples(st.integers(0, 40), st.integers(0, 40))


@settings(deadline=None, max_examples=count_examples(80))
@given(
    st.lists(st.lists(points, min_size=3, max_size=8), min_size=1, max_size=4),
    st.sampled_from([0.0, 0.05, 0.5, 3.0]), st.sampled_from(["largest", "all"]),
    st.booleans(), st.sampled_from([0.0, 0.3]), st.booleans(),
)  # fmt: skip
def test_any_rings_give_a_map_or_a_map_error(
    rings: list[list[tuple[int, int]]], tolerance: float, keep: Any, hull: bool, margin: float, given: bool
) -> None:
    parts = [Polygon([(x / 4, y / 4) for x, y in ring]) for ring in rings]
    outer = box(1, 1, 9, 9) if given else None
    shaping = Shaping(simplify=tolerance, keep=keep, hull=hull, margin=margin)
    try:
        environment, report = build_environment(build_foreign_map(*parts, boundary=outer), shaping, "plan")
    except MapError as error:
        assert str(error).startswith("plan: ")
        assert "\n" not in str(error)
        return
    assert from_json(to_json(environment)) == environment
    assert report.area_kept == environment.free_area
    assert environment.free.is_valid
    if tolerance == 0.0 and keep == "all":
        assert report.area_kept == pytest.approx(report.area_read, abs=0.02)
    if hull or margin:
        assert environment.boundary_polygon.buffer(1e-3).covers(environment.free)


@settings(deadline=None, max_examples=count_examples(60))
@given(st.lists(points, min_size=3, max_size=9), st.booleans(), st.sampled_from([0.0, 0.4]))
def test_boundary_and_obstacles_preserve_the_free_space(
    ring: list[tuple[int, int]], hull: bool, margin: float
) -> None:
    free = round_polygons(shapely.make_valid(Polygon(ring)), 4)
    if free.is_empty:
        return
    boundary, solid = build_boundary(free, None, hull=hull, margin=margin, digits=4)
    left = shapely.difference(boundary, shapely.union_all(solid))
    assert shapely.symmetric_difference(left, free).area < 1e-3 * (1 + free.area)


def test_the_deviation_of_walls_is_measured() -> None:
    # A bump of 15 mm is removed: a triangle of 30 cm² becomes solid.
    bumpy = Polygon([(0, 0), (4.8, 0), (5, 0.015), (5.2, 0), (10, 0), (10, 8), (0, 8)])
    _, report = build_environment(build_foreign_map(bumpy), Shaping(), "plan")
    assert (report.moved, report.moved_area) == (pytest.approx(0.015), pytest.approx(0.003))
    assert report.changed == (
        "walls moved by at most 0.015 m; 0.003 m² changed between free and solid, 0.0038% of the free area",
    )
    assert (report.to_dict()["moved_m"], report.to_dict()["moved_area_m2"]) == (
        report.moved,
        report.moved_area,
    )
    _, report = build_environment(build_foreign_map(bumpy), Shaping(simplify=0.0), "plan")
    assert (report.changed, report.moved, report.moved_area) == ((), 0.0, 0.0)


def test_a_map_of_many_vertices_has_a_note() -> None:
    angle = [k * math.tau / 6000 for k in range(6000)]
    round_room = Polygon([(400 * math.cos(a), 400 * math.sin(a)) for a in angle])
    _, report = build_environment(build_foreign_map(round_room), Shaping(simplify=0.0), "plan")
    assert report.vertices_kept > 5900  # after rounding, some are on the line between their neighbors
    assert report.notes[-1].startswith(
        f"This map has many vertices ({report.vertices_kept}): computing the distances between them takes "
        "about"
    )
    assert "many" not in join_lines(build_environment(build_foreign_map(round_room), Shaping(), "plan")[1])


@pytest.mark.parametrize(("most", "expected"), [("MAX_OBSTACLES", "obstacles"), ("MAX_VERTICES", "vertices")])
def test_a_map_that_takes_too_long_is_rejected(
    monkeypatch: pytest.MonkeyPatch, most: str, expected: str
) -> None:
    monkeypatch.setattr(f"robocov_app.formats.geometry.conversion.environment.{most}", 0)
    with pytest.raises(MapError, match=rf"plan: expected at most 0 {expected}, got \d+: --specks AREA"):
        build_environment(build_foreign_map(ROOM), Shaping(), "plan")


_RECTANGLES = st.tuples(*[st.integers(0, 10)] * 2, *[st.integers(1, 5)] * 2)


@settings(max_examples=count_examples(60), deadline=None)
@given(st.lists(_RECTANGLES, max_size=6))
def test_the_start_is_where_clearance_is_largest(blocks: list[tuple[int, int, int, int]]) -> None:
    solid = shapely.union_all([box(x, y, x + width, y + height) for x, y, width, height in blocks])
    room = max(shapely.get_parts(box(-1, -1, 16, 16) - solid), key=lambda part: part.area)
    (x, y), away = find_widest_point(room, 0.01)
    assert room.contains(shapely.Point(x, y))
    assert away == pytest.approx(room.boundary.distance(shapely.Point(x, y)))
    assert away >= shapely.maximum_inscribed_circle(room, tolerance=0.001).length - 0.0101
    assert find_widest_point(room, 0.01, sufficient=0.5)[1] >= min(0.5, away - 0.01)
