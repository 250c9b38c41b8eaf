"""Numbers and lengths of SVG."""

import re

# Possessive quantifiers (++, *+) never backtrack, which would take forever with a million digits before an
# invalid character.
DECIMAL = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?"
NUMBER = re.compile(rf"[\s,]*+({DECIMAL})", re.ASCII)
MAX_NUMBER = 1e30
"""Numbers with a larger absolute value are rejected; numbers smaller than its inverse become 0."""
METERS_PER_UNIT = 0.0254 / 96
"""Default length of a user unit: 96 units are an inch."""
_LENGTH = re.compile(rf"\s*+({DECIMAL})\s*+([A-Za-z]*+|%)\s*+", re.ASCII)
_USER_UNITS = {
    "": 1.0,
    "px": 1.0,
    "in": 96.0,
    "cm": 96 / 2.54,
    "mm": 96 / 25.4,
    "q": 96 / 101.6,
    "pt": 4 / 3,
    "pc": 16.0,
}
"""Number of user units in each unit of length (CSS Values 4, section 6.2)."""


def parse_number(text: str) -> float:
    """Convert text to a number; raise ValueError if it is invalid or larger than `MAX_NUMBER`."""
    value = float(text)
    if not abs(value) <= MAX_NUMBER:
        raise ValueError(f"expected a number up to {MAX_NUMBER:g}, got {text[:20]}")
    return 0.0 if abs(value) < 1.0 / MAX_NUMBER else value


def parse_numbers(text: str) -> list[float]:
    """Parse a list of numbers, such as ``points``; raise ValueError if it contains anything else."""
    values = []
    position = 0
    while match := NUMBER.match(text, position):
        values.append(parse_number(match[1]))
        position = match.end()
    if text[position:].strip(" \t\r\n\f,"):
        raise ValueError(f"expected a number, got {text[position : position + 20].strip()!r}")
    return values


def parse_length(text: str, whole: float | None = None) -> float:
    """Parse a length, and convert it to user units.

    Parameters
    ----------
    text : str
    whole : float or None
        Length to which percentages refer. None if percentages are not allowed.

    Raises
    ------
    ValueError
        If the text is not a length.
    """
    match = _LENGTH.fullmatch(text)
    unit = match[2].lower() if match else ""
    is_percentage = unit == "%" and whole is not None
    if match is None or not (unit in _USER_UNITS or is_percentage):
        raise ValueError(f"expected a length in px, mm, cm, in, pt, pc or %, got {text[:30]!r}")
    value = parse_number(match[1])
    if unit == "%" and whole is not None:
        return value * whole / 100.0
    return value * _USER_UNITS[unit]
