"""Plots on matplotlib axes, and the display of maps and runs in notebooks."""

import inspect
import io
import re
import textwrap
from dataclasses import replace
from html.parser import HTMLParser

import matplotlib
import numpy as np
import pytest
from drawn_run import CORRIDOR, HALL, ROOMS, SHAFT, record_walk
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

import robocov as rc
from robocov.cost import CoverageCost
from robocov.drawing import Drawable
from robocov.errors import ParameterError
from robocov.metrics import compute_cost_history
from robocov_app import notebook as drawing_backend
from robocov_app.figures.comparisons import plot_comparison
from robocov_app.figures.cost_curves import plot_cost
from robocov_app.figures.map_pages import plot_environment, plot_trajectories
from robocov_app.figures.page import to_plot_color
from robocov_app.look.colors import format_hex_color
from robocov_app.look.theme import DARK, LIGHT


@pytest.fixture(autouse=True)
def _use_coarse_lattice(request, monkeypatch):
    """Draw distances on a coarse lattice to save time, except in slow tests."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(drawing_backend, "MIN_FIGURE_LATTICE", 32)


RUN = record_walk(ROOMS, 5)
COST = CoverageCost(ROOMS, 32)
# The synthetic run passes through walls, so only its end and times without overlaps are used.
RESULT = COST(RUN.positions[-1])
HISTORY = compute_cost_history(RUN.thin(0.0), COST, 1.0)
DRAWABLES = [ROOMS, RUN, RESULT, HISTORY]
IDS = ["environment", "record", "result", "history"]


@pytest.mark.parametrize("drawable", DRAWABLES, ids=IDS)
class TestAxes:
    def test_without_axes_a_page_is_drawn(self, drawable):
        axes = drawable.plot(size=(900, 600))
        assert axes.figure.get_size_inches() * axes.figure.dpi == pytest.approx([900, 600], abs=0.1)
        assert axes in axes.figure.axes
        assert axes.has_data()
        png, metadata = axes._repr_png_()
        assert Image.open(io.BytesIO(png)).size == (900, 600)
        assert metadata["alt"]

    def test_the_theme_is_chosen_by_name(self, drawable):
        axes = drawable.plot(theme="dark", size=(500, 400))
        assert to_rgb(axes.figure.get_facecolor()) == to_plot_color(DARK.background)
        with pytest.raises(ParameterError, match="unknown theme 'drak': did you mean 'dark'"):
            drawable.plot(theme="drak")

    @pytest.mark.slow
    def test_the_users_style_is_neither_used_nor_changed(self, drawable):
        expected, _ = drawable.plot(size=(500, 400))._repr_png_()
        user_style = {
            "font.size": 30,
            "lines.linewidth": 9,
            "axes.grid": True,
            "image.cmap": "jet",
            "axes.facecolor": "pink",
            "axes.prop_cycle": "cycler('color','k')",
        }
        with matplotlib.rc_context(user_style):
            previous = dict(matplotlib.rcParams)
            drawn, _ = drawable.plot(size=(500, 400))._repr_png_()
            drawable.plot(Figure().subplots())
            assert dict(matplotlib.rcParams) == previous
        assert drawn == expected

    def test_given_axes_are_returned_and_other_axes_are_unchanged(self, drawable):
        figure = Figure(layout="constrained")
        other, given = figure.subplots(1, 2)
        other.plot([0, 1], [2, 3])
        other.set_title("other")
        previous = (other.get_xlim(), other.get_ylim(), other.get_aspect(), other.get_facecolor())
        assert drawable.plot(given) is given
        assert given.get_children()
        assert (other.get_xlim(), other.get_ylim(), other.get_aspect(), other.get_facecolor()) == previous
        assert len(other.lines) == 1
        assert other.get_title() == "other"
        given.set_title("added")  # The user may add to the plot.
        given.plot([1, 2], [1, 2], color="k")
        figure.savefig(io.BytesIO(), format="svg")

    @pytest.mark.slow
    def test_axes_of_a_user_class_in_a_subfigure_are_drawn_on(self, drawable):
        class UserAxes(Axes):
            name = "user"

        subfigure = Figure().subfigures(1, 2)[1]
        axes = subfigure.add_axes((0.2, 0.2, 0.6, 0.6), axes_class=UserAxes)
        assert drawable.plot(axes) is axes
        assert axes.has_data()
        subfigure.figure.savefig(io.BytesIO(), format="pdf")

    @pytest.mark.parametrize(
        "build_axes",
        [
            lambda: Figure(),
            lambda: Figure().subplots(2, 2),
            lambda: Figure().add_subplot(projection="polar"),
            lambda: Figure().add_subplot(projection="3d"),
            lambda: "axes",
        ],
        ids=["figure", "several", "polar", "3d", "text"],
    )
    def test_other_objects_than_axes_are_rejected(self, drawable, build_axes):
        with pytest.raises(
            ParameterError, match=r"^axes: expected one matplotlib Axes with straight x and y"
        ):
            drawable.plot(build_axes())

    def test_an_unknown_option_is_rejected(self, drawable):
        with pytest.raises(TypeError, match="color_of_the_sky"):
            drawable.plot(color_of_the_sky="blue")


def test_plot_draws_the_same_page_as_the_command():
    figure = plot_trajectories(RUN, mean_distance=1.5)
    assert RUN.plot(mean_distance=1.5)._repr_png_() == figure.axes[0]._repr_png_()


@pytest.mark.parametrize("drawable", DRAWABLES[:3], ids=IDS[:3])
def test_maps_on_given_axes_have_equal_scales_in_meters(drawable):
    figure = Figure(figsize=(9, 3))
    axes = drawable.plot(figure.subplots())
    figure.draw_without_rendering()
    assert axes.get_xlim() == (0.0, 16.0)
    assert axes.get_ylim() == (0.0, 10.0)
    box = axes.get_window_extent()
    assert box.width / 16.0 == pytest.approx(box.height / 10.0)
    assert axes.get_xlabel() == "x (m)"
    assert axes.get_ylabel() == "y (m)"
    assert all(re.fullmatch(r"\d+", label.get_text()) for label in axes.get_xticklabels())


class TestDistances:
    def test_pixels_have_the_color_of_their_exact_distance(self):
        figure = Figure(figsize=(8, 5), dpi=100)
        axes = figure.add_axes((0.1, 0.1, 0.7, 0.8))
        RESULT.plot(axes)
        data = io.BytesIO()
        figure.savefig(data, format="png", dpi=100)
        pixels = np.asarray(Image.open(data).convert("RGB")).astype(int)
        limit = axes.child_axes[0].get_ylim()[1]
        fine = CoverageCost(ROOMS, 64)
        result = fine(RUN.positions[-1])
        reached = np.isfinite(result.distances)
        distances = result.distances[reached]
        assert 0.5 * limit < distances.max() <= limit
        columns, heights = axes.transData.transform(fine.points[reached]).T
        colors = pixels[len(pixels) - 1 - heights.astype(int), columns.astype(int)]
        levels = np.minimum(distances / limit * 1000, 999).astype(int)
        expected_colors = LIGHT.build_heat_table(1000)[levels].astype(int)
        is_exact = np.abs(colors - expected_colors).max(axis=1) <= 8
        # Cell borders, edges of walls, robots and their numbers cover the other points.
        assert is_exact.mean() > 0.85

    def test_distances_on_small_axes_have_a_high_resolution(self):
        axes = Figure(figsize=(2, 2), dpi=50).subplots()
        (image,) = RESULT.plot(axes).images
        assert image.get_size()[1] >= 1000

    @pytest.mark.slow
    def test_a_coarse_result_is_drawn_on_a_finer_lattice(self):
        coarse = CoverageCost(ROOMS, 16)(RUN.positions[-1])
        fine = CoverageCost(ROOMS, 256)(RUN.positions[-1])
        texts = [text.get_text() for text in coarse.plot().figure.texts]
        assert f"5 robots, mean distance {coarse.mean_distance:.3f} m" in texts, "the value is not changed"
        drawn_coarse = coarse.plot().images[0].get_array()
        drawn_fine = fine.plot().images[0].get_array()
        np.testing.assert_array_equal(drawn_coarse, drawn_fine)

    @pytest.mark.slow
    def test_robots_are_drawn_with_the_given_radius(self):
        def get_sizes(**options):
            collections = RESULT.plot(**options).collections
            (discs,) = [collection for collection in collections if len(collection.get_offsets()) == 5]
            return discs.get_sizes()

        assert get_sizes(radius=0.9).min() > 4 * get_sizes().max()
        sizes = get_sizes(radius=[0.9, 0.1, 0.1, 0.1, 0.1])
        assert sizes[0] > 4 * sizes[1:].max()

    def test_a_result_without_its_map_is_rejected(self):
        for incomplete in (replace(RESULT, environment=None), replace(RESULT, sites=None)):
            with pytest.raises(ParameterError, match="expected a result with its map"):
                incomplete.plot()


def test_a_curve_has_its_label_and_the_color_of_its_controller():
    axes = HISTORY.plot(label="RAPF", controller="rapf")
    assert [text.get_text() for text in axes.texts] == [f"RAPF  {HISTORY.mean_distance[-1]:.3f} m"]
    assert axes.lines[0].get_color() != HISTORY.plot(controller="rpf").lines[0].get_color()
    assert np.asarray(axes.lines[0].get_ydata()).tolist() == HISTORY.mean_distance.tolist()


VOID_TAGS = ("br", "img", "input", "meta", "link", "hr")


class ParsedPage(HTMLParser):
    """A parsed page.

    Attributes
    ----------
    open_tags : list of str
        Elements that are not closed.
    elements : list of tuple of (str, dict)
        Tag and attributes of each element.
    text : str
        Text outside scripts and styles.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open_tags: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID_TAGS:
            self.open_tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open_tags.pop() == tag

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open_tags):
            self.text += data

    def find_all(self, tag):
        """Return the attributes of all elements with a tag."""
        return [attributes for other, attributes in self.elements if other == tag]


