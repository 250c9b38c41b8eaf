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
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import ndimage

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.errors import MapError, OutputError, ParameterError, quote, to_one_line
from robocov.files.writing import replace_file
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.rasterize import build_grid, build_grid_report, find_free_cells
from robocov_app.formats.geometry.vectorize import BLOCKED, FREE, UNKNOWN, Cells, build_grid_map
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.picture import Brightness, describe_transparency, read_picture
from robocov_app.formats.reports import ExportReport

_OCCUPIED, _FREE = 0.65, 0.196
_THRESHOLDS = {"occupied_thresh": _OCCUPIED, "free_thresh": _FREE}  # as map_server writes them
_KNOWN = ("image", "resolution", "origin", "negate", "mode", *_THRESHOLDS)
_NOISE = 1.5  # in maps that robots made single cells are noise
_SAVED_UNKNOWN = 205  # what savers write for unknown cells, of 255
_WHITE = 254  # what map_saver writes for free cells; occupied ones are 0
_FINER = 4  # so many by so many places of a cell, of which the solid part is its occupancy of scale and raw


def sniff(path: Path, head: bytes) -> bool:
    return path.suffix.lower() in (".yaml", ".yml") and b"image" in head and b"resolution" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    where = to_one_line(path)
    given = files.parse_yaml(files.read_content(path, files.MAX_YAML_BYTES), where)
    mode = _text(given, "mode", where, "trinary").lower()
    if mode not in ("trinary", "scale", "raw"):
        raise MapError(f"{where}: mode: expected one of trinary, scale, raw, got {quote(mode)}")
    cell = _number(_text(given, "resolution", where), f"{where}: resolution")
    files.require_length(cell, f"{where}: resolution", minimum=1e-4, maximum=1000.0)
    corner = given.get("origin", ["0", "0", "0"])
    if not isinstance(corner, list) or not 2 <= len(corner) <= 3:
        raise MapError(f"{where}: origin: expected [x, y, yaw], got {quote(corner)}")
    x, y, yaw = (_number(text, f"{where}: origin[{k}]") for k, text in enumerate([*corner, "0"][:3]))
    files.require_coordinate(x, f"{where}: origin[0]")
    files.require_coordinate(y, f"{where}: origin[1]")
    negated = _text(given, "negate", where, "0").lower()
    if negated not in ("0", "1", "false", "true", "no", "yes", "off", "on"):
        raise MapError(f"{where}: negate: expected 0 or 1, got {quote(negated)}")
    negate = negated in ("1", "true", "yes", "on")
    occupied, free = (
        _number(_text(given, key, where, str(default)), f"{where}: {key}")
        for key, default in _THRESHOLDS.items()
    )
    if not 0.0 <= free <= occupied <= 1.0:
        wanted = "expected numbers from 0 to 1, the first not the larger"
        raise MapError(f"{where}: free_thresh, occupied_thresh: {wanted}, got {free:g}, {occupied:g}")
    repaired: list[str] = []
    name, at = _text(given, "image", where), f"{where}: image"
    image = files.find_named_file(
        path, name, "picture", at=at, notes=repaired, allow_anywhere=options.anywhere
    )
    picture = read_picture(image, to_one_line(image))
    transparency = _describe_transparency(picture, mode)
    threshold = 0.5 if options.threshold is None else options.threshold
    notes = [f"{to_one_line(key)}: no key of map_server, not looked at" for key in given if key not in _KNOWN]
    if mode != "raw":
        taken = {key: default for key, default in _THRESHOLDS.items() if key not in given}
        repaired += [f"{key} is missing, {default:g} taken" for key, default in taken.items()]
    if mode == "trinary":
        if options.threshold is not None:
            raise ParameterError(f"--threshold: of no use here: {where} is of mode trinary")
        cells = _trinary(picture, negate, free, occupied)
        notes += _doubted(picture, negate, free)
    elif mode == "scale":
        cells = _scale(picture, negate, free, occupied, threshold)
    else:
        cells = _raw(picture, threshold)
    if transparency:
        notes.append(transparency)
        if not (cells == FREE).any() and options.unknown != "free":
            raise MapError(f"{where}: no cell is free: {transparency}")
    turn = math.remainder(yaw, 2 * math.pi)
    notes += _describe_yaw(yaw, turn)
    return build_grid_map(
        cells,
        where,
        path.stem,
        f"A ROS map of {cell:g} m a cell, imported.",
        cell,
        origin=(x, y),
        yaw=turn,
        unknown=options.unknown or "obstacle",
        noise=_NOISE,
        repaired=tuple(repaired),
        notes=tuple(notes),
    )


def _trinary(picture: Brightness, negate: bool, free: float, occupied: float) -> Cells:
    level, full = picture.level, picture.full
    if picture.alpha is not None:
        # of a grey picture every colour is the level
        colours = np.rint(np.arange(full + 1) * (765 / full)).astype(np.uint16)[level]
        level, full = colours + picture.alpha.astype(np.uint16), 1020
    dark = _darkness(full, negate)
    table = np.full(full + 1, UNKNOWN, np.uint8)
    table[dark < free] = FREE
    table[dark > occupied] = BLOCKED
    return table[level]


def _scale(picture: Brightness, negate: bool, free: float, occupied: float, threshold: float) -> Cells:
    dark = _darkness(picture.full, negate)
    occupancy = np.rint((dark - free) / max(occupied - free, 1e-9) * 100.0)
    occupancy[dark < free] = 0.0
    occupancy[dark > occupied] = 100.0
    cells = _blocked(occupancy, threshold)[picture.level]
    if picture.alpha is not None:
        cells[picture.alpha < 255] = UNKNOWN
    return cells


