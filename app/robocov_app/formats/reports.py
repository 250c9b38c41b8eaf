"""Reports of imports and exports: sizes, losses and changes."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from robocov.errors import format_area, format_count

_JSON_KEYS = {
    "size": "size_m",
    "tolerance": "tolerance_m",
    "moved": "moved_m",
    "others": "other_parts_m",
    "area": "area_m2",
    "area_read": "area_read_m2",
    "area_kept": "area_kept_m2",
    "area_written": "area_written_m2",
    "moved_area": "moved_area_m2",
    "removed_area": "removed_area_m2",
}
"""JSON keys of the fields that have a unit."""


def _label_lines(label: str, lines: tuple[str, ...]) -> list[str]:
    return [f"{label}: {line}" for line in lines]


@dataclass(frozen=True)
class _Report:
    """A report that can be written as JSON."""

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a JSON document, with units in the key names."""
        document: dict[str, Any] = {}
        for report_field in fields(self):
            value = getattr(self, report_field.name)
            if isinstance(value, tuple):
                value = [str(item) if isinstance(item, Path) else item for item in value]
            document[_JSON_KEYS.get(report_field.name, report_field.name)] = value
        return document


@dataclass(frozen=True)
class ImportReport(_Report):
    """Report of an import, so that nothing is repaired silently.

    Attributes
    ----------
    source, format : str
        File and name of its format.
    vertices_read, vertices_kept : int
    area_read, area_kept : float, m²
        Free area in the file and in the map.
    size : (width, height), m
        Size of the boundary.
    obstacles : int
    tolerance : float, m
        Distance by which the simplification was allowed to move walls.
    moved_area : float, m²
        Area that the simplification made free or solid.
    moved : float, m
        Maximum distance by which the simplification moved a wall: a Hausdorff distance.
    removed, removed_area : int, float m²
        Number and area of removed hairs: slits and spurs thinner than the resolution of coordinates.
    others : tuple of (x, y), m
        A point in each large part of the free space that was left out, for `Shaping.inside`.
    repaired, dropped, changed, notes : tuple of str
        Repairs, losses, changes on purpose (simplified, grown), and remarks; one line each.
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

    def format_lines(self) -> list[str]:
        """Return the report as lines of text: two lines of facts, then one line for each remark."""
        area_read = format_area(self.area_read)
        area_kept = format_area(self.area_kept)
        width, height = self.size
        return [
            f"{self.format}: {self.vertices_read} vertices read, {self.vertices_kept} kept; "
            f"free area {area_read} read, {area_kept} kept",
            f"{width:.4g} x {height:.4g} m, {format_count(self.obstacles, 'obstacle')}",
            *self.format_remarks(),
        ]

    def format_remarks(self) -> list[str]:
        """Return the repairs, losses, changes and notes, one line each."""
        return [
            *_label_lines("repaired", self.repaired),
            *_label_lines("dropped", self.dropped),
            *_label_lines("changed", self.changed),
            *_label_lines("note", self.notes),
        ]


@dataclass(frozen=True)
class ExportReport(_Report):
    """Report of an export.

    Attributes
    ----------
    format : str
        Name of the format.
    files : tuple of Path
        Written files, the requested one first.
    area, area_written : float, m²
        Free area of the map and of the written file.
    dropped : tuple of str
        Properties of the map that the format cannot express.
    notes : tuple of str
        Remarks.
    warnings : tuple of str
        Passages that robots can no longer drive through.
    """

    format: str
    files: tuple[Path, ...]
    area: float
    area_written: float
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def format_lines(self) -> list[str]:
        """Return the report as lines of text."""
        area = format_area(self.area)
        area_written = format_area(self.area_written)
        return [
            f"{self.format}: free area {area}, written {area_written}",
            *_label_lines("dropped", self.dropped),
            *_label_lines("note", self.notes),
            f"saved in {', '.join(map(str, self.files))}",
        ]
