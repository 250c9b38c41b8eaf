"""The map JSON, version 1, as pydantic models: its structure, its JSON Schema, its structural errors.

The models of obstacles, starts and densities follow from the classes that these are read into.
"""

import math
from collections.abc import Iterator
from dataclasses import MISSING, fields
from difflib import get_close_matches
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, TypeAlias, Union, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, create_model
from pydantic_core import ErrorDetails

from robocov import density, environment
from robocov.density import MAX_RASTER_SIZE, MAX_WEIGHT, Interpolation
from robocov.environment import Repeat
from robocov.errors import JsonPath, MapError, Mistake, describe_unknown_name, format_path, quote_json
from robocov.files.strictjson import check_header, refused

FORMAT = "robocov-map"
VERSION = 1
HEAD = {"format": FORMAT, "version": VERSION}
SLOWEST, FASTEST = 1e-3, 10.0
"""Speeds of an obstacle in m/s."""
SMALLEST, LARGEST = 1e-3, 1e4
"""Sizes of anything in metres."""
FARTHEST = 1e7
"""Largest coordinate in metres: national grids fit, and a micrometre still counts."""
LIGHTEST = 1e-9
"""Weights that are smaller are read as 0: they would be when the map is written."""
NOTHING = "all places count 0, but a weight above 0 was wanted"
LONGEST_LABEL = 100
"""Most characters of a label."""
_BASES = {"uniform": "weight", "gaussians": "floor", "polygons": "background"}
"""Keys of what a place counts at least, by the kind of the density."""
_TINY = 1e-100
"""Coordinates nearer to zero, in metres, are read as zero: quotients of such numbers are no numbers."""
_MOST = 10_000
_NAME = r"^[^\x00-\x1f\x7f]+$"


def _between(least: float, most: float, description: str | None = None) -> Any:
    return Field(strict=True, allow_inf_nan=False, ge=least, le=most, description=description)


Coordinate: TypeAlias = Annotated[
    float,
    _between(-FARTHEST, FARTHEST, "metres"),
    AfterValidator(lambda value: 0.0 if -_TINY < value < _TINY else value),
]
Size: TypeAlias = Annotated[float, _between(SMALLEST, LARGEST)]
Speed: TypeAlias = Annotated[float, _between(SLOWEST, FASTEST)]
Vertex: TypeAlias = Annotated[
    list[Coordinate], Field(min_length=2, max_length=2, examples=[[1.5, 2]]), AfterValidator(tuple)
]
VertexRing: TypeAlias = Annotated[list[Vertex], Field(min_length=3), AfterValidator(tuple)]
Text: TypeAlias = Annotated[str, Field(strict=True)]
Sentence: TypeAlias = Annotated[Text, Field(max_length=10_000)]
FileName: TypeAlias = Annotated[Text, Field(min_length=1, max_length=500)]
Label: TypeAlias = Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_LABEL, pattern=_NAME)]
Entry: TypeAlias = Annotated[float, _between(0.0, MAX_WEIGHT)]
Weight: TypeAlias = Annotated[Entry, AfterValidator(lambda weight: weight if weight >= LIGHTEST else 0.0)]
Line: TypeAlias = Annotated[list[Vertex], Field(min_length=2)]
Places: TypeAlias = Annotated[list[Vertex], Field(min_length=1)]
Row: TypeAlias = Annotated[list[Entry], Field(min_length=1, max_length=MAX_RASTER_SIZE)]
Rows: TypeAlias = Annotated[list[Row], Field(min_length=1, max_length=MAX_RASTER_SIZE)]
Extent: TypeAlias = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
Variance: TypeAlias = Annotated[float, _between(-1e8, 1e8)]
Variances: TypeAlias = Annotated[list[Variance], Field(min_length=2, max_length=2)]
Matrix: TypeAlias = Annotated[list[Variances], Field(min_length=2, max_length=2)]


