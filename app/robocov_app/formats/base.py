"""Interface of a map format: reader, options, and reports of what became of a map."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import CircleObstacle, Environment, WallObstacle
from robocov.errors import ParameterError, format_count, quote, require_number
from robocov_app.formats.colours import ROLES, Colour, ColourKey

Primitive: TypeAlias = CircleObstacle | WallObstacle
_LENGTH = (1e-6, 1e4, "m")
_STROKE = re.compile(r"(\d{1,6}(?:\.\d{0,9})?|\.\d{1,9})\s*(px|m)?", re.ASCII)
_KEYS = {name: f"{name}_m" for name in ("size", "tolerance", "moved")} | {"others": "other_parts_m"}
_AREAS = ("area", "area_read", "area_kept", "area_written", "moved_area", "removed_area")
_KEYS |= {name: f"{name}_m2" for name in _AREAS}


@dataclass(frozen=True, eq=False)
class Painted:
    """A shape of a drawing in its colour, mixed with white where it is translucent; `area` in m."""

    area: BaseGeometry
    colour: Colour


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """A picture in its colours, made smaller.

    Attributes
    ----------
    pixels : (rows, columns, 3) array of uint8
        The top row first.
    bounds : tuple of 4 float, m
        Lower left and upper right corner.
    """

    pixels: NDArray[np.uint8]
    bounds: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class ForeignMap:
    """Raw content of a foreign file. Readers only read: `robocov_app.formats.geometry.conversion` cleans.

    `free`, m, y up: may be invalid, empty, of many parts, and stick out of `boundary`. `boundary`, m: what is
    inside of it and not free becomes obstacles; without it, or where walls separate the free space from it,
    the outline of the free space is the boundary. `has_named_boundary`: it stays even there.
    `boundary_source`: what the boundary is, for the report.
    `vertices_read`: of a raster, corners of the outline of its free cells. `cell`, m: the longer side of one.
    `specks`, m²: smaller obstacles are noise of how such maps are made. `cut_corners`: by a step or two of a
    grid, so that `geometry.corners` makes them whole. `primitives`: obstacles that the file draws as such,
    not in `free`, kept instead of the polygons that they cover where nothing speaks against it.
    `robots`, (n, 2) m: where the file places some. `repaired`, `dropped`, `notes`: a line each, with counts.
    """

    name: str
    description: str
    free: MultiPolygon
    format: str = ""
    boundary: Polygon | MultiPolygon | None = None
    has_named_boundary: bool = False
    boundary_source: str = ""
    vertices_read: int = 0
    cell: float | None = None
    specks: float = 0.0
    cut_corners: bool = False
    primitives: tuple[Primitive, ...] = ()
    robots: tuple[tuple[float, float], ...] = ()
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    page: Polygon | None = None
    painted: tuple[Painted, ...] = ()
    thumbnail: Thumbnail | None = None


def square_metres(area: float, digits: int = 4) -> str:
    """Return an area with so many digits, and never as a power of ten."""
    return f"{area:.0f} m²" if area >= 1000 else f"{area:.{digits}g} m²"


@dataclass(frozen=True)
class _Report:
    def _told(self, *kinds: str) -> list[str]:
        return [f"{kind.removesuffix('s')}: {line}" for kind in kinds for line in getattr(self, kind)]

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a JSON document, with units in the key names."""
        document = {_KEYS.get(each.name, each.name): getattr(self, each.name) for each in fields(self)}
        for key, value in document.items():
            if isinstance(value, tuple):
                document[key] = [str(each) if isinstance(each, Path) else each for each in value]
        return document


@dataclass(frozen=True)
class ImportReport(_Report):
    """Report on an imported map, so that nothing is repaired in silence; lengths in m, areas in m².

    `changed`: on purpose (simplified, grown). `size`: of the boundary. `tolerance`: by how much walls were
    allowed to move. `moved_area`: was free and is not, or is and was not, for the simplification. `moved`: by
    how much a wall moved for it, at most: the Hausdorff distance of what remained. `removed`, `removed_area`:
    hairs, that is slits and spurs thinner than the decimals of a map. `others`: a place in each large part
    of the free space that was left out, as `Shaping.inside` takes it.
    """

    source: str
    format: str
    vertices_read: int
    vertices_kept: int
    area_read: float
    area_kept: float
    size: tuple[float, float] = (0.0, 0.0)
    obstacles: int = 0
    tolerance: float = 0.0
    moved_area: float = 0.0
    moved: float = 0.0
    removed: int = 0
    removed_area: float = 0.0
    others: tuple[tuple[float, float], ...] = ()
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        return [
            f"{self.format}: {self.vertices_read} vertices read, {self.vertices_kept} kept; "
            f"free area {square_metres(self.area_read)} read, {square_metres(self.area_kept)} kept",
            f"{self.size[0]:.4g} x {self.size[1]:.4g} m, {format_count(self.obstacles, 'obstacle')}",
            *self._told("repaired", "dropped", "changed", "notes"),
        ]


