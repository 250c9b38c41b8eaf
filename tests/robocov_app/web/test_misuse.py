"""Misuse of a served window: it stops no other page, and shows the window to no stranger."""

import os
import socket
import struct
import time
import urllib.request
from contextlib import ExitStack, suppress

import numpy as np
import pygame
import pytest

pytest.importorskip("websockets")

from page_client import connect_page, wait_until
from websockets.exceptions import ConnectionClosed

from robocov_app.web.server import WebDisplay

MAX_ANSWER_S = 10.0


@pytest.fixture
def display(folder, capfd, monkeypatch):
    """Serve a window; check afterwards that it still answers and that nothing failed."""
    monkeypatch.setattr("robocov_app.web.connections.REQUEST_TIMEOUT_S", 1.0)
    with WebDisplay(folder=folder) as display:
        display.send(pygame.Surface((60, 40), 0, 32))
        yield display
        check_health(display)
    assert "Traceback" not in capfd.readouterr().err


def check_health(display):
    """Check that the page opens and gets a frame."""
    with urllib.request.urlopen(display.link, timeout=MAX_ANSWER_S) as response:
        assert b"<canvas" in response.read()
    with connect_page(display.link) as page:
        page.receive_frame()


def open_raw_connection(display):
    return socket.create_connection(("127.0.0.1", display.port), timeout=MAX_ANSWER_S)


def send_request(display, request):
    """Send bytes, and return what the server answers: all of a page, or the start of an error."""
    received = b""
    with open_raw_connection(display) as connection, suppress(OSError):
        with suppress(OSError):
            connection.sendall(request)
        while block := connection.recv(1 << 16):
            received += block
            if b"\r\n\r\n" in received and not received.startswith(b"HTTP/1.1 200"):
                break
    return received


def build_handshake(path, **changes):
    """Return the request that opens a socket, with changed headers; None removes a header."""
    headers = {
        "Host": "127.0.0.1",
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version": "13",
        **{name.replace("_", "-"): value for name, value in changes.items()},
    }
    lines = [f"{name}: {value}" for name, value in headers.items() if value is not None]
    return "\r\n".join([f"GET {path} HTTP/1.1", *lines, "", ""]).encode("latin-1")


def build_download_request(display, name):
    return f"GET /saved/{name}?token={display.token} HTTP/1.1\r\n\r\n".encode()


REQUESTS = {
    "nothing": b"\r\n\r\n",
    "zeros": bytes(100_000),
    "noise": np.random.default_rng(0).bytes(100_000),
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(200),
    "HTTP/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(30),
    "HTTP/0.9": b"GET /\r\n\r\n",
    "HTTP/9.9": b"GET / HTTP/9.9\r\n\r\n",
    "SSH": b"SSH-2.0-OpenSSH_9.6\r\n",
    "no path": b"GET  HTTP/1.1\r\n\r\n",
    "long path": b"GET /" + b"a" * 1_000_000 + b" HTTP/1.1\r\n\r\n",
    "long header": b"GET / HTTP/1.1\r\nX: " + b"a" * 1_000_000 + b"\r\n\r\n",
    "line without end": b"a" * 2_000_000,
    "many headers": b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 100_000 + b"\r\n",
    "many cookies": b"GET / HTTP/1.1\r\nCookie: " + b"a=b; " * 1500 + b"\r\n\r\n",
    "broken cookie": b'GET / HTTP/1.1\r\nCookie: \xff=\x80; =; ;;; a"b=\\\r\n\r\n',
    "null in path": b"GET /\0?token=\0 HTTP/1.1\r\n\r\n",
    "non-ASCII characters": "GET /ä?token=ß HTTP/1.1\r\n\r\n".encode(),
    "folded header": b"GET / HTTP/1.1\r\nX: a\r\n b\r\n\r\n",
    "header without colon": b"GET / HTTP/1.1\r\nHost\r\n\r\n",
    "body": b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello",
    "endless body": b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n" + bytes(1_000_000),
    "chunks": b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\n",
    "proxy": b"CONNECT example.com:443 HTTP/1.1\r\n\r\n",
    "address of another host": b"GET http://example.com/ HTTP/1.1\r\n\r\n",
    "options": b"OPTIONS * HTTP/1.1\r\n\r\n",
    "parent folders": b"GET /../../../../etc/passwd HTTP/1.1\r\n\r\n",
    "encoded parent folders": b"GET /saved/%2e%2e%2f%2e%2e%2fetc%2fpasswd HTTP/1.1\r\n\r\n",
    "two requests": b"GET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\n\r\n",
    "smuggled": b"GET / HTTP/1.1\r\nContent-Length: 0\r\nContent-Length: 50\r\n\r\nGET / HTTP/1.1\r\n\r\n",
    "line feeds without carriage returns": b"GET / HTTP/1.1\nHost: a\n\n",
    "token in a fragment": b"GET /#token=TOKEN HTTP/1.1\r\n\r\n",
    "token as a password": b"GET / HTTP/1.1\r\nAuthorization: Bearer TOKEN\r\n\r\n",
    "token as a user": b"GET http://TOKEN@localhost/ HTTP/1.1\r\n\r\n",
    "token in the path": b"GET /TOKEN/ HTTP/1.1\r\n\r\n",
    "token in a referrer": b"GET / HTTP/1.1\r\nReferer: http://localhost/?token=TOKEN\r\n\r\n",
    "token in another cookie": b"GET / HTTP/1.1\r\nCookie: token=TOKEN\r\n\r\n",
    "token in another case": b"GET /?token=tOKEN HTTP/1.1\r\n\r\n",
    "token with a suffix": b"GET /?token=TOKENx HTTP/1.1\r\n\r\n",
    "wrong token last": b"GET /?token=TOKEN&token=x HTTP/1.1\r\n\r\n",
}


