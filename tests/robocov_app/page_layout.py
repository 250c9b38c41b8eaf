"""Checks that all texts of a plot can be read."""

MIN_OVERLAP_PX = 1.0
MAX_OVERHANG_PX = 0.5


def measure_extents(figure):
    """Return the extents of all texts outside the axes, and those of the axes, px."""
    renderer = figure.canvas.get_renderer()
    texts = [text for text in figure.texts if text.get_text()]
    text_boxes = [text.get_window_extent(renderer) for text in [*texts, *figure.legends]]
    axes_boxes = [axes.get_window_extent(renderer) for axes in figure.axes]
    return text_boxes, axes_boxes


def boxes_overlap(first, second):
    """Return whether two boxes overlap by more than `MIN_OVERLAP_PX` in both directions."""
    overlap_width = min(first.x1, second.x1) - max(first.x0, second.x0)
    overlap_height = min(first.y1, second.y1) - max(first.y0, second.y0)
    return overlap_width > MIN_OVERLAP_PX and overlap_height > MIN_OVERLAP_PX


def assert_layout_is_clear(figure):
    """Check that nothing is cut off at the edge of the page, and that no text overlaps anything."""
    text_boxes, axes_boxes = measure_extents(figure)
    boxes = [*text_boxes, *axes_boxes]
    page = figure.bbox
    for box in boxes:
        assert box.x0 >= -MAX_OVERHANG_PX
        assert box.y0 >= -MAX_OVERHANG_PX
        assert box.x1 <= page.x1 + MAX_OVERHANG_PX
        assert box.y1 <= page.y1 + MAX_OVERHANG_PX
    for k, box in enumerate(boxes):
        for other in boxes[k + 1 :]:
            assert not boxes_overlap(box, other)
