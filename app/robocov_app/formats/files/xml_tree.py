"""Elements of an XML file, read by expat. Entities that name files or expand without limit are rejected."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np

from robocov.errors import MapError, quote, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov.typing import FloatArray
from robocov_app.formats.files.limits import MAX_TEXT_BYTES
from robocov_app.formats.files.numbers import parse_number
from robocov_app.formats.files.reading import read_content

MAX_ELEMENTS = 100_000
"""Maximum number of elements in a file, and of elements drawn if some are drawn repeatedly."""
MAX_ATTRIBUTES = 1_000_000
MAX_NESTING = 100
"""Deepest nesting of elements and of ``use`` references; drawing programs stay below 30."""
_SVG_NAMESPACE = "http://www.w3.org/2000/svg"
_MAX_EXPANDED_CHARACTERS = 1_000_000
"""Number of characters that entities and default attributes may add.

Drawing programs use entities mainly for the names of namespaces.
"""
_MAX_NAMESPACE_CHARACTERS = 1000
_MAX_DECLARATIONS = 1000


@dataclass(eq=False, slots=True)
class Element:
    """An element of SVG or of no namespace.

    Attributes
    ----------
    tag : str
        Name without its namespace.
    attributes : dict of str to str
    source_name : str
        Name of the file for messages.
    line : int
    children : list of Element
    text_pieces : list of str
        Text in the element, if its tag is among those whose text is kept.
    """

    tag: str
    attributes: dict[str, str]
    source_name: str
    line: int
    children: list[Element] = field(default_factory=list)
    text_pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Text in the element."""
        return "".join(self.text_pieces)

    def iterate(self) -> Iterator[Element]:
        """Yield the element and all elements in it, in the order of the file."""
        stack = [self]
        while stack:
            element = stack.pop()
            yield element
            stack += reversed(element.children)

    def find_child(self, tag: str) -> Element | None:
        """Return the first child with a tag, or None."""
        return next((child for child in self.children if child.tag == tag), None)

    def parse_numbers(self, name: str, count: int | None = None, default: str | None = None) -> FloatArray:
        """Return the numbers in an attribute.

        Parameters
        ----------
        name : str
            Name of the attribute. Commas or blanks separate its numbers.
        count : int, optional
            How many numbers are expected. By default, any count is accepted.
        default : str, optional
            Text to parse if the element has no such attribute. By default, the attribute is required.

        Raises
        ------
        MapError
            If the attribute is missing, has the wrong count of numbers, or a number is out of range.
        """
        text = self.attributes.get(name, default)
        expected = f"expected {_describe_count(count)} from -1e7 to 1e7"
        if text is None:
            self.raise_error(f"{name}: missing, {expected}")
        values = np.array([parse_number(word) for word in text.replace(",", " ").split()])
        has_right_count = count is None or count == len(values)
        if not has_right_count or not (np.abs(values) <= MAX_COORDINATE_M).all():
            self.raise_error(f"{name}: {expected}, got {quote(text)}")
        return values

    def raise_error(self, problem: str) -> NoReturn:
        """Raise a MapError with the file, the line and the name of the element."""
        name = self.attributes.get("id")
        label = f"<{self.tag}>" if name is None else f"<{self.tag}> {quote(name)}"
        raise MapError(f"{self.source_name}:{self.line}: {label}: {problem}")


def _describe_count(count: int | None) -> str:
    if count == 1:
        return "a number"
    return "numbers" if count is None else f"{count} numbers"


def read_xml_tree(path: Path, root: str, kind: str, text_tags: Collection[str] = ()) -> Element:
    """Return the root element of an XML file.

    Parameters
    ----------
    path : Path
    root : str
        Tag that the root element must have.
    kind : str
        Kind of the file for messages, such as "SVG".
    text_tags : collection of str
        Tags of the elements whose text is kept.

    Raises
    ------
    MapError
        If the file is not XML, has another root or is too large, or if its entities refer to other files or
        entities, or expand to too much text.
    """
    source_name = to_one_line(path)
    content = read_content(path, MAX_TEXT_BYTES)
    if content.startswith(b"\x1f\x8b"):  # gzip
        actual = "a gzip-compressed file. Unpack it with gunzip."
        raise MapError(f"{source_name}: expected plain {kind}, got {actual}")
    if content.count(b"=") > MAX_ATTRIBUTES:
        raise MapError(f"{source_name}: expected at most {MAX_ATTRIBUTES} attributes, got more")
    builder = _TreeBuilder(source_name, content, kind, text_tags)
    try:
        builder.parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = to_one_line(expat.ErrorString(error.code))[:60]
        raise MapError(f"{source_name}:{error.lineno}: not XML: {reason}") from None
    except (ValueError, LookupError) as error:
        raise MapError(f"{source_name}: not XML: {to_one_line(error)[:60]}") from None
    root_element = builder.root
    if root_element is None or root_element.tag != root:
        actual = "other XML" if root_element is None else f"<{root_element.tag}>"
        raise MapError(f"{source_name}: expected <{root}>, got {actual}")
    return root_element


