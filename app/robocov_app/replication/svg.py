"""Small pictures of numbers in the page, as SVG: intervals of claims, and medians map by map.

Their colours are CSS variables; what they show is said in words as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

from markupsafe import Markup

from robocov_app.replication.verdicts import Criterion, amount

_TICKS = (0.0, 0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)  # of the axis of gaps


def interval_bar(criterion: Criterion) -> Markup:
    """Return an SVG element: the wanted range shaded, the interval a line, the estimate a mark."""
    interval, wide, edge = criterion.interval, 320.0, 14.0
    known = [value for value in (interval.estimate, interval.low, interval.high) if math.isfinite(value)]
    ends = [value for value in (criterion.low, criterion.high) if math.isfinite(value)]
    if not known or not ends:
        return Markup("")
    low, high = min(known + ends), max(known + ends)
    least = 0.0 if criterion.unit == "%" and low >= 0.0 else -math.inf
    room = 0.18 * (high - low) if high > low else max(0.1 * abs(high), 0.01)
    low, high = max(low - room, least), high + room

    def at(value: float) -> float:
        part = (min(max(value, low), high) - low) / (high - low)
        return round(edge + part * (wide - 2 * edge), 1)

    begin, end = at(criterion.low), at(criterion.high)
    parts = [
        f'<rect class="wanted" x="{begin}" y="4" width="{round(end - begin, 1)}" height="26" rx="3"/>',
        f'<path class="axis" d="M{edge} 30H{wide - edge}"/>',
    ]
    near = len(ends) == 2 and end - begin < 40.0  # their numbers then stand aside
    for value, anchor in zip(ends, ("end", "start"), strict=False):
        parts.append(f'<path class="bound" d="M{at(value)} 4V34"/>')
        aside = f' style="text-anchor: {anchor}"' if near else ""
        parts.append(f'<text x="{at(value)}" y="43"{aside}>{amount(value, criterion.unit)}</text>')
    state = {True: "yes", False: "no", None: "open"}[criterion.met]
    if math.isfinite(interval.low):
        parts.append(f'<path class="interval {state}" d="M{at(interval.low)} 17.0H{at(interval.high)}"/>')
    parts.append(f'<circle class="estimate {state}" cx="{at(interval.estimate)}" cy="17.0" r="5.5"/>')
    return _svg("bar", wide, 44.0, f"{criterion.found}; wanted: {criterion.wanted}", parts)


class Strip(NamedTuple):
    """A row of dots: the median gap on each map; `ours` stands out."""

    label: str
    ours: bool
    maps: Mapping[str, float]


def strips(rows: Sequence[Strip], highest: float) -> Markup:
    """Return an SVG element: a dot for each map that says which it is, on an axis of square roots.

    `highest` is the largest gap of all pictures that are to be compared.
    """
    rows = [row for row in rows if row.maps]
    if not rows:
        return Markup("")
    wide, left, right, tall, name_height = 440.0, 12.0, 16.0, 40.0, 13.0
    highest, lowest = max(highest, 0.01), min(0.0, *(min(row.maps.values()) for row in rows))
    begin, end = _root(lowest), _root(highest)

    def at(value: float) -> float:
        part = (_root(value) - begin) / (end - begin)
        return round(left + min(max(part, 0.0), 1.0) * (wide - left - right), 1)

    bottom = tall * len(rows) + 22.0
    parts, words = [], []
    last = -math.inf
    for tick in _TICKS:
        x = at(tick)
        if tick <= highest and x - last >= 36.0:
            last = x
            parts.append(f'<path class="grid" d="M{x} 0V{tall * len(rows)}"/>')
            parts.append(f'<text class="tick" x="{x}" y="{bottom - 6}">{amount(tick, "%")}</text>')
    for number, row in enumerate(rows):
        top, kind, label = tall * number, "ours" if row.ours else "other", escape(row.label)
        parts.append(f'<text class="name" x="{left - 4}" y="{top + name_height - 2}">{label}</text>')
        middle = top + name_height + (tall - name_height) / 2
        ranked = sorted(row.maps.items(), key=lambda item: item[1])
        for k, (name, value) in enumerate(ranked):
            y = round(middle + 7.0 * ((k * 5 % 8) / 7.0 - 0.5) * 2.0, 1)
            title = f"<title>{escape(name)}: {amount(value, '%')}</title>"
            parts.append(f'<circle class="{kind}" cx="{at(value)}" cy="{y}" r="3">{title}</circle>')
        half = ranked[(len(ranked) - 1) // 2][1] / 2 + ranked[len(ranked) // 2][1] / 2
        parts.append(f'<path class="middle" d="M{at(half)} {middle - 11}V{middle + 11}"/>')
        words.append(f"{label}: {amount(ranked[0][1], '%')} to {amount(ranked[-1][1], '%')}")
    most = max(len(row.maps) for row in rows)
    return _svg("strips", wide, bottom, f"Median gap on each of {most} maps. {'; '.join(words)}", parts)


def _svg(kind: str, wide: float, tall: float, words: str, parts: Sequence[str]) -> Markup:
    head = f'<svg class="{kind}" viewBox="0 0 {wide:g} {tall:g}" role="img" aria-label="{words}">'
    return Markup(f"{head}{''.join(parts)}</svg>")


def _root(value: float) -> float:
    """Return the square root, with the sign of the value."""
    return math.copysign(math.sqrt(abs(value)), value)
