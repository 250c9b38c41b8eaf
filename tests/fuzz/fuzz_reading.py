"""Read inputs in a process that may crash or hang, and report the outcomes."""

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

MAX_CPU_S = 3.0
"""Maximum processor time of a case."""

_WAIT_FACTOR = 5.0
"""Maximum time of an answer, relative to the processor time: other processes need the processor as well."""

_MAX_START_S = 60.0
"""Time within which the process must be ready."""

_MAX_ERROR_BYTES = 4000
"""Length of the end of the error output that is reported."""

_CHILD = Path(__file__).with_name("fuzz_child.py")


@dataclass(frozen=True)
class Job:
    """How to read a case.

    Attributes
    ----------
    kind : str
        ``import``, ``folder``, ``map``, ``study`` or ``check``.
    format : str or None
        Format of the imported file; None detects it.
    options : dict
        Arguments of `ReadOptions`, or of the command.
    shaping : dict
        Arguments of `Shaping`.
    """

    kind: str
    format: str | None = None
    options: dict[str, Any] = field(default_factory=dict)
    shaping: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """Outcome of a case.

    Attributes
    ----------
    outcome : str
        ``read`` or ``rejected``, or one of the findings ``error``, ``memory``, ``slow``, ``hang`` and
        ``crash``.
    text : str
        Description of what was read, or the error message.
    signature : str
        Identical for findings with the same cause; empty if there is no finding.
    traceback : str
    seconds : float, s
        Processor time; for ``slow``, ``hang`` and ``crash`` the elapsed time.
    """

    outcome: str
    text: str = ""
    signature: str = ""
    traceback: str = ""
    seconds: float = 0.0

    @property
    def is_expected(self) -> bool:
        """Whether the outcome is not a finding."""
        return self.outcome in ("read", "rejected")


class Reader:
    """Reads cases in a process, which is restarted if it ends.

    Parameters
    ----------
    seconds : float, s
        Maximum processor time of a case.

    Attributes
    ----------
    start_count : int
        How often the process was started.
    """

    def __init__(self, seconds: float = MAX_CPU_S) -> None:
        self.seconds = seconds
        self.start_count = 0
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
        """Read a case, and return its outcome."""
        folder = Path(self._folder.name) / "case"
        folder.mkdir(exist_ok=True)
        for path in folder.iterdir():
            path.unlink()
        for name, content in case.files.items():
            (folder / name).write_bytes(content)
        process = self._ensure_process()
        assert process.stdin is not None
        request = json.dumps({"file": str(folder / case.main), **vars(job)})
        max_wait = _WAIT_FACTOR * self.seconds
        start_time = time.monotonic()
        try:
            process.stdin.write(request.encode() + b"\n")
            process.stdin.flush()
            answer = self._wait_for_answer(max_wait)
        except BrokenPipeError:
            answer = None
        elapsed = time.monotonic() - start_time
        if answer is not None:
            outcome = Outcome(**answer)
            if outcome.is_expected and outcome.seconds > self.seconds:
                return Outcome("slow", f"{outcome.seconds:.1f} s", f"slow-{job.kind}", "", elapsed)
            return outcome
        is_hanging = process.poll() is None and elapsed >= max_wait
        self._stop()
        errors = self._read_errors()
        if is_hanging:
            return Outcome("hang", f"no answer in {elapsed:.1f} s", f"hang-{job.kind}", errors, elapsed)
        status = process.returncode
        return Outcome("crash", f"status {status}", f"crash-{job.kind}-{status}", errors, elapsed)

    def _ensure_process(self) -> subprocess.Popen[bytes]:
        """Return the process, after starting it if there is none."""
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
            self.start_count += 1
            self._pending = b""
            if self._wait_for_answer(_MAX_START_S) is None:
                self._stop()
                raise RuntimeError(f"the reading process did not start: {self._read_errors()}")
        return self._process

    def _wait_for_answer(self, seconds: float) -> dict[str, Any] | None:
        """Return the next answer, or None if the process ends or takes longer."""
        assert self._process is not None
        assert self._process.stdout is not None
        stream = self._process.stdout.fileno()
        deadline = time.monotonic() + seconds
        while b"\n" not in self._pending:
            remaining = deadline - time.monotonic()
            if remaining <= 0.0 or not select.select([stream], [], [], remaining)[0]:
                return None
            block = os.read(stream, 1 << 16)
            if not block:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(5.0)
                return None
            self._pending += block
        line, self._pending = self._pending.split(b"\n", 1)
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _read_errors(self) -> str:
        self._errors.seek(0)
        return self._errors.read()[-_MAX_ERROR_BYTES:].decode("utf-8", "replace")
