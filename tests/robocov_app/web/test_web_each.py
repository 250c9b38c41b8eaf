"""Everybody gets a window of their own, and comes back to it."""

import urllib.error
import urllib.request
from http.cookiejar import CookieJar

import pytest
from served_window import served

pytest.importorskip("websockets")

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("web")]


def visitor():
    """Return hands of a browser with cookies of its own: from an address to status, where it led, page."""
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))

    def opened(address):
        try:
            with browser.open(address) as answer:
                return answer.status, answer.url, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, address, error.read()

    return opened


def test_each_visitor_has_a_window_of_their_own(tmp_path):
    from websockets.sync.client import connect

    with served("demo", "rooms", "--paused", "--each", "--most", "2", "--folder", str(tmp_path)) as link:
        ada, ben, cleo = visitor(), visitor(), visitor()
        status, own, page = ada(link)
        assert status == 200
        assert b"<canvas" in page
        assert ben(link)[:2] != (status, own)
        assert ada(link)[1] == own  # she comes back to it
        assert ada(link.partition("?")[0])[0] == 200  # by her cookie alone
        strange = (link, link[:-3], link.partition("?")[0])
        assert [cleo(address)[0] for address in strange] == [503, 403, 403]
        with connect(own.replace("http", "ws").replace("/?", "/socket?"), proxy=None) as line:
            line.send('{"kind": "page", "width": 900, "height": 600, "ratio": 1.0, "dark": false}')
            while not isinstance(line.recv(10), bytes):
                pass
        assert sorted(each.name for each in tmp_path.iterdir()) == ["session-1", "session-2"]
