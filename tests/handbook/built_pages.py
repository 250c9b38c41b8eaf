"""The built pages of the handbook, and the links in them."""

from __future__ import annotations

from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

HAS_SPHINX = all(find_spec(name) for name in ("sphinx", "furo", "myst_parser"))
"""Whether the handbook can be built here."""


class PageLinks(HTMLParser):
    """The links in a page, and the places that links to the page may name.

    Attributes
    ----------
    targets : list of str
        Targets of links, and files of pictures.
    identifiers : set of str
        Values of ``id``.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.identifiers: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if value and name in ("href", "src"):
                self.targets.append(value)
            elif value and name == "id":
                self.identifiers.add(value)


class UnlinkedNames(HTMLParser):
    """The names of the program in a page that are not links.

    Attributes
    ----------
    names : list of str
        Names, in the order of the page.
    listed_names : list of str
        Those in lists of names to see also.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: list[str] = []
        self.listed_names: list[str] = []
        self._open_tags: list[str] = []
        self._is_name = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("a", "dt", "code"):
            self._open_tags.append(tag)
        if tag == "code":
            classes = (dict(attrs).get("class") or "").split()
            self._is_name = "py-obj" in classes and "a" not in self._open_tags
            if self._is_name:
                self.names.append("")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("a", "dt", "code") and tag in self._open_tags:
            while self._open_tags.pop() != tag:
                pass
        if tag == "code" and self._is_name:
            self._is_name = False
            if "dt" in self._open_tags:
                self.listed_names.append(self.names[-1])

    def handle_data(self, data: str) -> None:
        if self._is_name:
            self.names[-1] += data


def find_broken_links(site: Path) -> list[str]:
    """Return the links within a site that lead to no file, or to a place that the file does not have."""
    pages = {file.resolve(): PageLinks(file.read_text(encoding="utf-8")) for file in site.rglob("*.html")}
    broken_links = []
    for file, links in pages.items():
        for link in links.targets:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            is_broken = not target.is_file()
            if parts.fragment and target in pages:
                is_broken = unquote(parts.fragment) not in pages[target].identifiers
            if is_broken:
                broken_links.append(f"{file.name}: {link}")
    return broken_links
