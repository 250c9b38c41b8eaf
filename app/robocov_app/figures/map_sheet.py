"""A sheet of maps, side by side at one scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import ParameterError
from robocov_app.figures.arena import draw_map, map_handles
from robocov_app.figures.page import HEADING, TEXT, Page, plain_style
from robocov_app.render.layout import columns_for
from robocov_app.render.theme import LIGHT, Theme, theme_named

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    from robocov.environment import Environment

MOST = 60
"""Maps on a sheet: more would be too small to be seen."""

_WIDTH, _HIGHEST = 1600, 1600
"""Pixels of a sheet for which no size is asked, across and at most down."""

_SHAPE = 1600.0, 1200.0
"""What the columns of such a sheet are chosen for."""


def plot_maps(
    environments: Sequence[Environment],
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "",
) -> Figure:
    """Plot maps side by side at one scale, each under its name.

    `environments`: the first `MOST` are drawn; where there are more, the title says so. `size`, (width,
    height) or None: of the page; by default what suits the shapes of the maps. Raises ParameterError when
    there are no maps.
    """
    if not environments:
        raise ParameterError("maps: none were given, but at least one was wanted")
    theme = theme_named(theme)
    shown = list(environments)[:MOST]
    if len(shown) < len(environments):
        title = f"{title}  ·  {len(shown)} of {len(environments)}".removeprefix("  ·  ")
    with plain_style():
        bounds = np.array([environment.region.bounds for environment in shown])
        extents = bounds[:, 2:] - bounds[:, :2]
        wide, high = extents.max(axis=0).tolist()
        handles: dict[str, Artist] = {}
        for environment in shown:
            handles |= {str(handle.get_label()): handle for handle in map_handles(environment, theme)}
        entries = [*handles.values()]
        page = Page(size or (_WIDTH, _HIGHEST), theme, 1.5 if size is None else None)
        above, top = 26 * page.scale, (46 if title else 8) * page.scale
        columns = columns_for(len(shown), wide / high, size or _SHAPE, above)
        if size is None:
            slot = (_WIDTH - page.margin) / columns - page.margin
            rows = -(-len(shown) // columns)
            tall = top + rows * (above + slot * high / wide + 14 * page.scale) + page.footer_height(entries)
            page = Page((_WIDTH, int(np.clip(tall, 320, _HIGHEST))), theme, 1.5)
        below = page.footer_height(entries)
        panels = page.panels(len(shown), columns, wide / high, 0.0, above, top, below)
        for environment, (low_x, low_y, *_), (box, room) in zip(shown, bounds.tolist(), panels, strict=True):
            axes = page.axes(box)
            axes.set_xlim(low_x, low_x + wide)
            axes.set_ylim(low_y, low_y + high)
            axes.set_axis_off()
            draw_map(axes, environment, theme)
            page.text(environment.name, box[0], box[1] - 12 * page.scale, points=TEXT, bold=True, room=room)
        first = panels[0][0]
        if title:
            y = first[1] - above - 18 * page.scale
            page.text(title, first[0], y, points=HEADING, bold=True, room=page.size[0] - 2 * page.margin)
        right = max(box[0] + box[2] for box, _ in panels)
        bottom = max(box[1] + box[3] for box, _ in panels)
        page.footer(entries, first[0], right, bottom, first[2] / wide)
        return page.figure
