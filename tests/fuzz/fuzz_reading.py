"""Inputs read in a process that may die of them, under a watchdog; and what came of each."""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzz_seeds import Case

SECONDS = 3.0
"""What a case may take of a processor."""

_PATIENCE = 5.0
"""Times as long is waited for an answer: other processes want the processor too."""

_START = 60.0
"""Seconds within which the process must be ready."""

_CHILD = Path(__file__).with_name("fuzz_child.py")


@dataclass(frozen=True)
class Job:
    """How a case is read.

    Attributes
    ----------
    kind : str
        ``import``, ``map``, ``study`` or ``check``.
    format : str or None
        Of what is imported; None looks at the file.
    options, shaping : dict
        Of `ReadOptions` and `Shaping`, or of the command.
    """

    kind: str
    format: str | None = None
    options: dict[str, Any] = field(default_factory=dict)
    shaping: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes
    ----------
    outcome : str
        ``read`` or ``refused``; ``error``, ``memory``, ``slow``, ``hang`` and ``crash`` should not be.
    words : str
    signature : str
        The same for findings that come from the same place.
    traceback : str
    seconds : float
    """

    outcome: str
    words: str = ""
    signature: str = ""
    traceback: str = ""
    seconds: float = 0.0

    @property
    def good(self) -> bool:
        """Whether this may be."""
        return self.outcome in ("read", "refused")


class Reader:
    """Reads cases one after the other, in a process that is started again after each that it dies of."""

    def __init__(self, seconds: float = SECONDS) -> None:
        self.seconds = seconds
        self.started = 0
        self._process: subprocess.Popen[bytes] | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="fuzz-")
        self._errors = (Path(self._folder.name) / "stderr").open("w+b")
        self._pending = b""

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *exception: object) -> None:
        self._stop()
        self._errors.close()
        self._folder.cleanup()

    def read(self, case: Case, job: Job) -> Outcome:
        """Return what comes of a case."""
        folder = Path(self._folder.name) / "case"
        folder.mkdir(exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        for name, content in case.files.items():
            (folder / name).write_bytes(content)
        process = self._running()
        assert process.stdin is not None
        line = json.dumps({"file": str(folder / case.main), **vars(job)})
        began = time.monotonic()
        try:
            process.stdin.write(line.encode() + b"\n")
            process.stdin.flush()
            answer = self._answer(_PATIENCE * self.seconds)
        except BrokenPipeError:
            answer = None
        took = time.monotonic() - began
        if answer is not None:
            found = Outcome(**answer)
            slow = found.good and found.seconds > self.seconds
            return Outcome("slow", f"{found.seconds:.1f} s", f"slow-{job.kind}", "", took) if slow else found
        if process.poll() is None and took >= _PATIENCE * self.seconds:
            self._stop()
            return Outcome("hang", f"no answer in {took:.1f} s", f"hang-{job.kind}", self._said(), took)
        self._stop()
        status = process.returncode
        return Outcome("crash", f"status {status}", f"crash-{job.kind}-{status}", self._said(), took)

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            environment = {
                **os.environ,
                "OPENBLAS_NUM_THREADS": "1",
                "OMP_NUM_THREADS": "1",
                "ROBOCOV_CACHE": "",
            }
            self._errors.seek(0)
            self._errors.truncate()
            self._process = subprocess.Popen(
                [sys.executable, "-X", "faulthandler", str(_CHILD)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=environment,
                cwd=self._folder.name,
            )
            self.started += 1
            self._pending = b""
            if self._answer(_START) is None:
                self._stop()
                raise RuntimeError(f"the process that reads did not start: {self._said()}")
        return self._process

    def _answer(self, seconds: float) -> dict[str, Any] | None:
        """Return the next answer, None where the process ends or takes longer."""
        assert self._process is not None and self._process.stdout is not None
        stream = self._process.stdout.fileno()
        deadline = time.monotonic() + seconds
        while b"\n" not in self._pending:
            left = deadline - time.monotonic()
            if left <= 0.0 or not select.select([stream], [], [], left)[0]:
                return None
            fresh = os.read(stream, 1 << 16)
            if not fresh:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(5.0)
                return None
            self._pending += fresh
        line, self._pending = self._pending.split(b"\n", 1)
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _said(self) -> str:
        self._errors.seek(0)
        return self._errors.read()[-4000:].decode("utf-8", "replace")
