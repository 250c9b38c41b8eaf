"""Sketches in files: opened, saved whole or not at all, and noticed when something else changes them."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Literal, TypeAlias

from robocov.errors import MapError, OutputError, one_line
from robocov.files.atomic import writable, written
from robocov.files.strictjson import read_bytes
from robocov_app.editor.model.parser import parse_sketch
from robocov_app.editor.model.sketch import Sketch, sketch_text

State: TypeAlias = Literal["same", "changed", "gone"]


class ChangedError(OutputError):
    """A file is not as it was when it was read or written last, or there is one that was not known of."""


@dataclass(frozen=True)
class OnDisk:
    """A file as it was when it was read or written."""

    path: Path  # absolute
    digest: str  # SHA-256 of its content
    stamp: tuple[int, int]  # (size, time of change in ns); what can be asked of the file quickly


def opened(path: Path) -> tuple[Sketch, OnDisk]:
    """Return the sketch in a map file, which may be a draft, and what the file was like."""
    path = path.absolute()
    # the stamp of before: what changes while it is read is noticed at the next look
    stamp = _stamp(path)
    content = read_bytes(path)
    return parse_sketch(content, str(path), path.parent), OnDisk(path, _digest(content), stamp or (-1, 0))


def saved(sketch: Sketch, path: Path, before: OnDisk | None = None, *, over: bool = False) -> OnDisk:
    """Write a sketch to a file, whole or not at all; through a link, the file that it points to.

    ChangedError, unless `over`, when the file is not as it was `before`, or was not known of.
    """
    path = path.absolute()
    text = sketch_text(sketch).encode()
    writable(path)
    if not over:
        _require_same(path, before)
    with written(path) as part:
        part.write_bytes(text)
    return OnDisk(path, _digest(text), _stamp(path) or (-1, 0))


def state_of(before: OnDisk) -> State:
    """Return whether a file is still as it was, quickly; one that was merely touched is the same."""
    stamp = _stamp(before.path)
    if stamp is None:
        return "gone"
    if stamp == before.stamp:
        return "same"
    try:
        content = read_bytes(before.path)
    except MapError:
        return "changed" if _stamp(before.path) else "gone"
    return "same" if _digest(content) == before.digest else "changed"


def _require_same(path: Path, before: OnDisk | None) -> None:
    where = one_line(path)
    if before is None or before.path != path:
        if _stamp(path) is not None:
            raise ChangedError(f"{where}: there is such a file already")
    elif state_of(before) == "changed":
        raise ChangedError(f"{where}: has been changed by something else since it was opened or saved here")


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    return status.st_size, status.st_mtime_ns


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()