def find_external_links(html: str) -> list[str]:
    pattern = r"""(?:src|href|srcset)\s*=\s*["'](?!data:|#)[^"']+|url\((?!["']?(?:data:|#))[^)]+|@import|https?://"""
    return re.findall(pattern, html.replace("http://www.w3.org/", ""))


class TestNotebook:
    @pytest.mark.parametrize(
        "environment", [ROOMS, HALL, CORRIDOR, SHAFT], ids=lambda environment: environment.name
    )
    def test_a_map_is_a_drawing_with_a_description_for_screen_readers(self, environment):
        html = environment._repr_html_()
        page = ParsedPage(html)
        assert not page.open_tags
        assert not find_external_links(html)
        (drawing,) = page.find_all("svg")
        assert drawing["role"] == "img"
        assert environment.name in drawing["aria-label"]
        assert f"{environment.free_area:.4g} m² free" in page.text
        assert len(html) < 40_000

    def test_a_map_follows_the_theme_of_the_notebook(self):
        html = ROOMS._repr_html_()
        assert "prefers-color-scheme:dark" in html
        assert "data-jp-theme-light" in html
        assert "data-vscode-theme-kind" in html
        assert format_hex_color(DARK.background) in html
        (drawing,) = re.findall(r"<svg.*</svg>", html, flags=re.DOTALL)
        assert "#" not in drawing, "colors of a theme in the drawing"

    def test_the_scale_bar_has_the_labeled_length(self):
        html = ROOMS._repr_html_()
        page = ParsedPage(html)
        (bar,) = page.find_all("i")
        left, width = (float(part) / 100 for part in re.findall(r":([\d.]+)%", bar["style"]))
        (length,) = re.findall(r"(\d+(?:\.\d+)?) m$", page.text.strip())
        _, _, drawing_width, _ = (float(number) for number in page.find_all("svg")[0]["viewbox"].split())
        margin = float(re.search(r'class="region" d="M([\d.]+) ', html)[1])
        assert left * drawing_width == pytest.approx(margin, abs=0.1)
        map_scale = (drawing_width - 2 * margin) / 16.0
        assert width * drawing_width / float(length) == pytest.approx(map_scale, rel=2e-3)

    @pytest.mark.parametrize("name", ["<script>alert(1)</script>", 'a" onload="x', "倉庫 & 🤖"])
    def test_names_are_escaped(self, name):
        environment = replace(ROOMS, name=name, starts={name: ROOMS.starts["spread"]})
        record = replace(RUN, environment=environment, label=name)
        for drawable, plain in ((environment, ROOMS), (record, RUN)):
            page = ParsedPage(drawable._repr_html_())
            assert not page.open_tags
            plain_page = ParsedPage(plain._repr_html_())
            assert [tag for tag, _ in page.elements] == [tag for tag, _ in plain_page.elements]
            assert not any(key.startswith("on") for _, attributes in page.elements for key in attributes)
            assert name in page.text

    def test_a_run_is_a_replay_with_its_cost(self):
        html = RUN._repr_html_()
        page = ParsedPage(html)
        assert not page.open_tags
        assert not find_external_links(html)
        assert "robocov-replay" in html
        assert "startReplays" in html
        assert not [attributes for _, attributes in page.elements if "id" in attributes]
        labels = [drawing.get("aria-label") or "" for drawing in page.find_all("svg")]
        assert any("trajectories of 5 robots" in label for label in labels)
        assert len(html) < 200_000

    def test_a_run_without_a_finite_cost_is_shown_without_it(self):
        """All robots are inside an obstacle."""
        inside = np.broadcast_to(np.array([11.0, 2.8]), RUN.positions.shape)
        html = replace(RUN, positions=inside)._repr_html_()
        assert "robocov-replay" in html
        assert '"cost":null' in html

    def test_the_cost_on_a_large_map_is_not_computed(self, monkeypatch):
        monkeypatch.setattr(drawing_backend, "MAX_COST_VERTICES", 10)
        assert "robocov-replay" in RUN._repr_html_()
        assert '"cost":null' in RUN._repr_html_()

    def test_a_run_of_a_single_time_is_shown(self):
        start = RUN.until(0.0)
        assert "robocov-replay" in start._repr_html_()
        assert Image.open(io.BytesIO(start._repr_png_())).format == "PNG"

    def test_the_png_of_a_map_is_its_page(self):
        assert ROOMS._repr_png_() == plot_environment(ROOMS).axes[0]._repr_png_()[0]

    def test_the_same_run_gives_the_same_bytes(self):
        assert RUN._repr_html_() == record_walk(ROOMS, 5)._repr_html_()


