"""Checks of files before a window opens them."""

from pathlib import Path

from robocov.errors import MapError, describe_error, to_one_line


def require_regular_file(path: Path) -> None:
    """Raise MapError if a path is a broken link, or a pipe or device, which would block the window.

    A folder, or a path that does not exist, passes: reading it raises an error anyway.
    """
    try:
        exists = path.exists()
        is_broken_link = path.is_symlink() and not exists
        is_file = path.is_file() or path.is_dir()
    except (OSError, ValueError) as error:
        raise MapError(f"{to_one_line(path)}: cannot be read: {describe_error(error)}") from None
    if is_broken_link:
        raise MapError(f"{to_one_line(path)}: expected a file, got a broken link")
    if exists and not is_file:
        raise MapError(f"{to_one_line(path)}: expected a file, got a pipe or a device")
