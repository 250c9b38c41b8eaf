"""RGB colors: conversion to and from hexadecimal codes, mixing and contrast."""

from functools import lru_cache
from typing import TypeAlias

Color: TypeAlias = tuple[int, int, int]
"""Red, green and blue, each from 0 to 255."""

_DARK_TEXT: Color = (22, 27, 34)
_LIGHT_TEXT: Color = (255, 255, 255)


def parse_hex_color(code: str) -> Color:
    """Parse a hexadecimal color code of six digits.

    Examples
    --------
    >>> parse_hex_color("1F5FE0")
    (31, 95, 224)
    """
    return int(code[0:2], 16), int(code[2:4], 16), int(code[4:6], 16)


def format_hex_color(color: Color) -> str:
    """Return the hexadecimal code of a color, as in CSS and SVG.

    Examples
    --------
    >>> format_hex_color((31, 95, 224))
    '#1f5fe0'
    """
    return f"#{bytes(color).hex()}"


@lru_cache(maxsize=1000)  # Windows mix the same colors for many robots in each frame.
def mix(first: Color, second: Color, fraction: float) -> Color:
    """Mix two colors.

    Parameters
    ----------
    first, second : Color
    fraction : float
        Fraction of the second color, from 0 to 1.

    Returns
    -------
    Color

    Examples
    --------
    >>> mix((0, 0, 0), (200, 100, 0), 0.5)
    (100, 50, 0)
    """
    red, green, blue = (round(a + (b - a) * fraction) for a, b in zip(first, second, strict=True))
    return red, green, blue


def compute_luminance(color: Color) -> float:
    """Return the relative luminance of WCAG 2, from 0 for black to 1 for white."""
    red, green, blue = (_linearize(channel / 255) for channel in color)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _linearize(channel: float) -> float:
    """Return the linear light of an sRGB channel; both range from 0 to 1."""
    if channel <= 0.04045:
        return channel / 12.92
    return float(((channel + 0.055) / 1.055) ** 2.4)


def compute_contrast(first: Color, second: Color) -> float:
    """Return the contrast ratio of WCAG 2, from 1 for equal colors to 21 for black on white."""
    low, high = sorted([compute_luminance(first), compute_luminance(second)])
    return (high + 0.05) / (low + 0.05)


def choose_text_color(background: Color) -> Color:
    """Return near-black or white, whichever is more legible on a background."""
    is_light_better = compute_contrast(background, _LIGHT_TEXT) >= compute_contrast(background, _DARK_TEXT)
    return _LIGHT_TEXT if is_light_better else _DARK_TEXT
