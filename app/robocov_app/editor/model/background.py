"""The picture under a sketch, and the other marks that the editor keeps in a map's free keys."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import count, islice
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from robocov.environment import Point
from robocov.errors import MapError
from robocov.mapfile.models import to_json_value
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import compute_cos_sin, compute_levelling_angle

MAX_PIXELS = 64_000_000  # pixels of the largest picture that is taken


@dataclass(frozen=True)
class Background:
    """A picture under the map; its pixels count from the upper left corner, y down, as pictures have them."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    path: Annotated[str, Field(min_length=1)]  # as in the map: relative to its folder, or absolute
    pixels: tuple[Annotated[int, Field(gt=0)], Annotated[int, Field(gt=0)]]  # (width, height)
    scale: Annotated[float, Field(gt=0.0)] = 0.01  # m; side of a pixel
    corner: tuple[float, float] = (0.0, 0.0)  # m; where the picture's lower left corner lies
    turn: float = 0.0  # degrees; how far it is turned about that corner, counter-clockwise
    opacity: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5  # from 0, not to be seen, to 1
    shown: bool = True

    def to_world(self, pixel: Point) -> Point:
        x, y = pixel[0] * self.scale, (self.pixels[1] - pixel[1]) * self.scale
        cos, sin = compute_cos_sin(self.turn)
        return self.corner[0] + cos * x - sin * y, self.corner[1] + sin * x + cos * y

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Corners, m: lower left, lower right, upper right, upper left."""
        width, height = self.pixels
        left, right = self.to_world((0, height)), self.to_world((width, height))
        return left, right, self.to_world((width, 0)), self.to_world((0, 0))

    def to_document(self) -> dict[str, Any]:
        return {name: to_json_value(value) for name, value in asdict(self).items()} | {"shown": self.shown}

    @classmethod
    def from_document(cls, document: Any) -> "Background | None":
        """Return the picture that stands in a map; None where that is something else."""
        if not isinstance(document, dict) or set(document) != {item.name for item in fields(cls)}:
            return None
        try:
            found = _ADAPTER.validate_json(json.dumps(document), strict=True)
        except ValidationError:
            return None
        return found if math.prod(found.pixels) <= MAX_PIXELS else None


_ADAPTER = TypeAdapter(Background)


def create_background(path: str, pixels: tuple[int, int], width: float = 20.0) -> Background:
    """Return a picture just taken, so many metres wide, its lower left corner in the origin."""
    if min(pixels) < 1 or math.prod(pixels) > MAX_PIXELS:
        wanted = f"expected 1 to {MAX_PIXELS // 1_000_000} million pixels"
        raise MapError(f"the picture has {pixels[0]} x {pixels[1]} pixels: {wanted}")
    return Background(path, pixels, width / pixels[0])


def scale_to_length(background: Background, a: Point, b: Point, metres: float) -> Background:
    """Return the picture scaled so that two places on it, m, come to be so many metres apart; `a` stays."""
    require(0.0 < metres < math.inf, "the length between the two points must be above 0 m")
    _require_apart(background, a, b)
    factor = metres / math.dist(a, b)
    if not 1e-6 <= background.scale * factor <= 1e3:
        raise MapError(f"a pixel would be {background.scale * factor:.3g} m wide: is {metres:g} m right?")
    x, y = background.corner
    moved = a[0] + factor * (x - a[0]), a[1] + factor * (y - a[1])
    return replace(background, scale=background.scale * factor, corner=moved)


def level_background(background: Background, a: Point, b: Point) -> Background:
    _require_apart(background, a, b)
    return rotate_background(background, compute_levelling_angle(a, b), a)


def rotate_background(background: Background, degrees: float, about: Point) -> Background:
    """Return the picture turned counter-clockwise about a place, m."""
    cos, sin = compute_cos_sin(degrees)
    dx, dy = background.corner[0] - about[0], background.corner[1] - about[1]
    corner = about[0] + cos * dx - sin * dy, about[1] + sin * dx + cos * dy
    return replace(background, corner=corner, turn=math.remainder(background.turn + degrees, 360.0))


def _require_apart(background: Background, a: Point, b: Point) -> None:
    require(math.dist(a, b) >= 2 * background.scale, "click two points of the picture that are farther apart")


MARKS = {"note": str, "group": str, "locked": bool, "hidden": bool}
"""Attributes of an obstacle besides its shape, with their types; falsy values are not written."""

_HOME = "editor"  # the editor's free key, unless that holds something of somebody else
_LISTS = {"notes": ("note",), "outline": ("group", "locked", "hidden")}
_OURS = {*_LISTS, "background"}
_Keys: TypeAlias = Mapping[str, Any]
_Marks: TypeAlias = dict[int, dict[str, Any]]  # by the place of their obstacle
_Names: TypeAlias = Sequence[str | None]  # of the obstacles
_LOST = "notes of obstacles that are gone"


def write_marks(extra: _Keys, marks: _Marks, names: _Names, background: Background | None) -> dict[str, Any]:
    """Return the free keys of a map, `extra`, with the editor's; marks come by the place of an obstacle."""
    ours: dict[str, Any] = {}
    for key, kept in _LISTS.items():
        for k in sorted(marks):
            of = {"obstacle": k} if names[k] is None else {"obstacle": k, "name": names[k]}
            if held := {name: marks[k][name] for name in kept if name in marks[k]}:
                ours.setdefault(key, []).append({**of, **held})
    if background is not None:
        ours["background"] = background.to_document()
    if not ours:
        return dict(extra)
    home = next(key for key in _homes() if _is_free(extra.get(key, {})))
    return {**extra, home: {**extra.get(home, {}), **ours}}