class Model(BaseModel):
    """An object of a map JSON: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", populate_by_name=False)

    stands_for: ClassVar[Any] = None  # the class of what it describes, with fields of the same names

    def built(self) -> Any:
        """Return what it describes."""
        names = type(self).model_fields.keys() - {"kind"}
        return self.stands_for(**{name: _built(getattr(self, name)) for name in names})


def _built(value: Any) -> Any:
    if isinstance(value, Model):
        return value.built()
    return tuple(map(_built, value)) if isinstance(value, list) else value


def _field(description: str, example: Any, default: Any = ..., **limits: Any) -> Any:
    return Field(default, description=description, examples=[example], **limits)


_LABEL = f"a text of 1 to {LONGEST_LABEL} characters on one line"
_WEIGHT = f"a number from 0 to {MAX_WEIGHT:.0f}"
_SIZE = f"a number from {SMALLEST:g} to {LARGEST:.0f} (m)"
_SPEED = f"a number from {SLOWEST:g} to {FASTEST:g} (m/s)"
_REPEAT = '"loop" or "back-and-forth"'
# and what is wanted in it, in that, ...
_POINT = ("a point [x, y] in metres", f"a number from {-FARTHEST:.0f} to {FARTHEST:.0f} (m)")
_RING = ("a list of at least 3 points [x, y]", *_POINT)
_LINE = ("a list of at least 2 points [x, y]", *_POINT)
_PLACES = ("a list of at least 1 point [x, y]", *_POINT)
_MATRIX = ("[[xx, xy], [xy, yy]] in m²", "two numbers", "a number from -1e8 to 1e8 (m²)")
# examples
_CORNERS = [[1, 1], [2, 1], [2, 3]]
_YARDS = [[[1.4, 1.2], [1.8, 1.2], [1.8, 2]]]
_PATH = {"points": [[2, 1], [8, 1]], "speed": 0.5}
_HOT_SPOT = {"center": [7.5, 3], "sigma": 1.5, "weight": 4}
_WALL = {"kind": "wall", "points": [[5, 0], [5, 2.4]], "width": 0.1}
_STARTS = {"corner": {"kind": "disc", "center": [1, 1], "radius": 0.8}}
_DENSITY = {"kind": "gaussians", "floor": 0.2, "peaks": [_HOT_SPOT]}


class _Key(NamedTuple):
    """Expected value of a key, with the words of messages for it, for its items, for their items, ..."""

    type: Any
    description: str
    example: Any
    wanted: tuple[str, ...]


_KEYS = {
    "name": _Key(Label, "What it is, for people", "desk", (_LABEL,)),
    "center": _Key(Vertex, "The centre [x, y] in metres", [7.5, 3], _POINT),
    "radius": _Key(Size, "The radius in metres", 0.5, (_SIZE,)),
    "sigma": _Key(Size, "The standard deviation in metres, where it is round", 1.5, (_SIZE,)),
    "covariance": _Key(Matrix, "The covariance in m², where it is not", [[2, 0.5], [0.5, 1]], _MATRIX),
    "vertices": _Key(VertexRing, "Corners in order, either way, the first not repeated", _CORNERS, _RING),
    "holes": _Key(
        list[VertexRing], "Rings inside that are not part of it", _YARDS, ("a list of rings", *_RING)
    ),
    "points": _Key(Line, "The line, from end to end; a path's begins where the obstacle is", _CORNERS, _LINE),
    "width": _Key(Size, "The width in metres", 0.1, (_SIZE,)),
    "speed": _Key(Speed, "Metres a second", 0.5, (_SPEED,)),
    "repeat": _Key(Repeat, "From the end straight to the first point, or back", "loop", (_REPEAT,)),
    "positions": _Key(Places, "One [x, y] a robot, in metres", [[1, 1], [1.5, 1]], _PLACES),
    "weight": _Key(Weight, "How much a place counts; of a peak, what it adds at its centre", 4, (_WEIGHT,)),
    "floor": _Key(Weight, "What every place counts without the peaks", 0.2, (_WEIGHT,)),
    "background": _Key(Weight, "What a place outside all areas counts", 1, (_WEIGHT,)),
}


def _model(thing: Any, kind: str | None = None) -> type[Model]:
    """Return the model of a class of such keys; those with a default may be left out."""
    defaults = {field.name: field.default for field in fields(thing)}
    members: dict[str, Any] = {}
    if kind:
        members["kind"] = Literal[kind], _field("Which kind it is; the other keys follow from it", kind)
    for name, key in _KEYS.items():
        if name in defaults:
            default = ... if defaults[name] is MISSING else defaults[name]
            content = key.type if default is not None else key.type | None
            members[name] = content, _field(key.description, key.example, default)
    doc = str(thing.__doc__).partition("\n")[0]
    model = create_model(thing.__name__, __base__=Model, __doc__=doc, **members)
    model.stands_for = thing
    return model


_PARTS = {
    "path": _model(environment.ObstaclePath),
    "peaks": _model(density.Gaussian),
    "areas": _model(density.WeightedArea),
}
"""Objects at these keys, or in their lists."""


def _list_of(name: str, description: str, example: object) -> _Key:
    model: Any = _PARTS[name]
    content = Annotated[list[model], Field(max_length=_MOST)]
    return _Key(content, description, [example], (f"a list of at most {_MOST} {name}", "an object"))


_KEYS |= {
    "path": _Key(
        _PARTS["path"], "How it moves; without, it stands", _PATH, ("an object with points and speed",)
    ),
    "peaks": _list_of("peaks", "The hot spots, which add up", _HOT_SPOT),
    "areas": _list_of("areas", "The polygons, the later ones on top", {"vertices": _CORNERS, "weight": 5}),
}


class RasterModel(Model, title="raster density"):
    """A picture of the density, in rows of numbers or in a file."""

    kind: Literal["raster"] = _field("Which kind it is; the other keys follow from it", "raster")
    extent: Extent | None = _field(
        "What it covers, [x_min, y_min, x_max, y_max] in m; the boundary's box by default",
        [0, 0, 10, 6],
        None,
    )
    interpolation: Interpolation = _field(
        "bilinear between the cells' middles, or constant in each of the cells", "bilinear", "bilinear"
    )
    rows: Rows | None = _field("Rows of numbers, the top one first", [[1, 1, 2], [1, 4, 2]], None)
    picture: FileName | None = _field(
        "In place of rows, a grey PNG or PGM, relative to the map and in its folder", "density.png", None
    )
    black: Weight | None = _field("What black counts; 0 by default", 0.1, None)
    white: Weight | None = _field("What white counts; 1 by default", 5, None)


_KINDS: dict[str, dict[str, Any]] = {
    "obstacles": {
        "polygon": environment.PolygonObstacle,
        "circle": environment.CircleObstacle,
        "wall": environment.WallObstacle,
    },
    "starts": {
        "disc": environment.DiscStart,
        "uniform": environment.UniformStart,
        "points": environment.PointsStart,
    },
    "density": {
        "uniform": density.Uniform,
        "gaussians": density.Gaussians,
        "polygons": density.WeightedPolygons,
    },
}
_CHOICES = {
    key: {kind: _model(thing, kind) for kind, thing in things.items()} for key, things in _KINDS.items()
}
_CHOICES["density"]["raster"] = RasterModel
_MODELS = {model.stands_for: model for model in Model.__subclasses__() if model.stands_for}


def _one_of(key: str, description: str) -> Any:
    models = tuple(_CHOICES[key].values())
    return Annotated[Union[models], Field(discriminator="kind", description=description)]  # noqa: UP007


ObstacleModel: Any = _one_of("obstacles", "An obstacle")
StartModel: Any = _one_of("starts", "Where a team may start")
DensityModel: Any = _one_of("density", "How much each place counts")


class MapModel(Model, title="robocov map"):
    """A map of robocov: the outer boundary, obstacles, and named starts of the robots, in metres."""

    schema_: Text | None = _field("Where this schema is, for editors", "./map.json", None, alias="$schema")
    format: Literal["robocov-map"] = _field("Says what this file is", FORMAT)
    version: Literal[1] = _field("Version of the format", VERSION)
    name: Label = _field("The map's name, for people", "Two rooms")
    description: Sentence = _field("A sentence about it", "A wall with one door.", "")
    boundary: VertexRing = _field(
        "The outer boundary, convex or not; robots know its convex hull", [[0, 0], [10, 0], [10, 6], [0, 6]]
    )
    obstacles: list[ObstacleModel] = _field("They may overlap, touch, and stick out", [_WALL], [])
    starts: dict[Label, StartModel] = _field("Named starts; the first is the default", _STARTS, {})
    density: DensityModel | None = _field("How much places count, by default the same", _DENSITY, None)
    extra: dict[str, Any] = _field("Free keys of yours; kept untouched", {"author": "Ada"}, {})


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


def build_map_schema() -> dict[str, Any]:
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
    """Return `document` as a model; the `MapError` tells of mistakes in structure and density."""
    check_header(document, where, FORMAT, VERSION)
    try:
        model = MapModel.model_validate(document)
    except ValidationError as error:
        raise refused(error, where, _mistake) from None
    mistakes = _raster_mistakes if isinstance(model.density, RasterModel) else _weight_mistakes
    if model.density is not None and (found := list(mistakes(model.density))):
        raise MapError.from_mistakes(where, found)
    return model


# what is wanted at some keys, in their items, in their items, ...
_WANTED = {name: key.wanted for name, key in _KEYS.items()} | {
    "boundary": _RING,
    "description": ("a text of at most 10000 characters",),
    "extra": ("an object",),
    "$schema": ("a text",),
    "obstacles": ("a list of obstacles",),
    "starts": ("an object of named starts",),
    "extent": ("[x_min, y_min, x_max, y_max] in metres", _POINT[1]),
    "interpolation": ("bilinear or cells",),
    "rows": (f"a list of 1 to {MAX_RASTER_SIZE} rows", f"a list of 1 to {MAX_RASTER_SIZE} numbers", _WEIGHT),
    "picture": ("the name of a file",),
    **dict.fromkeys(("black", "white"), (_WEIGHT,)),
}


def _mistake(detail: ErrorDetails) -> Mistake:
    """Return one structural error in the project's words: place, value, what was wanted."""
    loc, value = list(detail["loc"]), detail["input"]
    if loc[0] == "starts" and loc[2:] == ["[key]"]:
        text = f"starts: name {quote_json(value)}, but {_LABEL} was wanted"
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
        at = f"{format_path(parent)}: " if parent else ""
        return Mistake(tuple(loc), f"{at}{describe_unknown_name('key', str(key), known)}", at_key=True)
    found = "missing" if detail["type"] == "missing" else quote_json(value)
    steps = [k for k, step in enumerate(loc) if isinstance(step, str)]
    wanted = _WANTED[str(loc[steps[-1]])][len(loc) - 1 - steps[-1]]
    return Mistake.at_path(tuple(loc), f"{found}, but {wanted} was wanted")


