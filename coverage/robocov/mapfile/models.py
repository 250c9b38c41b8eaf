"""The map JSON, version 1, as pydantic models: its structure, its JSON Schema, its structural errors."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, TypeVar, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from robocov.density import (
    FINEST,
    HEAVIEST,
    Gaussian,
    Gaussians,
    Interpolation,
    Uniform,
    WeightedArea,
    WeightedPolygons,
)
from robocov.environment import (
    CircleObstacle,
    DiscStart,
    ObstaclePath,
    PointsStart,
    PolygonObstacle,
    Repeat,
    UniformStart,
    WallObstacle,
)
from robocov.errors import Mistake, place, shown_json, unknown_name
from robocov.files.documents import check_header, refused

FORMAT = "robocov-map"
VERSION = 1

SLOWEST = 1e-3
"""Smallest speed of an obstacle in m/s."""
FASTEST = 10.0
"""Largest speed of an obstacle in m/s."""
SMALLEST = 1e-3
"""Smallest size of anything in metres."""
LARGEST = 1e4
"""Largest size of anything in metres."""
FARTHEST = 1e7
"""Largest coordinate in metres: national grids fit, and a micrometre still counts."""

TINY = 1e-100
"""Coordinates nearer to zero, in metres, are read as zero: quotients of such numbers are no numbers."""

LONGEST_LABEL = 100
"""Most characters of a label."""

_NAME = r"^[^\x00-\x1f\x7f]+$"


def _between(least: float, most: float, description: str | None = None) -> Any:
    return Field(strict=True, allow_inf_nan=False, ge=least, le=most, description=description)


Coordinate: TypeAlias = Annotated[
    float,
    _between(-FARTHEST, FARTHEST, "metres"),
    AfterValidator(lambda value: 0.0 if -TINY < value < TINY else value),
]
Size: TypeAlias = Annotated[float, _between(SMALLEST, LARGEST)]
Vertex: TypeAlias = Annotated[
    list[Coordinate], Field(min_length=2, max_length=2, examples=[[1.5, 2]]), AfterValidator(tuple)
]
VertexRing: TypeAlias = Annotated[list[Vertex], Field(min_length=3), AfterValidator(tuple)]
Label: TypeAlias = Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_LABEL, pattern=_NAME)]

LIGHTEST = 1e-9
"""Weights that are smaller are read as 0: they would be when the map is written."""

Entry: TypeAlias = Annotated[float, _between(0.0, HEAVIEST)]
Weight: TypeAlias = Annotated[Entry, AfterValidator(lambda weight: weight if weight >= LIGHTEST else 0.0)]
Variance: TypeAlias = Annotated[float, _between(-1e8, 1e8)]
Matrix: TypeAlias = Annotated[
    list[Annotated[list[Variance], Field(min_length=2, max_length=2)]], Field(min_length=2, max_length=2)
]
Speed: TypeAlias = Annotated[float, _between(SLOWEST, FASTEST)]

LEAST_VARIANCE = SMALLEST**2
"""Smallest variance of a peak each way, in square metres."""

_LONGEST_PATH = 500
_MOST = 10_000


class Model(BaseModel):
    """An object of a map JSON: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", populate_by_name=False)

    stands_for: ClassVar[Any]
    """The class of what it describes; fields of the same name hold the same."""

    def built(self) -> Any:
        """Return what it describes."""
        fields = {key: getattr(self, key) for key in type(self).model_fields if key != "kind"}
        return self.stands_for(**{key: _built(value) for key, value in fields.items()})


def _built(value: Any) -> Any:
    if isinstance(value, Model):
        return value.built()
    return tuple(map(_built, value)) if isinstance(value, list) else value


def _field(description: str, example: Any, default: Any = ..., **limits: Any) -> Any:
    return Field(default, description=description, examples=[example], **limits)


def _kind(name: str) -> Any:
    return _field("Which kind it is; the other keys follow from it", name)


def _name(example: str) -> Any:
    return _field("What it is, for people", example, None)


_PATH = {"points": [[2, 1], [8, 1]], "speed": 0.5}
_MATRIX = [[2, 0.5], [0.5, 1]]
_CORNERS = [[1, 1], [2, 1], [2, 3]]
_HOT_SPOT = {"center": [7.5, 3], "sigma": 1.5, "weight": 4}
_TREASURY = {"name": "treasury", "vertices": _CORNERS, "weight": 5}
_WALL = {"kind": "wall", "points": [[5, 0], [5, 2.4]], "width": 0.1}
_STARTS = {"corner": {"kind": "disc", "center": [1, 1], "radius": 0.8}}
_DENSITY = {"kind": "gaussians", "floor": 0.2, "peaks": [_HOT_SPOT]}


