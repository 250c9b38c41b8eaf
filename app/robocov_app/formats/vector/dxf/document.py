"""Detection of DXF files, and loading with ezdxf, within limits that are checked before it parses them."""

import logging
import re
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

from robocov.errors import MapError, RobocovError, describe_error, to_one_line
from robocov.optional_imports import import_optional
from robocov_app.formats import files

MAX_LINES = 8_000_000
"""Maximum number of lines of text. A LINE entity takes about 24 of them, a vertex 4."""
MAX_ENTITIES = 50_000
"""Maximum number of entities on all layers: ezdxf takes an eighth of a millisecond and 5 kB for each."""
BINARY = b"AutoCAD Binary DXF"
"""First bytes of a binary file."""
TEXT = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:999[ \t]*\r?\n[^\n]*\n\s*)*0[ \t]*\r?\n[ \t]*SECTION\b")
"""Start of a text file: a section, possibly after comments."""
_ENTITY = re.compile(rb"\n[ \t]*0[ \t]*\r?\n[ \t]*[A-Z]")
_POINT = re.compile(rb"\n[ \t]*10[ \t]*\r?\n")
_MAX_REASON_CHARACTERS = 200


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return head.startswith(BINARY) or TEXT.match(head) is not None


def load_document(path: Path, source_name: str) -> Any:
    """Load a drawing, and repair it if it is damaged.

    Parameters
    ----------
    path : Path
    source_name : str
        The file, for messages.

    Returns
    -------
    ezdxf.document.Drawing

    Raises
    ------
    MapError
        If the file cannot be read, is too large, or ezdxf is not installed.
    """
    _require_limits(files.read_content(path, files.MAX_TEXT_BYTES), source_name)
    try:
        ezdxf = import_optional("ezdxf", "dxf")
        recover = import_optional("ezdxf.recover", "dxf")
    except RobocovError as error:
        raise MapError(f"{source_name}: {error}") from None
    # ezdxf logs its repairs; without a handler, they would appear among the messages of a command.
    logging.getLogger("ezdxf").addHandler(logging.NullHandler())

    def repair(path: Path) -> Any:
        document, _ = recover.readfile(path)
        return document

    readers: tuple[Callable[[Path], Any], ...] = (ezdxf.readfile, repair)
    reason = ""
    for read in readers:
        try:
            return read(path)
        except Exception as error:  # ezdxf raises exceptions of any type for a damaged file
            if isinstance(error, OSError) and error.errno is not None:
                raise MapError(f"{source_name}: cannot be read: {describe_error(error)}") from None
            # Without a number, an OSError of ezdxf only means that the file does not begin as it expects.
            reason = to_one_line(error) or type(error).__name__
    reason = reason[:_MAX_REASON_CHARACTERS]
    raise MapError(f"{source_name}: expected a readable DXF, got a damaged one: {reason}")


def _require_limits(content: bytes, source_name: str) -> None:
    """Raise MapError if a file is not a DXF, or would take too long to parse."""
    if not content.startswith(BINARY):
        if not TEXT.match(content):
            raise MapError(
                f"{source_name}: expected a DXF with sections, got a file that begins with {content[:20]!r}"
            )
        if _count_matches(_ENTITY, content, MAX_ENTITIES) > MAX_ENTITIES:
            raise MapError(f"{source_name}: expected at most {MAX_ENTITIES} entities, got more")
        files.require_vertices(_count_matches(_POINT, content, files.MAX_VERTICES), source_name)
    lines = content.count(b"\n")
    if lines > MAX_LINES:
        raise MapError(f"{source_name}: expected at most {MAX_LINES} lines, got {lines}")


def _count_matches(pattern: re.Pattern[bytes], content: bytes, limit: int) -> int:
    """Return the number of matches, or `limit` + 1 if there are more."""
    return sum(1 for _ in islice(pattern.finditer(content), limit + 1))
