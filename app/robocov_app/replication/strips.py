"""Medians map by map as small pictures: one dot a map, on one axis for all controllers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

from markupsafe import Markup

from robocov_app.replication.verdicts import amount

_WIDTH, _LEFT, _RIGHT = 440.0, 12.0, 16.0
"""Units of the view box; the page gives it its size."""

_ROW, _NAME, _AXIS = 40.0, 13.0, 22.0
"""Heights of a row, of its name in it, and of the axis."""

_TICKS = (0.0, 0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)

_APART = 36.0
"""Least distance of two ticks."""


class Strip(NamedTuple):
    """One row.

    Attributes
    ----------
    label : str
    ours : bool
        Whether it stands out.
    maps : dict of map to float
        Median gap.
    """

    label: str
    ours: bool
    maps: Mapping[str, float]


def strips(rows: Sequence[Strip], highest: float) -> Markup:
    """Return an SVG element: a dot for each map, on an axis of square roots up to `highest`.

    Its colours are CSS variables; every dot says which map it is.

    Parameters
    ----------
    rows : sequence of Strip
    highest : float
        The largest gap of all pictures that are to be compared.
    """
    rows = [row for row in rows if row.maps]
    if not rows:
        return Markup("")
    lowest = min(0.0, *(min(row.maps.values()) for row in rows))
    ends = _root(lowest), _root(max(highest, 0.01))

    def at(value: float) -> float:
        part = (_root(value) - ends[0]) / (ends[1] - ends[0])
        return round(_LEFT + min(max(part, 0.0), 1.0) * (_WIDTH - _LEFT - _RIGHT), 1)

    tall = _ROW * len(rows) + _AXIS
    parts = []
    last = -math.inf
    for tick in _TICKS:
        x = at(tick)
        if tick <= max(highest, 0.01) and x - last >= _APART:
            last = x
            parts.append(f'<path class="grid" d="M{x} 0V{_ROW * len(rows)}"/>')
            parts.append(f'<text class="tick" x="{x}" y="{tall - 6}">{amount(tick, "%")}</text>')
    for number, row in enumerate(rows):
        top = _ROW * number
        kind = "ours" if row.ours else "other"
        parts.append(f'<text class="name" x="{_LEFT - 4}" y="{top + _NAME - 2}">{escape(row.label)}</text>')
        middle = top + _NAME + (_ROW - _NAME) / 2
        ranked = sorted(row.maps.items(), key=lambda item: item[1])
        for k, (name, value) in enumerate(ranked):
            y = round(middle + 7.0 * ((k * 5 % 8) / 7.0 - 0.5) * 2.0, 1)
            parts.append(
                f'<circle class="{kind}" cx="{at(value)}" cy="{y}" r="3">'
                f"<title>{escape(name)}: {amount(value, '%')}</title></circle>"
            )
        half = ranked[(len(ranked) - 1) // 2][1] / 2 + ranked[len(ranked) // 2][1] / 2
        parts.append(f'<path class="middle" d="M{at(half)} {middle - 11}V{middle + 11}"/>')
    words = "; ".join(
        f"{row.label}: {amount(min(row.maps.values()), '%')} to {amount(max(row.maps.values()), '%')}"
        for row in rows
    )
    return Markup(
        f'<svg class="strips" viewBox="0 0 {_WIDTH:g} {tall:g}" role="img" '
        f'aria-label="Median gap on each of {max(len(row.maps) for row in rows)} maps. {escape(words)}">'
        + "".join(parts)
        + "</svg>"
    )


def _root(value: float) -> float:
    """Return the square root, with the sign of the value."""
    return math.copysign(math.sqrt(abs(value)), value)
