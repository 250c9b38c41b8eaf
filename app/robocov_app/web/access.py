"""Access to a served window: tokens in links and cookies."""

import hmac
from collections.abc import Iterable
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qsl

from robocov.errors import InputError


def link_to(host: str, port: int, token: str) -> str:
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/?token={token}"


def listening_failed(host: str, port: int, error: OSError) -> InputError:
    why = (error.strerror or str(error)).rpartition(": ")[2]
    return InputError(f"--port: {host}:{port} cannot be listened to: {why}; --port 0 takes one that is free")


def query_of(address: str) -> dict[str, str]:
    return dict(parse_qsl(address.partition("?")[2]))


def token_in(address: str) -> str:
    return query_of(address).get("token", "")


def cookies_of(headers: Iterable[str]) -> dict[str, str]:
    try:
        return {name: each.value for name, each in SimpleCookie("; ".join(headers)).items()}
    except CookieError:
        return {}


def same(token: str, other: str) -> bool:
    """Compare in a time that tells nothing of where they differ."""
    return hmac.compare_digest(token.encode(errors="replace"), other.encode())
