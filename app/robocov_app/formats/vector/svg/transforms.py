"""SVG transforms as (3, 3) matrices."""

import math
import re
from collections.abc import Callable

import numpy as np

from robocov.typing import FloatArray
from robocov_app.formats.geometry.frames import build_frame
from robocov_app.formats.vector.svg.numbers import MAX_NUMBER, parse_numbers

_FUNCTION = re.compile(r"[\s,]*([A-Za-z]+)\s*\(([^()]*)\)")
_UNIT = re.compile(r"(?<=[\d.])(?:px|deg)\b", re.IGNORECASE)
_ALIGNMENTS = {"xmin": 0.0, "xmid": 0.5, "xmax": 1.0, "ymin": 0.0, "ymid": 0.5, "ymax": 1.0}


def build_affine(
    *, a: float = 1.0, b: float = 0.0, c: float = 0.0, d: float = 1.0, e: float = 0.0, f: float = 0.0
) -> FloatArray:
    """Return the (3, 3) matrix that transforms (x, y, 1) to (a x + c y + e, b x + d y + f, 1)."""
    return np.array([[a, c, e], [b, d, f], [0.0, 0.0, 1.0]])


def compose(outer: FloatArray, inner: FloatArray) -> FloatArray:
    """Return the matrix that applies the inner transform first, then the outer one.

    Raises
    ------
    ValueError
        If an element of the matrix is larger than `MAX_NUMBER`.
    """
    product = outer @ inner
    if not (np.abs(product) <= MAX_NUMBER).all():
        raise ValueError(f"a transform to coordinates beyond {MAX_NUMBER:g}")
    return np.asarray(product)


def compute_stretch(matrix: FloatArray) -> tuple[float, float]:
    """Return the smallest and the largest factor by which a transform stretches lengths.

    These are the singular values of its linear part. Computing them with LAPACK for each shape would take as
    long as the rest of the import.
    """
    (a, c), (b, d) = matrix[:2, :2].tolist()
    half_sum = math.hypot(a + d, b - c) / 2
    half_difference = math.hypot(a - d, b + c) / 2
    return abs(half_sum - half_difference), half_sum + half_difference


def parse_transform(text: str) -> FloatArray:
    """Return the matrix of a ``transform``, whose last function is applied first.

    Raises
    ------
    ValueError
        If the text is not a valid transform.
    """
    matrix = build_affine()
    position = 0
    while match := _FUNCTION.match(text, position):
        function = _FUNCTIONS.get(match[1].lower())
        # CSS writes numbers with units, attributes without.
        values = parse_numbers(_UNIT.sub("", match[2]))
        if function is None or len(values) not in function[0]:
            raise ValueError(f"expected a transform, got {match[0].strip()[:40]!r}")
        matrix = compose(matrix, function[1](*values))
        position = match.end()
    if text[position:].strip(" \t\r\n,") not in ("", "none"):
        raise ValueError(f"expected a transform, got {text[position:].strip()[:40]!r}")
    return matrix


def fit_view_box(
    box: tuple[float, float, float, float], width: float, height: float, alignment: str = ""
) -> FloatArray:
    """Return the matrix that fits a ``viewBox`` into a viewport (SVG 2, section 8.2).

    Parameters
    ----------
    box : (x, y, width, height)
    width, height : float
        Size of the viewport, whose upper left corner is [0, 0].
    alignment : str
        ``preserveAspectRatio``; ``xMidYMid meet`` by default.
    """
    align, _, rule = alignment.strip().partition(" ")
    x_scale = width / box[2]
    y_scale = height / box[3]
    to_origin = build_affine(e=-box[0], f=-box[1])
    if align.lower() == "none":
        return build_affine(a=x_scale, d=y_scale) @ to_origin
    scale = min(x_scale, y_scale)
    if rule.strip() == "slice":
        scale = max(x_scale, y_scale)
    align = align or "xMidYMid"
    left = (width - scale * box[2]) * _ALIGNMENTS.get(align[:4].lower(), 0.5)
    top = (height - scale * box[3]) * _ALIGNMENTS.get(align[4:].lower(), 0.5)
    return build_affine(a=scale, d=scale, e=left, f=top) @ to_origin


def _build_scale(x: float, y: float | None = None) -> FloatArray:
    if y is None:
        y = x
    return build_affine(a=x, d=y)


def _build_rotation(degrees: float, x: float = 0.0, y: float = 0.0) -> FloatArray:
    return np.asarray(build_frame(x, y, math.radians(degrees)) @ build_affine(e=-x, f=-y))


_FUNCTIONS: dict[str, tuple[tuple[int, ...], Callable[..., FloatArray]]] = {
    "matrix": ((6,), lambda a, b, c, d, e, f: build_affine(a=a, b=b, c=c, d=d, e=e, f=f)),
    "translate": ((1, 2), lambda x, y=0.0: build_affine(e=x, f=y)),
    "translatex": ((1,), lambda x: build_affine(e=x)),
    "translatey": ((1,), lambda y: build_affine(f=y)),
    "scale": ((1, 2), _build_scale),
    "scalex": ((1,), lambda x: build_affine(a=x)),
    "scaley": ((1,), lambda y: build_affine(d=y)),
    "rotate": ((1, 3), _build_rotation),
    "skewx": ((1,), lambda angle: build_affine(c=math.tan(math.radians(angle)))),
    "skewy": ((1,), lambda angle: build_affine(b=math.tan(math.radians(angle)))),
}
"""For each function: the allowed numbers of arguments, and how to build its matrix."""
