"""Interruption of a command by signals."""

import os
import signal
import threading

import pytest

from robocov_app.terminal.interruption import Interruption, note_interrupts, suppress_controller_errors

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_is_noted_and_the_second_ends(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), Interruption() as stop:
        assert not stop.requested
        os.kill(os.getpid(), number)
        assert stop.requested
        os.kill(os.getpid(), number)
    assert signal.getsignal(number) is before


def test_other_threads_leave_signals_alone() -> None:
    seen = []

    def note_request() -> None:
        with Interruption() as stop:
            seen.append(stop.requested)

    thread = threading.Thread(target=note_request)
    thread.start()
    thread.join()
    assert seen == [False]


class OddError(BaseException):
    pass


@pytest.mark.parametrize("error", [ValueError, SystemExit, GeneratorExit, KeyboardInterrupt, OddError])
def test_errors_of_controllers_are_suppressed(error: type[BaseException]) -> None:
    with note_interrupts(), suppress_controller_errors():
        raise error


def test_ctrl_c_in_a_controller_is_not_suppressed(interruptible: None) -> None:
    with pytest.raises(KeyboardInterrupt), note_interrupts(), suppress_controller_errors():
        signal.raise_signal(signal.SIGINT)
