"""The plots of a report: costs, comparisons, metrics, and what they depend on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.controllers.gains import Value, value_text
from robocov.errors import counted
from robocov.metrics.run_metrics import RunMetrics, run_metrics
from robocov_app.figures.gains import MOST_LEVELS, Dependence, plot_gain_grid, plot_gains
from robocov_app.figures.results import (
    Band,
    Pairs,
    Sample,
    plot_cost_bands,
    plot_final_costs,
    plot_paired,
    quartiles,
)
from robocov_app.figures.styles import CurveStyle, curve_styles
from robocov_app.report.embedding import ReplayRun, has_path
from robocov_app.report.groups import (
    Comparison,
    Group,
    by_controller,
    dependences,
    medians,
    ratio_text,
    relative,
    setting_label,
    settings,
    shown_groups,
)
from robocov_app.report.results import Entry, Result
from robocov_app.report.svg import inline_svg
from robocov_app.sweep.study import UNITS, WORDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# the styles of a result's groups by label (`robocov_app.report.groups.styles`)
Looks: TypeAlias = Mapping[str, CurveStyle]
MOST_PANELS = 24  # settings up to which each has panels of its own
PANEL = 420, 290  # of a panel in pixels; on a telephone it is shown a little smaller

SCALE = 1.0

_MOMENTS = 121  # moments of a cost curve: one every three pixels

RELATIVE = "final distance / median of map and team"


WIDE = 860, 360  # of a plot that stands alone, on a screen that is wide enough


class Plot(NamedTuple):
    """A plot of the page: its title (may be empty), its SVG, and another for small screens if it is wide."""

    title: str
    svg: str
    narrow: str = ""


class Curves:
    """Mean distances over time of all runs of a result, at common moments."""

    def __init__(self, result: Result) -> None:
        longest = 0.0
        histories = {}
        for entry in result.fine:
            history = result.history(entry)
            if history is None or not np.isfinite(history.mean_distance).any():
                continue
            time = history.time - history.time[0]
            longest = max(longest, float(time[-1]))
            histories[entry] = time, history.mean_distance
        self.time: Array = np.linspace(0.0, longest, _MOMENTS if longest > 0.0 else 1)
        self.values: dict[Entry, Array] = {
            entry: np.interp(self.time, time, values, right=np.nan)
            for entry, (time, values) in histories.items()
        }

    def band(self, group: Group, *, parts: bool = False) -> Band | None:
        """Return the curves of a group, as multiples of their first values where so wanted."""
        rows = [self.values[entry] for entry in group.entries if entry in self.values]
        if parts:
            rows = [row / row[0] for row in rows if np.isfinite(row[0]) and row[0] > 0.0]
        if not rows:
            return None
        return Band(group.label, group.controller, self.time, np.array(rows))


def cost_plots(result: Result, curves: Curves, looks: Looks, key: str) -> Iterator[Plot]:
    """Yield the cost curves: over all settings, as parts of the first value, then of each setting."""
    groups = shown_groups(result)
    every = settings(result)
    if len(every) > 1:
        bands = [band for group in groups if (band := curves.band(group, parts=True)) is not None]
        if bands:
            what = "mean distance / that of the start"
            yield _band_plot("All maps and teams together", bands, looks, f"{key}-all", what, "")
    for k, setting in enumerate(every if len(every) <= MOST_PANELS else ()):
        bands = [band for group in groups if (band := curves.band(group.at(setting))) is not None]
        if bands:
            what = "mean distance to the nearest robot (m)"
            title = setting_label(result, setting) if len(every) > 1 else ""
            yield _band_plot(title, bands, looks, f"{key}-{k}", what, "m")


def final_plots(result: Result, looks: Looks, key: str) -> Iterator[Plot]:
    """Yield the distributions of final costs: over all settings, by their medians, then of each setting."""
    groups = shown_groups(result)
    every = settings(result)
    if len(every) > 1:
        scales = medians(result)
        samples = [_sample(group, relative(group.entries, scales)) for group in groups]
        yield from _sample_plot("All maps and teams together", samples, looks, f"{key}-all", RELATIVE, "")
    for k, setting in enumerate(every if len(every) <= MOST_PANELS else ()):
        samples = [_sample(group, group.at(setting).finals) for group in groups]
        title = setting_label(result, setting) if len(every) > 1 else ""
        yield from _sample_plot(title, samples, looks, f"{key}-{k}", "final mean distance (m)", " m")


def paired_plots(comparisons: Sequence[Comparison], looks: Looks, key: str) -> Iterator[Plot]:
    """Yield the ratios of each comparison, a row for each map and one over all of them."""
    for k, each in enumerate(comparisons):
        if each.pairs < 2:
            continue
        name, rows = each.first.controller, []
        if 1 < len(each.maps) <= MOST_PANELS:
            rows = [Pairs(own.name, name, own.a / own.b, own.ratio) for own in each.maps]
        several = len(each.maps) > 1
        label = f"all {len(each.maps)} maps" if several else f"{each.pairs} pairs"
        ratios = (
            np.array([own.ratio.estimate for own in each.maps])
            if several
            else each.maps[0].a / each.maps[0].b
        )
        rows.append(Pairs(label, name, ratios, each.ratio))
        words = "; ".join(f"{row.label}: ratio {ratio_text(row.interval)}" for row in rows)
        figure = plot_paired(
            rows,
            size=(PANEL[0], None),
            scale=SCALE,
            label="ratio of final mean distances (log)",
            styles=[looks[each.first.label]] * len(rows),
        )
        yield Plot(each.label, inline_svg(figure, f"{key}-{k}", f"{each.label}, pair by pair. {words}."))


def _band_plot(title: str, bands: list[Band], looks: Looks, key: str, what: str, unit: str) -> Plot:
    own = [looks[band.label] for band in bands]
    figures = [
        # the axis tells the unit: names have little room
        plot_cost_bands(bands, size=size, scale=SCALE, title="", styles=own, label=what, unit="")
        for size in ((PANEL,) if title else (WIDE, PANEL))
    ]
    words = []
    for band in bands:
        low, middle, high = (row[np.isfinite(row)][-1] for row in quartiles(band.values))
        text = f"{band.label}: {middle:.3f} {unit}".rstrip()
        if len(band.values) > 1:
            text += f" at the end (median of {len(band.values)} runs, quartiles {low:.3f} to {high:.3f})"
        words.append(text)
    about = f"{title}: {what}" if title else what
    sentence = f"{about} against time, up to {bands[0].time[-1]:.4g} s. {'; '.join(words)}."
    return _alone(title, figures, key, sentence)


def _alone(title: str, figures: Sequence[Figure], key: str, sentence: str) -> Plot:
    """Return a plot that was drawn once, or for wide screens and for narrow ones."""
    return Plot(title, *(inline_svg(figure, f"{key}{k or ''}", sentence) for k, figure in enumerate(figures)))


def _sample(group: Group, values: Array) -> Sample:
    return Sample(group.label, group.controller, values[np.isfinite(values)])


def _sample_plot(
    title: str, samples: list[Sample], looks: Looks, key: str, what: str, unit: str
) -> Iterator[Plot]:
    samples = [sample for sample in samples if len(sample.values)]
    if not samples or max(len(sample.values) for sample in samples) < 2:
        return
    own = [looks[sample.label] for sample in samples]
    figures = [
        plot_final_costs([("", samples)], size=(width, None), scale=SCALE, styles=own, label=what)
        for width in ((PANEL[0],) if title else (WIDE[0], PANEL[0]))
    ]
    words = []
    for sample in samples:
        low, middle, high = np.percentile(sample.values, [25, 50, 75])
        words.append(
            f"{sample.label}: median {middle:.3f}{unit}, quartiles {low:.3f} to {high:.3f}, "
            f"{counted(len(sample.values), 'run')}"
        )
    sentence = f"{f'{title}: {what}' if title else what}. {'; '.join(words)}."
    yield _alone(title, figures, key, sentence)


def dependence_plots(result: Result, key: str) -> Iterator[Plot]:
    """Yield the final cost against every gain and limit that varies, then grids of gains."""
    groups = by_controller(result)
    one = len(settings(result)) == 1
    label = "final mean distance (m)" if one else RELATIVE
    scales = medians(result)
    for k, (name, controllers) in enumerate(dependences(result).items()):
        some = [group for group in groups if group.controller in controllers]
        words = _words(result, name)
        value = partial(_gain, name, words)
        rows = [_dependence(group, value, _scale(None if one else scales)) for group in some]
        yield from _gain_plot(_named(name, result.units), rows, groups, f"{key}-{k}", label, words)
    yield from _team_plots(result, groups, f"{key}-team")
    yield from _grid_plots(result, groups, None if one else scales, f"{key}-grid")


def _team_plots(result: Result, groups: Sequence[Group], key: str) -> Iterator[Plot]:
    """Yield the final cost against the team's size and limits, by the medians of the maps alone."""
    values: dict[str, list[float]] = {}
    for entry in result.fine:
        if np.isfinite(entry.final):
            values.setdefault(entry.map, []).append(entry.final)
    by_map = {name: float(np.median(each)) for name, each in values.items()}
    one = len(by_map) == 1
    label = "final mean distance (m)" if one else "final distance / median of map"

    def scale(entry: Entry) -> float:
        return 1.0 if one else by_map.get(entry.map, 0.0)

    parameters = (
        {"robots": ""} | {name: UNITS[name] for name, _ in result.fine[0].team if name not in WORDS}
        if result.fine
        else {}
    )
    for k, (name, unit) in enumerate(parameters.items()):
        if len({_team_value(name, entry) for entry in result.fine}) < 2:
            continue
        rows = [_dependence(group, partial(_team_value, name), scale) for group in groups]
        words = name.replace("_", " ") + (f" ({unit})" if unit else "")
        yield from _gain_plot(words, rows, groups, f"{key}-{k}", label)


