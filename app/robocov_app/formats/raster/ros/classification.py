"""Cells of a ROS map from the pixels of its picture.

The rules are those of http://wiki.ros.org/map_server and of nav2_map_server in ROS 2. Let p be the darkness
of a pixel from 0 to 1, or its brightness if `negate` is set. In the mode

- trinary, a cell is occupied if p > occupied_thresh, free if p < free_thresh, and unknown otherwise; an alpha
  channel is included in the average like a color;
- scale, a cell is unknown if it is not opaque; between the thresholds, its occupancy rises from 0 to 100%;
- raw, the value of the pixel is the occupancy of the cell in %, and the cell is unknown if the value exceeds
  100; `negate` and the thresholds are ignored.
"""

import numpy as np

from robocov.errors import ParameterError
from robocov.typing import FloatArray
from robocov_app.formats.geometry.cells.grid_map import BLOCKED, FREE, UNKNOWN, Cells
from robocov_app.formats.options import ReadOptions, get_or_default
from robocov_app.formats.raster.picture import Brightness
from robocov_app.formats.raster.ros.metadata import Metadata

_DEFAULT_OCCUPANCY = 0.5
"""Occupancy, from 0 to 1, at which a cell becomes an obstacle in the modes scale and raw."""


def classify(picture: Brightness, metadata: Metadata, options: ReadOptions, source_name: str) -> Cells:
    """Classify the pixels of a picture as cells, according to the mode of its map.

    Parameters
    ----------
    picture : Brightness
    metadata : Metadata
    options : ReadOptions
    source_name : str
        The file, for messages.

    Returns
    -------
    (rows, columns) array of uint8

    Raises
    ------
    ParameterError
        If the option ``threshold`` is given for the mode trinary, which has its own two thresholds.
    """
    threshold = get_or_default(options.threshold, _DEFAULT_OCCUPANCY)
    if metadata.mode == "raw":
        return classify_raw(picture, threshold)
    if metadata.mode == "scale":
        return classify_scale(
            picture,
            negate=metadata.negate,
            free=metadata.free,
            occupied=metadata.occupied,
            threshold=threshold,
        )
    if options.threshold is not None:
        raise ParameterError(f"--threshold: not applicable: {source_name} is of mode trinary")
    return classify_trinary(picture, negate=metadata.negate, free=metadata.free, occupied=metadata.occupied)


def classify_trinary(picture: Brightness, *, negate: bool, free: float, occupied: float) -> Cells:
    """Classify the pixels of a picture of mode trinary.

    Parameters
    ----------
    picture : Brightness
    negate : bool
        Whether light pixels are occupied, not dark ones.
    free, occupied : float
        Thresholds of darkness, from 0 to 1.

    Returns
    -------
    (rows, columns) array of uint8
    """
    level = picture.level
    max_level = picture.max_level
    if picture.alpha is not None:
        # The sum of red, green, blue and alpha, each from 0 to 255; in a gray picture the colors are equal.
        color_sums = np.rint(np.arange(max_level + 1) * (3 * 255 / max_level)).astype(np.uint16)
        level = color_sums[level] + picture.alpha.astype(np.uint16)
        max_level = 4 * 255
    darkness = _compute_darkness(max_level, negate=negate)
    table = np.full(max_level + 1, UNKNOWN, np.uint8)
    table[darkness < free] = FREE
    table[darkness > occupied] = BLOCKED
    return table[level]


def classify_scale(
    picture: Brightness, *, negate: bool, free: float, occupied: float, threshold: float
) -> Cells:
    """Classify the pixels of a picture of mode scale.

    Parameters
    ----------
    picture, negate, free, occupied
        See `classify_trinary`.
    threshold : float
        Occupancy, from 0 to 1, at which a cell becomes an obstacle.

    Returns
    -------
    (rows, columns) array of uint8
    """
    darkness = _compute_darkness(picture.max_level, negate=negate)
    occupancy = np.rint((darkness - free) / max(occupied - free, 1e-9) * 100.0)
    occupancy[darkness < free] = 0.0
    occupancy[darkness > occupied] = 100.0
    cells = _find_blocked_cells(occupancy, threshold)[picture.level]
    if picture.alpha is not None:
        cells[picture.alpha < 255] = UNKNOWN
    return cells


def classify_raw(picture: Brightness, threshold: float) -> Cells:
    """Classify the pixels of a picture of mode raw, whose values are the occupancy in percent."""
    occupancy = np.rint(_compute_darkness(picture.max_level, negate=True) * 255.0)
    table = _find_blocked_cells(occupancy, threshold)
    table[occupancy > 100.0] = UNKNOWN
    return table[picture.level]


def _compute_darkness(max_level: int, *, negate: bool) -> FloatArray:
    """Return the darkness, from 0 to 1, of each level from 0 to `max_level`."""
    shade = np.arange(max_level + 1) / max_level
    return shade if negate else 1.0 - shade


def _find_blocked_cells(occupancy: FloatArray, threshold: float) -> Cells:
    """Return `BLOCKED` or `FREE` for each occupancy in percent; an occupancy of 0% is always free."""
    return np.where(occupancy >= max(100.0 * threshold, 1.0), BLOCKED, FREE).astype(np.uint8)