def test_all_axes_of_a_comparison_show_the_whole_page():
    figure = plot_comparison([RUN, record_walk(HALL, 3)])
    first, second = (axes._repr_png_() for axes in figure.axes[:2])
    assert first == second


def test_a_comparison_is_a_page_with_a_panel_for_each_run():
    comparison = rc.compare(ROOMS, ["rapf", "lloyd"], robots=3, duration=1.0, lattice=8)
    axes = comparison.plot()
    assert len(axes.figure.axes) >= 2
    assert comparison._repr_png_().startswith(b"\x89PNG")
    html = comparison._repr_html_()
    assert html.count('class="robocov-replay"') == 1
    assert f"Lloyd on {ROOMS.name}" in html
    with pytest.raises(ParameterError, match="axes: expected None"):
        comparison.plot(axes)


def test_plot_documents_all_options_of_the_matplotlib_backend():
    # These functions pass further options on.
    passed_to = {
        "plot_environment": plot_environment,
        "plot_record": plot_trajectories,
        "plot_history": plot_cost,
    }
    text = inspect.getdoc(Drawable.plot).partition("Returns")[0].partition("Those of ``matplotlib`` are:")[2]
    entries = re.findall(r"^([\w, ]+) : .*\n((?: +.*\n)*)", textwrap.dedent(text), flags=re.MULTILINE)
    descriptions = {}
    for names, description in entries:
        descriptions |= dict.fromkeys(names.split(", "), description)
    for function, noun in (
        ("plot_environment", "map"),
        ("plot_record", "record"),
        ("plot_result", "coverage result"),
        ("plot_history", "cost history"),
        ("plot_comparison", "comparison"),
    ):
        parameters = inspect.signature(getattr(drawing_backend, function)).parameters.values()
        options = {
            parameter.name for parameter in parameters if parameter.kind is inspect.Parameter.KEYWORD_ONLY
        }
        if function in passed_to:
            # The first two parameters are the object and its axes.
            options |= {*list(inspect.signature(passed_to[function]).parameters)[2:]}
        documented = {
            name for name, description in descriptions.items() if re.search(rf"\b{noun}\b", description)
        }
        assert documented | {"theme", "size"} == options
