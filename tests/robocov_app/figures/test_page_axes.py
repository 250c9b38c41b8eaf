import io
import pickle

import matplotlib
import pytest
from drawn_run import ROOMS, record_walk
from PIL import Image

from robocov_app.figures.page import FigurePage, PageBox
from robocov_app.figures.runs import plot_trajectories
from robocov_app.look.theme import DARK


def test_the_page_is_shown_for_its_axes():
    figure = plot_trajectories(record_walk(ROOMS, 3), size=(1300, 900))
    png, said = figure.axes[0]._repr_png_()
    assert Image.open(io.BytesIO(png)).size == (1300, 900)
    # as large as its texts were meant to be: a page of 960 x 640 has them at 100 dots an inch
    assert said["width"] == pytest.approx(1300 / min(1300 / 960, 900 / 640), abs=1)
    assert "RAPF  ·  rooms" in said["alt"] and "3 robots" in said["alt"]


def test_later_drawing_on_page_axes_is_shown():
    axes = plot_trajectories(record_walk(ROOMS, 3)).axes[0]
    before, _ = axes._repr_png_()
    axes.plot([2, 8], [1, 9])
    assert axes._repr_png_()[0] != before


def test_page_axes_do_not_depend_on_the_style_of_the_user():
    axes = FigurePage((400, 300), DARK).add_axes(PageBox(20, 20, 360, 260))
    before = axes._repr_png_()
    with matplotlib.rc_context({"savefig.facecolor": "red", "savefig.bbox": "tight", "savefig.dpi": 17}):
        assert axes._repr_png_() == before


def test_a_page_can_be_pickled_as_other_figures_can():
    figure = plot_trajectories(record_walk(ROOMS, 3))
    again = pickle.loads(pickle.dumps(figure))
    assert again.axes[0]._repr_png_() == figure.axes[0]._repr_png_()
