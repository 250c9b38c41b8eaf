"""The plots of a report: costs, comparisons, metrics, and what they depend on."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np
from matplotlib.figure import Figure

from robocov.arrays import Array
from robocov.controllers.gains import Value, format_value
from robocov.errors import format_count
from robocov.metrics.run_metrics import RunMetrics, compute_run_metrics
from robocov_app.figures import results as drawing
from robocov_app.figures.curves import DISTANCE, TIME
from robocov_app.figures.results import MOST_LEVELS, Band, Dependence, Pairs, Sample
from robocov_app.figures.runs import to_free_area_percent
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles
from robocov_app.report import groups as grouped
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.groups import Comparison, Group, Scales, ratio_text, setting_label
from robocov_app.report.pictures import has_path
from robocov_app.report.results import Entry, Result
from robocov_app.report.svg import inline_svg
from robocov_app.sweep.parameters import TEXT_PARAMETERS, UNITS

Looks: TypeAlias = Mapping[str, CurveStyle]  # the styles of a result's groups by label (`groups.styles`)

TOGETHER = "All maps and teams together"
METERS, RELATIVE = "final mean distance (m)", "final distance / median of map and team"
MOST_PANELS = 24  # settings up to which each has panels of its own
PANEL = 420, 290  # of a panel in pixels; on a telephone it is shown a little smaller
WIDE = 860, 360  # of a plot that stands alone, on a screen that is wide enough
_MOMENTS = 121  # moments of a cost curve: one every three pixels
MOST_MEASURED, MOST_ROBOTS = 4, 60  # runs and robots up to which runs are measured: sight takes a while
_MEASURED = 30  # moments of a run, besides its first


class Plot(NamedTuple):
    """A plot of the page: its title (may be empty), its SVG, and another for small screens if it is wide."""

    title: str
    svg: str
    narrow: str = ""


def _parts(result: Result, key: str) -> Iterator[tuple[str, str, list[Group], bool]]:
    """Yield title, key and groups of several settings together, then of each where they are not many."""
    groups, every = grouped.shown_groups(result), grouped.settings(result)
    if len(every) > 1:
        yield TOGETHER, f"{key}-all", groups, True
    for k, setting in enumerate(every if len(every) <= MOST_PANELS else ()):
        title = setting_label(result, setting) if len(every) > 1 else ""
        yield title, f"{key}-{k}", [group.at(setting) for group in groups], False


def cost_plots(result: Result, looks: Looks, key: str) -> Iterator[Plot]:
    """Yield the cost curves: over all settings, as parts of the first value, then of each setting."""
    known = {entry: history for entry in result.fine if (history := result.history(entry)) is not None}
    known = {entry: each for entry, each in known.items() if np.isfinite(each.mean_distance).any()}
    longest = max((float(each.time[-1] - each.time[0]) for each in known.values()), default=0.0)
    time = np.linspace(0.0, longest, _MOMENTS if longest > 0.0 else 1)
    values = {
        entry: np.interp(time, each.time - each.time[0], each.mean_distance, right=np.nan)
        for entry, each in known.items()
    }
    for title, own, groups, several in _parts(result, key):
        bands, words, what, unit = [], [], DISTANCE, " m"
        if several:
            what, unit = "mean distance / that of the start", ""
        for group in groups:
            rows = [values[entry] for entry in group.entries if entry in values]
            if several:
                rows = [row / row[0] for row in rows if np.isfinite(row[0]) and row[0] > 0.0]
            if not rows:
                continue
            bands.append(Band(group.label, looks[group.label], time, np.array(rows)))
            low, middle, high = (row[np.isfinite(row)][-1] for row in drawing.quartiles(bands[-1].values))
            text = f"{group.label}: {middle:.3f}{unit}"
            if len(rows) > 1:
                text += f" at the end (median of {len(rows)} runs, quartiles {low:.3f} to {high:.3f})"
            words.append(text)
        if bands:
            about = f"{what} against time, up to {time[-1]:.4g} s. {'; '.join(words)}."
            # the axis tells the unit: names have little room
            yield _fitting(title, own, about, partial(drawing.plot_cost_bands, bands, label=what, unit=""))


def final_plots(result: Result, looks: Looks, key: str) -> Iterator[Plot]:
    """Yield the distributions of final costs: over all settings, by their medians, then of each setting."""
    scales, meters = grouped.medians(result), dict.fromkeys(result.fine, 1.0)
    for title, own, groups, several in _parts(result, key):
        what, unit = (RELATIVE, "") if several else (METERS, " m")
        samples = [
            Sample(group.label, looks[group.label], values)
            for group in groups
            if len(values := grouped.relative(group.entries, scales if several else meters))
        ]
        if not samples or max(len(sample.values) for sample in samples) < 2:
            continue

        def drawn(size: tuple[int, int], samples: list[Sample] = samples, what: str = what) -> Figure:
            return drawing.plot_final_costs([("", samples)], what, size[0], 1.0)

        words = []
        for label, _, found in samples:
            low, middle, high = np.percentile(found, [25, 50, 75])
            text = f"{label}: median {middle:.3f}{unit}, quartiles {low:.3f} to {high:.3f}"
            words.append(f"{text}, {format_count(len(found), 'run')}")
        yield _fitting(title, own, f"{what}. {'; '.join(words)}.", drawn)


def _fitting(title: str, key: str, about: str, drawn: Callable[[tuple[int, int]], Figure]) -> Plot:
    sizes, sentence = ((PANEL,), f"{title}: {about}") if title else ((WIDE, PANEL), about)
    svgs = (inline_svg(drawn(size), f"{key}{k or ''}", sentence) for k, size in enumerate(sizes))
    return Plot(title, *svgs)


def paired_plots(comparisons: Sequence[Comparison], looks: Looks, key: str) -> Iterator[Plot]:
    """Yield the ratios of each comparison, a row for each map and one over all of them."""
    for k, each in enumerate(comparisons):
        if each.pairs < 2:
            continue
        style, rows, maps = looks[each.first.label], [], each.maps
        if 1 < len(maps) <= MOST_PANELS:
            rows = [Pairs(own.name, style, own.a / own.b, own.ratio) for own in maps]
        if len(maps) > 1:
            ratios = np.array([own.ratio.estimate for own in maps])
            rows.append(Pairs(f"all {len(maps)} maps", style, ratios, each.ratio))
        else:
            rows.append(Pairs(f"{each.pairs} pairs", style, maps[0].a / maps[0].b, each.ratio))
        words = "; ".join(f"{row.label}: ratio {ratio_text(row.interval)}" for row in rows)
        figure = drawing.plot_paired(rows, "ratio of final mean distances (log)", PANEL[0], 1.0)
        yield Plot(each.label, inline_svg(figure, f"{key}-{k}", f"{each.label}, pair by pair. {words}."))


class _Parameter(NamedTuple):
    """Parameter of a result: a gain, or a property of the team; `choices` are the words it may be."""

    title: str
    value_of: Callable[[Entry], Value]
    choices: tuple[str, ...] = ()

    def level(self, place: float) -> Value:
        """Return the value at a place of the axis: nan stands for no limit, and a word's number for it."""
        if np.isnan(place):
            return None
        return self.choices[int(place)] if self.choices else place

    def text(self, place: float) -> str:
        return format_value(self.level(place), digits=4)

    def dependence(self, group: Group, scales: Scales, style: CurveStyle) -> Dependence:
        """Return the scaled costs of a group's runs over the parameter, of those that have one."""
        known = []
        for entry in group.entries:
            value, cost = self.value_of(entry), grouped.scaled(entry, scales)
            if np.isfinite(cost):
                place = float(self.choices.index(value)) if isinstance(value, str) else value
                known.append((np.nan if place is None else place, cost))
        places, values = np.array(known, dtype=float).reshape(-1, 2).T
        return Dependence(group.label, style, places, values)


