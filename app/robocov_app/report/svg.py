"""matplotlib's figures as small SVG in a page, text as text: colors of the light theme become variables."""

import io
import re
from collections.abc import Sequence
from functools import cache
from typing import Any
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

import matplotlib
from matplotlib.figure import Figure

from robocov_app.figures.files import plain_style
from robocov_app.look.colors import format_hex_color
from robocov_app.look.theme import LIGHT
from robocov_app.report.theme_css import list_css_colors

_STYLE: Any = {"svg.hashsalt": "robocov", "svg.fonttype": "none", "savefig.bbox": None}
_METADATA: dict[str, str | None] = {"Date": None, "Creator": None, "Format": None, "Type": None}
_SPACE = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
_NUMBER = re.compile(r"-?\d*\.?\d+(?:e[-+]?\d+)?")
_MANY = 8  # so many equal round marks are drawn as one dotted line
_PLOTTED = ("background", "ink", "faint", "grid", "rapf", "rpf", "lloyd")


def inline_svg(figure: Figure, key: str, sentence: str) -> str:
    """Return a figure in light colors as SVG; ids begin with `key`, `sentence` tells what it shows."""
    for patch in (figure.patch, *(axes.patch for axes in figure.axes)):
        patch.set_visible(False)
    text = io.StringIO()
    with plain_style(), matplotlib.rc_context(_STYLE):
        figure.savefig(text, format="svg", metadata=_METADATA, dpi=figure.dpi)
    source = fromstring(text.getvalue())
    box = " ".join(_short(number, 1) for number in source.get("viewBox", "").split())
    root = Element("svg", {"class": "plot", "viewBox": box, "role": "img", "aria-label": sentence})
    body = Element("g", {"stroke-linejoin": "round"})
    copy = _Copy(key)
    copy.drawn(source, body)
    root.extend([copy.definitions, body] if len(copy.definitions) else [body])
    return tostring(root, encoding="unicode", short_empty_elements=True)


class _Copy:
    """A copy of what is drawn, without the groups and ids that nothing needs, and with short names."""

    def __init__(self, key: str) -> None:
        self.definitions = Element("defs")
        self._key = key
        self._names: dict[str, str] = {}

    def drawn(self, source: Element, target: Element) -> None:
        uses = [child for child in source if child.tag == f"{_SPACE}use"]
        dots = self._dotted(uses) if len(uses) >= _MANY else None
        if dots is not None:
            target.append(dots)
        for child in source:
            tag, clip = child.tag.removeprefix(_SPACE), child.get("clip-path")
            if tag == "defs":
                for shape in (each for each in child if "id" in each.attrib):
                    element = self._element(shape)
                    element.extend([self._element(part) for part in shape])
                    element.set("id", self._name(shape.attrib["id"]))
                    element.attrib.pop("style", None)  # uses have their own
                    self.definitions.append(element)
            elif tag == "g":
                into = {} if clip is None else {"clip-path": self._renamed(clip)}
                self.drawn(child, SubElement(target, "g", into) if into else target)
            elif tag in ("path", "text", "rect", "image") or (tag == "use" and dots is None):
                target.append(self._element(child))

    def _name(self, old: str) -> str:
        return self._names.setdefault(old, f"{self._key}-{len(self._names)}")

    def _renamed(self, reference: str) -> str:
        return f"url(#{self._name(reference.removeprefix('url(#').removesuffix(')'))})"

    def _element(self, source: Element) -> Element:
        """Return an element with short numbers and the page's colors, without children."""
        element = Element(source.tag.removeprefix(_SPACE))
        element.text = source.text if element.tag == "text" else None
        for name, value in source.attrib.items():
            if name == "d":  # numbers of two decimals: no user sees the difference
                words = [_short(word, 2) if _NUMBER.fullmatch(word) else word for word in value.split()]
                element.set("d", re.sub(r" ?([A-Za-z]) ?", r"\1", " ".join(words)))
            elif name == _LINK:
                element.set("href", f"#{self._names[value.removeprefix('#')]}")
            elif name == "style":
                element.set("style", _colored(value))
            elif name in ("x", "y", "width", "height"):
                element.set(name, _short(value, 1))
            elif name == "transform" and not value.startswith("rotate(-0 "):
                element.set(name, value)
        if "clip-path" in source.attrib:
            element.set("clip-path", self._renamed(source.attrib["clip-path"]))
        return element

    def _dotted(self, uses: Sequence[Element]) -> Element | None:
        """Return many equal round marks as one path: dots of a round pen. None where they are not that."""
        first = uses[0]
        if any(use.get(_LINK) != first.get(_LINK) or use.get("style") != first.get("style") for use in uses):
            return None
        name = self._names[first.get(_LINK, "").removeprefix("#")]
        shape = next(each for each in self.definitions if each.get("id") == name)
        begin = re.match(r"M0 (\d*\.?\d+)C", shape.get("d", ""))
        if begin is None:
            return None
        look = dict(part.split(": ") for part in first.get("style", "").split("; "))
        places = "".join(f"M{_short(use.get('x', '0'), 1)} {_short(use.get('y', '0'), 1)}h0" for use in uses)
        opacity = look.get("opacity", look.get("fill-opacity", "1"))
        style = (
            f"fill: none; stroke: {look['fill']}; stroke-linecap: round; "
            f"stroke-width: {2 * float(begin[1]):g}; opacity: {opacity}"
        )
        return Element("path", {"d": places, "style": _colored(style)})


def _short(number: str, decimals: int) -> str:
    return f"{float(number):.{decimals}f}".rstrip("0").rstrip(".") if "." in number else number


def _colored(style: str) -> str:
    parts = [part for part in style.split("; ") if not part.startswith("font-family:")]
    text = ";".join(part.replace(": ", ":") for part in parts)
    return re.sub(r"#[0-9a-f]{6}", lambda match: _variables()[match[0]], text)


@cache
def _variables() -> dict[str, str]:
    """Return what stands for each color of the light theme that plots use, its first name."""
    colors = list_css_colors(LIGHT)
    names = [*_PLOTTED, *(name for name in colors if name.startswith(("other-", "heat-")))]
    return {format_hex_color(colors[name]): f"var(--rc-{name})" for name in reversed(names)}
