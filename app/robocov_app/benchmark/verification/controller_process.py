"""A process in which a controller decides, from the side of the verification."""

from __future__ import annotations

import math
import secrets
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, TypeAlias, get_args

import numpy as np

from robocov.compiled import open_cache_folder
from robocov.controllers.base import Information
from robocov.errors import ParameterError, RobocovError, quote, to_one_line
from robocov.observation import Decision, Scanning
from robocov.typing import FloatArray, IntArray
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.verification.controller_messages import (
    ANSWER,
    FAULT,
    MAX_TEXT_CHARS,
    MEASURE,
    READING,
    VIOLATION,
    DamagedMessageError,
    Description,
    Setup,
    Step,
    decode_decision,
    receive_plain,
)
from robocov_app.jobs.messages import send
from robocov_app.jobs.processes import end_process, start_python

_PROGRAM = """
from robocov_app.benchmark.verification.controller_program import run_controller_program
run_controller_program()
"""
CACHE_PREFIX = "robocov-verify-"
"""Beginning of the names of temporary folders for machine code."""
_MAX_VIOLATIONS = 20
"""Maximum number of violations that are listed."""
MAX_READ_FILES = 20
"""Maximum number of files that a controller may read. Reading more is a violation, so that no file goes
unreported."""
DESCRIPTION_LIMIT_S = 120.0
"""Maximum time for a controller to describe itself."""
ANSWER_LIMIT_S = 600.0
"""Maximum time for the setup or one step, including the compilation of the controller's functions."""
_POLL_INTERVAL_S = 0.2
"""Time between two checks of whether a process is late."""
Measure: TypeAlias = Callable[[IntArray, FloatArray], FloatArray]
"""Returns the density at points that robots measure, as the function of a `DensitySensor`."""


class ControllerFaultError(RobocovError):
    """The controller in a process has raised an error, or its process has ended or does not answer."""


@dataclass(frozen=True)
class DescribedController:
    """The description of a controller, and what the controller did while it was built.

    Attributes
    ----------
    description : Description
        What the controller declares about itself.
    violations : list of str
        Forbidden actions that it attempted.
    read_files : list of str
        Files that it has read, apart from those of Python and installed packages.
    """

    description: Description
    violations: list[str]
    read_files: list[str]


class _Watchdog:
    """A thread that kills a process if it does not answer in time, or if its answer is no longer needed.

    Parameters
    ----------
    process : subprocess.Popen
        The process.
    is_cancelled : callable
        Returns whether the answer is no longer needed.

    Attributes
    ----------
    limit_s : float
        Time limit for the current answer.
    is_late : bool
        Whether the process was killed because it did not answer in time.
    """

    def __init__(self, process: subprocess.Popen[bytes], is_cancelled: Callable[[], bool]) -> None:
        self.limit_s = math.inf
        self.is_late = False
        self._process = process
        self._is_cancelled = is_cancelled
        self._deadline = math.inf
        self._has_ended = threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def expect_answer(self, limit_s: float) -> None:
        """Start the time limit for the next answer."""
        self.limit_s = limit_s
        self._deadline = time.monotonic() + limit_s

    def accept_answer(self) -> None:
        """Stop the time limit, because the answer has arrived."""
        self._deadline = math.inf

    def end(self) -> None:
        """End the thread."""
        self._has_ended.set()

    def _watch(self) -> None:
        while not self._has_ended.wait(_POLL_INTERVAL_S):
            if time.monotonic() > self._deadline:
                self.is_late = True
            if self.is_late or self._is_cancelled():
                self._process.kill()
                return


