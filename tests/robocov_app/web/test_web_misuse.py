"""What no browser does to a served window: it neither ends nor blocks, and who may see it still does."""

import json
import os
import socket
import struct
import time
import urllib.request
from contextlib import ExitStack, suppress
from pathlib import Path

import numpy as np
import pygame
import pytest

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from robocov_app.web.server import WebDisplay

PATIENCE_S = 10.0


@pytest.fixture
def display(tmp_path, capfd, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.REQUEST_TIMEOUT_S", 1.0)
    with WebDisplay(folder=tmp_path) as shown:
        shown.send(pygame.Surface((60, 40), 0, 32))
        yield shown
        check_health(shown)
    assert "Traceback" not in capfd.readouterr().err


def check_health(display):
    """Open the page and its socket, as a teacher who reloads, and see a frame."""
    with urllib.request.urlopen(display.link, timeout=PATIENCE_S) as answer:
        assert b"<canvas" in answer.read()
    with connect(build_socket_address(display), proxy=None, open_timeout=PATIENCE_S) as line:
        while not isinstance(line.recv(PATIENCE_S), bytes):
            pass


def build_socket_address(display, token=None):
    return f"ws://127.0.0.1:{display.port}/socket?token={token or display.token}"


def open_raw_connection(display):
    return socket.create_connection(("127.0.0.1", display.port), timeout=PATIENCE_S)


def answer_to(display, request):
    """Send bytes, and return all that comes back until the server ends the connection."""
    received = b""
    with open_raw_connection(display) as line, suppress(OSError):
        with suppress(OSError):
            line.sendall(request)
        while piece := line.recv(1 << 16):
            received += piece
            if b"\r\n\r\n" in received and not received.startswith(b"HTTP/1.1 200"):
                break
    return received


def upgrade(path, **changes):
    """Return the request that opens a socket; changes with None leave a header out."""
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
    "letters beyond ASCII": "GET /ä?token=ß HTTP/1.1\r\n\r\n".encode(),
    "folded header": b"GET / HTTP/1.1\r\nX: a\r\n b\r\n\r\n",
    "header without colon": b"GET / HTTP/1.1\r\nHost\r\n\r\n",
    "body": b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello",
    "endless body": b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n" + bytes(1_000_000),
    "chunks": b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\n",
    "proxy": b"CONNECT example.com:443 HTTP/1.1\r\n\r\n",
    "address of elsewhere": b"GET http://example.com/ HTTP/1.1\r\n\r\n",
    "options": b"OPTIONS * HTTP/1.1\r\n\r\n",
    "parent folders": b"GET /../../../../etc/passwd HTTP/1.1\r\n\r\n",
    "encoded parent folders": b"GET /saved/%2e%2e%2f%2e%2e%2fetc%2fpasswd HTTP/1.1\r\n\r\n",
    "two requests": b"GET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\n\r\n",
    "smuggled": b"GET / HTTP/1.1\r\nContent-Length: 0\r\nContent-Length: 50\r\n\r\nGET / HTTP/1.1\r\n\r\n",
    "line feeds alone": b"GET / HTTP/1.1\nHost: a\n\n",
    "token in a fragment": b"GET /#token=TOKEN HTTP/1.1\r\n\r\n",
    "token as a password": b"GET / HTTP/1.1\r\nAuthorization: Bearer TOKEN\r\n\r\n",
    "token as a user": b"GET http://TOKEN@localhost/ HTTP/1.1\r\n\r\n",
    "token in the path": b"GET /TOKEN/ HTTP/1.1\r\n\r\n",
    "token in a referrer": b"GET / HTTP/1.1\r\nReferer: http://localhost/?token=TOKEN\r\n\r\n",
    "token in another cookie": b"GET / HTTP/1.1\r\nCookie: token=TOKEN\r\n\r\n",
    "token of other letters": b"GET /?token=tOKEN HTTP/1.1\r\n\r\n",
    "token and more": b"GET /?token=TOKENx HTTP/1.1\r\n\r\n",
    "wrong token last": b"GET /?token=TOKEN&token=x HTTP/1.1\r\n\r\n",
}


