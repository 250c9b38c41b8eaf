"""The path of a sensor's best place, by its height."""

import numpy as np
import pytest

from robocov.observation.region import Region
from robocov_app.look.colors import compute_contrast
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.replication.figures.height_plot import PENTAGON, draw_heights, find_sensor_optima

HEIGHTS = (0.01, 0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 100.0)


def test_rows_go_from_one_limit_to_the_other() -> None:
    rows = find_sensor_optima(HEIGHTS)
    assert [row.height for row in rows] == [0.0, *HEIGHTS, np.inf]
    away = [row.distance for row in rows]
    assert away == sorted(away, reverse=True)
    assert (rows[-1].x, rows[-1].y) == pytest.approx(tuple(Region(np.array(PENTAGON)).centroid))
    assert away[-1] == 0.0
    assert rows[0].x == pytest.approx(rows[1].x, abs=1e-6)
    assert all(0.0 < row.loss < 4e-4 for row in rows[1:-1] if row.height < 10.0)
    assert np.isnan([rows[0].loss, rows[-1].loss]).all()


def test_the_best_place_at_a_height() -> None:
    row = find_sensor_optima((1.0,))[1]
    assert (row.x, row.y, row.distance) == pytest.approx((2.0849, 1.6650, 0.05609), abs=6e-5)
    assert row.loss == pytest.approx(0.000284, abs=1e-6)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_the_plot_shows_the_path_in_its_frame(theme) -> None:
    figure = draw_heights((900, 380), theme, 0.8)
    cell, frame, distance = figure.axes
    path = frame.lines[0]
    low, high = frame.get_xlim()
    assert low < min(path.get_xdata()) and max(path.get_xdata()) < high
    low, high = frame.get_ylim()
    assert low < min(path.get_ydata()) and max(path.get_ydata()) < high
    assert distance.get_xscale() == "log"
    assert cell.get_aspect() == frame.get_aspect() == 1.0
    words = [each.get_text() for each in frame.texts]
    assert "h → ∞: the centroid" in words and len(words) >= 5
    marks = [word for word in words if word.startswith("h = ")]
    assert all(len(word) <= len("h = 0.001 m") for word in marks)
    # no word on another one, and all of them in the frame
    figure.canvas.draw()
    boxes = [each.get_window_extent() for each in frame.texts]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[k + 1 :])
    assert all(frame.bbox.x0 < box.x0 and box.x1 < frame.bbox.x1 for box in boxes)
    assert compute_contrast(tuple(round(255 * c) for c in frame.texts[0].get_color()), theme.background) > 7
