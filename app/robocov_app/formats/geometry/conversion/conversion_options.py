"""Parameters of the conversion of a foreign map, and the state of a conversion in progress."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import MIN_START_GAP_RADII
from robocov.errors import MapError, ParameterError, quote
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.simplification.simplify import DEFAULT_TOLERANCE_M
from robocov_app.formats.options import Options, get_or_default

_MAX_GRID_M = 1e-4
"""Coordinates are rounded to a multiple of this, or of a hundredth of a cell if that is finer."""


@dataclass(frozen=True)
class Shaping(Options):
    """Parameters of the conversion of a foreign map to an environment."""

    simplify: float | None = None
    """Maximum distance by which walls may move to save vertices, m (default: 0.02, or one cell of a grid)."""
    specks: float | None = None
    """Minimum area of obstacles, m² (default: 0, but single cells of ROS maps and JPEGs are dropped)."""
    keep: Literal["largest", "all"] = "largest"
    """Components of the free space to keep; with robots, the largest is the one with the most robots."""
    inside: tuple[float, float] | None = field(default=None, metadata={"metavar": "X Y"})
    """Keep the component that contains this point, m, instead of the largest."""
    hull: bool = False
    """Use the convex hull of the free space as boundary instead of its outline."""
    margin: float = 0.0
    """Thickness of the solid margin around the free space, m."""
    radius: float = DEFAULT_RADIUS_M
    """Radius of a robot, m; passages in which it fits stay open."""
    default_start: Literal["room", "uniform"] = "room"
    """Default start of the map: a disc around the widest point, or anywhere."""

    def __post_init__(self) -> None:
        self.require_ranges(
            simplify=(0, 10, "m"), specks=(0, 1e6, "m²"), margin=(0, 100, "m"), radius=(1e-3, 100, "m")
        )
        if self.inside is None:
            return
        if len(self.inside) != 2 or not all(abs(value) <= MAX_COORDINATE_M for value in self.inside):
            expected = f"expected two numbers from {-MAX_COORDINATE_M:.0f} to {MAX_COORDINATE_M:.0f} (m)"
            raise ParameterError(f"inside: {expected}, got {quote(self.inside)}")
        if self.keep == "all":
            raise ParameterError("keep: expected largest with the option inside, got all")


@dataclass(eq=False)
class Conversion:
    """A foreign map that is being converted.

    Attributes
    ----------
    foreign : ForeignMap
    shaping : Shaping
    source_name : str
        The file, for messages.
    repaired, dropped, changed, notes : list of str
        Lines of the import report.
    """

    foreign: ForeignMap
    shaping: Shaping
    source_name: str
    repaired: list[str] = field(init=False)
    dropped: list[str] = field(init=False)
    changed: list[str] = field(init=False)
    notes: list[str] = field(init=False)

    def __post_init__(self) -> None:
        self.repaired = [*self.foreign.repaired]
        self.dropped = [*self.foreign.dropped]
        self.changed = []
        self.notes = [*self.foreign.notes]

    @property
    def radius(self) -> float:
        """Radius of a robot, m."""
        return self.shaping.radius

    @property
    def clearance(self) -> float:
        """Minimum distance between a wall and the center of a robot at its start, m.

        It is at least the distance that map files require for a robot of the default radius.
        """
        return max(DEFAULT_RADIUS_M, self.radius) * (1 + MIN_START_GAP_RADII)

    @property
    def min_obstacle_area(self) -> float:
        """Area below which obstacles are dropped as specks, m²."""
        return get_or_default(self.shaping.specks, self.foreign.specks)

    @cached_property
    def digits(self) -> int:
        """Number of decimals of coordinates."""
        cell = self.foreign.cell
        grid = _MAX_GRID_M if cell is None else min(_MAX_GRID_M, cell / 100)
        return -math.floor(math.log10(grid) + 1e-9)

    @property
    def grid(self) -> float:
        """Resolution of the coordinates of the map, m."""
        return 10.0**-self.digits

    @property
    def tolerance(self) -> float:
        """Distance by which walls may move, m: at most a cell, and at most the diameter of a robot."""
        if self.shaping.simplify is not None:
            return self.shaping.simplify
        if self.foreign.cell is None:
            return DEFAULT_TOLERANCE_M
        return min(self.foreign.cell, 2 * self.radius)

    def require_at_most(self, maximum: int, count: int, noun: str) -> None:
        """Raise MapError if there are more than `maximum` obstacles or vertices."""
        if count > maximum:
            hint = "--specks AREA drops small obstacles, --simplify METERS draws walls with fewer vertices"
            raise MapError(f"{self.source_name}: expected at most {maximum} {noun}, got {count}: {hint}")
