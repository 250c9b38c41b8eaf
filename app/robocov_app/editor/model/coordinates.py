"""Typed coordinates, lengths and angles: ``3.2 1.5``, ``+0.5 0``, ``120cm``, ``@2<45``.

A comma between digits is a decimal comma, except beside a blank and among decimal points (``3.2,1.5``).
"""

import math
import re

from robocov.environment import Point
from robocov.errors import MapError, quote
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import compute_cos_sin

_METRIC = {"": 1.0, "m": 1.0, "km": 1000.0, "dm": 0.1, "cm": 0.01, "mm": 0.001}
_UNITS = _METRIC | {"in": 0.0254, '"': 0.0254, "ft": 0.3048, "'": 0.3048}
_NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*({'|'.join(sorted(_UNITS, key=len, reverse=True))})")
_FEET_AND_INCHES = re.compile(rf"({_NUMBER})\s*'\s*({_NUMBER})\s*\"")
_ANGLE = re.compile(rf"({_NUMBER})\s*(°|deg|rad|)")
_LENGTHS = "type a length, such as 3.2, 120cm or 12'6\""
_POINTS = "type x and y in metres, such as 3.2 1.5, relative as +0.5 0 or @2<45"
_SIZES = "type width and height in metres, such as 3 x 2"


def parse_length(text: str, *, now: float | None = None) -> float:
    """Return a length, m: ``3,2``, ``1200 mm``, ``4'6"``; from `now` also ``+0.5``, ``/2``, ``50%``."""
    typed = _clean(text)
    sign = typed[:1]
    if now is not None and sign and sign in "*/×÷":
        factor = _wanted(_number(typed[1:]), text, _LENGTHS)
        require(sign not in "/÷" or factor != 0.0, f"{quote(text)}: nothing can be divided by 0")
        return _limited(now * factor if sign in "*×" else now / factor, text)
    if now is not None and typed.endswith("%"):
        return _limited(now * _wanted(_number(typed[:-1]), text, _LENGTHS) / 100.0, text)
    relative = now if now is not None and sign in ("+", "-") else 0.0
    return _limited(_wanted(_length(typed), text, _LENGTHS) + relative, text)


def parse_point(text: str, *, last: Point | None = None) -> Point:
    """Return a place, m: ``3,2 1,5``, ``320 cm; 1.5 m``, ``2<45``; from `last` ``@2<45``, ``+0.5 0``."""
    typed = _clean(text)
    relative = typed[:1] in ("@", "+")
    require(last or not relative, f"{quote(text)}: there is no point before that it could be relative to")
    length, sign, angle = typed.removeprefix("@").strip().partition("<")
    if sign:
        x, y = _polar(_length(length.strip()), _angle(angle), text)
    else:
        x, y = (_wanted(value, text, _POINTS) for value in _pair(length, ""))
    if relative and last is not None:
        x, y = last[0] + x, last[1] + y
    if max(abs(x), abs(y)) > MAX_COORDINATE_M:
        raise MapError(f"{quote(text)}: maps reach {MAX_COORDINATE_M / 1000:.0f} km from their origin")
    return _exact(x), _exact(y)


def parse_next_point(text: str, last: Point | None, towards: Point | None) -> Point:
    """Return the next point of a line: as `point_of`, a length towards the cursor, or its own at ``<45``."""
    typed = _clean(text)
    if last is not None and towards is not None:
        dx, dy = towards[0] - last[0], towards[1] - last[1]
        away, length = math.hypot(dx, dy), _length(typed)
        if typed[:1] == "<":
            x, y = _polar(away, _angle(typed[1:]), text)
            return _exact(last[0] + x), _exact(last[1] + y)
        if not math.isnan(length):
            length = _limited(length, text)
            require(away != 0.0, f"{quote(text)}: point the cursor where the line is to go")
            return _exact(last[0] + dx / away * length), _exact(last[1] + dy / away * length)
    return parse_point(text, last=last)


def parse_size(text: str) -> tuple[float, float]:
    """Return width and height in metres: ``3 x 2``, ``3 2``, ``120cm × 80cm``; a single length is both."""
    typed = _clean(text)
    both = _length(typed)
    pair = _pair(typed, "x×*") if math.isnan(both) else (both, both)
    width, height = (_wanted(value, text, _SIZES) for value in pair)
    require(min(width, height) > 0.0, f"{quote(text)}: width and height must be above 0 m")
    return _limited(width, text), _limited(height, text)


def parse_angle(text: str) -> float:
    """Return an angle in degrees: ``45``, ``45°``, ``-90``, ``0.5rad``."""
    return _wanted(_angle(_clean(text)), text, "type an angle in degrees, such as 45")


def _clean(text: str) -> str:
    return " ".join(text.translate(str.maketrans("−–″”′’∠", "--\"\"''<")).lower().split())


def _wanted(value: float, text: str, wanted: str) -> float:
    require(not math.isnan(value), f"{quote(text)}: {wanted}")
    return value


def _number(typed: str) -> float:
    """Return a number; nan, as what reads lengths and angles below, for what is typed in another way."""
    typed = typed.strip()
    value = float(typed.replace(",", ".")) if re.fullmatch(_NUMBER, typed) else math.nan
    return value if math.isfinite(value) else math.nan


def _length(typed: str) -> float:
    if feet := _FEET_AND_INCHES.fullmatch(typed):
        whole, inches = _number(feet[1]), _number(feet[2])
        return _exact(math.copysign(abs(whole) * 0.3048 + inches * 0.0254, whole))
    match = _LENGTH.fullmatch(typed)
    return _exact(_number(match[1]) * _UNITS[match[2]]) if match else math.nan


def _pair(typed: str, signs: str) -> tuple[float, float]:
    """Return two lengths, parted by a semicolon, a blank, a comma that is no decimal one, or by a sign."""
    parted = [re.split(rf"\s*[{re.escape(sign)}]\s*", typed) for sign in signs]
    parted += [re.split(r"\s*;\s*", typed), re.split(r"\s*,\s+|\s+,\s*", typed)]
    if "." in typed:
        parted.append(re.split(r"\s*,\s*", typed))
    parted.append(re.split(r"\s+(?=[+\-.,\d])", typed))  # the unit of a length may stand apart from it
    fits = [parts for parts in parted if len(parts) == 2 and all(map(_LENGTH.fullmatch, parts))]
    a, b = fits[0] if fits else ("", "")
    return _length(a), _length(b)


def _angle(typed: str) -> float:
    match = _ANGLE.fullmatch(typed.strip())
    value = _number(match[1]) if match else math.nan
    return math.degrees(value) if match and match[2] == "rad" else value


def _polar(length: float, degrees: float, text: str) -> tuple[float, float]:
    cos, sin = compute_cos_sin(_wanted(degrees, text, _POINTS))
    return _wanted(length, text, _POINTS) * cos, length * sin


def _exact(value: float) -> float:
    """Return a coordinate without the noise of units: 1.1 inches are 0.02794 m."""
    return round(value, 9) + 0.0


def _limited(length: float, text: str) -> float:
    require(abs(length) <= MAX_SIZE_M, f"{quote(text)}: expected at most {MAX_SIZE_M / 1000:g} km")
    return _exact(length)
