"""The paper's figures 1 to 8 on environments of the same kinds.

Starts are green, final positions blue, trajectories red. RAPF's cost is blue, RPF's red, as in the paper.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.voronoi import partition
from robocov_app.figures import map_drawing, robot_drawing, run_drawing
from robocov_app.figures.curves import CurveMargins, TimeCurve, add_curve_axes, draw_curves
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL_SIZE_PT, TITLE_SIZE_PT, FigurePage, PageBox, to_plot_color
from robocov_app.look.legend import merge_legends
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.replication.assets import ASSETS
from robocov_app.replication.formatting import format_amount
from robocov_app.replication.results.outcome_tables import FIRST_MINUTE_S
from robocov_app.replication.results.outcomes import compute_matched_distance, compute_mean_until
from robocov_app.replication.results.study_results import FigureRun

PAGE_SCALE = 3.0
"""Scale of the pages: 300 dots per inch."""
WIDE_PX = 2148
NARROW_PX = 1050
"""Widths of two journal columns (7.16 inches) and of one (3.5 inches)."""
_COST_HEIGHT_PX = 1050
_COST_MARGINS = CurveMargins(left=34, top=34, bottom=44, right=46)
_ARRIVED = 0.05
"""A cost counts as settled from the time after which it stays within 5% of its last value."""
_SAME_COST = 0.0005
"""Relative difference below which two costs are called the same."""

FIGURES = {1: "partition", 2: "convex", 3: "convex", 4: "a", 5: "a", 6: "b", 7: "b", 8: "other"}
"""The case that each of the paper's figures shows, by its number."""
NON_CONVEX_FIGURES = (4, 5, 6, 7, 8)
"""Figures of non-convex environments."""
HALF_STEP = "half-step"
"""Variant of figures with half the control period."""
FIGURES_OF_VARIANTS: Mapping[str, Sequence[int]] = {
    "": tuple(FIGURES),
    "best": NON_CONVEX_FIGURES,
    "limited": NON_CONVEX_FIGURES,
    HALF_STEP: (4, 5),
}
"""The figures that are drawn in each variant; see `FigureRuns`."""
COST_FIGURES = (3, 5, 7)
"""Figures of the cost against time; the others, except for the first, show trajectories."""

CAPTIONS: Mapping[str, str] = tomllib.loads((ASSETS / "captions.toml").read_text(encoding="utf-8"))
"""Captions of all figures by name."""


def name_figure(number: int, variant: str = "") -> str:
    """Return the name of the files of a figure, such as "figure-4" or "figure-4-best"."""
    return f"figure-{number}-{variant}" if variant else f"figure-{number}"


def draw_figure(
    number: int, runs: Mapping[str, FigureRun], partition_run: Record, theme: Theme | str
) -> Figure:
    """Draw one of the paper's figures.

    Parameters
    ----------
    number : int
        Number of the figure, from 1 to 8.
    runs : Mapping
        Runs by "case/controller".
    partition_run : Record
        The run whose first frame is figure 1.
    theme : Theme or str

    Returns
    -------
    Figure
    """
    theme = get_theme(theme)
    if number == 1:
        return draw_partition(partition_run, theme)
    pair = _get_pair(runs, number)
    if number in COST_FIGURES:
        return draw_costs(pair, theme)
    records = [run.record for run in pair]
    titles = [run.record.label for run in pair]
    costs = [f"mean distance {run.history.mean_distance[-1]:.3f} m" for run in pair]
    return draw_side_by_side(records, list(zip(titles, costs, strict=True)), theme)


def _get_pair(runs: Mapping[str, FigureRun], number: int) -> tuple[FigureRun, FigureRun]:
    """Return the runs of RAPF and of the other controller that a figure compares."""
    case = FIGURES[number]
    other = "lloyd" if case == "convex" else "rpf"
    return runs[f"{case}/rapf"], runs[f"{case}/{other}"]


def describe_figure(number: int, runs: Mapping[str, FigureRun], partition_run: Record) -> str:
    """Return sentences that describe one of the paper's figures.

    Parameters
    ----------
    number : int
        Number of the figure, from 1 to 8.
    runs : Mapping
        Runs by "case/controller".
    partition_run : Record
        The run whose first frame is figure 1.
    """
    if number == 1:
        return _describe_partition(partition_run)
    rapf, other = _get_pair(runs, number)
    if number in COST_FIGURES:
        return _describe_costs(rapf, other)
    text = _describe_final_costs(rapf, other)
    if number == 8:
        text += f" {_describe_other_starts(runs)}"
    return text


