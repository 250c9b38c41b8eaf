"""Watching files for changes, whether an editor overwrites or replaces them."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

POLLING_INTERVAL_S = 0.25
"""Time between two checks of the files; a check takes microseconds."""
SETTLING_TIME_S = 0.1
"""Time without changes after which a file counts as written; editors write in pieces, or rename files."""
MAX_SETTLING_TIME_S = 2.0
"""Time after which a file is reported even if it keeps changing."""
_State: TypeAlias = tuple[int, int, int, int] | None
"""Modification time, size, inode and device of a file; None if it does not exist."""


def watch_files(
    paths: Sequence[Path], *, sleep: Callable[[float], None] = time.sleep
) -> Iterator[tuple[Path, ...]]:
    """Watch files or links forever.

    Parameters
    ----------
    paths : sequence of Path
        The files or links.
    sleep : callable
        Called to wait for a number of seconds.

    Yields
    ------
    tuple of Path
        First all paths, then those that were written, removed or replaced.
    """
    known_states = [_get_state(path) for path in paths]
    yield tuple(paths)
    while True:
        sleep(POLLING_INTERVAL_S)
        new_states = [_get_state(path) for path in paths]
        if new_states == known_states:
            continue
        settled_states = _wait_until_unchanged(paths, new_states, sleep)
        changed = []
        for path, known, new, settled in zip(paths, known_states, new_states, settled_states, strict=True):
            if not known == new == settled:
                changed.append(path)
        # Later writes are reported as another change, even if they happen while the caller handles this one.
        known_states = settled_states
        yield tuple(changed)


def _wait_until_unchanged(
    paths: Sequence[Path], states: list[_State], sleep: Callable[[float], None]
) -> list[_State]:
    """Wait until the states of files stay the same, and return them."""
    waited = 0.0
    previous: list[_State] | None = None
    while waited < MAX_SETTLING_TIME_S and states != previous:
        sleep(SETTLING_TIME_S)
        waited += SETTLING_TIME_S
        previous = states
        states = [_get_state(path) for path in paths]
    return states


def _get_state(path: Path) -> _State:
    """Return properties that change when a file is written or replaced; None if it does not exist."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino, status.st_dev