ALLOWED_ANSWERS = (b"", *(f"HTTP/1.1 {status}".encode() for status in (400, 403, 404, 405, 414, 431)))


@pytest.mark.parametrize("name", REQUESTS)
def test_malformed_requests_and_misplaced_tokens_get_no_page(display, name):
    request = REQUESTS[name].replace(b"TOKEN", display.token.encode())
    answer = send_request(display, request)
    assert b"<canvas" not in answer
    assert answer[:12] in ALLOWED_ANSWERS


HANDSHAKES = {
    "no key": {"Sec_WebSocket_Key": None},
    "short key": {"Sec_WebSocket_Key": "a"},
    "no version": {"Sec_WebSocket_Version": None},
    "old version": {"Sec_WebSocket_Version": "8"},
    "no upgrade": {"Upgrade": None},
    "another origin": {"Origin": "http://127.0.0.1.example"},
    "no host": {"Origin": "http://127.0.0.1", "Host": None},
    "origin null": {"Origin": "null"},
    "origin without a host": {"Origin": "http://", "Host": "x"},
    "origin of control characters": {"Origin": "http://127.0.0.1\t"},
}


@pytest.mark.parametrize("name", HANDSHAKES)
def test_invalid_handshakes_open_no_socket(display, name):
    answer = send_request(display, build_handshake(f"/socket?token={display.token}", **HANDSHAKES[name]))
    if name == "origin of control characters":  # White space around a value is not part of it.
        assert answer.startswith(b"HTTP/1.1 101")
    else:
        assert answer[:12] in (b"HTTP/1.1 400", b"HTTP/1.1 403", b"HTTP/1.1 426")


FRAMES = {
    "noise": np.random.default_rng(1).bytes(50_000),
    "not masked": b"\x81\x02{}",
    "reserved bits": b"\xf1\x80\0\0\0\0",
    "unknown opcode": b"\x83\x80\0\0\0\0",
    "long ping": b"\x89\xfe\x01\x00" + bytes(4 + 256),
    "continuation without a start": b"\x80\x80\0\0\0\0",
    "endless message": b"\x81\xff" + struct.pack(">Q", 2**62) + bytes(4),
    "negative length": b"\x81\xff" + struct.pack(">Q", 2**63 + 5) + bytes(4),
    "many continuations": b"\x01\x81\0\0\0\0a" + b"\x00\x81\0\0\0\0a" * 50_000,
    "invalid UTF-8": b"\x81\x82\0\0\0\0\xc3\x28",
    "wrong close": b"\x88\x82\0\0\0\0\x00\x01",
    "close of one byte": b"\x88\x81\0\0\0\0\x00",
    "many pings": b"\x89\x80\0\0\0\0" * 20_000,
    "half of a frame": b"\x81\xfe\xff",
}


@pytest.mark.parametrize("name", FRAMES)
def test_malformed_websocket_frames_stop_no_other_page(display, name):
    with open_raw_connection(display) as connection:
        connection.sendall(build_handshake(f"/socket?token={display.token}"))
        assert connection.recv(1 << 16).startswith(b"HTTP/1.1 101")
        with suppress(OSError):
            connection.sendall(FRAMES[name])
        check_health(display)


