"""The map JSON, version 1, as pydantic models: its structure, its JSON Schema, its structural errors."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import Field, ValidationError

from robocov.errors import unknown_name
from robocov.files.documents import check_header
from robocov.files.mistakes import MOST_LISTED, Mistake, place, refusal
from robocov.files.strictjson import shown_json
from robocov.mapfile import density_models
from robocov.mapfile.density_models import DensityModel
from robocov.mapfile.fields import COORDINATE as _COORDINATE
from robocov.mapfile.fields import FARTHEST as FARTHEST
from robocov.mapfile.fields import LABEL as _LABEL
from robocov.mapfile.fields import LARGEST as LARGEST
from robocov.mapfile.fields import (
    LONGEST_LABEL,
    Label,
    Model,
    Size,
    Vertex,
    VertexRing,
    kind_field,
)
from robocov.mapfile.fields import POINT as _POINT
from robocov.mapfile.fields import RING as _RING
from robocov.mapfile.fields import SIZE as _SIZE
from robocov.mapfile.fields import SMALLEST as SMALLEST

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

    from robocov.errors import MapError

FORMAT = "robocov-map"
VERSION = 1
SLOWEST = 1e-3
"""Smallest speed of an obstacle in m/s."""
FASTEST = 10.0
"""Largest speed of an obstacle in m/s."""


class PathModel(Model, title="path"):
    """The path of an obstacle that moves: it is shifted as its point goes along the line, and never turns."""

    points: list[Vertex] = Field(
        min_length=2,
        description="The line; at time zero its point is at the first, and the obstacle where it is drawn",
        examples=[[[2, 1], [8, 1]]],
    )
    speed: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=SLOWEST, le=FASTEST)] = Field(
        description="Metres a second", examples=[0.5]
    )
    repeat: Literal["loop", "back-and-forth"] = Field(
        "loop",
        description="From the last point straight to the first, or back the way it came",
        examples=["back-and-forth"],
    )


PathField: TypeAlias = Annotated[
    PathModel | None,
    Field(
        description="How it moves; without it, it stands",
        examples=[{"points": [[2, 1], [8, 1]], "speed": 0.5}],
    ),
]


class PolygonModel(Model, title="polygon"):
    """A solid polygon, with holes where given."""

    kind: Literal["polygon"] = kind_field("polygon")
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
    path: PathField = None


class CircleModel(Model, title="circle"):
    """A round pillar."""

    kind: Literal["circle"] = kind_field("circle")
    name: Label | None = Field(None, description="What it is, for people", examples=["pillar"])
    center: Vertex = Field(description="Its centre [x, y] in metres", examples=[[7.5, 3]])
    radius: Size = Field(description="Its radius in metres", examples=[0.5])
    path: PathField = None


class WallModel(Model, title="wall"):
    """A poly-line of some width, with flat ends."""

    kind: Literal["wall"] = kind_field("wall")
    name: Label | None = Field(None, description="What it is, for people", examples=["west wall"])
    points: list[Vertex] = Field(
        min_length=2, description="The middle line, from end to end", examples=[[[5, 0], [5, 2.4]]]
    )
    width: Size = Field(description="Its width in metres", examples=[0.1])
    path: PathField = None


class DiscModel(Model, title="disc start"):
    """The robots start somewhere in a disc."""

    kind: Literal["disc"] = kind_field("disc")
    center: Vertex = Field(description="The disc's centre [x, y] in metres", examples=[[1, 1]])
    radius: Size = Field(description="The disc's radius in metres", examples=[0.8])


class UniformModel(Model, title="uniform start"):
    """The robots start anywhere in the free space."""

    kind: Literal["uniform"] = kind_field("uniform")


class PointsModel(Model, title="points start"):
    """The robots start at given positions."""

    kind: Literal["points"] = kind_field("points")
    positions: list[Vertex] = Field(
        min_length=1, description="One [x, y] a robot, in metres", examples=[[[1, 1], [1.5, 1]]]
    )


ObstacleModel: TypeAlias = Annotated[
    PolygonModel | CircleModel | WallModel, Field(discriminator="kind", description="An obstacle")
]
StartModel: TypeAlias = Annotated[
    DiscModel | UniformModel | PointsModel, Field(discriminator="kind", description="Where a team may start")
]


class MapModel(Model, title="robocov map"):
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
    density: DensityModel | None = Field(
        None,
        description="How much each place counts; without it every place the same",
        examples=[
            {"kind": "gaussians", "floor": 0.2, "peaks": [{"center": [7.5, 3], "sigma": 1.5, "weight": 4}]}
        ],
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
        "maxLength": LONGEST_LABEL,
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def validate(document: object, where: str) -> MapModel:
    """Return `document` as a model.

    Raises
    ------
    MapError
        One line with the first structural error, and how many more there are.
    """
    check_header(document, where, FORMAT, VERSION)
    try:
        return MapModel.model_validate(document)
    except ValidationError as error:
        raise _refusal(error, where) from None


def validate_density(value: object, where: str) -> DensityModel:
    """Return the value at a map's ``density`` as a model.

    Raises
    ------
    MapError
        As `validate`.
    """
    try:
        return _Weighed.model_validate({"density": value}).density
    except ValidationError as error:
        raise _refusal(error, where) from None


class _Weighed(Model):
    density: DensityModel


def _refusal(error: ValidationError, where: str) -> MapError:
    """Return the error of a document with structural mistakes."""
    details = error.errors(include_url=False, include_context=False)
    # a misspelt key is also a missing one: naming the key that is there helps more
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    listed = [_mistake(detail) for detail in details[:MOST_LISTED]]
    return refusal(where, listed, len(details) - len(listed))


_CHOICES: dict[str, dict[str, type[Model]]] = {
    "obstacles": {"polygon": PolygonModel, "circle": CircleModel, "wall": WallModel},
    "starts": {"disc": DiscModel, "uniform": UniformModel, "points": PointsModel},
}

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
    "path": ("an object with points and speed",),
    "speed": (f"a number from {SLOWEST:g} to {FASTEST:g} (m/s)",),
    "repeat": ('"loop" or "back-and-forth"',),
    "starts": ("an object of named starts",),
}


def _mistake(detail: ErrorDetails) -> Mistake:
    """Return one structural error in the project's words: place, value, what was wanted."""
    loc, value = list(detail["loc"]), detail["input"]
    group = _CHOICES.get(str(loc[0]))
    model: type[Model] = MapModel
    if loc[0] == "density":
        if len(loc) == 1:
            return _kind_mistake(tuple(loc), value, list(density_models.KINDS))
        model = density_models.KINDS[str(loc.pop(1))]
        if len(loc) > 3:
            model = density_models.PARTS.get(str(loc[1]), model)
    elif group is not None and len(loc) > 2:
        if loc[-1] == "[key]":
            text = f"starts: name {shown_json(value)}, but {_LABEL} was wanted"
            return Mistake(tuple(loc[:-1]), text, at_key=True)
        # pydantic names the chosen kind as a step of the path
        model = group[str(loc.pop(2))]
        if len(loc) > 3 and loc[2] == "path":
            model = PathModel
    elif group is not None and len(loc) == 2:
        return _kind_mistake(tuple(loc), value, list(group))
    if detail["type"] == "extra_forbidden":
        *parent, key = loc
        known = [field.alias or name for name, field in model.model_fields.items()]
        at = f"{place(parent)}: " if parent else ""
        return Mistake(tuple(loc), f"{at}{unknown_name('key', str(key), known)}", at_key=True)
    found = "missing" if detail["type"] == "missing" else shown_json(value)
    steps = [k for k, step in enumerate(loc) if isinstance(step, str)]
    words = density_models.WANTED if loc[0] == "density" else _WANTED
    wanted = words[str(loc[steps[-1]])][len(loc) - 1 - steps[-1]]
    return Mistake.at(tuple(loc), f"{found}, but {wanted} was wanted")


def _kind_mistake(path: tuple[str | int, ...], value: object, kinds: list[str]) -> Mistake:
    """Return what is wrong with an obstacle, a start or a density whose kind is not known."""
    wanted = f"one of {', '.join(kinds)}"
    if not isinstance(value, dict):
        return Mistake.at(path, f"{shown_json(value)}, but an object whose kind is {wanted} was wanted")
    path = (*path, "kind")
    if "kind" not in value:
        return Mistake.at(path, f"missing, but {wanted} was wanted")
    near = get_close_matches(str(value["kind"]).lower(), kinds, n=1, cutoff=0.5)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    return Mistake.at(path, f"{shown_json(value['kind'])}, but {wanted} was wanted{hint}")