@dataclass(frozen=True)
class Options:
    """Parameters, each with a default."""

    def require(self, **ranges: tuple[float, float, str]) -> None:
        """Raise ParameterError where a value is out of its range, or none of the words of its type."""
        for name, hint in get_type_hints(type(self)).items():
            value = getattr(self, name)
            kinds = (hint, *get_args(hint))
            words = [word for kind in kinds if get_origin(kind) is Literal for word in get_args(kind)]
            if value is not None and name in ranges:
                require_number(name, value, *ranges[name])
            if value is not None and words and value not in words:
                raise ParameterError(f"{name}: expected one of {', '.join(words)}, got {quote(value)}")

    def require_known(self, chosen: Importer | Exporter) -> None:
        """Raise ParameterError where something is given that means nothing to a format."""
        given = [each.name for each in fields(self) if getattr(self, each.name) != each.default]
        if strange := [name for name in given if name not in chosen.options]:
            words = ", ".join(f"--{each}" for each in sorted(chosen.options)) or "none"
            known = f"no option of the format {chosen.name}, whose options are: {words}"
            raise ParameterError(f"--{strange[0]}: {known}")


@dataclass(frozen=True)
class ReadOptions(Options):
    """What a file does not say of itself; what is not given is as its format has it."""

    cell: float | None = None
    """Side of a cell or pixel, or width of a tile, in metres. By default MovingAI's and Tiled's have 1."""
    unknown: Literal["obstacle", "free", "cut"] | None = None
    """What unknown or transparent cells are; with cut the map ends where the known cells end."""
    threshold: float | None = None
    """From 0 to 1. What is darker in a picture is an obstacle; what is occupied with this probability in
    a ROS map of mode scale or raw is one. 0.5 by default."""
    invert: bool = False
    """In a picture light is an obstacle, not dark."""
    trees: Literal["obstacle", "free"] | None = None
    """Whether trees (T) in a MovingAI grid are obstacles (the default)."""
    water: Literal["obstacle", "free"] | None = None
    """Whether water (W) in a MovingAI grid, or of OpenStreetMap, is an obstacle (the default)."""
    anywhere: bool = False
    """Pictures and includes that a file names may be outside of its folder."""
    scale: float | None = None
    """Metres that a unit of a drawing, or a pixel of a TMX, stands for."""
    units: Literal["metres", "degrees"] | None = None
    """What the coordinates of GeoJSON are, whatever it says of itself."""
    thickness: float | None = None
    """Width in metres of walls that are drawn as lines."""
    pillar: float | None = None
    """Radius in metres of a pillar for each point; without it points are left out."""
    outlines: Literal["free", "solid", "nested"] | None = None
    """What closed outlines of a drawing are, but for the boundary. Nested are free and solid by turns, from
    the outside in, so that the larger area is free."""
    boundary: str | None = None
    """Name, id, class or layer of the shape that is the outer boundary."""
    around: float | None = None
    """Room in metres around the shapes where none of them is the boundary."""
    snap: float | None = None
    """Gaps in metres between outlines of free space that are narrower than this are closed where they cut
    it apart; 0 keeps all. By default 0.01, or a thousandth of the drawing if that is less."""
    only: tuple[str, ...] | None = None
    """Names, ids, classes or layers that are read; all else is left out."""
    skip: tuple[str, ...] | None = field(default=None, metadata={"aliases": ["--ignore-layer"]})
    """Names, ids, classes or layers that are left out."""
    level: str | None = None
    """Floor of a building that is read, by its number or name. By default the ground floor, 0."""
    free_colour: tuple[str, ...] | None = None
    """Colours that are free space, by name or as #rrggbb."""
    solid_colour: tuple[str, ...] | None = None
    """Colours that are obstacles."""
    ignore_colour: tuple[str, ...] | None = None
    """Colours that are left out: what is around or below them counts."""
    colour_tolerance: float | None = None
    """By how much a colour may differ in each of red, green and blue, of 255. By default 24 in a picture,
    and 0 in a drawing."""
    min_stroke: str | None = None
    """Thinner strokes (door arcs, furniture, text) are dropped: a width in metres, or in pixels as in 3px."""
    hatches: bool = False
    """Hatches are areas, as outlines are."""

    def __post_init__(self) -> None:
        lengths = dict.fromkeys(("cell", "scale", "thickness", "pillar", "around"), _LENGTH)
        self.require(
            threshold=(0.0, 1.0, ""),
            snap=(0.0, 10.0, "m"),
            colour_tolerance=(0.0, 255.0, ""),
            **lengths,
        )
        self.stroke_width(1.0)
        self.colour_key()

    def colour_key(self, tolerance: float = 0.0) -> ColourKey:
        """Return the colours that are given, with this tolerance where none is.

        Raises
        ------
        ParameterError
            If a colour is unknown, or given twice.
        """
        return ColourKey.from_names(
            {role: getattr(self, f"{role}_colour") or () for role in ROLES},
            tolerance if self.colour_tolerance is None else self.colour_tolerance,
        )

    def stroke_width(self, pixel: float) -> float:
        """Return the width in metres below which strokes are dropped, 0 for none.

        Parameters
        ----------
        pixel : float, m
            Side of a pixel, or of a unit of a drawing.

        Raises
        ------
        ParameterError
            If the option is no width.
        """
        if self.min_stroke is None:
            return 0.0
        match = _STROKE.fullmatch(self.min_stroke.strip())
        if match is None:
            wanted = "a width in metres, as in 0.1, or in pixels, as in 3px"
            raise ParameterError(f"min_stroke: expected {wanted}, got {quote(self.min_stroke)}")
        width = float(match[1])
        if match[2] == "px":
            return width * pixel
        require_number("min_stroke", width, 0.0, _LENGTH[1], "m")
        return width


