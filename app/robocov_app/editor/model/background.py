"""The picture under a sketch: a scanned floor plan, with its scale, place and turn."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from robocov.environment import Point
from robocov.errors import MapError
from robocov_app.editor.model.geometry import angle_to_level, cos_sin

MOST_PIXELS = 64_000_000  # pixels of the largest picture that is taken


@dataclass(frozen=True)
class Background:
    """A picture under the map; its pixels count from the upper left corner, y down, as pictures have them."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    # the file, as it stands in the map: relative to the map's folder, or absolute
    path: Annotated[str, Field(min_length=1)]
    pixels: tuple[Annotated[int, Field(gt=0)], Annotated[int, Field(gt=0)]]  # (width, height)
    scale: Annotated[float, Field(gt=0.0)] = 0.01  # m; side of a pixel
    corner: tuple[float, float] = (0.0, 0.0)  # m; where the picture's lower left corner lies
    turn: float = 0.0  # degrees; how far it is turned about that corner, counter-clockwise
    opacity: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5  # from 0, not to be seen, to 1
    shown: bool = True

    def place_of(self, pixel: Point) -> Point:
        """Return where a pixel lies on the map, m."""
        x, y = pixel[0] * self.scale, (self.pixels[1] - pixel[1]) * self.scale
        cos, sin = cos_sin(self.turn)
        return self.corner[0] + cos * x - sin * y, self.corner[1] + sin * x + cos * y

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Where its corners lie, m: lower left, lower right, upper right, upper left."""
        width, height = self.pixels
        left, right = self.place_of((0, height)), self.place_of((width, height))
        return left, right, self.place_of((width, 0)), self.place_of((0, 0))

    def document(self) -> dict[str, Any]:
        """Return it as it stands in a map."""
        held = asdict(self) | {
            "pixels": list(self.pixels),
            "corner": [_short(value) for value in self.corner],
        }
        return held | {name: _short(held[name]) for name in ("scale", "turn", "opacity")}

    @classmethod
    def of_document(cls, document: Any) -> Background | None:
        """Return the picture that stands in a map; None where that is something else."""
        if not isinstance(document, dict) or set(document) != {item.name for item in fields(cls)}:
            return None
        try:
            found = _ADAPTER.validate_json(json.dumps(document), strict=True)
        except ValidationError:
            return None
        return found if math.prod(found.pixels) <= MOST_PIXELS else None


_ADAPTER = TypeAdapter(Background)


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
    _require_apart(background, apart)
    factor = metres / apart
    if not 1e-6 <= background.scale * factor <= 1e3:
        raise MapError(f"a pixel would be {background.scale * factor:.3g} m wide: is {metres:g} m right?")
    corner = background.corner
    moved = a[0] + factor * (corner[0] - a[0]), a[1] + factor * (corner[1] - a[1])
    return replace(background, scale=background.scale * factor, corner=moved)


def levelled(background: Background, a: Point, b: Point) -> Background:
    """Return the picture turned about `a` so that the line to `b` becomes level or upright."""
    _require_apart(background, math.dist(a, b))
    return turned(background, angle_to_level(a, b), a)


def turned(background: Background, degrees: float, about: Point) -> Background:
    """Return the picture turned counter-clockwise about a place, m."""
    cos, sin = cos_sin(degrees)
    dx, dy = background.corner[0] - about[0], background.corner[1] - about[1]
    corner = about[0] + cos * dx - sin * dy, about[1] + sin * dx + cos * dy
    return replace(background, corner=corner, turn=math.remainder(background.turn + degrees, 360.0))


def _require_apart(background: Background, apart: float) -> None:
    if apart < 2 * background.scale:
        raise MapError("click two points of the picture that are farther apart")


def _short(value: float) -> int | float:
    return int(value) if float(value).is_integer() else float(value)
