"""Typed coordinates, lengths and angles: ``3.2 1.5``, ``+0.5 0``, ``120cm``, ``@2<45``.

A comma between digits is a decimal comma, except beside a blank and among decimal points (``3.2,1.5``).
"""

import math
import re
from typing import TypeVar

from robocov.environment import Point
from robocov.errors import MapError, shown
from robocov.mapfile.models import FARTHEST, LARGEST
from robocov_app.editor.model.geometry import cos_sin

_METRIC = {"": 1.0, "m": 1.0, "km": 1000.0, "dm": 0.1, "cm": 0.01, "mm": 0.001}
_UNITS = _METRIC | {"in": 0.0254, '"': 0.0254, "ft": 0.3048, "'": 0.3048}
_NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*({'|'.join(sorted(_UNITS, key=len, reverse=True))})")
_FEET_AND_INCHES = re.compile(rf"({_NUMBER})\s*'\s*({_NUMBER})\s*\"")
_ANGLE = re.compile(rf"({_NUMBER})\s*(°|deg|rad|)")
_LENGTHS = "type a length, such as 3.2, 120cm or 12'6\""
_POINTS = "type x and y in metres, such as 3.2 1.5, relative as +0.5 0 or @2<45"
_SIZES = "type width and height in metres, such as 3 x 2"
_Meant = TypeVar("_Meant")


def length_of(text: str, *, now: float | None = None) -> float:
    """Return a length in metres: ``3.2``, ``3,2``, ``120cm``, ``1200 mm``, ``3m``, ``4'``, ``6"``, ``4'6"``.

    With `now`, what it is at present, also ``+0.5``, ``-0.5``, ``*2``, ``/2`` and ``50%``.

    >>> length_of("120cm"), length_of("3,2"), length_of("+0.5", now=2.0), length_of("/4", now=2.0)
    (1.2, 3.2, 2.5, 0.5)
    """
    typed = _clean(text)
    sign = typed[:1]
    if now is not None and sign and sign in "*/×÷":
        factor = _wanted(_number(typed[1:].strip()), text, _LENGTHS)
        if sign in "/÷" and factor == 0.0:
            raise MapError(f"{shown(text)}: nothing can be divided by 0")
        return _limited(now * factor if sign in "*×" else now / factor, text)
    if now is not None and typed.endswith("%"):
        return _limited(now * _wanted(_number(typed[:-1].strip()), text, _LENGTHS) / 100.0, text)
    relative = now if now is not None and sign in ("+", "-") else 0.0
    return _limited(_wanted(_length(typed), text, _LENGTHS) + relative, text)


def point_of(text: str, *, last: Point | None = None) -> Point:
    """Return a place in metres: ``3.2 1.5``; ``2<45`` from the origin, at 45 degrees.

    Relative to `last`: ``@0.5 0``, ``@2<45``, and ``+0.5 0``, whose first sign is a plus.

    >>> point_of("3.2 1.5"), point_of("3,2 1,5"), point_of("320 cm; 1.5 m"), point_of("3.2,1.5")
    ((3.2, 1.5), (3.2, 1.5), (3.2, 1.5), (3.2, 1.5))
    >>> point_of("@2<90", last=(1.0, 1.0)), point_of("+0.5 -1", last=(1.0, 1.0))
    ((1.0, 3.0), (1.5, 0.0))
    """
    typed = _clean(text)
    relative = typed[:1] in ("@", "+")
    if relative and last is None:
        raise MapError(f"{shown(text)}: there is no point before that it could be relative to")
    length, sign, angle = typed.removeprefix("@").strip().partition("<")
    if sign:
        away = _wanted(_length(length.strip()), text, _POINTS)
        x, y = _polar(away, _wanted(_angle(angle.strip()), text, _POINTS))
    else:
        x, y = _wanted(_pair(length, ""), text, _POINTS)
    if relative and last is not None:
        x, y = last[0] + x, last[1] + y
    if max(abs(x), abs(y)) > FARTHEST:
        raise MapError(f"{shown(text)}: maps reach {FARTHEST / 1000:.0f} km from their origin")
    return _exact(x), _exact(y)


