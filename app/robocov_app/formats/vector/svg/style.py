"""Styles of SVG elements: style sheets, inheritance, visibility and colors."""

import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Literal, NamedTuple, TypeAlias

from robocov.errors import MapError
from robocov_app.formats.colors import Color, mix_with_white, parse_css_color
from robocov_app.formats.files.xml_tree import Element

Style: TypeAlias = Mapping[str, str]
"""Properties by name, with their values as written in the file."""
INHERITED = {
    "color": "black",
    "fill": "black",
    "fill-opacity": "1",
    "fill-rule": "nonzero",
    "stroke": "none",
    "stroke-opacity": "1",
    "stroke-width": "1",
    "stroke-dasharray": "none",
    "stroke-linecap": "butt",
    "stroke-linejoin": "miter",
    "stroke-miterlimit": "4",
    "visibility": "visible",
}
"""Properties that elements inherit from groups, with their defaults (SVG 2, section 13)."""
MAX_SHEET_CHARACTERS = 1_000_000
MAX_RULES = 10_000
MAX_RULE_CHECKS = 500_000
"""Maximum number of comparisons of a rule with an element."""
_PROPERTIES = (*INHERITED, "display", "opacity", "transform", "clip-path", "mask")
_SELECTOR = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][\w-]+)*)")
_CLASS_OR_ID = re.compile(r"[.#][\w-]+")
_IMPORTANT = re.compile(r"!\s*important\s*$", re.IGNORECASE)
_HARMLESS = re.compile(r"@(?:charset|font-face|keyframes|media|namespace|page)\b", re.IGNORECASE)
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_AT_RULE_PARTS = re.compile(r"[{};]")
_REFERENCE = re.compile(r"""\s*url\(\s*["']?#([^"')]*)["']?\s*\)""")


class _Declarations(NamedTuple):
    """Properties without and with the mark ``!important``."""

    normal: dict[str, str]
    important: dict[str, str]


class _StyleRule(NamedTuple):
    """A rule of a style sheet.

    Attributes
    ----------
    required_names : frozenset of str
        Tag, classes and id that an element must have.
    specificity : tuple of int
        Specificity: numbers of ids, classes and tags, then the number of the rule. The highest rule wins.
    declarations : _Declarations
    """

    required_names: frozenset[str]
    specificity: tuple[int, int, int, int]
    declarations: _Declarations


class StyleSheet:
    """The rules of a file for tags, classes and ids.

    Parameters
    ----------
    source_name : str
        The file, for messages.

    Attributes
    ----------
    unsupported_count : int
        Number of rules that are not supported, such as @supports.
    """

    def __init__(self, source_name: str) -> None:
        self.unsupported_count = 0
        self._source_name = source_name
        self._rules_by_name: dict[str, list[_StyleRule]] = {}
        self._rule_count = 0
        self._characters = 0
        self._checks = 0

    def add(self, text: str) -> None:
        """Add the rules of a style sheet; raise MapError if the sheets are too long."""
        self._characters += len(text)
        if self._characters > MAX_SHEET_CHARACTERS:
            expected = f"expected style sheets of at most {MAX_SHEET_CHARACTERS} characters"
            raise MapError(f"{self._source_name}: {expected}, got more")
        text = text.replace("<!--", " ").replace("-->", " ")
        # Comments are removed only up to the last "*/", because searching for a missing end takes forever.
        commented, end, rest = text.rpartition("*/")
        text = _COMMENT.sub(" ", commented + end) + rest
        for rule in self._remove_at_rules(text).split("}")[:-1]:
            before, brace, body = rule.rpartition("{")
            if not brace:
                continue
            declarations = _split_by_importance(parse_declarations(body))
            for selector in before.rpartition("{")[2].split(","):
                self._add_rule(selector.strip(), declarations)

    def get_properties(self, element: Element) -> dict[str, str]:
        """Return an element's own properties, from its attributes, the style sheets and its style attribute.

        Raise MapError if too many rules would have to be compared with elements.
        """
        attributes = element.attributes
        properties = {name: attributes[name].strip() for name in _PROPERTIES if name in attributes}
        names = {element.tag, f"#{attributes.get('id', '')}"}
        names |= {f".{class_name}" for class_name in attributes.get("class", "").split()}
        candidates = [rule for name in ("", *names) for rule in self._rules_by_name.get(name, ())]
        self._checks += len(candidates)
        if self._checks > MAX_RULE_CHECKS:
            raise MapError(f"{self._source_name}: too many rules for too many elements")
        rules = [rule for rule in candidates if rule.required_names <= names]
        rules.sort(key=lambda rule: rule.specificity)
        declarations = [rule.declarations for rule in rules]
        declarations.append(_split_by_importance(parse_declarations(attributes.get("style", ""))))
        for declared in declarations:
            properties |= declared.normal
        for declared in declarations:
            properties |= declared.important
        return properties

    def _remove_at_rules(self, text: str) -> str:
        """Remove the @ rules of a style sheet, which apply to other media or name other files."""
        kept = []
        position = 0
        while (start := text.find("@", position)) >= 0:
            kept.append(text[position:start])
            # Other media and fonts do not change shapes.
            if not _HARMLESS.match(text, start):
                self.unsupported_count += 1
            position = _skip_at_rule(text, start)
        return "".join([*kept, text[position:]])

    def _add_rule(self, selector: str, declarations: _Declarations) -> None:
        """Add a rule, or count it as unsupported if its selector is not a tag, classes and an id."""
        match = _SELECTOR.fullmatch(selector)
        if match is None or not selector or self._rule_count >= MAX_RULES:
            self.unsupported_count += 1
            return
        tags = [match[1]] if match[1] not in (None, "*") else []
        classes_and_ids = _CLASS_OR_ID.findall(match[2])
        id_count = sum(name.startswith("#") for name in classes_and_ids)
        self._rule_count += 1
        specificity = (id_count, len(classes_and_ids) - id_count, len(tags), self._rule_count)
        names = [*tags, *classes_and_ids]
        rule = _StyleRule(frozenset(names), specificity, declarations)
        # A rule is compared only with elements that have its last name; "" is for rules without names.
        key = names[-1] if names else ""
        self._rules_by_name.setdefault(key, []).append(rule)


