"""The map JSON, version 1, as pydantic models: its structure, its JSON Schema, its structural errors."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from robocov.errors import unknown_name
from robocov.mistakes import MOST_LISTED, Mistake, place, refusal
from robocov.strictjson import shown_json

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

FORMAT = "robocov-map"
VERSION = 1
SMALLEST = 1e-3
"""Smallest size of anything in metres."""
LARGEST = 1e4
"""Largest size of anything in metres."""
FARTHEST = 1e7
"""Largest coordinate in metres: national grids fit, and a micrometre still counts."""

_LONGEST_LABEL = 100
_NAME = r"^[^\x00-\x1f\x7f]+$"

Coordinate: TypeAlias = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST, description="metres")
]
Size: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=SMALLEST, le=LARGEST)]
Vertex: TypeAlias = Annotated[list[Coordinate], Field(min_length=2, max_length=2, examples=[[1.5, 2]])]
VertexRing: TypeAlias = Annotated[list[Vertex], Field(min_length=3)]
Label: TypeAlias = Annotated[str, Field(strict=True, min_length=1, max_length=_LONGEST_LABEL, pattern=_NAME)]


def _kind(name: str) -> Any:
    """Return the field that says which kind of obstacle or start an object is."""
    return Field(description="Which kind it is; the other keys follow from it", examples=[name])


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", populate_by_name=False)


class PolygonModel(_Model, title="polygon"):
    """A solid polygon, with holes where given."""

    kind: Literal["polygon"] = _kind("polygon")
    name: Label | None = Field(None, description="What it is, for people", examples=["desk"])
    vertices: VertexRing = Field(
        description="Corners in order, either way round, the first not repeated",
        examples=[[[1, 1], [2, 1], [2, 3]]],
    )
    holes: list[VertexRing] = Field(
        [],
        description="Rings inside that are free, such as courtyards",
        examples=[[[[1.4, 1.2], [1.8, 1.2], [1.8, 2]]]],
    )


class CircleModel(_Model, title="circle"):
    """A round pillar."""

    kind: Literal["circle"] = _kind("circle")
    name: Label | None = Field(None, description="What it is, for people", examples=["pillar"])
    center: Vertex = Field(description="Its centre [x, y] in metres", examples=[[7.5, 3]])
    radius: Size = Field(description="Its radius in metres", examples=[0.5])


class WallModel(_Model, title="wall"):
    """A poly-line of some width, with flat ends."""

    kind: Literal["wall"] = _kind("wall")
    name: Label | None = Field(None, description="What it is, for people", examples=["west wall"])
    points: list[Vertex] = Field(
        min_length=2, description="The middle line, from end to end", examples=[[[5, 0], [5, 2.4]]]
    )
    width: Size = Field(description="Its width in metres", examples=[0.1])


class DiscModel(_Model, title="disc start"):
    """The robots start somewhere in a disc."""

    kind: Literal["disc"] = _kind("disc")
    center: Vertex = Field(description="The disc's centre [x, y] in metres", examples=[[1, 1]])
    radius: Size = Field(description="The disc's radius in metres", examples=[0.8])


class UniformModel(_Model, title="uniform start"):
    """The robots start anywhere in the free space."""

    kind: Literal["uniform"] = _kind("uniform")


class PointsModel(_Model, title="points start"):
    """The robots start at given positions."""

    kind: Literal["points"] = _kind("points")
    positions: list[Vertex] = Field(
        min_length=1, description="One [x, y] a robot, in metres", examples=[[[1, 1], [1.5, 1]]]
    )


ObstacleModel: TypeAlias = Annotated[
    PolygonModel | CircleModel | WallModel, Field(discriminator="kind", description="An obstacle")
]
StartModel: TypeAlias = Annotated[
    DiscModel | UniformModel | PointsModel, Field(discriminator="kind", description="Where a team may start")
]


class MapModel(_Model, title="robocov map"):
    """A map of robocov: the outer boundary, obstacles, and named starts of the robots, in metres."""

    schema_: Annotated[str, Field(strict=True)] | None = Field(
        None, alias="$schema", description="Where this schema is, for editors", examples=["./map.schema.json"]
    )
    format: Literal["robocov-map"] = Field(description="Says what this file is", examples=[FORMAT])
    version: Literal[1] = Field(description="Version of the format", examples=[VERSION])
    name: Label = Field(description="The map's name, for people", examples=["Two rooms"])
    description: Annotated[str, Field(strict=True, max_length=10_000)] = Field(
        "", description="A sentence about it", examples=["A wall with one door."]
    )
    boundary: VertexRing = Field(
        description="The outer boundary, convex or not, either way round; the robots know its convex hull",
        examples=[[[0, 0], [10, 0], [10, 6], [0, 6]]],
    )
    obstacles: list[ObstacleModel] = Field(
        [],
        description="They may overlap, touch, and stick out of the boundary",
        examples=[[{"kind": "wall", "points": [[5, 0], [5, 2.4]], "width": 0.1}]],
    )
    starts: dict[Label, StartModel] = Field(
        {},
        description="Named starts; the first is the default",
        examples=[{"corner": {"kind": "disc", "center": [1, 1], "radius": 0.8}}],
    )
    extra: dict[str, Any] = Field(
        {}, description="Free keys of yours; kept untouched", examples=[{"author": "Ada"}]
    )


def map_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a map, with descriptions and examples for editors."""
    schema = MapModel.model_json_schema(by_alias=True)
    # pydantic says what keys of a pattern hold, but not that other keys are errors
    starts = schema["properties"]["starts"]
    ((pattern, start),) = starts.pop("patternProperties").items()
    starts["additionalProperties"] = start
    starts["propertyNames"] = {
        "type": "string",
        "pattern": pattern,
        "minLength": 1,
        "maxLength": _LONGEST_LABEL,
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def validate(document: object, where: str) -> MapModel:
    """Return `document` as a model.

    Raises
    ------
    MapError
        One line with the first structural error, and how many more there are.
    """
    check_header(document, where)
    try:
        return MapModel.model_validate(document)
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
    # a misspelt key is also a missing one: naming the key that is there helps more
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    listed = [_mistake(detail) for detail in details[:MOST_LISTED]]
    raise refusal(where, listed, len(details) - len(listed))


def check_header(document: object, where: str) -> None:
    """Refuse what is not a map, or is one of another version, before its content is looked at.

    Raises
    ------
    MapError
    """
    if not isinstance(document, dict):
        what = f"{shown_json(document)}, but a JSON object with a map was wanted"
        raise refusal(where, [Mistake.at((), what)])
    found = document.get("format")
    if found != FORMAT:
        state = shown_json(found) if "format" in document else "missing"
        raise refusal(where, [Mistake.at(("format",), f'{state}, but "{FORMAT}" was wanted')])
    version = document.get("version")
    if type(version) is not int or version != VERSION:
        state = shown_json(version) if "version" in document else "missing"
        newer = type(version) is int and version > VERSION
        advice = "; it needs a newer robocov" if newer else ""
        raise refusal(where, [Mistake.at(("version",), f"{state}, but {VERSION} was wanted{advice}")])


_CHOICES: dict[str, dict[str, type[_Model]]] = {
    "obstacles": {"polygon": PolygonModel, "circle": CircleModel, "wall": WallModel},
    "starts": {"disc": DiscModel, "uniform": UniformModel, "points": PointsModel},
}

_POINT = "a point [x, y] in metres"
_COORDINATE = f"a number from {-FARTHEST:.0f} to {FARTHEST:.0f} (m)"
_SIZE = f"a number from {SMALLEST:g} to {LARGEST:.0f} (m)"
_RING = "a list of at least 3 points [x, y]"
_LABEL = f"a text of 1 to {_LONGEST_LABEL} characters on one line"
_WANTED: dict[str, tuple[str, ...]] = {
    # what is wanted at a key, in its items, in their items, ...
    "boundary": (_RING, _POINT, _COORDINATE),
    "vertices": (_RING, _POINT, _COORDINATE),
    "holes": ("a list of rings", _RING, _POINT, _COORDINATE),
    "points": ("a list of at least 2 points [x, y]", _POINT, _COORDINATE),
    "positions": ("a list of at least 1 point [x, y]", _POINT, _COORDINATE),
    "center": (_POINT, _COORDINATE),
    "radius": (_SIZE,),
    "width": (_SIZE,),
    "name": (_LABEL,),
    "description": ("a text of at most 10000 characters",),
    "extra": ("an object",),
    "$schema": ("a text",),
    "obstacles": ("a list of obstacles",),
    "starts": ("an object of named starts",),
}


def _mistake(detail: ErrorDetails) -> Mistake:
    """Return one structural error in the project's words: place, value, what was wanted."""
    loc, value = list(detail["loc"]), detail["input"]
    group = _CHOICES.get(str(loc[0]))
    model: type[_Model] = MapModel
    if group is not None and len(loc) > 2:
        if loc[-1] == "[key]":
            text = f"starts: name {shown_json(value)}, but {_LABEL} was wanted"
            return Mistake(tuple(loc[:-1]), text, at_key=True)
        # pydantic names the chosen kind as a step of the path
        model = group[str(loc.pop(2))]
    elif group is not None and len(loc) == 2:
        return _kind_mistake(tuple(loc), value, list(group))
    if detail["type"] == "extra_forbidden":
        *parent, key = loc
        known = [field.alias or name for name, field in model.model_fields.items()]
        at = f"{place(parent)}: " if parent else ""
        return Mistake(tuple(loc), f"{at}{unknown_name('key', str(key), known)}", at_key=True)
    found = "missing" if detail["type"] == "missing" else shown_json(value)
    steps = [k for k, step in enumerate(loc) if isinstance(step, str)]
    wanted = _WANTED[str(loc[steps[-1]])][len(loc) - 1 - steps[-1]]
    return Mistake.at(tuple(loc), f"{found}, but {wanted} was wanted")


def _kind_mistake(path: tuple[str | int, ...], value: object, kinds: list[str]) -> Mistake:
    """Return what is wrong with an obstacle or a start whose kind is not known."""
    wanted = f"one of {', '.join(kinds)}"
    if not isinstance(value, dict):
        return Mistake.at(path, f"{shown_json(value)}, but an object whose kind is {wanted} was wanted")
    path = (*path, "kind")
    if "kind" not in value:
        return Mistake.at(path, f"missing, but {wanted} was wanted")
    near = get_close_matches(str(value["kind"]).lower(), kinds, n=1, cutoff=0.5)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    return Mistake.at(path, f"{shown_json(value['kind'])}, but {wanted} was wanted{hint}")
