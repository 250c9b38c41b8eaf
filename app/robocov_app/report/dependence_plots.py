"""Plots of what a result depends on: the gains of the controllers, and what varies of the team."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.controllers.gains import value_text
from robocov_app.figures.curves import curve_styles
from robocov_app.figures.gains import MOST_LEVELS, Dependence, plot_gain_grid, plot_gains
from robocov_app.report.groups import Group, by_controller, dependences, medians, settings
from robocov_app.report.result_plots import PANEL, RELATIVE, SCALE, Plot
from robocov_app.report.svg import inline_svg
from robocov_app.sweep.study import UNITS, WORDS

if TYPE_CHECKING:
    from robocov.controllers.gains import Value
    from robocov_app.report.gathering import Entry, Result


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
    group: Group,
    value_of: Callable[[Entry], float | None],
    scale_of: Callable[[Entry], float],
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
