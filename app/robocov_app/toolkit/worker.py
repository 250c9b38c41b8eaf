"""Work in processes of our own, beside a window that must not wait: only the newest question counts.

A *service* is a class without arguments whose objects answer questions (see `Service`). `LatestWorker`
runs one in another process, `DirectWorker` in this one; `started` and `asked` are for callers that may wait.
"""

import ctypes
import faulthandler
import importlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from typing import IO, Any, BinaryIO, Generic, Protocol, TypeAlias, TypeVar

from robocov.errors import RobocovError
from robocov_app.terminal.supervision import describe_status

_Answer = TypeVar("_Answer")
READY = "ready"  # first message of a process: its service is loaded
_PIPE = 1 << 20
_SET_DEATH_SIGNAL = 1


class Service(Protocol):
    """Answers questions; where that fails unforeseen, `failing` begins the message."""

    failing: str

    def __call__(self, questions: list[Any], line: "Line") -> object:
        """Learn from all questions since the last answer, one at least, and answer the last of them."""


class Wire:
    """Translates between the window and one process; called on threads, in order, anew for each process."""

    def encode(self, question: Any) -> object:
        return question

    def decode(self, answer: Any) -> Any:
        return answer


@dataclass(frozen=True, eq=False)
class Reply:
    """Answer to a numbered question, or in words why there is none; or, not `final`, how far it is."""

    number: int
    answer: Any
    trouble: str = ""
    final: bool = True


class LatestWorker(Generic[_Answer]):
    """A service in a process of its own, which is started by a question and again after it has died.

    `service` is ``package.module:Class``, `doing` what it does, for people: ``measures the map``. A process
    that works longer than `patience`, s, on an older question is ended for a newer one.
    """

    def __init__(self, service: str, doing: str, wire: type[Wire] = Wire, *, patience: float = inf) -> None:
        self.trouble = ""
        self.process: subprocess.Popen[bytes] | None = None  # a thread writes to it, and one reads
        self._service, self._doing, self._wire, self._patience = service, doing, wire, patience
        self._since = 0.0
        self._number = self._answered = 0
        self._ended = False
        self._ready = False
        self._told: Reply | None = None
        self._replies: deque[Reply] = deque(maxlen=1)
        self._questions: deque[tuple[int, object]] = deque(maxlen=1)
        self._asked = threading.Event()
        self._threads: list[threading.Thread] = []

    @property
    def lives(self) -> bool:
        return self.process is not None and not self._ended

    @property
    def busy(self) -> bool:
        return self._answered < self._number

    @property
    def progress(self) -> Any:
        """Progress of the newest question, as the service tells; None if it has not told yet."""
        told = self._told
        return told.answer if told is not None and told.number == self._number else None

    def put(self, question: object) -> None:
        """Ask; an older question without an answer does not count any more."""
        now = time.monotonic()
        if not self.busy:
            self._since = now
        if not self.lives or now - self._since > self._patience:
            self.close()
            self._since = now
            try:
                process = started(self._service)
            except OSError as error:  # no memory or no process to be had; the next question tries again
                self._number += 1
                self._answered = self._number
                self.trouble = f"the process that {self._doing} cannot be started: {error.strerror or error}"
                return
            self.process, self._ended, self._ready = process, False, False
            known = self.process, self._wire()
            calls = self._write, self._read
            self._threads = [threading.Thread(target=call, args=known, daemon=True) for call in calls]
            for thread in self._threads:
                thread.start()
        self._number += 1
        self._questions.append((self._number, question))
        self._asked.set()

    def poll(self) -> _Answer | None:
        """Return the newest answer since the last call, once; while `busy`, it is to an older question."""
        if self.process is None:
            return None
        ended, reply = self._ended, self._replies.pop() if self._replies else None
        if reply is not None:
            self._answered, self.trouble, self._since = reply.number, reply.trouble, time.monotonic()
        if ended and self.busy:
            self._answered = self._number
            self.trouble = f"the process that {self._doing} has ended{self._describe_end()}"
            return None
        return None if reply is None else reply.answer

    def _describe_end(self) -> str:
        """Return how the process has ended, and whether that was while it started."""
        assert self.process is not None
        status = self.process.poll()
        ending = "" if status is None else f" ({describe_status(status)})"
        return f"{ending}{'' if self._ready else ' while starting'}"

    def close(self) -> None:
        if self.process is not None:
            process, self.process = self.process, None
            self._asked.set()
            process.kill()
            process.wait()
            for thread in self._threads:
                thread.join()
            self._questions.clear()
            self._replies.clear()

    def _write(self, process: subprocess.Popen[bytes], wire: Wire) -> None:
        assert process.stdin is not None
        try:
            with suppress(OSError), process.stdin as stream:  # when the process has ended, reading says so
                while self._asked.wait() and self.process is process:
                    self._asked.clear()
                    if self._questions:
                        number, question = self._questions.pop()
                        send(stream, (number, wire.encode(question)))
        except Exception:  # a question that cannot be sent must not be waited for
            traceback.print_exc()
            if self.process is process:
                self._ended = True

    def _read(self, process: subprocess.Popen[bytes], wire: Wire) -> None:
        assert process.stdout is not None
        try:
            with process.stdout as stream:
                self._ready = receive(stream) == READY
                while (reply := receive(stream)) is not None:
                    if not reply.final:
                        self._told = reply
                        continue
                    if reply.answer is not None:
                        reply = Reply(reply.number, wire.decode(reply.answer), reply.trouble)
                    self._replies.append(reply)
        except Exception:  # neither must an answer that cannot be read
            traceback.print_exc()
        finally:
            self._ended = True


