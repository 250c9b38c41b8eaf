"""Number of entities in a drawing after its blocks are expanded."""

from collections.abc import Iterable
from typing import Any

from robocov.errors import MapError, quote
from robocov_app.formats import files

MAX_DRAWN_ENTITIES = 200_000
"""Maximum number of entities drawn, including those of inserted blocks."""
_MAX_PRINTED_COUNT = 10**300
"""Maximum number that is printed: nested blocks may expand to more entities than a float can represent."""


def require_few_entities(document: Any, source_name: str) -> None:
    """Check the number of entities to draw before drawing them: a few kB of blocks may expand to billions.

    Parameters
    ----------
    document : ezdxf.document.Drawing
    source_name : str
        The file, for messages.

    Raises
    ------
    MapError
        If there are more than `MAX_DRAWN_ENTITIES`, or a block is inserted into itself.
    """
    count = _EntityCounter(document, source_name).count(document.modelspace())
    if count > MAX_DRAWN_ENTITIES:
        expected = f"expected at most {MAX_DRAWN_ENTITIES} entities to draw, including those in blocks"
        raise MapError(f"{source_name}: {expected}, got {min(count, _MAX_PRINTED_COUNT):.3g}")


class _EntityCounter:
    """Counts entities, including those of inserted blocks. Each block is counted only once."""

    def __init__(self, document: Any, source_name: str) -> None:
        self._document = document
        self._source_name = source_name
        self._counts: dict[str, int] = {}
        self._open_blocks: list[str] = []

    def count(self, entities: Iterable[Any]) -> int:
        """Return the number of entities to draw, including those of inserted blocks."""
        total = 0
        for entity in entities:
            total += self._count_insert(entity) if entity.dxftype() == "INSERT" else 1
        return total

    def _count_insert(self, insert: Any) -> int:
        """Return the number of entities that an insert of a block adds, at all of its positions."""
        name = str(insert.dxf.get("name", "")).casefold()
        if name in self._open_blocks:
            raise MapError(f"{self._source_name}: block {quote(name)} is inserted into itself")
        if len(self._open_blocks) >= files.MAX_DEPTH:
            raise MapError(f"{self._source_name}: blocks are nested deeper than {files.MAX_DEPTH}")
        if name not in self._counts:
            block = self._document.blocks.get(name)
            self._open_blocks.append(name)
            self._counts[name] = 0 if block is None else self.count(block)
            self._open_blocks.pop()
        rows = int(insert.dxf.get("row_count", 1))
        columns = int(insert.dxf.get("column_count", 1))
        return max(rows, 1) * max(columns, 1) * (1 + self._counts[name])
