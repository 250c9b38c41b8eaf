"""Styles of curves: the color, dashes and marker of each controller, the same in every picture."""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme

Shape: TypeAlias = tuple[Any, str]
"""Dashes as in matplotlib's `linestyle`, and the marker at the end."""

_CONTROLLER_SHAPES: dict[str, Shape] = {
    "rapf": ("-", "o"),
    "rpf": ((0, (5, 1.6)), "s"),
    "lloyd": ((0, (1.6, 1.2)), "^"),
}
OTHER_SHAPES: tuple[Shape, ...] = (
    ((0, (6, 1.6, 1.6, 1.6)), "D"),
    ((0, (9, 2.5)), "v"),
    ((0, (3, 1.2, 1.2, 1.2, 1.2, 1.2)), "P"),
    ((0, (2.5, 2.5)), "*"),
    ((0, (9, 1.4, 3, 1.4)), "X"),
)
"""Shapes of other controllers, and of further curves of the same controller with other gains."""
_SHAPES = (*_CONTROLLER_SHAPES.values(), *OTHER_SHAPES)

MARKER_PATHS = {
    "o": "M0-5a5 5 0 1 0 .01 0z",
    "s": "M-4.6-4.6h9.2v9.2h-9.2z",
    "^": "M0-5.6 5.6 4.4H-5.6z",
    "v": "M0 5.6 5.6-4.4H-5.6z",
    "D": "M0-6 6 0 0 6-6 0z",
    "P": "M-2-6h4v4h4v4h-4v4h-4v-4h-4v-4h4z",
    "*": "M0-6.6 1.8-2.1 6.6-1.8 2.9 1.3 4.1 6 0 3.4-4.1 6-2.9 1.3-6.6-1.8-1.8-2.1z",
    "X": "M-5.6-3-3-5.6 0-2.6 3-5.6 5.6-3 2.6 0 5.6 3 3 5.6 0 2.6-3 5.6-5.6 3-2.6 0z",
}
"""Markers as SVG paths around the origin, 10 to 13 units wide."""


class CurveStyle(NamedTuple):
    """Style of a curve.

    Attributes
    ----------
    name : str
        Name of the color: that of a controller with its own color, or ``other-k`` for `Theme.others[k]`.
    dashes : object
        As in matplotlib's `linestyle`.
    mark : str
        Key of `MARKER_PATHS`, as in matplotlib's `marker`.
    """

    name: str
    dashes: Any
    mark: str

    def get_color(self, theme: Theme) -> Color:
        """Return the color of the curve in a theme."""
        kind, _, number = self.name.rpartition("-")
        if kind == "other":
            return theme.others[int(number)]
        return theme.get_controller_color(self.name)

    def list_dash_lengths(self) -> list[float]:
        """Return the alternating lengths of dashes and gaps; an empty list for a solid curve."""
        if self.dashes == "-":
            return []
        _, lengths = self.dashes
        return list(lengths)


def choose_controller_styles(controllers: Iterable[str]) -> dict[str, CurveStyle]:
    """Choose a different style for each controller.

    Parameters
    ----------
    controllers : iterable of str
        Names of controllers.

    Returns
    -------
    dict of str to CurveStyle
    """
    names = list(dict.fromkeys(controllers))
    return dict(zip(names, choose_curve_styles(names), strict=True))


def choose_curve_styles(controllers: Sequence[str]) -> list[CurveStyle]:
    """Choose a style for each curve; curves of one controller differ in color, dashes and marker.

    Parameters
    ----------
    controllers : sequence of str
        Name of the controller of each curve. A name may occur several times, with different gains.

    Returns
    -------
    list of CurveStyle
        The first curve of each controller has the controller's own style; further curves have variants of it.
    """
    first_styles = _choose_first_styles(controllers)
    used = set(first_styles.values())
    seen: set[str] = set()
    styles = []
    for controller in controllers:
        first = first_styles[controller]
        style = first
        if controller in seen:
            style = _choose_variant(first, used)
        seen.add(controller)
        used.add(style)
        styles.append(style)
    return styles


def _choose_first_styles(controllers: Sequence[str]) -> dict[str, CurveStyle]:
    """Return the style of the first curve of each controller."""
    free_styles = _iterate_other_styles()
    styles = {}
    for name in dict.fromkeys(controllers):
        if name in _CONTROLLER_SHAPES:
            styles[name] = CurveStyle(name, *_CONTROLLER_SHAPES[name])
        else:
            styles[name] = next(free_styles)
    return styles


def _iterate_other_styles() -> Iterator[CurveStyle]:
    """Yield 25 different styles in an endless cycle.

    After all colors have been used once, each is combined with the next shape, and so on.
    """
    count = len(OTHER_SHAPES)
    styles = []
    for offset, color in itertools.product(range(count), repeat=2):
        dashes, mark = OTHER_SHAPES[(color + offset) % count]
        styles.append(CurveStyle(f"other-{color}", dashes, mark))
    return itertools.cycle(styles)


def _choose_variant(first: CurveStyle, used: set[CurveStyle]) -> CurveStyle:
    """Choose an unused style for a further curve of a controller; its first style if all are used.

    Styles in other colors come first, then other shapes in the controller's color.
    """
    other_colors = [CurveStyle(f"other-{k}", *shape) for k, shape in enumerate(OTHER_SHAPES)]
    other_shapes = [CurveStyle(first.name, *shape) for shape in _SHAPES]
    free = [style for style in (*other_colors, *other_shapes) if style not in used]
    if not free:
        return first
    return free[0]
