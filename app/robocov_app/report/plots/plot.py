"""The plots of a page, and their panels for several settings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeAlias, TypeVar

import numpy as np
from matplotlib.figure import Figure

from robocov.typing import FloatArray
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.report.analysis.groups import (
    RunGroup,
    format_setting,
    list_displayed_groups,
    list_settings,
)
from robocov_app.report.results.result import ReportedResult
from robocov_app.report.svg import inline_svg

GroupStyles: TypeAlias = Mapping[str, CurveStyle]
"""Style of each label; see `robocov_app.report.analysis.groups.choose_group_styles`."""

MAX_PANELS = 24
"""Maximum number of settings, or of maps, that get a panel each."""
PANEL_SIZE_PX = (420, 290)
"""Size of a panel. On a phone it is displayed a little smaller."""
LARGE_PANEL_SIZE_PX = (600, 380)
"""Size of a panel with many curves, of which two fit next to each other on a wide screen."""
WIDE_SIZE_PX = (860, 360)
"""Size of a plot that is alone in its row, if the screen is wide enough."""
TOGETHER_TITLE = "All maps and teams together"
FINAL_DISTANCE_LABEL = "final mean distance (m)"
SCALED_DISTANCE_LABEL = "final distance / median of map and team"

_Content = TypeVar("_Content")


class PagePlot(NamedTuple):
    """A plot of a page.

    Attributes
    ----------
    title : str
        Title above the plot; may be empty.
    svg : str
    narrow : str
        SVG for small screens; empty if `svg` fits on them.
    """

    title: str
    svg: str
    narrow: str = ""


class Panel(NamedTuple):
    """The content of a panel that shows groups.

    Attributes
    ----------
    title : str
        Title; empty if there is only one panel.
    key : str
        Start of the ids in the SVG of the panel.
    groups : list of RunGroup
        Groups reduced to the runs of the panel.
    map_name : str
        Map that the panel shows; empty if it shows several settings together.
    """

    title: str
    key: str
    groups: list[RunGroup]
    map_name: str

    @property
    def is_together(self) -> bool:
        """Whether the panel shows several settings together."""
        return not self.map_name


def list_panels(result: ReportedResult, key: str) -> list[Panel]:
    """List the panels of a result: one for all settings together, then one for each if there are not many."""
    groups = list_displayed_groups(result)
    settings = list_settings(result)
    panels = []
    if len(settings) > 1:
        panels.append(Panel(TOGETHER_TITLE, f"{key}-all", groups, map_name=""))
    if len(settings) <= MAX_PANELS:
        for number, setting in enumerate(settings):
            title = ""
            if len(settings) > 1:
                title = format_setting(result, setting)
            setting_groups = [group.select(setting) for group in groups]
            map_name, _, _ = setting
            panels.append(Panel(title, f"{key}-{number}", setting_groups, map_name))
    return panels


@dataclass(frozen=True, eq=False)
class DrawnPanel(Generic[_Content]):
    """A panel with what it shows.

    Attributes
    ----------
    panel : Panel
    contents : list
        Bands or samples, one for each group of runs.
    values : array
        Values for which the limits of the axis are chosen, at least one of them finite.
    """

    panel: Panel
    contents: list[_Content]
    values: FloatArray


def compute_map_ranges(panels: Sequence[DrawnPanel[Any]]) -> dict[str, tuple[float, float]]:
    """Compute the range of the values on each map, so that the panels of a map have the same axis.

    Parameters
    ----------
    panels : sequence of DrawnPanel

    Returns
    -------
    dict of str to (low, high)
        Ranges by `Panel.map_name`.
    """
    map_values: dict[str, list[FloatArray]] = {}
    for drawn in panels:
        map_values.setdefault(drawn.panel.map_name, []).append(drawn.values.ravel())
    ranges = {}
    for map_name, arrays in map_values.items():
        values = np.concatenate(arrays)
        ranges[map_name] = (float(np.nanmin(values)), float(np.nanmax(values)))
    return ranges


def build_panel_plot(
    panel: Panel,
    description: str,
    draw: Callable[[tuple[int, int]], Figure],
    *,
    size: tuple[int, int] = PANEL_SIZE_PX,
) -> PagePlot:
    """Build the plot of a panel.

    A panel that is larger than `PANEL_SIZE_PX` gets a second SVG for small screens.

    Parameters
    ----------
    panel : Panel
    description : str
        Description for readers who cannot see the plot.
    draw : callable
        Draws the figure at a given size, px.
    size : (width, height), px
        Size of a panel with a title. A panel without a title is alone in its row, and wider.

    Returns
    -------
    PagePlot
    """
    text = description
    if panel.title:
        text = f"{panel.title}: {description}"
    else:
        size = WIDE_SIZE_PX
    svg = inline_svg(draw(size), panel.key, text)
    if size == PANEL_SIZE_PX:
        return PagePlot(panel.title, svg)
    narrow_svg = inline_svg(draw(PANEL_SIZE_PX), f"{panel.key}-narrow", text)
    return PagePlot(panel.title, svg, narrow_svg)
