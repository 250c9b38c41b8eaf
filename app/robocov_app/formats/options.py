"""Options for reading and writing foreign maps; the command line and the window offer all of them."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from robocov.errors import ParameterError, quote, require_number
from robocov_app.formats.colors import ROLES, ColorKey

_MIN_LENGTH_M = 1e-6
_MAX_LENGTH_M = 1e4
_LENGTH_RANGE = (_MIN_LENGTH_M, _MAX_LENGTH_M, "m")
_STROKE_WIDTH = re.compile(r"(\d{1,6}(?:\.\d{0,9})?|\.\d{1,9})\s*(px|m)?", re.ASCII)


_Value = TypeVar("_Value")


def get_or_default(value: _Value | None, default: _Value) -> _Value:
    """Return the value of an option, or the default if the value is None."""
    return default if value is None else value


@dataclass(frozen=True)
class Options:
    """Base class of options: dataclasses whose fields all have defaults."""

    def require_ranges(self, **ranges: tuple[float, float, str]) -> None:
        """Check that numbers are in their ranges, and that words are among those that the option accepts.

        Parameters
        ----------
        **ranges : (minimum, maximum, unit)
            Ranges of numbers, keyed by the names of the options.

        Raises
        ------
        ParameterError
            If a number is out of range, or a word is not accepted.
        """
        for name, hint in get_type_hints(type(self)).items():
            value = getattr(self, name)
            if value is None:
                continue
            if name in ranges:
                minimum, maximum, unit = ranges[name]
                require_number(name, value, minimum, maximum, unit)
            words = _list_words(hint)
            if words and value not in words:
                raise ParameterError(f"{name}: expected one of {', '.join(words)}, got {quote(value)}")

    def require_supported(self, format_name: str, supported: Collection[str]) -> None:
        """Check that all options given by the user apply to a format.

        Parameters
        ----------
        format_name : str
        supported : collection of str
            Names of the options that apply to the format.

        Raises
        ------
        ParameterError
            If any other option differs from its default.
        """
        for option in fields(self):
            is_given = getattr(self, option.name) != option.default
            if is_given and option.name not in supported:
                words = ", ".join(map(_format_option, sorted(supported))) or "none"
                reason = f"not supported by the format {format_name} (supported: {words})"
                raise ParameterError(f"{_format_option(option.name)}: {reason}")


def _format_option(name: str) -> str:
    """Return the name of an option as it is written on the command line."""
    return f"--{name.replace('_', '-')}"


def _list_words(hint: Any) -> list[str]:
    """Return the words that the Literal types in a type hint allow."""
    words: list[str] = []
    for kind in (hint, *get_args(hint)):
        if get_origin(kind) is Literal:
            words += get_args(kind)
    return words


@dataclass(frozen=True)
class ReadOptions(Options):
    """Options for reading a map, in addition to its file. Their defaults are those of its format."""

    cell: float | None = None
    """Side of a cell, pixel or tile, m (default: 1 for MovingAI, Tiled and CoverageControl)."""
    unknown: Literal["obstacle", "free", "cut"] | None = None
    """Treatment of unknown or transparent cells; with cut the map ends at the known cells."""
    threshold: float | None = None
    """Brightness below which pixels, or occupancy from which ROS cells, are obstacles (default: 0.5)."""
    invert: bool = False
    """Light pixels of an image are obstacles, not dark ones."""
    trees: Literal["obstacle", "free"] | None = None
    """Whether trees (T) in a MovingAI grid are obstacles (the default)."""
    water: Literal["obstacle", "free"] | None = None
    """Whether water (W) in a MovingAI grid, or of OpenStreetMap, is an obstacle (the default)."""
    anywhere: bool = False
    """Allow images and included files outside the folder of the file."""
    scale: float | None = None
    """Size of a unit of a drawing, or of a pixel of a TMX, m."""
    units: Literal["meters", "degrees"] | None = None
    """Unit of the coordinates of GeoJSON; overrides the file."""
    thickness: float | None = None
    """Width of walls that are drawn as lines, m."""
    pillar: float | None = None
    """Radius of the pillar at each point, m; by default points are left out."""
    outlines: Literal["free", "solid", "nested"] | None = None
    """Meaning of closed outlines except the boundary; nested: alternately free and solid, from outside in."""
    boundary: str | None = None
    """Name, id, class or layer of the outer boundary."""
    around: float | None = None
    """Margin around the shapes if none of them is the boundary, m."""
    snap: float | None = None
    """Maximum width of gaps between outlines to close, m (default: 0.01, or less in small drawings)."""
    only: tuple[str, ...] | None = field(default=None, metadata={"metavar": "NAME ..."})
    """Names, ids, classes or layers to read; all others are left out."""
    skip: tuple[str, ...] | None = field(
        default=None, metadata={"aliases": ["--ignore-layer"], "metavar": "NAME ..."}
    )
    """Names, ids, classes or layers to leave out."""
    level: str | None = None
    """Number or name of the floor of a building to read (default: 0, the ground floor)."""
    free_color: tuple[str, ...] | None = field(default=None, metadata={"metavar": "COLOR ..."})
    """Colors of free space, as names or #rrggbb."""
    solid_color: tuple[str, ...] | None = field(default=None, metadata={"metavar": "COLOR ..."})
    """Colors of obstacles."""
    ignore_color: tuple[str, ...] | None = field(default=None, metadata={"metavar": "COLOR ..."})
    """Colors to ignore; they are replaced by the color around or below them."""
    color_tolerance: float | None = None
    """Maximum difference in red, green and blue, of 255 (default: 24 in images, 0 in drawings)."""
    min_stroke: str | None = None
    """Minimum width of strokes to read, in meters or pixels, as in 3px; drops door arcs, furniture, text."""
    hatches: bool = False
    """Treat hatches as areas, like outlines."""

    def __post_init__(self) -> None:
        self.require_ranges(
            cell=_LENGTH_RANGE,
            scale=_LENGTH_RANGE,
            thickness=_LENGTH_RANGE,
            pillar=_LENGTH_RANGE,
            around=_LENGTH_RANGE,
            threshold=(0.0, 1.0, ""),
            snap=(0.0, 10.0, "m"),
            color_tolerance=(0.0, 255.0, ""),
        )
        # Called only to raise errors for an invalid width or color before a file is read.
        self.compute_stroke_width(1.0)
        self.build_color_key()

    def build_color_key(self, default_tolerance: float = 0.0) -> ColorKey:
        """Build the key of the declared colors and their roles.

        Parameters
        ----------
        default_tolerance : float
            Tolerance if the user gives none, from 0 to 255.

        Raises
        ------
        ParameterError
            If a color is unknown, or given twice.
        """
        tolerance = get_or_default(self.color_tolerance, default_tolerance)
        names = {role: getattr(self, f"{role}_color") or () for role in ROLES}
        return ColorKey.from_names(names, tolerance)

    def compute_stroke_width(self, pixel: float) -> float:
        """Return the width, m, below which strokes are dropped; 0 if the option is not given.

        Parameters
        ----------
        pixel : float, m
            Side of a pixel, or of a unit of a drawing.

        Raises
        ------
        ParameterError
            If the option is not a valid width.
        """
        if self.min_stroke is None:
            return 0.0
        match = _STROKE_WIDTH.fullmatch(self.min_stroke.strip())
        if match is None:
            expected = "a width in meters, as in 0.1, or in pixels, as in 3px"
            raise ParameterError(f"min_stroke: expected {expected}, got {quote(self.min_stroke)}")
        width = float(match[1])
        if match[2] == "px":
            return width * pixel
        require_number("min_stroke", width, 0.0, _MAX_LENGTH_M, "m")
        return width