class PathModel(Model, title="path"):
    """The path of an obstacle that moves: it is shifted as its point goes along the line, and never turns."""

    stands_for = ObstaclePath
    points: list[Vertex] = _field(
        "The line; at time zero its point is at the first, and the obstacle where it is drawn",
        _PATH["points"],
        min_length=2,
    )
    speed: Speed = _field("Metres a second", 0.5)
    repeat: Repeat = _field(
        "From the last point straight to the first, or back the way it came", "back-and-forth", "loop"
    )


PathField: TypeAlias = Annotated[PathModel | None, _field("How it moves; without it, it stands", _PATH)]


class PolygonModel(Model, title="polygon"):
    """A solid polygon, with holes where given."""

    stands_for = PolygonObstacle
    kind: Literal["polygon"] = _kind("polygon")
    name: Label | None = _name("desk")
    vertices: VertexRing = _field("Corners in order, either way round, the first not repeated", _CORNERS)
    holes: list[VertexRing] = _field(
        "Rings inside that are free, such as courtyards", [[[1.4, 1.2], [1.8, 1.2], [1.8, 2]]], []
    )
    path: PathField = None


class CircleModel(Model, title="circle"):
    """A round pillar."""

    stands_for = CircleObstacle
    kind: Literal["circle"] = _kind("circle")
    name: Label | None = _name("pillar")
    center: Vertex = _field("Its centre [x, y] in metres", [7.5, 3])
    radius: Size = _field("Its radius in metres", 0.5)
    path: PathField = None


class WallModel(Model, title="wall"):
    """A poly-line of some width, with flat ends."""

    stands_for = WallObstacle
    kind: Literal["wall"] = _kind("wall")
    name: Label | None = _name("west wall")
    points: list[Vertex] = _field("The middle line, from end to end", [[5, 0], [5, 2.4]], min_length=2)
    width: Size = _field("Its width in metres", 0.1)
    path: PathField = None


class DiscModel(Model, title="disc start"):
    """The robots start somewhere in a disc."""

    stands_for = DiscStart
    kind: Literal["disc"] = _kind("disc")
    center: Vertex = _field("The disc's centre [x, y] in metres", [1, 1])
    radius: Size = _field("The disc's radius in metres", 0.8)


class UniformModel(Model, title="uniform start"):
    """The robots start anywhere in the free space."""

    stands_for = UniformStart
    kind: Literal["uniform"] = _kind("uniform")


class PointsModel(Model, title="points start"):
    """The robots start at given positions."""

    stands_for = PointsStart
    kind: Literal["points"] = _kind("points")
    positions: list[Vertex] = _field("One [x, y] a robot, in metres", [[1, 1], [1.5, 1]], min_length=1)


ObstacleModel: TypeAlias = Annotated[
    PolygonModel | CircleModel | WallModel, Field(discriminator="kind", description="An obstacle")
]
StartModel: TypeAlias = Annotated[
    DiscModel | UniformModel | PointsModel, Field(discriminator="kind", description="Where a team may start")
]


class UniformDensityModel(Model, title="uniform density"):
    """Every place counts the same."""

    stands_for = Uniform
    kind: Literal["uniform"] = _kind("uniform")
    weight: Weight = _field("What every place counts, above 0", 1, 1.0)


class PeakModel(Model, title="peak"):
    """A Gaussian hot spot."""

    stands_for = Gaussian
    center: Vertex = _field("Its centre [x, y] in metres", [7.5, 3])
    sigma: Size | None = _field("Its standard deviation in metres, where it is round", 1.5, None)
    covariance: Matrix | None = _field(
        "Its covariance in square metres where it is not: symmetric, positive definite", _MATRIX, None
    )
    weight: Weight = _field("What it adds at its centre", 4)


class GaussianDensityModel(Model, title="Gaussian density"):
    """Gaussian hot spots over a floor."""

    stands_for = Gaussians
    kind: Literal["gaussians"] = _kind("gaussians")
    floor: Weight = _field("What every place counts without them", 0.2, 0.0)
    peaks: list[PeakModel] = _field("The hot spots, which add up", [_HOT_SPOT], max_length=_MOST)


class AreaModel(Model, title="weighted area"):
    """A polygon in which every place counts the same."""

    stands_for = WeightedArea
    name: Label | None = _name("treasury")
    vertices: VertexRing = _field("Corners in order, either way round, the first not repeated", _CORNERS)
    holes: list[VertexRing] = _field(
        "Rings inside that are not part of it", [[[1.5, 1.2], [1.8, 1.2], [1.8, 1.8]]], []
    )
    weight: Weight = _field("What a place in it counts", 5)


