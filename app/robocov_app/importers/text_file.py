"""Foreign text files: bytes to text, whatever wrote them."""

from __future__ import annotations

import codecs
from typing import TYPE_CHECKING

from robocov.errors import MapError, one_line
from robocov_app.importers import limits

if TYPE_CHECKING:
    from pathlib import Path

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def read_text(path: Path, separator: bytes) -> tuple[str, str]:
    """Return the text of a file, and what messages call it.

    Parameters
    ----------
    path : Path
    separator : bytes
        What stands between vertices: where there are too many, nothing is read.

    Raises
    ------
    MapError
        When it cannot be read, is too large, or is neither UTF-8 nor marked as UTF-16.
    """
    where = one_line(path)
    content = limits.content(path, limits.MAX_TEXT_BYTES)
    limits.require_vertices(content.count(separator), where)
    marked = (both for both in _MARKS if content.startswith(both[0]))
    mark, encoding = next(marked, (b"", "utf-8"))
    try:
        return content[len(mark) :].decode(encoding), where
    except UnicodeDecodeError as error:
        raise MapError(f"{where}: byte {error.start}: not {encoding.upper()}, but text was wanted") from None
