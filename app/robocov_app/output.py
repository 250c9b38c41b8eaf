"""Result folders and the small text files in them."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from robocov.errors import InputError, OutputError
from robocov.files.atomic import written

_OF_A_RUN = (
    *("run.json", "record.npz", "cost.csv", "metrics.csv", "run.mp4"),
    *("trajectories.png", "trajectories.svg", "cost.png", "cost.svg"),
)
_OF_A_COMPARISON = (
    *("comparison.json", "comparison.csv", "comparison.mp4"),
    *("trajectories.png", "trajectories.svg", "cost.png", "cost.svg"),
)
REPORT = "report.html"
"""A page about the results in the folder, which goes with them."""

_REPORT_HEAD = b'<meta name="generator" content="robocov'

_OF_A_REPLAY = ("replay.json", "run.mp4", "comparison.mp4")
"""Files that a result consists of, beside ``frames/`` and the folders of a comparison's runs."""


@contextmanager
def results(folder: Path, *, overwrite: bool) -> Iterator[Path]:
    """Give a folder for results; where the work in it fails with nothing written, it goes again.

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


def prepared(folder: Path, *, overwrite: bool) -> Path:
    """Create `folder`, or make sure that its content may be replaced; nothing is removed yet.

    Raises
    ------
    InputError
        When the folder is not empty and `overwrite` is not given, or what is in it is no result.
    OutputError
        When it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = any(folder.iterdir())
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
    if used and not overwrite:
        raise InputError(f"{folder}: the folder is not empty; another --out, or --overwrite, was wanted")
    if used and not _holds_result(folder):
        raise InputError(
            f"{folder}: what is in the folder is no result of robocov, so --overwrite leaves it alone; "
            f"another --out was wanted"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{folder}: cannot be used for results: Permission denied")
    return folder


def cleared(folder: Path) -> Path:
    """Remove the earlier result in `folder`, and nothing else; call it when there is a new one to write.

    Folders are removed only when they belong to that result and are empty then; links are not followed.

    Raises
    ------
    OutputError
        When something cannot be removed.
    """
    try:
        _clear(folder)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
    return folder


def _holds_result(folder: Path) -> bool:
    return any(
        _content(folder / f"{kind}.json", f"robocov-{kind}") is not None
        for kind in ("run", "comparison", "replay")
    )


def _content(path: Path, kind: str) -> dict[str, Any] | None:
    """Return the JSON object in a file of ours of this kind, None where it is something else."""
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) and content.get("format") == kind else None


def _clear(folder: Path) -> None:
    files: tuple[str, ...]
    comparison = _content(folder / "comparison.json", "robocov-comparison")
    if comparison is not None:
        for name in comparison.get("folders", ()):
            part = folder / Path(str(name)).name
            if part.is_dir() and not part.is_symlink() and _holds_result(part):
                _clear(part)
                with suppress(OSError):
                    part.rmdir()
        files = _OF_A_COMPARISON
    elif _content(folder / "run.json", "robocov-run") is not None:
        files = _OF_A_RUN
    elif _content(folder / "replay.json", "robocov-replay") is not None:
        files = _OF_A_REPLAY
    else:
        return
    for name in files:
        (folder / name).unlink(missing_ok=True)
    if is_report(folder / REPORT):
        (folder / REPORT).unlink()
    for part in folder.glob(".*.part.*"):  # of a run that was killed
        part.unlink()
    frames = folder / "frames"
    if frames.is_dir() and not frames.is_symlink():
        for picture in frames.glob("[0-9]*.png"):
            picture.unlink()
        with suppress(OSError):
            frames.rmdir()


def is_report(path: Path) -> bool:
    """Return whether a file is a page that ``robocov report`` has written."""
    try:
        with path.open("rb") as file:
            return _REPORT_HEAD in file.read(2000)
    except OSError:
        return False


def free_name(folder: Path, stem: str, suffix: str) -> Path:
    """Return a path that is not there yet: ``stem-1.suffix``, ``stem-2.suffix``, ..."""
    stem = stem.rstrip("0123456789").rstrip("-") or stem
    k = 1
    while (folder / f"{stem}-{k}{suffix}").exists():
        k += 1
    return folder / f"{stem}-{k}{suffix}"


def listed(folder: Path) -> str:
    """Return the names of what a result consists of, for people."""
    return ", ".join(sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")))


def write_json(path: Path, content: Any) -> None:
    """Write `content` as JSON; whole or not at all."""
    with written(path) as part:
        part.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def write_csv(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    """Write rows under a header; numbers keep all their digits."""
    with written(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(csv_text(header, rows))


def csv_text(header: str, rows: Iterable[Iterable[object]]) -> str:
    """Return what `write_csv` writes."""
    lines = [header, *(",".join(str(cell) for cell in row) for row in rows)]
    return "\n".join(lines) + "\n"


def finite(content: Any) -> Any:
    """Return JSON content with None for every number that is not finite: JSON has no other word for it."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content
