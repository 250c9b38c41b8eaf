"""Films of runs: one by itself, or several side by side under a legend that they share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.cost import CoverageCost, MomentaryCost
from robocov.environment import Environment
from robocov.errors import ParameterError, shown
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.render.annotations import LEGEND_ROW, MARGIN, STRIP, legend_picture
from robocov_app.render.canvas import LegendEntry
from robocov_app.render.density import cost_words, mean_words
from robocov_app.render.distance_field import Fields, round_limit
from robocov_app.render.layers import Layer
from robocov_app.render.layout import columns_for, united
from robocov_app.render.picture import Painter, checked_layers, pane_layers, scale_for, standard_layers
from robocov_app.render.scene import record_scene
from robocov_app.render.theme import Colour, theme_named
from robocov_app.runs.cost import FILM_LATTICE, built_cost, cost_for_pictures
from robocov_app.runs.options import RunOptions
from robocov_app.runs.recording import Frame, save_moving_picture
from robocov_app.runs.run import Run
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import progress

USUAL_SIZE = (1920, 1080)  # pixels that a film of several panes has at most, where no size is asked for
GAP = 2  # pixels of the line between two panes

_NARROWEST = 360  # least width in pixels of a pane at scale 1: its caption fits

FILM_SCALE = 1.3
"""How far the scale of colours of a film reaches, as a multiple of the largest distance at its end."""

FILMS = "run.mp4", "comparison.mp4"  # of one run, of several side by side
FILM_HOLD = 1.0  # seconds for which a film stays on its last moment

Costs: TypeAlias = "tuple[Array, Array] | tuple[Array, Array, Array]"
"""Times, s, and mean distances, m; and mean times, s, where robots are not equally fast."""


@dataclass(frozen=True, eq=False)
class FilmStyle:
    """How a film looks, and how fast it goes.

    `colours`: a hue for each robot, or all trajectories in the "paper"'s red. `fps`: frames per second of the
    film. `speed`: simulated seconds per second of it. `hold`, s: so long it stays on the last moment. `also`,
    `without`: layers shown besides the usual ones, and not. `fields`: what layers of distances draw.
    """

    theme: str = "light"
    colours: str = "robots"
    fps: float = 30.0
    speed: float = 1.0
    hold: float = 0.0
    also: frozenset[str] = frozenset()
    without: frozenset[str] = frozenset()
    fields: Fields | None = None

    def rows(self, time: Array) -> IntArray:
        """Return which row of a record of ascending times, (T,) s, each frame shows."""
        return frame_rows(time, self.fps, self.speed, self.hold)


def frame_rows(time: Array, fps: float, speed: float = 1.0, hold: float = 0.0) -> IntArray:
    """Return which row of a record each frame shows.

    `time`, (T,) s: ascending. `fps`: frames per second of the film. `speed`: simulated seconds per second of
    the film. `hold`, s: so long the film stays on the last row at its end. Raises
    ParameterError when `fps` or `speed` is not positive.

    Examples
    --------
    >>> frame_rows(np.arange(5) * 0.5, fps=2, speed=2.0).tolist()
    [0, 2, 4]
    """
    for name, value in (("fps", fps), ("speed", speed)):
        if not (np.isfinite(value) and value > 0):
            raise ParameterError(f"{name}: {shown(value)}, but a positive number was wanted")
    duration = float(time[-1] - time[0])
    count = int(np.ceil(duration / speed * fps - 1e-9)) + 1
    at = time[0] + np.arange(count + round(hold * fps)) * (speed / fps)
    # half a microsecond forgives the rounding of sums of steps
    rows = np.searchsorted(time, at + 5e-7, side="right") - 1
    return np.asarray(np.clip(rows, 0, len(time) - 1), dtype=np.intp)


def iter_frames(
    record: Record,
    style: FilmStyle = FilmStyle(),
    *,
    size: tuple[int, int] = (1280, 720),
    layers: Sequence[Layer] | None = None,
    scale: float | None = None,
    cost: Costs | None = None,
    rows: IntArray | None = None,
) -> Iterator[Frame]:
    """Draw the frames of a saved run, one at a time; the arrays are the caller's own.

    `size`: (width, height) in px. `layers`: from the lowest to the topmost; None for `standard_layers`.
    `scale`: of text and lines; None for what suits the size. `cost`: of which each frame says the latest
    known, see `told_costs`. `rows`: the rows to show, instead of those that the style gives.
    """
    layers = standard_layers(style.colours) if layers is None else layers
    painter = Painter(record.environment, size, theme_named(style.theme), layers, scale)
    painter.change(style.also, style.without)
    last, frame = -1, None
    for row in (style.rows(record.time) if rows is None else rows).tolist():
        if frame is None or row != last:
            text = _cost_text(mean_words(record.environment), float(record.time[row]), cost)
            fields = style.fields if painter.needs_field else None
            last, frame = row, painter.frame(record_scene(record, row, cost=text, fields=fields))
        yield frame


def told_costs(history: CostHistory) -> Costs:
    """Return of a cost history what frames tell."""
    if history.mean_time is None:
        return history.time, history.mean_distance
    return history.time, history.mean_distance, history.mean_time


def _cost_text(what: str, time: float, cost: Costs | None) -> str:
    if cost is None:
        return ""
    known = int(np.searchsorted(cost[0], time + 5e-7, side="right")) - 1
    return cost_words(what, *(values[known] for values in cost[1:])) if known >= 0 else ""


@dataclass(frozen=True)
class PaneLayout:
    """How panes share a film: sizes in px of each and of all, and the legend, as wide as the film."""

    columns: int
    pane: tuple[int, int]
    scale: float
    header: Frame
    size: tuple[int, int]


def pane_layout(
    records: Sequence[Record], style: FilmStyle = FilmStyle(), size: tuple[int, int] | None = None
) -> PaneLayout:
    """Lay out panes so that the maps are as large as can be: wide maps below each other.

    `size`, (width, height) or None: of the whole film; None for what suits the map, within `USUAL_SIZE`.
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
    header = _legend(records, style, width, scale)
    if size is None:
        height = len(header) + rows * pane_height + (rows - 1) * GAP
        width, height = width + width % 2, height + height % 2
    else:
        pane_height = (height - len(header) - (rows - 1) * GAP) // rows
    return PaneLayout(columns, (pane_width, max(pane_height, 40)), scale, header, (width, height))


