"""The narrowest gap: exact cases, symmetry, and a comparison with erosion."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import MultiPolygon, Point, Polygon, box
from shapely.affinity import affine_transform
from shapely.geometry.base import BaseGeometry

from robocov.environment import find_narrow_gaps, find_narrowest_gap


def build_free_space(*parts: BaseGeometry) -> MultiPolygon:
    polygons = [polygon for part in parts for polygon in shapely.get_parts(part)]
    return MultiPolygon([shapely.orient_polygons(polygon) for polygon in polygons])


ROOM = box(0, 0, 10, 6)
TWO_ROOMS = ROOM - box(4.9, 0, 5.1, 2) - box(4.9, 2.7, 5.1, 6)
SLANTED_SLIT = Polygon([(0, 0), (10, 0), (10, 6), (0, 6)]) - Polygon([(3, 0), (4, 0), (6, 3), (5, 3)])


@pytest.mark.parametrize(
    ("space", "width"),
    [
        (TWO_ROOMS, 0.7),
        (ROOM - box(4, 2, 6, 5), 1.0),  # a block, 1 m from the north wall
        (ROOM - box(2, 2, 3, 3) - box(3.5, 3.5, 5, 5), math.hypot(0.5, 0.5)),  # corner to corner
        (ROOM - Polygon([(2, 2), (4, 3), (2, 4)]) - box(4.5, 1, 5, 5), 0.5),  # corner to side
        (box(0, 0, 3, 3) | box(3, 1, 8, 1.8), 0.8),  # a long dead end
        (box(0, 0, 3, 3) | box(3, 1, 8, 1.8) | box(8, 0, 11, 3), 0.8),
        (box(0, 0, 9, 2) | box(7, 0, 9, 9), 2.0),  # an L: both arms are long
        (
            ROOM - box(3, 0, 4, 3) - box(6, 3, 7, 6),
            2.0,
        ),  # a bend between two walls
        (SLANTED_SLIT, 3.0),
    ],
)
def test_widths_are_exact(space: BaseGeometry, width: float) -> None:
    gap = find_narrowest_gap(build_free_space(space))
    assert gap is not None
    assert gap.width == pytest.approx(width, abs=2e-6)
    first, second = gap.between
    assert math.dist(first, second) == pytest.approx(width, abs=2e-6)
    for end in gap.between:
        assert shapely.distance(space.boundary, Point(end)) < 2e-6


@pytest.mark.parametrize(
    "space",
    [
        ROOM,
        Polygon([(0, 0), (10, 0), (0.2, 1)]),  # acute corners
        Point(0, 0).buffer(5),
        ROOM | box(10, 2, 10.5, 3),  # a niche wider than deep
        ROOM | box(10, 2, 10.15, 2.1),  # a niche too small for a robot
        ROOM - Polygon([(0, 0), (5, 0), (0, 0.5)]),
        ROOM - box(0, 0, 3, 3) - box(3, 3, 10, 6),  # two rooms that touch in a point
        ROOM - Point(1, 3).buffer(1.0),  # a polygon of a circle that all but touches the wall
    ],
)
def test_spaces_without_passages_have_no_gap(space: BaseGeometry) -> None:
    assert find_narrowest_gap(build_free_space(space)) is None


def test_an_empty_space_has_no_gap() -> None:
    assert find_narrowest_gap(MultiPolygon()) is None


def test_many_vertices_along_a_wall_are_not_a_passage() -> None:
    angle = np.linspace(0, 2 * np.pi, 40_001)[:-1]
    round_room = Polygon(np.column_stack([np.cos(angle), np.sin(angle)]).round(9) * 50)
    assert find_narrowest_gap(build_free_space(round_room)) is None


def test_the_gap_is_the_narrowest_of_all_components() -> None:
    other_room = affine_transform(ROOM - box(4, 2, 6, 5.8), [1, 0, 0, 1, 20, 0])
    gap = find_narrowest_gap(build_free_space(TWO_ROOMS, other_room))
    assert gap is not None
    assert gap.width == pytest.approx(0.2)
    assert min(x for x, _ in gap.between) >= 20


@st.composite
def draw_room_with_blocks(draw: st.DrawFn) -> Polygon:
    """Draw a rectangular room with discs and boxes in it that touch neither each other nor a wall."""
    space: BaseGeometry = box(0, 0, 10, 8)
    blocks: list[BaseGeometry] = []
    for _ in range(draw(st.integers(1, 5))):
        x = draw(st.floats(1, 9))
        y = draw(st.floats(1, 7))
        size = draw(st.floats(0.1, 0.8))
        if draw(st.booleans()):
            block = Point(x, y).buffer(size, quad_segs=draw(st.integers(2, 12)))
        else:
            turn = draw(st.floats(0, math.pi))
            c = math.cos(turn)
            s = math.sin(turn)
            block = affine_transform(box(-size, -0.4, size, 0.4), [c, -s, s, c, x, y])
        is_apart = all(block.distance(other) > 0.05 for other in blocks)
        if is_apart and block.distance(space.exterior) > 0.05 and space.contains(block):
            blocks.append(block)
    return box(0, 0, 10, 8) - shapely.union_all(blocks)


def count_parts_and_holes(space: BaseGeometry, radius: float) -> tuple[int, int]:
    """Count the components and holes of the area for the center of a disc."""
    parts = shapely.get_parts(space.buffer(-radius, quad_segs=64))
    parts = parts[shapely.area(parts) > 0]
    return len(parts), int(sum(len(part.interiors) for part in parts))


@settings(deadline=None, max_examples=count_examples(150))
@given(draw_room_with_blocks())
def test_erosion_changes_the_topology_only_at_the_gap(space: Polygon) -> None:
    gap = find_narrowest_gap(build_free_space(space))
    original_counts = (1, len(space.interiors))
    if gap is None:
        assert original_counts == (1, 0)
        return
    for fraction in (0.2, 0.6, 0.998):
        assert count_parts_and_holes(space, fraction * gap.width / 2) == original_counts
    assert count_parts_and_holes(space, 1.002 * gap.width / 2) != original_counts


@settings(deadline=None, max_examples=count_examples(60))
@given(draw_room_with_blocks(), st.integers(0, 30), st.floats(0, 6.3), st.booleans())
def test_the_gap_moves_with_the_map(space: Polygon, first: int, turn: float, mirrored: bool) -> None:
    gap = find_narrowest_gap(build_free_space(space))
    c = math.cos(turn)
    s = math.sin(turn)
    flip = -1 if mirrored else 1
    moved = affine_transform(space, [c * flip, -s, s * flip, c, 3.0, -7.0])
    rings = [
        np.roll(np.asarray(ring.coords)[:-1], first, axis=0) for ring in (moved.exterior, *moved.interiors)
    ]
    moved_gap = find_narrowest_gap(build_free_space(Polygon(rings[0], rings[1:])))
    assert (gap is None) == (moved_gap is None)
    if gap is not None and moved_gap is not None:
        assert moved_gap.width == pytest.approx(gap.width, abs=2e-6)


@pytest.mark.parametrize("first", range(12))
@pytest.mark.parametrize("depth", [0.5, 1.5])
def test_a_niche_counts_if_it_is_deeper_than_wide_for_any_first_vertex(first: int, depth: float) -> None:
    ring = np.asarray((ROOM | box(10, 2, 10 + depth, 3)).exterior.coords)[:-1]
    gap = find_narrowest_gap(build_free_space(Polygon(np.roll(ring, first % len(ring), axis=0))))
    if depth < 1.0:
        assert gap is None
    else:
        assert gap is not None
        assert gap.width == pytest.approx(1.0)


# All gaps below a width


def test_all_gaps_below_a_width_are_found() -> None:
    walls = ROOM - box(2, 0, 2.2, 2) - box(2, 2.5, 2.2, 6) - box(7, 0, 7.2, 4) - box(7, 4.9, 7.2, 6)
    for width, doors in [(0.4, set()), (0.6, {0.5}), (1.0, {0.5, 0.9})]:
        gaps = find_narrow_gaps(build_free_space(walls), width)
        widths = [gap.width for gap in gaps]
        assert set(widths) == doors
        assert widths == sorted(widths)
        for gap in gaps:
            x = (gap.between[0][0] + gap.between[1][0]) / 2
            door_x = 2.1 if gap.width == 0.5 else 7.1
            assert abs(x - door_x) <= 0.1 + 1e-9
    assert find_narrow_gaps(build_free_space(ROOM), 100.0) == ()
    assert find_narrow_gaps(MultiPolygon(), 1.0) == ()


@settings(max_examples=count_examples(60))
@given(
    st.lists(
        st.tuples(st.integers(0, 9), st.integers(0, 5), st.integers(1, 3), st.integers(1, 3)), max_size=6
    )
)
def test_the_first_of_all_gaps_is_the_narrowest_one(blocks: list[tuple[int, int, int, int]]) -> None:
    room = ROOM - shapely.union_all([box(x, y, x + u - 0.35, y + v - 0.2) for x, y, u, v in blocks])
    space = build_free_space(room)
    gap = find_narrowest_gap(space)
    if gap is None:
        assert find_narrow_gaps(space, 20.0) == ()
    else:
        assert find_narrow_gaps(space, gap.width + 1e-3)[0].width == gap.width
        assert find_narrow_gaps(space, gap.width - 1e-5) == ()
