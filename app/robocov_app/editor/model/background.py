"""The background image of a map, and the marks of obstacles, which the editor stores in the map's free keys.

Free keys are members of ``extra`` in a map file, where any program may store data. Marks are attributes of an
obstacle that only the editor uses; see `MARKS`.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import count, islice
from typing import Annotated, Any, ClassVar, NamedTuple, TypeAlias

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from robocov.environment import Point
from robocov.errors import MapError
from robocov.mapfile.models import to_json_value
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import compute_leveling_angle
from robocov_app.toolkit.tools.geometry import compute_cos_sin

MAX_PIXELS = 64_000_000
DEFAULT_WIDTH_M = 20.0
MIN_PIXEL_M = 1e-6
MAX_PIXEL_M = 1e3
_KEYS = {"rotation_deg": "turn"}
"""JSON keys of attributes in map files that differ from the name of the attribute."""


@dataclass(frozen=True)
class Background:
    """An image behind the map, such as a scanned plan that the user traces.

    Pixel coordinates start at the upper left corner; y points down.

    Attributes
    ----------
    path : str
        Path of the image as written in the map: relative to the map's folder, or absolute.
    pixels : tuple of int
        Width and height, px.
    scale : float
        Side of a pixel, m.
    corner : tuple of float
        Position of the lower left corner, m.
    rotation_deg : float
        Counter-clockwise rotation about that corner, degrees.
    opacity : float
        Opacity from 0 (invisible) to 1.
    shown : bool
        Whether the image is shown.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    path: Annotated[str, Field(min_length=1)]
    pixels: tuple[Annotated[int, Field(gt=0)], Annotated[int, Field(gt=0)]]
    scale: Annotated[float, Field(gt=0.0)] = 0.01
    corner: tuple[float, float] = (0.0, 0.0)
    rotation_deg: float = 0.0
    opacity: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    shown: bool = True

    def to_world(self, pixel: Point) -> Point:
        """Return the position of a pixel on the map, m."""
        x = pixel[0] * self.scale
        y = (self.pixels[1] - pixel[1]) * self.scale
        cos, sin = compute_cos_sin(self.rotation_deg)
        return self.corner[0] + cos * x - sin * y, self.corner[1] + sin * x + cos * y

    @property
    def upper_left(self) -> Point:
        """Position of the upper left corner, m."""
        return self.to_world((0, 0))

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Positions of the lower left, lower right, upper right and upper left corner, m."""
        width, height = self.pixels
        return (
            self.to_world((0, height)),
            self.to_world((width, height)),
            self.to_world((width, 0)),
            self.upper_left,
        )

    def to_document(self) -> dict[str, Any]:
        """Return the JSON object that describes the image in a map file."""
        document = {_KEYS.get(name, name): to_json_value(value) for name, value in asdict(self).items()}
        # `to_json_value` turns bools into numbers.
        return document | {"shown": self.shown}

    @classmethod
    def from_document(cls, document: Any) -> "Background | None":
        """Return the image that a JSON value describes; None if the value is something else."""
        keys = {field.name: _KEYS.get(field.name, field.name) for field in fields(cls)}
        if not isinstance(document, dict) or set(document) != set(keys.values()):
            return None
        values = {name: document[key] for name, key in keys.items()}
        try:
            background = _ADAPTER.validate_json(json.dumps(values), strict=True)
        except ValidationError:
            return None
        if math.prod(background.pixels) > MAX_PIXELS:
            return None
        return background


_ADAPTER = TypeAdapter(Background)


def create_background(path: str, pixels: tuple[int, int], width: float = DEFAULT_WIDTH_M) -> Background:
    """Create a background image with its lower left corner at the origin.

    Parameters
    ----------
    path : str
        Path of the image as written in the map.
    pixels : tuple of int
        Width and height, px.
    width : float
        Width on the map, m.

    Raises
    ------
    MapError
        If the image is empty or too large.
    """
    if min(pixels) < 1 or math.prod(pixels) > MAX_PIXELS:
        size = f"{pixels[0]} x {pixels[1]} pixels"
        raise MapError(f"the image has {size}: expected 1 to {MAX_PIXELS // 1_000_000} million pixels")
    return Background(path, pixels, width / pixels[0])


def scale_to_length(background: Background, a: Point, b: Point, length: float) -> Background:
    """Scale the image about point `a` so that the distance between points `a` and `b` becomes a length, m."""
    require(0.0 < length < math.inf, "the length between the two points must be above 0 m")
    _require_apart(background, a, b)
    factor = length / math.dist(a, b)
    scale = background.scale * factor
    if not MIN_PIXEL_M <= scale <= MAX_PIXEL_M:
        raise MapError(f"a pixel would be {scale:.3g} m wide: is {length:g} m right?")
    x, y = background.corner
    corner = (a[0] + factor * (x - a[0]), a[1] + factor * (y - a[1]))
    return replace(background, scale=scale, corner=corner)


def level_background(background: Background, a: Point, b: Point) -> Background:
    """Rotate the image about point `a` so that the line to `b` is horizontal or vertical."""
    _require_apart(background, a, b)
    return rotate_background(background, compute_leveling_angle(a, b), a)


def rotate_background(background: Background, degrees: float, about: Point) -> Background:
    """Rotate the image counter-clockwise about a point, m."""
    cos, sin = compute_cos_sin(degrees)
    dx = background.corner[0] - about[0]
    dy = background.corner[1] - about[1]
    corner = (about[0] + cos * dx - sin * dy, about[1] + sin * dx + cos * dy)
    return replace(
        background, corner=corner, rotation_deg=math.remainder(background.rotation_deg + degrees, 360.0)
    )


def _require_apart(background: Background, a: Point, b: Point) -> None:
    is_apart = math.dist(a, b) >= 2 * background.scale
    require(is_apart, "click two points of the image that are farther apart")


MARKS = {"note": str, "group": str, "locked": bool, "hidden": bool}
"""Marks of an obstacle with their types. Empty and false values are not written to files."""

_PREFERRED_KEY = "editor"  # free key of the editor, unless another program uses it
# Members of the editor's free key with marks: each is a list of entries with some of the marks.
_SECTIONS = {"notes": ("note",), "outline": ("group", "locked", "hidden")}
_OWN_MEMBERS = {*_SECTIONS, "background"}
_LOST_NOTES = "notes of obstacles that are gone"
FreeKeys: TypeAlias = Mapping[str, Any]
MarksByIndex: TypeAlias = dict[int, dict[str, Any]]
Names: TypeAlias = Sequence[str | None]  # of the obstacles


class ReadMarks(NamedTuple):
    """Content of the free keys of a map.

    Attributes
    ----------
    marks : dict of int to dict
        Marks of obstacles, by obstacle index.
    background : Background or None
        The background image.
    others : dict
        Free keys of other programs.
    """

    marks: MarksByIndex
    background: Background | None
    others: dict[str, Any]


def write_marks(
    free_keys: FreeKeys, marks: MarksByIndex, names: Names, background: Background | None
) -> dict[str, Any]:
    """Return the free keys of a map, including the marks and the background image.

    Parameters
    ----------
    free_keys : mapping
        Free keys of other programs.
    marks : dict of int to dict
        Marks of obstacles, by obstacle index.
    names : sequence of str or None
        Names of the obstacles.
    background : Background or None
        The background image.
    """
    content: dict[str, Any] = {}
    for section, mark_names in _SECTIONS.items():
        for index in sorted(marks):
            values = {name: marks[index][name] for name in mark_names if name in marks[index]}
            if values:
                content.setdefault(section, []).append({**_identify(index, names), **values})
    if background is not None:
        content["background"] = background.to_document()
    if not content:
        return dict(free_keys)
    key = next(key for key in _list_candidate_keys() if _is_available(free_keys.get(key, {})))
    return {**free_keys, key: {**free_keys.get(key, {}), **content}}


def _identify(index: int, names: Names) -> dict[str, Any]:
    """Return the members that identify an obstacle in an entry: its index, and its name if it has one."""
    name = names[index]
    if name is None:
        return {"obstacle": index}
    return {"obstacle": index, "name": name}


def read_marks(free_keys: FreeKeys, names: Names) -> ReadMarks:
    """Read the marks and the background image from the free keys of a map, given the names of its obstacles.

    A key whose content the editor could not have written is left to other programs.
    """
    # At most len(free_keys) keys can be in use, so the search ends after one more.
    for key in islice(_list_candidate_keys(), len(free_keys) + 1):
        content = free_keys.get(key)
        if not isinstance(content, dict) or _is_available(content):
            continue
        background = Background.from_document(content.get("background"))
        has_broken_background = "background" in content and background is None
        if has_broken_background or not _has_valid_sections(content):
            continue
        marks, rest = _assign_marks(content, names)
        others = dict(free_keys)
        if rest:
            others[key] = rest
        else:
            del others[key]
        return ReadMarks(marks, background, others)
    return ReadMarks({}, None, dict(free_keys))


def _has_valid_sections(content: FreeKeys) -> bool:
    has_valid_entries = all(
        _are_entries(content.get(section, []), mark_names) for section, mark_names in _SECTIONS.items()
    )
    return has_valid_entries and isinstance(content.get(_LOST_NOTES, []), list)


def _assign_marks(content: FreeKeys, names: Names) -> tuple[MarksByIndex, dict[str, Any]]:
    """Find the obstacle of each entry in the editor's free key.

    Returns
    -------
    marks : dict of int to dict
        Marks of obstacles, by obstacle index.
    rest : dict
        Members that other programs have added to the key, and notes whose obstacle no longer exists.
    """
    marks: MarksByIndex = {}
    rest = {key: value for key, value in content.items() if key not in _OWN_MEMBERS}
    for section, mark_names in _SECTIONS.items():
        assigned: set[int] = set()
        for entry in content.get(section, []):
            index = _find_obstacle(entry, names)
            if index is not None and index not in assigned:
                assigned.add(index)
                values = {name: entry[name] for name in mark_names if name in entry}
                marks.setdefault(index, {}).update(values)
            elif section == "notes":
                rest[_LOST_NOTES] = [*rest.get(_LOST_NOTES, []), entry]
    return marks, rest


def _list_candidate_keys() -> Iterator[str]:
    """Yield the free keys that the editor may use, in order of preference."""
    yield _PREFERRED_KEY
    yield from (f"{_PREFERRED_KEY} {k}" for k in count(2))


def _is_available(content: object) -> bool:
    """Return whether the editor may add its members to a free key with this content; not if it has any."""
    return isinstance(content, dict) and not _OWN_MEMBERS & content.keys()


def _are_entries(entries: object, mark_names: tuple[str, ...]) -> bool:
    return isinstance(entries, list) and all(_is_entry(entry, mark_names) for entry in entries)


def _is_entry(entry: object, mark_names: tuple[str, ...]) -> bool:
    """Return whether a JSON value is an entry, with an obstacle and at least one of the given marks."""
    # `type`, because bool is a subclass of int.
    if not isinstance(entry, dict) or type(entry.get("obstacle")) is not int:
        return False
    if not isinstance(entry.get("name", ""), str) or not set(entry) <= {"obstacle", "name", *mark_names}:
        return False
    present = [name for name in mark_names if name in entry]
    return bool(present) and all(type(entry[name]) is MARKS[name] for name in present)


def _find_obstacle(entry: FreeKeys, names: Names) -> int | None:
    """Find the index of the obstacle of an entry: by index and name, or by a unique name; None if missing."""
    index: int = entry["obstacle"]
    name = entry.get("name")
    exists = 0 <= index < len(names)
    has_same_name = exists and names[index] == name
    if not has_same_name and name is not None and names.count(name) == 1:
        return names.index(name)
    # The obstacle may have been given a name since, or have lost its name.
    is_compatible = exists and (name is None or names[index] in (None, name))
    if not is_compatible:
        return None
    return index
