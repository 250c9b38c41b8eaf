"""Links to served windows."""

from __future__ import annotations

import socket
from urllib.parse import urlsplit

import pytest

from robocov_app.web.access import build_link


@pytest.mark.parametrize("host", ["0.0.0.0", "127.0.0.1", "::1"])
def test_the_server_answers_at_the_address_of_its_link(host: str) -> None:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        server = socket.create_server((host, 0), family=family)
    except OSError:
        pytest.skip(f"this machine cannot listen at {host}")
    with server:
        link = urlsplit(build_link(host, server.getsockname()[1], token="secret"))
        assert link.hostname is not None
        assert link.port is not None
        socket.create_connection((link.hostname, link.port), timeout=5).close()
    assert link.query == "token=secret"


def test_a_server_at_all_addresses_is_reached_from_the_network(monkeypatch: pytest.MonkeyPatch) -> None:
    class ConnectedSocket(socket.socket):
        def connect(self, address: object) -> None:
            """Connect nowhere."""

        def getsockname(self) -> tuple[str, int]:
            return "10.0.0.7", 40000

    monkeypatch.setattr(socket, "socket", ConnectedSocket)
    assert build_link("0.0.0.0", 8765, token="secret") == "http://10.0.0.7:8765/?token=secret"
    assert build_link("127.0.0.1", 8765, token="secret") == "http://127.0.0.1:8765/?token=secret"


def test_without_a_network_the_link_leads_to_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    class UnconnectedSocket(socket.socket):
        def connect(self, address: object) -> None:
            raise OSError("network is unreachable")

    monkeypatch.setattr(socket, "socket", UnconnectedSocket)
    assert build_link("0.0.0.0", 8765, token="secret") == "http://127.0.0.1:8765/?token=secret"