class DirectWorker(Generic[_Answer]):
    """A service that answers in this process at once: for pictures without a display, and for tests."""

    busy, lives, progress = False, True, None

    def __init__(self, service: Service, wire: Wire | None = None) -> None:
        self._service, self._wire = service, wire or Wire()
        self.trouble, self._answer = "", None

    def put(self, question: object) -> None:
        reply = reply_of(self._service, [(0, self._wire.encode(question))], Line())
        self.trouble, self._answer = reply.trouble, reply.answer

    def poll(self) -> _Answer | None:
        answer, self._answer = self._answer, None
        return None if answer is None else self._wire.decode(answer)

    def close(self) -> None:
        """There is nothing to end."""


Worker: TypeAlias = LatestWorker[_Answer] | DirectWorker[_Answer]


class Line:
    """Channel of a service while it works: newer questions in, progress out."""

    def newer(self) -> list[Any]:
        return []

    def tell(self, progress: object) -> None:
        """Say how far the answer is."""


class _PipeLine(Line):
    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source, self._target = source, target
        self._asked = threading.Condition()
        self._questions: list[tuple[int, Any]] = []
        self._number = 0

    def newer(self) -> list[Any]:
        return [question for _, question in self._questions]

    def tell(self, progress: object) -> None:
        self.say(Reply(self._number, progress, final=False))

    def say(self, message: object) -> None:
        try:
            send(self._target, message)
        except OSError:
            os._exit(0)

    def taken(self) -> list[tuple[int, Any]]:
        with self._asked:
            self._asked.wait_for(lambda: self._questions)
            questions, self._questions = self._questions, []
        self._number = questions[-1][0]
        return questions

    def listen(self) -> None:
        while (question := receive(self._source)) is not None:
            with self._asked:
                self._questions.append(question)
                self._asked.notify()
        os._exit(0)


def reply_of(service: Service, questions: list[tuple[int, Any]], line: Line) -> Reply:
    number = questions[-1][0]
    try:
        return Reply(number, service([question for _, question in questions], line))
    except RobocovError as error:
        return Reply(number, None, str(error))
    except Exception as error:  # what nobody has foreseen must not end the window
        traceback.print_exc()
        return Reply(number, None, f"{service.failing}: {error}")


def serve(service: str) -> None:
    """Answer questions until the standard input ends, which it does however the parent ends."""
    if sys.version_info >= (3, 14):
        faulthandler.enable(c_stack=False)  # the engine's own frames would hide those of a user's code
    else:
        faulthandler.enable()
    with suppress(OSError, AttributeError, TypeError):  # where the kernel can end it with its parent
        ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    # code that is called reads nothing, and prints to stderr
    source, target = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    line = _PipeLine(source, target)
    threading.Thread(target=line.listen, daemon=True).start()
    module, _, name = service.partition(":")
    answering = getattr(importlib.import_module(module), name)()
    line.say(READY)
    while True:
        line.say(reply_of(answering, line.taken(), line))


def started(service: str, *, stderr: IO[bytes] | None = None) -> subprocess.Popen[bytes]:
    """Start a process that serves; pipes lead to its standard input and from its standard output."""
    # it is to import what this one does
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        environment.setdefault(name, "1")
    serving = f"from robocov_app.toolkit.worker import serve; serve({service!r})"
    command = [sys.executable, "-P", "-c", serving]  # -P: what lies in the working folder is not meant
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=stderr, env=environment)
    if sys.platform == "linux":
        import fcntl

        # a pipe that holds a whole answer wakes its reader less often; so much is not allowed to everybody
        with suppress(OSError):
            fcntl.fcntl(process.stdout, fcntl.F_SETPIPE_SZ, _PIPE)  # type: ignore[arg-type]
    return process


def asked(process: subprocess.Popen[bytes], question: object) -> Reply | None:
    """Ask a process that serves, and wait for its answer; None if it ends."""
    assert process.stdin is not None and process.stdout is not None
    with suppress(OSError):
        send(process.stdin, (0, question))
    while (reply := receive(process.stdout)) == READY:
        pass
    return reply if isinstance(reply, Reply) else None


def ended(process: subprocess.Popen[bytes]) -> int:
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        with suppress(OSError):
            stream.close()
    return process.wait()


def send(stream: IO[bytes], message: object) -> None:
    stream.write(pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """Read one message; None at the end, also in the midst of one."""
    try:
        return pickle.load(stream)
    except (EOFError, pickle.UnpicklingError):
        return None
