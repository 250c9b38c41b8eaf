"""Layout of the viewer: boxes that fill the window, panes of equal size, and the scale of texts."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.toolkit.window.layout import (
    MIN_PORTRAIT_SIZE_PX,
    MIN_SIZE_PX,
    Box,
    Layout,
    build_layout,
    find_max_scale,
    is_inside,
)

WIDTHS = st.integers(900, 3840)
HEIGHTS = st.integers(600, 2160)
SCALES = st.floats(1.0, 3.0)
ASPECTS = st.floats(0.1, 10.0)


@st.composite
def draw_layouts(draw: st.DrawFn) -> Layout:
    size = draw(WIDTHS), draw(HEIGHTS)
    panes = draw(st.integers(1, 4))
    return build_layout(
        size,
        draw(SCALES),
        panes,
        draw(ASPECTS),
        panel=draw(st.booleans()),
    )


def list_boxes(layout: Layout) -> list[Box]:
    return [
        layout.bar,
        layout.rail,
        layout.arena,
        layout.handle,
        layout.panel,
        layout.chart,
        layout.time_slider,
        layout.status,
    ]


def compute_overlap(first: Box, second: Box) -> int:
    """Return the area that two boxes share, px²."""
    width = min(first[0] + first[2], second[0] + second[2]) - max(first[0], second[0])
    height = min(first[1] + first[3], second[1] + second[3]) - max(first[1], second[1])
    return max(width, 0) * max(height, 0)


@given(draw_layouts())
def test_boxes_fill_the_window_without_overlapping(layout: Layout) -> None:
    boxes = list_boxes(layout)
    width, height = layout.size
    for left, top, box_width, box_height in boxes:
        assert left >= 0
        assert top >= 0
        assert left + box_width <= width
        assert top + box_height <= height
    for k, first in enumerate(boxes):
        for second in boxes[k + 1 :]:
            assert compute_overlap(first, second) == 0
    assert sum(box_width * box_height for _, _, box_width, box_height in boxes) == width * height


@given(draw_layouts())
def test_panes_have_equal_sizes_and_do_not_overlap(layout: Layout) -> None:
    assert len({pane[2:] for pane in layout.panes}) == 1
    left, top, width, height = layout.arena
    for k, pane in enumerate(layout.panes):
        assert pane[0] >= left
        assert pane[1] >= top + layout.legend.height
        assert pane[0] + pane[2] <= left + width
        assert pane[1] + pane[3] <= top + height
        assert pane[2] > 50
        assert pane[3] > 30
        assert all(compute_overlap(pane, other) == 0 for other in layout.panes[k + 1 :])


@given(draw_layouts())
def test_texts_fit_at_the_scale_of_the_layout(layout: Layout) -> None:
    width, height = layout.size
    min_size = MIN_SIZE_PX if width >= height else MIN_PORTRAIT_SIZE_PX
    assert width / layout.scale >= min_size[0]
    assert height / layout.scale >= min_size[1]
    row_height = round(26 * layout.scale)
    panel_width = round(320 * layout.scale)
    if layout.has_sheet:
        row_height = 0
        panel_width = width
    assert layout.panel.width in (0, panel_width)
    assert layout.status.height == layout.time_slider.height == row_height


@given(WIDTHS, HEIGHTS, SCALES)
def test_a_scale_that_fits_is_kept(width: int, height: int, scale: float) -> None:
    layout = build_layout((width, height), scale, 1, 1.0)
    assert layout.scale == min(scale, find_max_scale((width, height)))


def test_the_smallest_window_fits_at_scale_1() -> None:
    assert build_layout(MIN_SIZE_PX, 1.0, 4, 1.0).scale == 1.0


@pytest.mark.parametrize("size", [(640, 480), (320, 200), (200, 2000), (1, 1)])
def test_windows_that_are_too_small_have_a_small_scale(size: tuple[int, int]) -> None:
    for panes in (1, 2, 3, 4):
        layout = build_layout(size, 1.0, panes, 1.3)
        assert layout.scale < 1.0
        assert layout.arena.width >= 0
        assert all(pane[3] >= 1 for pane in layout.panes)


@given(draw_layouts(), st.integers(0, 3839), st.integers(0, 2159))
def test_every_pixel_is_in_one_box(layout: Layout, x: int, y: int) -> None:
    pixel = (x % layout.size[0], y % layout.size[1])
    assert sum(is_inside(box, pixel) for box in list_boxes(layout)) == 1


@pytest.mark.parametrize("size", [(1280, 720), (900, 600), (2560, 1440)])
def test_four_panes_form_two_columns_if_their_maps_are_larger_so(size: tuple[int, int]) -> None:
    layout = build_layout(size, 1.0, 4, 4 / 3)
    assert len({left for left, *_ in layout.panes}) == 2