class _TreeBuilder:
    """Builds the tree of elements from the events of expat, and rejects what expands without limit."""

    def __init__(self, source_name: str, content: bytes, kind: str, text_tags: Collection[str]) -> None:
        """Prepare a parser for `content`, which must be passed to `parser.Parse`."""
        self.source_name = source_name
        self.kind = kind
        self.text_tags = text_tags
        # Limits that depend on the file: entities may be inserted at each reference.
        self.reference_count = content.count(b"&")
        self.remaining_characters = len(content) + _MAX_EXPANDED_CHARACTERS
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start_element
        self.parser.EndElementHandler = lambda name: self.open_elements.pop()
        self.parser.CharacterDataHandler = self._add_text
        self.parser.EntityDeclHandler = self._check_entity
        self.parser.AttlistDeclHandler = self._count_declaration
        self.parser.StartNamespaceDeclHandler = self._check_namespace
        self.open_elements: list[Element | None] = []
        self.root: Element | None = None
        self.element_count = 0
        self.declaration_count = 0

    def _start_element(self, name: str, attributes: dict[str, str]) -> None:
        """Add an element to its parent.

        Elements of foreign namespaces, and all elements in them, are left out: they are None in
        `open_elements`.
        """
        self.element_count += 1
        line = self.parser.CurrentLineNumber
        if self.element_count > MAX_ELEMENTS:
            raise MapError(f"{self.source_name}:{line}: expected at most {MAX_ELEMENTS} elements, got more")
        if len(self.open_elements) >= MAX_NESTING:
            raise MapError(f"{self.source_name}:{line}: elements are nested deeper than {MAX_NESTING}")
        # Expat puts a blank between the namespace and the name.
        namespace, _, tag = name.rpartition(" ")
        plain_attributes = {key.rpartition(" ")[2]: value for key, value in attributes.items()}
        self._count_characters(sum(map(len, plain_attributes)))
        self._count_characters(sum(map(len, plain_attributes.values())))
        parent = self.open_elements[-1] if self.open_elements else None
        is_in_foreign_element = bool(self.open_elements) and parent is None
        if namespace not in ("", _SVG_NAMESPACE) or is_in_foreign_element:
            self.open_elements.append(None)
            return
        element = Element(tag, plain_attributes, self.source_name, line)
        if parent is None:
            self.root = element
        else:
            parent.children.append(element)
        self.open_elements.append(element)

    def _add_text(self, text: str) -> None:
        self._count_characters(len(text))
        element = self.open_elements[-1]
        if element is not None and element.tag in self.text_tags:
            element.text_pieces.append(text)

    def _count_characters(self, count: int) -> None:
        """Count characters, because entities and default attributes can expand to more than the file has."""
        self.remaining_characters -= count
        if self.remaining_characters < 0:
            self._raise_error("entities that expand to too much text")

    def _check_entity(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        base: str | None,
        system_id: str | None,
        public_id: str | None,
        notation: str | None,
    ) -> None:
        """Check a declared entity: it may be short text, which expat inserts at every reference."""
        self._count_declaration()
        entity = f"an entity {quote(name)}"
        if value is None:
            self._raise_error(f"{entity} that refers to another file ({quote(system_id)})")
        if is_parameter or "&" in value or "%" in value:
            self._raise_error(f"{entity} that refers to other entities")
        if len(value) * self.reference_count > _MAX_EXPANDED_CHARACTERS:
            self._raise_error(f"{entity} that expands to too much text")

    def _count_declaration(self, *_: object) -> None:
        """Count declared entities and attributes, because expat searches all of them at each use."""
        self.declaration_count += 1
        if self.declaration_count > _MAX_DECLARATIONS:
            self._raise_error(f"more than {_MAX_DECLARATIONS} declarations")

    def _check_namespace(self, prefix: str | None, name: str | None) -> None:
        """Check the length of a namespace, which expat prepends to every name in it."""
        if name is not None and len(name) > _MAX_NAMESPACE_CHARACTERS:
            self._raise_error(f"a namespace of {len(name)} characters")

    def _raise_error(self, problem: str) -> NoReturn:
        line = self.parser.CurrentLineNumber
        raise MapError(f"{self.source_name}:{line}: expected plain {self.kind}, got {problem}")