class ControllerProcess:
    """A process that executes a controller, and from which only plain values are accepted.

    As a context manager, it ends the process on exit.

    Parameters
    ----------
    folder : Path
        Folder for the machine code that processes compile. Each process has its own subfolder.
    is_cancelled : callable, optional
        Returns whether the answers of the process are no longer needed. The process is then killed.

    Attributes
    ----------
    violations : list of str
        Forbidden actions that the controller attempted.
    read_files : list of str
        Files that the controller has read, apart from those of Python and installed packages.
    """

    def __init__(self, folder: Path, is_cancelled: Callable[[], bool] = lambda: False) -> None:
        self.violations: list[str] = []
        self.read_files: list[str] = []
        # Processes must not share a file, through which robots could exchange what they know.
        self._cache = _create_cache(folder)
        self._process = start_python(
            _PROGRAM, stderr=subprocess.DEVNULL, variables={"NUMBA_CACHE_DIR": str(self._cache)}
        )
        self._watchdog = _Watchdog(self._process, is_cancelled)
        self._robot_count = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.end()

    def describe(self, code: ControllerCode) -> Description:
        """Return what a controller declares about itself.

        Raises
        ------
        ControllerFaultError
            If the controller cannot be built, or does not answer in time.
        """
        self._watchdog.expect_answer(DESCRIPTION_LIMIT_S)
        self._send(code)
        return read_description(self._receive_answer())

    def begin(self, setup: Setup) -> None:
        """Send what the process knows before the first step, without waiting for the controller."""
        self._robot_count = len(setup.team)
        self._watchdog.expect_answer(ANSWER_LIMIT_S)
        self._send(setup)

    def wait_until_ready(self) -> None:
        """Wait until the controller is ready for the first step.

        Raises
        ------
        ControllerFaultError
            If the controller fails, or does not answer in time.
        """
        self._receive_answer()

    def send_step(self, step: Step) -> None:
        """Send the observations of a step."""
        self._watchdog.expect_answer(ANSWER_LIMIT_S)
        self._send(step)

    def receive_decision(self, measure: Measure | None) -> Decision:
        """Wait for the decision of the controller for the observations that were sent.

        Parameters
        ----------
        measure : callable or None
            Measures the density, if robots do not know it.

        Returns
        -------
        Decision
            Forces, goals and messages, with payloads of bytes.

        Raises
        ------
        ControllerFaultError
            If the controller fails or does not answer in time, or if the answer is not a decision.
        """
        values = self._receive_answer(measure)
        try:
            return decode_decision(values, self._robot_count)
        except DamagedMessageError as error:
            raise ControllerFaultError(str(error)) from None

    def end(self) -> None:
        """End the process, and remove its machine code."""
        self._watchdog.end()
        self._process.kill()
        end_process(self._process)
        shutil.rmtree(self._cache, ignore_errors=True)

    def _send(self, message: object) -> None:
        assert self._process.stdin is not None
        # If the process has ended, there is no answer, which is reported.
        with suppress(OSError):
            send(self._process.stdin, message)

    def _receive_answer(self, measure: Measure | None = None) -> Any:
        """Wait for an answer, and handle the messages before it."""
        while True:
            kind, *values = self._receive()
            if kind == ANSWER and len(values) == 1:
                self._watchdog.accept_answer()
                return values[0]
            if kind == FAULT:
                raise ControllerFaultError(_require_text(values))
            if kind == VIOLATION:
                self._add_violation(to_one_line(_require_text(values)))
            elif kind == READING:
                self._add_read_file(to_one_line(_require_text(values)))
            elif kind == MEASURE and measure is not None and len(values) == 2:
                self._send(self._answer_measurement(measure, *values))
            else:
                raise ControllerFaultError("its process sent an invalid message")

    def _receive(self) -> tuple[Any, ...]:
        """Return the kind and the values of the next message of the process."""
        assert self._process.stdout is not None
        try:
            message = receive_plain(self._process.stdout)
        except (EOFError, OSError):
            raise ControllerFaultError(self._describe_end()) from None
        except DamagedMessageError as error:
            reason = str(error)
            if self._watchdog.is_late:
                # The killed process may have left a part of a message.
                reason = self._describe_end()
            raise ControllerFaultError(reason) from None
        if not isinstance(message, tuple) or not message or not isinstance(message[0], str):
            raise ControllerFaultError("its process sent an invalid message")
        return message

    def _describe_end(self) -> str:
        if self._watchdog.is_late:
            return f"its process did not answer within {self._watchdog.limit_s:g} s"
        return "its process ended"

    def _add_violation(self, action: str) -> None:
        if action not in self.violations and len(self.violations) < _MAX_VIOLATIONS:
            self.violations.append(action)

    def _add_read_file(self, path: str) -> None:
        if path in self.read_files:
            return
        if len(self.read_files) < MAX_READ_FILES:
            self.read_files.append(path)
        else:
            self._add_violation(
                f"reading more than {MAX_READ_FILES} files that are not part of its source code"
            )

    def _answer_measurement(self, measure: Measure, robots: Any, points: Any) -> FloatArray | str:
        """Return the density at points, or the reason why it cannot be measured."""
        try:
            rows = np.array(robots, dtype=np.intp)
            if rows.ndim != 1:
                raise ValueError("expected a list of robots")
            coordinates = np.frombuffer(points).reshape(len(rows), 2)
        except (TypeError, ValueError, OverflowError):
            raise ControllerFaultError("its process sent an invalid measurement") from None
        if len(rows) and not 0 <= rows.min() <= rows.max() < self._robot_count:
            return "density: expected the index of a robot"
        try:
            return measure(rows, coordinates)
        except RobocovError as error:
            return str(error)


