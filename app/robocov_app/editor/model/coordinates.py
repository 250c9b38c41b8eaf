"""Parsing of typed coordinates, lengths and angles: ``3.2 1.5``, ``+0.5 0``, ``120cm``, ``@2<45``.

A comma between digits is a decimal comma, unless it is next to a blank or the text contains decimal points
(``3.2,1.5``).
"""

import math
import re

from robocov.environment import Point
from robocov.errors import MapError, quote
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M
from robocov_app.editor.model import require
from robocov_app.toolkit.tools.geometry import compute_cos_sin

_METRIC_UNITS = {"": 1.0, "m": 1.0, "km": 1000.0, "dm": 0.1, "cm": 0.01, "mm": 0.001}
_INCH_M = 0.0254
_FOOT_M = 0.3048
_UNITS = _METRIC_UNITS | {"in": _INCH_M, '"': _INCH_M, "ft": _FOOT_M, "'": _FOOT_M}
_NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*({'|'.join(sorted(_UNITS, key=len, reverse=True))})")
_FEET_AND_INCHES = re.compile(rf"({_NUMBER})\s*'\s*({_NUMBER})\s*\"")
_ANGLE = re.compile(rf"({_NUMBER})\s*(°|deg|rad|)")
_TYPOGRAPHIC_SIGNS = str.maketrans("−–″”′’∠", "--\"\"''<")
_LENGTH_HELP = "type a length, such as 3.2, 120cm or 12'6\""
_POINT_HELP = "type x and y in meters, such as 3.2 1.5, relative as +0.5 0 or @2<45"
_SIZE_HELP = "type width and height in meters, such as 3 x 2"
_ANGLE_HELP = "type an angle in degrees, such as 45"


def parse_length(text: str, *, now: float | None = None) -> float:
    """Parse a length that the user typed, m: ``3,2``, ``1200 mm``, ``4'6"``.

    Parameters
    ----------
    text : str
        Text that the user typed.
    now : float, optional
        Current length, m. With it, the text may be relative: ``+0.5``, ``/2``, ``50%``.

    Raises
    ------
    MapError
        If the text is not a length, or the length is too large.
    """
    typed = _clean(text)
    sign = typed[:1]
    if now is not None and sign in ("*", "/", "×", "÷"):
        factor = _require_value(_parse_number(typed[1:]), text, _LENGTH_HELP)
        if sign in ("*", "×"):
            return _check_length(now * factor, text)
        require(factor != 0.0, f"{quote(text)}: nothing can be divided by 0")
        return _check_length(now / factor, text)
    if now is not None and typed.endswith("%"):
        percent = _require_value(_parse_number(typed[:-1]), text, _LENGTH_HELP)
        return _check_length(now * percent / 100.0, text)
    length = _require_value(_parse_length(typed), text, _LENGTH_HELP)
    if now is not None and sign in ("+", "-"):
        return _check_length(length + now, text)
    return _check_length(length, text)


def parse_point(text: str, *, last: Point | None = None) -> Point:
    """Parse a position that the user typed, m: ``3,2 1,5``, ``320 cm; 1.5 m``, ``2<45``.

    Parameters
    ----------
    text : str
        Text that the user typed.
    last : Point, optional
        The previous point, m, for relative positions: ``@2<45``, ``+0.5 0``.

    Raises
    ------
    MapError
        If the text is not a position, or the position is too far from the origin for a map.
    """
    typed = _clean(text)
    is_relative = typed[:1] in ("@", "+")
    require(last or not is_relative, f"{quote(text)}: a relative position needs a previous point")
    length, angle_sign, angle = typed.removeprefix("@").strip().partition("<")
    if angle_sign:
        x, y = _convert_polar(_parse_length(length.strip()), _parse_angle(angle), text)
    else:
        x, y = _parse_pair(length, "")
        _require_value(x, text, _POINT_HELP)
        _require_value(y, text, _POINT_HELP)
    if is_relative and last is not None:
        x += last[0]
        y += last[1]
    if max(abs(x), abs(y)) > MAX_COORDINATE_M:
        raise MapError(
            f"{quote(text)}: coordinates must be within {MAX_COORDINATE_M / 1000:.0f} km of the origin"
        )
    return _round_exactly(x), _round_exactly(y)