def _words(result: Result, name: str) -> tuple[str, ...]:
    """Return the values of a gain that is a word; none of one that is a number."""
    values = dict.fromkeys(dict(entry.gains).get(name) for entry in result.fine)
    return tuple(value for value in values if isinstance(value, str))


def _gain(name: str, words: tuple[str, ...], entry: Entry) -> float | None:
    """Return the value of a gain, of a word its number."""
    value = dict(entry.gains)[name]
    return words.index(value) if isinstance(value, str) else value


def _team_value(name: str, entry: Entry) -> float | None:
    return entry.robots if name == "robots" else dict(entry.team)[name]


def _scale(scales: Mapping[tuple[object, ...], float] | None) -> Callable[[Entry], float]:
    """Return what the final cost of an entry is divided by, 0 where that is not known."""
    return lambda entry: 1.0 if scales is None else scales.get(entry.setting, 0.0)


def _dependence(
    group: Group, value_of: Callable[[Entry], float | None], scale_of: Callable[[Entry], float]
) -> Dependence:
    places, values = [], []
    for entry in group.entries:
        scale = scale_of(entry)
        if np.isfinite(entry.final) and scale > 0.0:
            place = value_of(entry)
            places.append(np.nan if place is None else place)
            values.append(entry.final / scale)
    return Dependence(group.label, group.controller, np.array(places), np.array(values))