@dataclass(frozen=True)
class WriteOptions(Options):
    """Options for writing a map. Their defaults are those of its format."""

    cell: float | None = None
    """Side of a cell or pixel, m (default: 0.05). Walls thinner than a cell are written without gaps."""
    mode: Literal["trinary", "scale", "raw"] | None = None
    """Encoding of occupancy in a ROS map (default: trinary)."""
    image: Literal["pgm", "png"] | None = None
    """Image format of a ROS map (default: pgm)."""
    scale: float | None = None
    """Length on the map of one millimeter in an SVG file, m (default: 0.001, true to scale)."""
    digits: int | None = None
    """Number of decimals of coordinates (default: enough for micrometers)."""
    origin: tuple[float, float] | None = field(default=None, metadata={"metavar": "LON LAT"})
    """Longitude and latitude of the map's point [0, 0], for GeoJSON in degrees; needs robocov[geo]."""

    def __post_init__(self) -> None:
        self.require_ranges(cell=_LENGTH_RANGE, scale=_LENGTH_RANGE, digits=(0, 12, ""))
        if self.origin is None:
            return
        longitude, latitude = self.origin
        if not (abs(longitude) <= 180.0 and abs(latitude) <= 89.0):
            expected = "expected a longitude from -180 to 180 and a latitude from -89 to 89"
            raise ParameterError(f"origin: {expected}, got {quote(self.origin)}")
