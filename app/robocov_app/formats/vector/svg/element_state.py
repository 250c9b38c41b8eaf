"""The state around an element of a drawing: transform, style, labels and viewport."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from robocov.typing import FloatArray
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.vector.svg.numbers import parse_length, parse_numbers
from robocov_app.formats.vector.svg.style import Style, inherit_style, parse_opacity
from robocov_app.formats.vector.svg.transforms import build_affine, compose, fit_view_box, parse_transform


def parse_view_box(attributes: dict[str, str]) -> tuple[float, float, float, float] | None:
    """Return the ``viewBox`` (x, y, width, height) among attributes; None if it is missing or has no area.

    Raises
    ------
    ValueError
        If the attribute is not four numbers.
    """
    if "viewBox" not in attributes:
        return None
    values = parse_numbers(attributes["viewBox"])
    if len(values) != 4:
        raise ValueError(f"expected four numbers, got viewBox {attributes['viewBox'][:30]!r}")
    x, y, width, height = values
    return (x, y, width, height) if width > 0.0 and height > 0.0 else None


def list_labels(
    element: Element, *, outer: tuple[str, ...] = (), inner: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Return the distinct labels: inner ones, those of the element itself, then outer ones."""
    attributes = element.attributes
    names = (attributes.get("id", ""), attributes.get("label", ""), *attributes.get("class", "").split())
    own = [name.strip() for name in names if name.strip()]
    return tuple(dict.fromkeys([*inner, *own, *outer]))


@dataclass(frozen=True, eq=False)
class ElementState:
    """The state in which an element is drawn: its own properties and those it inherits.

    Attributes
    ----------
    matrix : (3, 3) array
        Transform from the element's units to meters.
    style : Style
    labels : tuple of str
        Labels of the element and of those around it, the innermost first.
    width, height : float
        Size of the viewport.
    depth : int
        Number of elements around it.
    opacity : float
        Opacity of the element and of the groups around it, multiplied.
    """

    matrix: FloatArray
    style: Style
    labels: tuple[str, ...]
    width: float
    height: float
    depth: int = 0
    opacity: float = 1.0

    @property
    def diagonal(self) -> float:
        """Length to which percentages without a direction refer (SVG 2, section 8.9)."""
        return math.hypot(self.width, self.height) / math.sqrt(2.0)

    def build_child_state(self, element: Element, properties: Style) -> ElementState:
        """Return the state of a child element with its own properties."""
        return replace(
            self,
            matrix=compose(self.matrix, parse_transform(properties.get("transform", ""))),
            style=inherit_style(self.style, properties),
            labels=list_labels(element, outer=self.labels),
            depth=self.depth + 1,
            opacity=self.opacity * parse_opacity(properties.get("opacity", "1")),
        )

    def translate(self, element: Element) -> ElementState:
        """Return the state translated to the position of a ``use`` or ``svg`` element."""
        x, y = self.parse_lengths(element, "x", "y")
        return replace(self, matrix=compose(self.matrix, build_affine(e=x, f=y)))

    def enter_target(self, target: Element, properties: Style) -> ElementState:
        """Return the state of the target of a ``use`` element; this is the state of the ``use`` element."""
        style = inherit_style(self.style, properties)
        return replace(self, style=style, labels=list_labels(target, inner=self.labels))

    def enter_viewport(self, attributes: dict[str, str]) -> ElementState:
        """Return the state inside the viewport of an element with these attributes."""
        width = parse_length(attributes.get("width", "100%").replace("auto", "100%"), self.width)
        height = parse_length(attributes.get("height", "100%").replace("auto", "100%"), self.height)
        matrix = self.matrix
        box = parse_view_box(attributes)
        if box is not None:
            fit = fit_view_box(box, width, height, attributes.get("preserveAspectRatio", ""))
            matrix = compose(matrix, fit)
            _, _, width, height = box
        return replace(self, matrix=matrix, width=width, height=height)

    def parse_radius(self, element: Element) -> float:
        """Return the radius of a circle, in the units of the element."""
        return parse_length(element.attributes.get("r", "0"), self.diagonal)

    def parse_lengths(self, element: Element, *names: str) -> list[float]:
        """Return attributes that are lengths along x or y, in the element's units; missing ones are 0."""
        lengths = []
        for name in names:
            text = element.attributes.get(name, "0").strip()
            is_horizontal = name[0] in "xw" or name in ("cx", "rx")
            whole = self.width if is_horizontal else self.height
            lengths.append(0.0 if text == "auto" else parse_length(text, whole))
        return lengths
