"""Inputs made smaller while the same goes wrong (A. Zeller and R. Hildebrandt, *Simplifying and isolating
failure-inducing input*, IEEE Transactions on Software Engineering 28, 2002).
"""

import time
from collections.abc import Callable

from fuzz_seeds import Case


def shrink(case: Case, fails: Callable[[Case], bool], seconds: float) -> Case:
    """Return a case that still fails, with less in its files: lines, then parts of lines, go.

    Parameters
    ----------
    case : Case
        That fails.
    fails : callable
    seconds : float
        After that it is left as it is.
    """
    deadline = time.monotonic() + seconds
    for name in case.files:
        for split in (_split_lines, _split_bytes):
            case = _shrink_file(case, name, split, fails, deadline)
    return case


def _split_lines(content: bytes) -> list[bytes]:
    return content.splitlines(keepends=True)


def _split_bytes(content: bytes) -> list[bytes]:
    return [content[k : k + 1] for k in range(len(content))]


def _shrink_file(
    case: Case,
    name: str,
    split: Callable[[bytes], list[bytes]],
    fails: Callable[[Case], bool],
    deadline: float,
) -> Case:
    parts = split(case.files[name])
    size = max(len(parts) // 2, 1)
    while parts and time.monotonic() < deadline:
        at = 0
        gone = False
        while at < len(parts) and time.monotonic() < deadline:
            fewer = parts[:at] + parts[at + size :]
            smaller = case.with_file(name, b"".join(fewer))
            if fails(smaller):
                case = smaller
                parts = fewer
                gone = True
            else:
                at += size
        if size == 1 and not gone:
            break
        size = max(size // 2, 1)
    return case