def _describe_partition(run: Record) -> str:
    """Return a sentence with the mean distance of the robots from the centroids of their cells."""
    positions = run.positions[0]
    centroids = partition(positions, run.environment.region).centroids
    mean_distance = float(np.hypot(*(centroids - positions).T).mean())
    return (
        f"The robots are at random positions in “{run.environment.name}”, on average "
        f"{format_amount(mean_distance, 'm')} from the centroids of their cells."
    )


def _describe_costs(rapf: FigureRun, other: FigureRun) -> str:
    """Return sentences that compare the costs of two runs over time."""
    label = other.record.label
    rapf_mean = compute_mean_until(rapf.history, FIRST_MINUTE_S)
    other_mean = compute_mean_until(other.history, FIRST_MINUTE_S)
    rapf_cost = rapf.history.mean_distance
    other_cost = other.history.mean_distance
    # The first costs are equal, because both start from the same positions.
    common = slice(1, min(len(rapf_cost), len(other_cost)))
    lower = float((rapf_cost[common] < other_cost[common]).mean())
    return (
        f"Over the first {FIRST_MINUTE_S:g} s, RAPF averages {rapf_mean:.3f} m, "
        f"{_describe_difference(rapf_mean, other_mean)} {label} ({other_mean:.3f} m). RAPF's cost is lower "
        f"{format_amount(lower, '%')} of the time. RAPF stays within 5% of its final value from "
        f"{find_arrival_time(rapf.history):.0f} s on, "
        f"{label} from {find_arrival_time(other.history):.0f} s on."
    )


def _describe_final_costs(rapf: FigureRun, other: FigureRun) -> str:
    """Return a sentence that compares the final costs of two runs."""
    rapf_cost = float(rapf.history.mean_distance[-1])
    other_cost = float(other.history.mean_distance[-1])
    return (
        f"On “{rapf.record.environment.name}” RAPF ends with a mean distance of {rapf_cost:.3f} m, "
        f"{_describe_difference(rapf_cost, other_cost)} {other.record.label} ({other_cost:.3f} m)."
    )


def _describe_other_starts(runs: Mapping[str, FigureRun]) -> str:
    """Return a sentence on the distances between the final positions from two different starts."""
    distances = []
    for controller in ("rapf", "rpf"):
        first = runs[f"b/{controller}"].record.positions[-1]
        second = runs[f"other/{controller}"].record.positions[-1]
        distances.append(format_amount(compute_matched_distance(first, second), "m"))
    return (
        f"On average, the final positions are {distances[0]} from those of figure 6 with RAPF, "
        f"and {distances[1]} with RPF (robots are matched to minimize the sum of distances)."
    )


def describe_half_step(runs: Mapping[str, FigureRun], half_step_runs: Mapping[str, FigureRun]) -> str:
    """Return a sentence on how much half the control period changes the results of figure 4."""
    texts = []
    for controller in ("rapf", "rpf"):
        full = runs[f"a/{controller}"]
        half = half_step_runs[f"a/{controller}"]
        offsets = half.record.positions[-1] - full.record.positions[-1]
        distance = format_amount(float(np.hypot(*offsets.T).max()), "m")
        cost_ratio = float(half.history.mean_distance[-1] / full.history.mean_distance[-1])
        change = _describe_difference(cost_ratio, 1.0)
        texts.append(
            f"{half.record.label}'s final positions change by at most {distance}, "
            f"and its cost is {change} before"
        )
    return f"With half the control period, {'; '.join(texts)}."


def _describe_difference(cost: float, other_cost: float) -> str:
    """Return how a cost compares with another one, such as "3.0% less than"."""
    change = cost / other_cost - 1.0
    if abs(change) < _SAME_COST:
        return "the same as"
    direction = "less" if change < 0 else "more"
    return f"{format_amount(abs(change), '%')} {direction} than"


def find_arrival_time(history: CostHistory) -> float:
    """Return the time, s, from which a cost stays within 5% of its last value."""
    cost = history.mean_distance
    is_away = np.abs(cost - cost[-1]) > _ARRIVED * cost[-1]
    rows = np.flatnonzero(is_away)
    return float(history.time[rows[-1] + 1]) if len(rows) else float(history.time[0])


