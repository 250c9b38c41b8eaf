"""Colours of a drawing that are declared free, solid or ignored, and what is painted in which colour."""

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
NO_ROLE = 0  # in arrays of roles, where a role is its index in `ROLES` plus one
PICTURE_TOLERANCE = 24.0  # levels per channel: what saving as JPEG and soft edges change
DARK, PALE = 0.5, 0.75  # luminance below which paint is dark, and from which it is pale
_LUMA = (0.299, 0.587, 0.114)  # weights of red, green and blue (ITU-R BT.601)
_MAX_COLOURS = 32  # declared in one import: each is compared with every pixel
_MAX_NAMED = 6  # colours that are listed in a line
_MAX_LETTERS = 100  # of the name of a colour
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
        """Return the role of the nearest declared colour within the tolerance."""
        if colour is None or not self.entries:
            return None
        code = int(self.classify(np.array([[colour]], dtype=np.uint8))[0, 0])
        return None if code == NO_ROLE else ROLES[code - 1]

    def find_nearest(self, colour: Colour) -> Colour | None:
        """Return the nearest colour of the key within the tolerance, whatever its role."""
        distances = [max(abs(a - b) for a, b in zip(colour, its, strict=True)) for its, _ in self.entries]
        if not distances or min(distances) > self.tolerance:
            return None
        return self.entries[distances.index(min(distances))][0]

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
    """The colour of a fill or a stroke as it is seen on white, if known; its role, if one was declared."""

    colour: Colour | None = None
    role: Role | None = None


UNPAINTED = Paint()


def parse_colour(text: str, option: str) -> Colour:
    """Return the colour of a CSS name or of ``#rrggbb``.

    Raises
    ------
    ParameterError
        If it is neither; the message begins with `option`.
    """
    colour = None if text.strip().casefold() == "transparent" else read_colour(text)
    if colour is None:
        wanted = "a colour name or #rrggbb, as in lightblue or '#add8e6'"
        raise ParameterError(f"{option}: expected {wanted}, got {quote(text)}")
    return colour


def read_colour(text: str) -> Colour | None:
    """Return the colour that CSS text stands for, mixed with white where it is translucent, or None."""
    found = read_paint(text)
    return None if found is None else mix_with_white(*found)


def read_paint(text: str) -> tuple[Colour, float] | None:
    """Return the colour and the opacity that CSS text stands for, or None."""
    from PIL import ImageColor

    text = text.strip()
    if len(text) > _MAX_LETTERS:
        return None
    if text.casefold() == "transparent":
        return (0, 0, 0), 0.0
    if (function := _FUNCTION.fullmatch(text)) is not None:
        return _read_rgb(function[1])
    try:
        red, green, blue, *alpha = ImageColor.getrgb(text)
    except (ValueError, TypeError):
        return None
    return (red, green, blue), alpha[0] / 255 if alpha else 1.0


def _read_rgb(arguments: str) -> tuple[Colour, float] | None:
    """Read what stands between the brackets of ``rgb()``, in any of the ways of CSS Color 4."""
    levels: list[float] = []
    for word in re.split(r"[\s,/]+", arguments.strip()):
        number = _NUMBER.fullmatch(word)
        if number is None:
            return None
        whole = 1.0 if len(levels) == 3 else 255.0
        levels.append(min(float(number[1]) * (whole / 100 if number[2] else 1.0), whole))
    if len(levels) not in (3, 4):
        return None
    red, green, blue = (round(level) for level in levels[:3])
    return (red, green, blue), levels[3] if len(levels) == 4 else 1.0


def mix_with_white(colour: Colour, opacity: float) -> Colour:
    red, green, blue = (round(255 + (level - 255) * opacity) for level in colour)
    return red, green, blue


def name_colour(colour: Sequence[int]) -> str:
    """Return a colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def count_colours(colours: Iterable[Colour | None]) -> str:
    """Return the names of colours with how often each occurs, the most frequent first; None is left out."""
    counts = Counter(name_colour(colour) for colour in colours if colour is not None)
    words = [f"{name} ({count})" for name, count in counts.most_common(_MAX_NAMED)]
    if more := len(counts) - len(words):
        words.append(f"and {format_count(more, 'other colour')}")
    return ", ".join(words)


def luminance(colour: Colour) -> float:
    """Return how light a colour is: 0 is black, 1 is white."""
    return sum(weight * level for weight, level in zip(_LUMA, colour, strict=True)) / 255
