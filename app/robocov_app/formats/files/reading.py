"""Reading the bytes and the text of one file, within a size limit."""

import codecs
import stat
from pathlib import Path

from robocov.errors import MapError, describe_error, to_one_line
from robocov_app.formats.files.limits import MAX_FILE_BYTES, MAX_TEXT_BYTES, require_vertices

HEAD_BYTES = 1 << 20
"""Number of bytes at the start of a file from which its format is detected."""
_MAX_NAME_CHARACTERS = 60
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def read_head(path: Path, maximum: int = HEAD_BYTES) -> bytes:
    """Return the first bytes of a file.

    Parameters
    ----------
    path : Path
    maximum : int
        Number of bytes to read.

    Raises
    ------
    MapError
        If there is no regular file at `path`, or it cannot be read.
    """
    source_name = to_one_line(path)
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise MapError(f"{source_name}: expected a file, got a folder")
        if not stat.S_ISREG(mode):
            # Opening a pipe would block until another program writes to it.
            raise MapError(f"{source_name}: expected a file, got a pipe or a device")
        with path.open("rb") as file:
            return file.read(maximum)
    except FileNotFoundError:
        raise MapError(f"{source_name}: no such file") from None
    except (OSError, ValueError) as error:
        raise MapError(f"{source_name}: cannot be read: {describe_error(error)}") from None


def require_regular_file(path: Path) -> None:
    """Raise MapError if there is no regular file at a path, or it cannot be read."""
    read_head(path, 0)


def read_content(path: Path, maximum: int = MAX_FILE_BYTES) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    path : Path
    maximum : int
        Maximum accepted size, bytes.

    Raises
    ------
    MapError
        If the file is larger, or if it cannot be read.
    """
    require_regular_file(path)
    if path.stat().st_size <= maximum:
        # The file may have grown since: one byte more shows whether it has.
        content = read_head(path, maximum + 1)
        if len(content) <= maximum:
            return content
    raise MapError(f"{to_one_line(path)}: expected at most {maximum / 1e6:.3g} MB, got more")


def read_text(path: Path, separator: bytes) -> tuple[str, str]:
    """Return the text of a file, and the name of the file for messages.

    Parameters
    ----------
    path : Path
    separator : bytes
        Bytes between two vertices. They are counted to reject files with too many vertices before parsing.

    Raises
    ------
    MapError
        If the file is too large, has too many vertices, or is not text.
    """
    source_name = to_one_line(path)
    content = read_content(path, MAX_TEXT_BYTES)
    require_vertices(content.count(separator), source_name)
    encoding = "utf-8"
    for mark, marked_encoding in _BYTE_ORDER_MARKS:
        if content.startswith(mark):
            content = content.removeprefix(mark)
            encoding = marked_encoding
            break
    try:
        return content.decode(encoding), source_name
    except UnicodeDecodeError as error:
        raise MapError(f"{source_name}: byte {error.start}: not {encoding.upper()}, expected text") from None


def get_map_name(path: Path) -> str:
    """Return a name for a map whose file contains none: the file name without its suffix."""
    return to_one_line(path.stem)[:_MAX_NAME_CHARACTERS] or "map"


def starts_with(head: bytes, bracket: bytes) -> bool:
    """Return whether a text starts with a bracket, apart from a byte order mark and white space."""
    return head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == bracket
