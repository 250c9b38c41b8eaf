"""The plots of a report: from a result to SVG with a title, and a sentence for who does not see it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.errors import counted
from robocov_app.figures.curves import CurveStyle
from robocov_app.figures.results import (
    Band,
    Pairs,
    Sample,
    plot_cost_bands,
    plot_final_costs,
    plot_paired,
    quartiles,
)
from robocov_app.report.groups import (
    Group,
    medians,
    relative,
    setting_label,
    settings,
    shown_groups,
)
from robocov_app.report.pairs import Comparison, ratio_text
from robocov_app.report.svg import inline_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from robocov_app.report.gathering import Entry, Result

Looks: TypeAlias = Mapping[str, CurveStyle]
"""The styles of a result's groups by label (`robocov_app.report.groups.styles`)."""

MOST_PANELS = 24
"""Settings up to which each has panels of its own."""

PANEL = 420, 290
"""Of a panel in pixels; on a telephone it is shown a little smaller."""

SCALE = 1.0

_MOMENTS = 121
"""Moments of a cost curve: one every three pixels."""

RELATIVE = "final distance / median of map and team"


WIDE = 860, 360
"""Of a plot that stands alone, on a screen that is wide enough."""


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
        samples = [_sample(group, relative(group, scales)) for group in groups]
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
