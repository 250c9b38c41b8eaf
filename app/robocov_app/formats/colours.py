"""Colours of drawings and pictures, and the roles that the user declares for them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.errors import ParameterError, format_count, quote

Colour: TypeAlias = tuple[int, int, int]
Role: TypeAlias = Literal["free", "solid", "ignore"]
ROLES: tuple[Role, ...] = ("free", "solid", "ignore")
WHITE: Colour = (255, 255, 255)
NO_ROLE = 0
"""Value in arrays of roles, in which a role is its index in `ROLES` plus one."""
PICTURE_TOLERANCE = 24.0
"""Tolerance of a picture, in levels: JPEG compression and soft edges change colours by that much."""
MAX_DARK_LUMINANCE = 0.5
"""Paint with a lower luminance is dark."""
MIN_PALE_LUMINANCE = 0.75
"""Paint with this luminance or a higher one is pale."""
_LUMA_WEIGHTS = (0.299, 0.587, 0.114)
"""Weights of red, green and blue (ITU-R BT.601)."""
_MAX_COLOURS = 32
"""Largest number of declared colours: each is compared with every pixel."""
_MAX_LISTED_COLOURS = 6
_MAX_NAME_CHARACTERS = 100
_FUNCTION = re.compile(r"rgba?\(([^()]*)\)", re.IGNORECASE)
_NUMBER = re.compile(r"\+?(\d{1,9}(?:\.\d{0,9})?|\.\d{1,9})(%?)", re.ASCII)


@dataclass(frozen=True)
class ColourKey:
    """Colours with a declared role.

    Parameters
    ----------
    entries : sequence of (colour, role)
    tolerance : float
        Largest difference in each of red, green and blue, from 0 to 255.

    Notes
    -----
    A key without entries is false.
    """

    entries: tuple[tuple[Colour, Role], ...] = ()
    tolerance: float = 0.0

    @classmethod
    def from_names(cls, names: Mapping[Role, Sequence[str]], tolerance: float = 0.0) -> ColourKey:
        """Build a key from the names of colours of each role.

        Raises
        ------
        ParameterError
            If a colour is unknown, or has two roles.
        """
        entries: dict[Colour, Role] = {}
        for role, texts in names.items():
            for text in texts:
                colour = parse_colour(text, f"{role}_colour")
                if entries.setdefault(colour, role) != role:
                    other = f"{entries[colour]}_colour"
                    raise ParameterError(f"{role}_colour: {quote(text)} is a colour of {other} as well")
        if len(entries) > _MAX_COLOURS:
            raise ParameterError(f"free_colour: expected at most {_MAX_COLOURS} colours, got {len(entries)}")
        return cls(tuple(entries.items()), tolerance)

    def __bool__(self) -> bool:
        return bool(self.entries)

    def find_role(self, colour: Colour | None) -> Role | None:
        """Return the role of the nearest declared colour within the tolerance, or None."""
        if colour is None or not self.entries:
            return None
        code = int(self.classify(np.array([[colour]], dtype=np.uint8))[0, 0])
        return None if code == NO_ROLE else ROLES[code - 1]

    def find_nearest(self, colour: Colour) -> Colour | None:
        """Return the nearest colour of the key within the tolerance, of any role, or None."""
        nearest: Colour | None = None
        smallest_difference = np.inf
        for entry, _ in self.entries:
            difference = max(abs(a - b) for a, b in zip(colour, entry, strict=True))
            if difference <= self.tolerance and difference < smallest_difference:
                nearest = entry
                smallest_difference = difference
        return nearest

    def classify(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the roles of pixels.

        Parameters
        ----------
        pixels : (rows, columns, 3) array of uint8

        Returns
        -------
        roles : (rows, columns) array of uint8
            `NO_ROLE`, or the index in `ROLES` plus one.
        """
        roles = np.full(pixels.shape[:2], NO_ROLE, dtype=np.uint8)
        nearest = np.full(pixels.shape[:2], 256, dtype=np.int16)
        for colour, role in self.entries:
            difference = np.zeros(pixels.shape[:2], dtype=np.int16)
            for channel in range(3):
                levels = pixels[:, :, channel].astype(np.int16)
                np.maximum(difference, abs(levels - colour[channel]), out=difference)
            closer = (difference < nearest) & (difference <= self.tolerance)
            roles[closer] = ROLES.index(role) + 1
            nearest[closer] = difference[closer]
        return roles


class Paint(NamedTuple):
    """The paint of a fill or a stroke.

    Attributes
    ----------
    colour : tuple of 3 int or None
        Colour on a white page, if it is known.
    role : str or None
        Declared role of the colour.
    """

    colour: Colour | None = None
    role: Role | None = None


UNPAINTED = Paint()


def parse_colour(text: str, option: str) -> Colour:
    """Return the colour of a CSS name or of ``#rrggbb``, given as an option.

    Raises
    ------
    ParameterError
        If the text is neither; the message begins with `option`.
    """
    colour = None if text.strip().casefold() == "transparent" else parse_css_colour_on_white(text)
    if colour is None:
        expected = "a colour name or #rrggbb, as in lightblue or '#add8e6'"
        raise ParameterError(f"{option}: expected {expected}, got {quote(text)}")
    return colour


def parse_css_colour_on_white(text: str) -> Colour | None:
    """Return the colour of a CSS text on a white page, or None if it is not a colour."""
    paint = parse_css_colour(text)
    if paint is None:
        return None
    colour, opacity = paint
    return mix_with_white(colour, opacity)


def parse_css_colour(text: str) -> tuple[Colour, float] | None:
    """Return the colour and the opacity, from 0 to 1, of a CSS text, or None if it is not a colour."""
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
    opacity = alpha[0] / 255 if alpha else 1.0
    return (red, green, blue), opacity


def _parse_rgb_arguments(arguments: str) -> tuple[Colour, float] | None:
    """Return the colour and the opacity of the arguments of ``rgb()``, in any notation of CSS Color 4."""
    levels: list[float] = []
    for word in re.split(r"[\s,/]+", arguments.strip()):
        number = _NUMBER.fullmatch(word)
        if number is None:
            return None
        maximum = 1.0 if len(levels) == 3 else 255.0
        unit = maximum / 100 if number[2] else 1.0
        levels.append(min(float(number[1]) * unit, maximum))
    if len(levels) not in (3, 4):
        return None
    red, green, blue = (round(level) for level in levels[:3])
    opacity = levels[3] if len(levels) == 4 else 1.0
    return (red, green, blue), opacity


def mix_with_white(colour: Colour, opacity: float) -> Colour:
    """Return a colour as it appears on white with an opacity from 0 to 1."""
    red, green, blue = (round(255 + (level - 255) * opacity) for level in colour)
    return red, green, blue


def name_colour(colour: Sequence[int]) -> str:
    """Return a colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def count_colours(colours: Iterable[Colour | None]) -> str:
    """Return the names of colours with their frequencies, the most frequent first; None is ignored."""
    counts = Counter(name_colour(colour) for colour in colours if colour is not None)
    words = [f"{name} ({count})" for name, count in counts.most_common(_MAX_LISTED_COLOURS)]
    unlisted = len(counts) - len(words)
    if unlisted:
        words.append(f"and {format_count(unlisted, 'other colour')}")
    return ", ".join(words)


def compute_luminance(colour: Colour) -> float:
    """Return the luminance of a colour, from 0 (black) to 1 (white)."""
    return sum(weight * level for weight, level in zip(_LUMA_WEIGHTS, colour, strict=True)) / 255
