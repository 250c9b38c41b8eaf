"""Saving what the session holds, beside the window: as ``robocov run`` and ``robocov compare`` write it."""

from __future__ import annotations

import queue
import re
import subprocess
import sys
import threading
from bisect import bisect_left
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.errors import OutputError
from robocov_app.runs.compare import folder_names
from robocov_app.terminal.output import free_name
from robocov_app.toolkit.worker import receive, send, started
from robocov_app.viewer.session.kept import Job, Kept, Moments, NotKept, Part

if TYPE_CHECKING:
    from robocov_app.viewer.session.history import Moment
    from robocov_app.viewer.session.session import Session

LATTICE = 64
"""Sites along a side, as `robocov run` has them where nothing else is said."""

_AT_ONCE = 256
"""Moments that are packed in one go: a millisecond or so during which the window cannot draw."""


class Said(NamedTuple):
    """How saving went."""

    words: str
    trouble: bool


class Wanted(NamedTuple):
    """What is to be saved.

    Attributes
    ----------
    job : Job
    panes : tuple of int
        The numbers of the lanes.
    moments : list of Moment
    name : str
        What people call the folder.
    since : str
        Since when, in words; empty for since the beginning.
    """

    job: Job
    panes: tuple[int, ...]
    moments: list[Moment]
    name: str
    since: str


class Keeper:
    """Has runs saved by other processes, one after the other.

    No call but `finish` waits for them.

    Parameters
    ----------
    lattice : int
        On which the coverage cost is evaluated.
    """

    def __init__(self, lattice: int = LATTICE) -> None:
        self._lattice = lattice
        self._wanted: queue.SimpleQueue[Wanted | None] = queue.SimpleQueue()
        self._said: queue.SimpleQueue[Said] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._ended = False

    def save(self, session: Session, folder: Path, map_name: str = "") -> str:
        """Begin to save what the session holds, since its last touch, in a new folder; return what to tell.

        Parameters
        ----------
        session : Session
        folder : Path
            Where the new folder is made.
        map_name : str
            What the user calls the map; by default its own name.

        Raises
        ------
        OutputError
            When the folder cannot be made.
        ParameterError
            When a controller is not there any more, so that nothing can be computed.
        """
        for lane in session.lanes:
            lane.law.made()
        target = _made(folder, _stem(session, map_name))
        wanted = wanted_of(session, target, self._lattice)
        self._wanted.put(wanted)
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, daemon=True)
            self._thread.start()
        return f"saving the run: {wanted.name}{wanted.since}"

    def poll(self) -> list[Said]:
        """Return what is to be told since the last call."""
        said = []
        while not self._said.empty():
            said.append(self._said.get())
        return said

    def finish(self) -> None:
        """Wait until all is saved; after Ctrl-C what is being saved stays as it is."""
        if self._thread is None:
            return
        self._wanted.put(None)
        try:
            self._thread.join(0.5)
            if self._thread.is_alive():
                sys.stderr.write("saving runs; Ctrl-C gives up\n")
                self._thread.join()
        except BaseException:
            self._give_up()
            raise
        self._thread = None

    def _give_up(self) -> None:
        """Leave what is not saved yet; no empty folder stays."""
        self._ended = True
        with suppress(queue.Empty):
            while True:
                wanted = self._wanted.get_nowait()
                if wanted is not None:
                    _remove_empty(wanted.job.folder)
        self._wanted.put(None)
        if self._process is not None:
            self._process.kill()

    def _work(self) -> None:
        while (wanted := self._wanted.get()) is not None and not self._ended:
            try:
                answer = self._saved(wanted)
            except OSError as error:
                answer = NotKept(error.strerror or str(error))
            except Exception as error:  # whatever it is, it is told
                answer = NotKept(f"{type(error).__name__}: {error}")
            if isinstance(answer, Kept):
                remarks = "".join(f"; {remark}" for remark in answer.remarks)
                words = f"run saved: {wanted.name} (record, cost, pictures){wanted.since}{remarks}"
                self._said.put(Said(words, trouble=False))
            else:
                _remove_empty(wanted.job.folder)
                self._said.put(Said(f"run not saved: {wanted.name}: {answer.message}", trouble=True))

    def _saved(self, wanted: Wanted) -> Kept | NotKept:
        with started("robocov_app.viewer.session.keep_process") as process:
            self._process = process
            if self._ended:
                process.kill()
            assert process.stdin is not None
            assert process.stdout is not None
            # where the process has ended, it says nothing either
            with suppress(OSError):
                tell(process.stdin, wanted)
            with suppress(OSError):
                process.stdin.close()
            answer = receive(process.stdout)
        self._process = None
        ended = NotKept("the process that saves it has ended")
        return answer if isinstance(answer, Kept | NotKept) else ended


