"""Films of runs: one by itself, or several side by side under a legend that they share."""

from collections.abc import Iterator, Sequence
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.render.annotations import LEGEND_ROW, MARGIN, STRIP, legend_picture
from robocov_app.render.canvas import LegendEntry
from robocov_app.render.density import cost_label, mean_label
from robocov_app.render.distance_field import Fields, round_limit
from robocov_app.render.layers import Layer
from robocov_app.render.layout import columns_for, united
from robocov_app.render.picture import Painter, pane_layers, scale_for, standard_layers
from robocov_app.render.scene import Scene, record_scene
from robocov_app.render.theme import Colour, Theme
from robocov_app.runs.cost import FILM_LATTICE, built_cost, cost_for_pictures
from robocov_app.runs.encoding import Frame, save_moving_picture
from robocov_app.runs.options import FilmOptions
from robocov_app.runs.run import Run
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import progress

USUAL_SIZE = (1920, 1080)  # pixels that a film of several panes has at most, where no size is asked for
GAP = 2  # pixels of the line between two panes
_NARROWEST = 360  # least width in pixels of a pane at scale 1: its caption fits
FILM_SCALE = 1.3  # upper end of a film's colour scale, as a multiple of the largest distance at its end
FILMS = "run.mp4", "comparison.mp4"  # of one run, of several side by side
FILM_HOLD = 1.0  # seconds for which a film stays on its last moment


def frame_rows(time: Array, fps: float, speed: float = 1.0, hold: float = 0.0) -> IntArray:
    """Return which row of ascending times, (T,) s, each frame of a film shows, the last one for `hold`, s."""
    count = int(np.ceil(float(time[-1] - time[0]) / speed * fps - 1e-9)) + 1
    at = time[0] + np.arange(count + round(hold * fps)) * (speed / fps)
    # half a microsecond forgives the rounding of sums of steps
    rows = np.searchsorted(time, at + 5e-7, side="right") - 1
    return np.asarray(np.clip(rows, 0, len(time) - 1), dtype=np.intp)


def iter_frames(
    record: Record,
    film: FilmOptions,
    *,
    size: tuple[int, int] = (1280, 720),
    layers: Sequence[Layer] | None = None,
    scale: float | None = None,
    cost: CostHistory | None = None,
    rows: IntArray | None = None,
    fields: Fields | None = None,
) -> Iterator[Frame]:
    """Draw the frames of a saved run, by default of `frame_rows`; each tells the latest known `cost`."""
    painter = _painter(record, film, size, layers or standard_layers(film.colours), scale)
    rows = frame_rows(record.time, film.fps, film.film_speed) if rows is None else rows
    for row, shown in groupby(rows.tolist()):
        text = ""
        if cost is not None and (known := np.searchsorted(cost.time, record.time[row] + 5e-7, side="right")):
            mean_time = None if cost.mean_time is None else cost.mean_time[known - 1]
            text = cost_label(mean_label(record.environment), cost.mean_distance[known - 1], mean_time)
        field = fields if painter.needs_field else None
        frame = painter.frame(record_scene(record, row, cost=text, fields=field))
        yield from (frame for _ in shown)


def _painter(
    record: Record, film: FilmOptions, size: tuple[int, int], layers: Sequence[Layer], scale: float | None
) -> Painter:
    painter = Painter(record.environment, size, film.colour_theme, layers, scale)
    painter.change(*film.layers())
    return painter


class PaneLayout(NamedTuple):
    """Layout of a film's panes: sizes in px of each and of all, and the legend, as wide as the film."""

    columns: int
    pane: tuple[int, int]
    scale: float
    header: Frame
    size: tuple[int, int]

    def page(self, panes: Sequence[Frame], theme: Theme) -> Frame:
        page = np.full((self.size[1], self.size[0], 3), theme.background, dtype=np.uint8)
        page[: len(self.header), : self.header.shape[1]] = self.header
        body = tiled(panes, self.columns, GAP, theme.grid, theme.background)
        part = page[len(self.header) :][: body.shape[0], : body.shape[1]]
        part[:] = body[: part.shape[0], : part.shape[1]]
        return page


