"""Where everything stands: in the window, beside each other, with room for what it is for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.toolkit.layout import (
    MIN_PORTRAIT_SIZE_PX,
    MIN_SIZE_PX,
    Box,
    Layout,
    build_layout,
    find_max_scale,
    is_inside,
)

WIDTHS, HEIGHTS = st.integers(900, 3840), st.integers(600, 2160)
SCALES = st.floats(1.0, 3.0)
ASPECTS = st.floats(0.1, 10.0)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    size = draw(WIDTHS), draw(HEIGHTS)
    panes = draw(st.integers(1, 4))
    rows = draw(st.integers(1, 3))
    return build_layout(size, draw(SCALES), panes, draw(ASPECTS), panel=draw(st.booleans()), legend_rows=rows)


def overlap(first: Box, second: Box) -> int:
    wide = min(first[0] + first[2], second[0] + second[2]) - max(first[0], second[0])
    high = min(first[1] + first[3], second[1] + second[3]) - max(first[1], second[1])
    return max(wide, 0) * max(high, 0)


@given(layouts())
def test_boxes_are_in_the_window_and_fill_it_without_overlapping(layout: Layout) -> None:
    boxes = [layout.arena, layout.panel, layout.chart, layout.track, layout.status]
    width, height = layout.size
    for left, top, wide, high in boxes:
        assert left >= 0 and top >= 0 and left + wide <= width and top + high <= height
    for k, first in enumerate(boxes):
        for second in boxes[k + 1 :]:
            assert overlap(first, second) == 0
    assert sum(wide * high for _, _, wide, high in boxes) == width * height


@given(layouts())
def test_panes_are_equal_in_the_arena_and_beside_each_other(layout: Layout) -> None:
    assert len({pane[2:] for pane in layout.panes}) == 1
    left, top, wide, high = layout.arena
    for k, pane in enumerate(layout.panes):
        assert pane[0] >= left and pane[1] >= top + layout.legend[3]
        assert pane[0] + pane[2] <= left + wide and pane[1] + pane[3] <= top + high
        assert pane[2] > 50 and pane[3] > 30
        assert all(overlap(pane, other) == 0 for other in layout.panes[k + 1 :])


@given(layouts())
def test_there_is_room_for_what_is_written_at_that_scale(layout: Layout) -> None:
    width, height = layout.size
    least = MIN_SIZE_PX if width >= height else MIN_PORTRAIT_SIZE_PX
    assert width / layout.scale >= least[0] and height / layout.scale >= least[1]
    assert layout.panel[2] in (0, round(320 * layout.scale))
    assert layout.status[3] == layout.track[3] == round(26 * layout.scale)


@given(WIDTHS, HEIGHTS, SCALES)
def test_a_scale_that_there_is_room_for_is_taken_as_it_is(width: int, height: int, scale: float) -> None:
    layout = build_layout((width, height), scale, 1, 1.0)
    assert layout.scale == min(scale, find_max_scale((width, height)))


def test_the_smallest_window_has_room_at_scale_1() -> None:
    assert build_layout(MIN_SIZE_PX, 1.0, 4, 1.0).scale == 1.0


@pytest.mark.parametrize("size", [(640, 480), (320, 200), (200, 2000), (1, 1)])
def test_windows_that_are_too_small_get_small_letters_and_no_error(size: tuple[int, int]) -> None:
    for panes in (1, 2, 3, 4):
        layout = build_layout(size, 1.0, panes, 1.3)
        assert layout.scale < 1.0
        assert layout.arena[2] >= 0 and all(pane[3] >= 1 for pane in layout.panes)


@given(layouts(), st.integers(0, 3839), st.integers(0, 2159))
def test_every_pixel_is_in_one_box(layout: Layout, x: int, y: int) -> None:
    x, y = x % layout.size[0], y % layout.size[1]
    boxes = (layout.arena, layout.panel, layout.chart, layout.track, layout.status)
    assert sum(is_inside(box, (x, y)) for box in boxes) == 1


@pytest.mark.parametrize(("size", "rows"), [((1280, 720), 1), ((900, 600), 2), ((2560, 1440), 1)])
def test_four_panes_stand_two_by_two_where_their_maps_are_larger_so(size: tuple[int, int], rows: int) -> None:
    layout = build_layout(size, 1.0, 4, 4 / 3, legend_rows=rows)
    assert len({left for left, *_ in layout.panes}) == 2