@dataclass(frozen=True)
class Importer:
    """A foreign format: its name as in ``--format``, a title for people, suffixes in lower case.

    ``sniff(path, head)``: whether a file that begins with these bytes (`files.HEAD` of them, or all) is of
    it; cheap, and never raises. ``reader(path, options)``: the map in it; a one-line MapError on whatever it
    cannot use, within a second and 200 MB. `options`: those of `ReadOptions` that mean something here.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    reader: Callable[[Path, ReadOptions], ForeignMap]
    options: frozenset[str] = frozenset()

    def read(self, path: Path, options: ReadOptions) -> ForeignMap:
        return replace(self.reader(path, options), format=self.name)


@dataclass(frozen=True)
class WriteOptions(Options):
    """How a map is written; what is not given is as its format has it."""

    cell: float | None = None
    """Side of a cell, or of a pixel, in metres; 0.05 by default. Walls that are thinner stay whole."""
    mode: Literal["trinary", "scale", "raw"] | None = None
    """How a ROS map says what is occupied; trinary by default."""
    image: Literal["pgm", "png"] | None = None
    """Kind of the picture of a ROS map; pgm by default."""
    scale: float | None = None
    """Metres that a millimetre of an SVG stands for; 0.001, true scale, by default."""
    digits: int | None = None
    """Decimals of coordinates; by default a micrometre."""
    origin: tuple[float, float] | None = None
    """Longitude and latitude of [0, 0] m: GeoJSON in degrees. Needs pyproj: robocov[geo]."""

    def __post_init__(self) -> None:
        self.require(cell=_LENGTH, scale=_LENGTH, digits=(0, 12, ""))
        if self.origin is not None and not (abs(self.origin[0]) <= 180.0 and abs(self.origin[1]) <= 89.0):
            wanted = "expected a longitude from -180 to 180 and a latitude from -89 to 89"
            raise ParameterError(f"origin: {wanted}, got {quote(self.origin)}")


@dataclass(frozen=True)
class ExportReport(_Report):
    """Result of an export: files (the one asked for first), free areas in m², and words.

    `dropped`: what the format cannot hold. `warnings`: where robots cannot drive any more.
    """

    format: str
    files: tuple[Path, ...]
    area: float
    area_written: float
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        area, of_it = square_metres(self.area), square_metres(self.area_written)
        first = f"{self.format}: free area {area}, written {of_it}"
        return [first, *self._told("dropped", "notes"), f"saved in {', '.join(map(str, self.files))}"]


@dataclass(frozen=True)
class Exporter:
    """A foreign format to write, as an `Importer`.

    ``write(environment, path, options)`` writes the map whole or not at all, by
    `robocov.files.writing.replace_file`.
    ``files(path, options)``: all files that would be written, the given one first.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    write: Callable[[Environment, Path, WriteOptions], ExportReport]
    options: frozenset[str] = frozenset()
    files: Callable[[Path, WriteOptions], tuple[Path, ...]] = lambda path, _: (path,)
