from dataclasses import replace

import pytest

from robocov.environment import Environment
from robocov_app.figures.runs import MAX_MAPS, plot_maps


def list_texts(figure) -> list[str]:  # type: ignore[no-untyped-def]
    return [text.get_text() for text in figure.texts]


def test_maps_are_side_by_side_at_one_scale(empty: Environment, cluttered: Environment) -> None:
    wide = replace(empty, name="wide", boundary=((5.0, 5.0), (25.0, 5.0), (25.0, 12.0), (5.0, 12.0)))
    figure = plot_maps([empty, cluttered, wide])
    panels = figure.axes
    assert len(panels) == 3
    boxes = [axes.get_window_extent() for axes in panels]
    for axes, box in zip(panels, boxes, strict=True):
        zoom = box.width / (axes.get_xlim()[1] - axes.get_xlim()[0])
        assert zoom == pytest.approx(boxes[0].width / 20.0)
        assert box.height / (axes.get_ylim()[1] - axes.get_ylim()[0]) == pytest.approx(zoom)
    assert panels[2].get_xlim() == (5.0, 25.0)
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[k + 1 :])
    assert list_texts(figure)[:3] == ["empty", "cluttered", "wide"]
    assert round(figure.bbox.width) == 1600


def test_all_is_on_the_page_and_the_dark_is_dark(empty: Environment) -> None:
    figure = plot_maps([empty] * 7, "dark")
    assert sum(figure.get_facecolor()[:3]) < 0.6
    for axes in figure.axes:
        box = axes.get_window_extent()
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= 1600 and box.y1 <= figure.bbox.height


@pytest.mark.slow
def test_only_the_first_of_many_maps_are_drawn(empty: Environment) -> None:
    figure = plot_maps([empty] * (MAX_MAPS + 5))
    assert len(figure.axes) == MAX_MAPS
    assert f"{MAX_MAPS} of {MAX_MAPS + 5}" in list_texts(figure)
