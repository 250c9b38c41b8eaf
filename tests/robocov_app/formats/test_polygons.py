"""Areas that rings enclose, compared with winding numbers that are computed from angles."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import Polygon, box

from robocov.errors import MapError
from robocov_app.formats.geometry.crossings import (
    MAX_CROSSINGS,
    CrossingCounter,
    extract_edges,
    extract_sides,
)
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes.enclosed_area import find_enclosed_area

_RING = st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=3, max_size=9)


def count_windings(ring: np.ndarray, x: float, y: float) -> float:
    """Return the winding number of a ring around a point, from the angles between its vertices."""
    angle = np.arctan2(ring[:, 1] - y, ring[:, 0] - x)
    turn = (np.diff(angle, append=angle[:1]) + math.pi) % math.tau - math.pi
    return float(np.rint(turn.sum() / math.tau))


@settings(max_examples=count_examples(150))
@given(st.lists(_RING, min_size=1, max_size=3), st.sampled_from(["evenodd", "nonzero"]))
def test_fills_agree_with_winding_angles(rings: list[list[tuple[int, int]]], rule: str) -> None:
    arrays = [np.array(ring, dtype=float) for ring in rings]
    enclosed = find_enclosed_area(arrays, rule)  # type: ignore[arg-type]
    area = enclosed.area
    reason = enclosed.invalidity
    assert area.is_valid
    assert reason is None
    # Irrational coordinates are not on an edge.
    for x in np.arange(0.123456789, 12.0, 1.7):
        for y in np.arange(0.1415926, 12.0, 1.9):
            around = [count_windings(ring, x, y) for ring in arrays]
            inside = sum(around) != 0 if rule == "nonzero" else sum(abs(n) for n in around) % 2 == 1
            edge = min(shapely.distance(shapely.LinearRing(ring), shapely.Point(x, y)) for ring in arrays)
            assert edge < 1e-9 or area.covers(shapely.Point(x, y)) == inside


@settings(max_examples=count_examples(150))
@given(st.lists(_RING, min_size=1, max_size=3))
def test_holes_are_subtracted_from_the_outline(rings: list[list[tuple[int, int]]]) -> None:
    arrays = [np.array(ring, dtype=float) for ring in rings]
    enclosed = find_enclosed_area(arrays)
    area = enclosed.area
    reason = enclosed.invalidity
    lost = enclosed.lost_holes
    assert area.is_valid
    outer = find_enclosed_area(arrays[:1]).area
    assert area.difference(outer).area < 1e-9
    for hole in arrays[1:]:
        if Polygon(hole).is_valid:
            assert area.intersection(Polygon(hole)).area < 1e-9
    plain = Polygon(arrays[0], arrays[1:])
    assert lost or (reason is None) == (plain.is_valid or area.is_empty)
    if plain.is_valid and plain.area > 0.0:
        assert area.geoms[0].equals(plain)


def test_a_bow_tie_consists_of_both_halves() -> None:
    enclosed = find_enclosed_area([np.array([[0, 0], [4, 4], [4, 0], [0, 4]], dtype=float)])
    area = enclosed.area
    reason = enclosed.invalidity
    assert reason == "Self-intersection[2 2]"
    assert area.area == 8.0


def test_halves_with_a_common_edge_are_joined() -> None:
    ring = np.array([[1, 0], [2, 2], [2, 0], [1, 0], [2, 2], [0, 0]], dtype=float)
    area = find_enclosed_area([ring]).area
    assert area.is_valid and len(area.geoms) == 1


def test_rings_without_area_are_empty() -> None:
    line = np.array([[0, 0], [4, 0], [0, 0]], dtype=float)
    for rule in ("holes", "evenodd", "nonzero"):
        assert find_enclosed_area([line], rule).area.is_empty
        assert find_enclosed_area([np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])], rule).area.is_empty
        assert find_enclosed_area([], rule).area.is_empty


@pytest.mark.slow
def test_a_ring_may_touch_itself_many_times() -> None:
    count = 2000
    angle = np.arange(count) * math.tau / count
    star = np.column_stack([np.cos(angle), np.sin(angle)]) * np.where(np.arange(count) % 2, 1.0, 3.0)[:, None]
    CrossingCounter("star").add([shapely.LinearRing(star)])
    x = np.arange(count, dtype=float)
    parallel = np.stack([np.column_stack([x, 0 * x]), np.column_stack([x + 900, 0 * x + 900])], axis=1)
    CrossingCounter("hatch").add(shapely.linestrings(parallel))


@pytest.mark.slow
@pytest.mark.parametrize("count", [800, 3000, 20_000])
def test_a_tangle_is_rejected_early(count: int) -> None:
    ring = np.random.default_rng(1).random((count, 2))
    with pytest.raises(MapError, match=f"knot: expected at most {MAX_CROSSINGS} crossings of lines"):
        CrossingCounter("knot").add([shapely.LinearRing(ring)])
    CrossingCounter("loose").add([shapely.LinearRing(ring[:200])])


def test_the_message_about_crossings_states_their_number() -> None:
    counter = CrossingCounter("knot", count=MAX_CROSSINGS)
    with pytest.raises(MapError, match=f"got about {MAX_CROSSINGS + 1}$"):
        counter.add([shapely.LineString([(0, 0), (2, 2)]), shapely.LineString([(0, 2), (2, 0)])])


@pytest.mark.slow
def test_crossings_of_all_shapes_are_counted_together() -> None:
    angle = np.arange(151) * 75 * math.tau / 151
    star = np.column_stack([np.cos(angle), np.sin(angle)])
    crossings = CrossingCounter("stars")
    find_enclosed_area([star], "nonzero", crossings)
    assert crossings.count == pytest.approx(151 * (75 - 1), rel=0.01)
    find_enclosed_area([star + 5], "evenodd", crossings)
    with pytest.raises(MapError, match=r"stars: expected at most"):
        find_enclosed_area([star + 9], "holes", crossings)


def test_ineffective_holes_are_counted() -> None:
    outer = box(0, 0, 9, 9).exterior
    hole = box(1, 1, 2, 2).exterior
    nothing = [
        [(3, 3), (4, 4)],
        [(3, 3), (3, 3), (3, 3)],
        [(5, 5), (6, 6), (7, 7)],
        [(20, 0), (21, 0), (21, 1)],
    ]
    rings = [np.array(ring) for ring in (outer.coords, hole.coords, *nothing)]
    enclosed = find_enclosed_area(rings)
    area = enclosed.area
    lost = enclosed.lost_holes
    assert area.area == 80
    assert lost == {
        "with fewer than three different points": 2,
        "without an area": 1,
        "outside of their outline": 1,
    }
    assert find_enclosed_area(rings[:4]).lost_holes == {"with fewer than three different points": 2}


def test_edges_and_parts_are_extracted() -> None:
    ring = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert extract_edges([shapely.LinearRing(ring)] * 2).shape == (6, 2, 2)
    assert extract_edges([shapely.LineString(ring)]).tolist() == [[[0, 0], [1, 0]], [[1, 0], [1, 1]]]
    assert extract_edges([]).shape == (0, 2, 2)
    assert extract_sides(shapely.box(0, 0, 1, 1) - shapely.box(0.2, 0.2, 0.5, 0.5)).shape == (8, 2, 2)
    nested = shapely.GeometryCollection(
        [shapely.Point(0, 0), shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(5, 5, 9, 9)])]
    )
    assert [part.area for part in to_multipolygon(nested).geoms] == [16.0, 1.0]


def test_no_part_is_lost_at_almost_coincident_edges() -> None:
    # Without a grid, GEOS 3.14 loses the triangle on the right.
    slim = Polygon([(0, 0), (1, 0), (-40, 764)])
    enclosed = find_enclosed_area([np.array([(0, 0), (1, 161), (1, 0), (-40, 764)], dtype=float)])
    bow = enclosed.area
    reason = enclosed.invalidity
    assert reason is not None
    both = unite([slim, bow])
    assert shapely.distance(both, shapely.Point(1, 161)) < 1e-5
    overlap = shapely.intersection(slim, bow, grid_size=1e-9).area
    assert both.area == pytest.approx(slim.area + bow.area - overlap, rel=1e-5)


@settings(max_examples=count_examples(60), deadline=None)
@given(st.lists(_RING, min_size=1, max_size=5))
def test_a_union_covers_its_parts(rings: list[list[tuple[int, int]]]) -> None:
    areas = [find_enclosed_area([np.array(ring, dtype=float)], "nonzero").area for ring in rings]
    both = unite(areas)
    assert both.area >= max(area.area for area in areas) - 1e-6
    for area in areas:
        assert shapely.difference(area, both.buffer(1e-5)).area < 1e-9
