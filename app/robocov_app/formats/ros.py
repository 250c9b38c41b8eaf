"""ROS maps: YAML and an image, as map_server and nav2 read and write them.

How a pixel is read is as of http://wiki.ros.org/map_server and of ROS 2's nav2_map_server: with p the
darkness of the pixel from 0 to 1 (its brightness where `negate` is set), a cell of mode

- trinary is occupied where p > occupied_thresh, free where p < free_thresh, else unknown; where the picture
  has an alpha channel, that is averaged in like a color;
- scale is unknown where it is not opaque; between the thresholds its occupancy rises from 0 to 100 %;
- raw has the pixel's value as its occupancy in %, and is unknown where that exceeds 100; `negate` and the
  thresholds do not count.

An occupancy of 50 % and more, or what the option ``threshold`` says, is taken as an obstacle. Single cells
in the free space are taken as noise, and dropped, unless the size of specks says otherwise.

When a map is written, cells outside of the boundary are unknown, except for those along the free space: these
are occupied, so that planners which take the unknown for passable stay inside.
"""

import json
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.arrays import Array, BoolArray
from robocov.environment import Environment
from robocov.errors import MapError, OutputError, ParameterError, quote, to_one_line
from robocov.files.writing import replace_file
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.rasterize import CellGrid, build_grid, build_grid_report, find_free_cells
from robocov_app.formats.geometry.vectorize import BLOCKED, FREE, UNKNOWN, Cells, build_grid_map
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.picture import Brightness, describe_transparency, read_picture
from robocov_app.formats.reports import ExportReport

Mode: TypeAlias = Literal["trinary", "scale", "raw"]
_OCCUPIED_THRESHOLD = 0.65
_FREE_THRESHOLD = 0.196
"""Thresholds as map_server writes them."""
_DEFAULT_THRESHOLDS = {"occupied_thresh": _OCCUPIED_THRESHOLD, "free_thresh": _FREE_THRESHOLD}
_KNOWN_KEYS = ("image", "resolution", "origin", "negate", "mode", *_DEFAULT_THRESHOLDS)
_NOISE_CELLS = 1.5
"""Obstacles of fewer cells are noise of the robots that made the map."""
_UNKNOWN_LEVEL = 205
"""Level, of 255, that map savers write for unknown cells."""
_FREE_LEVEL = 254
"""Level that map_saver writes for free cells; that of occupied ones is 0."""
_SUBDIVISION = 4
"""Subcells along each side of a cell; the solid fraction of them is its occupancy of scale and raw."""
_MIN_RESOLUTION_M = 1e-4
_MAX_RESOLUTION_M = 1000.0
_TRUE_WORDS = ("1", "true", "yes", "on")
_FALSE_WORDS = ("0", "false", "no", "off")
_PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""File names that need no quotes in YAML."""


@dataclass(frozen=True)
class _Metadata:
    """The keys of the YAML of a map.

    Attributes
    ----------
    mode : str
    resolution : float, m
        Side of a cell.
    origin : (x, y), m
        Lower left corner.
    yaw : float, rad
    negate : bool
    occupied, free : float
        Thresholds of darkness, from 0 to 1.
    """

    mode: Mode
    resolution: float
    origin: tuple[float, float]
    yaw: float
    negate: bool
    occupied: float
    free: float


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return path.suffix.lower() in (".yaml", ".yml") and b"image" in head and b"resolution" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a map and its picture.

    Raises
    ------
    MapError
        If a key is missing or wrong, the picture cannot be read, or no cell is free.
    ParameterError
        If there is a threshold for a map of mode trinary.
    """
    where = to_one_line(path)
    document = files.parse_yaml(files.read_content(path, files.MAX_YAML_BYTES), where)
    metadata = _parse_metadata(document, where)
    repaired: list[str] = []
    image = files.find_named_file(
        path,
        _get_text(document, "image", where),
        "picture",
        at=f"{where}: image",
        notes=repaired,
        allow_anywhere=options.anywhere,
    )
    picture = read_picture(image, to_one_line(image))
    transparency = _describe_transparency(picture, metadata.mode)
    unknown_keys = [to_one_line(key) for key in document if key not in _KNOWN_KEYS]
    notes = [f"{key}: no key of map_server, not looked at" for key in unknown_keys]
    if metadata.mode != "raw":
        missing = [key for key in _DEFAULT_THRESHOLDS if key not in document]
        repaired += [f"{key} is missing, {_DEFAULT_THRESHOLDS[key]:g} taken" for key in missing]
    cells = _classify(picture, metadata, options, where)
    if metadata.mode == "trinary":
        notes += _describe_doubtful_cells(picture, metadata)
    if transparency:
        notes.append(transparency)
        if not (cells == FREE).any() and options.unknown != "free":
            raise MapError(f"{where}: no cell is free: {transparency}")
    turn = math.remainder(metadata.yaw, 2 * math.pi)
    notes += _describe_yaw(metadata.yaw, turn)
    return build_grid_map(
        cells,
        where,
        path.stem,
        f"A ROS map of {metadata.resolution:g} m a cell, imported.",
        metadata.resolution,
        origin=metadata.origin,
        yaw=turn,
        unknown=options.unknown or "obstacle",
        noise=_NOISE_CELLS,
        repaired=tuple(repaired),
        notes=tuple(notes),
    )


