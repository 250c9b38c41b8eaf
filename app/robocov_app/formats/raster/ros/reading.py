"""ROS maps: a YAML file and a picture, as written by map_server and nav2.

In the modes scale and raw, cells with an occupancy of 50% or more are obstacles; the option ``threshold``
changes this limit. Single blocked cells in the free space are dropped as noise unless `Shaping.specks` is
given.
"""

import math
from pathlib import Path

import numpy as np

from robocov.errors import MapError, to_one_line
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.cells.grid_map import FREE, GridFrame, build_grid_map
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.raster.picture import Brightness, describe_transparency, read_picture
from robocov_app.formats.raster.ros.classification import classify
from robocov_app.formats.raster.ros.metadata import (
    DEFAULT_THRESHOLDS,
    UNKNOWN_LEVEL,
    Metadata,
    parse_metadata,
)

_NOISE_CELLS = 1.5
"""Obstacles of fewer cells are sensor noise of the robots that made the map."""


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return path.suffix.lower() in (".yaml", ".yml") and b"image" in head and b"resolution" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a map and its picture.

    Raises
    ------
    MapError
        If a key is missing or invalid, the picture cannot be read, or no cell is free.
    ParameterError
        If the option ``threshold`` is given for a map of mode trinary.
    """
    source_name = to_one_line(path)
    document = files.parse_yaml(files.read_content(path, files.MAX_YAML_BYTES), source_name)
    metadata = parse_metadata(document, source_name)
    repaired: list[str] = []
    image = files.find_named_file(
        path,
        metadata.image,
        "image",
        location=f"{source_name}: image",
        notes=repaired,
        allow_anywhere=options.anywhere,
    )
    picture = read_picture(image, to_one_line(image))
    cells = classify(picture, metadata, options, source_name)
    transparency = _describe_transparency(picture, metadata.mode)
    if transparency and options.unknown != "free" and not (cells == FREE).any():
        raise MapError(f"{source_name}: no cell is free: {transparency}")
    if metadata.mode != "raw":
        repaired += _describe_missing_thresholds(metadata)
    yaw = math.remainder(metadata.yaw, 2 * math.pi)
    notes = [f"{key}: unknown key, ignored" for key in metadata.unknown_keys]
    if metadata.mode == "trinary":
        notes += _describe_doubtful_cells(picture, metadata)
    if transparency:
        notes.append(transparency)
    notes += _describe_yaw(metadata.yaw, yaw)
    return build_grid_map(
        cells,
        GridFrame(metadata.resolution, metadata.origin, yaw),
        source_name,
        name=path.stem,
        description=f"A ROS map of {metadata.resolution:g} m a cell, imported.",
        unknown=options.unknown or "obstacle",
        noise_cells=_NOISE_CELLS,
        repaired=tuple(repaired),
        notes=tuple(notes),
    )


def _describe_missing_thresholds(metadata: Metadata) -> list[str]:
    return [f"{key} is missing, {DEFAULT_THRESHOLDS[key]:g} used" for key in metadata.missing_thresholds]


def _describe_transparency(picture: Brightness, mode: str) -> str:
    """Return a note on transparent pixels; empty if there are none, or if they are unknown cells."""
    description = describe_transparency(picture)
    if not description or mode == "scale":
        return ""
    if mode == "raw":
        return description
    share, _, _ = description.partition(";")
    return f"{share}, which map_server averages in as if it were a dark color"


def _describe_yaw(yaw_in_file: float, yaw: float) -> list[str]:
    """Return a note if the map is rotated; `yaw` is that in the file reduced to half a turn, rad."""
    if yaw == 0.0:
        return []
    note = f"origin: rotated by {math.degrees(yaw):.4g} degrees about the lower left corner"
    if abs(yaw_in_file) > 2 * math.pi:
        radians = math.radians(yaw_in_file)
        note += f", as its yaw is {yaw_in_file:g} rad; if it was meant in degrees, write {radians:.6g}"
    return [note]


def _describe_doubtful_cells(picture: Brightness, metadata: Metadata) -> list[str]:
    """Return a note if the thresholds make cells free that were probably saved as unknown."""
    count = int(np.count_nonzero(picture.level == UNKNOWN_LEVEL))
    is_plain = not metadata.negate and picture.max_level == 255 and picture.alpha is None
    is_unknown_free = metadata.free > 1 - UNKNOWN_LEVEL / 255
    if not is_plain or not is_unknown_free or count < picture.level.size / 100:
        return []
    cells = f"{count} cells have the value {UNKNOWN_LEVEL}, which is saved for unknown cells"
    return [f"{cells}, and are free according to free_thresh {metadata.free:g}"]
