"""matplotlib figures as compact SVG in a page: text stays text, and colors follow the theme of the page."""

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
_NAMESPACE = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
_NUMBER = re.compile(r"-?\d*\.?\d+(?:e[-+]?\d+)?")
_COLOR = re.compile(r"#[0-9a-f]{6}")
_CIRCLE_START = re.compile(r"M0 (\d*\.?\d+)C")
"""Start of the path of a round mark, with its radius, up to the first curve."""
_SHAPES = ("path", "text", "rect", "image")
_COORDINATES = ("x", "y", "width", "height")
_PATH_DECIMALS = 2
_COORDINATE_DECIMALS = 1
_MIN_DOTS = 8
"""Minimum number of equal round marks that are combined into one dotted line."""
_PLOT_COLORS = ("background", "ink", "faint", "grid", "rapf", "rpf", "lloyd")
"""Names of the colors in plots. If two colors have the same value, the first name is used."""


def inline_svg(figure: Figure, key: str, description: str) -> str:
    """Convert a figure to an SVG element.

    Parameters
    ----------
    figure : Figure
        Figure in the colors of the light theme, which are replaced by CSS variables of the page.
    key : str
        Start of all ids in the element.
    description : str
        Description for readers who cannot see the plot.

    Returns
    -------
    str
    """
    for patch in (figure.patch, *(axes.patch for axes in figure.axes)):
        patch.set_visible(False)
    text = io.StringIO()
    with plain_style(), matplotlib.rc_context(_STYLE):
        figure.savefig(text, format="svg", metadata=_METADATA, dpi=figure.dpi)
    source = fromstring(text.getvalue())
    view_box = [_shorten_number(number, 1) for number in source.get("viewBox", "").split()]
    attributes = {
        "class": "plot",
        "viewBox": " ".join(view_box),
        "role": "img",
        "aria-label": description,
    }
    root = Element("svg", attributes)
    body = Element("g", {"stroke-linejoin": "round"})
    copy = _SmallCopy(key)
    copy.copy_children(source, body)
    if len(copy.definitions):
        root.append(copy.definitions)
    root.append(body)
    return tostring(root, encoding="unicode", short_empty_elements=True)


