"""The elements of an XML file, read by expat with nothing in it that could grow or reach elsewhere."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np

from robocov.arrays import Array
from robocov.errors import MapError, quote, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats import files

MOST_ELEMENTS = 100_000  # in a file, and drawn of it where parts are used again
MOST_ATTRIBUTES = 1_000_000
DEEPEST = 100  # deepest nesting of elements and uses; drawing programs stay below 30
_SVG = "http://www.w3.org/2000/svg"
_EXPANDED = 1_000_000  # characters that entities and default attributes may add: mostly names of namespaces
_LONGEST_NAMESPACE, _MOST_DECLARATIONS = 1000, 1000


@dataclass(eq=False, slots=True)
class Element:
    """An element of SVG or of no namespace, named without; `pieces` of text, where that means something."""

    tag: str
    attributes: dict[str, str]
    where: str
    line: int
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(self.pieces)

    def everything(self) -> Iterator[Element]:
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)

    def child(self, tag: str) -> Element | None:
        return next((child for child in self.children if child.tag == tag), None)

    def numbers(self, name: str, count: int | None = None, default: str | None = None) -> Array:
        """Return the numbers of an attribute, which commas or blanks separate, `count` of them."""
        text = self.attributes.get(name, default)
        values = np.array([files.number(part) for part in (text or "").replace(",", " ").split()])
        if text is None or count not in (None, len(values)) or not (np.abs(values) <= MAX_COORDINATE_M).all():
            number = "a number" if count == 1 else "numbers" if count is None else f"{count} numbers"
            expected = f"expected {number} within 1e7"
            if text is None:
                self.refuse(f"{name}: missing, {expected}")
            self.refuse(f"{name}: {expected}, got {quote(text)}")
        return values

    def refuse(self, what: str) -> NoReturn:
        name = self.attributes.get("id")
        called = f"<{self.tag}>" if name is None else f"<{self.tag}> {quote(name)}"
        raise MapError(f"{self.where}:{self.line}: {called}: {what}")


def read_xml_tree(path: Path, root: str, kind: str, texts: Collection[str] = ()) -> Element:
    """Return the `root` of an XML file, which messages call a `kind`; `texts`: tags whose text counts.

    Refused are entities that stand for other files, other entities or too much.
    """
    where = to_one_line(path)
    content = files.content(path, files.MAX_TEXT_BYTES)
    if content.startswith(b"\x1f\x8b"):
        raise MapError(f"{where}: expected plain {kind}, got compressed (gunzip makes it)")
    if content.count(b"=") > MOST_ATTRIBUTES:
        raise MapError(f"{where}: expected at most {MOST_ATTRIBUTES} attributes, got more")
    reader = _Reader(where, content, kind, texts)
    try:
        reader.parser.Parse(content, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        line = f":{error.lineno}" if isinstance(error, expat.ExpatError) else ""
        reason = expat.ErrorString(error.code) if isinstance(error, expat.ExpatError) else error
        raise MapError(f"{where}{line}: not XML: {to_one_line(reason)[:60]}") from None
    first = reader.first
    if first is None or first.tag != root:
        found = "other XML" if first is None else f"<{first.tag}>"
        raise MapError(f"{where}: expected <{root}>, got {found}")
    return first


class _Reader:
    def __init__(self, where: str, content: bytes, kind: str, texts: Collection[str]) -> None:
        self.where, self.kind, self.texts = where, kind, texts
        self.references = content.count(b"&")
        self.room = len(content) + _EXPANDED
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = lambda name: self.open.pop()
        self.parser.CharacterDataHandler = self._text
        self.parser.EntityDeclHandler = self._entity
        self.parser.AttlistDeclHandler = self._declared
        self.parser.StartNamespaceDeclHandler = self._namespace
        self.open: list[Element | None] = []
        self.first: Element | None = None
        self.count = self.declarations = 0

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.count += 1
        line = self.parser.CurrentLineNumber
        if self.count > MOST_ELEMENTS:
            raise MapError(f"{self.where}:{line}: expected at most {MOST_ELEMENTS} elements, got more")
        if len(self.open) >= DEEPEST:
            raise MapError(f"{self.where}:{line}: elements are nested deeper than {DEEPEST}")
        namespace, _, tag = name.rpartition(" ")
        plain = {key.rpartition(" ")[2]: value for key, value in attributes.items()}
        self._take(sum(map(len, plain)) + sum(map(len, plain.values())))
        parent = self.open[-1] if self.open else None
        element = None
        # what a foreign element holds is foreign as well
        if namespace in ("", _SVG) and (parent is not None or not self.open):
            element = Element(tag, plain, self.where, line)
            if parent is None:
                self.first = element
            else:
                parent.children.append(element)
        self.open.append(element)

    def _text(self, text: str) -> None:
        self._take(len(text))
        if (element := self.open[-1]) is not None and element.tag in self.texts:
            element.pieces.append(text)

    def _take(self, count: int) -> None:
        """Count characters: entities and default attributes make more of them than the file has."""
        self.room -= count
        if self.room < 0:
            self._refuse("entities that stand for too much")

    def _entity(self, name: str, parameter: bool, value: str | None, *rest: object) -> None:
        """Check an entity: it may stand for a few words, which expat puts in where it is used."""
        self._declared()
        stands = f"an entity {quote(name)} that stands"
        if value is None:
            self._refuse(f"{stands} for another file ({quote(rest[1])})")
        if parameter or "&" in value or "%" in value:
            self._refuse(f"{stands} for other entities")
        if len(value) * self.references > _EXPANDED:
            self._refuse(f"{stands} for too much")

    def _declared(self, *given: object) -> None:
        """Count entities and attributes that are declared: expat looks through all of them each time."""
        self.declarations += 1
        if self.declarations > _MOST_DECLARATIONS:
            self._refuse(f"more than {_MOST_DECLARATIONS} declarations")

    def _namespace(self, prefix: str | None, name: str | None) -> None:
        """Check the name of a namespace, which becomes part of every name in it."""
        if name is not None and len(name) > _LONGEST_NAMESPACE:
            self._refuse(f"a namespace of {len(name)} characters")

    def _refuse(self, what: str) -> NoReturn:
        line = self.parser.CurrentLineNumber
        raise MapError(f"{self.where}:{line}: expected plain {self.kind}, got {what}")