class PolygonDensityModel(Model, title="polygon density"):
    """Polygons of constant density; where they overlap, the last one counts."""

    stands_for = WeightedPolygons
    kind: Literal["polygons"] = _kind("polygons")
    background: Weight = _field("What a place outside them all counts", 1, 1.0)
    areas: list[AreaModel] = _field("The polygons, the later ones on top", [_TREASURY], max_length=_MOST)


class RasterDensityModel(Model, title="raster density"):
    """A picture of the density, in rows of numbers or in a file."""

    kind: Literal["raster"] = _kind("raster")
    extent: Annotated[list[Coordinate], Field(min_length=4, max_length=4)] | None = _field(
        "What it covers, [x_min, y_min, x_max, y_max] in metres; the boundary's box by default",
        [0, 0, 10, 6],
        None,
    )
    interpolation: Interpolation = _field(
        "bilinear between the cells' middles, or constant in each of the cells", "bilinear", "bilinear"
    )
    rows: list[Annotated[list[Entry], Field(min_length=1, max_length=FINEST)]] | None = _field(
        "Rows of numbers, the top one first", [[1, 1, 2], [1, 4, 2]], None, min_length=1, max_length=FINEST
    )
    picture: Annotated[str, Field(strict=True, min_length=1, max_length=_LONGEST_PATH)] | None = _field(
        "In place of rows, a grey PNG or PGM, relative to the map and in its folder", "density.png", None
    )
    black: Weight | None = _field("What black counts; 0 by default", 0.1, None)
    white: Weight | None = _field("What white counts; 1 by default", 5, None)


DensityModel: TypeAlias = Annotated[
    UniformDensityModel | GaussianDensityModel | PolygonDensityModel | RasterDensityModel,
    Field(discriminator="kind", description="How much each place counts"),
]


class MapModel(Model, title="robocov map"):
    """A map of robocov: the outer boundary, obstacles, and named starts of the robots, in metres."""

    schema_: Annotated[str, Field(strict=True)] | None = _field(
        "Where this schema is, for editors", "./map.schema.json", None, alias="$schema"
    )
    format: Literal["robocov-map"] = _field("Says what this file is", FORMAT)
    version: Literal[1] = _field("Version of the format", VERSION)
    name: Label = _field("The map's name, for people", "Two rooms")
    description: Annotated[str, Field(strict=True, max_length=10_000)] = _field(
        "A sentence about it", "A wall with one door.", ""
    )
    boundary: VertexRing = _field(
        "The outer boundary, convex or not, either way round; the robots know its convex hull",
        [[0, 0], [10, 0], [10, 6], [0, 6]],
    )
    obstacles: list[ObstacleModel] = _field(
        "They may overlap, touch, and stick out of the boundary", [_WALL], []
    )
    starts: dict[Label, StartModel] = _field("Named starts; the first is the default", _STARTS, {})
    density: DensityModel | None = _field(
        "How much each place counts; without it every place the same", _DENSITY, None
    )
    extra: dict[str, Any] = _field("Free keys of yours; kept untouched", {"author": "Ada"}, {})


_MODELS: dict[type, type[Model]] = {
    model.stands_for: model for model in Model.__subclasses__() if hasattr(model, "stands_for")
}


def plain(value: Any) -> Any:
    """Return the JSON of what a model describes, or of coordinates; whole numbers are int."""
    if isinstance(value, (float, int, np.integer, np.floating)):
        number = float(value)
        # beyond that, floats are whole without being meant so, and JSON gets long
        return int(number) if number.is_integer() and abs(number) < 1e15 else number
    if isinstance(value, str):
        return value
    if hasattr(value, "__iter__"):
        return [plain(item) for item in value]
    document = {}
    model = next(_MODELS[base] for base in type(value).__mro__ if base in _MODELS)
    for key, field in model.model_fields.items():
        found = get_args(field.annotation)[0] if key == "kind" else getattr(value, key)
        if found not in (None, (), []) or field.is_required():
            document[key] = plain(found)
    return document


def map_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a map, with descriptions and examples for editors."""
    schema = MapModel.model_json_schema(by_alias=True)
    # pydantic says what keys of a pattern hold, but not that other keys are errors
    starts = schema["properties"]["starts"]
    ((pattern, start),) = starts.pop("patternProperties").items()
    starts["additionalProperties"] = start
    label = {"type": "string", "pattern": pattern, "minLength": 1, "maxLength": LONGEST_LABEL}
    starts["propertyNames"] = label
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def validate(document: object, where: str) -> MapModel:
    """Return `document` as a model; the `MapError` tells of structural mistakes."""
    check_header(document, where, FORMAT, VERSION)
    return _validated(MapModel, document, where)


def validate_density(value: object, where: str) -> DensityModel:
    """Return the value at a map's ``density`` as a model, likewise."""
    return _validated(_WithDensity, {"density": value}, where).density


