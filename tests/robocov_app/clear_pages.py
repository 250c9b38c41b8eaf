"""Whether the words of a plot can all be read."""


def list_boxes(figure):
    """Return the extents of all that is written on the page outside the arenas, and of the arenas."""
    renderer = figure.canvas.get_renderer()
    texts = [text for text in figure.texts if text.get_text()]
    parts = [*texts, *figure.legends]
    return [part.get_window_extent(renderer) for part in parts], [
        axes.get_window_extent(renderer) for axes in figure.axes
    ]


def overlaps(first, second):
    wide = min(first.x1, second.x1) - max(first.x0, second.x0)
    high = min(first.y1, second.y1) - max(first.y0, second.y0)
    return wide > 1.0 and high > 1.0


def assert_all_clear(figure):
    """Nothing is cut at the page's edge, and no words lie on others or on an arena."""
    words, arenas = list_boxes(figure)
    page = figure.bbox
    for box in [*words, *arenas]:
        assert box.x0 >= -0.5 and box.y0 >= -0.5 and box.x1 <= page.x1 + 0.5 and box.y1 <= page.y1 + 0.5
    everything = [*words, *arenas]
    for k, box in enumerate(everything):
        for other in everything[k + 1 :]:
            assert not overlaps(box, other)