def _parse_metadata(document: dict[str, files.Value], where: str) -> _Metadata:
    """Return the checked keys of a map; `where` names the file."""
    mode = _get_text(document, "mode", where, "trinary").lower()
    if mode not in get_args(Mode):
        raise MapError(f"{where}: mode: expected one of trinary, scale, raw, got {quote(mode)}")
    resolution = _parse_number(_get_text(document, "resolution", where), f"{where}: resolution")
    files.require_length(
        resolution, f"{where}: resolution", minimum=_MIN_RESOLUTION_M, maximum=_MAX_RESOLUTION_M
    )
    x, y, yaw = _parse_origin(document, where)
    negate = _get_text(document, "negate", where, "0").lower()
    if negate not in _TRUE_WORDS + _FALSE_WORDS:
        raise MapError(f"{where}: negate: expected 0 or 1, got {quote(negate)}")
    thresholds = {}
    for key, default in _DEFAULT_THRESHOLDS.items():
        thresholds[key] = _parse_number(_get_text(document, key, where, str(default)), f"{where}: {key}")
    occupied = thresholds["occupied_thresh"]
    free = thresholds["free_thresh"]
    if not 0.0 <= free <= occupied <= 1.0:
        expected = "expected numbers from 0 to 1, the first not the larger"
        raise MapError(f"{where}: free_thresh, occupied_thresh: {expected}, got {free:g}, {occupied:g}")
    return _Metadata(
        mode=mode,  # type: ignore[arg-type]
        resolution=resolution,
        origin=(x, y),
        yaw=yaw,
        negate=negate in _TRUE_WORDS,
        occupied=occupied,
        free=free,
    )


def _parse_origin(document: dict[str, files.Value], where: str) -> tuple[float, float, float]:
    """Return the pose of the lower left corner: x and y in m, and the yaw in rad."""
    origin = document.get("origin", ["0", "0", "0"])
    if not isinstance(origin, list) or not 2 <= len(origin) <= 3:
        raise MapError(f"{where}: origin: expected [x, y, yaw], got {quote(origin)}")
    x, y, yaw = (_parse_number(text, f"{where}: origin[{k}]") for k, text in enumerate([*origin, "0"][:3]))
    files.require_coordinate(x, f"{where}: origin[0]")
    files.require_coordinate(y, f"{where}: origin[1]")
    return x, y, yaw


def _classify(picture: Brightness, metadata: _Metadata, options: ReadOptions, where: str) -> Cells:
    """Return the cells of a picture, as the mode of the map says."""
    threshold = 0.5 if options.threshold is None else options.threshold
    if metadata.mode == "raw":
        return _classify_raw(picture, threshold)
    if metadata.mode == "scale":
        return _classify_scale(picture, metadata.negate, metadata.free, metadata.occupied, threshold)
    if options.threshold is not None:
        raise ParameterError(f"--threshold: of no use here: {where} is of mode trinary")
    return _classify_trinary(picture, metadata.negate, metadata.free, metadata.occupied)


def _classify_trinary(picture: Brightness, negate: bool, free: float, occupied: float) -> Cells:
    """Return the cells of a picture of mode trinary, by the thresholds of darkness."""
    level = picture.level
    full = picture.full
    if picture.alpha is not None:
        # In a gray picture each of the three colors is the level.
        colors = np.rint(np.arange(full + 1) * (765 / full)).astype(np.uint16)[level]
        level = colors + picture.alpha.astype(np.uint16)
        full = 4 * 255
    dark = _compute_darkness(full, negate)
    table = np.full(full + 1, UNKNOWN, np.uint8)
    table[dark < free] = FREE
    table[dark > occupied] = BLOCKED
    return table[level]