def _create_cache(folder: Path) -> Path:
    """Create a cache folder for one process, with a copy of the machine code of robocov.

    Controllers must not write to the cache that other processes read. No process can guess the name of the
    folder of another.
    """
    cache = folder / secrets.token_hex(16)
    cache.mkdir(mode=0o700)
    shared_cache = open_cache_folder()
    if shared_cache is not None:
        # Other programs may replace files at the same time. What is missing in the copy is compiled again.
        with suppress(shutil.Error):
            shutil.copytree(shared_cache, cache / shared_cache.name)
    return cache


def _require_text(values: list[Any]) -> str:
    """Return the only value, which must be a string of limited length; a process may send anything."""
    if len(values) != 1 or not _is_short_string(values[0]):
        raise ControllerFaultError(
            f"its process sent an invalid message: expected a string of at most {MAX_TEXT_CHARS} characters"
        )
    return str(values[0])


def _is_short_string(value: Any) -> bool:
    return isinstance(value, str) and len(value) <= MAX_TEXT_CHARS


def describe_controller(
    code: ControllerCode, is_cancelled: Callable[[], bool] = lambda: False
) -> DescribedController:
    """Let a process describe a controller.

    Parameters
    ----------
    code : ControllerCode
        The controller.
    is_cancelled : callable, optional
        Returns whether the description is no longer needed, for example because the user has pressed Ctrl+C.

    Returns
    -------
    DescribedController

    Raises
    ------
    ControllerFaultError
        If the controller cannot be built or does not answer in time, or if the description is cancelled.
    """
    with (
        tempfile.TemporaryDirectory(prefix=CACHE_PREFIX) as folder,
        ControllerProcess(Path(folder), is_cancelled) as process,
    ):
        description = process.describe(code)
    return DescribedController(description, process.violations, process.read_files)


def read_description(values: Any) -> Description:
    """Parse and check the description that a controller process has sent.

    Parameters
    ----------
    values : object
        As `robocov_app.benchmark.verification.controller_messages.describe` returns them, or anything else.

    Returns
    -------
    Description

    Raises
    ------
    ControllerFaultError
        If the values are not a description.
    """
    try:
        label = values["label"]
        if not _is_short_string(label):
            raise ParameterError(f"label: expected at most {MAX_TEXT_CHARS} characters, got {quote(label)}")
        information: Information = values["information"]
        if information not in get_args(Information):
            expected = ", ".join(get_args(Information))
            raise ParameterError(f"information: expected one of {expected}, got {quote(information)}")
        gains = values["gains"]
        _require_gains(gains)
        scanning = None if values["scanning"] is None else Scanning(*values["scanning"])
        return Description(label, information, gains, scanning)
    except (KeyError, TypeError, ValueError, OverflowError, RobocovError) as error:
        raise ControllerFaultError(f"its process sent an invalid description: {error}") from None


def _require_gains(gains: Any) -> None:
    """Raise ParameterError unless the values are gains: finite numbers, short strings or None, by name."""
    if not isinstance(gains, Mapping):
        raise ParameterError(f"gains: expected values by name, got {quote(gains)}")
    for name, value in gains.items():
        if not _is_short_string(name):
            raise ParameterError(
                f"gains: expected names of at most {MAX_TEXT_CHARS} characters, got {quote(name)}"
            )
        if value is not None and not _is_short_string(value) and not _is_finite_number(value):
            raise ParameterError(
                f"gains: {quote(name)}: expected a finite number, a string of at most {MAX_TEXT_CHARS} "
                f"characters or None, got {quote(value)}"
            )


def _is_finite_number(value: Any) -> bool:
    try:
        return isinstance(value, int | float) and math.isfinite(value)
    except OverflowError:
        # A whole number that no float can represent.
        return False