def _gain_plot(
    name: str,
    rows: list[Dependence],
    groups: Sequence[Group],
    key: str,
    label: str,
    choices: tuple[str, ...] = (),
) -> Iterator[Plot]:
    rows = [row for row in rows if len(row.values)]
    if not rows:
        return
    known = curve_styles(group.controller for group in groups)
    looks = [known[row.controller] for row in rows]
    figure = plot_gains(rows, name, size=PANEL, scale=SCALE, styles=looks, label=label, words=choices)
    words = []
    for row in rows:
        levels = np.unique(row.gains)
        if len(levels) <= MOST_LEVELS:
            parts = [
                f"{_level(level, choices)}: {np.median(row.values[_same(row.gains, level)]):.3f}"
                for level in levels.tolist()
            ]
            words.append(f"{row.label}, medians at {', '.join(parts)}")
        else:
            low, high = np.nanmin(row.gains), np.nanmax(row.gains)
            best = row.gains[int(np.argmin(row.values))]
            span = f"from {low:.3g} to {high:.3g}"
            words.append(f"{row.label}, {len(row.values)} runs {span}, the lowest value at {_level(best)}")
    yield Plot(name, inline_svg(figure, key, f"{label} against {name}. {'; '.join(words)}."))


def _grid_plots(
    result: Result, groups: Sequence[Group], scales: Mapping[tuple[object, ...], float] | None, key: str
) -> Iterator[Plot]:
    """Yield medians over every two gains of a controller that were tried on a grid."""
    varying, count = dependences(result), 0
    for group in groups:
        own = [name for name, controllers in varying.items() if group.controller in controllers]
        for first, second in combinations(own, 2):
            choices = _words(result, first), _words(result, second)
            values_of = (partial(_gain, *each) for each in zip((first, second), choices, strict=True))
            pair = [_dependence(group, value, _scale(scales)) for value in values_of]
            columns, rows = (np.unique(each.gains) for each in pair)
            if not (1 < len(columns) <= MOST_LEVELS and 1 < len(rows) <= MOST_LEVELS):
                continue
            values = np.full((len(rows), len(columns)), np.nan)
            for i, row in enumerate(rows):
                for j, column in enumerate(columns):
                    here = _same(pair[0].gains, column) & _same(pair[1].gains, row)
                    if here.any():
                        values[i, j] = np.median(pair[0].values[here])
            if np.isnan(values).mean() > 0.5:
                continue  # no grid: a sample of a range
            count += 1
            names = first, second
            levels = tuple(
                [_level_value(x, known) for x in each.tolist()]
                for each, known in zip((columns, rows), choices, strict=True)
            )
            yield _grid_plot(
                result, group, names, (levels[0], levels[1]), values, f"{key}-{count}", scales is None
            )


