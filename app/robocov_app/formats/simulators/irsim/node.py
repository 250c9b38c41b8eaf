"""Values of a YAML file with their locations in it, which error messages name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from robocov.errors import MapError, quote
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov.typing import FloatArray
from robocov_app.formats import files

_TRUE_WORDS = ("true", "yes", "on", "1")


@dataclass(frozen=True)
class Node:
    """A value in a YAML file, which may be missing.

    Attributes
    ----------
    value : str, list, dict or None
        None if the file does not contain it.
    location : str
        Place of the value, for messages, as in "world.yaml: obstacle[0].shape".
    """

    value: files.Value | None
    location: str

    @property
    def is_given(self) -> bool:
        """Whether the file contains the value."""
        return self.value not in (None, "", "null", "~", "None", [], {})

    def __getitem__(self, name: str) -> Node:
        """Return the value of a key; raise MapError if this value is not a mapping."""
        prefix = self.location if self.location.endswith(": ") else f"{self.location}."
        if isinstance(self.value, dict):
            return Node(self.value.get(name), f"{prefix}{name}")
        if self.is_given:
            self.raise_error("a mapping (name: value)")
        return Node(None, f"{prefix}{name}")

    def list_items(self, *, allow_single: bool = False) -> list[Node]:
        """Return the items of a list; an empty list if the value is not given.

        Parameters
        ----------
        allow_single : bool
            Whether to accept a value that is not a list as its only item.

        Raises
        ------
        MapError
            If the value is not a list.
        """
        if not self.is_given:
            return []
        if isinstance(self.value, list):
            return [Node(item, f"{self.location}[{k}]") for k, item in enumerate(self.value)]
        if not allow_single:
            self.raise_error("a list")
        return [self]

    def get_text(self, default: str = "") -> str:
        """Return the value as text; raise MapError if it is a list or a mapping."""
        if not self.is_given:
            return default
        if not isinstance(self.value, str):
            self.raise_error("one value")
        return self.value

    def is_true(self) -> bool:
        """Return whether the value is a word for true; raise MapError if it is a list or a mapping."""
        return self.get_text().lower() in _TRUE_WORDS

    def parse_number(self, default: float) -> float:
        """Return the value as a number; raise MapError for invalid input."""
        value = files.parse_number(self.get_text(str(default)))
        if not abs(value) <= MAX_COORDINATE_M:
            self.raise_error("a number from -1e7 to 1e7")
        return value

    def parse_length(self, default: float) -> float:
        """Return the value as a positive length, m; raise MapError if it is out of range."""
        value = self.parse_number(default)
        files.require_length(value, self.location)
        return value

    def parse_numbers(self, default: list[float]) -> FloatArray:
        """Return the numbers of a list.

        Parameters
        ----------
        default : list of float
            Numbers that replace missing ones. If the value is given, it must have at least two numbers.

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
            self.raise_error(f"a list of {len(default)} numbers")
        return np.array([*values, *default[len(values) :]])

    def raise_error(self, expected: str) -> NoReturn:
        """Raise a MapError with the location of this value and a description of the expected one."""
        raise MapError(f"{self.location}: expected {expected}, got {quote(self.value)}")
