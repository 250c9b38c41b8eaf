"""Access to served windows: by the token of a link, and by the cookie of a page."""

from __future__ import annotations

import urllib.error
import urllib.request
from http.cookies import SimpleCookie

import pytest

pytest.importorskip("websockets")

from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from robocov_app.toolkit.window.share_link import ShareLink
from robocov_app.web.server import WebDisplay


def fetch_cookie(display: WebDisplay) -> str:
    """Open the link for controlling, and return the cookie that the page sets."""
    with urllib.request.urlopen(display.link) as response:
        cookies = SimpleCookie(response.headers["Set-Cookie"])
    name, morsel = next(iter(cookies.items()))
    assert morsel["httponly"]
    assert morsel["samesite"] == "Lax"
    return f"{name}={morsel.value}"


def open_socket(display: WebDisplay, **headers: str) -> ClientConnection:
    """Open the socket of a window at its address without a token."""
    return connect(f"ws://127.0.0.1:{display.port}/socket", additional_headers=headers, proxy=None)


@pytest.mark.parametrize(
    "path",
    ["/", "/?token=", "/?token=" + "x" * 24, "/socket", "/page.html", "//[x/"],
)
def test_pages_without_a_valid_token_are_forbidden(display: WebDisplay, path: str) -> None:
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(f"http://127.0.0.1:{display.port}{path}")
    with error.value as response:
        assert response.code == 403


def test_a_socket_without_a_cookie_is_forbidden(display: WebDisplay) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        open_socket(display)
    with pytest.raises(InvalidStatus, match="403"):
        open_socket(display, Origin=f"http://127.0.0.1:{display.port}")


@pytest.mark.parametrize("origin", ["http://elsewhere.example", "http://[x"])
def test_pages_of_other_sites_cannot_open_a_socket(display: WebDisplay, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        open_socket(display, Cookie=fetch_cookie(display), Origin=origin)


def test_the_cookie_of_the_page_opens_a_socket(display: WebDisplay) -> None:
    with open_socket(display, Cookie=fetch_cookie(display), Origin=f"http://127.0.0.1:{display.port}"):
        pass


def test_the_cookie_opens_a_socket_behind_a_proxy(display: WebDisplay) -> None:
    headers = {"X-Forwarded-Host": "hub.example", "Origin": "https://hub.example"}
    with open_socket(display, Cookie=fetch_cookie(display), **headers):
        pass


def test_the_watch_link_does_not_replace_the_cookie_of_a_page_that_may_control(display: WebDisplay) -> None:
    request = urllib.request.Request(display.watch_link, headers={"Cookie": fetch_cookie(display)})
    with urllib.request.urlopen(request) as response:
        assert response.headers["Set-Cookie"] is None
    with urllib.request.urlopen(display.watch_link) as response:
        assert display.watch_token in response.headers["Set-Cookie"]


def test_the_watch_link_is_shared_unless_pages_connect_through_another_server() -> None:
    with WebDisplay() as display:
        assert display.share_link.address == display.watch_link
        assert not display.share_link.opens_own_window
    visitor_link = ShareLink("http://192.0.2.1:8765/?token=everyone", "192.0.2.1", opens_own_window=True)
    with WebDisplay(visitor_link=visitor_link) as display:
        assert display.share_link is visitor_link
        assert display.shared.invitation["link"] == visitor_link.address
