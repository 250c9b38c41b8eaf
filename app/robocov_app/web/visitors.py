"""Identities and folders of the visitors of a server that opens a window for each of them."""

from __future__ import annotations

import hmac
import json
import secrets
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeGuard

from robocov.files.writing import replace_file

FILE_NAME = ".robocov-visitors.json"
_ID_BYTES = 18
_ID_CHARACTERS = 24


def create_id() -> str:
    """Create a random identity for a visitor, which cannot be guessed."""
    return secrets.token_urlsafe(_ID_BYTES)


def sign(visitor: str, key: str) -> str:
    """Return the token of a visitor, which proves that the server with this key has admitted them."""
    return f"{visitor}.{_compute_signature(visitor, key)}"


def read_id(token: str) -> str:
    """Return the identity in a token without checking its signature; empty if it is not a visitor's token."""
    visitor, dot, _ = token.partition(".")
    return visitor if dot and len(visitor) == _ID_CHARACTERS else ""


def is_signed(token: str, key: str) -> bool:
    """Return whether a token was signed with this key."""
    visitor = read_id(token)
    return bool(visitor) and hmac.compare_digest(token.encode(errors="replace"), sign(visitor, key).encode())


def _compute_signature(visitor: str, key: str) -> str:
    """Return the first 128 bits of the HMAC of an identity, as hexadecimal digits."""
    return hmac.new(key.encode(), visitor.encode(errors="replace"), sha256).hexdigest()[:32]


class VisitorFolders:
    """The folders of all visitors in one parent folder, including visitors of earlier servers.

    A file in the parent folder maps hashes of visitors' identities to their folders, so that someone who
    reads the file cannot use the identities.

    Parameters
    ----------
    folder : Path
        The parent folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        content = self._read()
        cookie = content.get("cookie")
        self.cookie = cookie if _is_cookie_name(cookie) else f"robocov-{secrets.token_hex(6)}"
        """Name of the visitors' cookie, unique because browsers share cookies among all ports of a host."""
        self._names = _read_names(content)

    def find(self, visitor: str) -> Path | None:
        """Return the folder of a returning visitor; None for a new visitor."""
        name = self._names.get(_hash(visitor))
        if name is None or not (self._folder / name).is_dir():
            return None
        return self._folder / name

    def create(self) -> Path:
        """Create a folder for a new visitor; raise `OSError` if that is not possible."""
        number = 1
        while True:
            path = self._folder / f"session-{number}"
            try:
                path.mkdir()
                return path
            except FileExistsError:
                number += 1

    def assign(self, visitor: str, path: Path) -> None:
        """Assign a folder to a visitor; raise `OSError` or `OutputError` if it cannot be recorded."""
        # Another server may have updated the file in the meantime.
        self._names = {**_read_names(self._read()), **self._names, _hash(visitor): path.name}
        content = {"cookie": self.cookie, "visitors": self._names}
        with replace_file(self._folder / FILE_NAME) as temporary:
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    def _read(self) -> dict[str, Any]:
        """Return the content of the file; empty if it cannot be read."""
        with suppress(OSError, ValueError):
            content = json.loads((self._folder / FILE_NAME).read_text("utf-8"))
            if isinstance(content, dict):
                return content
        return {}


def _hash(visitor: str) -> str:
    """Return the hash under which the folder of a visitor's identity is stored."""
    return sha256(visitor.encode(errors="replace")).hexdigest()


def _read_names(content: dict[str, Any]) -> dict[str, str]:
    """Return the valid folder names in the content of the file, by the hash of the visitor's identity."""
    names = content.get("visitors")
    if not isinstance(names, dict):
        return {}
    return {str(key): name for key, name in names.items() if _is_session_name(name)}


def _is_cookie_name(name: object) -> TypeGuard[str]:
    return isinstance(name, str) and name.startswith("robocov-") and name[len("robocov-") :].isalnum()


def _is_session_name(name: object) -> TypeGuard[str]:
    return isinstance(name, str) and name.startswith("session-") and name[len("session-") :].isdecimal()
