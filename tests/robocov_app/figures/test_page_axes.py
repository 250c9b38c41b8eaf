"""Figures that a notebook shows for their axes."""

import io
import pickle

import matplotlib
import pytest
from drawn_run import ROOMS, record_walk
from PIL import Image

from robocov_app.figures.map_pages import plot_trajectories
from robocov_app.figures.page import FigurePage, PageBox
from robocov_app.look.theme import DARK


def test_axes_are_shown_with_their_whole_page():
    figure = plot_trajectories(record_walk(ROOMS, 3), size=(1300, 900))
    png, _ = figure.axes[0]._repr_png_()
    assert Image.open(io.BytesIO(png)).size == (1300, 900)


def test_a_page_is_shown_in_the_size_for_which_its_texts_are_meant():
    """A page of 960 x 640 pixels has texts for 100 dots per inch."""
    figure = plot_trajectories(record_walk(ROOMS, 3), size=(1300, 900))
    _, metadata = figure.axes[0]._repr_png_()
    text_scale = min(1300 / 960, 900 / 640)
    assert metadata["width"] == pytest.approx(1300 / text_scale, abs=1)


def test_a_shown_page_has_an_alternative_text():
    _, metadata = plot_trajectories(record_walk(ROOMS, 3)).axes[0]._repr_png_()
    assert "RAPF  ·  rooms" in metadata["alt"]
    assert "3 robots" in metadata["alt"]


def test_lines_that_are_added_to_shown_axes_appear():
    axes = plot_trajectories(record_walk(ROOMS, 3)).axes[0]
    png, _ = axes._repr_png_()
    axes.plot([2, 8], [1, 9])
    png_with_line, _ = axes._repr_png_()
    assert png_with_line != png


def test_shown_axes_do_not_depend_on_the_matplotlib_style_of_the_user():
    axes = FigurePage((400, 300), DARK).add_axes(PageBox(20, 20, 360, 260))
    expected = axes._repr_png_()
    with matplotlib.rc_context({"savefig.facecolor": "red", "savefig.bbox": "tight", "savefig.dpi": 17}):
        assert axes._repr_png_() == expected


def test_a_page_can_be_pickled():
    figure = plot_trajectories(record_walk(ROOMS, 3))
    unpickled = pickle.loads(pickle.dumps(figure))
    assert unpickled.axes[0]._repr_png_() == figure.axes[0]._repr_png_()