@pytest.mark.parametrize("name", REQUESTS)
def test_requests_of_no_browser_get_nothing(display, name):
    request = REQUESTS[name].replace(b"TOKEN", display.token.encode())
    answer = answer_to(display, request)
    assert b"<canvas" not in answer
    assert answer[:12] in (b"", *(f"HTTP/1.1 {status}".encode() for status in (400, 403, 404, 405, 414, 431)))


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
def test_sockets_of_no_page_of_ours_do_not_open(display, name):
    answer = answer_to(display, upgrade(f"/socket?token={display.token}", **HANDSHAKES[name]))
    if name == "origin of control characters":  # white space around a header is none of it
        assert answer.startswith(b"HTTP/1.1 101")
    else:
        assert answer[:12] in (b"HTTP/1.1 400", b"HTTP/1.1 403", b"HTTP/1.1 426")


FRAMES = {
    "noise": np.random.default_rng(1).bytes(50_000),
    "not masked": b"\x81\x02{}",
    "reserved bits": b"\xf1\x80\0\0\0\0",
    "unknown kind": b"\x83\x80\0\0\0\0",
    "long ping": b"\x89\xfe\x01\x00" + bytes(4 + 256),
    "a piece of nothing": b"\x80\x80\0\0\0\0",
    "endless message": b"\x81\xff" + struct.pack(">Q", 2**62) + bytes(4),
    "negative length": b"\x81\xff" + struct.pack(">Q", 2**63 + 5) + bytes(4),
    "many pieces": b"\x01\x81\0\0\0\0a" + b"\x00\x81\0\0\0\0a" * 50_000,
    "no letters": b"\x81\x82\0\0\0\0\xc3\x28",
    "wrong close": b"\x88\x82\0\0\0\0\x00\x01",
    "close of one byte": b"\x88\x81\0\0\0\0\x00",
    "many pings": b"\x89\x80\0\0\0\0" * 20_000,
    "half of a frame": b"\x81\xfe\xff",
}


@pytest.mark.parametrize("name", FRAMES)
def test_frames_of_no_browser_end_their_connection_alone(display, name):
    with open_raw_connection(display) as line:
        line.sendall(upgrade(f"/socket?token={display.token}"))
        assert line.recv(1 << 16).startswith(b"HTTP/1.1 101")
        with suppress(OSError):
            line.sendall(FRAMES[name])
        check_health(display)


