"""State that every window has: a status message, a clock, and actions whose errors are shown."""

from collections.abc import Callable
from pathlib import Path

from robocov.errors import RobocovError
from robocov_app.toolkit.sentence_case import to_sentence_case
from robocov_app.toolkit.window.exceptions import describe_os_error

MESSAGE_S = 5.0
"""Time for which a status message is shown."""


class WindowModel:
    """State of a window, independent of drawing and events: base class of the models of both windows.

    Attributes
    ----------
    error_message_s : float
        Time for which an error message is shown.
    revision : int
        Increases whenever the window must be redrawn.
    message : str
        Status message; empty after a few seconds.
    has_error_message : bool
        Whether the message reports an error.
    now : float
        Time since the window was opened, s.
    hidden_folder : Path or None
        Folder that messages omit from paths, because the user of a browser cannot open it.
    """

    error_message_s = MESSAGE_S

    def __init__(self) -> None:
        self.revision = 0
        self.message = ""
        self.has_error_message = False
        self.now = 0.0
        self.hidden_folder: Path | None = None
        self._message_time = 0.0

    def show_message(self, text: str, *, is_error: bool = False) -> None:
        """Show a status message, in sentence case; if it is empty, the current message stays."""
        if text:
            self.message = to_sentence_case(self.shorten_paths(text))
            self.has_error_message = is_error
            self._message_time = self.now

    def shorten_paths(self, text: str) -> str:
        """Remove the hidden folder from all paths in a text."""
        folder = self.hidden_folder
        if folder is None:
            return text
        for spelling in (folder.resolve(), folder.absolute(), folder):
            prefix = spelling.as_posix().rstrip("/") + "/"
            # The folder "." is not a part of its paths, and "./" may be a part of others.
            if len(prefix) > len("./"):
                text = text.replace(prefix, "")
        return text

    def clear_message(self) -> None:
        """Remove the status message."""
        self.message = ""

    def pass_time(self, seconds: float) -> None:
        """Advance the clock, and remove the status message once it has been shown long enough."""
        self.now += seconds
        duration = MESSAGE_S
        if self.has_error_message:
            duration = self.error_message_s
        if self.now - self._message_time > duration:
            self.clear_message()

    def attempt(self, action: Callable[[], object]) -> None:
        """Run an action, and show the message that it returns or the error that it raises."""
        try:
            self.carry_out(action)
        except RobocovError as error:
            self.show_message(self.describe_error(error), is_error=True)
        except OSError as error:
            self.show_message(describe_os_error(error), is_error=True)

    def carry_out(self, action: Callable[[], object]) -> None:
        """Run an action, and show the message that it returns; let its errors propagate."""
        self.revision += 1
        message = action()
        if isinstance(message, str):
            self.show_message(message)

    def describe_error(self, error: RobocovError) -> str:
        """Return the message that the window shows for an error."""
        return str(error)
