"""What a reader of a foreign format is, and the options that readers have between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal

from robocov.errors import ParameterError, shown

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from robocov_app.importers.foreign import ForeignMap

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

    Attributes
    ----------
    name : str
        As in ``--format``.
    title : str
        One line for people.
    suffixes : tuple of str
        Lower case, with the dot: ``(".yaml", ".yml")``.
    sniff : callable
        ``sniff(path, head)``: whether a file that begins with these bytes (`limits.HEAD` of them, or
        all) is of the format. Cheap, and never raises.
    read : callable
        ``read(path, options)``: the `ForeignMap` in the file. Raises MapError, one line, on whatever
        it cannot use, within a second and 200 MB.
    options : frozenset of str
        Names of the `ReadOptions` that mean something here.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    read: Callable[[Path, ReadOptions], ForeignMap]
    options: frozenset[str] = frozenset()
