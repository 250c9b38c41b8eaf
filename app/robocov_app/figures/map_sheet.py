"""A sheet of maps, side by side at one scale."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from robocov.environment import Environment
from robocov_app.figures.arena import draw_map, map_handles
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import HEADING, Page
from robocov_app.render.layout import columns_for
from robocov_app.render.theme import LIGHT, Theme, theme_named

MOST = 60  # maps on a sheet: more would be too small to be seen
_WIDTH, _HIGHEST = 1600, 1600  # pixels of a sheet, across and at most down


@plain_style()
def plot_maps(environments: Sequence[Environment], theme: Theme | str = LIGHT) -> Figure:
    """Plot the first `MOST` maps side by side at one scale, each under its name."""
    theme = theme_named(theme)
    drawn = environments[:MOST]
    title = f"{len(drawn)} of {len(environments)}" if len(drawn) < len(environments) else ""
    bounds = np.array([environment.region.bounds for environment in drawn])
    wide, high = (bounds[:, 2:] - bounds[:, :2]).max(axis=0).tolist()
    handles = {str(each.get_label()): each for one in drawn for each in map_handles(one, theme)}
    entries = [*handles.values()]
    page = Page((_WIDTH, _HIGHEST), theme, 1.5)
    above, top = 26 * page.scale, (46 if title else 8) * page.scale
    columns = columns_for(len(drawn), wide / high, (1600, 1200), above)
    slot = (_WIDTH - page.margin) / columns - page.margin
    rows = -(-len(drawn) // columns)
    tall = top + rows * (above + slot * high / wide + 14 * page.scale) + page.footer_height(entries)
    page = Page((_WIDTH, int(np.clip(tall, 320, _HIGHEST))), theme, 1.5)
    below = page.footer_height(entries)
    panels = page.panels(len(drawn), columns, wide / high, 0.0, above, top, below)
    for environment, (low_x, low_y, *_), (box, room) in zip(drawn, bounds.tolist(), panels, strict=True):
        draw_map(page.map_axes(box, low_x, low_y, low_x + wide, low_y + high), environment, theme)
        page.text(environment.name, box[0], box[1] - 12 * page.scale, bold=True, room=room)
    first = panels[0][0]
    if title:
        y = first[1] - above - 18 * page.scale
        page.text(title, first[0], y, points=HEADING, bold=True, room=page.room)
    page.footer(entries, [box for box, _ in panels], first[2] / wide)
    return page.figure
