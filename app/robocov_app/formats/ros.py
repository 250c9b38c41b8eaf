"""ROS maps: YAML and an image, as map_server and nav2 read and write them.

How a pixel is read is as of http://wiki.ros.org/map_server and of ROS 2's nav2_map_server: with p the
darkness of the pixel from 0 to 1 (its brightness where `negate` is set), a cell of mode

- trinary is occupied where p > occupied_thresh, free where p < free_thresh, else unknown; where the picture
  has an alpha channel, that is averaged in like a colour;
- scale is unknown where it is not opaque; between the thresholds its occupancy rises from 0 to 100 %;
- raw has the pixel's value as its occupancy in %, and is unknown where that exceeds 100; `negate` and the
  thresholds do not count.

An occupancy of 50 % and more, or what the option ``threshold`` says, is taken as an obstacle. Single cells
in the free space are taken as noise, and dropped, unless the size of specks says otherwise.

What is outside of the boundary is unknown, but for the cells along the free space: these are occupied, so
that planners which take the unknown for passable stay inside.
"""

import json
import math
import re
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.arrays import BoolArray
from robocov.environment import Environment
from robocov.errors import MapError, OutputError, ParameterError, one_line, shown
from robocov.files.atomic import written
from robocov_app.formats import files
from robocov_app.formats.base import Exporter, ExportReport, ForeignMap, Importer, ReadOptions, WriteOptions
from robocov_app.formats.geometry.cells import Grid, free_cells, grid_over, grid_report
from robocov_app.formats.geometry.raster import BLOCKED, FREE, UNKNOWN, Cells, foreign_map
from robocov_app.formats.picture import Brightness, read_picture

_OCCUPIED, _FREE = 0.65, 0.196  # thresholds of a file that gives none, as map_server writes them
_KNOWN = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")

_NOISE = 1.5  # in maps that robots made single cells are noise
_SAVED_UNKNOWN = 205  # what savers write for unknown cells, of 255


def _sniff(path: Path, head: bytes) -> bool:
    return path.suffix.lower() in (".yaml", ".yml") and b"image" in head and b"resolution" in head


def _read(path: Path, options: ReadOptions) -> ForeignMap:
    where = one_line(path)
    text = files.content(path, files.MAX_YAML_BYTES)
    given = files.parse_yaml(text, where)
    mode = _text(given, "mode", where, "trinary").lower()
    if mode not in ("trinary", "scale", "raw"):
        raise MapError(f"{where}: mode: {shown(mode)}, but one of trinary, scale, raw was wanted")
    cell = _number(given, "resolution", where)
    files.require_length(cell, f"{where}: resolution", smallest=1e-4, largest=1000.0)
    origin = _origin(given, where)
    negated = _text(given, "negate", where, "0").lower()
    if negated not in ("0", "1", "false", "true", "no", "yes", "off", "on"):
        raise MapError(f"{where}: negate: {shown(negated)}, but 0 or 1 was wanted")
    negate = negated in ("1", "true", "yes", "on")
    occupied = _number(given, "occupied_thresh", where, _OCCUPIED)
    free = _number(given, "free_thresh", where, _FREE)
    if not 0.0 <= free <= occupied <= 1.0:
        wanted = "numbers from 0 to 1 were wanted, the first not the larger"
        raise MapError(f"{where}: free_thresh, occupied_thresh: {free:g}, {occupied:g}, but {wanted}")
    name = _text(given, "image", where)
    at = f"{where}: image"
    image, moved = files.named_file(path, name, anywhere=options.anywhere, at=at, what="picture")
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
    for key, taken in (("occupied_thresh", _OCCUPIED), ("free_thresh", _FREE)):
        if key not in given and mode != "raw":
            repaired.append(f"{key} is missing, {taken:g} taken")
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
        repaired=tuple(repaired),
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
    what = f"{doubtful} cells have the value {_SAVED_UNKNOWN}, which is saved for unknown cells"
    return [f"{what}, and are free by free_thresh {free:g}"]


def _origin(given: dict[str, files.Value], where: str) -> tuple[float, float, float]:
    """Return x, y (m) and yaw (rad) of the lower left corner."""
    values = given.get("origin", ["0", "0", "0"])
    if not isinstance(values, list) or not 2 <= len(values) <= 3:
        raise MapError(f"{where}: origin: {shown(values)}, but [x, y, yaw] was wanted")
    x, y, yaw = (_parsed(value, f"{where}: origin[{k}]") for k, value in enumerate([*values, "0"][:3]))
    files.require_coordinate(x, f"{where}: origin[0]")
    files.require_coordinate(y, f"{where}: origin[1]")
    return x, y, math.remainder(yaw, 2 * math.pi)


def _text(given: dict[str, files.Value], key: str, where: str, default: str | None = None) -> str:
    value = given.get(key, default)
    if key not in given and default is None:
        raise MapError(f"{where}: {key}: missing, but it was wanted")
    if not isinstance(value, str):
        raise MapError(f"{where}: {key}: {shown(value)}, but one value was wanted")
    return value