def wanted_of(session: Session, folder: Path, lattice: int = LATTICE) -> Wanted:
    """Return what is to be saved of a session in a folder: all since the last touch."""
    moments = session.history.since(untouched_since(session))
    panes = tuple(lane.number for lane in session.lanes)
    scenario = session.scenario
    job = Job(
        folder=str(folder.resolve()),
        dt=scenario.dt,
        start=scenario.start,
        seed=scenario.seed,
        parts=tuple(Part.of(moments[0].states[pane]) for pane in panes),
        moments=len(moments),
        lattice=lattice,
    )
    return Wanted(job, panes, moments, f"{folder}/", since_words(session, moments[0].step))


def tell(stream: IO[bytes], wanted: Wanted) -> None:
    """Say to another process what is to be saved."""
    send(stream, wanted.job)
    for k in range(0, len(wanted.moments), _AT_ONCE):
        send(stream, _packed(wanted.moments[k : k + _AT_ONCE], wanted.panes))


def untouched_since(session: Session) -> int:
    """Return the number of the first moment from which on nothing but time has gone on.

    From there on map, robots, limits and controllers are the same in all panes that are there now.
    """
    history = session.history

    def as_now(k: int) -> bool:
        states = history[k].states
        return all(
            lane.number in states and states[lane.number].circumstances is lane.circumstances
            for lane in session.lanes
        )

    # what has changed never becomes the same again
    return min(bisect_left(range(len(history)), True, key=as_now), len(history) - 1)


def since_words(session: Session, step: int) -> str:
    """Return since when a run is saved that begins at a step, and why; nothing if that is the beginning."""
    if step == 0:
        return ""
    time = step * session.scenario.dt
    causes = [event.text for event in session.events if abs(event.time - time) < 0.5 * session.scenario.dt]
    if not causes:
        return f", since {time:.1f} s"
    # gains are no sentence
    return f", since {time:.1f} s" + (f" ({causes[-1]})" if ":" in causes[-1] else f", when {causes[-1]}")


def _packed(moments: list[Moment], panes: tuple[int, ...]) -> Moments:
    return Moments(
        np.array([moment.step for moment in moments]),
        tuple(np.stack([moment.states[pane].positions for moment in moments]) for pane in panes),
        tuple(np.stack([moment.states[pane].velocities for moment in moments]) for pane in panes),
    )


def _stem(session: Session, map_name: str) -> str:
    """Return what the folder is called, but for its number."""
    name = map_name.replace("\\", "/").rpartition("/")[2].removesuffix(".json")
    name = name or session.environment.name
    laws = [lane.law.name for lane in session.lanes]
    what = folder_names(laws)[0] if len(laws) == 1 else "comparison"
    stem = re.sub(r"[^\w.-]+", "-", name).strip(".-")[:64] or "map"
    return f"{stem}-{what}"


def _made(folder: Path, stem: str) -> Path:
    """Make a folder that was not there before.

    Raises
    ------
    OutputError
        When it cannot be made.
    """
    while True:
        target = free_name(folder, stem, "")
        try:
            target.mkdir(parents=True)
        except FileExistsError:
            if not target.exists():  # a file stands where a folder is wanted
                raise OutputError(f"{target}: cannot be made") from None
        except OSError as error:
            raise OutputError(f"{target}: cannot be made: {error.strerror or error}") from error
        else:
            return target


def _remove_empty(folder: str) -> None:
    with suppress(OSError):
        Path(folder).rmdir()  # fails, as it should, where there is something in it
