"""A foreign map as its reader understood it, and the report of what became of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shapely import MultiPolygon, Polygon

from robocov.errors import counted
from robocov_app.formats.geometry.primitives import Primitive


@dataclass(frozen=True, eq=False)
class ForeignMap:
    """What a reader found in a file. Readers only read: `robocov_app.formats.geometry.shaping` cleans.

    `name`: the map's name, for people: from the file where it has one, else the file's stem. `description`: a
    sentence about it. `format`: name of its format, as in `robocov_app.formats.IMPORTERS`. `free`, m: what
    is free, y up. May be invalid (rings that cross themselves or each other), empty, of many parts, and may
    stick out of `boundary`: nothing is cleaned yet. `boundary`, m: the outer boundary where the format gives
    one; what is inside of it and not free becomes obstacles. Without it the outline of the free space is the
    boundary. `vertices_read`: vertices in the file; of a raster, corners of the outline of its free cells.
    `cell`, m: side of a cell, of rasters; of cells that are no squares the longer one. `specks`, m²: smaller
    obstacles are noise of how such maps are made, unless somebody says otherwise. `cut_corners`: whether
    corners are cut by a step or two of a grid: `robocov_app.formats.geometry.simplify.sharpened` makes them
    whole. `primitives`: obstacles that the file draws as such, with
    their names: they are not in `free`, and are kept instead of the polygons that they cover where nothing
    speaks against it. `robots`, (n, 2) m: where the file places robots. `repaired`, `dropped`, `notes`: what
    the reader had to put right, what it left out, and what is worth knowing besides (how unknown cells were
    taken, say): one line each, with counts and areas.
    """

    name: str
    description: str
    format: str
    free: MultiPolygon
    boundary: Polygon | None = None
    vertices_read: int = 0
    cell: float | None = None
    specks: float = 0.0
    cut_corners: bool = False
    primitives: tuple[Primitive, ...] = ()
    robots: tuple[tuple[float, float], ...] = ()
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def square_metres(area: float, digits: int = 4) -> str:
    """Return an area with so many digits, and never as a power of ten.

    >>> square_metres(30083.2), square_metres(0.123456)
    ('30083 m²', '0.1235 m²')
    """
    return f"{area:.0f} m²" if area >= 1000 else f"{area:.{digits}g} m²"


@dataclass(frozen=True)
class ImportReport:
    """What came of a foreign map, so that nothing is repaired in silence.

    `source`: the file. `format`: name of its format. `vertices_read`, `vertices_kept`: vertices in the file,
    and in the map. `area_read`, `area_kept`, m²: free area that the file encloses, and that of the map.
    `repaired`, `dropped`, `changed`, `notes`: what was put right, what was left out, what was changed on
    purpose (simplified, grown), and what is worth knowing besides; one line each. `size`, (width, height) m:
    of the map's boundary. `obstacles`: obstacles of the map. `tolerance`, m: by how much walls were allowed
    to move. `moved_area`, m²: area that was free and is not, or is and was not, for the simplification.
    `moved`, m: by how much a wall moved for it, at most. `others`, m: a place in each of the largest parts of
    the free space that were left out, as `Shaping.inside` takes it; empty where what was left out is not
    worth a word.
    """

    source: str
    format: str
    vertices_read: int
    vertices_kept: int
    area_read: float
    area_kept: float
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    size: tuple[float, float] = (0.0, 0.0)
    obstacles: int = 0
    tolerance: float = 0.0
    moved_area: float = 0.0
    moved: float = 0.0
    others: tuple[tuple[float, float], ...] = ()

    def lines(self) -> list[str]:
        """Return the report for people, one fact a line."""
        return [
            f"{self.format}: {self.vertices_read} vertices read, {self.vertices_kept} kept; "
            f"free area {square_metres(self.area_read)} read, {square_metres(self.area_kept)} kept",
            f"{self.size[0]:.4g} x {self.size[1]:.4g} m, {counted(self.obstacles, 'obstacle')}",
            *(f"repaired: {line}" for line in self.repaired),
            *(f"dropped: {line}" for line in self.dropped),
            *(f"changed: {line}" for line in self.changed),
            *(f"note: {line}" for line in self.notes),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a JSON document, with units in the key names."""
        return {
            "source": self.source,
            "format": self.format,
            "vertices_read": self.vertices_read,
            "vertices_kept": self.vertices_kept,
            "area_read_m2": self.area_read,
            "area_kept_m2": self.area_kept,
            "size_m": list(self.size),
            "obstacles": self.obstacles,
            "tolerance_m": self.tolerance,
            "moved_area_m2": self.moved_area,
            "moved_m": self.moved,
            "other_parts_m": [list(place) for place in self.others],
            "repaired": list(self.repaired),
            "dropped": list(self.dropped),
            "changed": list(self.changed),
            "notes": list(self.notes),
        }