def _classify_scale(
    picture: Brightness, negate: bool, free: float, occupied: float, threshold: float
) -> Cells:
    """Return the cells of a picture of mode scale, by their occupancy."""
    dark = _compute_darkness(picture.full, negate)
    occupancy = np.rint((dark - free) / max(occupied - free, 1e-9) * 100.0)
    occupancy[dark < free] = 0.0
    occupancy[dark > occupied] = 100.0
    cells = _find_blocked_cells(occupancy, threshold)[picture.level]
    if picture.alpha is not None:
        cells[picture.alpha < 255] = UNKNOWN
    return cells


def _classify_raw(picture: Brightness, threshold: float) -> Cells:
    """Return the cells of a picture of mode raw, whose pixels are the occupancy."""
    occupancy = np.rint(_compute_darkness(picture.full, negate=True) * 255.0)
    table = _find_blocked_cells(occupancy, threshold)
    table[occupancy > 100.0] = UNKNOWN
    return table[picture.level]


def _compute_darkness(full: int, negate: bool) -> Array:
    """Return the darkness, from 0 to 1, of each level from 0 to `full`."""
    shade = np.arange(full + 1) / full
    return shade if negate else 1.0 - shade


def _find_blocked_cells(occupancy: Array, threshold: float) -> Cells:
    """Return the cells of occupancies in percent."""
    return np.where(occupancy >= max(100.0 * threshold, 1.0), BLOCKED, FREE).astype(np.uint8)


def _describe_transparency(picture: Brightness, mode: str) -> str:
    """Return how transparent pixels count, as text, or an empty text if they count as unknown."""
    description = describe_transparency(picture)
    if not description or mode == "scale":
        return ""
    if mode == "raw":
        return description
    share, _, _ = description.partition(",")
    return f"{share}, which map_server averages in as if it were a dark color"


def _describe_yaw(yaw: float, turn: float) -> list[str]:
    """Return a note on the third number of the origin, where it turns the map."""
    if turn == 0.0:
        return []
    notes = [f"origin: turned by {math.degrees(turn):.4g} degrees about the lower left corner"]
    if abs(yaw) > 2 * math.pi:
        radians = math.radians(yaw)
        notes[0] += f", as its yaw is {yaw:g} rad; if it was meant in degrees, write {radians:.6g}"
    return notes


def _describe_doubtful_cells(picture: Brightness, metadata: _Metadata) -> list[str]:
    """Return a note if cells that were saved as unknown count as free by the thresholds."""
    count = int(np.count_nonzero(picture.level == _UNKNOWN_LEVEL))
    is_plain = not metadata.negate and picture.full == 255 and picture.alpha is None
    is_unknown_free = metadata.free > 1 - _UNKNOWN_LEVEL / 255
    if not is_plain or not is_unknown_free or count < picture.level.size / 100:
        return []
    cells = f"{count} cells have the value {_UNKNOWN_LEVEL}, which is saved for unknown cells"
    return [f"{cells}, and are free by free_thresh {metadata.free:g}"]


def _get_text(document: dict[str, files.Value], key: str, where: str, default: str | None = None) -> str:
    """Return the text of a key; without a default it must be there."""
    value = document.get(key, default)
    if value is None:
        raise MapError(f"{where}: {key}: missing")
    if not isinstance(value, str):
        raise MapError(f"{where}: {key}: expected one value, got {quote(value)}")
    return value


def _parse_number(text: files.Value, where: str) -> float:
    value = files.parse_number(text) if isinstance(text, str) else math.nan
    if not math.isfinite(value):
        raise MapError(f"{where}: expected a number, got {quote(text)}")
    return value