def pane_layout(
    records: Sequence[Record],
    film: FilmOptions,
    size: tuple[int, int] | None = None,
    fields: Fields | None = None,
    legend_of: Sequence[Scene] | None = None,
) -> PaneLayout:
    """Lay out panes so that the maps are as large as can be: wide maps below each other.

    `size`: of the whole film, px; None suits the map, within `USUAL_SIZE`. `legend_of`: the scenes that the
    legend explains, by default the beginnings of the records, and where robots fail their ends.
    """
    bounds = [record.environment.region.bounds for record in records]
    aspect = max((high_x - low_x) / (high_y - low_y) for low_x, low_y, high_x, high_y in bounds)
    width, height = size or USUAL_SIZE
    scale = scale_for((width, height))
    around = (6 + LEGEND_ROW + 6 + STRIP) * scale
    columns = columns_for(len(records), aspect, (width, height - LEGEND_ROW * scale), around)
    rows = -(-len(records) // columns)
    scale = max(min(scale, width / columns / _NARROWEST), 0.75)
    around, beside = (6 + LEGEND_ROW + 6 + STRIP + 4) * scale, (2 * MARGIN + 4) * scale
    pane_width = (width - (columns - 1) * GAP) // columns
    if size is None:
        highest = (height - (6 + LEGEND_ROW) * scale) / rows - GAP
        pane_height = round(min((pane_width - beside) / aspect + around, highest))
        needed = max(round((pane_height - around) * aspect + beside), round(_NARROWEST * scale))
        pane_width = min(pane_width, needed)
        width = columns * pane_width + (columns - 1) * GAP
    painter = _painter(records[0], film, (64, 64), pane_layers(film.colours), scale)
    if legend_of is None:
        shown = fields if painter.needs_field else None
        ends = ((each, row) for each in records for row in (0, len(each) - 1))
        moments = [(each, row) for each, row in ends if not row or each.conditions]
        legend_of = [record_scene(record, row, fields=shown) for record, row in moments]
    # the longest first: its order is kept, and mostly nothing is missing
    found = sorted((painter.legend_entries(scene) for scene in legend_of), key=len)[::-1]
    header = legend_picture(united(found, LegendEntry.key), width, film.colour_theme, scale, film.layers()[0])
    if size is None:
        height = len(header) + rows * pane_height + (rows - 1) * GAP
        width, height = width + width % 2, height + height % 2
    else:
        pane_height = (height - len(header) - (rows - 1) * GAP) // rows
    return PaneLayout(columns, (pane_width, max(pane_height, 40)), scale, header, (width, height))


def comparison_frames(
    records: Sequence[Record],
    costs: Sequence[CostHistory],
    layout: PaneLayout,
    film: FilmOptions,
    *,
    hold: float = 0.0,
    fields: Fields | None = None,
) -> Iterator[Frame]:
    look: dict[str, Any] = {"size": layout.pane, "scale": layout.scale, "fields": fields}
    films = []
    for record, cost in zip(records, costs, strict=True):
        rows = frame_rows(record.time, film.fps, film.film_speed, hold)
        layers = pane_layers(film.colours)  # they keep what they have drawn: each film has its own
        films.append(iter_frames(record, film, layers=layers, cost=cost, rows=rows, **look))
    panes: list[Frame] = []
    for fresh in zip_longest(*films):
        panes = [old if new is None else new for new, old in zip_longest(fresh, panes)]
        yield layout.page(panes, film.colour_theme)


def tiled(frames: Sequence[Frame], columns: int, gap: int, line: Colour, blank: Colour) -> Frame:
    """Join frames of one size in rows, with lines of `gap` px between; free places are `blank`."""
    height, width, _ = frames[0].shape
    rows, columns = -(-len(frames) // columns), min(columns, len(frames))
    page = np.full((rows * (height + gap) - gap, columns * (width + gap) - gap, 3), blank, dtype=np.uint8)
    for k, frame in enumerate(frames):
        x, y = k % columns * (width + gap), k // columns * (height + gap)
        page[y : y + height, x : x + width] = frame
        page[y : y + height, max(x - gap, 0) : x] = page[max(y - gap, 0) : y] = line
    return page


def film_fields(
    runs: Sequence[Run], cost: CoverageCost | None, film: FilmOptions, *, quiet: bool
) -> Fields | None:
    """Return the distances that films of runs show on one scale of colours, which suits the end; or None."""
    if not film.layers()[0] & {"distances", "geodesic_cells"}:
        return None
    environment = runs[0].record.environment
    cost = cost or built_cost(environment, FILM_LATTICE, quiet=quiet)
    cost = cost_for_pictures(environment, cost, FILM_LATTICE)
    momentary, farthest = TimeVaryingCost(cost), 0.0
    for record in (run.record for run in runs):
        result = momentary(float(record.time[-1]), record.positions[-1], record.working[-1])
        if result is not None:
            farthest = max(farthest, float(result.distances[np.isfinite(result.distances)].max(initial=0.0)))
    return Fields(cost, round_limit(FILM_SCALE * farthest))


def save_moving(
    runs: Sequence[Run],
    cost: CoverageCost | None,
    folder: Path,
    film: FilmOptions,
    stop: Interruption,
    *,
    quiet: bool,
    bare: Sequence[Run] | None = None,
) -> None:
    """Write ``frames/`` and the film as the options say; `bare`: the runs on one map, without who failed."""
    if not (film.frames or film.video):
        return
    fields = film_fields(bare or runs, cost, film, quiet=quiet)
    records, costs = [run.record for run in runs], [run.history for run in runs]
    rows = frame_rows(max(records, key=len).time, film.fps, film.film_speed, FILM_HOLD)
    if len(runs) == 1:
        frames = iter_frames(records[0], film, size=film.film_size(), cost=costs[0], rows=rows, fields=fields)
    else:
        layout = pane_layout(records, film, film.picture_size(), fields)
        frames = comparison_frames(records, costs, layout, film, hold=FILM_HOLD, fields=fields)
    write_moving(frames, len(rows), folder / FILMS[len(runs) > 1], film, stop, quiet=quiet)


def write_moving(
    frames: Iterator[Frame], total: int, path: Path, film: FilmOptions, stop: Interruption, *, quiet: bool
) -> None:
    """Write frames beside a film, as PNGs, and the film, as the options say; Ctrl-C ends both early."""
    with progress("film" if film.video else "frames", total, quiet=quiet) as update:

        def told() -> Iterator[Frame]:
            for done, frame in enumerate(frames, start=1):
                yield frame
                update(done)
                if stop.requested:
                    return

        folder = path.parent / "frames" if film.frames else None
        save_moving_picture(told(), folder, path if film.video else None, film.fps)