def dependence_plots(result: Result, key: str) -> Iterator[Plot]:
    """Yield the final cost against every gain and limit that varies, then grids of gains."""
    groups, varying = grouped.by_controller(result), grouped.dependences(result)
    styles = choose_controller_styles(group.controller for group in groups)

    def scale(label: str, part_of: Callable[[Entry], object]) -> tuple[str, Scales]:
        # by the medians of parts; of one part in meters
        if len({part_of(entry) for entry in result.fine}) == 1:
            return METERS, dict.fromkeys(result.fine, 1.0)
        return label, grouped.medians(result, part_of)

    def plotted(over: _Parameter, some: list[Group], by: tuple[str, Scales], key: str) -> Iterator[Plot]:
        label, scales = by
        rows = [over.dependence(group, scales, styles[group.controller]) for group in some]
        if rows := [row for row in rows if len(row.values)]:
            figure = drawing.plot_gains(rows, over.title, PANEL, label, over.choices)
            words = "; ".join(_levels_text(row, over) for row in rows)
            yield Plot(over.title, inline_svg(figure, key, f"{label} against {over.title}. {words}."))

    by_setting = scale(RELATIVE, lambda entry: entry.setting)
    gains: dict[str, _Parameter] = {}
    for k, (name, controllers) in enumerate(varying.items()):
        values = dict.fromkeys(dict(entry.gains).get(name) for entry in result.fine)
        unit, choices = result.units.get(name, ""), tuple(each for each in values if isinstance(each, str))
        title = f"{name} ({unit})" if unit else name
        gains[name] = _Parameter(title, partial(_named, "gains", name), choices)
        some = [group for group in groups if group.controller in controllers]
        yield from plotted(gains[name], some, by_setting, f"{key}-{k}")
    team = [_Parameter("robots", lambda entry: entry.robots)]
    for name, _ in result.fine[0].team if result.fine else ():
        if name not in TEXT_PARAMETERS:
            title = f"{name.replace('_', ' ')} ({UNITS[name]})"
            team.append(_Parameter(title, partial(_named, "team", name)))
    # teams differ in their settings: by the medians of the maps alone
    by_map = scale("final distance / median of map", lambda entry: entry.map)
    for k, parameter in enumerate(team):
        if len({parameter.value_of(entry) for entry in result.fine}) > 1:
            yield from plotted(parameter, groups, by_map, f"{key}-team-{k}")
    count = 1
    for group in groups:
        own = [name for name, controllers in varying.items() if group.controller in controllers]
        for names in combinations(own, 2):
            both, style = {name: gains[name] for name in names}, styles[group.controller]
            if plot := _grid_plot(group, both, by_setting, style, f"{key}-grid-{count}"):
                count += 1
                yield plot