def _grid_plot(
    result: Result,
    group: Group,
    names: tuple[str, str],
    levels: tuple[list[Value], list[Value]],
    values: Array,
    key: str,
    metres: bool,
) -> Plot:
    columns, rows = levels
    both = _named(names[0], result.units), _named(names[1], result.units)
    figure = plot_gain_grid(columns, rows, values, both, size=PANEL, scale=SCALE)
    i, j = np.unravel_index(int(np.nanargmin(values)), values.shape)
    title = f"{group.label} over {names[0]} and {names[1]}"
    what = "final distance in m" if metres else RELATIVE
    sentence = (
        f"{title}: medians of the {what}, from {np.nanmin(values):.3g} at {both[0]} {_text(columns[j])} "
        f"and {both[1]} {_text(rows[i])} to {np.nanmax(values):.3g}."
    )
    return Plot(title, inline_svg(figure, key, sentence))


def _named(name: str, units: Mapping[str, str]) -> str:
    unit = units.get(name, "")
    return f"{name} ({unit})" if unit else name


def _level_value(level: float, words: tuple[str, ...]) -> Value:
    """Return the value of a gain at a level: nan is null, and a word's is its number."""
    if np.isnan(level):
        return None
    return words[int(level)] if words else level


def _level(level: float, words: tuple[str, ...] = ()) -> str:
    return _text(_level_value(level, words))


def _text(value: Value) -> str:
    return value_text(value, digits=4)


def _same(values: Array, level: float) -> BoolArray:
    return np.isnan(values) if np.isnan(level) else values == level


MOST_MEASURED = 4  # runs up to which they are measured: what is in sight takes a while to know
MOST_ROBOTS = 60  # robots up to which they are
_MEASURED = 30  # moments of a run, besides its first


