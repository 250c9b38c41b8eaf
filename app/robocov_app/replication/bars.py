"""Intervals as small pictures: where an estimate lies, and the range in which it was wanted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from markupsafe import Markup

from robocov_app.replication.verdicts import amount

if TYPE_CHECKING:
    from robocov_app.replication.verdicts import Criterion

_WIDTH, _HEIGHT = 320.0, 44.0
"""Units of the view box; the page gives it its size."""

_APART = 40.0
"""Nearer than this, the ends of the range have their numbers aside."""

_EDGE, _LINE = 14.0, 17.0
"""Free at both sides, and the height of the line of the interval."""


def interval_bar(criterion: Criterion) -> Markup:
    """Return an SVG element: the wanted range shaded, the interval a line, the estimate a mark.

    Its colours are CSS variables; what it shows is said in words as well.
    """
    interval = criterion.interval
    known = [value for value in (interval.estimate, interval.low, interval.high) if math.isfinite(value)]
    ends = [value for value in (criterion.low, criterion.high) if math.isfinite(value)]
    if not known or not ends:
        return Markup("")
    low, high = min(known + ends), max(known + ends)
    room = 0.18 * (high - low) if high > low else max(0.1 * abs(high), 0.01)
    low, high = low - room, high + room
    if criterion.unit == "%" and min(known + ends) >= 0.0:
        low = max(low, 0.0)

    def at(value: float) -> float:
        part = (min(max(value, low), high) - low) / (high - low)
        return round(_EDGE + part * (_WIDTH - 2 * _EDGE), 1)

    begin, end = at(criterion.low), at(criterion.high)
    parts = [
        f'<rect class="wanted" x="{begin}" y="4" width="{round(end - begin, 1)}" height="26" rx="3"/>',
        f'<path class="axis" d="M{_EDGE} 30H{_WIDTH - _EDGE}"/>',
    ]
    near = len(ends) == 2 and end - begin < _APART
    for value, anchor in zip(ends, ("end", "start"), strict=False):
        parts.append(f'<path class="bound" d="M{at(value)} 4V34"/>')
        aside = f' style="text-anchor: {anchor}"' if near else ""
        parts.append(f'<text x="{at(value)}" y="43"{aside}>{amount(value, criterion.unit)}</text>')
    state = {True: "yes", False: "no", None: "open"}[criterion.met]
    if math.isfinite(interval.low):
        parts.append(f'<path class="interval {state}" d="M{at(interval.low)} {_LINE}H{at(interval.high)}"/>')
    parts.append(f'<circle class="estimate {state}" cx="{at(interval.estimate)}" cy="{_LINE}" r="5.5"/>')
    words = f"{criterion.found}; wanted: {criterion.wanted}"
    return Markup(
        f'<svg class="bar" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{words}">'
        + "".join(parts)
        + "</svg>"
    )