def read_marks(extra: _Keys, names: _Names) -> tuple[_Marks, Background | None, dict[str, Any]]:
    """Return marks by the place of their obstacle, the picture, and the free keys of everybody else."""
    for home in islice(_homes(), len(extra) + 1):
        held = extra.get(home)
        if not isinstance(held, dict) or _is_free(held):
            continue
        background = Background.from_document(held.get("background"))
        sound = all(_are_entries(held.get(key, []), kept) for key, kept in _LISTS.items())
        if not sound or ("background" in held and background is None):
            continue
        marks: _Marks = {}
        rest = {key: value for key, value in held.items() if key not in _OURS}
        for key, kept in _LISTS.items():
            taken = set()
            for entry in held.get(key, []):
                k = _obstacle_of(entry, names)
                if k is not None and k not in taken:
                    taken.add(k)
                    marks.setdefault(k, {}).update((name, entry[name]) for name in kept if name in entry)
                elif key == "notes":
                    rest[_LOST] = [*rest.get(_LOST, []), entry]
        others = {**extra, home: rest}
        return marks, background, {key: value for key, value in others.items() if key != home or rest}
    return {}, None, dict(extra)


def _homes() -> Iterator[str]:
    yield _HOME
    yield from (f"{_HOME} {k}" for k in count(2))


def _is_free(held: object) -> bool:
    return isinstance(held, dict) and not _OURS & held.keys()


def _are_entries(entries: object, kept: tuple[str, ...]) -> bool:
    return isinstance(entries, list) and all(
        isinstance(entry, dict)
        and type(entry.get("obstacle")) is int
        and isinstance(entry.get("name", ""), str)
        and set(entry) <= {"obstacle", "name", *kept}
        and any(name in entry for name in kept)
        and all(type(entry[name]) is MARKS[name] for name in kept if name in entry)
        for entry in entries
    )


def _obstacle_of(entry: _Keys, names: _Names) -> int | None:
    k, name = entry["obstacle"], entry.get("name")
    there = 0 <= k < len(names)
    if not (there and names[k] == name) and name is not None and names.count(name) == 1:
        return names.index(name)
    # it may have got a name, or lost it
    return k if there and (name is None or names[k] in (None, name)) else None
