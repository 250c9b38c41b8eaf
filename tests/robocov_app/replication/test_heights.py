"""The best position of a sensor, depending on its height."""

from itertools import combinations

import numpy as np
import pytest

from robocov.observation.region import Region
from robocov_app.look.colors import compute_contrast
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.replication.figures.height_plot import PENTAGON, draw_heights, find_sensor_optima

HEIGHTS = (0.01, 0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 100.0)


def test_the_best_position_moves_from_the_median_to_the_centroid() -> None:
    rows = find_sensor_optima(HEIGHTS)
    assert [row.height for row in rows] == [0.0, *HEIGHTS, np.inf]
    distances = [row.distance for row in rows]
    assert distances == sorted(distances, reverse=True)
    assert (rows[-1].x, rows[-1].y) == pytest.approx(tuple(Region(np.array(PENTAGON)).centroid))
    assert distances[-1] == 0.0
    assert rows[0].x == pytest.approx(rows[1].x, abs=1e-6)
    assert all(0.0 < row.loss < 4e-4 for row in rows[1:-1] if row.height < 10.0)
    assert np.isnan([rows[0].loss, rows[-1].loss]).all()


def test_the_best_position_at_a_height_of_one_meter() -> None:
    row = find_sensor_optima((1.0,))[1]
    assert (row.x, row.y, row.distance) == pytest.approx((2.0849, 1.6650, 0.05609), abs=6e-5)
    assert row.loss == pytest.approx(0.000284, abs=1e-6)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_the_plot_shows_the_whole_path(theme) -> None:
    cell, frame, distance = draw_heights((900, 380), theme, 0.8).axes
    path = frame.lines[0]
    low, high = frame.get_xlim()
    assert low < min(path.get_xdata()) and max(path.get_xdata()) < high
    low, high = frame.get_ylim()
    assert low < min(path.get_ydata()) and max(path.get_ydata()) < high
    assert distance.get_xscale() == "log"
    assert cell.get_aspect() == frame.get_aspect() == 1.0


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_heights_are_labeled_legibly(theme) -> None:
    figure = draw_heights((900, 380), theme, 0.8)
    _, frame, _ = figure.axes
    labels = [text.get_text() for text in frame.texts]
    assert "h → ∞: the centroid" in labels and len(labels) >= 5
    heights = [label for label in labels if label.startswith("h = ")]
    assert all(len(label) <= len("h = 0.001 m") for label in heights)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in frame.texts]
    assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))
    assert all(frame.bbox.x0 < box.x0 and box.x1 < frame.bbox.x1 for box in boxes)
    color = tuple(round(255 * channel) for channel in frame.texts[0].get_color())
    assert compute_contrast(color, theme.background) > 7
