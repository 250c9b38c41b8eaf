"""SVG drawings: filled shapes are areas, unfilled strokes are walls; at their own scale or a given one."""

from __future__ import annotations

import re
from pathlib import Path

import shapely

from robocov.arrays import Array
from robocov.errors import MapError, one_line
from robocov_app.formats.foreign import ForeignMap
from robocov_app.formats.geometry.enclosing import foreign_map
from robocov_app.formats.geometry.shapes import Shapes
from robocov_app.formats.options import Importer, ReadOptions
from robocov_app.formats.svg.drawing import SvgDrawing, view_box
from robocov_app.formats.svg.path import PIXEL, affine, composed, fitted, length, numbers
from robocov_app.formats.xml_tree import Element, read_svg_tree

_ROOT = re.compile(rb"<(?:[\w-]+:)?svg[\s>]")
_SMALLEST = 1.0
"""A drawing smaller than this, in metres, at its own scale is a picture of something larger."""


def is_svg(path: Path, head: bytes) -> bool:
    """Return whether a file that begins with `head` looks like SVG; compressed SVG does by its name."""
    return _ROOT.search(head) is not None or path.suffix.lower() == ".svgz"


def read_svg(path: Path, options: ReadOptions) -> ForeignMap:
    """Return the map that an SVG file draws.

    Filled shapes are areas, by their fill rule: solid, but for the boundary (see
    `enclosing.foreign_map`, whose names are ids, classes and the labels of Inkscape's
    layers, of the shape and the groups around it). Shapes that are only stroked are walls as wide as the
    stroke, or as the option ``thickness``. Colours mean nothing. What is hidden, text and pictures are left
    out. Curves become lines that stay within a millimetre; where a stroke turns more sharply than its mitre
    limit allows, its point is cut at the limit, as of all walls, and not bevelled.

    Without the option ``scale``, metres a user unit of the root, the drawing has its own size: 96 px are an
    inch, mm are mm. The y axis is turned up; the lower left corner of the picture is [0, 0] m, or what an
    attribute ``data-origin`` of the root says.

    Raises MapError when the file cannot be read or understood, or is smaller than a metre at its own scale.
    """
    root, where = read_svg_tree(path)
    shapes = Shapes(where, options)
    drawing = SvgDrawing(root, where, shapes)
    try:
        matrix, width, height = _page(root, options.scale)
    except ValueError as error:
        root.refuse(where, str(error))
    drawing.draw(matrix, width, height)
    if options.scale is None:
        _require_size(shapes, where)
    scale = "at its own scale" if options.scale is None else f"a unit is {options.scale:g} m"
    name, description = _title(root, path)
    return foreign_map(
        shapes,
        format=IMPORTER.name,
        name=name,
        description=description,
        solid=True,
        notes=[scale, *drawing.notes()],
    )


def _page(root: Element, scale: float | None) -> tuple[Array, float, float]:
    """Return the matrix from the root's units to metres, and the size of its viewport in these units."""
    given = root.attributes
    box = view_box(given)
    size = []
    for name, whole in (("width", box[2] if box else 300.0), ("height", box[3] if box else 150.0)):
        text = given.get(name, "100%").strip()
        size.append(length("100%" if text == "auto" else text, whole))
    width, height = size
    if box is None:
        box = (0.0, 0.0, width, height)
    if width <= 0.0 or height <= 0.0:
        raise ValueError(f"{width:g} x {height:g} px, but a size was wanted")
    if scale is None:
        inside = fitted(box, width, height, given.get("preserveAspectRatio", ""))
        fit = composed(affine(PIXEL, d=PIXEL), inside)
        bottom = PIXEL * height
    else:
        fit = composed(affine(scale, d=scale), affine(e=-box[0], f=-box[1]))
        bottom = scale * box[3]
    origin = numbers(given.get("data-origin", "0 0"))
    if len(origin) != 2:
        raise ValueError(f"data-origin {given['data-origin'][:30]!r}, but two numbers were wanted")
    return composed(affine(d=-1.0, e=origin[0], f=origin[1] + bottom), fit), box[2], box[3]


def _require_size(shapes: Shapes, where: str) -> None:
    """Refuse a plan that is as small as the paper it is on, before a robot finds no room in it."""
    everything = [
        *(o.area for o in shapes.outlines),
        *(shapely.linestrings(line.points) for line in shapes.lines),
    ]
    if not everything:
        return
    x, y, right, top = shapely.total_bounds(everything)
    if max(right - x, top - y) < _SMALLEST:
        raise MapError(
            f"{where}: {right - x:.3g} x {top - y:.3g} m at its own scale, but at least {_SMALLEST:g} m was "
            f"wanted: --scale METRES says what a unit is, as in --scale 0.01"
        )


def _title(root: Element, path: Path) -> tuple[str, str]:
    texts = {
        child.tag: one_line(" ".join(child.text.split())) for child in root.children if child.text.strip()
    }
    name = texts.get("title", "")[:80] or one_line(path.stem)[:60] or "map"
    return name, texts.get("desc", "")[:1000] or "Imported from SVG."


IMPORTER = Importer(
    name="svg",
    title="SVG drawings: filled shapes, strokes as walls",
    suffixes=(".svg", ".svgz"),
    sniff=is_svg,
    read=read_svg,
    options=frozenset({"scale", "thickness", "outlines", "boundary", "around", "only", "skip"}),
)