class _SmallCopy:
    """Copies the shapes of an SVG, without unnecessary groups and ids, and with short names.

    Parameters
    ----------
    key : str
        Start of all ids.

    Attributes
    ----------
    definitions : Element
        Shapes to which other elements refer.
    """

    def __init__(self, key: str) -> None:
        self.definitions = Element("defs")
        self._key = key
        self._names: dict[str, str] = {}

    def copy_children(self, source: Element, target: Element) -> None:
        """Copy the shapes in one element into another, in the same order."""
        uses = [child for child in source if child.tag == f"{_NAMESPACE}use"]
        dotted_line = self._build_dotted_line(uses)
        if dotted_line is not None:
            target.append(dotted_line)
        for child in source:
            tag = child.tag.removeprefix(_NAMESPACE)
            if tag == "defs":
                self._copy_definitions(child)
            elif tag == "g":
                self._copy_group(child, target)
            elif tag in _SHAPES or (tag == "use" and dotted_line is None):
                target.append(self._copy_element(child))

    def _copy_definitions(self, source: Element) -> None:
        """Copy shapes to which other elements refer."""
        for shape in source:
            if "id" not in shape.attrib:
                continue
            element = self._copy_element(shape)
            element.extend([self._copy_element(child) for child in shape])
            element.set("id", self._shorten_name(shape.attrib["id"]))
            # The style is dropped, because each use of the shape has its own.
            element.attrib.pop("style", None)
            self.definitions.append(element)

    def _copy_group(self, source: Element, target: Element) -> None:
        """Copy the shapes in a group. The group itself is copied only if it clips them."""
        clip = source.get("clip-path")
        if clip is not None:
            target = SubElement(target, "g", {"clip-path": self._shorten_reference(clip)})
        self.copy_children(source, target)

    def _shorten_name(self, name: str) -> str:
        """Return the short name that replaces an id."""
        return self._names.setdefault(name, f"{self._key}-{len(self._names)}")

    def _shorten_reference(self, reference: str) -> str:
        """Shorten the name in a reference, ``url(#name)``."""
        name = reference.removeprefix("url(#").removesuffix(")")
        return f"url(#{self._shorten_name(name)})"

    def _copy_element(self, source: Element) -> Element:
        """Copy an element without its children, with short numbers and the colors of the page."""
        element = Element(source.tag.removeprefix(_NAMESPACE))
        if element.tag == "text":
            element.text = source.text
        for name, value in source.attrib.items():
            if name == "d":
                element.set(name, _shorten_path(value))
            elif name == _LINK:
                element.set("href", f"#{self._names[value.removeprefix('#')]}")
            elif name == "style":
                element.set(name, _replace_colors(value))
            elif name in _COORDINATES:
                element.set(name, _shorten_number(value, _COORDINATE_DECIMALS))
            # Matplotlib gives horizontal text a rotation by -0 degrees.
            elif name == "transform" and not value.startswith("rotate(-0 "):
                element.set(name, value)
        if "clip-path" in source.attrib:
            element.set("clip-path", self._shorten_reference(source.attrib["clip-path"]))
        return element

    def _build_dotted_line(self, uses: Sequence[Element]) -> Element | None:
        """Combine equal round marks into one path, whose points a round pen draws as dots.

        Return None if there are fewer than `_MIN_DOTS` marks, or if they differ or are not round.
        """
        if len(uses) < _MIN_DOTS:
            return None
        first = uses[0]
        link = first.get(_LINK, "")
        style = first.get("style", "")
        if any(use.get(_LINK) != link or use.get("style", "") != style for use in uses):
            return None
        name = self._names[link.removeprefix("#")]
        shape = next(shape for shape in self.definitions if shape.get("id") == name)
        circle = _CIRCLE_START.match(shape.get("d", ""))
        if circle is None:
            return None
        properties = dict(declaration.split(": ") for declaration in style.split("; "))
        opacity = properties.get("opacity", properties.get("fill-opacity", "1"))
        line_style = (
            f"fill: none; stroke: {properties['fill']}; stroke-linecap: round; "
            f"stroke-width: {2 * float(circle[1]):g}; opacity: {opacity}"
        )
        dots = []
        for use in uses:
            x = _shorten_number(use.get("x", "0"), _COORDINATE_DECIMALS)
            y = _shorten_number(use.get("y", "0"), _COORDINATE_DECIMALS)
            dots.append(f"M{x} {y}h0")
        return Element("path", {"d": "".join(dots), "style": _replace_colors(line_style)})


def _shorten_path(path: str) -> str:
    """Shorten path data: round numbers, and remove spaces next to commands."""
    words = []
    for word in path.split():
        if _NUMBER.fullmatch(word) is not None:
            word = _shorten_number(word, _PATH_DECIMALS)
        words.append(word)
    return re.sub(r" ?([A-Za-z]) ?", r"\1", " ".join(words))


def _shorten_number(number: str, decimals: int) -> str:
    """Round a number to a number of decimals, without trailing zeros."""
    if "." not in number:
        return number
    return f"{float(number):.{decimals}f}".rstrip("0").rstrip(".")


def _replace_colors(style: str) -> str:
    """Shorten a style: remove spaces and fonts, and replace colors by CSS variables."""
    declarations = [part for part in style.split("; ") if not part.startswith("font-family:")]
    text = ";".join(declaration.replace(": ", ":") for declaration in declarations)
    return _COLOR.sub(lambda match: _map_colors_to_variables()[match[0]], text)


@cache
def _map_colors_to_variables() -> dict[str, str]:
    """Return the CSS variable of each color of the light theme that occurs in plots."""
    colors = list_css_colors(LIGHT)
    names = [*_PLOT_COLORS, *(name for name in colors if name.startswith(("other-", "heat-")))]
    # In reverse, so that the first name of a color comes last and replaces the others.
    return {format_hex_color(colors[name]): f"var(--rc-{name})" for name in reversed(names)}