def parse_next_point(text: str, last: Point | None, toward: Point | None) -> Point:
    """Parse the next point of a line that is being drawn, m.

    Parameters
    ----------
    text : str
        Text that the user typed: a position as in `parse_point`, a length in the direction of the cursor, or
        an angle, such as ``<45``, at the distance of the cursor.
    last : Point or None
        The previous point of the line, m.
    toward : Point or None
        Position of the cursor, m.
    """
    if last is None or toward is None:
        return parse_point(text, last=last)
    typed = _clean(text)
    dx = toward[0] - last[0]
    dy = toward[1] - last[1]
    cursor_distance = math.hypot(dx, dy)
    if typed[:1] == "<":
        x, y = _convert_polar(cursor_distance, _parse_angle(typed[1:]), text)
        return _round_exactly(last[0] + x), _round_exactly(last[1] + y)
    length = _parse_length(typed)
    if math.isnan(length):
        return parse_point(text, last=last)
    length = _check_length(length, text)
    require(cursor_distance != 0.0, f"{quote(text)}: point the cursor where the line is to go")
    x = last[0] + dx / cursor_distance * length
    y = last[1] + dy / cursor_distance * length
    return _round_exactly(x), _round_exactly(y)


def parse_size(text: str) -> tuple[float, float]:
    """Parse a width and height, m: ``3 x 2``, ``3 2``, ``120cm × 80cm``. A single length is used for both."""
    typed = _clean(text)
    side = _parse_length(typed)
    width = side
    height = side
    if math.isnan(side):
        width, height = _parse_pair(typed, "x×*")
    _require_value(width, text, _SIZE_HELP)
    _require_value(height, text, _SIZE_HELP)
    require(min(width, height) > 0.0, f"{quote(text)}: width and height must be above 0 m")
    return _check_length(width, text), _check_length(height, text)


def parse_angle(text: str) -> float:
    """Parse an angle that the user typed, degrees: ``45``, ``45°``, ``-90``, ``0.5rad``."""
    return _require_value(_parse_angle(_clean(text)), text, _ANGLE_HELP)


def _clean(text: str) -> str:
    """Return a text in lower case, with ASCII signs instead of typographic ones, and with single blanks."""
    return " ".join(text.translate(_TYPOGRAPHIC_SIGNS).lower().split())


def _require_value(value: float, text: str, help_text: str) -> float:
    require(not math.isnan(value), f"{quote(text)}: {help_text}")
    return value


def _parse_number(typed: str) -> float:
    """Parse a number; return nan if the text is not one."""
    typed = typed.strip()
    if not re.fullmatch(_NUMBER, typed):
        return math.nan
    value = float(typed.replace(",", "."))
    if not math.isfinite(value):
        return math.nan
    return value


def _parse_length(typed: str) -> float:
    """Parse a length with an optional unit, or in feet and inches, m; return nan if it is not one."""
    feet = _FEET_AND_INCHES.fullmatch(typed)
    if feet:
        whole = _parse_number(feet[1])
        inches = _parse_number(feet[2])
        return _round_exactly(math.copysign(abs(whole) * _FOOT_M + inches * _INCH_M, whole))
    match = _LENGTH.fullmatch(typed)
    if not match:
        return math.nan
    return _round_exactly(_parse_number(match[1]) * _UNITS[match[2]])


def _parse_pair(typed: str, signs: str) -> tuple[float, float]:
    """Parse two lengths that are separated by one of `signs`, a semicolon, a comma or a blank, m.

    A comma between digits is a decimal comma, unless there are decimal points.
    """
    splits = [re.split(rf"\s*[{re.escape(sign)}]\s*", typed) for sign in signs]
    splits.append(re.split(r"\s*;\s*", typed))
    splits.append(re.split(r"\s*,\s+|\s+,\s*", typed))
    if "." in typed:
        splits.append(re.split(r"\s*,\s*", typed))
    # A blank separates two lengths only before a number, because it may also precede a unit.
    splits.append(re.split(r"\s+(?=[+\-.,\d])", typed))
    for parts in splits:
        if len(parts) == 2 and all(map(_LENGTH.fullmatch, parts)):
            return _parse_length(parts[0]), _parse_length(parts[1])
    return math.nan, math.nan


def _parse_angle(typed: str) -> float:
    """Parse an angle, degrees; return nan if the text is not one."""
    match = _ANGLE.fullmatch(typed.strip())
    if not match:
        return math.nan
    value = _parse_number(match[1])
    if match[2] == "rad":
        return math.degrees(value)
    return value


def _convert_polar(length: float, degrees: float, text: str) -> tuple[float, float]:
    cos, sin = compute_cos_sin(_require_value(degrees, text, _POINT_HELP))
    return _require_value(length, text, _POINT_HELP) * cos, length * sin


def _round_exactly(value: float) -> float:
    """Round away the errors of unit conversion: 1.1 inches are exactly 0.02794 m. Never minus zero."""
    return round(value, 9) + 0.0


def _check_length(length: float, text: str) -> float:
    require(abs(length) <= MAX_SIZE_M, f"{quote(text)}: expected at most {MAX_SIZE_M / 1000:g} km")
    return _round_exactly(length)
