"""Files that are watched: their changes, however editors write them."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

INTERVAL = 0.25  # s between two looks at the files: a look costs microseconds, and a save is noticed at once
SETTLED = 0.1  # s for which a file must be as it is: editors write in pieces, or remove and rename
LONGEST = 2.0  # seconds after which a file that never settles counts as changed all the same


def changes(
    paths: Sequence[Path], *, sleep: Callable[[float], None] = time.sleep
) -> Iterator[tuple[Path, ...]]:
    """Yield the files, or links to them, that were written, removed or replaced; at first all; for ever."""
    seen = list(map(_state, paths))
    yield tuple(paths)
    while True:
        sleep(INTERVAL)
        first = now = list(map(_state, paths))
        if now == seen:
            continue
        waited, before = 0.0, None
        while waited < LONGEST and now != before:
            sleep(SETTLED)
            waited += SETTLED
            # noted before anything is read: what is written from now on is another change
            before, now = now, list(map(_state, paths))
        states = zip(paths, seen, first, now, strict=True)
        seen = now
        yield tuple(path for path, old, *new in states if new != [old, old])


def _state(path: Path) -> tuple[int, int, int, int] | None:
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino, found.st_dev
