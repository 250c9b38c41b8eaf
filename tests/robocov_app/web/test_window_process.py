"""The process of a visitor's window: the server learns its address, or why it did not open."""

import asyncio
import multiprocessing
from pathlib import Path

import pytest

from robocov.errors import InputError
from robocov_app.commands.options import WindowOptions
from robocov_app.toolkit.window.share_link import ShareLink
from robocov_app.web.window_process import (
    OpeningFailure,
    WindowAddress,
    get_server_access,
    start_window_process,
    wait_until_open,
)

LINK = ShareLink("http://192.0.2.1:8765/?token=everyone", "192.0.2.1", opens_own_window=True)


class FakeProcess:
    """A process that only notes whether it was terminated."""

    has_ended = False

    def terminate(self):
        self.has_ended = True


def send_to_server(folder: Path, *results: object) -> tuple[FakeProcess, object]:
    """Let a window's process send results and end; return the process and the opened window."""
    process = FakeProcess()
    receiver, sender = multiprocessing.Pipe(duplex=False)
    with sender:
        for result in results:
            sender.send(result)
    return process, asyncio.run(wait_until_open(process, receiver, folder))


def test_an_address_opens_the_window(tmp_path):
    process, window = send_to_server(tmp_path, WindowAddress(8000, "secret"))
    assert window.address == WindowAddress(8000, "secret")
    assert window.folder == tmp_path
    assert not process.has_ended


@pytest.mark.parametrize("message", ["--seed: expected a number", "Control the window: http://127.0.0.1:1/"])
def test_a_failure_is_an_error_whatever_its_text_is(tmp_path, message):
    folder = tmp_path / "visitor"
    folder.mkdir()
    with pytest.raises(InputError) as raised:
        send_to_server(folder, OpeningFailure(message))
    assert str(raised.value) == message
    assert not folder.exists()


def test_a_process_that_ends_without_a_result_has_not_opened_a_window(tmp_path):
    with pytest.raises(InputError, match="the window did not open"):
        send_to_server(tmp_path)


def print_and_open(options: WindowOptions) -> int:
    """Print a line and report an address, as a command that shows a window."""
    print("loaded a controller")
    server_access = get_server_access()
    assert server_access is not None
    assert server_access.link == LINK
    server_access.send_address(WindowAddress(options.port, "secret"))
    return 0


def test_text_that_a_command_prints_is_not_mistaken_for_a_result(tmp_path):
    process, receiver = start_window_process(
        print_and_open, WindowOptions(serve=True, each=True), tmp_path, LINK
    )
    window = asyncio.run(wait_until_open(process, receiver, tmp_path))
    process.join()
    assert window.address == WindowAddress(0, "secret")