def _kind_mistake(path: tuple[str | int, ...], value: object, kinds: list[str]) -> Mistake:
    """Return what is wrong with an obstacle, a start or a density whose kind is not known."""
    wanted = f"one of {', '.join(kinds)}"
    if not isinstance(value, dict):
        return Mistake.at_path(path, f"{quote_json(value)}, but an object whose kind is {wanted} was wanted")
    path = (*path, "kind")
    if "kind" not in value:
        return Mistake.at_path(path, f"missing, but {wanted} was wanted")
    near = get_close_matches(str(value["kind"]).lower(), kinds, n=1, cutoff=0.5)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    return Mistake.at_path(path, f"{quote_json(value['kind'])}, but {wanted} was wanted{hint}")


def _not_one_of(model: Model, one: str, other: str) -> str | None:
    """Return what is wrong where not exactly one of two keys is given."""
    given = [getattr(model, key) is not None for key in (one, other)]
    if sum(given) == 1:
        return None
    return f"{'both' if all(given) else 'neither'} of {one} and {other}, but one of them was wanted"


def _weight_mistakes(model: DensityModel) -> Iterator[Mistake]:
    peaks, areas = (getattr(model, key, []) for key in ("peaks", "areas"))
    for k, peak in enumerate(peaks):
        at: JsonPath = ("density", "peaks", k)
        if what := _not_one_of(peak, "sigma", "covariance"):
            yield Mistake.at_path(at, what)
        elif peak.covariance is not None:
            (a, b), (c, d) = peak.covariance
            smaller_eigenvalue = 0.5 * (a + d) - math.hypot(0.5 * (a - d), b)
            if b != c or not smaller_eigenvalue >= SMALLEST**2 or a * d - b * c <= 1e-9 * a * d:
                wanted = f"positive definite matrix of at least ({SMALLEST * 1000:g} mm)² each way"
                what = f"{quote_json(peak.covariance)}, but a symmetric, {wanted} was wanted"
                yield Mistake.at_path((*at, "covariance"), what)
    if not getattr(model, _BASES[model.kind]) and not any(part.weight for part in (*peaks, *areas)):
        yield Mistake.at_path(("density", "weight") if model.kind == "uniform" else ("density",), NOTHING)


def _raster_mistakes(model: RasterModel) -> Iterator[Mistake]:
    if what := _not_one_of(model, "rows", "picture"):
        yield Mistake.at_path(("density",), what)
        return
    if model.extent is not None:
        x_min, y_min, x_max, y_max = model.extent
        sides = x_max - x_min, y_max - y_min
        if not (min(sides) >= SMALLEST and max(sides) <= LARGEST):
            wanted = f"[x_min, y_min, x_max, y_max] with sides from {SMALLEST:g} to {LARGEST:.0f} m"
            yield Mistake.at_path(
                ("density", "extent"), f"{quote_json(model.extent)}, but {wanted} was wanted"
            )
    if model.rows is not None:
        for name in ("black", "white"):
            if getattr(model, name) is not None:
                yield Mistake.at_path(("density", name), "is for a picture, but there are rows of numbers")
        widths = [len(row) for row in model.rows]
        for k, width in enumerate(widths):
            if width != widths[0]:
                what = f"{width} numbers, but {widths[0]}, as in the first row, were wanted"
                yield Mistake.at_path(("density", "rows", k), what)
                return
        if not max(map(max, model.rows)) >= LIGHTEST:
            yield Mistake.at_path(("density", "rows"), NOTHING)