def _named(part: str, name: str, entry: Entry) -> Value:
    value: Value = dict(getattr(entry, part))[name]
    return value


def _levels_text(row: Dependence, parameter: _Parameter) -> str:
    levels = np.unique(row.gains)
    if len(levels) > MOST_LEVELS:
        span = f"from {np.nanmin(row.gains):.3g} to {np.nanmax(row.gains):.3g}"
        best = parameter.text(row.gains[int(np.argmin(row.values))])
        return f"{row.label}, {len(row.values)} runs {span}, the lowest value at {best}"
    places = np.nan_to_num(row.gains, nan=np.inf)
    parts = [
        f"{parameter.text(level)}: {np.median(row.values[places == np.nan_to_num(level, nan=np.inf)]):.3f}"
        for level in levels.tolist()
    ]
    return f"{row.label}, medians at {', '.join(parts)}"


def _grid_plot(
    group: Group, over: Mapping[str, _Parameter], by: tuple[str, Scales], style: CurveStyle, key: str
) -> Plot | None:
    """Return medians over two gains of a controller; None where they were not tried on a grid."""
    (label, scales), gains = by, list(over.values())
    first, second = (gain.dependence(group, scales, style) for gain in gains)
    columns, i = np.unique(first.gains, return_inverse=True)
    rows, j = np.unique(second.gains, return_inverse=True)
    if not (1 < len(columns) <= MOST_LEVELS and 1 < len(rows) <= MOST_LEVELS):
        return None
    values = np.full((len(rows), len(columns)), np.nan)
    for row, column in set(zip(j.tolist(), i.tolist(), strict=True)):
        values[row, column] = np.median(first.values[(j == row) & (i == column)])
    if np.isnan(values).mean() > 0.5:
        return None  # a sample of a range
    levels = [[gain.level(place) for place in own] for gain, own in zip(gains, (columns, rows), strict=True)]
    titles = gains[0].title, gains[1].title
    figure = drawing.plot_gain_grid(PANEL, levels[0], levels[1], values, titles)
    row, column = np.unravel_index(int(np.nanargmin(values)), values.shape)
    title = f"{group.label} over {' and '.join(over)}"
    what = "final distance in m" if label == METERS else RELATIVE
    best = f"{titles[0]} {gains[0].text(columns[column])} and {titles[1]} {gains[1].text(rows[row])}"
    span = f"from {np.nanmin(values):.3g} at {best} to {np.nanmax(values):.3g}"
    return Plot(title, inline_svg(figure, key, f"{title}: medians of the {what}, {span}."))


