"""Boundary and free space of a drawing: the same rules for every format."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import box
from vector_files import build_square

from robocov.errors import MapError, ParameterError
from robocov_app.formats import ForeignMap, ReadOptions
from robocov_app.formats.files import MAX_VERTICES
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry, WallLine

HALL = build_square(0, 0, 20, 10)


def collect_shapes(*areas: Any, lines: Any = (), points: Any = (), **options: Any) -> Shapes:
    """Return shapes; an area or a line may be a pair of it and its name."""
    collected = Shapes("plan", ReadOptions(**options))

    def build_geometry(kind: str, value: Any) -> SourceGeometry:
        ring, name = value if isinstance(value, tuple) else (value, None)
        return SourceGeometry(kind, (np.array(ring, dtype=float),), (name,) if name else ())  # type: ignore[arg-type]

    for area in areas:
        collected.add(build_geometry("polygon", area))
    for line in lines:
        collected.add(build_geometry("line", line))
    for point in points:
        collected.add(build_geometry("point", [point]))
    return collected


def build_map(collected: Shapes, solid: bool = True) -> ForeignMap:
    return collected.build_foreign_map(name="plan", description="", solid=solid)


def test_the_largest_outline_that_contains_the_rest_is_the_boundary() -> None:
    foreign = build_map(
        collect_shapes(build_square(2, 2, 1, 1), HALL, build_square(5, 5, 2, 1), build_square(30, 0, 1, 1))
    )
    assert foreign.dropped == ("1 shape outside of the boundary",)
    assert foreign.boundary is not None
    assert foreign.boundary.equals(box(0, 0, 20, 10))
    assert foreign.free.area == pytest.approx(200 - 1 - 2)
    assert foreign.boundary_source == "the largest closed outline of 200 m²"
    assert foreign.notes == ("3 closed outlines treated as solid (--outlines free: as free space)",)


def test_a_named_boundary_may_have_any_size() -> None:
    named = collect_shapes((build_square(1, 1, 8, 8), "Boundary"), HALL, build_square(2, 2, 1, 1))
    assert build_map(named).boundary.area == pytest.approx(64.0)  # type: ignore[union-attr]
    chosen = collect_shapes(
        (build_square(1, 1, 8, 8), "east wing"), (HALL, "frame"), boundary="East Wing", skip=("frame",)
    )
    foreign = build_map(chosen)
    assert foreign.free.area == pytest.approx(64.0)
    assert foreign.dropped == ("1 shape by their names (--only, --skip)",)
    assert foreign.boundary_source == "the shape called 'East Wing'"
    assert foreign.has_named_boundary


def test_closed_lines_with_its_name_are_the_boundary() -> None:
    sides = [([a, b], "boundary") for a, b in pairwise(HALL)]
    foreign = build_map(collect_shapes(build_square(2, 2, 1, 1), lines=[*sides, [[5, 0], [5, 5]]]))
    assert foreign.boundary.equals(box(0, 0, 20, 10))  # type: ignore[union-attr]
    assert foreign.free.area == pytest.approx(200 - 1 - 0.5)
    assert foreign.notes[-1] == "1 line treated as a wall, 0.1 m wide (--thickness)"
    with pytest.raises(MapError, match=r"plan: boundary 'open': encloses no area, expected a closed outline"):
        build_map(collect_shapes(HALL, lines=[([[0, 0], [1, 1]], "open")], boundary="open"))


def test_the_outer_edge_of_closed_walls_is_the_boundary() -> None:
    collected = collect_shapes(lines=[HALL, [[10, 0], [10, 4]], [[10, 6], [10, 10]]], thickness=0.2)
    foreign = build_map(collected)
    assert foreign.boundary.bounds == pytest.approx((-0.1, -0.1, 20.1, 10.1))  # type: ignore[union-attr]
    assert foreign.free.area == pytest.approx(19.8 * 9.8 - 2 * 0.2 * 3.9)
    assert len(foreign.free.geoms) == 1


def test_a_missing_boundary_becomes_a_rectangle_around_everything() -> None:
    foreign = build_map(collect_shapes(build_square(0, 0, 2, 2), build_square(5, 5, 2, 2), around=3.0))
    assert foreign.boundary.equals(box(-3, -3, 10, 10))  # type: ignore[union-attr]
    assert foreign.free.area == pytest.approx(13 * 13 - 8)
    assert "--around" in foreign.boundary_source
    assert not foreign.has_named_boundary
    with_pillar = build_map(collect_shapes(lines=[[[0, 0], [6, 0]]], points=[[9, 5]], pillar=0.5))
    assert with_pillar.free.bounds == pytest.approx((-1, -1.05, 10.5, 6.5), abs=0.01)
    assert with_pillar.dropped == ()


def test_geometries_are_free_unless_one_contains_the_others() -> None:
    rooms = collect_shapes(build_square(0, 0, 4, 4), build_square(3, 1, 6, 2), build_square(50, 0, 5, 5))
    free = build_map(rooms, solid=False)
    assert free.boundary is None
    assert free.free.area == pytest.approx(16 + 12 - 2 + 25)
    assert free.notes == ("3 closed outlines treated as free space (--outlines solid: as obstacles)",)
    nested = build_map(collect_shapes(HALL, build_square(2, 2, 1, 1), build_square(5, 5, 2, 1)), solid=False)
    assert nested.free.area == pytest.approx(197.0)
    alone = build_map(collect_shapes(HALL, lines=[[[5, 0], [5, 5]]]), solid=False)
    assert alone.free.area == pytest.approx(200 - 0.5)
    walls = build_map(collect_shapes(lines=[HALL]), solid=False)
    assert walls.free.area == pytest.approx(19.9 * 9.9)


def test_islands_of_free_space_in_obstacles_are_free() -> None:
    court = collect_shapes(HALL)
    court.add_outline([np.array(build_square(30, 0, 10, 10)), np.array(build_square(32, 2, 6, 6))])
    court.add_outline([np.array(build_square(34, 4, 2, 2))])
    assert build_map(court, solid=False).free.area == pytest.approx(200 + 64 + 4)


def test_walls_drawn_as_one_shape_are_solid() -> None:
    walls = collect_shapes(build_square(4, 4, 1, 1))
    walls.add_outline(
        [
            np.array(build_square(0, 0, 20, 10)),
            np.array(build_square(1, 1, 8, 8)),
            np.array(build_square(10, 1, 9, 8)),
        ]
    )
    foreign = build_map(walls)
    assert foreign.boundary.equals(box(0, 0, 20, 10))  # type: ignore[union-attr]
    assert foreign.free.area == pytest.approx(64 + 72 - 1)


def test_outlines_can_be_declared() -> None:
    areas = (HALL, build_square(2, 2, 1, 1))
    assert build_map(collect_shapes(*areas, outlines="free")).free.area == pytest.approx(200.0)
    assert build_map(collect_shapes(*areas, outlines="solid"), solid=False).free.area == pytest.approx(199.0)
    rooms = collect_shapes(
        build_square(1, 1, 4, 4), build_square(6, 1, 4, 4), (HALL, "boundary"), outlines="free"
    )
    foreign = build_map(rooms)
    assert foreign.free.area == pytest.approx(32.0)
    assert foreign.boundary.area == pytest.approx(200.0)  # type: ignore[union-attr]
    with pytest.raises(MapError, match="expected a closed outline around free space, got none"):
        build_map(collect_shapes(lines=[HALL], outlines="free"))


def test_points_become_pillars_on_request() -> None:
    assert build_map(collect_shapes(HALL, points=[[5, 5]])).dropped == (
        "1 point (--pillar RADIUS makes pillars of them)",
    )
    foreign = build_map(collect_shapes(HALL, points=[[5, 5], [8, 5]], pillar=0.5))
    assert foreign.free.area == pytest.approx(200 - 2 * 0.7854, abs=0.01)
    assert foreign.notes[-1] == "2 points treated as pillars"


def test_adjacent_lines_are_joined_to_whole_corners() -> None:
    corner = collect_shapes(lines=[[[0, 0], [4, 0]], [[4, 0], [4, 3]], [[8, 0], [9, 0]]])
    corner.join_lines()
    assert len(corner.lines) == 2
    solid = shapely.union_all([line.solid for line in corner.lines])
    assert solid.area == pytest.approx(0.1 * (4 + 3 + 1))
    separate = collect_shapes(lines=[([[0, 0], [4, 0]], "a"), ([[4, 0], [4, 3]], "b")])
    separate.join_lines()
    assert len(separate.lines) == 2


def test_shapes_are_selected_by_name() -> None:
    areas = ((HALL, "hall"), (build_square(2, 2, 1, 1), "desk"), (build_square(5, 5, 2, 1), "Plant"))
    assert build_map(collect_shapes(*areas, only=("HALL", "plant"))).free.area == pytest.approx(198.0)
    assert build_map(collect_shapes(*areas, skip=("plant", "desk"))).free.area == pytest.approx(200.0)
    with pytest.raises(ParameterError, match=r"plan: skip: unknown name 'plants': did you mean 'Plant'\?"):
        build_map(collect_shapes(*areas, skip=("plants",)))
    with pytest.raises(ParameterError, match=r"plan: boundary: no shape has a name"):
        build_map(collect_shapes(HALL, boundary="hall"))


def test_omissions_and_repairs_are_reported() -> None:
    collected = collect_shapes(HALL, [[0, 0], [1, 0], [2, 0]], lines=[[[1, 1], [1, 1]]])
    collected.omissions.add_heights(np.array([np.nan, 2.0, 3.5]))
    collected.count_omission("text", count=2)
    collected.count_omission("empty geometry", count=2)
    collected.repairs.counts["ring", "closed"] += 2
    foreign = build_map(collected)
    assert foreign.dropped == (
        "2 empty geometries",
        "1 line without a length",
        "1 outline without an area",
        "2 texts",
        "2 third coordinates, z from 2 to 3.5",
    )
    assert foreign.repaired == ("2 rings closed",)
    with pytest.raises(
        MapError, match=r"expected at least one closed outline or line, got none \(1 text left out\)"
    ):
        empty = collect_shapes()
        empty.count_omission("text")
        build_map(empty)


def test_hairlines_become_walls() -> None:
    foreign = build_map(collect_shapes(HALL, lines=[[[5, 0], [5, 5]]], thickness=1e-5))
    assert foreign.repaired == ("1 line thinner than 1 mm, widened to 1 mm",)
    assert foreign.free.area == pytest.approx(200 - 0.005)


def test_a_line_without_a_length_is_not_widened() -> None:
    foreign = build_map(collect_shapes(HALL, lines=[[[1, 1], [1, 1]]], thickness=1e-5))
    assert foreign.dropped == ("1 line without a length",)
    assert foreign.repaired == ()


def test_self_crossing_outlines_are_counted() -> None:
    bow = [[0, 0], [4, 4], [4, 0], [0, 4]]
    one = build_map(collect_shapes(bow), solid=False)
    assert one.repaired == ("the outline crossed or touched itself: Self-intersection[2 2]",)
    assert one.free.area == pytest.approx(8.0)
    two = build_map(collect_shapes(bow, [[x + 10, y] for x, y in bow]), solid=False)
    assert two.repaired == ("2 outlines crossed or touched themselves, the first: Self-intersection[2 2]",)


@pytest.mark.parametrize("far", [1e300, np.nan, np.inf, 2e7])
def test_coordinates_out_of_range_are_rejected(far: float) -> None:
    for drawn in ({"lines": [[[0, 0], [far, 0]]]}, {"points": [[far, 0]]}):
        with pytest.raises(MapError, match=r"plan: expected coordinates from -10000000 to"):
            collect_shapes(**drawn)
    with pytest.raises(MapError, match="coordinates from"):
        collect_shapes([[0, 0], [far, 0], [0, 1]])
    with pytest.raises(MapError, match="coordinates from"):
        Shapes("plan", ReadOptions()).add_circle(np.zeros(2), far)


def test_drawings_larger_than_any_map_are_rejected() -> None:
    far = collect_shapes(build_square(0, 0, 1e6, 9))
    with pytest.raises(MapError, match=r"plan: expected at most 10 km, got 1e.06 x 9 m: is the scale right."):
        build_map(far)


def test_shapes_thinner_than_the_grid_are_omitted() -> None:
    slivers = collect_shapes(*([[0, y], [3, y], [6, y + 1e-7]] for y in (0, 5)))
    assert build_map(slivers).free.area == pytest.approx(8 * 7)


def test_too_many_vertices_are_rejected() -> None:
    collected = Shapes("plan", ReadOptions())
    with pytest.raises(MapError, match=r"plan: expected at most"):
        collected.add_line(WallLine(np.zeros((MAX_VERTICES + 1, 2)), 0.1))


def test_a_tangle_of_lines_is_rejected() -> None:
    ends = np.random.default_rng(0).random((3000, 2, 2)) * 10
    with pytest.raises(MapError, match="crossings of lines"):
        build_map(collect_shapes(lines=ends.tolist()))


_ROOM = st.tuples(st.integers(0, 30), st.integers(0, 30), st.integers(1, 12), st.integers(1, 12))


@settings(max_examples=count_examples(100))
@given(st.lists(_ROOM, min_size=1, max_size=6), st.sampled_from(["free", "solid"]))
def test_free_and_solid_are_complements(rooms: list[tuple[int, int, int, int]], what: str) -> None:
    frame = (build_square(-1, -1, 60, 60), "boundary")
    foreign = build_map(collect_shapes(frame, *(build_square(*room) for room in rooms), outlines=what))
    together = shapely.union_all([box(x, y, x + w, y + h) for x, y, w, h in rooms])
    expected = together if what == "free" else box(-1, -1, 59, 59) - together
    assert foreign.free.is_valid
    assert foreign.free.symmetric_difference(expected).area < 1e-6
