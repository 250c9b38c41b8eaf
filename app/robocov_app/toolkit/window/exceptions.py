"""Unexpected exceptions in a window, which are logged with their traceback and reported in one sentence.

The log is the file `LOG_FILE` in the folder for drafts, or standard error if there is no such folder.
"""

import logging
import os
import sys
import traceback
from collections import Counter
from collections.abc import Callable
from logging.handlers import RotatingFileHandler
from pathlib import Path

from robocov.text import remove_controls

LOG_FILE = "errors.log"
_MAX_LOG_BYTES = 1_000_000
"""Maximum size of the log file; one older file of this size is kept."""
_MAX_MESSAGE_CHARS = 120
_MAX_LEVELS = 30
"""Maximum number of traceback entries that are logged; infinite recursion has thousands."""


class ExceptionLog:
    """Logs unexpected exceptions of a window.

    The same exception may be raised in every frame. Only its 1st, 10th, 100th, ... occurrence is logged.

    Parameters
    ----------
    folder : Path, optional
        Folder for the log file. By default exceptions are written to standard error.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.file = None if folder is None else folder / LOG_FILE
        self.count = 0
        self._counts = Counter[tuple[str, str, int]]()

    def record(self, error: BaseException, action: str) -> str:
        """Log an exception.

        Parameters
        ----------
        error : BaseException
        action : str
            Action of the window that failed, such as "drawing".

        Returns
        -------
        str
            One sentence with the exception and where the log is.
        """
        self.count += 1
        error_key = _build_key(error)
        self._counts[error_key] += 1
        count = self._counts[error_key]
        # True for the powers of ten: 1, 10, 100, ...
        if str(count).strip("0") == "1":
            self._write(error, action, count)
        message = remove_controls(" ".join(str(error).split()), single_line=True)[:_MAX_MESSAGE_CHARS]
        name = type(error).__name__
        if message:
            name = f"{name}: {message}"
        log = "the terminal" if self.file is None else str(self.file)
        return f"Internal error while {action} ({name}). Details: {log}."

    def attempt(self, action: str, call: Callable[[], object]) -> bool:
        """Call a function, and record any exception that it raises; return whether it succeeded."""
        try:
            call()
        except Exception as error:
            self.record(error, action)
            return False
        return True

    def _write(self, error: BaseException, action: str, count: int) -> None:
        """Write an exception with its traceback to the log; `count` is how often it has occurred."""
        repeated = f" (number {count})" if count > 1 else ""
        lines = traceback.format_exception(type(error), error, error.__traceback__, limit=-_MAX_LEVELS)
        text = f"robocov: internal error while {action}{repeated}\n{''.join(lines)}"
        handler = self._open_handler()
        handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
        try:
            # A handler reports its own errors, such as a full disk, on standard error and never raises.
            handler.handle(logging.LogRecord("robocov", logging.ERROR, "", 0, text, None, None))
        finally:
            handler.close()

    def _open_handler(self) -> logging.Handler:
        """Open the log file; if that fails, log to standard error from now on."""
        if self.file is not None:
            try:
                self.file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
                return RotatingFileHandler(
                    self.file,
                    maxBytes=_MAX_LOG_BYTES,
                    backupCount=1,
                    encoding="utf-8",
                    errors="backslashreplace",
                )
            except OSError:
                self.file = None
        return logging.StreamHandler(sys.stderr)


def describe_os_error(error: OSError) -> str:
    """Return the file name and the reason of an operating system error, on one line."""
    reason = error.strerror or str(error) or type(error).__name__
    if error.filename is not None:
        reason = f"{os.fsdecode(error.filename)}: {reason}"
    return remove_controls(reason, single_line=True)


def _build_key(error: BaseException) -> tuple[str, str, int]:
    """Return the type of an exception, and the file and line at which it was raised, to count equal ones."""
    frames = traceback.extract_tb(error.__traceback__, limit=-1)
    if not frames:
        return type(error).__name__, "", 0
    return type(error).__name__, frames[0].filename, frames[0].lineno or 0
