"""Files that appear whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robocov.errors import OutputError


@contextmanager
def written(target: Path, *, durable: bool = True) -> Iterator[Path]:
    """Give a path beside `target` to write to; rename it to `target` when all went well, else remove it.

    The path has the suffix of `target`, so that writers which go by it work. Unless `durable` is
    switched off, as for one of many frames, the file is on the disk before it gets its name.

    Raises
    ------
    OutputError
        When the file cannot be written (no permission, no space, no such folder); the message names `target`.
    """
    part = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        yield part
        if durable:
            with part.open("rb") as file:
                os.fsync(file.fileno())
        part.replace(target)
    except OSError as error:
        with suppress(OSError):  # where the folder is none, there is no part to be removed either
            part.unlink()
        raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error
    except BaseException:
        part.unlink(missing_ok=True)
        raise
