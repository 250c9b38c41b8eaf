"""Files that a window is asked to open."""

from pathlib import Path

from robocov.errors import MapError, describe_error, to_one_line


def require_regular_file(path: Path) -> None:
    """Raise MapError if a path names a pipe or a device, which would hold up the window, or no file at all.

    A path to nothing passes: what reads it says so in its own words.
    """
    try:
        exists = path.exists()
        is_broken_link = path.is_symlink() and not exists
        is_file = path.is_file() or path.is_dir()
    except (OSError, ValueError) as error:
        raise MapError(f"{to_one_line(path)}: cannot be read: {describe_error(error)}") from None
    if is_broken_link:
        raise MapError(f"{to_one_line(path)}: expected a file, got a link to nothing")
    if exists and not is_file:
        raise MapError(f"{to_one_line(path)}: expected a file, got a pipe or a device")
