"""Curve styles of controllers: colors, dashes and marks, the same in every picture."""

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias

from robocov_app.render.theme import Color, Theme

Look: TypeAlias = tuple[Any, str]  # dashes and end mark

# of the paper's controllers
_KNOWN: dict[str, Look] = {"rapf": ("-", "o"), "rpf": ((0, (5, 1.6)), "s"), "lloyd": ((0, (1.6, 1.2)), "^")}
# those of controllers that have none of their own, and of one controller's second, third, ... gains.
VARIANTS: tuple[Look, ...] = (
    ((0, (6, 1.6, 1.6, 1.6)), "D"),
    ((0, (9, 2.5)), "v"),
    ((0, (3, 1.2, 1.2, 1.2, 1.2, 1.2)), "P"),
    ((0, (2.5, 2.5)), "*"),
    ((0, (9, 1.4, 3, 1.4)), "X"),
)
_LOOKS = (*_KNOWN.values(), *VARIANTS)

# the marks as SVG paths round the origin, 10 to 13 across
MARKS = {
    "o": "M0-5a5 5 0 1 0 .01 0z",
    "s": "M-4.6-4.6h9.2v9.2h-9.2z",
    "^": "M0-5.6 5.6 4.4H-5.6z",
    "v": "M0 5.6 5.6-4.4H-5.6z",
    "D": "M0-6 6 0 0 6-6 0z",
    "P": "M-2-6h4v4h4v4h-4v4h-4v-4h-4v-4h4z",
    "*": "M0-6.6 1.8-2.1 6.6-1.8 2.9 1.3 4.1 6 0 3.4-4.1 6-2.9 1.3-6.6-1.8-1.8-2.1z",
    "X": "M-5.6-3-3-5.6 0-2.6 3-5.6 5.6-3 2.6 0 5.6 3 3 5.6 0 2.6-3 5.6-5.6 3-2.6 0z",
}


class CurveStyle(NamedTuple):
    """Color, dashes and mark; `name` is a controller's own color, or ``other-k`` of `Theme.others`."""

    name: str
    dashes: Any
    mark: str

    def color(self, theme: Theme) -> Color:
        kind, _, number = self.name.rpartition("-")
        return theme.others[int(number)] if kind == "other" else theme.controller(self.name)


def curve_styles(controllers: Iterable[str]) -> dict[str, CurveStyle]:
    """Return a style for each controller; those that have none of their own get the others' in turn."""
    names = list(dict.fromkeys(controllers))
    return dict(zip(names, styles_of(names), strict=True))


def styles_of(controllers: Sequence[str]) -> list[CurveStyle]:
    """Return a style for each curve: another color, dashes and mark for each of a controller's variants."""
    count = len(VARIANTS)
    # after all colors once more with the next look each: 25 that differ
    turns = itertools.product(range(count), repeat=2)
    free = itertools.cycle(CurveStyle(f"other-{k}", *VARIANTS[(k + turn) % count]) for turn, k in turns)
    spare = [CurveStyle(f"other-{k}", *look) for k, look in enumerate(VARIANTS)]
    names = dict.fromkeys(controllers)
    first = {name: CurveStyle(name, *_KNOWN[name]) if name in _KNOWN else next(free) for name in names}
    left, used = dict(first), set(first.values())
    styles = []
    for name in controllers:
        style = left.pop(name, None)
        if style is None:
            own = [first[name]._replace(dashes=dashes, mark=mark) for dashes, mark in _LOOKS]
            style = next((each for each in (*spare, *own) if each not in used), first[name])
            used.add(style)
        styles.append(style)
    return styles
