"""The command `robocov`: finds the subcommand, and turns errors into one line and an exit status.

Only the module of the called subcommand is imported, so that help appears at once.
"""

import atexit
import gc
import importlib
import io
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from robocov_app.commands import COMMANDS

if TYPE_CHECKING:
    from robocov.errors import RobocovError

OK = 0
"""Exit status of a command that succeeded."""
FAILED = 1
"""Exit status of a command that failed for a reason other than its input."""
BAD_INPUT = 2
"""Exit status of a command whose input cannot be used."""
INTERRUPTED = 130
"""Exit status of a command that was interrupted."""
TRACEBACK_VARIABLE = "ROBOCOV_TRACEBACK"
"""Environment variable; if it is set, errors are printed with their traceback."""
_MAX_ERROR_CHARS = 1000
"""Maximum length of an error message; longer ones are shortened."""
_EXAMPLES = (
    ("robocov demo", "the interactive window; with --tour, a lesson of eleven chapters"),
    ("robocov run rooms --video --out first-run", "six robots cover six rooms; figures and a video"),
    ("robocov compare office --controllers rapf rpf lloyd --out office", "three controllers, same starts"),
    ("robocov run rooms --controller mine.py:MyController", "a controller of your own"),
)
"""Commands and explanations at the end of the help."""
_FIRST_STEPS = """\
robocov demo --tour                           a lesson in the window
robocov run rooms --video --out first-run     one run, with figures and a video
robocov edit mine.json                        draw a map
robocov handbook                              tutorials, guides, reference
robocov --help                                all commands"""
"""Text that is printed in a terminal if no command is given."""


def main(arguments: list[str] | None = None) -> int:
    """Run `robocov`.

    Parameters
    ----------
    arguments : list of str or None
        Words after `robocov`; by default those of the command line.

    Returns
    -------
    int
        The exit status.
    """
    _prepare_output()
    if arguments is None:
        # The operating system frees the memory of a process; collecting garbage at exit can take two seconds.
        atexit.register(gc.freeze)
    words = sys.argv[1:] if arguments is None else arguments
    if not words:
        _print_text(_FIRST_STEPS if sys.stdout.isatty() else _format_overview())
        return BAD_INPUT
    name, *rest = words
    if name in ("-h", "--help", "help"):
        _print_text(_format_overview())
        return OK
    if name == "--version":
        from robocov import __version__

        _print_text(f"robocov {__version__}")
        return OK
    if name not in COMMANDS:
        from robocov.errors import find_similar_names

        similar_names = find_similar_names(name, COMMANDS)
        hint = f"known are {', '.join(COMMANDS)}"
        if similar_names:
            hint = f"did you mean {' or '.join(map(repr, similar_names))}?"
        return _print_error(f"unknown command {name!r}: {hint}")
    # Calls from other code, such as tests, stay in this process.
    return _run_subcommand(name, rest, may_supervise=arguments is None)


def _run_subcommand(name: str, rest: list[str], *, may_supervise: bool) -> int:
    """Run a subcommand so that a user's controller cannot hide its failure, and return its exit status."""
    from robocov_app.terminal.standard_streams import StandardStreams
    from robocov_app.terminal.supervision import (
        can_supervise,
        find_user_controllers,
        prepare_supervision,
        report_status,
        supervise,
    )

    controllers = find_user_controllers(rest)
    if may_supervise and controllers and can_supervise():
        status, error_message = supervise(controllers)
        return _print_error(error_message, FAILED) if error_message else status
    descriptor = prepare_supervision() if may_supervise else None
    streams = StandardStreams()
    try:
        status = _run_command(name, rest)
        closed_streams = streams.restore()
    except BaseException as error:
        closed_streams = streams.restore()
        status = FAILED if closed_streams else _print_failure(error, name)
    if closed_streams:
        cause = f"controller {', '.join(controllers)}" if controllers else "the command"
        status = _print_error(f"{cause}: it closed the {' and the '.join(closed_streams)}", FAILED)
    streams.close()
    if descriptor is not None:
        report_status(descriptor, status)
    return status


def _import_command(name: str) -> ModuleType:
    """Import the module of a subcommand."""
    return importlib.import_module(f"robocov_app.commands.{COMMANDS[name].module}")


def _run_command(name: str, rest: list[str]) -> int:
    """Run a subcommand and return its exit status. It may raise anything."""
    # Standard output is for answers only.
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    with _end_at_once_on_interrupt():
        module = _import_command(name)
        from robocov_app.terminal.arguments import parse_options

        options = parse_options(module.Arguments, name, rest)
    from robocov_app.terminal.interruption import note_interrupts

    with ExitStack() as stack:
        if COMMANDS[name].uses_kernels:
            from robocov_app.terminal.progress import report_compilation

            stack.enter_context(report_compilation())
        stack.enter_context(note_interrupts())
        status = module.command(options)
    sys.stdout.flush()
    return int(status or OK)


