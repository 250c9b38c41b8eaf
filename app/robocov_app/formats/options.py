"""Options of reading and writing, and what a format is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from robocov.environment import Environment
from robocov.errors import ParameterError, shown
from robocov_app.formats.foreign import ForeignMap, square_metres

_LENGTHS = ("cell", "scale", "thickness", "pillar", "around")
_FRACTIONS = ("threshold",)


@dataclass(frozen=True)
class ReadOptions:
    """What a file does not say of itself. None is the format's own default, and "not given".

    Attributes
    ----------
    cell : float, m
        Side of a cell of a grid, width of a tile, metres a pixel of a picture.
    unknown : str
        What unknown or transparent cells are: ``obstacle`` (the default), ``free``, or ``cut``: outside
        of the map, which ends where the known cells end.
    threshold : float
        From 0 to 1. Of a picture: what is darker is an obstacle (0.5). Of a ROS map whose mode is
        scale or raw: what is occupied with at least this probability is one (0.5).
    invert : bool
        In a picture light is an obstacle, not dark.
    trees, water : str
        What such cells of a MovingAI grid are, and water of OpenStreetMap: ``obstacle`` (the default) or
        ``free``.
    anywhere : bool
        Whether a file may name another one outside of its own folder.
    scale : float, m
        Metres that a unit of a vector format, or a pixel of a tile map, stands for.
    units : str
        What coordinates on the globe are: ``degrees``, or ``metres``, whatever the file says of itself.
    thickness : float, m
        Width of walls that are drawn as lines (0.1, or the line's own where it has one).
    pillar : float, m
        Radius of a pillar for each point; without it points are left out.
    outlines : str
        What closed outlines are: ``free`` space, or ``solid``, but for the one that is the boundary.
    boundary : str
        Name, id, class or layer of the shape that is the outer boundary.
    around : float, m
        Room left around the shapes where none of them is the boundary (1).
    only, skip : tuple of str
        Names, ids, classes or layers: all else is left out, or these are.
    hatches : bool
        Whether hatches are areas, as outlines are; otherwise they are left out.

    Raises
    ------
    ParameterError
        When a value is out of range.
    """

    cell: float | None = None
    unknown: Literal["obstacle", "free", "cut"] | None = None
    threshold: float | None = None
    invert: bool | None = None
    trees: Literal["obstacle", "free"] | None = None
    water: Literal["obstacle", "free"] | None = None
    anywhere: bool | None = None
    scale: float | None = None
    units: Literal["metres", "degrees"] | None = None
    thickness: float | None = None
    pillar: float | None = None
    outlines: Literal["free", "solid"] | None = None
    boundary: str | None = None
    around: float | None = None
    only: tuple[str, ...] | None = None
    skip: tuple[str, ...] | None = None
    hatches: bool | None = None

    def __post_init__(self) -> None:
        for name in _LENGTHS:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and 1e-6 <= value <= 1e4):
                raise ParameterError(
                    f"{name}: {shown(value)}, but a number from 1e-6 to 10000 (m) was wanted"
                )
        for name in _FRACTIONS:
            value = getattr(self, name)
            if value is not None and not 0.0 <= value <= 1.0:
                raise ParameterError(f"{name}: {shown(value)}, but a number from 0 to 1 was wanted")
        for name, choices in _CHOICES.items():
            value = getattr(self, name)
            if value is not None and value not in choices:
                raise ParameterError(f"{name}: {shown(value)}, but one of {', '.join(choices)} was wanted")

    def given(self) -> tuple[str, ...]:
        """Return the names of the options that are not None."""
        return tuple(field.name for field in fields(self) if getattr(self, field.name) is not None)


_CHOICES = {
    "unknown": ("obstacle", "free", "cut"),
    "trees": ("obstacle", "free"),
    "water": ("obstacle", "free"),
    "units": ("metres", "degrees"),
    "outlines": ("free", "solid"),
}


@dataclass(frozen=True)
class Importer:
    """A foreign format.

    `name`: as in ``--format``. `title`: one line for people. `suffixes`: lower case, with the dot:
    ``(".yaml", ".yml")``. `sniff`: ``sniff(path, head)``: whether a file that begins with these bytes
    (`files.HEAD` of them, or all) is of the format. Cheap, and never raises. `read`: ``read(path,
    options)``: the `ForeignMap` in the file. Raises MapError, one line, on whatever it cannot use, within a
    second and 200 MB. `options`: names of the `ReadOptions` that mean something here.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    read: Callable[[Path, ReadOptions], ForeignMap]
    options: frozenset[str] = frozenset()


@dataclass(frozen=True)
class WriteOptions:
    """How a map is written. None is the format's own default, and "not given".

    Attributes
    ----------
    cell : float, m
        Side of a cell of a grid, metres a pixel of a picture.
    mode : str
        Of a ROS map: ``trinary`` (the default), ``scale`` or ``raw``.
    image : str
        Kind of the picture of a ROS map: ``pgm`` (the default) or ``png``.
    scale : float, m
        Metres that a millimetre of a drawing stands for.
    digits : int
        Decimals of the coordinates of a vector format.
    origin : (longitude, latitude), degrees
        Where on the globe [0, 0] m is: coordinates are written in degrees.

    Raises
    ------
    ParameterError
        When a value is out of range.
    """

    cell: float | None = None
    mode: Literal["trinary", "scale", "raw"] | None = None
    image: Literal["pgm", "png"] | None = None
    scale: float | None = None
    digits: int | None = None
    origin: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("cell", "scale"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and 1e-6 <= value <= 1e4):
                raise ParameterError(
                    f"{name}: {shown(value)}, but a number from 1e-6 to 10000 (m) was wanted"
                )
        if self.digits is not None and not 0 <= self.digits <= 12:
            raise ParameterError(f"digits: {shown(self.digits)}, but a number from 0 to 12 was wanted")
        if self.origin is not None and not (abs(self.origin[0]) <= 180.0 and abs(self.origin[1]) <= 89.0):
            wanted = "a longitude from -180 to 180 and a latitude from -89 to 89 were wanted"
            raise ParameterError(f"origin: {shown(self.origin)}, but {wanted}")
        for name, choices in (("mode", ("trinary", "scale", "raw")), ("image", ("pgm", "png"))):
            value = getattr(self, name)
            if value is not None and value not in choices:
                raise ParameterError(f"{name}: {shown(value)}, but one of {', '.join(choices)} was wanted")

    def given(self) -> tuple[str, ...]:
        """Return the names of the options that are not None."""
        return tuple(field.name for field in fields(self) if getattr(self, field.name) is not None)


@dataclass(frozen=True)
class ExportReport:
    """What came of a map in a foreign format.

    `files`: what was written; the first is the one that was asked for. `area`, m²: free area of the map.
    `area_written`, m²: free area of what was written. `dropped`, `notes`: what the format cannot hold (names,
    starts), and what is worth knowing besides; one line each. `warnings`: what is wrong in the file: where
    robots cannot drive any more; one line each.
    """

    format: str
    files: tuple[Path, ...]
    area: float
    area_written: float
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return the report for people, one fact a line."""
        area, of_it = square_metres(self.area), square_metres(self.area_written)
        return [
            f"{self.format}: free area {area}, written {of_it}",
            *(f"dropped: {line}" for line in self.dropped),
            *(f"note: {line}" for line in self.notes),
            f"saved in {', '.join(str(file) for file in self.files)}",
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a JSON document, with units in the key names."""
        return {
            "format": self.format,
            "files": [str(file) for file in self.files],
            "area_m2": self.area,
            "area_written_m2": self.area_written,
            "dropped": list(self.dropped),
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }


def _only(path: Path, options: WriteOptions) -> tuple[Path, ...]:
    return (path,)


@dataclass(frozen=True)
class Exporter:
    """A foreign format to write.

    `name`: as in ``--format``. `title`: one line for people. `suffixes`: lower case, with the dot. `write`:
    ``write(environment, path, options)`` writes the map whole or not at all (`robocov.files.atomic.written`)
    and returns an `ExportReport`. Raises ParameterError or OutputError. `options`: names of the
    `WriteOptions` that mean something here. `files`: ``files(path, options)``: all files that would be
    written, the given one first.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    write: Callable[[Environment, Path, WriteOptions], ExportReport]
    options: frozenset[str] = frozenset()
    files: Callable[[Path, WriteOptions], tuple[Path, ...]] = _only
