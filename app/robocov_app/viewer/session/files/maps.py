"""The maps of a session file: bundled ones by name and digest, others in full, each of them once."""

import hashlib
import json
from collections.abc import Collection, Mapping
from functools import cache, lru_cache
from typing import Any, NoReturn

from pydantic_core import PydanticCustomError

from robocov.environment import Environment
from robocov.errors import MapError, Mistake, quote_json
from robocov.mapfile import from_json, list_bundled_maps, load_map, to_json
from robocov_app.viewer.session.files.models import BundledMapModel

DIGEST_CHARS = 16


def refuse_value(where: str, path: tuple[str | int, ...], value: object, expected: str) -> NoReturn:
    """Raise the MapError of a value in a session file.

    Parameters
    ----------
    where : str
        Name of the file.
    path : tuple of str and int
        JSON path of the value.
    value : object
        The value.
    expected : str
        The expected value.
    """
    message = f"expected {expected}, got {quote_json(value)}"
    raise MapError.from_mistakes(where, [Mistake.at_path(path, message)])


class FileContext:
    """The context of the fields of a session file: its maps, and the controllers that may be run.

    Parameters
    ----------
    where : str
        Name of the file.
    controllers : collection of str
        Controllers in files of the user's own, as the user has named them.

    Attributes
    ----------
    maps : list
        The maps as they are in the file.
    """

    def __init__(self, where: str = "", controllers: Collection[str] = ()) -> None:
        self.where = where
        self.controllers = controllers
        self.maps: list[Any] = []
        self._environments: dict[int, Environment] = {}

    def get_number(self, environment: Environment) -> int:
        """Return the number of a map. A new map is added to `maps`."""
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
        if number >= len(self.maps):
            expected = f"the number of a map, 0 to {len(self.maps) - 1}"
            raise PydanticCustomError("wanted", "{words}", {"words": expected})
        content = self.maps[number]
        if isinstance(content, BundledMapModel):
            return self._load_bundled_map(number, content)
        try:
            return from_json(content)
        except MapError as error:
            message = f"maps[{number}]: {str(error).removeprefix('map: ')}"
            raise MapError.from_mistakes(self.where, [Mistake(("maps", number), message)]) from None

    def _load_bundled_map(self, number: int, content: BundledMapModel) -> Environment:
        if content.bundled not in list_bundled_maps():
            path = ("maps", number, "bundled")
            refuse_value(self.where, path, content.bundled, "the name of a bundled map")
        environment = load_map(content.bundled)
        if _compute_digest(to_json(environment)) != content.digest:
            path = ("maps", number, "digest")
            refuse_value(self.where, path, content.digest, "the digest of the present map")
        return environment


@lru_cache(maxsize=8)
def _build_map_content(environment: Environment) -> dict[str, Any]:
    """Return a map as session files contain it."""
    content = to_json(environment)
    digest = _compute_digest(content)
    name = _list_bundled_digests().get(digest)
    if name is None:
        return content
    return {"bundled": name, "digest": digest}


@cache
def _list_bundled_digests() -> dict[str, str]:
    """Return the names of the bundled maps by their digests."""
    return {_compute_digest(to_json(load_map(name))): name for name in list_bundled_maps()}


def _compute_digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGEST_CHARS]
