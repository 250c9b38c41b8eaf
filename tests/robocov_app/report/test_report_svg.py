"""Figures of matplotlib are embedded in a page as SVG."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from reported_results import HOSTILE, build_recorded_result, build_run

from robocov_app.figures.cost_bands import Band, plot_cost_bands
from robocov_app.figures.final_values import Sample, plot_final_values
from robocov_app.figures.gains import GainGrid, GainResults, plot_gain_grid, plot_gains
from robocov_app.figures.page import ValueAxis
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.theme import LIGHT
from robocov_app.report.analysis.groups import choose_group_styles
from robocov_app.report.plots.costs import build_cost_plots, build_final_distance_plots
from robocov_app.report.svg import inline_svg
from robocov_app.report.theme_css import list_css_colors

RNG = np.random.default_rng(5)
TIME = np.linspace(0.0, 10.0, 40)
STYLES = choose_controller_styles(["rapf", "rpf", "lloyd", "mine"])
PANEL = 420, 290
FIGURES = {
    "bands": lambda name="RAPF": plot_cost_bands(
        [
            Band(name, STYLES["rapf"], TIME, RNG.uniform(1, 2, (5, 40))),
            Band("RPF", STYLES["rpf"], TIME, np.ones((1, 40))),
        ],
        PANEL,
        ValueAxis("distance (m)", "m"),
    ),
    "boxes": lambda name="RAPF": plot_final_values(
        [
            (
                "",
                [
                    Sample(name, STYLES["rapf"], RNG.normal(2, 0.1, 300)),
                    Sample("x", STYLES["mine"], np.ones(2)),
                ],
            )
        ],
        ValueAxis("distance (m)"),
        width=800,
        scale=1.25,
    ),
    "gains": lambda name="RAPF": plot_gains(
        [GainResults(name, STYLES["lloyd"], np.array([1.0, 2.0, np.nan] * 9), np.ones(27))],
        name,
        PANEL,
        "distance (m)",
    ),
    "grid": lambda name="RAPF": plot_gain_grid(
        GainGrid(name, "b", [1.0, 2.0], [1.0], np.array([[1.0, 2.0]])), PANEL
    ),
}


@pytest.mark.parametrize("kind", FIGURES)
def test_all_colors_are_variables_of_the_page(kind) -> None:
    svg = inline_svg(FIGURES[kind](), "k", "description")
    assert not re.findall(r"#[0-9a-fA-F]{3,6}\b|rgb\(", svg.replace("#k-", "="))
    used = set(re.findall(r"var\(--rc-([\w-]+)\)", svg))
    assert used
    assert used <= list_css_colors(LIGHT).keys()


@pytest.mark.parametrize("kind", FIGURES)
def test_ids_start_with_the_key_and_all_references_are_valid(kind) -> None:
    svg = inline_svg(FIGURES[kind](), "f7", "description")
    root = ElementTree.fromstring(svg)
    ids = [each.get("id") for each in root.iter() if each.get("id")]
    assert ids
    assert len(ids) == len(set(ids))
    assert all(name.startswith("f7-") for name in ids)
    references = set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', svg))
    assert {name for pair in references for name in pair if name} <= set(ids)


@pytest.mark.parametrize("kind", FIGURES)
def test_figures_refer_neither_to_other_files_nor_to_fonts_of_matplotlib(kind) -> None:
    svg = inline_svg(FIGURES[kind](), "f7", "description")
    assert "http" not in svg
    assert "DejaVu" not in svg


def test_hostile_texts_are_escaped() -> None:
    for kind, figure in FIGURES.items():
        root = ElementTree.fromstring(inline_svg(figure(HOSTILE), "k", HOSTILE))
        assert root.get("aria-label") == HOSTILE
        assert root.get("role") == "img"
        texts = " ".join(each.text or "" for each in root.iter("text"))
        assert "</script>" in texts, kind
        assert not [each for each in root.iter() if each.tag in ("script", "img")]


def test_many_points_become_one_path() -> None:
    figure = FIGURES["boxes"]()
    axes = figure.axes[0]
    points = axes.lines[0]
    expected = axes.transData.transform(np.column_stack(points.get_data()))
    root = ElementTree.fromstring(inline_svg(figure, "k", "x"))
    dots = [each for each in root.iter("path") if "h0" in (each.get("d") or "")]
    assert len(dots) == 1
    positions = np.array(re.findall(r"M([\d.]+) ([\d.]+)h0", dots[0].get("d")), dtype=float)
    height = float(root.get("viewBox").split()[3])
    pixels = positions * figure.dpi / 72
    assert pixels[:, 0] == pytest.approx(expected[:, 0], abs=0.1)
    assert height * figure.dpi / 72 - pixels[:, 1] == pytest.approx(expected[:, 1], abs=0.2)
    assert "stroke-width:3.6" in dots[0].get("style")


def test_the_same_figure_gives_the_same_bytes() -> None:
    band = Band("RAPF", STYLES["rapf"], TIME, np.outer([1, 2, 3], TIME))
    first = inline_svg(plot_cost_bands([band], PANEL, ValueAxis("distance (m)", "m")), "k", "x")
    second = inline_svg(plot_cost_bands([band], PANEL, ValueAxis("distance (m)", "m")), "k", "x")
    assert first == second


@pytest.mark.parametrize("build", [build_cost_plots, build_final_distance_plots])
def test_panels_of_a_map_have_the_same_axis(build) -> None:
    finals = {("rooms", 4): 40.0, ("rooms", 8): 50.0, ("hall", 4): 0.5, ("hall", 8): 0.7}
    runs = [
        build_run(seed=seed, final=final + 0.1 * seed, map_name=map_name, robots=robots)
        for (map_name, robots), final in finals.items()
        for seed in range(3)
    ]
    result = build_recorded_result(runs)
    plots = {plot.title: plot.svg for plot in build(result, choose_group_styles(result), "k")}
    ticks = {title: re.findall(r">([\d.]+)</text>", svg) for title, svg in plots.items()}
    assert ticks["rooms, 4 robots"] == ticks["rooms, 8 robots"]
    assert ticks["hall, 4 robots"] == ticks["hall, 8 robots"]
    assert ticks["rooms, 4 robots"] != ticks["hall, 4 robots"]


def test_all_cost_axes_are_the_same_and_begin_at_0() -> None:
    runs = [
        build_run(seed=seed, final=final + 0.1 * seed, map_name=map_name)
        for map_name, final in (("rooms", 4.0), ("hall", 3.0))
        for seed in range(3)
    ]
    result = build_recorded_result(runs)
    plots = {plot.title: plot.svg for plot in build_cost_plots(result, choose_group_styles(result), "k")}
    ticks = {title: re.findall(r">([\d.]+)</text>", svg) for title, svg in plots.items()}
    assert ticks["rooms"] == ticks["hall"]
    # The first 0 is that of the time axis.
    assert ticks["rooms"].count("0") == 2


def test_a_panel_of_costs_has_a_smaller_version_for_phones() -> None:
    result = build_recorded_result([build_run(seed=seed, map_name=name) for name in "ab" for seed in (0, 1)])
    for plot in build_cost_plots(result, choose_group_styles(result), "k"):
        widths = [
            float(ElementTree.fromstring(svg).get("viewBox").split()[2]) for svg in (plot.svg, plot.narrow)
        ]
        assert widths[0] > 1.3 * widths[1]