def _in_contact(gaps: Array) -> Array:
    """Return gaps in whole millimeters: what is below is the solver's slop, which has no sign."""
    return np.asarray(np.round(gaps, 3) + 0.0)


# title, label, unit and values of each plot of a metric
_PANELS: tuple[tuple[str, str, str, Callable[[RunMetrics], Array]], ...] = (
    (
        "Sensed",
        "in range and in sight (% of the free area)",
        "%",
        to_free_area_percent(lambda m: m.sensed_area),
    ),
    ("Seen", "in line of sight (% of the free area)", "%", to_free_area_percent(lambda m: m.visible_area)),
    ("Energy", "work |F v| so far (J)", "J", lambda m: m.work),
    ("Path", "path of a robot so far, mean (m)", "m", lambda m: m.path_length),
    ("Clearance", "smallest gap to a wall (m)", "m", lambda m: _in_contact(m.wall_clearance)),
    ("Distance kept", "smallest gap between robots (m)", "m", lambda m: _in_contact(m.robot_clearance)),
    ("Connectivity", "parts of the team that hear each other", "", lambda m: np.asarray(m.components, float)),
)


def measure_plots(result: Result, runs: Sequence[ReplayRun], looks: Looks, key: str) -> list[Plot]:
    """Return a plot for each metric that tells something; none of a sweep, or where ways are not known."""
    if result.kind == "sweep" or not 0 < len(runs) <= MOST_MEASURED:
        return []
    if any(len(run.record.team) > MOST_ROBOTS or not has_path(run.record) for run in runs):
        return []
    measured = []
    for record in (run.record for run in runs):
        seconds = float(record.time[-1] - record.time[0])
        measured.append(compute_run_metrics(record, _MEASURED / seconds if seconds > 0.0 else 0.0))
    parting = any((metrics.components != metrics.components[0]).any() for metrics in measured)
    curves = [
        (title, label, unit, [(metrics.time, of(metrics)) for metrics in measured])
        for title, label, unit, of in _PANELS
        if parting or title != "Connectivity"
    ]
    histories = [run.history for run in runs]
    times = [(each.time, each.mean_time) for each in histories if each and each.mean_time is not None]
    if len(times) == len(runs):
        curves.insert(0, ("Time to come", TIME, "s", times))
    plots = []
    for title, label, unit, found in curves:
        bands = [
            Band(run.label, looks[run.label], time - time[0], np.where(known, values, np.nan)[None])
            for run, (time, values) in zip(runs, found, strict=True)
            if (known := np.isfinite(values)).any()
        ]
        if not bands:
            continue
        figure = drawing.plot_cost_bands(bands, PANEL, label, unit)
        words = []
        for band in bands:
            first, last = band.values[0][np.isfinite(band.values[0])][[0, -1]]
            words.append(f"{band.label}: from {first:.4g} to {last:.4g} {unit}".rstrip())
        sentence = f"{title}: {label} against time. {'; '.join(words)}."
        plots.append(Plot(title, inline_svg(figure, f"{key}-{title.lower().replace(' ', '-')}", sentence)))
    return plots
