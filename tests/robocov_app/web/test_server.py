"""The server of a window: starting, stopping, and requests other than GET."""

import socket
import time
import urllib.error
import urllib.request

import pytest

from robocov.errors import RobocovError

pytest.importorskip("websockets")

from robocov_app.web.server import WebDisplay


def test_stopping_does_not_wait_for_silent_connections():
    with WebDisplay() as display:
        silent_connection = socket.create_connection(("127.0.0.1", display.port))
        with urllib.request.urlopen(display.link):
            pass
        start_time = time.monotonic()
    assert time.monotonic() - start_time < 3.0
    silent_connection.close()


def test_a_port_in_use_is_rejected(display):
    message = rf"^--port: cannot listen at 127.0.0.1:{display.port}: address already in use. Use --port 0"
    with pytest.raises(RobocovError, match=message), WebDisplay(port=display.port):
        pass


def test_a_head_request_gets_headers_alone(display):
    request = urllib.request.Request(display.link, method="HEAD")
    with urllib.request.urlopen(request) as response:
        assert response.status == 200
        assert response.read() == b""


@pytest.mark.parametrize("method", ["POST", "DELETE"])
def test_other_methods_are_not_allowed(display, method):
    request = urllib.request.Request(display.link, method=method)
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(request)
    with error.value as response:
        assert response.code == 405
