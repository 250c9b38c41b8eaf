"""Colors of drawings and pictures, and the roles that the user declares for them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.errors import ParameterError, format_count, quote

Color: TypeAlias = tuple[int, int, int]
Role: TypeAlias = Literal["free", "solid", "ignore"]
ROLES: tuple[Role, ...] = ("free", "solid", "ignore")
WHITE: Color = (255, 255, 255)

PICTURE_TOLERANCE = 24.0
"""Tolerance of a picture, in levels (0 to 255): JPEG compression and soft edges change colors this much."""
MAX_DARK_LUMINANCE = 0.5
"""Paint with a lower luminance is dark."""
MIN_PALE_LUMINANCE = 0.75
"""Paint with this luminance or a higher one is pale."""
_LUMA_WEIGHTS = (0.299, 0.587, 0.114)
"""Weights of red, green and blue (ITU-R BT.601)."""
_MAX_COLORS = 32
"""Maximum number of declared colors. Each of them is compared with every pixel."""
_MAX_LISTED_COLORS = 6
_MAX_NAME_CHARACTERS = 100
_FUNCTION = re.compile(r"rgba?\(([^()]*)\)", re.IGNORECASE)
_NUMBER = re.compile(r"\+?(\d{1,9}(?:\.\d{0,9})?|\.\d{1,9})(%?)", re.ASCII)


class RoleCode(IntEnum):
    """Codes of roles in arrays of pixels."""

    NONE = 0
    FREE = 1
    SOLID = 2
    IGNORE = 3


ROLE_CODES: dict[Role, RoleCode] = {
    "free": RoleCode.FREE,
    "solid": RoleCode.SOLID,
    "ignore": RoleCode.IGNORE,
}
_ROLES_BY_CODE = {code: role for role, code in ROLE_CODES.items()}


@dataclass(frozen=True)
class ColorKey:
    """Colors with a declared role.

    Parameters
    ----------
    entries : sequence of (color, role)
    tolerance : float
        Maximum difference in each of red, green and blue, from 0 to 255.

    Notes
    -----
    A key without entries is false.
    """

    entries: tuple[tuple[Color, Role], ...] = ()
    tolerance: float = 0.0

    @classmethod
    def from_names(cls, names: Mapping[Role, Sequence[str]], tolerance: float = 0.0) -> ColorKey:
        """Build a key from the names of colors of each role.

        Raises
        ------
        ParameterError
            If a color is unknown, or has two roles.
        """
        entries: dict[Color, Role] = {}
        for role, texts in names.items():
            for text in texts:
                color = parse_color(text, f"{role}_color")
                if entries.setdefault(color, role) != role:
                    other = f"{entries[color]}_color"
                    raise ParameterError(f"{role}_color: {quote(text)} is a color of {other} as well")
        if len(entries) > _MAX_COLORS:
            counts = Counter(entries.values())
            role = max(counts, key=counts.__getitem__)
            raise ParameterError(
                f"{role}_color: expected at most {_MAX_COLORS} colors in all, got {len(entries)}"
            )
        return cls(tuple(entries.items()), tolerance)

    def __bool__(self) -> bool:
        return bool(self.entries)

    def find_role(self, color: Color | None) -> Role | None:
        """Return the role of the nearest declared color, or None if no color is within the tolerance."""
        if color is None or not self.entries:
            return None
        # A picture of one pixel.
        code = RoleCode(self.classify(np.array([[color]], dtype=np.uint8))[0, 0])
        return _ROLES_BY_CODE.get(code)

    def find_nearest(self, color: Color) -> Color | None:
        """Return the nearest declared color of any role, or None if no color is within the tolerance."""
        nearest: Color | None = None
        smallest_difference = np.inf
        for entry, _ in self.entries:
            difference = max(abs(a - b) for a, b in zip(color, entry, strict=True))
            if difference <= self.tolerance and difference < smallest_difference:
                nearest = entry
                smallest_difference = difference
        return nearest

    def classify(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the role of each pixel: that of the nearest declared color within the tolerance.

        Parameters
        ----------
        pixels : (rows, columns, 3) array of uint8

        Returns
        -------
        roles : (rows, columns) array of uint8
            A `RoleCode` for each pixel.
        """
        roles = np.full(pixels.shape[:2], RoleCode.NONE, dtype=np.uint8)
        nearest = np.full(pixels.shape[:2], 256, dtype=np.int16)  # more than any difference of levels
        for color, role in self.entries:
            difference = np.zeros(pixels.shape[:2], dtype=np.int16)
            for channel in range(3):
                levels = pixels[:, :, channel].astype(np.int16)
                np.maximum(difference, abs(levels - color[channel]), out=difference)
            closer = (difference < nearest) & (difference <= self.tolerance)
            roles[closer] = ROLE_CODES[role]
            nearest[closer] = difference[closer]
        return roles


