"""The command `robocov`: finds the subcommand, and turns errors into one line and an exit status.

Each command is a module of `robocov_app.commands`, with its options `Arguments` and a function `command`;
only that of the command that is called is imported: asking for help must not pay for plotting.
"""

import importlib
import io
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from robocov_app.commands import COMMANDS

if TYPE_CHECKING:
    from robocov.errors import RobocovError

OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
TRACEBACK = "ROBOCOV_TRACEBACK"  # environment variable; where it is set, errors come with their traceback
# commands that call kernels, see `robocov.compiled`
_COMPILING = {"run", "compare", "sweep", "demo", "report", "paper", "replay", "cost", "optimum", "benchmark"}
_LONGEST = 1000  # characters of an error that are told
_EXAMPLES = (
    ("robocov demo", "the interactive window; robocov demo --tour plays a lesson of eleven chapters"),
    ("robocov run rooms --video --out first-run", "six robots cover six rooms; pictures and a film"),
    ("robocov compare office --controllers rapf rpf lloyd --out office", "three controllers, same starts"),
    ("robocov run rooms --controller mine.py:MyController", "a control law of your own"),
)
_FIRST_STEPS = """\
robocov demo --tour                           a lesson in the window
robocov run rooms --video --out first-run     one run, with pictures and a film
robocov edit mine.json                        draw a map
robocov handbook                              tutorials, guides, reference
robocov --help                                all commands"""


def main(arguments: list[str] | None = None) -> int:
    """Run `robocov` with the given arguments and return its exit status."""
    _prepare_output()
    given = sys.argv[1:] if arguments is None else arguments
    if not given or given[0] in ("-h", "--help", "help"):
        print(_overview() if given or not sys.stdout.isatty() else _FIRST_STEPS)
        return OK if given else BAD_INPUT
    if given[0] == "--version":
        from robocov import __version__

        print(f"robocov {__version__}")
        return OK
    name, *rest = given
    if name not in COMMANDS:
        near = get_close_matches(name, COMMANDS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(COMMANDS)}"
        return _complain(f"unknown command {name!r}: {hint}")
    # what is called from other code, as tests do, stays in this process
    return _guarded(name, rest, supervised=arguments is None)


def _guarded(name: str, rest: list[str], *, supervised: bool = False) -> int:
    from robocov_app.terminal.standard_streams import StandardStreams
    from robocov_app.terminal.supervision import (
        begin_supervised,
        can_supervise,
        find_own_controllers,
        report_status,
        supervise,
    )

    controllers = find_own_controllers(rest)
    if supervised and controllers and can_supervise():
        status, complaint = supervise(controllers)
        return _complain(complaint, FAILED) if complaint else status
    descriptor = begin_supervised() if supervised else None
    streams = StandardStreams()
    try:
        status = _run_command(name, rest)
        closed = streams.restore()
    except BaseException as error:
        closed = streams.restore()
        status = FAILED if closed else _explain(error, name)
    if closed:
        who = f"controller {', '.join(controllers)}" if controllers else "the command"
        status = _complain(f"{who}: it closed the {' and the '.join(closed)}", FAILED)
    streams.close()
    if descriptor is not None:
        report_status(descriptor, status)
    return status


def _run_command(name: str, rest: list[str]) -> int:
    """Run a command and return its exit status; it may raise anything."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # stdout belongs to answers
    with _stopping_at_once():
        module = importlib.import_module(f"robocov_app.commands.{COMMANDS[name][0]}")
        from robocov_app.terminal.arguments import parse_options

        options = parse_options(module.Arguments, name, rest)
    if name in _COMPILING:
        from robocov_app.terminal.progress import report_compilation

        report_compilation()
    from robocov_app.terminal.interruption import note_interrupts

    with note_interrupts():
        status = module.command(options)
    sys.stdout.flush()
    return int(status or OK)


def _find_users_fault(error: BaseException) -> "RobocovError | None":
    """Return what is wrong in a user's own code, if the error comes from there."""
    if "robocov.controllers" not in sys.modules:
        return None  # Without it, which takes long to import, no code of users has run.
    from robocov.controllers.user_modules import explain_user_fault

    return explain_user_fault(error)


def _explain(error: BaseException, name: str) -> int:
    """Say in one line why a command has failed, and return its exit status."""
    from robocov.errors import ControllerEndedError, ParameterError, RobocovError
    from robocov_app.terminal.interruption import was_interrupted
    from robocov_app.terminal.output import echo

    if isinstance(error, ControllerEndedError):
        return _complain(str(error), FAILED)
    if isinstance(error, ParameterError):
        from robocov_app.terminal.arguments import name_option

        module = importlib.import_module(f"robocov_app.commands.{COMMANDS[name][0]}")
        return _complain(name_option(module.Arguments, str(error)))
    if isinstance(error, RobocovError):
        return _complain(str(error))
    fault = _find_users_fault(error)
    if isinstance(error, KeyboardInterrupt) and (was_interrupted() or fault is None):
        echo("robocov: stopped", to_stderr=True)
        return INTERRUPTED
    if isinstance(error, BrokenPipeError):
        # the reader (head, say) has had enough; keep the interpreter from complaining at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    if isinstance(error, OSError):
        file = error.filename
        what = "the answer cannot be written" if file is None else f"{os.fsdecode(file)}: cannot be used"
        return _complain(f"{what}: {error.strerror or error}")
    if isinstance(error, SystemExit) and fault is None:
        return error.code if isinstance(error.code, int) else OK if error.code is None else BAD_INPUT
    if fault is not None:
        return _complain(str(fault), FAILED if isinstance(fault, ControllerEndedError) else BAD_INPUT)
    if not isinstance(error, Exception | SystemExit):
        return _complain(f"ended by {type(error).__name__}: {error}", FAILED)
    echo("".join(traceback.format_exception(error)), end="", to_stderr=True)
    echo("robocov: this is a fault of robocov, not of your input; please report it", to_stderr=True)
    return FAILED


@contextmanager
def _stopping_at_once() -> Iterator[None]:
    """End the process at Ctrl-C while modules are loaded, when there is nothing to lose.

    Python now and then swallows an interruption there, and would go on as if nobody had wanted to stop.
    """
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def stop(number: int, frame: object) -> None:
        os.write(2, b"robocov: stopped\n")
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _prepare_output() -> None:
    """Make sure that answers can be written whatever the terminal, with a ? where it knows no ²."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the caller
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 - it stays open to the end
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _complain(message: str, status: int = BAD_INPUT) -> int:
    from robocov_app.terminal.output import echo

    if os.environ.get(TRACEBACK):
        echo(traceback.format_exc(), end="", to_stderr=True)
    # names of files and gains may hold line breaks, or thousands of characters; an error is one line
    line = " ".join(message.splitlines())
    line = line if len(line) <= _LONGEST else f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 3 :]}"
    echo(f"robocov: error: {line}", to_stderr=True)
    return status


def _overview() -> str:
    width = max(map(len, COMMANDS))
    parts = ["usage: robocov COMMAND [options]", "Multi-robot coverage control among unknown obstacles."]
    lines = [f"  {name:<{width}}  {line}" for name, (_, line) in COMMANDS.items()]
    parts += ["\n".join(["commands:", *lines])]
    parts += ["\n".join(["examples:", *(f"  {call}\n      {line}" for call, line in _EXAMPLES)])]
    return "\n\n".join([*parts, "robocov COMMAND -h explains a command; robocov --version"])
