"""A process in which a controller decides, from the side of the verification."""

from __future__ import annotations

import secrets
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias, get_args

import numpy as np

from robocov.compiled import open_cache_folder
from robocov.controllers.base import Information
from robocov.errors import ParameterError, RobocovError, quote
from robocov.observation import Decision, Observations, Scanning
from robocov.typing import FloatArray, IntArray
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.verification.controller_messages import (
    ANSWER,
    FAULT,
    MEASURE,
    READING,
    VIOLATION,
    DamagedMessageError,
    Description,
    Setup,
    StepEncoder,
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
_MAX_LISTED = 20
"""Maximum number of violations, and of files, that are listed."""
Measure: TypeAlias = Callable[[IntArray, FloatArray], FloatArray]
"""Returns the density at points that robots measure, as the function of a `DensitySensor`."""


class ControllerFaultError(RobocovError):
    """The controller in a process has raised an error, or its process has ended."""


class ControllerProcess:
    """A process that executes a controller, and from which only plain values are accepted.

    Parameters
    ----------
    folder : Path
        Folder for the machine code that processes compile. Each process has its own subfolder.

    Attributes
    ----------
    violations : list of str
        Forbidden actions that the controller attempted.
    read_files : list of str
        Files that the controller has read, apart from those of Python and installed packages.
    """

    def __init__(self, folder: Path) -> None:
        self.violations: list[str] = []
        self.read_files: list[str] = []
        # Processes must not share a file, through which robots could exchange what they know.
        self._cache = _create_cache(folder)
        self._process = start_python(
            _PROGRAM, stderr=subprocess.DEVNULL, variables={"NUMBA_CACHE_DIR": str(self._cache)}
        )
        self._step_encoder = StepEncoder()
        self._robot_count = 0

    def describe(self, code: ControllerCode) -> Description:
        """Return what a controller declares about itself.

        Raises
        ------
        ControllerFaultError
            If the controller cannot be built.
        """
        self._send(code)
        return read_description(self._receive_answer())

    def begin(self, setup: Setup) -> None:
        """Send what the process knows before the first step, without waiting for the controller."""
        self._robot_count = len(setup.team)
        self._send(setup)

    def wait_until_ready(self) -> None:
        """Wait until the controller is ready for the first step.

        Raises
        ------
        ControllerFaultError
            If the controller fails.
        """
        self._receive_answer()

    def send_observations(self, observations: Observations) -> None:
        """Send the observations of a step, without those that a process must not receive."""
        self._send(self._step_encoder.encode(observations))

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
            If the controller fails, or the answer is not a decision.
        """
        values = self._receive_answer(measure)
        try:
            return decode_decision(values, self._robot_count)
        except DamagedMessageError as error:
            raise ControllerFaultError(str(error)) from None

    def end(self) -> None:
        """End the process, and remove its machine code."""
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
                return values[0]
            if kind == FAULT:
                raise ControllerFaultError(" ".join(map(str, values)))
            if kind == VIOLATION:
                _add_once(self.violations, " ".join(map(str, values)))
            elif kind == READING:
                _add_once(self.read_files, " ".join(map(str, values)))
            elif kind == MEASURE and measure is not None and len(values) == 2:
                self._send(self._answer_measurement(measure, *values))
            else:
                raise ControllerFaultError("its process sent an invalid message")

    def _receive(self) -> Iterable[Any]:
        """Return the next message of the process."""
        assert self._process.stdout is not None
        try:
            message = receive_plain(self._process.stdout)
        except (EOFError, OSError):
            raise ControllerFaultError("its process ended") from None
        except DamagedMessageError as error:
            raise ControllerFaultError(str(error)) from None
        if not isinstance(message, tuple) or not message:
            # No message has this kind, so the caller rejects it.
            return ("",)
        return message

    def _answer_measurement(self, measure: Measure, robots: Any, points: Any) -> FloatArray | str:
        """Return the density at points, or the reason why it cannot be measured."""
        try:
            rows = np.array(robots, dtype=np.intp)
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


def _add_once(texts: list[str], text: str) -> None:
    """Add a text to a list that does not contain it, unless the list is full."""
    if text not in texts and len(texts) < _MAX_LISTED:
        texts.append(text)


def describe_controller(code: ControllerCode) -> tuple[Description, list[str]]:
    """Let a process describe a controller.

    Parameters
    ----------
    code : ControllerCode
        The controller.

    Returns
    -------
    description : Description
        What the controller declares about itself.
    violations : list of str
        Forbidden actions that it attempted while it was built.

    Raises
    ------
    ControllerFaultError
        If the controller cannot be built.
    """
    with tempfile.TemporaryDirectory(prefix=CACHE_PREFIX) as folder:
        process = ControllerProcess(Path(folder))
        try:
            return process.describe(code), process.violations
        finally:
            process.end()


def read_description(values: Any) -> Description:
    """Return the description in plain values.

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
        label: Any = values["label"]
        information: Information = values["information"]
        gains: Any = values["gains"]
        scanning = None if values["scanning"] is None else Scanning(*values["scanning"])
        if information not in get_args(Information):
            expected = ", ".join(get_args(Information))
            raise ParameterError(f"information: expected one of {expected}, got {quote(information)}")
        return Description(label, information, gains, scanning)
    except (KeyError, TypeError, RobocovError) as error:
        raise ControllerFaultError(f"its process sent an invalid description: {error}") from None
