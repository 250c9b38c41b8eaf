"""A foreign map as its reader understood it, and the report of what became of it."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

from shapely import MultiPolygon, Polygon

from robocov.errors import counted
from robocov_app.formats.geometry.primitives import Primitive


@dataclass(frozen=True, eq=False)
class ForeignMap:
    """What a reader found in a file. Readers only read: `robocov_app.formats.geometry.conversion` cleans.

    `free`, m, y up: may be invalid, empty, of many parts, and stick out of `boundary`. `boundary`, m: what is
    inside of it and not free becomes obstacles; without it the outline of the free space is the boundary.
    `vertices_read`: of a raster, corners of the outline of its free cells. `cell`, m: the longer side of one.
    `specks`, m²: smaller obstacles are noise of how such maps are made. `cut_corners`: by a step or two of a
    grid, so that `geometry.simplify.sharpened` makes them whole. `primitives`: obstacles that the file draws
    as such, not in `free`, kept instead of the polygons that they cover where nothing speaks against it.
    `robots`, (n, 2) m: where the file places some. `repaired`, `dropped`, `notes`: a line each, with counts.
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


_KEYS = {name: f"{name}_m" for name in ("size", "tolerance", "moved")} | {"others": "other_parts_m"}
_KEYS |= {name: f"{name}_m2" for name in ("area", "area_read", "area_kept", "area_written", "moved_area")}


def document_of(report: Any) -> dict[str, Any]:
    """Return a report, a dataclass, as a JSON document, with units in the key names."""
    given = {_KEYS.get(each.name, each.name): getattr(report, each.name) for each in fields(report)}
    return {key: list(value) if isinstance(value, tuple) else value for key, value in given.items()}


def told(**lines: Iterable[str]) -> list[str]:
    """Return lines, each after the word for its kind."""
    return [f"{kind}: {line}" for kind, some in lines.items() for line in some]


def square_metres(area: float, digits: int = 4) -> str:
    """Return an area with so many digits, and never as a power of ten.

    >>> square_metres(30083.2), square_metres(0.123456)
    ('30083 m²', '0.1235 m²')
    """
    return f"{area:.0f} m²" if area >= 1000 else f"{area:.{digits}g} m²"


@dataclass(frozen=True)
class ImportReport:
    """What came of a foreign map, so that nothing is repaired in silence; lengths in m, areas in m².

    `changed`: on purpose (simplified, grown). `size`: of the boundary. `tolerance`: by how much walls were
    allowed to move. `moved_area`: was free and is not, or is and was not, for the simplification. `moved`: by
    how much a wall moved for it, at most. `others`: a place in each large part of the free space that was
    left out, as `Shaping.inside` takes it.
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
    others: tuple[tuple[float, float], ...] = ()
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return the report for people, one fact a line."""
        return [
            f"{self.format}: {self.vertices_read} vertices read, {self.vertices_kept} kept; "
            f"free area {square_metres(self.area_read)} read, {square_metres(self.area_kept)} kept",
            f"{self.size[0]:.4g} x {self.size[1]:.4g} m, {counted(self.obstacles, 'obstacle')}",
            *told(repaired=self.repaired, dropped=self.dropped, changed=self.changed, note=self.notes),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a JSON document, with units in the key names."""
        return document_of(self)
