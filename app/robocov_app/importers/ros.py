"""Maps of ROS: the YAML of map_server and the picture that it names.

How a pixel is read is as of http://wiki.ros.org/map_server and of ROS 2's nav2_map_server: with p the
darkness of the pixel from 0 to 1 (its brightness where `negate` is set), a cell of mode

- trinary is occupied where p > occupied_thresh, free where p < free_thresh, else unknown; where the picture
  has an alpha channel, that is averaged in like a colour;
- scale is unknown where it is not opaque; between the thresholds its occupancy rises from 0 to 100 %;
- raw has the pixel's value as its occupancy in %, and is unknown where that exceeds 100; `negate` and the
  thresholds do not count.

An occupancy of 50 % and more, or what the option ``threshold`` says, is taken as an obstacle. Single cells
in the free space are taken as noise, and dropped, unless the size of specks says otherwise.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import MapError, ParameterError, one_line, shown
from robocov_app.importers import limits, plain_yaml
from robocov_app.importers.images import Brightness, read_picture
from robocov_app.importers.named_files import named_file
from robocov_app.importers.raster import BLOCKED, FREE, UNKNOWN, Cells, foreign_map
from robocov_app.importers.reading import Importer, ReadOptions

if TYPE_CHECKING:
    from robocov_app.importers.foreign import ForeignMap

_OCCUPIED, _FREE = 0.65, 0.196
"""Thresholds of a file that gives none, as map_server writes them."""

_KNOWN = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")

_NOISE = 1.5
"""In maps that robots made single cells are noise."""

_SAVED_UNKNOWN = 205
"""What savers write for unknown cells, of 255."""


def _sniff(path: Path, head: bytes) -> bool:
    return path.suffix.lower() in (".yaml", ".yml") and b"image" in head and b"resolution" in head


def _read(path: Path, options: ReadOptions) -> ForeignMap:
    where = one_line(path)
    text = limits.content(path, plain_yaml.MAX_BYTES)
    given = plain_yaml.parse(text, where)
    mode = _text(given, "mode", where, "trinary").lower()
    if mode not in ("trinary", "scale", "raw"):
        raise MapError(f"{where}: mode: {shown(mode)}, but one of trinary, scale, raw was wanted")
    cell = _number(given, "resolution", where)
    limits.require_length(cell, f"{where}: resolution", smallest=1e-4, largest=1000.0)
    origin = _origin(given, where)
    negate = _truth(given, where)
    occupied = _number(given, "occupied_thresh", where, _OCCUPIED)
    free = _number(given, "free_thresh", where, _FREE)
    if not 0.0 <= free <= occupied <= 1.0:
        raise MapError(
            f"{where}: free_thresh, occupied_thresh: {free:g}, {occupied:g}, "
            f"but numbers from 0 to 1 were wanted, the first not the larger"
        )
    name = _text(given, "image", where)
    image, moved = named_file(
        path, name, anywhere=bool(options.anywhere), at=f"{where}: image", what="picture"
    )
    picture = read_picture(image, one_line(image))
    threshold = 0.5 if options.threshold is None else options.threshold
    notes = [f"{one_line(key)}: no key of map_server, not looked at" for key in given if key not in _KNOWN]
    if mode == "trinary":
        if options.threshold is not None:
            raise ParameterError(f"--threshold: of no use here: {where} is of mode trinary")
        cells = _trinary(picture, negate, free, occupied)
        notes += _doubted(picture, negate, free)
    elif mode == "scale":
        cells = _scale(picture, negate, free, occupied, threshold)
    else:
        cells = _raw(picture, threshold)
    repaired = [] if moved is None else [moved]
    missing = [key for key in ("occupied_thresh", "free_thresh") if key not in given and mode != "raw"]
    return foreign_map(
        cells,
        name=path.stem,
        description=f"A ROS map of {cell:g} m a cell, imported.",
        format="ros",
        cell=cell,
        origin=origin[:2],
        yaw=origin[2],
        unknown=options.unknown or "obstacle",
        noise=_NOISE,
        where=where,
        repaired=(
            *repaired,
            *(f"{key} is missing, {_OCCUPIED if key[0] == 'o' else _FREE:g} taken" for key in missing),
        ),
        notes=tuple(notes),
    )


def _trinary(picture: Brightness, negate: bool, free: float, occupied: float) -> Cells:
    level, full = picture.level, picture.full
    if picture.alpha is not None:
        # of a grey picture every colour is the level
        colours = np.uint16(3) if full == 255 else np.uint16(1)
        level, full = level * colours + picture.alpha.astype(np.uint16), 1020
    shade = np.arange(full + 1) / full
    dark = shade if negate else 1.0 - shade
    table = np.full(full + 1, UNKNOWN, np.uint8)
    table[dark < free] = FREE
    table[dark > occupied] = BLOCKED
    return table[level]


def _scale(picture: Brightness, negate: bool, free: float, occupied: float, threshold: float) -> Cells:
    shade = np.arange(picture.full + 1) / picture.full
    dark = shade if negate else 1.0 - shade
    occupancy = np.rint((dark - free) / max(occupied - free, 1e-9) * 100.0)
    occupancy[dark < free] = 0.0
    occupancy[dark > occupied] = 100.0
    table = np.where(occupancy >= max(100.0 * threshold, 1.0), BLOCKED, FREE).astype(np.uint8)
    cells = table[picture.level]
    if picture.alpha is not None:
        cells[picture.alpha < 255] = UNKNOWN
    return cells


def _raw(picture: Brightness, threshold: float) -> Cells:
    occupancy = np.rint(np.arange(picture.full + 1) / picture.full * 255.0)
    table = np.where(occupancy >= max(100.0 * threshold, 1.0), BLOCKED, FREE).astype(np.uint8)
    table[occupancy > 100.0] = UNKNOWN
    return table[picture.level]


def _doubted(picture: Brightness, negate: bool, free: float) -> list[str]:
    """Return a word where cells that were saved as unknown count as free by the thresholds."""
    if negate or picture.full != 255 or picture.alpha is not None or free <= 1 - _SAVED_UNKNOWN / 255:
        return []
    doubtful = int(np.count_nonzero(picture.level == _SAVED_UNKNOWN))
    if doubtful < picture.level.size / 100:
        return []
    return [
        f"{doubtful} cells have the value {_SAVED_UNKNOWN}, which is saved for unknown cells, "
        f"and are free by free_thresh {free:g}"
    ]


def _origin(given: dict[str, plain_yaml.Value], where: str) -> tuple[float, float, float]:
    """Return x, y (m) and yaw (rad) of the lower left corner."""
    values = given.get("origin", ["0", "0", "0"])
    if not isinstance(values, list) or not 2 <= len(values) <= 3:
        raise MapError(f"{where}: origin: {shown(values)}, but [x, y, yaw] was wanted")
    x, y, yaw = (_parsed(value, f"{where}: origin[{k}]") for k, value in enumerate([*values, "0"][:3]))
    limits.require_coordinate(x, f"{where}: origin[0]")
    limits.require_coordinate(y, f"{where}: origin[1]")
    return x, y, math.remainder(yaw, 2 * math.pi)


def _truth(given: dict[str, plain_yaml.Value], where: str) -> bool:
    text = _text(given, "negate", where, "0").lower()
    if text not in ("0", "1", "false", "true", "no", "yes", "off", "on"):
        raise MapError(f"{where}: negate: {shown(text)}, but 0 or 1 was wanted")
    return text in ("1", "true", "yes", "on")


def _text(given: dict[str, plain_yaml.Value], key: str, where: str, default: str | None = None) -> str:
    value = given.get(key, default)
    if key not in given and default is None:
        raise MapError(f"{where}: {key}: missing, but it was wanted")
    if not isinstance(value, str):
        raise MapError(f"{where}: {key}: {shown(value)}, but one value was wanted")
    return value


def _number(given: dict[str, plain_yaml.Value], key: str, where: str, default: float | None = None) -> float:
    if key not in given and default is not None:
        return default
    return _parsed(_text(given, key, where), f"{where}: {key}")


def _parsed(text: plain_yaml.Value, where: str) -> float:
    try:
        value = float(text) if isinstance(text, str) else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MapError(f"{where}: {shown(text)}, but a number was wanted")
    return value


IMPORTER = Importer(
    name="ros",
    title="ROS map_server: YAML with a PGM or PNG",
    suffixes=(".yaml", ".yml"),
    sniff=_sniff,
    read=_read,
    options=frozenset({"unknown", "threshold", "anywhere"}),
)
