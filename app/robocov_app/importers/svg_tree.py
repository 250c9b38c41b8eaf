"""The elements of an SVG file, read by expat with nothing in it that could grow or reach elsewhere."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn
from xml.parsers import expat

from robocov.errors import MapError, shown
from robocov.files.strictjson import one_line
from robocov_app.importers import limits

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

MOST_ELEMENTS = 100_000
"""In a file, and drawn of it where parts are used again."""

MOST_ATTRIBUTES = 1_000_000

DEEPEST = 100
"""Deepest nesting of elements and uses; drawing programs stay below 30."""

_SVG = "http://www.w3.org/2000/svg"
_TYPES = re.compile(rb"<\0*!\0*(?:D\0*O\0*C\0*T\0*Y\0*P\0*E|E\0*N\0*T\0*I\0*T\0*Y)")


@dataclass(eq=False, slots=True)
class Element:
    """An element of SVG; those of other namespaces are left out when it is read.

    Attributes
    ----------
    tag : str
        Without its namespace.
    attributes : dict of str
        Their names without namespaces.
    children : list of Element
    text : str
        Of ``style``, ``title`` and ``desc`` only.
    line : int
        Of the file, counted from 1.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def everything(self) -> Iterator[Element]:
        """Yield this element and all in it."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)

    def refuse(self, where: str, what: str) -> NoReturn:
        """Raise the error of this element."""
        name = self.attributes.get("id")
        called = f"<{self.tag}>" if name is None else f"<{self.tag}> {shown(name)}"
        raise MapError(f"{where}:{self.line}: {called}: {what}")


def read_svg_tree(path: Path) -> tuple[Element, str]:
    """Return the root of the SVG file at `path`, and what messages call the file.

    Raises
    ------
    MapError
        When it cannot be read, is too large, is not XML or not SVG; when it has a document type or
        entities, which could make it of any size; or too many elements, or too deep ones.
    """
    where = one_line(path)
    content = limits.content(path, limits.MAX_TEXT_BYTES)
    if content.startswith(b"\x1f\x8b"):
        raise MapError(f"{where}: compressed, but plain SVG was wanted (gunzip makes it)")
    declared = _TYPES.search(content)
    if declared:
        line = content.count(b"\n", 0, declared.start()) + 1
        raise MapError(
            f"{where}:{line}: <!DOCTYPE or <!ENTITY, but SVG without was wanted: delete it, SVG needs neither"
        )
    if content.count(b"=") > MOST_ATTRIBUTES:
        raise MapError(f"{where}: more than {MOST_ATTRIBUTES} attributes, but fewer were wanted")
    return _Reader(where).root(content), where


class _Reader:
    """Builds the tree from what expat tells."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.open: list[Element | None] = []
        self.first: Element | None = None
        self.count = 0

    def root(self, content: bytes) -> Element:
        """Return the root element."""
        try:
            self.parser.Parse(content, True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            line = f":{error.lineno}" if isinstance(error, expat.ExpatError) else ""
            reason = expat.ErrorString(error.code) if isinstance(error, expat.ExpatError) else error
            raise MapError(f"{self.where}{line}: not XML: {one_line(reason)[:60]}") from None
        if self.first is None or self.first.tag != "svg":
            found = "other XML" if self.first is None else f"<{self.first.tag}>"
            raise MapError(f"{self.where}: {found}, but <svg> was wanted")
        return self.first

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.count += 1
        line = self.parser.CurrentLineNumber
        if self.count > MOST_ELEMENTS:
            raise MapError(f"{self.where}:{line}: more than {MOST_ELEMENTS} elements, but fewer were wanted")
        if len(self.open) >= DEEPEST:
            raise MapError(f"{self.where}:{line}: elements nested deeper than {DEEPEST}, but less was wanted")
        namespace, _, tag = name.rpartition(" ")
        element = None
        # what a foreign element holds is foreign as well
        if namespace in ("", _SVG) and (not self.open or self.open[-1] is not None):
            plain = {key.rpartition(" ")[2]: value for key, value in attributes.items()}
            element = Element(tag, plain, line)
            if self.open and self.open[-1] is not None:
                self.open[-1].children.append(element)
            elif not self.open:
                self.first = element
        self.open.append(element)

    def _end(self, name: str) -> None:
        self.open.pop()

    def _text(self, text: str) -> None:
        element = self.open[-1]
        if element is not None and element.tag in ("style", "title", "desc"):
            element.text += text

    def _doctype(self, *given: object) -> NoReturn:
        raise MapError(f"{self.where}: a document type, but SVG without was wanted")