def _number(given: dict[str, files.Value], key: str, where: str, default: float | None = None) -> float:
    if key not in given and default is not None:
        return default
    return _parsed(_text(given, key, where), f"{where}: {key}")


def _parsed(text: files.Value, where: str) -> float:
    try:
        value = float(text) if isinstance(text, str) else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MapError(f"{where}: {shown(text)}, but a number was wanted")
    return value


IMPORTER = Importer(
    "ros", "ROS map_server: YAML with a PGM or PNG", (".yaml", ".yml"), _sniff, _read,
    options=frozenset({"unknown", "threshold", "anywhere"}),
)  # fmt: skip


_WHITE, _GREY, _BLACK = 254, _SAVED_UNKNOWN, 0  # what map_saver writes for free, unknown and occupied
_FINER = 4
"""Of scale and raw a cell's occupancy is the part of so many by so many of its places that is solid."""

_Pixels: TypeAlias = NDArray[np.uint8]


def _files(path: Path, options: WriteOptions) -> tuple[Path, ...]:
    mode = options.mode or "trinary"
    image = options.image or ("png" if mode == "scale" else "pgm")
    return (path, path.with_suffix(f".{image}"))


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    mode = options.mode or "trinary"
    _, image = _files(path, options)
    if image == path:
        raise OutputError(f"{one_line(path)}: the name of the picture, but one for the YAML was wanted")
    text_name = _quoted(image.name, path)
    grid = grid_over(environment, options.cell)
    free = free_cells(environment, grid)
    within = grid.covered(environment.boundary_polygon)
    # a wall of one cell all around what is free
    unknown = ~(within | ndimage.binary_dilation(free, np.ones((3, 3), bool)))
    if mode == "trinary":
        pixels = np.where(free, np.uint8(_WHITE), np.uint8(_BLACK))
        pixels[unknown] = _GREY
        alpha = None
    else:
        pixels, alpha, free = _graded(environment, grid, free, unknown, mode)
    notes: tuple[str, ...] = ()
    if alpha is not None and image.suffix == ".pgm":
        notes = ("a PGM of mode scale has no unknown cells: what is outside is occupied",)
        pixels = np.where(unknown, np.uint8(_BLACK), pixels)
        alpha = None
    _save(image, pixels[::-1], None if alpha is None else alpha[::-1], grid)
    with written(path) as part:
        part.write_text(
            f"image: {text_name}\nmode: {mode}\nresolution: {grid.cell!r}\n"
            f"origin: [{grid.origin[0]!r}, {grid.origin[1]!r}, 0.0]\n"
            f"negate: 0\noccupied_thresh: {_OCCUPIED}\nfree_thresh: {_FREE}\n",
            encoding="utf-8",
        )
    return grid_report("ros", (path, image), environment, grid, free, notes=notes)


def _graded(
    environment: Environment, grid: Grid, free: BoolArray, unknown: BoolArray, mode: str
) -> tuple[_Pixels, _Pixels | None, BoolArray]:
    """Return pixels and opacity of mode scale or raw, (rows, columns), and the cells that are mostly free.

    A cell that is not free is occupied for sure: costmaps take what is less than sure for free.
    """
    fine = grid.covered(environment.free, _FINER).reshape(grid.rows, _FINER, grid.columns, _FINER)
    solid = 1.0 - fine.mean(axis=(1, 3), dtype=np.float32)
    solid[~free] = 1.0
    percent = np.rint(100.0 * solid)
    free = percent < 50.0
    if mode == "raw":
        return np.where(unknown, 255, percent).astype(np.uint8), None, free
    dark = np.where(solid >= 1.0, 1.0, np.where(solid <= 0.0, 0.0, _FREE + solid * (_OCCUPIED - _FREE)))
    alpha = np.where(unknown, np.uint8(0), np.uint8(255))
    return np.rint(255.0 * (1.0 - dark)).astype(np.uint8), alpha, free


def _save(path: Path, pixels: _Pixels, alpha: _Pixels | None, grid: Grid) -> None:
    """Write a picture, the top row first."""
    with written(path) as part:
        if path.suffix == ".pgm":
            head = f"P5\n# robocov {grid.cell!r} m/pix\n{grid.columns} {grid.rows}\n255\n"
            part.write_bytes(head.encode("ascii") + pixels.tobytes())
            return
        import PIL.Image

        picture = pixels if alpha is None else np.dstack([pixels, alpha])
        PIL.Image.fromarray(np.ascontiguousarray(picture)).save(part, format="PNG")


def _quoted(name: str, path: Path) -> str:
    """Return a file's name as YAML has it."""
    try:
        name.encode()
    except UnicodeEncodeError:
        raise OutputError(f"{one_line(path)}: {shown(name)}: no name that UTF-8 can hold") from None
    return name if re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name) else json.dumps(name)


EXPORTER = Exporter(
    "ros", "ROS map_server: YAML with a PGM or PNG", (".yaml", ".yml"), _write,
    options=frozenset({"cell", "mode", "image"}), files=_files,
)  # fmt: skip
