"""Colors of distances to the nearest robot: the scale, its ticks and its palette."""

import numpy as np
from numpy.typing import NDArray

from robocov.typing import FloatArray
from robocov_app.look.theme import Theme
from robocov_app.render.distance_map.pixel_distances import BorderPixels, DistanceField

MAX_LEVEL = 253
"""Index in the palette of distances at the end of the scale and beyond."""
_UNREACHED_LEVEL = MAX_LEVEL + 1
_HATCH_LEVEL = MAX_LEVEL + 2
_LIMIT_FACTORS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
_TICK_FACTORS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
_MAX_TICK_INTERVALS = 5
_TOLERANCE = 1e-9
_HATCH_SPACING_WIDTHS = 9
"""Distance between the lines of the hatching, in widths of a line."""


def choose_color_limit(distance: float) -> float:
    """Choose the end of a color scale.

    Parameters
    ----------
    distance : float, m
        Maximum distance to show.

    Returns
    -------
    float, m
        The next round length from `distance` upwards; 1 m if the distance is not positive and finite.

    Examples
    --------
    >>> [choose_color_limit(distance) for distance in (0.93, 4.2, 13.0)]
    [1.0, 5.0, 15.0]
    """
    if not np.isfinite(distance) or distance <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(distance))
    min_limit = distance * (1.0 - _TOLERANCE)
    limit = min(factor * power for factor in _LIMIT_FACTORS if factor * power >= min_limit)
    # Formatting removes the rounding error of the multiplication.
    return float(f"{limit:.12g}")


def list_color_ticks(limit: float) -> list[float]:
    """List the ticks of a color scale.

    Parameters
    ----------
    limit : float, m
        End of the scale, from `choose_color_limit`.

    Returns
    -------
    list of float, m
        Equally spaced round lengths from 0 to the limit.

    Examples
    --------
    >>> list_color_ticks(8.0)
    [0.0, 2.0, 4.0, 6.0, 8.0]
    """
    power = 10.0 ** np.floor(np.log10(limit))
    step = power
    count = 1
    for factor in _TICK_FACTORS:
        step = factor * power
        intervals = limit / step
        count = round(intervals)
        is_whole = abs(intervals - count) < _TOLERANCE
        if is_whole and intervals <= _MAX_TICK_INTERVALS + _TOLERANCE:
            break
    return [float(f"{k * step:.12g}") for k in range(count + 1)]


def build_palette(theme: Theme) -> NDArray[np.uint8]:
    """Build the palette of the distance map, for the indices of `compute_color_levels`.

    Parameters
    ----------
    theme : Theme

    Returns
    -------
    (256, 3) array of uint8
        RGB values: 254 from the nearest to the farthest distance, then the background and the hatching of
        points that no robot can reach.
    """
    unreached = np.array([theme.unreached, theme.obstacle_edge], dtype=np.uint8)
    return np.concatenate([theme.build_heat_table(MAX_LEVEL + 1), unreached])


def compute_color_levels(
    field: DistanceField, x: FloatArray, y: FloatArray, limit: float, hatch_px: int
) -> NDArray[np.uint8]:
    """Compute the palette indices of a grid of points by their distance to the nearest robot.

    Parameters
    ----------
    field : DistanceField
    x : (w,) array, m
    y : (h,) array, m
    limit : float, m
        End of the color scale.
    hatch_px : int
        Distance between the lines that hatch points that no robot can reach, in points of the grid.

    Returns
    -------
    (h, w) array of uint8
        Indices into the palette of `build_palette`.
    """
    distances = field.compute_distances(x, y)
    is_reached = np.isfinite(distances)
    np.multiply(distances, MAX_LEVEL / limit, out=distances)
    np.minimum(distances, MAX_LEVEL, out=distances)
    levels = distances.astype(np.uint8)
    if not is_reached.all():
        rows, columns = np.indices(is_reached.shape)
        line_width = max(hatch_px // _HATCH_SPACING_WIDTHS, 1)
        is_on_line = (rows + columns) % hatch_px < line_width
        hatching = np.where(is_on_line, _HATCH_LEVEL, _UNREACHED_LEVEL)
        levels[~is_reached] = hatching[~is_reached]
    return levels


def compute_line_opacities(borders: BorderPixels, zoom: float, width: float) -> FloatArray:
    """Compute the fraction of each pixel that a line along borders covers.

    Parameters
    ----------
    borders : BorderPixels
    zoom : float, px/m
    width : float, px

    Returns
    -------
    (k,) array
        From 0 to 1.
    """
    return np.asarray(np.clip(0.5 * width + 0.5 - borders.distances * zoom, 0.0, 1.0))