def _raw(picture: Brightness, threshold: float) -> Cells:
    occupancy = np.rint(_darkness(picture.full, negate=True) * 255.0)
    table = _blocked(occupancy, threshold)
    table[occupancy > 100.0] = UNKNOWN
    return table[picture.level]


def _darkness(full: int, negate: bool) -> Array:
    shade = np.arange(full + 1) / full
    return shade if negate else 1.0 - shade


def _blocked(occupancy: Array, threshold: float) -> Cells:
    return np.where(occupancy >= max(100.0 * threshold, 1.0), BLOCKED, FREE).astype(np.uint8)


def _describe_transparency(picture: Brightness, mode: str) -> str:
    """Return how transparent pixels count, in words, where they do not count as unknown; or nothing."""
    found = describe_transparency(picture)
    if not found or mode == "scale":
        return ""
    if mode == "raw":
        return found
    share, _, _ = found.partition(",")
    return f"{share}, which map_server averages in as if it were a dark colour"


def _describe_yaw(yaw: float, turn: float) -> list[str]:
    """Return a note on the third number of the origin, where it turns the map."""
    if turn == 0.0:
        return []
    notes = [f"origin: turned by {math.degrees(turn):.4g} degrees about the lower left corner"]
    if abs(yaw) > 2 * math.pi:
        radians = math.radians(yaw)
        notes[0] += f", as its yaw is {yaw:g} rad; if it was meant in degrees, write {radians:.6g}"
    return notes


def _doubted(picture: Brightness, negate: bool, free: float) -> list[str]:
    """Return a word where cells that were saved as unknown count as free by the thresholds."""
    doubtful = int(np.count_nonzero(picture.level == _SAVED_UNKNOWN))
    plain = not negate and picture.full == 255 and picture.alpha is None
    if not plain or free <= 1 - _SAVED_UNKNOWN / 255 or doubtful < picture.level.size / 100:
        return []
    what = f"{doubtful} cells have the value {_SAVED_UNKNOWN}, which is saved for unknown cells"
    return [f"{what}, and are free by free_thresh {free:g}"]


def _text(given: dict[str, files.Value], key: str, where: str, default: str | None = None) -> str:
    value = given.get(key, default)
    if value is None:
        raise MapError(f"{where}: {key}: missing")
    if not isinstance(value, str):
        raise MapError(f"{where}: {key}: expected one value, got {quote(value)}")
    return value


def _number(text: files.Value, where: str) -> float:
    if not isinstance(text, str) or not math.isfinite(value := files.parse_number(text)):
        raise MapError(f"{where}: expected a number, got {quote(text)}")
    return value


def list_files(path: Path, options: WriteOptions) -> tuple[Path, ...]:
    image = options.image or ("png" if options.mode == "scale" else "pgm")
    return (path, path.with_suffix(f".{image}"))


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    mode = options.mode or "trinary"
    _, image = list_files(path, options)
    if image == path:
        raise OutputError(f"{to_one_line(path)}: expected another name for the YAML than for the picture")
    try:
        image.name.encode()
    except UnicodeEncodeError:
        raise OutputError(f"{to_one_line(path)}: {quote(image.name)}: no name that UTF-8 can hold") from None
    plain = re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", image.name)
    text_name = image.name if plain else json.dumps(image.name)
    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    walled = ndimage.binary_dilation(free, np.ones((3, 3), bool))  # by one cell all around what is free
    unknown = ~(grid.find_covered_cells(environment.boundary_polygon) | walled)
    solid = None
    if mode != "trinary":
        # a cell that is not free is occupied for sure: costmaps take what is less than sure for free
        fine = grid.find_covered_cells(environment.free, _FINER).reshape(
            grid.rows, _FINER, grid.columns, _FINER
        )
        solid = 1.0 - fine.mean(axis=(1, 3), dtype=np.float32)
        solid[~free] = 1.0
        free = np.rint(100.0 * solid) < 50.0
    notes: tuple[str, ...] = ()
    alpha = None
    if solid is None:
        pixels = np.where(free, np.uint8(_WHITE), np.uint8(0))
        pixels[unknown] = _SAVED_UNKNOWN
    elif mode == "raw":
        pixels = np.where(unknown, 255, np.rint(100.0 * solid))
    else:
        dark = np.where(solid >= 1.0, 1.0, np.where(solid <= 0.0, 0.0, _FREE + solid * (_OCCUPIED - _FREE)))
        pixels = np.rint(255.0 * (1.0 - dark))
        if image.suffix == ".pgm":
            notes = ("a PGM of mode scale has no unknown cells: what is outside is occupied",)
            pixels[unknown] = 0
        else:
            alpha = np.where(unknown, np.uint8(0), np.uint8(255))
    pixels = pixels.astype(np.uint8)
    picture = np.ascontiguousarray((pixels if alpha is None else np.dstack([pixels, alpha]))[::-1])
    with replace_file(image) as part:
        if image.suffix == ".pgm":
            head = f"P5\n# robocov {grid.cell!r} m/pix\n{grid.columns} {grid.rows}\n255\n"
            part.write_bytes(head.encode("ascii") + picture.tobytes())
        else:
            import PIL.Image

            PIL.Image.fromarray(picture).save(part, format="PNG")
    with replace_file(path) as part:
        part.write_text(
            f"image: {text_name}\nmode: {mode}\nresolution: {grid.cell!r}\n"
            f"origin: [{grid.origin[0]!r}, {grid.origin[1]!r}, 0.0]\n"
            f"negate: 0\noccupied_thresh: {_OCCUPIED}\nfree_thresh: {_FREE}\n",
            encoding="utf-8",
        )
    return replace(build_grid_report("ros", (path, image), environment, grid, free), notes=notes)
