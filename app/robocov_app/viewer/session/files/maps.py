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


def refuse_value(where: str, path: tuple[str | int, ...], value: object, expected: str) -> NoReturn:
    """Raise a MapError about a value in a session file.

    Parameters
    ----------
    where : str
        Name of the file.
    path : tuple of str and int
        JSON path of the value.
    value : object
        The value.
    expected : str
        Description of the expected value.
    """
    message = f"expected {expected}, got {quote_json(value)}"
    raise MapError.from_issues(where, [Issue.at_path(path, message)])


class FileContext:
    """Context in which the fields of a session file are read or written: maps and allowed controllers.

    Parameters
    ----------
    where : str
        Name of the file.
    controllers : collection of str
        Controllers in users' files that may be loaded, as the user has named them.

    Attributes
    ----------
    maps : list
        The maps as represented in the file.
    """

    def __init__(self, where: str = "", controllers: Collection[str] = ()) -> None:
        self.where = where
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
            raise MapError.from_issues(self.where, [Issue(("maps", number), message)]) from None

    def _load_bundled_map(self, number: int, content: BundledMapModel) -> Environment:
        if content.bundled not in list_bundled_maps():
            path = ("maps", number, "bundled")
            refuse_value(self.where, path, content.bundled, "the name of a bundled map")
        environment = load_map(content.bundled)
        digest = _compute_digest(to_json(environment))
        if digest != content.digest:
            expected = quote_json(digest)
            reason = f"the bundled map {quote(content.bundled)} has changed since the session was saved"
            message = f"expected {expected}, got {quote_json(content.digest)}: {reason}"
            raise MapError.from_issues(self.where, [Issue.at_path(("maps", number, "digest"), message)])
        return environment


@lru_cache(maxsize=8)
def _build_map_content(environment: Environment) -> dict[str, Any]:
    """Return the representation of a map in session files."""
    content = to_json(environment)
    digest = _compute_digest(content)
    name = _list_bundled_digests().get(digest)
    if name is None:
        return content
    return {"bundled": name, "digest": digest}


@cache
def _list_bundled_digests() -> dict[str, str]:
    """Return the name of each bundled map, by its digest."""
    return {_compute_digest(to_json(load_map(name))): name for name in list_bundled_maps()}


def _compute_digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGEST_CHARS]
