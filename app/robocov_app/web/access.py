"""Access to a served window: tokens in links and cookies."""

import hmac
from collections.abc import Iterable
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qsl

from robocov.errors import InputError

_LOOPBACK_ADDRESSES = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Addresses that a browser on this machine can open, for a server that listens at all addresses."""


def build_link(host: str, port: int, token: str) -> str:
    """Return the address of a served window with its token."""
    host = _LOOPBACK_ADDRESSES.get(host, host)
    if ":" in host:
        host = f"[{host}]"
    return f"http://{host}:{port}/?token={token}"


def build_listen_error(host: str, port: int, error: OSError) -> InputError:
    """Build the error that a server cannot listen at an address."""
    reason = (error.strerror or str(error)).rpartition(": ")[2]
    return InputError(f"--port: cannot listen at {host}:{port}: {reason}. Use --port 0 for any free port.")


def parse_query(address: str) -> dict[str, str]:
    """Return the query parameters of an address; if a name occurs several times, the last value counts."""
    return dict(parse_qsl(address.partition("?")[2]))


def get_token(address: str) -> str:
    """Return the token in an address; empty if it has none."""
    return parse_query(address).get("token", "")


def parse_cookies(headers: Iterable[str]) -> dict[str, str]:
    """Return the cookies of a request by their names; none if a header is invalid."""
    try:
        cookies = SimpleCookie("; ".join(headers))
    except CookieError:
        return {}
    return {name: cookie.value for name, cookie in cookies.items()}


def are_equal(token: str, other: str) -> bool:
    """Return whether two tokens are equal, in a time that does not reveal where they differ."""
    return hmac.compare_digest(token.encode(errors="replace"), other.encode())
