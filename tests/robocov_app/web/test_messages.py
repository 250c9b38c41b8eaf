"""Messages that a server receives from a page: which ones it accepts, and which ones close the connection."""

from contextlib import suppress

import pytest

pytest.importorskip("websockets")

from page_client import wait_until
from websockets.exceptions import ConnectionClosed

INVALID_MESSAGES = ("", "{}", "[" * 5000, '{"kind": "move", "x": 1e999, "y": 0}', b"\0\1", "9" * 99)
NOT_UNDERSTOOD = 1008
TOO_LARGE = 1009


@pytest.mark.parametrize("message", INVALID_MESSAGES, ids=range(len(INVALID_MESSAGES)))
def test_invalid_messages_close_the_connection(teacher, message):
    teacher.socket.send(message)
    code, _ = teacher.wait_for_close()
    assert code == NOT_UNDERSTOOD


@pytest.mark.parametrize("message", ["x" * (2 << 20), bytes(2 << 20)], ids=("text", "file"))
def test_messages_that_are_too_large_close_the_connection(teacher, message):
    with suppress(ConnectionClosed):
        teacher.socket.send(message)
    code, _ = teacher.wait_for_close()
    assert code == TOO_LARGE


def test_the_longest_text_that_a_page_pastes_is_accepted(display, teacher):
    text = "\N{SNOWMAN}\n" * 50_000
    teacher.send(kind="paste", text=text)
    messages = display.shared.window_input._messages
    wait_until(lambda: messages)
    assert messages.popleft().text == text
