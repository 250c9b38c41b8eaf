"""Number of entities that a drawing with blocks stands for."""

from collections.abc import Iterable
from typing import Any

from robocov.errors import MapError, quote
from robocov_app.formats import files

MAX_DRAWN_ENTITIES = 200_000
"""Largest number of entities drawn, including those of inserted blocks."""
_MAX_PRINTED_COUNT = 10**300
"""Blocks in blocks may stand for more entities than a float can express."""


def require_few_entities(document: Any, where: str) -> None:
    """Check the number of entities to be drawn, without drawing them: a few kB may stand for billions.

    Parameters
    ----------
    document : ezdxf.document.Drawing
    where : str
        The file, for messages.

    Raises
    ------
    MapError
        If there are more than `MAX_DRAWN_ENTITIES`, or a block is inserted into itself.
    """
    count = _EntityCounter(document, where).count(document.modelspace())
    if count > MAX_DRAWN_ENTITIES:
        actual = f"{min(count, _MAX_PRINTED_COUNT):.3g} entities to be drawn, including those in blocks"
        raise MapError(f"{where}: expected at most {MAX_DRAWN_ENTITIES}, got {actual}")


class _EntityCounter:
    """Counts entities, each block once."""

    def __init__(self, document: Any, where: str) -> None:
        self._document = document
        self._where = where
        self._counts: dict[str, int] = {}
        self._open_blocks: list[str] = []

    def count(self, entities: Iterable[Any]) -> int:
        """Return the number of entities that are drawn for some, with those of blocks."""
        total = 0
        for entity in entities:
            total += self._count_insert(entity) if entity.dxftype() == "INSERT" else 1
        return total

    def _count_insert(self, insert: Any) -> int:
        name = str(insert.dxf.get("name", "")).casefold()
        if name in self._open_blocks:
            raise MapError(f"{self._where}: block {quote(name)} is inserted into itself")
        if len(self._open_blocks) >= files.MAX_DEPTH:
            raise MapError(f"{self._where}: blocks are nested deeper than {files.MAX_DEPTH}")
        if name not in self._counts:
            block = self._document.blocks.get(name)
            self._open_blocks.append(name)
            self._counts[name] = 0 if block is None else self.count(block)
            self._open_blocks.pop()
        rows = int(insert.dxf.get("row_count", 1))
        columns = int(insert.dxf.get("column_count", 1))
        return max(rows, 1) * max(columns, 1) * (1 + self._counts[name])