@plain_style()
def draw_partition(run: Record, theme: Theme = LIGHT) -> Figure:
    """Draw robots, their Voronoi cells and the centers of mass of the cells at the start of a run."""
    environment = run.environment
    positions = run.positions[0]
    edge_color = to_plot_color(theme.cell_edge)
    dot_style: Any = {
        "linestyle": "none",
        "marker": "o",
        "markersize": 4.0,
        "color": to_plot_color(theme.ink),
    }
    handles: list[Artist] = [
        robot_drawing.build_robot_handle("robot", theme.final, theme),
        Line2D([], [], label="centroid of its cell", **dot_style),
        Line2D([], [], color=edge_color, linewidth=0.9, label="Voronoi cell"),
        *map_drawing.build_map_handles(environment, theme, show_boundary=False),
    ]
    page, boxes = build_panels(environment, 1, NARROW_PX, handles, theme, above=10.0)
    draw_panel_footer(page, boxes, environment, handles)
    axes = add_panel_axes(page, boxes[0], environment)
    map_drawing.draw_map(axes, environment, theme)
    cells = partition(positions, environment.region)
    hues = [k % len(theme.robots) for k in range(len(positions))]
    fills = [to_plot_color(theme.get_paper_cell_color(hue)) for hue in hues]
    collection = PolyCollection(
        list(cells.polygons), facecolors=fills, edgecolors=edge_color, linewidths=0.8, zorder=1
    )
    axes.add_collection(collection, autolim=False)
    axes.plot(*cells.centroids.T, zorder=8, clip_on=False, **dot_style)
    numbers = range(1, len(positions) + 1)
    robot_drawing.draw_robots(axes, positions, run.team.radius, numbers, theme)
    return page.figure


@plain_style()
def draw_side_by_side(records: Sequence[Record], headings: Iterable[tuple[str, str]], theme: Theme) -> Figure:
    """Draw runs on the same map next to each other.

    Parameters
    ----------
    records : sequence of Record
    headings : iterable of (str, str)
        Title and final cost above each panel.
    theme : Theme

    Returns
    -------
    Figure
    """
    handles = merge_legends(
        (run_drawing.build_run_handles(record, theme, "paper") for record in records), map_drawing.get_label
    )
    environment = records[0].environment
    page, boxes = build_panels(environment, len(records), WIDE_PX, handles, theme, above=30.0)
    panels = [add_panel_axes(page, box, environment) for box in boxes]
    for letter, record, (title, cost), axes in zip("abcdef", records, headings, panels, strict=False):
        run_drawing.draw_run(axes, record, theme, "paper")
        box = axes.get_position()
        left = box.x0 * page.size[0]
        right = box.x1 * page.size[0]
        top = (1.0 - box.y1) * page.size[1] - 14 * page.scale
        page.write(f"({letter})  {title}", left, top, points=TITLE_SIZE_PT, bold=True)
        page.write(cost, right, top, points=SMALL_SIZE_PT, color=theme.faint, align="right")
    draw_panel_footer(page, boxes, environment, run_drawing.drop_undrawn_handles(handles, panels))
    return page.figure


@plain_style()
def draw_costs(runs: Sequence[FigureRun], theme: Theme = LIGHT) -> Figure:
    """Draw the costs of runs against time."""
    curves = [
        TimeCurve(run.record.label, run.record.controller, run.history.time, run.history.mean_distance)
        for run in runs
    ]
    page = FigurePage((WIDE_PX, _COST_HEIGHT_PX), theme, PAGE_SCALE)
    draw_curves(add_curve_axes(page, curves, _COST_MARGINS), curves, theme)
    return page.figure


def build_panels(
    environment: Environment,
    count: int,
    width: int,
    handles: Sequence[Artist],
    theme: Theme,
    *,
    above: float,
) -> tuple[FigurePage, list[PageBox]]:
    """Build a page with several boxes for the same map in a row, and space for a legend and a scale bar.

    Parameters
    ----------
    environment : Environment
    count : int
        Number of boxes.
    width : int
        Width of the page, px.
    handles : sequence of Artist
        Handles of the legend.
    theme : Theme
    above : float
        Space above the boxes, px at scale 1.

    Returns
    -------
    page : FigurePage
    boxes : list of PageBox
    """
    min_x, min_y, max_x, max_y = environment.region.bounds
    # A first page, of any height, serves to measure the margin and the footer.
    sketch = FigurePage((width, width), theme, PAGE_SCALE)
    panel_width = (width - (count + 1) * sketch.margin) / count
    panel_height = panel_width / ((max_x - min_x) / (max_y - min_y))
    top = above * PAGE_SCALE
    page = FigurePage((width, round(top + panel_height + sketch.measure_footer(handles))), theme, PAGE_SCALE)
    lefts = [page.margin + k * (panel_width + page.margin) for k in range(count)]
    return page, [PageBox(left, top, panel_width, panel_height) for left in lefts]


def add_panel_axes(page: FigurePage, box: PageBox, environment: Environment) -> Axes:
    """Add axes for a map in a box of `build_panels`."""
    return page.add_map_axes(box, *environment.region.bounds)


def draw_panel_footer(
    page: FigurePage, boxes: Sequence[PageBox], environment: Environment, handles: Sequence[Artist]
) -> None:
    """Draw the scale bar and a legend below the boxes of `build_panels`."""
    min_x, _, max_x, _ = environment.region.bounds
    page.draw_footer(handles, boxes, boxes[0].width / (max_x - min_x))
