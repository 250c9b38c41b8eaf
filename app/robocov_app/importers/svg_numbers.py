"""Numbers, lengths and transforms as SVG writes them."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array

# nothing is given back once it is taken (++, *+): else a million digits before a wrong letter take for ever
_DECIMAL = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?"
NUMBER = re.compile(rf"[\s,]*+({_DECIMAL})", re.ASCII)
_LENGTH = re.compile(rf"\s*+({_DECIMAL})\s*+([A-Za-z]*+|%)\s*+", re.ASCII)
_FUNCTION = re.compile(r"[\s,]*([A-Za-z]+)\s*\(([^()]*)\)")

_LARGEST = 1e30
PIXELS = {
    "": 1.0,
    "px": 1.0,
    "in": 96.0,
    "cm": 96 / 2.54,
    "mm": 96 / 25.4,
    "q": 96 / 101.6,
    "pt": 4 / 3,
    "pc": 16.0,
}
"""User units in a unit of length (CSS Values 4, section 6.2)."""

PIXEL = 0.0254 / 96
"""A user unit in metres, where nothing says otherwise."""


def number(text: str) -> float:
    """Return a number; what is next to nothing is nothing.

    Raises
    ------
    ValueError
        When it is so large that calculating with it would go wrong.
    """
    value = float(text)
    if not abs(value) <= _LARGEST:
        raise ValueError(f"{text[:20]}, but a number up to {_LARGEST:g} was wanted")
    return 0.0 if abs(value) < 1.0 / _LARGEST else value


def numbers(text: str) -> list[float]:
    """Return the numbers of a list as that of ``points``.

    Raises
    ------
    ValueError
        When there is something else in it.
    """
    found, at = [], 0
    while match := NUMBER.match(text, at):
        found.append(number(match[1]))
        at = match.end()
    if text[at:].strip(" \t\r\n\f,"):
        raise ValueError(f"{text[at : at + 20].strip()!r}, but a number was wanted")
    return found


def length(text: str, whole: float | None = None) -> float:
    """Return a length in user units.

    Parameters
    ----------
    text : str
    whole : float or None
        What a percentage is of; None allows none.

    Raises
    ------
    ValueError
        When it is no length, or of a unit that depends on a font.
    """
    match = _LENGTH.fullmatch(text)
    unit = match[2].lower() if match else ""
    if match is None or not (unit in PIXELS or (unit == "%" and whole is not None)):
        raise ValueError(f"{text[:30]!r}, but a length in px, mm, cm, in, pt, pc or % was wanted")
    value = number(match[1])
    return value * whole / 100.0 if unit == "%" and whole is not None else value * PIXELS[unit]


def affine(
    a: float = 1.0, b: float = 0.0, c: float = 0.0, d: float = 1.0, e: float = 0.0, f: float = 0.0
) -> Array:
    """Return the (3, 3) matrix that takes (x, y, 1) to (a x + c y + e, b x + d y + f, 1)."""
    return np.array([[a, c, e], [b, d, f], [0.0, 0.0, 1.0]])


def composed(outer: Array, inner: Array) -> Array:
    """Return the matrix of both, the inner one first.

    Raises
    ------
    ValueError
        When it makes things so large that calculating with them would go wrong.
    """
    both = outer @ inner
    if not (np.abs(both) <= _LARGEST).all():
        raise ValueError(f"a transform to coordinates beyond {_LARGEST:g}, but smaller ones were wanted")
    return np.asarray(both)


def moved(matrix: Array, points: Array) -> Array:
    """Return (k, 2) points under a matrix."""
    return np.asarray(points @ matrix[:2, :2].T + matrix[:2, 2])


def stretch(matrix: Array) -> tuple[float, float]:
    """Return by how much a matrix makes lengths longer, at least and at most: its singular values."""
    (a, c), (b, d) = matrix[:2, :2].tolist()
    # by hand: a decomposition by LAPACK, for each shape, takes as long as all else that is read of it
    half, turned = math.hypot(a + d, b - c) / 2, math.hypot(a - d, b + c) / 2
    return abs(half - turned), half + turned


def transform(text: str) -> Array:
    """Return the matrix of a ``transform``; the last of its functions comes first.

    Raises
    ------
    ValueError
        When there is something else in it.
    """
    matrix, at = affine(), 0
    while match := _FUNCTION.match(text, at):
        function = _FUNCTIONS.get(match[1].lower())
        # CSS writes units where attributes have none
        values = numbers(re.sub(r"(?<=[\d.])(?:px|deg)\b", "", match[2]))
        if function is None or len(values) not in function[0]:
            raise ValueError(f"{match[0].strip()[:40]!r}, but a transform was wanted")
        matrix = composed(matrix, function[1](*values))
        at = match.end()
    if text[at:].strip(" \t\r\n,") not in ("", "none"):
        raise ValueError(f"{text[at:].strip()[:40]!r}, but a transform was wanted")
    return matrix


def _rotation(angle: float, x: float = 0.0, y: float = 0.0) -> Array:
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return affine(e=x, f=y) @ affine(cos, sin, -sin, cos) @ affine(e=-x, f=-y)


_FUNCTIONS: dict[str, tuple[tuple[int, ...], Callable[..., Array]]] = {
    # how many numbers each takes, and its matrix
    "matrix": ((6,), affine),
    "translate": ((1, 2), lambda x, y=0.0: affine(e=x, f=y)),
    "translatex": ((1,), lambda x: affine(e=x)),
    "translatey": ((1,), lambda y: affine(f=y)),
    "scale": ((1, 2), lambda x, y=None: affine(x, d=x if y is None else y)),
    "scalex": ((1,), lambda x: affine(a=x)),
    "scaley": ((1,), lambda y: affine(d=y)),
    "rotate": ((1, 3), _rotation),
    "skewx": ((1,), lambda angle: affine(c=math.tan(math.radians(angle)))),
    "skewy": ((1,), lambda angle: affine(b=math.tan(math.radians(angle)))),
}


def fitted(box: tuple[float, float, float, float], width: float, height: float, how: str = "") -> Array:
    """Return the matrix that fits a ``viewBox`` into a viewport (SVG 2, section 8.2).

    Parameters
    ----------
    box : x, y, width, height
        Of positive size.
    width, height : float
        Of the viewport, whose corner is [0, 0].
    how : str
        ``preserveAspectRatio``; empty is the default, ``xMidYMid meet``.
    """
    align, _, rule = how.strip().partition(" ")
    x, y = width / box[2], height / box[3]
    if align.lower() == "none":
        return affine(x, d=y) @ affine(e=-box[0], f=-box[1])
    scale = max(x, y) if rule.strip() == "slice" else min(x, y)
    align = align or "xMidYMid"
    parts = {"xmin": 0.0, "xmid": 0.5, "xmax": 1.0, "ymin": 0.0, "ymid": 0.5, "ymax": 1.0}
    left = (width - scale * box[2]) * parts.get(align[:4].lower(), 0.5)
    top = (height - scale * box[3]) * parts.get(align[4:].lower(), 0.5)
    return affine(scale, d=scale, e=left, f=top) @ affine(e=-box[0], f=-box[1])
