"""A served window in a cell of a notebook: a process of its own, and a frame that shows it."""

import os
import re
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


class LiveWindow:
    """The interactive window, live in the cell that shows it, until `close` or the end of the kernel.

    `link`: its address, also for another tab. `arguments`: of ``robocov``, a command first. Raises
    RobocovError with what the command says if it does not begin. JupyterHub needs jupyter-server-proxy.
    """

    def __init__(self, arguments: Sequence[str], height: int = 620) -> None:
        import_optional("websockets", "web")
        call = [sys.executable, "-m", "robocov_app", *arguments, "--serve", "--port", "0"]
        environment = {**os.environ, DRAFTS: ""}  # the cell makes the window again, there is nothing to offer
        # a file: nobody reads on once the window is open, and a pipe that is full would stop the process
        with tempfile.TemporaryFile() as errors:
            self._process = subprocess.Popen(
                call,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env=environment,
            )
            self.close = weakref.finalize(self, _ended, self._process)
            assert self._process.stdout is not None
            self.height = height
            found = re.match(r"open (\S+)", self._process.stdout.readline())
            if found is None:
                self._process.wait()
                errors.seek(0)
                text = errors.read().decode(errors="replace").strip().removeprefix("robocov: error: ")
                raise RobocovError(text or "the window did not open")
            self.link = found[1]

    def _repr_html_(self) -> str:
        link = self.link
        if prefix := os.environ.get("JUPYTERHUB_SERVICE_PREFIX"):
            place = urlsplit(link)
            link = f"{prefix}proxy/{place.port}/?{place.query}"
        style = f"width:100%;height:{self.height}px;border:0"
        allowed = "clipboard-read; clipboard-write; fullscreen"
        return f'<iframe src="{escape(link)}" style="{style}" allow="{allowed}" title="robocov"></iframe>'


def _ended(process: subprocess.Popen[str]) -> None:
    with process:  # which closes its streams, and waits
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