def comparison_frames(
    records: Sequence[Record], costs: Sequence[Costs], layout: PaneLayout, style: FilmStyle
) -> Iterator[Frame]:
    """Draw the frames of several saved runs side by side, each with what is told of its cost."""
    look = theme_named(style.theme)
    size, scale = layout.pane, layout.scale
    films = [
        # layers keep what they have drawn: each film has its own
        iter_frames(record, style, size=size, scale=scale, layers=pane_layers(style.colours), cost=cost)
        for record, cost in zip(records, costs, strict=True)
    ]
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

    Films that end before the others stay on their last frame. With `columns` None all are in one row, where
    their widths may differ. `gap`, px, and `line` are between two; `blank` is what the last row leaves free.
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


def _legend(records: Sequence[Record], style: FilmStyle, width: int, scale: float) -> Frame:
    """Draw one legend for all: of what any of them shows."""
    look = theme_named(style.theme)
    found: list[list[LegendEntry]] = []
    for record in records:
        painter = Painter(record.environment, (64, 64), look, pane_layers(style.colours), scale)
        painter.change(style.also, style.without)
        fields = style.fields if painter.needs_field else None
        # robots that fail are explained too
        for row in (0, -1) if record.conditions is not None else (0,):
            scene = record_scene(record, row % len(record), fields=fields)
            found.append(painter.legend_entries(scene))
    # the longest first: its order is kept, and mostly nothing is missing
    entries = united(sorted(found, key=len)[::-1], LegendEntry.key)
    return legend_picture(entries, width, look, scale, style.also)


def check_layers(options: RunOptions) -> None:
    """Raise ParameterError, before anything is simulated, when films cannot show what is wanted."""
    checked_layers("--show", options.show)
    checked_layers("--hide", options.hide)


def film_style(runs: Sequence[Run], cost: CoverageCost | None, options: RunOptions) -> FilmStyle:
    """Return the style of films of runs on one map, all on one scale of colours.

    The scale suits the end, when the robots have spread; farther places at the start are all of one colour.
    Where no `cost` of the map is there, it is made if it is needed.
    """
    also, without = checked_layers("--show", options.show), checked_layers("--hide", options.hide)
    look = options.theme, options.colours, options.fps, options.film_speed, FILM_HOLD
    if not also & {"distances", "geodesic_cells"}:
        return FilmStyle(*look, also, without)
    environment = runs[0].record.environment
    if cost is None:
        cost = built_cost(environment, FILM_LATTICE, quiet=options.json)
    cost = cost_for_pictures(environment, cost, FILM_LATTICE)
    farthest = max((float(reached.max(initial=0.0)) for reached in _reached(runs, cost)), default=0.0)
    return FilmStyle(*look, also, without, Fields(cost, round_limit(FILM_SCALE * farthest)))


def _reached(runs: Sequence[Run], cost: CoverageCost) -> Iterator[Array]:
    """Yield the distances at the end of each run that are finite."""
    momentary = MomentaryCost(cost)
    for run in runs:
        record = run.record
        result = momentary(float(record.time[-1]), record.positions[-1], record.working[-1])
        if result is not None:
            yield result.distances[np.isfinite(result.distances)]


def save_moving(
    runs: Sequence[Run],
    cost: CoverageCost | None,
    folder: Path,
    options: RunOptions,
    stop: Interruption,
    *,
    bare: Sequence[Run] | None = None,
) -> None:
    """Write ``frames/``, and ``run.mp4`` or of several runs ``comparison.mp4``, as the options say.

    Ctrl-C ends both early. `bare`: the same runs on one map, where distances are to one without robots that
    failed. For `cost` see `film_style`.
    """
    if not (options.frames or options.video):
        return
    style = film_style(bare or runs, cost, options)
    records, costs = [run.record for run in runs], [told_costs(run.history) for run in runs]
    total = len(style.rows(max(records, key=len).time))
    layout = pane_layout(records, style, options.picture_size()) if len(runs) > 1 else None

    def frames() -> Iterator[Frame]:
        if layout is None:
            return iter_frames(records[0], style, size=options.film_size(), cost=costs[0])
        return comparison_frames(records, costs, layout, style)

    write_moving(frames(), total, folder / FILMS[layout is not None], options, stop)


def write_moving(
    frames: Iterator[Frame], total: int, film: Path, options: RunOptions, stop: Interruption
) -> None:
    """Write frames beside a film, as PNGs, and the film, as the options say; Ctrl-C ends both early."""

    def told() -> Iterator[Frame]:
        for done, frame in enumerate(frames, start=1):
            yield frame
            update(done)
            if stop.requested:
                return

    pictures = film.parent / "frames" if options.frames else None
    with progress("film" if options.video else "frames", total, quiet=options.json) as update:
        save_moving_picture(told(), pictures, film if options.video else None, options.fps)
