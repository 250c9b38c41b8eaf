"""How an element of SVG is painted: presentation attributes, style sheets, and what is inherited."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from robocov.errors import MapError
from robocov_app.formats.xml_tree import Element

Style: TypeAlias = Mapping[str, str]
"""Properties by name, as they are written."""

INHERITED = {
    "fill": "black", "fill-opacity": "1", "fill-rule": "nonzero",
    "stroke": "none", "stroke-opacity": "1", "stroke-width": "1", "stroke-dasharray": "none",
    "stroke-linecap": "butt", "stroke-linejoin": "miter", "stroke-miterlimit": "4",
    "visibility": "visible",
}  # fmt: skip
"""What passes from groups to their elements, and what it is by default (SVG 2, section 13)."""

_PROPERTIES = (*INHERITED, "display", "opacity", "transform", "clip-path", "mask")
_SELECTOR = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][\w-]+)*)")
_IMPORTANT = re.compile(r"!\s*important\s*$", re.IGNORECASE)
_HARMLESS = re.compile(r"@(?:charset|font-face|keyframes|media|namespace|page)\b", re.IGNORECASE)
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_AT_RULE_PARTS = re.compile(r"[{};]")

MOST_TEXT, MOST_RULES, MOST_WORK = 1_000_000, 10_000, 500_000
"""Characters of style sheets, rules in them, and pairs of a rule and an element that are looked at."""


class _Rule(NamedTuple):
    """A rule of a style sheet, for one selector; the second of its properties are marked as important."""

    tag: str
    marks: tuple[str, ...]
    weight: tuple[int, int, int, int]
    properties: tuple[dict[str, str], dict[str, str]]

    def fits(self, element: Element, classes: set[str]) -> bool:
        return self.tag in ("", "*", element.tag) and all(
            mark[1:] in classes if mark[0] == "." else element.attributes.get("id") == mark[1:]
            for mark in self.marks
        )


@dataclass
class StyleSheet:
    """The rules of the file `where`, of tags, classes and ids; others, as in @supports, are `strange`."""

    where: str
    strange: int = 0
    _keyed: dict[str, list[_Rule]] = field(default_factory=dict)
    _count: int = 0
    _size: int = 0
    _work: int = 0

    def add(self, text: str) -> None:
        """Add the rules of a text. Raises MapError when there are too many."""
        self._size += len(text)
        if self._size > MOST_TEXT:
            raise MapError(f"{self.where}: style sheets of over {MOST_TEXT} characters, but less was wanted")
        text = text.replace("<!--", " ").replace("-->", " ")
        # up to the last end of a comment: to look for one that is not there takes for ever
        commented, end, text = text.rpartition("*/")
        text = _COMMENT.sub(" ", commented + end) + text
        for rule in self._without_at_rules(text).split("}")[:-1]:
            before, brace, body = rule.rpartition("{")
            if not brace:
                continue
            selectors = before.rpartition("{")[2]
            properties = _by_importance(declarations(body))
            for selector in selectors.split(","):
                self._add(selector.strip(), properties)

    def of(self, element: Element) -> dict[str, str]:
        """Return an element's own properties; MapError when there are too many rules for too many."""
        attributes = element.attributes
        found = {name: attributes[name].strip() for name in _PROPERTIES if name in attributes}
        classes = set(attributes.get("class", "").split())
        keys = ["", element.tag, *(f".{name}" for name in classes), f"#{attributes.get('id', '')}"]
        looked_at = [rule for key in keys for rule in self._keyed.get(key, ())]
        self._work += len(looked_at)
        if self._work > MOST_WORK:
            raise MapError(f"{self.where}: too many rules for too many elements, but fewer were wanted")
        rules = [rule for rule in looked_at if rule.fits(element, classes)]
        chosen = [rule.properties for rule in sorted(rules, key=lambda rule: rule.weight)]
        chosen.append(_by_importance(declarations(attributes.get("style", ""))))
        for k in (0, 1):
            for properties in chosen:
                found |= properties[k]
        return found

    def _without_at_rules(self, text: str) -> str:
        """Return a style sheet without its @ rules, which hold for other media, or name other files."""
        kept, at = [], 0
        while (begin := text.find("@", at)) >= 0:
            kept.append(text[at:begin])
            # other media and fonts change no shape
            self.strange += not _HARMLESS.match(text, begin)
            at, depth = len(text), 0
            for part in _AT_RULE_PARTS.finditer(text, begin):
                depth += (part[0] == "{") - (part[0] == "}")
                if depth <= 0 and part[0] != "{":
                    at = part.end()
                    break
        return "".join([*kept, text[at:]])

    def _add(self, selector: str, properties: tuple[dict[str, str], dict[str, str]]) -> None:
        match = _SELECTOR.fullmatch(selector)
        if match is None or not selector or self._count >= MOST_RULES:
            self.strange += 1
            return
        tag, marks = match[1] or "", tuple(re.findall(r"[.#][\w-]+", match[2]))
        ids = sum(mark[0] == "#" for mark in marks)
        self._count += 1
        rule = _Rule(tag, marks, (ids, len(marks) - ids, int(tag not in ("", "*")), self._count), properties)
        key = marks[-1] if marks else tag.replace("*", "")
        self._keyed.setdefault(key, []).append(rule)


def declarations(text: str) -> dict[str, str]:
    """Return the properties of a ``style`` attribute or of the body of a rule.

    >>> declarations("fill: none; stroke-width:2px;")
    {'fill': 'none', 'stroke-width': '2px'}
    """
    pairs = (part.partition(":") for part in text.split(";") if ":" in part)
    return {name.strip().lower(): value.strip() for name, _, value in pairs}


def _by_importance(properties: dict[str, str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the properties that are not marked as important, and those that are, without the mark."""
    important = {name: value for name, value in properties.items() if _IMPORTANT.search(value)}
    plain = {name: value for name, value in properties.items() if name not in important}
    return plain, {name: _IMPORTANT.sub("", value).rstrip() for name, value in important.items()}


def inherited(parent: Style, own: Style) -> dict[str, str]:
    """Return the inherited properties of an element, from those of its parent and its own."""
    return {
        name: parent[name] if (value := own.get(name, "inherit")) in ("inherit", "unset") else value
        for name in INHERITED
    }


def is_painted(style: Style, what: str) -> bool:
    """Return whether ``fill`` or ``stroke`` is there: neither none nor transparent."""
    paint = style[what].lower()
    return paint not in ("none", "transparent") and not _is_zero(style[f"{what}-opacity"])


def is_hidden(own: Style) -> bool:
    """Return whether an element is not drawn, with all in it."""
    return own.get("display", "").lower() == "none" or _is_zero(own.get("opacity", "1"))


def _is_zero(number: str) -> bool:
    try:
        return float(number.strip().rstrip("%")) == 0.0
    except ValueError:
        return False
