"""Shrink inputs that fail, by delta debugging.

A. Zeller and R. Hildebrandt, *Simplifying and isolating failure-inducing input*, IEEE Transactions on
Software Engineering 28, 2002.
"""

import time
from collections.abc import Callable

from fuzz_seeds import Case


def shrink(case: Case, fails: Callable[[Case], bool], seconds: float) -> Case:
    """Return a case that still fails, after removing lines and then bytes from its files.

    Parameters
    ----------
    case : Case
        Case that fails.
    fails : callable
        Returns whether a case fails in the same way.
    seconds : float, s
        Maximum time.
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
    """Remove ever shorter runs of parts from a file as long as the case fails."""
    parts = split(case.files[name])
    count = max(len(parts) // 2, 1)
    while parts and time.monotonic() < deadline:
        start = 0
        is_smaller = False
        while start < len(parts) and time.monotonic() < deadline:
            remaining = parts[:start] + parts[start + count :]
            smaller = case.with_file(name, b"".join(remaining))
            if fails(smaller):
                case = smaller
                parts = remaining
                is_smaller = True
            else:
                start += count
        if count == 1 and not is_smaller:
            break
        count = max(count // 2, 1)
    return case
