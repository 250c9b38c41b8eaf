"""A window that is served by a process of its own."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def served(command: str, *arguments: str) -> Iterator[str]:
    """Serve a window at any free port, and give its link."""
    call = [sys.executable, "-m", "robocov_app", command, *arguments, "--serve", "--port", "0"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "ROBOCOV_SETTINGS": ""}
    process = subprocess.Popen(call, stdout=subprocess.PIPE, env=environment, text=True)
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := re.search(r"http://\S+", line):
                yield found[0]
                return
        raise AssertionError("no link was printed")
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()
