"""Faults of a user's controller, told in one line."""

from __future__ import annotations

import traceback
from pathlib import Path

from robocov.errors import ParameterError

MODULE = "robocov_user_"
"""Prefix of the names of modules loaded from files of users."""

_OURS = str(Path(__file__).parents[1])


def fault_of(where: str, error: BaseException, when: str = "") -> ParameterError:
    """Return the error that tells what went wrong in code that is not ours, and in which line of it.

    Parameters
    ----------
    where : str
        What the message begins with: whose code, and what it was to do.
    error : BaseException
        As it was caught, with its traceback.
    when : str
        What the message ends with.
    """
    frames = _frames(error)
    theirs = [frame for frame in frames if frame[0].startswith(MODULE)]
    theirs = theirs or [frame for frame in frames if not frame[1].startswith((_OURS, "<"))]
    at = f" ({Path(theirs[-1][1]).name}, line {theirs[-1][2]})" if theirs else ""
    return ParameterError(f"{where}: {type(error).__name__}: {error}{at}{when}")


def users_fault(error: BaseException) -> ParameterError | None:
    """Return what tells of an error that came up in a user's file; None where it did elsewhere."""
    theirs = any(frame[0].startswith(MODULE) for frame in _frames(error))
    return fault_of("a controller of your own", error) if theirs else None


def _frames(error: BaseException) -> list[tuple[str, str, int]]:
    """Return module, file and line of each call that led to an error."""
    return [
        (str(frame.f_globals.get("__name__")), frame.f_code.co_filename, line)
        for frame, line in traceback.walk_tb(error.__traceback__)
    ]