def test_many_silent_connections_keep_nobody_out(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.MAX_UNANSWERED", 40)
    with ExitStack() as stack:
        for number in range(300):
            line = stack.enter_context(open_raw_connection(display))
            with suppress(OSError):
                line.sendall(b"GET / HT" * (number % 3))
        check_health(display)


def test_a_request_that_comes_byte_by_byte_is_given_up(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.REQUEST_TIMEOUT_S", 0.3)
    with open_raw_connection(display) as line:
        begun = time.monotonic()
        with suppress(OSError):
            while time.monotonic() - begun < PATIENCE_S:
                line.sendall(b"a")
                time.sleep(0.02)
        assert time.monotonic() - begun < PATIENCE_S


def test_sockets_that_open_and_close_fast(display):
    for number in range(60):
        line = open_raw_connection(display)
        if number % 3:
            line.sendall(upgrade(f"/socket?token={display.watch_token}"))
        if number % 2:  # without a goodbye
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        line.close()
    end = time.monotonic() + PATIENCE_S
    while display.shared.pages and time.monotonic() < end:
        time.sleep(0.01)
    assert not display.shared.pages
    assert len(display.shared.delivery.bases) <= 1


def test_a_page_that_never_reads_is_ended_and_holds_up_nobody(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.page_connection.SEND_TIMEOUT_S", 0.5)
    monkeypatch.setattr("robocov_app.web.pages.MAX_FRAMES_IN_FLIGHT", 1000)  # it says that it has shown all
    with socket.socket() as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        line.connect(("127.0.0.1", display.port))
        line.sendall(upgrade(f"/socket?token={display.watch_token}"))
        end = time.monotonic() + PATIENCE_S
        while not display.shared.pages:
            time.sleep(0.01)
        noise = np.random.default_rng(0)
        surface = pygame.Surface((400, 300), 0, 32)
        while display.shared.pages and time.monotonic() < end:
            pygame.surfarray.blit_array(surface, noise.integers(0, 255, (400, 300, 3)))
            display.send(surface)
            time.sleep(0.02)
        assert not display.shared.pages


def test_a_page_that_says_what_it_never_got(display):
    with connect(build_socket_address(display), proxy=None) as line:
        for number in (0, 1, 7, 2**32 - 1):
            for _ in range(20):
                line.send(json.dumps({"kind": "shown", "number": number}))
        check_health(display)


def test_watchers_who_send_much_wait_and_hold_up_nobody(display):
    move = json.dumps({"kind": "move", "x": 1, "y": 1})
    with connect(build_socket_address(display, display.watch_token), proxy=None) as watcher:
        for _ in range(3000):
            watcher.send(move)
        check_health(display)


def test_a_name_in_turns_as_fast_as_possible(display):
    with connect(build_socket_address(display, display.watch_token), proxy=None) as watcher:
        for number in range(1000):
            with suppress(ConnectionClosed):
                watcher.send(json.dumps({"kind": "name", "name": f"Ada {number}"}))
        check_health(display)


def test_files_that_are_large_are_not_read_into_memory(display, tmp_path):
    with (tmp_path / "long.mp4").open("wb") as file:
        file.truncate(1 << 40)  # no bytes on the disk
    display.saved_files = ("long.mp4",)
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(display.link.replace("/?", "/saved/long.mp4?"))
    with refused.value as answer:
        assert answer.code == 404
        assert b"larger than 256 MB; copy it from the folder" in answer.read()


def test_files_that_nobody_takes_are_bounded(display, tmp_path, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.MAX_FILES_BYTES", 20 << 20)
    (tmp_path / "film.mp4").write_bytes(bytes(8 << 20))
    display.saved_files = ("film.mp4",)
    request = f"GET /saved/film.mp4?token={display.token} HTTP/1.1\r\n\r\n".encode()
    with open_raw_connection(display) as first, open_raw_connection(display) as second:
        for line in (first, second):
            line.sendall(request)
            assert line.recv(1000).startswith(b"HTTP/1.1 200")
        assert answer_to(display, request).startswith(b"HTTP/1.1 503")
    end = time.monotonic() + PATIENCE_S
    while not answer_to(display, request).startswith(b"HTTP/1.1 200"):
        assert time.monotonic() < end


def test_a_download_that_is_taken_slowly_is_not_cut(tmp_path, monkeypatch):
    monkeypatch.setattr("robocov_app.web.connections.REQUEST_TIMEOUT_S", 0.2)
    monkeypatch.setattr("robocov_app.web.connections.CLOSE_TIMEOUT_S", 0.2)
    content = os.urandom(8 << 20)
    Path(tmp_path / "film.mp4").write_bytes(content)
    with WebDisplay(folder=tmp_path) as display, socket.socket() as line:
        display.saved_files = ("film.mp4",)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        line.connect(("127.0.0.1", display.port))
        line.sendall(f"GET /saved/film.mp4?token={display.token} HTTP/1.1\r\n\r\n".encode())
        received = b""
        for size in ((4 << 20), (8 << 20) - 20_000):
            while len(received) < size and (piece := line.recv(1 << 19)):
                received += piece
            time.sleep(0.6)
        while piece := line.recv(1 << 19):
            received += piece
    assert received.endswith(content)
