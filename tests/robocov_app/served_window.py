"""A window that is served by a process of its own."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


class Link(str):
    """The link of a served window, with its process."""

    process: subprocess.Popen[str]


@contextmanager
def serve_window(command: str, *arguments: str, port: int = 0, **how: object) -> Iterator[Link]:
    """Serve a window, by default at any free port, and give its link; `how`: more for the process."""
    call = [sys.executable, "-m", "robocov_app", command, *arguments, "--serve", "--port", str(port)]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "ROBOCOV_SETTINGS": ""}
    process = subprocess.Popen(call, stdout=subprocess.PIPE, env=environment, text=True, **how)
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := re.search(r"http://\S+", line):
                link = Link(found[0])
                link.process = process
                yield link
                return
        raise AssertionError("no link was printed")
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()