def list_files(path: Path, options: WriteOptions) -> tuple[Path, ...]:
    """Return the YAML and the picture that are written for a path."""
    suffix = options.image
    if suffix is None:
        suffix = "png" if options.mode == "scale" else "pgm"
    return (path, path.with_suffix(f".{suffix}"))


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write an environment as a YAML and a picture.

    Raises
    ------
    OutputError
        If a file cannot be written, or both would have the same name.
    """
    mode = options.mode or "trinary"
    _, image = list_files(path, options)
    image_name = _quote_image_name(path, image)
    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    # One cell all around the free space is occupied.
    walls_and_free = ndimage.binary_dilation(free, np.ones((3, 3), bool))
    unknown = ~(grid.find_covered_cells(environment.boundary_polygon) | walls_and_free)
    occupancy: NDArray[np.float32] | None = None
    if mode != "trinary":
        occupancy = _compute_occupancy(environment, grid, free)
        free = np.rint(100.0 * occupancy) < 50.0
    is_pgm = image.suffix == ".pgm"
    pixels = _build_pixels(mode, free, unknown, occupancy, is_pgm=is_pgm)
    notes: tuple[str, ...] = ()
    if mode == "scale" and is_pgm:
        notes = ("a PGM of mode scale has no unknown cells: what is outside is occupied",)
    _write_picture(image, pixels, grid.cell)
    x, y = grid.origin
    with replace_file(path) as temporary:
        temporary.write_text(
            f"image: {image_name}\nmode: {mode}\nresolution: {grid.cell!r}\n"
            f"origin: [{x!r}, {y!r}, 0.0]\n"
            f"negate: 0\noccupied_thresh: {_OCCUPIED_THRESHOLD}\nfree_thresh: {_FREE_THRESHOLD}\n",
            encoding="utf-8",
        )
    return replace(build_grid_report("ros", (path, image), environment, grid, free), notes=notes)


def _quote_image_name(path: Path, image: Path) -> str:
    """Return the name of the picture as it is written in the YAML at `path`."""
    if image == path:
        raise OutputError(f"{to_one_line(path)}: expected another name for the YAML than for the picture")
    try:
        image.name.encode()
    except UnicodeEncodeError:
        raise OutputError(f"{to_one_line(path)}: {quote(image.name)}: no name that UTF-8 can hold") from None
    return image.name if _PLAIN_NAME.fullmatch(image.name) else json.dumps(image.name)


def _compute_occupancy(environment: Environment, grid: CellGrid, free: BoolArray) -> NDArray[np.float32]:
    """Return the solid fraction of each cell.

    A cell that is not free is fully occupied, because costmaps take what is less than certain for free.
    """
    subcells = grid.find_covered_cells(environment.free, _SUBDIVISION)
    subcells = subcells.reshape(grid.rows, _SUBDIVISION, grid.columns, _SUBDIVISION)
    occupancy: NDArray[np.float32] = 1.0 - subcells.mean(axis=(1, 3), dtype=np.float32)
    occupancy[~free] = 1.0
    return occupancy


def _build_pixels(
    mode: str, free: BoolArray, unknown: BoolArray, occupancy: NDArray[np.float32] | None, *, is_pgm: bool
) -> NDArray[np.uint8]:
    """Return the pixels of a map, (rows, columns) or with alpha (rows, columns, 2), the bottom row first."""
    if occupancy is None:
        pixels: NDArray[np.uint8] = np.where(free, np.uint8(_FREE_LEVEL), np.uint8(0))
        pixels[unknown] = _UNKNOWN_LEVEL
        return pixels
    if mode == "raw":
        return np.where(unknown, 255, np.rint(100.0 * occupancy)).astype(np.uint8)
    darkness = _FREE_THRESHOLD + occupancy * (_OCCUPIED_THRESHOLD - _FREE_THRESHOLD)
    darkness = np.where(occupancy <= 0.0, 0.0, darkness)
    darkness = np.where(occupancy >= 1.0, 1.0, darkness)
    pixels = np.rint(255.0 * (1.0 - darkness)).astype(np.uint8)
    if is_pgm:
        pixels[unknown] = 0
        return pixels
    alpha = np.where(unknown, np.uint8(0), np.uint8(255))
    pixels_with_alpha: NDArray[np.uint8] = np.dstack([pixels, alpha])
    return pixels_with_alpha


def _write_picture(path: Path, pixels: NDArray[np.uint8], cell: float) -> None:
    """Write pixels, the bottom row first, as a PGM or PNG."""
    picture = np.ascontiguousarray(pixels[::-1])
    with replace_file(path) as temporary:
        if path.suffix == ".pgm":
            rows, columns = picture.shape
            header = f"P5\n# robocov {cell!r} m/pix\n{columns} {rows}\n255\n"
            temporary.write_bytes(header.encode("ascii") + picture.tobytes())
        else:
            import PIL.Image

            PIL.Image.fromarray(picture).save(temporary, format="PNG")