class _WithDensity(Model):
    density: DensityModel


_Kind = TypeVar("_Kind", bound=Model)


def _validated(kind: type[_Kind], document: object, where: str) -> _Kind:
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise refused(error, where, _mistake) from None


_CHOICES: dict[str, dict[str, type[Model]]] = {
    key: {get_args(each.model_fields["kind"].annotation)[0]: each for each in get_args(get_args(union)[0])}
    for key, union in (("obstacles", ObstacleModel), ("starts", StartModel), ("density", DensityModel))
}

_PARTS: dict[str, type[Model]] = {"path": PathModel, "peaks": PeakModel, "areas": AreaModel}
"""Values at these keys, or in their lists."""

_POINT = "a point [x, y] in metres"
_COORDINATE = f"a number from {-FARTHEST:.0f} to {FARTHEST:.0f} (m)"
_RING = "a list of at least 3 points [x, y]"
_LABEL = f"a text of 1 to {LONGEST_LABEL} characters on one line"
_WEIGHT = f"a number from 0 to {HEAVIEST:.0f}"


# what is wanted at some keys, in their items, in their items, ...
_WANTED = {
    key: words
    for keys, words in {
        "boundary vertices": (_RING, _POINT, _COORDINATE),
        "holes": ("a list of rings", _RING, _POINT, _COORDINATE),
        "points": ("a list of at least 2 points [x, y]", _POINT, _COORDINATE),
        "positions": ("a list of at least 1 point [x, y]", _POINT, _COORDINATE),
        "center": (_POINT, _COORDINATE),
        "radius width sigma": (f"a number from {SMALLEST:g} to {LARGEST:.0f} (m)",),
        "name": (_LABEL,),
        "description": ("a text of at most 10000 characters",),
        "extra": ("an object",),
        "$schema": ("a text",),
        "obstacles": ("a list of obstacles",),
        "path": ("an object with points and speed",),
        "speed": (f"a number from {SLOWEST:g} to {FASTEST:g} (m/s)",),
        "repeat": ('"loop" or "back-and-forth"',),
        "starts": ("an object of named starts",),
        "weight floor background black white": (_WEIGHT,),
        "peaks": (f"a list of at most {_MOST} peaks", "an object"),
        "areas": (f"a list of at most {_MOST} areas", "an object"),
        "covariance": ("[[xx, xy], [xy, yy]] in m²", "two numbers", "a number from -1e8 to 1e8 (m²)"),
        "extent": ("[x_min, y_min, x_max, y_max] in metres", _COORDINATE),
        "interpolation": ("bilinear or cells",),
        "rows": (f"a list of 1 to {FINEST} rows", f"a list of 1 to {FINEST} numbers", _WEIGHT),
        "picture": ("the name of a file",),
    }.items()
    for key in keys.split()
}


def _mistake(detail: ErrorDetails) -> Mistake:
    """Return one structural error in the project's words: place, value, what was wanted."""
    loc, value = list(detail["loc"]), detail["input"]
    if loc[0] == "starts" and loc[2:] == ["[key]"]:
        text = f"starts: name {shown_json(value)}, but {_LABEL} was wanted"
        return Mistake(tuple(loc[:-1]), text, at_key=True)
    kinds = _CHOICES.get(str(loc[0]), {})
    model: type[Model] = MapModel
    inside = 0 if not kinds else 1 if loc[0] == "density" else 2
    if inside and len(loc) == inside:
        return _kind_mistake(tuple(loc), value, list(kinds))
    if inside and len(loc) > inside:
        # pydantic names the chosen kind as a step of the path
        model = kinds[str(loc.pop(inside))]
    if detail["type"] == "extra_forbidden":
        *parent, key = loc
        model = _PARTS.get(str(parent[inside]), model) if len(parent) > inside else model
        known = [field.alias or name for name, field in model.model_fields.items()]
        at = f"{place(parent)}: " if parent else ""
        return Mistake(tuple(loc), f"{at}{unknown_name('key', str(key), known)}", at_key=True)
    found = "missing" if detail["type"] == "missing" else shown_json(value)
    steps = [k for k, step in enumerate(loc) if isinstance(step, str)]
    wanted = _WANTED[str(loc[steps[-1]])][len(loc) - 1 - steps[-1]]
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
