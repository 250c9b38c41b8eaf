"""Runs the parts of a frame so that an unexpected exception does not end the window."""

from collections.abc import Callable
from time import perf_counter

import pygame

from robocov_app.toolkit.window.exceptions import ExceptionLog

_MAX_CONSECUTIVE_EXCEPTIONS = 5
"""Number of consecutive exceptions of an action after which it is tried only every `_RETRY_S` seconds."""
_RETRY_S = 1.0

RollBack = Callable[[], None]
"""A function that reverts all changes since it was created."""


class ExceptionGuard:
    """Runs the parts of a frame; logs and reports any exception, and reverts the changes made before it.

    An action that keeps failing is tried only occasionally, so that the window stays usable.

    Parameters
    ----------
    report : callable
        Shows a message in the window. Called with the message and the name of the action that failed.

    Attributes
    ----------
    is_enabled : bool
        Whether exceptions are logged and reported instead of raised. Tests set it to False.
    log : ExceptionLog
    """

    def __init__(self, report: Callable[[str, str], None]) -> None:
        self.is_enabled = True
        self.log = ExceptionLog()
        self._report = report
        self._exception_counts: dict[str, int] = {}
        self._retry_at_s: dict[str, float] = {}

    def run(
        self,
        action: str,
        call: Callable[[], object],
        *,
        create_save_point: Callable[[], RollBack] | None = None,
    ) -> bool:
        """Run one part of a frame.

        Parameters
        ----------
        action : str
            Name of the action, such as "drawing".
        call : callable
        create_save_point : callable, optional
            Called before `call`; returns the function that reverts the changes if `call` raises.

        Returns
        -------
        bool
            Whether the call succeeded.

        Raises
        ------
        MemoryError
        Exception
            Any exception after the display was closed, or if the guard is not enabled.
        """
        if perf_counter() < self._retry_at_s.get(action, 0.0):
            return False
        if not self.is_enabled:
            call()
            return True
        roll_back: RollBack | None = None
        try:
            if create_save_point is not None:
                roll_back = create_save_point()
            call()
        except MemoryError:
            raise
        except Exception as error:
            if not pygame.display.get_init():
                raise
            self._handle_exception(error, action, roll_back)
            return False
        self._exception_counts.pop(action, None)
        self._retry_at_s.pop(action, None)
        return True

    def _handle_exception(self, error: Exception, action: str, roll_back: RollBack | None) -> None:
        """Log an exception, revert the changes before it, and report it in the window."""
        count = self._exception_counts.get(action, 0) + 1
        self._exception_counts[action] = count
        if count >= _MAX_CONSECUTIVE_EXCEPTIONS:
            self._retry_at_s[action] = perf_counter() + _RETRY_S
        message = self.log.record(error, action)
        if roll_back is not None and self.log.attempt("undoing an action", roll_back):
            message += " The action was undone."
        message += " Save your work."
        self.log.attempt("reporting an error", lambda: self._report(message, action))
