"""What an import did to a foreign map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ImportReport:
    """What came of a foreign map, so that nothing is repaired in silence.

    Attributes
    ----------
    source : str
        The file.
    format : str
        Name of its format.
    vertices_read, vertices_kept : int
        Vertices in the file, and in the map.
    area_read, area_kept : float, m²
        Free area that the file encloses, and that of the map.
    repaired, dropped : tuple of str
        What was changed and what was left out, one line each.
    """

    source: str
    format: str
    vertices_read: int
    vertices_kept: int
    area_read: float
    area_kept: float
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return the report for people, one fact a line."""
        return [
            f"{self.format}: {self.vertices_read} vertices read, {self.vertices_kept} kept; "
            f"free area {self.area_read:.4g} m² read, {self.area_kept:.4g} m² kept",
            *(f"repaired: {line}" for line in self.repaired),
            *(f"dropped: {line}" for line in self.dropped),
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
            "repaired": list(self.repaired),
            "dropped": list(self.dropped),
        }
