"""Values of a YAML file with their positions, so that messages name them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from robocov.arrays import Array
from robocov.errors import MapError, quote
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats import files

_TRUE_WORDS = ("true", "yes", "on", "1")


@dataclass(frozen=True)
class Node:
    """A value of a file.

    Attributes
    ----------
    value : str, list, dict or None
        None if the file does not contain it.
    at : str
        Position, for messages, as in "world.yaml: obstacle[0].shape".
    """

    value: files.Value | None
    at: str

    @property
    def is_given(self) -> bool:
        """Whether the file contains the value."""
        return self.value not in (None, "", "null", "~", "None", [], {})

    def __getitem__(self, name: str) -> Node:
        """Return the value of a key. Raises MapError if this value is not a mapping."""
        prefix = self.at if self.at.endswith(": ") else f"{self.at}."
        if isinstance(self.value, dict):
            return Node(self.value.get(name), f"{prefix}{name}")
        if self.is_given:
            self.refuse("a mapping (name: value)")
        return Node(None, f"{prefix}{name}")

    def list_items(self, *, allow_single: bool = False) -> list[Node]:
        """Return the items of a list, none if it is not given.

        Parameters
        ----------
        allow_single : bool
            Whether a value that is not a list is its only item.

        Raises
        ------
        MapError
            If the value is not a list.
        """
        if not self.is_given:
            return []
        if isinstance(self.value, list):
            return [Node(item, f"{self.at}[{k}]") for k, item in enumerate(self.value)]
        if not allow_single:
            self.refuse("a list")
        return [self]

    def get_text(self, default: str = "") -> str:
        """Return a text. Raises MapError if it is a list or mapping."""
        if not self.is_given:
            return default
        if not isinstance(self.value, str):
            self.refuse("one value")
        return self.value

    def is_true(self) -> bool:
        """Return whether the value is one of the words for true. Raises MapError as `get_text`."""
        return self.get_text().lower() in _TRUE_WORDS

    def parse_number(self, default: float) -> float:
        """Return a number. Raises MapError if it is not one."""
        value = files.parse_number(self.get_text(str(default)))
        if not abs(value) <= MAX_COORDINATE_M:
            self.refuse("a number within 1e7")
        return value

    def parse_length(self, default: float) -> float:
        """Return a positive length, m. Raises MapError if it is out of range."""
        value = self.parse_number(default)
        files.require_length(value, self.at)
        return value

    def parse_numbers(self, default: list[float]) -> Array:
        """Return the numbers of a list.

        Parameters
        ----------
        default : list of float
            The first two numbers may be missing together, others each.

        Returns
        -------
        (k,) array
            As long as `default` or longer.

        Raises
        ------
        MapError
            If there is only one number, or an item is not a number.
        """
        values = [item.parse_number(0.0) for item in self.list_items()]
        if self.is_given and len(values) < 2:
            self.refuse(f"a list of {len(default)} numbers")
        return np.array([*values, *default[len(values) :]])

    def refuse(self, expected: str) -> NoReturn:
        """Raise the MapError of this value."""
        raise MapError(f"{self.at}: expected {expected}, got {quote(self.value)}")
