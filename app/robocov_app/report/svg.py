"""matplotlib's figures as small SVG in a page, text as text: colours of the light theme become variables."""

from __future__ import annotations

import io
import re
from typing import Any
from xml.etree import ElementTree

import matplotlib
from matplotlib.figure import Figure

from robocov_app.figures.files import plain_style
from robocov_app.render.theme import LIGHT
from robocov_app.report.theme_css import hex_code, named_colours

_STYLE: Any = {"svg.hashsalt": "robocov", "svg.fonttype": "none", "savefig.bbox": None}

_METADATA: dict[str, str | None] = {"Date": None, "Creator": None, "Format": None, "Type": None}

_SPACE = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"

_MANY = 8  # so many equal round marks are drawn as one dotted line

_NUMBER = re.compile(r"-?\d*\.?\d+(?:e[-+]?\d+)?")

_PLOTTED = (
    *("background", "ink", "faint", "grid", "rapf", "rpf", "lloyd"),
    *(f"other-{k}" for k in range(len(LIGHT.others))),
)


def inline_svg(figure: Figure, key: str, sentence: str) -> str:
    """Return a figure in light colours as SVG; ids begin with `key`, `sentence` tells what it shows."""
    figure.patch.set_visible(False)
    for axes in figure.axes:
        axes.patch.set_visible(False)
    text = io.StringIO()
    with plain_style(), matplotlib.rc_context(_STYLE):
        figure.savefig(text, format="svg", metadata=_METADATA, dpi=figure.dpi)
    source = ElementTree.fromstring(text.getvalue())
    names: dict[str, str] = {}
    definitions = ElementTree.Element("defs")
    body = ElementTree.Element("g", {"stroke-linejoin": "round"})
    _copied(source, body, definitions, names, key)
    root = ElementTree.Element(
        "svg",
        {
            "class": "plot",
            "viewBox": " ".join(_short(number, 1) for number in source.get("viewBox", "").split()),
            "role": "img",
            "aria-label": sentence,
        },
    )
    if len(definitions):
        root.append(definitions)
    root.append(body)
    return ElementTree.tostring(root, encoding="unicode", short_empty_elements=True)


def _copied(
    source: ElementTree.Element,
    target: ElementTree.Element,
    definitions: ElementTree.Element,
    names: dict[str, str],
    key: str,
) -> None:
    """Copy what is drawn, without the groups and ids that nothing needs."""
    uses = [child for child in source if child.tag == f"{_SPACE}use"]
    if len(uses) >= _MANY and (dots := _dotted(uses, definitions, names)) is not None:
        target.append(dots)
        uses = []
    for child in source:
        tag = child.tag.removeprefix(_SPACE)
        if tag == "defs":
            for shape in child:
                _define(shape, definitions, names, key)
        elif tag == "use":
            if uses:
                target.append(_element(child, names))
        elif tag == "g":
            clip = child.get("clip-path")
            inner = target
            if clip is not None:
                inner = ElementTree.SubElement(target, "g", {"clip-path": _renamed(clip, names, key)})
            _copied(child, inner, definitions, names, key)
        elif tag in ("path", "text", "rect", "image"):
            element = _element(child, names)
            if "clip-path" in child.attrib:
                element.set("clip-path", _renamed(child.attrib["clip-path"], names, key))
            target.append(element)


def _define(
    shape: ElementTree.Element, definitions: ElementTree.Element, names: dict[str, str], key: str
) -> None:
    """Keep a marker or a clip path under a short name."""
    if "id" not in shape.attrib:
        return
    element = _element(shape, names)
    for child in shape:
        element.append(_element(child, names))
    name = names.setdefault(shape.attrib["id"], f"{key}-{len(names)}")
    element.set("id", name)
    element.attrib.pop("style", None)  # uses have their own
    definitions.append(element)


def _renamed(reference: str, names: dict[str, str], key: str) -> str:
    """Return ``url(#name)`` with the name that is used here."""
    old = reference.removeprefix("url(#").removesuffix(")")
    return f"url(#{names.setdefault(old, f'{key}-{len(names)}')})"


def _element(source: ElementTree.Element, names: dict[str, str]) -> ElementTree.Element:
    """Return an element with short numbers and the page's colours, without children."""
    element = ElementTree.Element(source.tag.removeprefix(_SPACE))
    element.text = source.text if element.tag == "text" else None
    for name, value in source.attrib.items():
        if name == "d":
            element.set("d", _short_path(value))
        elif name == _LINK:
            element.set("href", f"#{names[value.removeprefix('#')]}")
        elif name == "style":
            element.set("style", _coloured(value))
        elif name in ("x", "y", "width", "height"):
            element.set(name, _short(value, 1))
        elif name == "transform" and not value.startswith("rotate(-0 "):
            element.set(name, value)
    return element


def _dotted(
    uses: list[ElementTree.Element], definitions: ElementTree.Element, names: dict[str, str]
) -> ElementTree.Element | None:
    """Return many equal round marks as one path: dots of a round pen. None where they are not that."""
    first = uses[0]
    if any(use.get(_LINK) != first.get(_LINK) or use.get("style") != first.get("style") for use in uses):
        return None
    name = names[first.get(_LINK, "").removeprefix("#")]
    shape = next(each for each in definitions if each.get("id") == name)
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
    return ElementTree.Element("path", {"d": places, "style": _coloured(style)})


def _short_path(d: str) -> str:
    """Return a path with numbers of two decimals, that no user sees the difference of."""
    words = [_short(word, 2) if _NUMBER.fullmatch(word) else word for word in d.split()]
    text = " ".join(words)
    return re.sub(r" ?([A-Za-z]) ?", r"\1", text)


def _short(number: str, decimals: int) -> str:
    return f"{float(number):.{decimals}f}".rstrip("0").rstrip(".") if "." in number else number


def _coloured(style: str) -> str:
    """Return a style with the page's colours and font."""
    parts = [part for part in style.split("; ") if not part.startswith("font-family:")]
    text = ";".join(part.replace(": ", ":") for part in parts)
    return re.sub(r"#[0-9a-f]{6}", lambda match: _variables()[match[0]], text)


def _variables() -> dict[str, str]:
    """Return what stands for each colour of the light theme that plots use."""
    colours = named_colours(LIGHT)
    names = [*_PLOTTED, *(name for name in colours if name.startswith("heat-"))]
    # the first name of a colour holds
    return {hex_code(colours[name]): f"var(--rc-{name})" for name in reversed(names)}
