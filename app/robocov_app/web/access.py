"""Access to a served window: tokens in links and cookies."""

import hmac
import socket
from collections.abc import Iterable
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qsl

from robocov.errors import InputError

CONTROL_LABEL = "Control the window: "
"""Text before the link in the first line that a served window prints."""
_LOOPBACK_ADDRESSES = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Addresses that a browser on this machine can open, for a server that listens at all addresses."""
_PROBES = {"0.0.0.0": (socket.AF_INET, "192.0.2.1"), "::": (socket.AF_INET6, "2001:db8::1")}
"""Families of these addresses, and addresses reserved for documentation, which lie in no local network."""


def find_network_address(host: str) -> str:
    """Find the address by which other computers reach a server that listens at a host.

    Parameters
    ----------
    host : str
        If it stands for all addresses, such as 0.0.0.0, the result is the address by which this machine
        reaches others, or a loopback address without a network. Other hosts are returned as they are.
    """
    if host not in _PROBES:
        return host
    family, remote_address = _PROBES[host]
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            # A datagram socket sends nothing when it connects, but then knows its own address.
            probe.connect((remote_address, 9))
            return str(probe.getsockname()[0])
    except OSError:
        return _LOOPBACK_ADDRESSES[host]


def build_link(host: str, port: int, token: str) -> str:
    """Return the address of a served window with its token."""
    host = find_network_address(host)
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
