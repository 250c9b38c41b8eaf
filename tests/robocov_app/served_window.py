"""A window that a process of its own serves to browsers."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

MAX_SHUTDOWN_S = 20.0


class Link(str):
    """The link of a served window, with its process."""

    process: subprocess.Popen[str]


@contextmanager
def serve_window(
    command: str,
    *arguments: str,
    port: int = 0,
    environment: Mapping[str, str] | None = None,
    **process_options: object,
) -> Iterator[Link]:
    """Serve a window until the context ends, and yield its link.

    Port 0 stands for any free port. `environment` adds variables to those of this process. Further options
    are passed to `subprocess.Popen`.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "robocov_app", command, *arguments, "--serve", "--port", str(port)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONUNBUFFERED": "1", "ROBOCOV_SETTINGS": "", **(environment or {})},
        text=True,
        **process_options,
    )
    assert process.stdout is not None
    try:
        for line in process.stdout:
            if found := re.search(r"http://\S+", line):
                link = Link(found[0])
                link.process = process
                yield link
                return
        raise AssertionError("no link was printed")
    finally:
        process.terminate()
        process.wait(MAX_SHUTDOWN_S)
        process.stdout.close()
