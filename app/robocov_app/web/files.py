"""Uploads to and downloads from a served window; all files are in its folder."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from zipfile import ZIP_DEFLATED, ZipFile

from robocov.errors import InputError, OutputError, RobocovError, describe_error
from robocov.files.result_folder import MANIFEST_FILE
from robocov.files.writing import replace_file
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.dialogs import MAX_FOLDER_ENTRIES

MAX_DOWNLOAD_BYTES = 1 << 28
MAX_NAME_BYTES = 200
_IMAGE_SUFFIXES = "png jpg jpeg bmp gif webp tif tiff pgm"
_MAP_SUFFIXES = "json geojson wkt svg dxf yaml yml tmx osm map scen world argos xml"
UPLOAD_SUFFIXES = frozenset(f".{suffix}" for suffix in f"robocov {_IMAGE_SUFFIXES} {_MAP_SUFFIXES}".split())
_OFFERED_SUFFIXES = UPLOAD_SUFFIXES | {".mp4", ".csv", ".html", ".pdf", ".zip"}
_MAX_OFFERED = 20


class TransferError(RobocovError):
    """A file cannot be uploaded or downloaded; the message is shown in the page."""


def prepare_folder(folder: Path) -> None:
    """Create the folder of a served window, and check that files can be written to it.

    Raises
    ------
    InputError
        If the path is not a folder, or the folder cannot be created or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder, prefix=".robocov-"):
            pass
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"--folder: {folder}: not a folder; choose another --folder") from None
    except OSError as error:
        raise InputError(
            f"--folder: {folder}: cannot be written to: {describe_error(error)}; choose another --folder"
        ) from None


class Upload:
    """A file that arrives from a page in pieces.

    Parameters
    ----------
    name : str
        Name of the file.
    size : int
        Its size in bytes.
    is_rejected : bool
        Whether the file is rejected. Its pieces are discarded, since the page may already have sent them.
    """

    def __init__(self, name: str, size: int, *, is_rejected: bool) -> None:
        self.name = name
        self.is_rejected = is_rejected
        self._remaining = size
        self._pieces: list[bytes] = []

    @property
    def is_complete(self) -> bool:
        """Whether all of the file has arrived."""
        return self._remaining == 0

    def add(self, piece: bytes) -> None:
        """Add the next piece; raise `ValueError` if the file exceeds the announced size."""
        if len(piece) > self._remaining:
            raise ValueError(f"{self.name}: larger than announced")
        self._remaining -= len(piece)
        if not self.is_rejected:
            self._pieces.append(piece)

    def save(self, folder: Path) -> Path:
        """Write the file under an unused name, and return its path; raise `TransferError` on failure."""
        path = folder / self.name
        try:
            # A broken symbolic link also counts as an existing file, as in `find_free_path`.
            if os.path.lexists(path):
                path = find_free_path(folder, path.stem, path.suffix)
            with replace_file(path) as temporary:
                temporary.write_bytes(b"".join(self._pieces))
        except OSError as error:
            raise TransferError(
                f"{self.name}: cannot be saved on the server: {describe_error(error)}"
            ) from error
        except OutputError as error:
            # The message of the error contains a path of the server, which the user of the page must not see.
            # The message of its cause contains only the reason.
            cause = error.__cause__
            reason = describe_error(cause) if isinstance(cause, OSError) else str(error)
            raise TransferError(f"{self.name}: cannot be saved on the server: {reason}") from error
        return path


def check_name(name: str) -> None:
    """Raise `TransferError` if a file with this name cannot be uploaded."""
    path = Path(name)
    if not name or path.name != name or "\\" in name or name.startswith("."):
        raise TransferError("expected a file name without a folder")
    if not name.isprintable():
        raise TransferError("expected only printable characters in the file name")
    if len(name.encode()) > MAX_NAME_BYTES:
        raise TransferError(f"{name[:40]}…: the name is too long; expected at most {MAX_NAME_BYTES} bytes")
    if path.suffix.lower() not in UPLOAD_SUFFIXES:
        raise TransferError(f"{name}: expected a map, an image or a session (.robocov)")


def list_saved(
    folder: Path, since: float, uploads: Mapping[str, float] = MappingProxyType({})
) -> tuple[str, ...]:
    """Return the names of files and folders saved in a folder since a given time, newest first.

    Parameters
    ----------
    folder : Path
    since : float
        The time, s since the epoch.
    uploads : mapping of str to float
        Modification time of each uploaded file by its name. Uploads are omitted unless they were saved again.
    """
    try:
        paths = list(islice(folder.iterdir(), MAX_FOLDER_ENTRIES))
    except OSError:
        return ()
    dated_names: list[tuple[float, str]] = []
    for path in paths:
        # Broken links, folders that cannot be read, and files that have just been removed are left out.
        with suppress(OSError):
            time = path.stat().st_mtime
            is_recent = time >= since and uploads.get(path.name) != time
            if is_recent and _is_offered(path):
                dated_names.append((time, path.name))
    dated_names.sort(reverse=True)
    return tuple(name for _, name in dated_names[:_MAX_OFFERED])


def _is_offered(path: Path) -> bool:
    """Return whether a path is a result folder or a file of a kind that pages may download."""
    if path.name.startswith("."):
        return False
    if path.is_dir():
        return (path / MANIFEST_FILE).exists()
    return path.suffix.lower() in _OFFERED_SUFFIXES


def read_saved(path: Path) -> tuple[str, bytes]:
    """Return the name and the content of a download: a file, or a folder as a zip archive.

    Raises
    ------
    TransferError
        If it cannot be read, or is larger than `MAX_DOWNLOAD_BYTES`.
    """
    try:
        if path.is_dir():
            entries = sorted(path.rglob("*"))
            members = [entry for entry in entries if entry.is_file() and not entry.is_symlink()]
        else:
            members = [path]
        if sum(member.stat().st_size for member in members) > MAX_DOWNLOAD_BYTES:
            limit = f"{MAX_DOWNLOAD_BYTES >> 20} MB"
            raise TransferError(
                f"{path.name}: larger than {limit}; copy it directly from the server's folder"
            )
        if path.is_dir():
            return f"{path.name}.zip", _zip_files(members, path.parent)
        return path.name, path.read_bytes()
    except OSError as error:
        raise TransferError(f"{path.name}: cannot be read: {describe_error(error)}") from error


def _zip_files(members: list[Path], root: Path) -> bytes:
    """Return a zip archive of files with their paths relative to a root folder."""
    archive = BytesIO()
    with ZipFile(archive, "w", ZIP_DEFLATED, strict_timestamps=False) as target:
        for path in members:
            target.write(path, path.relative_to(root))
    return archive.getvalue()
