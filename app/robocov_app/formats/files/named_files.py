"""Files that a foreign file names: pictures, tilesets and included worlds."""

from contextlib import suppress
from pathlib import Path, PureWindowsPath

from robocov.errors import MapError, quote
from robocov_app.formats.files.reading import require_regular_file

MAX_INCLUDED_FILES = 200
"""Maximum number of files that a map may include. A file that is read twice counts twice."""
MAX_INCLUDED_BYTES = 20_000_000
"""Maximum total size of all included files."""
_MAX_PATH_CHARACTERS = 400


class IncludeBudget:
    """Limit on the files that a map includes: with nested includes, a few kB can name billions of files.

    Parameters
    ----------
    max_files : int
        Number of files that may be read. A file that is included twice counts twice.
    max_bytes : int
        Total size that may be read.
    """

    def __init__(self, max_files: int = MAX_INCLUDED_FILES, max_bytes: int = MAX_INCLUDED_BYTES) -> None:
        self.max_files = max_files
        self.max_bytes = max_bytes
        self.files_read = 0
        self.bytes_read = 0

    def count_file(self, path: Path, location: str) -> None:
        """Count a file that is about to be read.

        Parameters
        ----------
        path : Path
        location : str
            Location at which the file is named, for messages.

        Raises
        ------
        MapError
            If the map includes too many files or too many bytes, or the file cannot be read.
        """
        require_regular_file(path)
        self.files_read += 1
        self.bytes_read += path.stat().st_size
        if self.files_read > self.max_files:
            expected = f"expected at most {self.max_files} (a file read twice counts twice)"
            raise MapError(f"{location}: included files: {expected}, got more")
        if self.bytes_read > self.max_bytes:
            expected = f"expected at most {self.max_bytes / 1e6:g} MB in total"
            raise MapError(f"{location}: included files: {expected}, got more")


def find_named_file(
    path: Path, name: str, kind: str, *, location: str, notes: list[str], allow_anywhere: bool
) -> Path:
    """Return the path of a file that is named in another file.

    Programs store the path that a file had when the map was saved, and files may have moved since. If there
    is no file at that path, a file of the same name next to `path` is returned instead, and a note says so.

    Parameters
    ----------
    path : Path
        The file that contains the name.
    name : str
        Name, relative to the folder of `path`.
    kind : str
        Kind of the file, such as "image", for messages.
    location : str
        Place of the name, for messages.
    notes : list of str
        Notes of the import. One is appended if the file next to `path` is used instead.
    allow_anywhere : bool
        Whether the file may be outside the folder of `path`.

    Raises
    ------
    MapError
        If the name is empty, too long or invalid, or if the file must be in the folder but is not.
    """
    if not name:
        raise MapError(f"{location}: empty, expected the name of the {kind}")
    if len(name) > _MAX_PATH_CHARACTERS:
        raise MapError(f"{location}: {quote(name)}: expected a shorter name, got {len(name)} characters")
    named = path.parent / name
    # PureWindowsPath separates folders at both kinds of slashes.
    neighbor = path.parent / PureWindowsPath(name).name
    try:
        is_allowed = allow_anywhere or _is_inside(named, path.parent)
        is_usable = is_allowed and _exists(named)
        if not is_usable and neighbor.is_file() and _is_inside(neighbor, path.parent):
            key = location.rpartition(": ")[2]
            note = f"{key}: {quote(name)} not found, used {quote(neighbor.name)} next to the file"
            if note not in notes:
                notes.append(note)
            return neighbor
    except (OSError, ValueError, RuntimeError) as error:
        raise MapError(f"{location}: {quote(name)}: {_describe_name_error(error)}") from None
    if not is_allowed:
        expected = f"expected the {kind} in it (--anywhere allows it)"
        raise MapError(f"{location}: {quote(name)} is outside the folder of the file, {expected}")
    return named


def _describe_name_error(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return "not a valid file name"


def _is_inside(path: Path, folder: Path) -> bool:
    return path.resolve().is_relative_to(folder.resolve())


def _exists(path: Path) -> bool:
    """Return whether a path exists; raise OSError if that is unknown, for example because it is too long."""
    with suppress(FileNotFoundError, NotADirectoryError):
        path.stat()
        return True
    return False