class _Panel(NamedTuple):
    title: str
    label: str
    unit: str
    of: Callable[[RunMetrics], Array]


def _part(area: Callable[[RunMetrics], Array]) -> Callable[[RunMetrics], Array]:
    return lambda metrics: np.asarray(100.0 * area(metrics) / metrics.free_area)


def _in_contact(gaps: Array) -> Array:
    """Return gaps in whole millimetres: what is below is the solver's slop, which has no sign."""
    return np.asarray(np.round(gaps, 3) + 0.0)


_PANELS = (
    _Panel("Sensed", "in range and in sight (% of the free area)", "%", _part(lambda m: m.sensed_area)),
    _Panel("Seen", "in line of sight (% of the free area)", "%", _part(lambda m: m.visible_area)),
    _Panel("Energy", "work |F v| so far (J)", "J", lambda m: m.work),
    _Panel("Path", "path of a robot so far, mean (m)", "m", lambda m: m.path_length),
    _Panel("Clearance", "smallest gap to a wall (m)", "m", lambda m: _in_contact(m.wall_clearance)),
    _Panel("Distance kept", "smallest gap between robots (m)", "m", lambda m: _in_contact(m.robot_clearance)),
    _Panel(
        "Connectivity", "parts of the team that hear each other", "", lambda m: m.components.astype(float)
    ),
)


def measure_plots(
    result: Result, runs: Sequence[ReplayRun], entries: Sequence[Entry], looks: Looks, key: str
) -> list[Plot]:
    """Return a plot for each metric of a run, or of the runs of a comparison; none of a sweep.

    Nor are there any of very many runs or robots, or where a record does not tell the robots' ways. A
    metric that tells nothing is left out, as the gap between robots where there is one.
    """
    if result.kind == "sweep" or not 0 < len(runs) <= MOST_MEASURED:
        return []
    if any(len(run.record.team) > MOST_ROBOTS or not has_path(run.record) for run in runs):
        return []
    groups = shown_groups(result)
    group_of = {entry: group for group in groups for entry in group.entries}
    measured = [_measured(run) for run in runs]
    curves = [
        (panel, [(metrics.time, panel.of(metrics)) for metrics in measured])
        for panel in _PANELS
        if panel.title != "Connectivity" or any((m.components != m.components[0]).any() for m in measured)
    ]
    histories = [run.history for run in runs]
    times = [(each.time, each.mean_time) for each in histories if each and each.mean_time is not None]
    if len(times) == len(runs):
        title, what = "Time to come", "mean time until the first robot is there (s)"
        curves.insert(0, (_Panel(title, what, "s", lambda m: m.time), times))
    plots = []
    for panel, found in curves:
        bands = [
            Band(
                group_of[entry].label, entry.controller, time - time[0], np.where(known, values, np.nan)[None]
            )
            for entry, (time, values) in zip(entries, found, strict=True)
            if entry in group_of and (known := np.isfinite(values)).any()
        ]
        if bands:
            own = [looks[band.label] for band in bands]
            figure = plot_cost_bands(
                bands, size=PANEL, scale=SCALE, title="", styles=own, label=panel.label, unit=panel.unit
            )
            name = f"{key}-{panel.title.lower().replace(' ', '-')}"
            plots.append(Plot(panel.title, inline_svg(figure, name, _sentence(panel, bands))))
    return plots


def _measured(run: ReplayRun) -> RunMetrics:
    record = run.record
    seconds = float(record.time[-1] - record.time[0])
    return run_metrics(record, _MEASURED / seconds if seconds > 0.0 else 0.0)


def _sentence(panel: _Panel, bands: Sequence[Band]) -> str:
    """Return a plot's curves in words."""
    words = []
    for band in bands:
        first, last = band.values[0][np.isfinite(band.values[0])][[0, -1]]
        words.append(f"{band.label}: from {first:.4g} to {last:.4g} {panel.unit}".rstrip())
    return f"{panel.title}: {panel.label} against time. {'; '.join(words)}."
