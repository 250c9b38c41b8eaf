"""Files that are watched: their changes, however editors write them."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

INTERVAL = 0.25
"""Seconds between two looks at the files. A look costs microseconds, and a save is noticed at once."""

SETTLED = 0.1
"""Seconds for which a file must be as it is: editors write in pieces, or remove a file and rename another."""

LONGEST = 2.0  # seconds after which a file that never settles counts as changed all the same

_State: TypeAlias = tuple[int, int, int, int] | None


def changes(
    paths: Sequence[Path], *, sleep: Callable[[float], None] = time.sleep
) -> Iterator[tuple[Path, ...]]:
    """Yield the files, or links to them, that were written, removed or replaced; at first all; for ever."""
    seen = {path: _state(path) for path in paths}
    yield tuple(paths)
    while True:
        sleep(INTERVAL)
        changed = [path for path in paths if _state(path) != seen[path]]
        if not changed:
            continue
        waited = 0.0
        while waited < LONGEST:
            now = {path: _state(path) for path in paths}
            sleep(SETTLED)
            waited += SETTLED
            if all(_state(path) == now[path] for path in paths):
                break
        # noted before anything is read: what is written from now on is another change
        now = {path: _state(path) for path in paths}
        changed = [path for path in paths if path in changed or now[path] != seen[path]]
        seen = now
        yield tuple(changed)


def _state(path: Path) -> _State:
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino, found.st_dev
