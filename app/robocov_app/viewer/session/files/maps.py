"""The maps of a session file: bundled maps by name and digest, others in full; each is stored once."""

import hashlib
import json
from collections.abc import Collection, Mapping
from functools import cache, lru_cache
from typing import Any, NoReturn

from pydantic_core import PydanticCustomError

from robocov.environment import Environment
from robocov.errors import Issue, MapError, quote, quote_json
from robocov.mapfile import from_json, list_bundled_maps, load_map, to_json
from robocov_app.viewer.session.files.models import BundledMapModel

DIGEST_CHARS = 16
_DIGESTS_WITH_DESCRIPTION = {
    "blocks-a": "016c47aecf35c2ce",
    "blocks-b": "5c0d42c52e56fbc4",
    "campus": "9fdad3c0d5c43c21",
    "cave": "15826297a0518ea8",
    "city": "ae11b90f987b941d",
    "corridor": "b158a1ca98c969c0",
    "courtyard": "3657aa4d3bc5b48a",
    "forklifts": "d04f1fc56f88e3bd",
    "gaps": "d9df1e61e2c91c73",
    "hospital": "251d4cd81e686dc9",
    "l-shape": "ea129597b6c4c5e9",
    "museum": "07a70595f9811cd5",
    "office": "f27af4dc7ac1721a",
    "pentagon": "2ba69474dae2f664",
    "rooms": "f80cc6154428d973",
    "square": "70a1f7aab13565c4",
    "trap": "360c3417c0777a47",
    "warehouse": "928aa1bf7944e421",
}
"""Digests of the bundled maps in sessions of earlier versions, whose digests included the description."""


def reject_value(source_name: str, path: tuple[str | int, ...], value: object, expected: str) -> NoReturn:
    """Raise a MapError about a value in a session file.

    Parameters
    ----------
    source_name : str
        Name of the file.
    path : tuple of str and int
        JSON path of the value.
    value : object
        The value.
    expected : str
        Description of the expected value.
    """
    message = f"expected {expected}, got {quote_json(value)}"
    raise MapError.from_issues(source_name, [Issue.at_path(path, message)])


class FileContext:
    """Context in which the fields of a session file are read or written: maps and allowed controllers.

    Parameters
    ----------
    source_name : str
        Name of the file.
    controllers : collection of str
        Controllers in users' files that may be loaded, as the user has named them.

    Attributes
    ----------
    maps : list
        The maps as represented in the file.
    """

    def __init__(self, source_name: str = "", controllers: Collection[str] = ()) -> None:
        self.source_name = source_name
        self.controllers = controllers
        self.maps: list[Any] = []
        self._environments: dict[int, Environment] = {}

    def get_number(self, environment: Environment) -> int:
        """Return the number of a map in the file; add it to `maps` if it is new."""
        content = _build_map_content(environment)
        if content not in self.maps:
            self.maps.append(content)
        return self.maps.index(content)

    def get_environment(self, number: int) -> Environment:
        """Return the map with a number.

        Raises
        ------
        MapError
            If the map cannot be used.
        PydanticCustomError
            If there is no map with this number.
        """
        if number not in self._environments:
            self._environments[number] = self._load_environment(number)
        return self._environments[number]

    def _load_environment(self, number: int) -> Environment:
        """Build the map with a number from its representation in the file."""
        if number >= len(self.maps):
            expected = f"the number of a map, 0 to {len(self.maps) - 1}"
            raise PydanticCustomError("expected", "{message}", {"message": expected})
        content = self.maps[number]
        if isinstance(content, BundledMapModel):
            return self._load_bundled_map(number, content)
        try:
            return from_json(content)
        except MapError as error:
            message = f"maps[{number}]: {str(error).removeprefix('map: ')}"
            raise MapError.from_issues(self.source_name, [Issue(("maps", number), message)]) from None

    def _load_bundled_map(self, number: int, content: BundledMapModel) -> Environment:
        if content.bundled not in list_bundled_maps():
            path = ("maps", number, "bundled")
            reject_value(self.source_name, path, content.bundled, "the name of a bundled map")
        environment = load_map(content.bundled)
        digest = _compute_digest(to_json(environment))
        if content.digest not in (digest, _DIGESTS_WITH_DESCRIPTION.get(content.bundled)):
            expected = quote_json(digest)
            reason = f"the bundled map {quote(content.bundled)} has changed since the session was saved"
            message = f"expected {expected}, got {quote_json(content.digest)}: {reason}"
            raise MapError.from_issues(self.source_name, [Issue.at_path(("maps", number, "digest"), message)])
        return environment


def find_bundled_name(environment: Environment) -> str | None:
    """Return the name under which a map is bundled; None if it is not bundled."""
    return _build_map_content(environment).get("bundled")


@lru_cache(maxsize=8)
def _build_map_content(environment: Environment) -> dict[str, Any]:
    """Return the representation of a map in session files."""
    content = to_json(environment)
    for name, bundled_content in _load_bundled_contents().items():
        if content == bundled_content:
            return {"bundled": name, "digest": _compute_digest(content)}
    return content


@cache
def _load_bundled_contents() -> dict[str, dict[str, Any]]:
    """Return the content of each bundled map, by its name."""
    return {name: to_json(load_map(name)) for name in list_bundled_maps()}


def _compute_digest(content: Mapping[str, Any]) -> str:
    """Return the digest of a map without its description, on which no simulation depends."""
    text = json.dumps({**content, "description": None}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGEST_CHARS]
