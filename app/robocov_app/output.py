"""Result folders and the small text files in them."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from robocov.atomic import written
from robocov.errors import InputError, OutputError

_OURS = (
    *("run.json", "record.npz", "cost.csv", "run.mp4"),
    *("trajectories.png", "trajectories.svg", "cost.png", "cost.svg"),
    *("comparison.json", "comparison.csv", "comparison.mp4"),
)
"""Files that an earlier result in the same folder may have left; `--overwrite` removes these."""


def prepared(folder: Path, *, overwrite: bool) -> Path:
    """Create `folder`, or empty it of an earlier result.

    Files that are not robocov's stay.

    Raises
    ------
    InputError
        When the folder is not empty and `overwrite` is not given.
    OutputError
        When it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            if not overwrite:
                raise InputError(
                    f"{folder}: the folder is not empty; another --out, or --overwrite, was wanted"
                )
            _clear(folder)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{folder}: cannot be used for results: Permission denied")
    return folder


@contextmanager
def results(folder: Path, *, overwrite: bool) -> Iterator[Path]:
    """Give a prepared folder; where the work in it fails with nothing written, it goes again.

    Raises
    ------
    InputError, OutputError
        As `prepared`.
    """
    existed = folder.exists()
    prepared(folder, overwrite=overwrite)
    try:
        yield folder
    except BaseException:
        if not existed:
            with suppress(OSError):
                folder.rmdir()  # fails, as it should, where there is something in it
        raise


def _clear(folder: Path) -> None:
    for name in _OURS:
        (folder / name).unlink(missing_ok=True)
    for part in folder.glob(".*.part.*"):  # of a run that was killed
        part.unlink()
    frames = folder / "frames"
    if frames.is_dir():
        for picture in frames.glob("[0-9]*.png"):
            picture.unlink()
    for part in folder.iterdir():
        if part.is_dir() and (part / "run.json").is_file():
            _clear(part)
            if not any(part.iterdir()):
                shutil.rmtree(part)


def write_json(path: Path, content: Any) -> None:
    """Write `content` as JSON; whole or not at all."""
    with written(path) as part:
        part.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def write_csv(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    """Write rows under a header; numbers keep all their digits."""
    with written(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(header + "\n")
        for row in rows:
            file.write(",".join(str(cell) for cell in row) + "\n")


def finite(content: Any) -> Any:
    """Return JSON content with None for every number that is not finite: JSON has no other word for it."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content
