"""A served window in a notebook cell: a separate process, and an iframe that shows it."""

import os
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Sequence
from html import escape
from urllib.parse import urlsplit

from robocov.errors import RobocovError
from robocov.optional_imports import import_optional
from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFTS
from robocov_app.web.access import CONTROL_LABEL

_END_TIMEOUT_S = 5.0
"""Time for the process to end before it is killed."""


class LiveWindow:
    """An interactive window in a notebook cell; it runs until `close` is called or the kernel ends.

    On JupyterHub, jupyter-server-proxy must be installed.

    Parameters
    ----------
    arguments : sequence of str
        Arguments of ``robocov``, starting with the command.
    height : int
        Height of the iframe in the cell, CSS pixels.

    Attributes
    ----------
    link : str
        Address of the window, which can also be opened in another tab.
    height : int
        As passed.
    close : callable
        Ends the window.

    Raises
    ------
    RobocovError
        If the command does not open a window, with its message.
    """

    link: str

    def __init__(self, arguments: Sequence[str], height: int = 620) -> None:
        """Start the window's process, and wait until it prints the link."""
        import_optional("websockets", "web")
        self.height = height
        command = [sys.executable, "-m", "robocov_app", *arguments, "--serve", "--port", "0"]
        # Running the notebook cell again creates a new window, so drafts are not needed.
        environment = {**os.environ, DRAFTS: ""}
        # Errors go to a file: a full pipe that nobody reads would block the process.
        with tempfile.TemporaryFile() as errors:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env=environment,
            )
            self.close = weakref.finalize(self, _end_process, self._process)
            assert self._process.stdout is not None
            line = self._process.stdout.readline()
            if not line.startswith(CONTROL_LABEL):
                self._process.wait()
                errors.seek(0)
                text = errors.read().decode(errors="replace").strip().removeprefix("robocov: error: ")
                raise RobocovError(text or "the window did not open")
            self.link = line.removeprefix(CONTROL_LABEL).strip()

    def _repr_html_(self) -> str:
        """Return the iframe that shows the window in the notebook."""
        link = self.link
        prefix = os.environ.get("JUPYTERHUB_SERVICE_PREFIX")
        if prefix:
            parts = urlsplit(link)
            link = f"{prefix}proxy/{parts.port}/?{parts.query}"
        style = f"width:100%;height:{self.height}px;border:0"
        allowed = "clipboard-read; clipboard-write; fullscreen"
        return f'<iframe src="{escape(link)}" style="{style}" allow="{allowed}" title="robocov"></iframe>'


def _end_process(process: subprocess.Popen[str]) -> None:
    """Terminate a process, kill it if that takes too long, and close its streams."""
    with process:
        process.terminate()
        try:
            process.wait(_END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