class Paint(NamedTuple):
    """The paint of a fill or a stroke.

    Attributes
    ----------
    color : tuple of 3 int or None
        Color on a white page, if it is known.
    role : str or None
        Declared role of the color.
    """

    color: Color | None = None
    role: Role | None = None


UNPAINTED = Paint()


def parse_color(text: str, option: str) -> Color:
    """Return the color that a user gave as an option: a CSS name or ``#rrggbb``.

    Raises
    ------
    ParameterError
        If the text is not a color. The message begins with `option`.
    """
    color = parse_css_color_on_white(text)
    if color is None or text.strip().casefold() == "transparent":
        expected = "a color name or #rrggbb, as in lightblue or '#add8e6'"
        raise ParameterError(f"{option}: expected {expected}, got {quote(text)}")
    return color


def parse_css_color_on_white(text: str) -> Color | None:
    """Return a CSS color as it appears on a white page, or None for invalid input."""
    paint = parse_css_color(text)
    if paint is None:
        return None
    color, opacity = paint
    return mix_with_white(color, opacity)


def parse_css_color(text: str) -> tuple[Color, float] | None:
    """Return the color and the opacity (0 to 1) of a CSS color, or None for invalid input."""
    from PIL import ImageColor

    text = text.strip()
    if len(text) > _MAX_NAME_CHARACTERS:
        return None
    if text.casefold() == "transparent":
        return (0, 0, 0), 0.0
    function = _FUNCTION.fullmatch(text)
    if function is not None:
        return _parse_rgb_arguments(function[1])
    try:
        red, green, blue, *alpha = ImageColor.getrgb(text)
    except (ValueError, TypeError):
        return None
    if not alpha:
        return (red, green, blue), 1.0
    return (red, green, blue), alpha[0] / 255


def _parse_rgb_arguments(arguments: str) -> tuple[Color, float] | None:
    """Return the color and the opacity given by the arguments of ``rgb()``; None if they are invalid.

    The arguments are three numbers or percentages and an optional opacity, separated by spaces, commas or a
    slash. Values above the maximum are clipped, as in CSS. Negative numbers and ``none`` are not supported.
    """
    levels: list[float] = []
    for word in re.split(r"[\s,/]+", arguments.strip()):
        number = _NUMBER.fullmatch(word)
        if number is None:
            return None
        maximum = 255.0
        if len(levels) == 3:
            maximum = 1.0  # the fourth argument is the opacity
        level = float(number[1])
        if number[2] == "%":
            level *= maximum / 100
        levels.append(min(level, maximum))
    if len(levels) == 3:
        levels.append(1.0)
    if len(levels) != 4:
        return None
    red, green, blue, opacity = levels
    return (round(red), round(green), round(blue)), opacity


def mix_with_white(color: Color, opacity: float) -> Color:
    """Return a color as it appears on white with an opacity from 0 to 1."""
    red, green, blue = [round(255 + (level - 255) * opacity) for level in color]
    return red, green, blue


def name_color(color: Sequence[int]) -> str:
    """Return a color as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*color)


def describe_color_counts(colors: Iterable[Color | None]) -> str:
    """Describe how often each color occurs, the most frequent first: "#ff0000 (3), #000000 (1)"."""
    counts = Counter(name_color(color) for color in colors if color is not None)
    words = [f"{name} ({count})" for name, count in counts.most_common(_MAX_LISTED_COLORS)]
    unlisted = len(counts) - len(words)
    if unlisted:
        words.append(f"and {format_count(unlisted, 'other color')}")
    return ", ".join(words)


def compute_luminance(color: Color) -> float:
    """Return the luminance of a color, from 0 (black) to 1 (white)."""
    return sum(weight * level for weight, level in zip(_LUMA_WEIGHTS, color, strict=True)) / 255