def _print_failure(error: BaseException, name: str) -> int:
    """Print why a subcommand failed, and return its exit status.

    The message is one line, unless the failure is a fault of robocov itself.
    """
    from robocov.errors import ControllerEndedError, ParameterError, RobocovError

    if isinstance(error, ControllerEndedError):
        return _print_error(str(error), FAILED)
    if isinstance(error, ParameterError):
        from robocov_app.terminal.arguments import name_option

        return _print_error(name_option(_import_command(name).Arguments, str(error)))
    if isinstance(error, RobocovError):
        return _print_error(str(error))
    fault = _find_users_fault(error)
    if isinstance(error, KeyboardInterrupt) and _is_users_interrupt(fault):
        from robocov_app.terminal.output import echo

        echo("robocov: stopped", to_stderr=True)
        return INTERRUPTED
    if isinstance(error, BrokenPipeError):
        _discard_output()
        return OK
    if isinstance(error, OSError):
        return _print_os_error(error)
    if fault is not None:
        return _print_error(str(fault), FAILED if isinstance(fault, ControllerEndedError) else BAD_INPUT)
    if isinstance(error, SystemExit):
        return _get_exit_status(error)
    if not isinstance(error, Exception):
        return _print_error(f"ended by {type(error).__name__}: {error}", FAILED)
    return _print_internal_error(error)


def _print_text(text: str) -> None:
    """Print a text, and return quietly if the reader of the output has ended, as `head` does."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _discard_output()


def _discard_output() -> None:
    """Discard all further output, because the reader of the pipe has ended.

    Without this, Python would print an error when it exits.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _find_users_fault(error: BaseException) -> "RobocovError | None":
    """Return the explanation of an error that comes from a user's own code; None for any other error."""
    if "robocov.controllers" not in sys.modules:
        # No user's code has run if this package, which takes long to import, was not imported.
        return None
    from robocov.controllers.user_modules import explain_user_fault

    return explain_user_fault(error)


def _is_users_interrupt(fault: "RobocovError | None") -> bool:
    """Return whether a `KeyboardInterrupt` was Ctrl+C, rather than raised by a user's controller."""
    from robocov_app.terminal.interruption import was_interrupted

    return was_interrupted() or fault is None


def _print_os_error(error: OSError) -> int:
    """Print the file and the reason of an error of the operating system, and return the exit status."""
    reason = error.strerror or error
    if error.filename is None:
        return _print_error(f"the output cannot be written: {reason}")
    return _print_error(f"{os.fsdecode(error.filename)}: cannot be used: {reason}")


def _get_exit_status(error: SystemExit) -> int:
    """Return the exit status that a `SystemExit` requests."""
    if isinstance(error.code, int):
        return error.code
    return OK if error.code is None else BAD_INPUT


def _print_internal_error(error: BaseException) -> int:
    """Print the traceback of a fault of robocov, and return the exit status."""
    from robocov_app.terminal.output import echo

    echo("".join(traceback.format_exception(error)), end="", to_stderr=True)
    echo("robocov: this is a fault of robocov, not of your input; please report it", to_stderr=True)
    return FAILED


@contextmanager
def _end_at_once_on_interrupt() -> Iterator[None]:
    """End the process at Ctrl+C while modules are imported, when there are no results to keep.

    During imports, Python sometimes ignores a `KeyboardInterrupt`.
    """
    is_main_thread = threading.current_thread() is threading.main_thread()
    if not is_main_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
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
    """Make sure that any answer can be written. A character that cannot be encoded is replaced by a "?"."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            # The caller has closed the stream. Its replacement stays open until the process ends.
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _print_error(message: str, status: int = BAD_INPUT) -> int:
    """Print an error in one line, and return the exit status."""
    from robocov_app.terminal.output import echo

    if os.environ.get(TRACEBACK_VARIABLE):
        echo(traceback.format_exc(), end="", to_stderr=True)
    # Names of files and gains may contain line breaks, or thousands of characters.
    line = " ".join(message.splitlines())
    if len(line) > _MAX_ERROR_CHARS:
        line = f"{line[: _MAX_ERROR_CHARS // 2]} ... {line[-_MAX_ERROR_CHARS // 3 :]}"
    echo(f"robocov: error: {line}", to_stderr=True)
    return status


def _format_overview() -> str:
    """Return the help of `robocov`."""
    width = max(len(name) for name in COMMANDS)
    lines = [
        "usage: robocov COMMAND [options]",
        "",
        "Multi-robot coverage control among unknown obstacles.",
        "",
        "commands:",
    ]
    lines += [f"  {name:<{width}}  {command.summary}" for name, command in COMMANDS.items()]
    lines += ["", "examples:"]
    for call, explanation in _EXAMPLES:
        lines += [f"  {call}", f"      {explanation}"]
    lines += ["", "robocov COMMAND -h explains a command; robocov --version"]
    return "\n".join(lines)
