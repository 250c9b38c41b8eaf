"""Plots from Python: axes in, axes out; and what notebooks show of maps and runs."""

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
from robocov_app.figures.page import to_plot_color
from robocov_app.figures.runs import plot_comparison, plot_environment, plot_trajectories
from robocov_app.look.colors import format_hex_color
from robocov_app.look.theme import DARK, LIGHT


@pytest.fixture(autouse=True)
def _coarse_pictures(request, monkeypatch):
    """Pictures of distances from few sites, which are soon there, but in the thorough run."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(drawing_backend, "MIN_FIGURE_LATTICE", 32)


RUN = record_walk(ROOMS, 5)
COST = CoverageCost(ROOMS, 32)
# made-up runs go through walls: their ends and a few moments that are free will do
RESULT = COST(RUN.positions[-1])
HISTORY = compute_cost_history(RUN.thin(0.0), COST, 1.0)
THINGS = [ROOMS, RUN, RESULT, HISTORY]
IDS = ["environment", "record", "result", "history"]


@pytest.mark.parametrize("thing", THINGS, ids=IDS)
class TestAxes:
    def test_without_axes_there_is_a_page_and_its_axes_come_out(self, thing):
        axes = thing.plot(size=(900, 600))
        assert axes.figure.get_size_inches() * axes.figure.dpi == pytest.approx([900, 600], abs=0.1)
        assert axes in axes.figure.axes and axes.has_data()
        png, said = axes._repr_png_()
        assert Image.open(io.BytesIO(png)).size == (900, 600)
        assert said["alt"]

    def test_themes(self, thing):
        axes = thing.plot(theme="dark", size=(500, 400))
        assert to_rgb(axes.figure.get_facecolor()) == to_plot_color(DARK.background)
        with pytest.raises(ParameterError, match="unknown theme 'drak': did you mean 'dark'"):
            thing.plot(theme="drak")

    @pytest.mark.slow
    def test_the_users_style_is_neither_heeded_nor_changed(self, thing):
        wanted, _ = thing.plot(size=(500, 400))._repr_png_()
        theirs = {"font.size": 30, "lines.linewidth": 9, "axes.grid": True, "image.cmap": "jet"}
        with matplotlib.rc_context(
            theirs | {"axes.facecolor": "pink", "axes.prop_cycle": "cycler('color','k')"}
        ):
            before = dict(matplotlib.rcParams)
            given, _ = thing.plot(size=(500, 400))._repr_png_()
            thing.plot(Figure().subplots())
            assert dict(matplotlib.rcParams) == before
        assert given == wanted

    def test_axes_in_the_same_axes_out_and_others_stay_as_they_are(self, thing):
        figure = Figure(layout="constrained")
        theirs, ours = figure.subplots(1, 2)
        theirs.plot([0, 1], [2, 3])
        theirs.set_title("mine")
        before = (theirs.get_xlim(), theirs.get_ylim(), theirs.get_aspect(), theirs.get_facecolor())
        assert thing.plot(ours) is ours and ours.get_children()
        assert (theirs.get_xlim(), theirs.get_ylim(), theirs.get_aspect(), theirs.get_facecolor()) == before
        assert len(theirs.lines) == 1 and theirs.get_title() == "mine"
        ours.set_title("theirs")  # and what the user adds holds
        ours.plot([1, 2], [1, 2], color="k")
        figure.savefig(io.BytesIO(), format="svg")

    @pytest.mark.slow
    def test_axes_of_a_part_of_a_figure_and_of_a_kind_of_ones_own(self, thing):
        class Mine(Axes):
            name = "mine"

        part = Figure().subfigures(1, 2)[1]
        axes = part.add_axes((0.2, 0.2, 0.6, 0.6), axes_class=Mine)
        assert thing.plot(axes) is axes and axes.has_data()
        part.figure.savefig(io.BytesIO(), format="pdf")

    @pytest.mark.parametrize(
        "make",
        [
            lambda: Figure(),
            lambda: Figure().subplots(2, 2),
            lambda: Figure().add_subplot(projection="polar"),
            lambda: Figure().add_subplot(projection="3d"),
            lambda: "axes",
        ],
        ids=["figure", "several", "polar", "3d", "text"],
    )
    def test_what_are_no_axes_is_refused(self, thing, make):
        with pytest.raises(
            ParameterError, match=r"^axes: expected one matplotlib Axes with straight x and y"
        ):
            thing.plot(make())

    def test_an_option_that_there_is_not_is_named(self, thing):
        with pytest.raises(TypeError, match="color_of_the_sky"):
            thing.plot(color_of_the_sky="blue")


def test_the_pages_are_those_of_the_command_line():
    """One implementation: what `plot` draws is what `robocov run` draws."""
    figure = plot_trajectories(RUN, mean_distance=1.5)
    assert RUN.plot(mean_distance=1.5)._repr_png_() == figure.axes[0]._repr_png_()


@pytest.mark.parametrize("thing", THINGS[:3], ids=IDS[:3])
def test_maps_on_given_axes_are_in_meters_and_not_distorted(thing):
    figure = Figure(figsize=(9, 3))
    axes = thing.plot(figure.subplots())
    figure.draw_without_rendering()
    assert axes.get_xlim() == (0.0, 16.0) and axes.get_ylim() == (0.0, 10.0)
    box = axes.get_window_extent()
    assert box.width / 16.0 == pytest.approx(box.height / 10.0)
    assert axes.get_xlabel() == "x (m)" and axes.get_ylabel() == "y (m)"
    assert all(re.fullmatch(r"\d+", label.get_text()) for label in axes.get_xticklabels())


class TestDistances:
    def test_they_are_drawn_where_they_are(self):
        """Each pixel has the color that the scale beside the map has at the exact distance."""
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
        scale = LIGHT.build_heat_table(1000)[np.minimum(distances / limit * 1000, 999).astype(int)].astype(
            int
        )
        right = np.abs(colors - scale).max(axis=1) <= 8
        # borders, walls' edges, robots and their numbers cover the others
        assert right.mean() > 0.85

    def test_small_axes_can_be_saved_large(self):
        axes = Figure(figsize=(2, 2), dpi=50).subplots()
        (image,) = RESULT.plot(axes).images
        assert image.get_size()[1] >= 1000

    @pytest.mark.slow
    def test_a_coarse_lattice_is_replaced_by_one_that_can_be_drawn(self):
        coarse = CoverageCost(ROOMS, 16)(RUN.positions[-1])
        fine = CoverageCost(ROOMS, 256)(RUN.positions[-1])
        words = [text.get_text() for text in coarse.plot().figure.texts]
        # the picture is the finer one's, the figure the result's own
        assert f"5 robots, mean distance {coarse.mean_distance:.3f} m" in words
        pictures = [result.plot().images[0].get_array() for result in (coarse, fine)]
        np.testing.assert_array_equal(*pictures)

    @pytest.mark.slow
    def test_robots_have_the_radius_that_they_are_said_to_have(self):
        def get_sizes(**options):
            (discs,) = [c for c in RESULT.plot(**options).collections if len(c.get_offsets()) == 5]
            return discs.get_sizes()

        assert get_sizes(radius=0.9).min() > 4 * get_sizes().max()
        apart = get_sizes(radius=[0.9, 0.1, 0.1, 0.1, 0.1])
        assert apart[0] > 4 * apart[1:].max()

    def test_a_result_without_its_map_is_rejected(self):
        for lost in (replace(RESULT, environment=None), replace(RESULT, sites=None)):
            with pytest.raises(ParameterError, match="expected a result with its map"):
                lost.plot()


def test_a_curve_has_its_name_and_its_controllers_color():
    blue = HISTORY.plot(label="RAPF", controller="rapf")
    assert [text.get_text() for text in blue.texts] == [f"RAPF  {HISTORY.mean_distance[-1]:.3f} m"]
    assert blue.lines[0].get_color() != HISTORY.plot(controller="rpf").lines[0].get_color()
    assert np.asarray(blue.lines[0].get_ydata()).tolist() == HISTORY.mean_distance.tolist()


class Elements(HTMLParser):
    """The elements of a page with their attributes, the words, and whether all are closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        if tag not in ("br", "img", "input", "meta", "link", "hr"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_startendtag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.words += data

    def of(self, tag):
        return [attributes for found, attributes in self.found if found == tag]


def asks_for_the_network(html: str) -> list[str]:
    pattern = r"""(?:src|href|srcset)\s*=\s*["'](?!data:|#)[^"']+|url\((?!["']?(?:data:|#))[^)]+|@import|https?://"""
    return re.findall(pattern, html.replace("http://www.w3.org/", ""))


class TestNotebook:
    @pytest.mark.parametrize("environment", [ROOMS, HALL, CORRIDOR, SHAFT], ids=lambda map_: map_.name)
    def test_a_map_is_a_picture_with_words_for_who_cannot_see_it(self, environment):
        html = environment._repr_html_()
        page = Elements(html)
        assert not page.open and not asks_for_the_network(html)
        (picture,) = page.of("svg")
        assert picture["role"] == "img" and environment.name in picture["aria-label"]
        assert f"{environment.free_area:.4g} m² free" in page.words
        assert len(html) < 40_000

    def test_it_is_in_light_and_dark(self):
        html = ROOMS._repr_html_()
        assert "prefers-color-scheme:dark" in html
        assert "data-jp-theme-light" in html and "data-vscode-theme-kind" in html
        assert format_hex_color(DARK.background) in html
        (drawing,) = re.findall(r"<svg.*</svg>", html, flags=re.DOTALL)
        assert "#" not in drawing, "colors of a theme in the drawing"

    def test_the_scale_bar_is_as_long_as_it_says(self):
        html = ROOMS._repr_html_()
        page = Elements(html)
        (bar,) = page.of("i")
        left, width = (float(part) / 100 for part in re.findall(r":([\d.]+)%", bar["style"]))
        (length,) = re.findall(r"(\d+(?:\.\d+)?) m$", page.words.strip())
        _, _, whole, _ = (float(part) for part in page.of("svg")[0]["viewbox"].split())
        outline = re.search(r'class="region" d="M([\d.]+) ', html)
        assert left * whole == pytest.approx(float(outline[1]), abs=0.1)
        # the outline is as far from the right edge
        assert width * whole / float(length) == pytest.approx(
            (whole - 2 * float(outline[1])) / 16.0, rel=2e-3
        )

    @pytest.mark.parametrize("name", ["<script>alert(1)</script>", 'a" onload="x', "倉庫 & 🤖"])
    def test_names_are_words_whatever_is_in_them(self, name):
        environment = replace(ROOMS, name=name, starts={name: ROOMS.starts["spread"]})
        for thing in (environment, replace(RUN, environment=environment, label=name)):
            page = Elements(thing._repr_html_())
            assert not page.open
            plain = Elements((ROOMS if thing is environment else RUN)._repr_html_())
            assert [tag for tag, _ in page.found] == [tag for tag, _ in plain.found]
            assert not any(key.startswith("on") for _, attributes in page.found for key in attributes)
            assert name in page.words

    def test_a_run_is_a_replay_with_its_cost(self):
        html = RUN._repr_html_()
        page = Elements(html)
        assert not page.open and not asks_for_the_network(html)
        assert "robocov-replay" in html and "startReplays" in html
        assert not [attributes for _, attributes in page.found if "id" in attributes]
        assert any("trajectories of 5 robots" in (svg.get("aria-label") or "") for svg in page.of("svg"))
        assert len(html) < 200_000

    def test_a_run_whose_cost_cannot_be_had_is_shown_without(self):
        """These robots walk through walls, where no distance is known."""
        inside = np.broadcast_to(np.array([11.0, 2.8]), RUN.positions.shape)
        html = replace(RUN, positions=inside)._repr_html_()
        assert "robocov-replay" in html and '"cost":null' in html

    def test_nobody_waits_for_the_cost_of_a_large_map(self, monkeypatch):
        monkeypatch.setattr(drawing_backend, "MAX_COST_VERTICES", 10)
        assert "robocov-replay" in RUN._repr_html_() and '"cost":null' in RUN._repr_html_()

    def test_a_run_of_one_moment_is_shown(self):
        first = RUN.until(0.0)
        assert "robocov-replay" in first._repr_html_()
        assert Image.open(io.BytesIO(first._repr_png_())).format == "PNG"

    def test_where_there_is_no_html_there_is_the_page(self):
        assert ROOMS._repr_png_() == plot_environment(ROOMS).axes[0]._repr_png_()[0]

    def test_the_same_run_gives_the_same_bytes(self):
        assert RUN._repr_html_() == record_walk(ROOMS, 5)._repr_html_()


def test_a_comparison_is_shown_for_each_of_its_axes():
    figure = plot_comparison([RUN, record_walk(HALL, 3)])
    shown = [axes._repr_png_() for axes in figure.axes]
    assert shown[0] == shown[1]


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


def test_the_backend_has_no_options_of_its_own_beside_the_documented():
    """What `plot` documents is what it takes."""
    import inspect

    from robocov_app.figures import runs

    drawn_by = {"plot_environment": runs.plot_environment, "plot_record": runs.plot_trajectories}
    drawn_by["plot_history"] = runs.plot_cost
    text = inspect.getdoc(Drawable.plot).partition("Returns")[0].partition("Those of ``matplotlib`` are:")[2]
    entries = re.findall(r"^([\w, ]+) : .*\n((?: +.*\n)*)", textwrap.dedent(text), flags=re.MULTILINE)
    documented = {name: words for names, words in entries for name in names.split(", ")}
    for function, whose in (
        ("plot_environment", "map"),
        ("plot_record", "record"),
        ("plot_result", "coverage result"),
        ("plot_history", "cost history"),
        ("plot_comparison", "comparison"),
    ):
        parameters = inspect.signature(getattr(drawing_backend, function)).parameters.values()
        options = {each.name for each in parameters if each.kind is inspect.Parameter.KEYWORD_ONLY}
        if function in drawn_by:  # the others are handed on, after what is drawn and the axes
            options |= {*list(inspect.signature(drawn_by[function]).parameters)[2:]}
        own = {name for name, words in documented.items() if re.search(rf"\b{whose}\b", words)}
        assert own | {"theme", "size"} == options
