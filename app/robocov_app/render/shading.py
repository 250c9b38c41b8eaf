"""Fields as pictures: colours for distances, lines where the nearest robot changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from robocov.arrays import Array
    from robocov_app.render.field import Borders, Field
    from robocov_app.render.theme import Theme

_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)

FARTHEST = 253
"""Number of the colour at the limit of the scale and beyond."""


def round_limit(distance: float) -> float:
    """Return a round length not below a distance, m, to which a scale of colours may reach.

    >>> [round_limit(x) for x in (0.93, 1.0, 4.2, 13.0, float("nan"))]
    [1.0, 1.0, 5.0, 15.0, 1.0]
    """
    if not np.isfinite(distance) or distance <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(distance))
    return next(float(f"{step * power:.12g}") for step in _STEPS if step * power >= distance * (1.0 - 1e-9))


def ticks(limit: float, most: int = 5) -> list[float]:
    """Return round lengths from zero to a limit, m, for a scale of colours.

    >>> ticks(5.0), ticks(1.5), ticks(8.0)
    ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [0.0, 0.5, 1.0, 1.5], [0.0, 2.0, 4.0, 6.0, 8.0])
    """
    power = 10.0 ** np.floor(np.log10(limit))
    for step in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0):
        count = limit / (step * power)
        if count <= most + 1e-9 and abs(count - round(count)) < 1e-9:
            break
    return [float(f"{k * step * power:.12g}") for k in range(round(count) + 1)]


def palette(theme: Theme) -> NDArray[np.uint8]:
    """Return the colours of `levels`, (256, 3): from near to far, then of where no robot can come."""
    return np.concatenate([theme.heat_table(FARTHEST + 1), [theme.unreached, theme.obstacle_edge]]).astype(
        np.uint8
    )


def levels(field: Field, x: Array, y: Array, limit: float, hatch: int) -> NDArray[np.uint8]:
    """Return distances as a picture of numbers of colours in the `palette`.

    Parameters
    ----------
    field : Field
    x, y : (w,) and (h,) m
        Of the pixels' middles.
    limit : float, m
        From here on all is of the farthest colour.
    hatch : int
        Pixels from one slanted line to the next, where no robot can come.

    Returns
    -------
    (h, w)
    """
    distance = field.distances(x, y)
    reached = np.isfinite(distance)
    np.multiply(distance, FARTHEST / limit, out=distance)
    np.minimum(distance, FARTHEST, out=distance)
    level = distance.astype(np.uint8)
    if not reached.all():
        row, column = np.indices(reached.shape)
        line = np.asarray((row + column) % hatch < max(hatch // 9, 1))
        level[~reached] = FARTHEST + 1 + line[~reached]
    return level


def strength(borders: Borders, zoom: float, width: float) -> Array:
    """Return how much of each pixel a smooth line along the borders covers, 0 to 1.

    Parameters
    ----------
    borders : Borders
        At the middles of pixels.
    zoom : float, px/m
    width : float, px
    """
    return np.asarray(np.clip(0.5 * width + 0.5 - borders.gap * zoom, 0.0, 1.0))
