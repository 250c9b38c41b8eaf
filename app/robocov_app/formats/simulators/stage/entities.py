"""Models, blocks and windows of world files with their properties, and the macros on which they are based."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from robocov.errors import MapError, quote
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.simulators.stage.tokens import BRACKETS, Token


@dataclass(frozen=True, eq=False)
class Entity:
    """A model, block or window in a world file.

    Attributes
    ----------
    type : str
        Type of the entity, or name of the macro on which it is based.
    location : str
        File and line, for messages.
    properties : dict of str to list of str
        Values of each property.
    children : list of Entity
        Entities within this one.
    """

    type: str
    location: str
    properties: dict[str, list[str]] = field(default_factory=dict)
    children: list[Entity] = field(default_factory=list)

    def get_text(self, name: str, default: str = "") -> str:
        """Return the first value of a property."""
        return self.properties.get(name, [default])[0]

    def parse_number(self, name: str, default: float) -> float:
        """Return the first value of a property as a number; raise MapError for invalid input."""
        return float(self.parse_numbers(name, (default,))[0])

    def parse_numbers(self, name: str, default: tuple[float, ...]) -> FloatArray:
        """Return the values of a property as numbers.

        Parameters
        ----------
        name : str
        default : tuple of float
            Numbers that replace missing ones at the end.

        Returns
        -------
        (k,) array
            As long as `default`.

        Raises
        ------
        MapError
            If a value is not a number, or out of range.
        """
        texts = self.properties.get(name, [])[: len(default)]
        numbers = [files.parse_number(text) for text in texts]
        values = np.array([*numbers, *default[len(texts) :]])
        if not (np.abs(values) <= MAX_COORDINATE_M).all():
            raise MapError(
                f"{self.location}: expected numbers from -1e7 to 1e7, got {name} {quote(' '.join(texts))}"
            )
        return values


class World(NamedTuple):
    """The content of a world file.

    Attributes
    ----------
    root : Entity
        An entity that contains the children and properties at the top level of the file.
    macros : dict of str to Entity
        Entities on which others are based, keyed by name.
    """

    root: Entity
    macros: dict[str, Entity]


def parse_world(tokens: deque[Token], source_name: str) -> World:
    """Parse the tokens of a world.

    Parameters
    ----------
    tokens : deque of Token
        The tokens; they are removed from the deque.
    source_name : str
        The file, for messages.

    Raises
    ------
    MapError
        At the first syntax error.
    """
    parser = _EntityParser(tokens)
    root = Entity("world", source_name)
    parser.parse_content(root, 0)
    return World(root, parser.macros)


class _EntityParser:
    """Builds entities from tokens."""

    def __init__(self, tokens: deque[Token]) -> None:
        self.macros: dict[str, Entity] = {}
        self._tokens = tokens

    def parse_content(self, entity: Entity, depth: int) -> None:
        """Add properties and children to an entity, up to its closing bracket; at depth 0, up to the end."""
        if depth > files.MAX_DEPTH:
            raise MapError(f"{entity.location}: nested deeper than {files.MAX_DEPTH}")
        while self._tokens:
            token = self._tokens.popleft()
            if depth and token.kind == ")":
                return
            if token.kind != "word":
                closing = ", or )" if depth else ""
                token.raise_error(f"the name of a model or a property{closing}")
            if token.text == "define" and self._is_at_macro():
                self._parse_macro(token, depth)
            elif self._peek_kind(0) == "(":
                self._tokens.popleft()
                child = Entity(token.text, token.location)
                entity.children.append(child)
                self.parse_content(child, depth + 1)
            else:
                entity.properties[token.text] = self._parse_values(token)
        if depth:
            raise MapError(f"{entity.location}: expected a ) to close this bracket, got the end of the file")

    def _peek_kind(self, index: int) -> str:
        """Return the kind of the token at an index from here on, or an empty string past the end."""
        if index >= len(self._tokens):
            return ""
        return self._tokens[index].kind

    def _is_at_macro(self) -> bool:
        """Return whether a name, a type and a bracket follow, as in the definition of a macro."""
        kinds = [self._peek_kind(index) for index in range(3)]
        return kinds[:2] == ["word", "word"] and kinds[2] in BRACKETS

    def _parse_macro(self, define: Token, depth: int) -> None:
        name = self._tokens.popleft()
        base = self._tokens.popleft()
        self._tokens.popleft()  # the bracket
        macro = Entity(base.text, define.location)
        self.parse_content(macro, depth + 1)
        self.macros.setdefault(name.text, macro)

    def _parse_values(self, name: Token) -> list[str]:
        """Return the values of a property; an empty list gives one empty string."""
        expected = f"a value or ( after {quote(name.text)}"
        values = [self._take_token(name, expected)]
        if values[0].kind == "[":
            expected = f"a value of {quote(name.text)}"
            values = []
            while self._tokens and self._tokens[0].kind not in BRACKETS:
                values.append(self._tokens.popleft())
            expected_end = f"a ] after the values of {quote(name.text)}"
            end = self._take_token(name, expected_end)
            if end.kind != "]":
                end.raise_error(expected_end)
        for value in values:
            if value.kind not in ("number", "string"):
                value.raise_error(expected)
        return [value.text for value in values] or [""]

    def _take_token(self, name: Token, expected: str) -> Token:
        """Return and remove the next token, which follows a name; raise MapError at the end of the file."""
        if not self._tokens:
            raise MapError(f"{name.location}: expected {expected}, got the end of the file")
        return self._tokens.popleft()