def test_pages_open_in_spite_of_many_silent_connections(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.MAX_UNANSWERED", 40)
    with ExitStack() as stack:
        for number in range(300):
            connection = stack.enter_context(open_raw_connection(display))
            with suppress(OSError):
                connection.sendall(b"GET / HT" * (number % 3))
        check_health(display)


def test_a_request_that_arrives_byte_by_byte_times_out(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.REQUEST_TIMEOUT_S", 0.3)
    with open_raw_connection(display) as connection:
        start_time = time.monotonic()
        with suppress(OSError):
            while time.monotonic() - start_time < MAX_ANSWER_S:
                connection.sendall(b"a")
                time.sleep(0.02)
        assert time.monotonic() - start_time < MAX_ANSWER_S


def test_pages_of_short_connections_are_removed(display):
    for number in range(60):
        connection = open_raw_connection(display)
        if number % 3:
            connection.sendall(build_handshake(f"/socket?token={display.watch_token}"))
        if number % 2:  # Reset the connection instead of closing it.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        connection.close()
    wait_until(lambda: not display.shared.pages)
    assert len(display.shared.delivery.bases) <= 1


def open_slow_connection(display):
    """Open a connection with a small receive buffer, so that the server has to wait for its reader."""
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect(("127.0.0.1", display.port))
    return connection


def test_a_page_that_never_reads_is_disconnected(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.page_connection.SEND_TIMEOUT_S", 0.5)
    # The server sends frames although the page confirms none.
    monkeypatch.setattr("robocov_app.web.pages.MAX_FRAMES_IN_FLIGHT", 1000)
    with open_slow_connection(display) as connection:
        connection.sendall(build_handshake(f"/socket?token={display.watch_token}"))
        wait_until(lambda: display.shared.pages)
        deadline = time.monotonic() + MAX_ANSWER_S
        noise = np.random.default_rng(0)
        surface = pygame.Surface((400, 300), 0, 32)
        while display.shared.pages and time.monotonic() < deadline:
            pygame.surfarray.blit_array(surface, noise.integers(0, 255, (400, 300, 3)))
            display.send(surface)
            time.sleep(0.02)
        assert not display.shared.pages


def test_confirmations_of_frames_that_were_never_sent_are_ignored(display, teacher):
    for number in (0, 1, 7, 2**32 - 1):
        for _ in range(20):
            teacher.send(kind="shown", number=number)
    check_health(display)


def test_many_messages_of_a_viewer_delay_no_other_page(display, viewer):
    for _ in range(3000):
        viewer.send(kind="move", x=1, y=1)
    check_health(display)


def test_many_changes_of_a_name_delay_no_other_page(display, viewer):
    for number in range(1000):
        with suppress(ConnectionClosed):
            viewer.send(kind="name", name=f"Ada {number}")
    check_health(display)


def test_large_files_are_rejected_without_reading_them(display, folder):
    with (folder / "long.mp4").open("wb") as file:
        file.truncate(1 << 40)  # A sparse file occupies no disk space.
    display.saved_files = ("long.mp4",)
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(display.link.replace("/?", "/saved/long.mp4?"))
    with error.value as response:
        assert response.code == 404
        assert b"larger than 256 MB; copy it directly from the server's folder" in response.read()


def test_the_memory_of_unfinished_downloads_is_limited(display, folder, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.MAX_FILES_BYTES", 20 << 20)
    (folder / "run.mp4").write_bytes(bytes(8 << 20))
    display.saved_files = ("run.mp4",)
    request = build_download_request(display, "run.mp4")
    with open_raw_connection(display) as first, open_raw_connection(display) as second:
        for connection in (first, second):
            connection.sendall(request)
            assert connection.recv(1000).startswith(b"HTTP/1.1 200")
        assert send_request(display, request).startswith(b"HTTP/1.1 503")
    wait_until(lambda: send_request(display, request).startswith(b"HTTP/1.1 200"))


def test_slow_downloads_are_completed(display, folder, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.REQUEST_TIMEOUT_S", 0.2)
    monkeypatch.setattr("robocov_app.web.connections.CLOSE_TIMEOUT_S", 0.2)
    content = os.urandom(8 << 20)
    (folder / "run.mp4").write_bytes(content)
    display.saved_files = ("run.mp4",)
    received = b""
    with open_slow_connection(display) as connection:
        connection.sendall(build_download_request(display, "run.mp4"))
        for pause_at_bytes in (4 << 20, (8 << 20) - 20_000):
            while len(received) < pause_at_bytes and (block := connection.recv(1 << 19)):
                received += block
            time.sleep(0.6)
        while block := connection.recv(1 << 19):
            received += block
    assert received.endswith(content)