def next_point_of(text: str, last: Point | None, towards: Point | None) -> Point:
    """Return the next point of a line that is drawn: as `point_of`, or a mere length towards the cursor.

    ``<45`` alone keeps the cursor's distance at that angle.

    >>> next_point_of("2", (1.0, 1.0), (1.0, 1.3))
    (1.0, 3.0)
    """
    typed = _clean(text)
    if last is not None and towards is not None:
        dx, dy = towards[0] - last[0], towards[1] - last[1]
        away, length = math.hypot(dx, dy), _length(typed)
        if typed[:1] == "<":
            x, y = _polar(away, _wanted(_angle(typed[1:].strip()), text, _POINTS))
            return _exact(last[0] + x), _exact(last[1] + y)
        if length is not None:
            length = _limited(length, text)
            if away == 0.0:
                raise MapError(f"{shown(text)}: point the cursor where the line is to go")
            return _exact(last[0] + dx / away * length), _exact(last[1] + dy / away * length)
    return point_of(text, last=last)


def size_of(text: str) -> tuple[float, float]:
    """Return width and height in metres: ``3 x 2``, ``3 2``, ``120cm × 80cm``; a single length is both.

    >>> size_of("3 x 2"), size_of("120cm×80cm"), size_of("1,5")
    ((3.0, 2.0), (1.2, 0.8), (1.5, 1.5))
    """
    typed = _clean(text)
    both = _length(typed)
    width, height = (both, both) if both is not None else _wanted(_pair(typed, "x×*"), text, _SIZES)
    if min(width, height) <= 0.0:
        raise MapError(f"{shown(text)}: width and height must be above 0 m")
    return _limited(width, text), _limited(height, text)


def angle_of(text: str) -> float:
    """Return an angle in degrees: ``45``, ``45°``, ``-90``, ``0.5rad``.

    >>> angle_of("22,5°")
    22.5
    """
    return _wanted(_angle(_clean(text)), text, "type an angle in degrees, such as 45")


def _clean(text: str) -> str:
    return " ".join(text.translate(str.maketrans("−–″”′’∠", "--\"\"''<")).lower().split())


def _wanted(meant: _Meant | None, text: str, wanted: str) -> _Meant:
    if meant is None:
        raise MapError(f"{shown(text)}: {wanted}")
    return meant


def _number(typed: str) -> float | None:
    value = float(typed.replace(",", ".")) if re.fullmatch(_NUMBER, typed) else math.nan
    return value if math.isfinite(value) else None


def _length(typed: str) -> float | None:
    feet = _FEET_AND_INCHES.fullmatch(typed)
    match = _LENGTH.fullmatch(typed)
    if feet:
        whole, inches = _number(feet[1]), _number(feet[2])
        if whole is None or inches is None:
            return None
        return _exact(math.copysign(abs(whole) * 0.3048 + inches * 0.0254, whole))
    number = _number(match[1]) if match else None
    return None if match is None or number is None else _exact(number * _UNITS[match[2]])


def _pair(typed: str, signs: str) -> tuple[float, float] | None:
    """Return two lengths, parted by a semicolon, a blank, a comma that is no decimal one, or by a sign."""
    parted = [re.split(rf"\s*[{re.escape(sign)}]\s*", typed) for sign in signs]
    parted += [re.split(r"\s*;\s*", typed), re.split(r"\s*,\s+|\s+,\s*", typed)]
    if "." in typed:
        parted.append(re.split(r"\s*,\s*", typed))
    # the unit of a length may stand apart from it
    parted.append(re.split(r"\s+(?=[+\-.,\d])", typed))
    for parts in parted:
        if len(parts) == 2 and all(_LENGTH.fullmatch(part) for part in parts):
            x, y = map(_length, parts)
            return None if x is None or y is None else (x, y)
    return None


def _angle(typed: str) -> float | None:
    match = _ANGLE.fullmatch(typed)
    value = _number(match[1]) if match else None
    return math.degrees(value) if match and value is not None and match[2] == "rad" else value


def _polar(length: float, degrees: float) -> tuple[float, float]:
    cos, sin = cos_sin(degrees)
    return length * cos, length * sin


def _exact(value: float) -> float:
    """Return a coordinate without the noise of units: 1.1 inches are 0.02794 m."""
    return round(value, 9) + 0.0


def _limited(length: float, text: str) -> float:
    if abs(length) > LARGEST:
        raise MapError(f"{shown(text)}: at most {LARGEST / 1000:g} km was wanted")
    return _exact(length)
