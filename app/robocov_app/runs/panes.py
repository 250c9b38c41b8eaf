"""Several films in one: panes of equal size in rows, under a legend that they share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import ParameterError
from robocov_app.render.furniture import LEGEND_ROW, MARGIN, STRIP, legend_picture
from robocov_app.render.layers import LegendEntry
from robocov_app.render.legends import united
from robocov_app.render.picture import Painter, pane_layers, scale_for
from robocov_app.render.record_scene import record_scene
from robocov_app.render.spacing import columns_for
from robocov_app.render.theme import Colour, theme_named
from robocov_app.runs.recording import Frame, iter_frames

if TYPE_CHECKING:
    from robocov.environment import Environment
    from robocov.record import Record
    from robocov_app.render.field import Fields
    from robocov_app.runs.recording import Costs

USUAL_SIZE = (1920, 1080)
"""Pixels that a film of several panes has at most, where no size is asked for."""

GAP = 2
"""Pixels of the line between two panes."""

_NARROWEST = 360
"""Least width in pixels of a pane at scale 1: its caption fits."""


@dataclass(frozen=True)
class PaneLayout:
    """How the panes share a film.

    `pane`, `size`: (width, height) in px, of each and of the film. `scale`: of text and lines. `header`:
    (height, width, 3) RGB, the legend, as wide as the film.
    """

    columns: int
    pane: tuple[int, int]
    scale: float
    header: Frame
    size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Shown:
    """What panes show besides, or not, of what they usually do. `fields`: see `iter_frames`."""

    also: frozenset[str] = frozenset()
    without: frozenset[str] = frozenset()
    fields: Fields | None = None


def pane_layout(
    records: Sequence[Record],
    theme: str,
    colours: str = "robots",
    size: tuple[int, int] | None = None,
    shown: Shown = Shown(),
) -> PaneLayout:
    """Lay out panes so that the maps are as large as can be: wide maps below each other.

    `records`: their first moments tell what the legend has to explain. `colours`: see `iter_frames`. `size`,
    (width, height) or None: of the whole film; None for what suits the map, within `USUAL_SIZE`.
    """
    count = len(records)
    aspect = max(_aspect(record.environment) for record in records)
    width, height = size or USUAL_SIZE
    scale = scale_for((width, height))
    around = (6 + LEGEND_ROW + 6 + STRIP) * scale
    columns = columns_for(count, aspect, (width, height - LEGEND_ROW * scale), around)
    rows = -(-count // columns)
    scale = max(min(scale, width / columns / _NARROWEST), 0.75)
    around, beside = (6 + LEGEND_ROW + 6 + STRIP + 4) * scale, (2 * MARGIN + 4) * scale
    pane_width = (width - (columns - 1) * GAP) // columns
    if size is None:
        highest = (height - (6 + LEGEND_ROW) * scale) / rows - GAP
        pane_height = round(min((pane_width - beside) / aspect + around, highest))
        needed = max(round((pane_height - around) * aspect + beside), round(_NARROWEST * scale))
        pane_width = min(pane_width, needed)
        width = columns * pane_width + (columns - 1) * GAP
    header = _legend(records, theme, colours, width, scale, shown)
    if size is None:
        height = len(header) + rows * pane_height + (rows - 1) * GAP
        width, height = width + width % 2, height + height % 2
    else:
        pane_height = (height - len(header) - (rows - 1) * GAP) // rows
    return PaneLayout(columns, (pane_width, max(pane_height, 40)), scale, header, (width, height))


def comparison_frames(
    records: Sequence[Record],
    costs: Sequence[Costs],
    layout: PaneLayout,
    *,
    theme: str,
    colours: str,
    fps: float,
    speed: float,
    hold: float,
    shown: Shown = Shown(),
) -> Iterator[Frame]:
    """Draw the frames of several saved runs side by side.

    `records`, `costs`: what frames tell of each run's cost goes with its record, see `iter_frames`. `theme`,
    `colours`, `fps`, `speed`, `hold`: see `iter_frames`.
    """
    films = [
        iter_frames(
            record,
            size=layout.pane,
            theme=theme,
            fps=fps,
            speed=speed,
            hold=hold,
            layers=pane_layers(colours),
            scale=layout.scale,
            cost=cost,
            also=shown.also,
            without=shown.without,
            fields=shown.fields,
        )
        for record, cost in zip(records, costs, strict=True)
    ]
    look = theme_named(theme)
    for body in side_by_side(films, layout.columns, GAP, look.grid, look.background):
        frame = np.empty((layout.size[1], layout.size[0], 3), dtype=np.uint8)
        frame[:] = look.background
        top = len(layout.header)
        frame[:top, : layout.header.shape[1]] = layout.header
        part = frame[top : top + body.shape[0], : body.shape[1]]
        part[:] = body[: part.shape[0], : part.shape[1]]
        yield frame


def side_by_side(
    films: Sequence[Iterator[Frame]],
    columns: int | None = None,
    gap: int = GAP,
    line: Colour = (128, 128, 128),
    blank: Colour = (255, 255, 255),
) -> Iterator[Frame]:
    """Join the frames of several films of one size into frames that show them in rows.

    `films`: ends when all have ended; those that end before the others stay on their last frame. `columns`:
    films in a row; None puts all in one, where their widths may differ. `gap`, px: width of the line between
    two. `line`, `blank`: of that line, and of what the last row leaves free. Raises ParameterError when a
    film has no frame.
    """
    columns = columns or len(films)
    current: list[Frame | None] = [None] * len(films)
    while True:
        fresh = [next(film, None) for film in films]
        if all(frame is None for frame in fresh):
            return
        current = [new if new is not None else old for new, old in zip(fresh, current, strict=True)]
        shown = [frame for frame in current if frame is not None]
        if len(shown) < len(films):
            raise ParameterError("frames: none were given, but at least one was wanted")
        rows = [_joined(shown[k : k + columns], 1, gap, line) for k in range(0, len(shown), columns)]
        missing = rows[0].shape[1] - rows[-1].shape[1]
        if missing > 0:
            free = np.empty((rows[-1].shape[0], missing, 3), dtype=np.uint8)
            free[:] = blank
            rows[-1] = np.concatenate([rows[-1], free], axis=1)
        yield _joined(rows, 0, gap, line)


def _joined(frames: Sequence[Frame], axis: int, gap: int, line: Colour) -> Frame:
    """Put frames in a row (axis 1) or column (axis 0), with lines between."""
    parts: list[Frame] = []
    for frame in frames:
        if parts:
            shape = (gap, frame.shape[1], 3) if axis == 0 else (frame.shape[0], gap, 3)
            between = np.empty(shape, dtype=np.uint8)
            between[:] = line
            parts.append(between)
        parts.append(frame)
    return np.concatenate(parts, axis=axis)


def _aspect(environment: Environment) -> float:
    low_x, low_y, high_x, high_y = environment.region.bounds
    return (high_x - low_x) / (high_y - low_y)


def _legend(
    records: Sequence[Record], theme: str, colours: str, width: int, scale: float, shown: Shown
) -> Frame:
    """Draw one legend for all: of what any of them shows."""
    look = theme_named(theme)
    found: list[list[LegendEntry]] = []
    for record in records:
        painter = Painter(record.environment, (64, 64), look, pane_layers(colours), scale)
        painter.change(shown.also, shown.without)
        fields = shown.fields if painter.needs_field else None
        # robots that fail are explained too
        for row in (0, -1) if record.conditions is not None else (0,):
            scene = record_scene(record, row % len(record), fields=fields)
            found.append(painter.legend_entries(scene))
    # the longest first: its order is kept, and mostly nothing is missing
    entries = united(sorted(found, key=len)[::-1], LegendEntry.key)
    return legend_picture(entries, width, look, scale, shown.also)