def _skip_at_rule(text: str, start: int) -> int:
    """Return the position after an @ rule, which ends at a semicolon or at its closing brace."""
    depth = 0
    for part in _AT_RULE_PARTS.finditer(text, start):
        if part[0] == "{":
            depth += 1
            continue
        if part[0] == "}":
            depth -= 1
        if depth <= 0:
            return part.end()
    return len(text)


def parse_declarations(text: str) -> dict[str, str]:
    """Parse the declarations of a style attribute or rule; values are keyed by the names of properties."""
    pairs = [part.partition(":") for part in text.split(";") if ":" in part]
    return {name.strip().lower(): value.strip() for name, _, value in pairs}


def _split_by_importance(properties: dict[str, str]) -> _Declarations:
    """Split properties into those without and those with ``!important``, which is removed."""
    normal = {}
    important = {}
    for name, value in properties.items():
        if _IMPORTANT.search(value):
            important[name] = _IMPORTANT.sub("", value).rstrip()
        else:
            normal[name] = value
    return _Declarations(normal, important)


def inherit_style(parent: Style, own: Style) -> dict[str, str]:
    """Return the style of an element with given own properties, inheriting the others from its parent."""
    style = {}
    for name in INHERITED:
        value = own.get(name, "inherit")
        style[name] = parent[name] if value in ("inherit", "unset") else value
    return style


def is_painted(style: Style, kind: Literal["fill", "stroke"]) -> bool:
    """Return whether a fill or a stroke is visible."""
    if style[kind].lower() in ("none", "transparent") or _is_zero(style[f"{kind}-opacity"]):
        return False
    paint = parse_css_color(style[kind])
    return paint is None or paint[1] > 0.0


def compute_visible_color(
    style: Style,
    kind: Literal["fill", "stroke"],
    opacity: float,
    get_gradient_color: Callable[[str], str | None],
) -> Color | None:
    """Return the color of a fill or a stroke, mixed with white if it is translucent.

    Parameters
    ----------
    style : Style
    kind : "fill" or "stroke"
    opacity : float
        Opacity of the element and of the groups around it.
    get_gradient_color : callable
        Returns the color of the gradient with an id, as written in the file, or None.

    Returns
    -------
    Color or None
        None if the color is unknown, such as that of a pattern.
    """
    written = style[kind]
    match = _REFERENCE.match(written)
    if match:
        written = get_gradient_color(match[1]) or written[match.end() :].strip()
    if written.casefold() == "currentcolor":
        written = style["color"]
    paint = parse_css_color(written)
    if paint is None:
        return None
    color, alpha = paint
    return mix_with_white(color, alpha * opacity * parse_opacity(style[f"{kind}-opacity"]))


def parse_opacity(text: str) -> float:
    """Parse an opacity, a number or a percentage, and limit it to 0 to 1; invalid input gives 1."""
    text = text.strip()
    try:
        value = float(text.rstrip("%"))
    except ValueError:
        return 1.0
    if math.isnan(value):
        return 1.0
    if text.endswith("%"):
        value /= 100.0
    return min(max(value, 0.0), 1.0)


def is_hidden(own: Style) -> bool:
    """Return whether these own properties of an element hide it and everything in it."""
    return own.get("display", "").lower() == "none" or _is_zero(own.get("opacity", "1"))


def _is_zero(text: str) -> bool:
    with suppress(ValueError):
        return float(text.strip().rstrip("%")) == 0.0
    return False
