"""The picture under a sketch: a scanned floor plan, with its scale, place and turn."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from robocov.errors import MapError
from robocov_app.editor.model.geometry import cos_sin

if TYPE_CHECKING:
    from robocov.environment import Point

MOST_PIXELS = 64_000_000
"""Pixels of the largest picture that is taken."""


@dataclass(frozen=True)
class Background:
    """A picture that lies under the map.

    Pixels count from the picture's upper left corner, x to the right and y down, as pictures have them.

    Attributes
    ----------
    path : str
        The file, as it stands in the map: relative to the map's folder, or absolute.
    pixels : (width, height)
    scale : float, m
        Side of a pixel.
    corner : (x, y), m
        Where the picture's lower left corner lies.
    turn : float, degrees
        How far it is turned about that corner, counter-clockwise.
    opacity : float
        From 0, not to be seen, to 1.
    shown : bool
    """

    path: str
    pixels: tuple[int, int]
    scale: float = 0.01
    corner: Point = (0.0, 0.0)
    turn: float = 0.0
    opacity: float = 0.5
    shown: bool = True

    def place_of(self, pixel: Point) -> Point:
        """Return where a pixel lies on the map, m."""
        x, y = pixel[0] * self.scale, (self.pixels[1] - pixel[1]) * self.scale
        cos, sin = cos_sin(self.turn)
        return self.corner[0] + cos * x - sin * y, self.corner[1] + sin * x + cos * y

    def pixel_at(self, place: Point) -> Point:
        """Return the pixel at a place of the map, which may lie beside the picture."""
        dx, dy = place[0] - self.corner[0], place[1] - self.corner[1]
        cos, sin = cos_sin(self.turn)
        x, y = cos * dx + sin * dy, cos * dy - sin * dx
        return x / self.scale, self.pixels[1] - y / self.scale

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Where its corners lie, m: lower left, lower right, upper right, upper left."""
        width, height = self.pixels
        pixels: tuple[Point, Point, Point, Point] = ((0, height), (width, height), (width, 0), (0, 0))
        a, b, c, d = (self.place_of(pixel) for pixel in pixels)
        return a, b, c, d

    def document(self) -> dict[str, Any]:
        """Return it as it stands in a map."""
        return {
            "path": self.path,
            "pixels": list(self.pixels),
            "scale": _short(self.scale),
            "corner": [_short(value) for value in self.corner],
            "turn": _short(self.turn),
            "opacity": _short(self.opacity),
            "shown": self.shown,
        }

    @classmethod
    def of_document(cls, document: Any) -> Background | None:
        """Return the picture that stands in a map; None where that is something else."""
        if not isinstance(document, dict) or set(document) != {item.name for item in fields(cls)}:
            return None
        pixels, corner = document["pixels"], document["corner"]
        numbers = [document["scale"], document["turn"], document["opacity"]]
        for pair in (pixels, corner):
            if not isinstance(pair, list) or len(pair) != 2:
                return None
            numbers += pair
        if not all(_is_number(value) for value in numbers) or not isinstance(document["shown"], bool):
            return None
        width, height = pixels
        sound = type(width) is type(height) is int and width > 0 < height and width * height <= MOST_PIXELS
        if not (sound and isinstance(document["path"], str) and document["path"]):
            return None
        if not (document["scale"] > 0.0 and 0.0 <= document["opacity"] <= 1.0):
            return None
        return cls(
            document["path"],
            (width, height),
            float(document["scale"]),
            (float(corner[0]), float(corner[1])),
            float(document["turn"]),
            float(document["opacity"]),
            document["shown"],
        )


def picture_laid(path: str, pixels: tuple[int, int], width: float = 20.0) -> Background:
    """Return a picture just taken, so many metres wide, its lower left corner in the origin."""
    if min(pixels) < 1 or pixels[0] * pixels[1] > MOST_PIXELS:
        raise MapError(
            f"the picture has {pixels[0]} x {pixels[1]} pixels: "
            f"1 to {MOST_PIXELS // 1_000_000} million pixels were wanted"
        )
    return Background(path, pixels, width / pixels[0])


def to_scale(background: Background, a: Point, b: Point, metres: float) -> Background:
    """Return the picture scaled so that two places on it, m, come to be so many metres apart; `a` stays."""
    apart = math.dist(a, b)
    if not (math.isfinite(metres) and metres > 0.0):
        raise MapError("the length between the two points must be above 0 m")
    if apart < 2 * background.scale:
        raise MapError("click two points of the picture that are farther apart")
    factor = metres / apart
    if not 1e-6 <= background.scale * factor <= 1e3:
        raise MapError(f"a pixel would be {background.scale * factor:.3g} m wide: is {metres:g} m right?")
    corner = background.corner
    moved = a[0] + factor * (corner[0] - a[0]), a[1] + factor * (corner[1] - a[1])
    return replace(background, scale=background.scale * factor, corner=moved)


def turned(background: Background, degrees: float, about: Point) -> Background:
    """Return the picture turned counter-clockwise about a place, m."""
    cos, sin = cos_sin(degrees)
    dx, dy = background.corner[0] - about[0], background.corner[1] - about[1]
    corner = about[0] + cos * dx - sin * dy, about[1] + sin * dx + cos * dy
    turn = math.remainder(background.turn + degrees, 360.0)
    return replace(background, corner=corner, turn=turn)


def shifted(background: Background, a: Point, b: Point) -> Background:
    """Return the picture moved so that what lay at `a` lies at `b`, m."""
    corner = background.corner[0] + b[0] - a[0], background.corner[1] + b[1] - a[1]
    return replace(background, corner=corner)


def _short(value: float) -> int | float:
    return int(value) if float(value).is_integer() else float(value)


def _is_number(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
