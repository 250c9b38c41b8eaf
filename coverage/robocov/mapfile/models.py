"""Pydantic models of the map JSON, version 1, and its JSON Schema.

The models of obstacles, starts and densities are built from the fields of the classes that they describe,
such as `CircleObstacle`, and from the table `KEYS`.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, TypeAlias, Union, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, create_model, model_validator

from robocov import density, environment
from robocov.density import MAX_RASTER_SIZE, MAX_WEIGHT, Interpolation
from robocov.environment import Repeat

FORMAT = "robocov-map"
VERSION = 1
HEADER: Mapping[str, Any] = {"format": FORMAT, "version": VERSION}
"""First keys of every map file."""
MIN_SPEED_M_S = 1e-3
MAX_SPEED_M_S = 10.0
"""Minimum and maximum speed of an obstacle."""
MIN_SIZE_M = 1e-3
MAX_SIZE_M = 1e4
"""Minimum and maximum length or extent."""
MAX_COORDINATE_M = 1e7
"""Maximum absolute value of a coordinate: large enough for the coordinates of national grids, and small
enough to distinguish micrometers."""
MIN_WEIGHT = 1e-9
"""Minimum weight above 0. Smaller weights are read as 0, because they would be written as 0."""
MAX_LABEL_CHARACTERS = 100
"""Maximum number of characters of a name."""
MAX_DESCRIPTION_CHARACTERS = 10_000
"""Maximum number of characters of the description of a map."""
_MAX_FILE_NAME_CHARACTERS = 500
"""Maximum number of characters of the path of an image."""
_MAX_VARIANCE_M2 = 1e8
"""Maximum absolute value in a covariance matrix."""
_MIN_COORDINATE_M = 1e-100
"""Minimum absolute value of a coordinate. Smaller coordinates are read as 0, because quotients of such
numbers overflow."""
_MAX_FEATURES = 10_000
"""Maximum number of peaks or areas of a density."""
_MAX_INTEGER_FLOAT = 1e15
"""Value below which whole floats are written as integers. Larger floats would have many digits as
integers."""
_LABEL_PATTERN = r"^[^\x00-\x1f\x7f]+$"
"""Pattern of a name: no control characters, and so no line breaks."""


def _limit_number(minimum: float, maximum: float, description: str | None = None) -> Any:
    """Build the field of a number in a range."""
    return Field(strict=True, allow_inf_nan=False, ge=minimum, le=maximum, description=description)


Coordinate: TypeAlias = Annotated[
    float,
    _limit_number(-MAX_COORDINATE_M, MAX_COORDINATE_M, "meters"),
    AfterValidator(lambda value: 0.0 if -_MIN_COORDINATE_M < value < _MIN_COORDINATE_M else value),
]
Size: TypeAlias = Annotated[float, _limit_number(MIN_SIZE_M, MAX_SIZE_M)]
Speed: TypeAlias = Annotated[float, _limit_number(MIN_SPEED_M_S, MAX_SPEED_M_S)]
Vertex: TypeAlias = Annotated[
    list[Coordinate], Field(min_length=2, max_length=2, examples=[[1.5, 2]]), AfterValidator(tuple)
]
VertexRing: TypeAlias = Annotated[list[Vertex], Field(min_length=3), AfterValidator(tuple)]
Text: TypeAlias = Annotated[str, Field(strict=True)]
Description: TypeAlias = Annotated[Text, Field(max_length=MAX_DESCRIPTION_CHARACTERS)]
FileName: TypeAlias = Annotated[Text, Field(min_length=1, max_length=_MAX_FILE_NAME_CHARACTERS)]
Label: TypeAlias = Annotated[
    str, Field(strict=True, min_length=1, max_length=MAX_LABEL_CHARACTERS, pattern=_LABEL_PATTERN)
]
RasterValue: TypeAlias = Annotated[float, _limit_number(0.0, MAX_WEIGHT)]
Weight: TypeAlias = Annotated[
    RasterValue, AfterValidator(lambda weight: weight if weight >= MIN_WEIGHT else 0.0)
]
Line: TypeAlias = Annotated[list[Vertex], Field(min_length=2)]
Positions: TypeAlias = Annotated[list[Vertex], Field(min_length=1)]
Row: TypeAlias = Annotated[list[RasterValue], Field(min_length=1, max_length=MAX_RASTER_SIZE)]
Rows: TypeAlias = Annotated[list[Row], Field(min_length=1, max_length=MAX_RASTER_SIZE)]
Extent: TypeAlias = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
Variance: TypeAlias = Annotated[float, _limit_number(-_MAX_VARIANCE_M2, _MAX_VARIANCE_M2)]
Variances: TypeAlias = Annotated[list[Variance], Field(min_length=2, max_length=2)]
Matrix: TypeAlias = Annotated[list[Variances], Field(min_length=2, max_length=2)]


class Model(BaseModel):
    """Base class of models of JSON objects, in which unknown keys are errors.

    Attributes
    ----------
    described_class : type
        Class that the model describes. It has fields of the same names.
    """

    model_config = ConfigDict(extra="forbid", populate_by_name=False)

    described_class: ClassVar[Any] = None

    def build(self) -> Any:
        """Build an object of the described class.

        Returns
        -------
        object
            An obstacle, start or density, or part of one of these.
        """
        names = type(self).model_fields.keys() - {"kind"}
        return self.described_class(**{name: _build_value(getattr(self, name)) for name in names})


def _build_value(value: Any) -> Any:
    """Convert the value of a key: models to the objects that they describe, and lists to tuples."""
    if isinstance(value, Model):
        return value.build()
    if isinstance(value, list):
        return tuple(_build_value(item) for item in value)
    return value


def _build_field(description: str, example: Any, default: Any = ..., alias: str | None = None) -> Any:
    """Build a field with a description and an example for text editors."""
    return Field(default, description=description, examples=[example], alias=alias)


LABEL_EXPECTED = f"a string of 1 to {MAX_LABEL_CHARACTERS} characters on one line"
WEIGHT_EXPECTED = f"a number from 0 to {MAX_WEIGHT:.0f}"
_SIZE_EXPECTED = f"a number from {MIN_SIZE_M:g} to {MAX_SIZE_M:.0f} (m)"
_SPEED_EXPECTED = f"a number from {MIN_SPEED_M_S:g} to {MAX_SPEED_M_S:g} (m/s)"
COORDINATE_EXPECTED = f"a number from {-MAX_COORDINATE_M:.0f} to {MAX_COORDINATE_M:.0f} (m)"
# Each tuple describes an expected value, then its items if it is a list, then the items of these, and so on.
_POINT_EXPECTED = ("a point [x, y] in meters", COORDINATE_EXPECTED)
RING_EXPECTED = ("a list of at least 3 points [x, y]", *_POINT_EXPECTED)
_LINE_EXPECTED = ("a list of at least 2 points [x, y]", *_POINT_EXPECTED)
_POSITIONS_EXPECTED = ("a list of at least 1 point [x, y]", *_POINT_EXPECTED)
_MATRIX_EXPECTED = ("[[xx, xy], [xy, yy]] in m²", "two numbers", "a number from -1e8 to 1e8 (m²)")

_EXAMPLE_CORNERS = [[1, 1], [2, 1], [2, 3]]
_EXAMPLE_HOLES = [[[1.4, 1.2], [1.8, 1.2], [1.8, 2]]]
_EXAMPLE_PATH = {"points": [[2, 1], [8, 1]], "speed": 0.5}
_EXAMPLE_PEAK = {"center": [7.5, 3], "sigma": 1.5, "weight": 4}
_EXAMPLE_WALL = {"kind": "wall", "points": [[5, 0], [5, 2.4]], "width": 0.1}
_EXAMPLE_STARTS = {"corner": {"kind": "disc", "center": [1, 1], "radius": 0.8}}
_EXAMPLE_DENSITY = {"kind": "gaussians", "floor": 0.2, "peaks": [_EXAMPLE_PEAK]}


class KeySpecification(NamedTuple):
    """A key of the objects in a map.

    Attributes
    ----------
    type : object
        Type annotation of the value.
    description : str
        Description for text editors.
    example : object
        Example of a value, for text editors.
    expected : tuple of str
        Descriptions for messages: of the value, of its items if it is a list, of the items of these, and so
        on.
    """

    type: Any
    description: str
    example: Any
    expected: tuple[str, ...]


KEYS = {
    "name": KeySpecification(Label, "Displayed name", "desk", (LABEL_EXPECTED,)),
    "center": KeySpecification(Vertex, "Center [x, y] in meters", [7.5, 3], _POINT_EXPECTED),
    "radius": KeySpecification(Size, "Radius in meters", 0.5, (_SIZE_EXPECTED,)),
    "sigma": KeySpecification(Size, "Standard deviation of a round peak in meters", 1.5, (_SIZE_EXPECTED,)),
    "covariance": KeySpecification(
        Matrix, "Covariance of an elliptic peak in m²", [[2, 0.5], [0.5, 1]], _MATRIX_EXPECTED
    ),
    "vertices": KeySpecification(
        VertexRing,
        "Corners in either direction; the first is not repeated",
        _EXAMPLE_CORNERS,
        RING_EXPECTED,
    ),
    "holes": KeySpecification(
        list[VertexRing],
        "Outlines of the holes, inside the vertices",
        _EXAMPLE_HOLES,
        ("a list of rings", *RING_EXPECTED),
    ),
    "points": KeySpecification(
        Line,
        "Points of the line from end to end; a path starts at the position of its obstacle",
        _EXAMPLE_CORNERS,
        _LINE_EXPECTED,
    ),
    "width": KeySpecification(Size, "Width in meters", 0.1, (_SIZE_EXPECTED,)),
    "speed": KeySpecification(Speed, "Speed in meters per second", 0.5, (_SPEED_EXPECTED,)),
    "repeat": KeySpecification(
        Repeat,
        "From the end straight to the first point, or back along the path",
        "loop",
        ('"loop" or "back-and-forth"',),
    ),
    "positions": KeySpecification(
        Positions, "[x, y] of each robot in meters", [[1, 1], [1.5, 1]], _POSITIONS_EXPECTED
    ),
    "weight": KeySpecification(
        Weight, "Weight of the points; for a peak, the weight added at its center", 4, (WEIGHT_EXPECTED,)
    ),
    "floor": KeySpecification(Weight, "Weight of all points without the peaks", 0.2, (WEIGHT_EXPECTED,)),
    "background": KeySpecification(Weight, "Weight of the points outside all areas", 1, (WEIGHT_EXPECTED,)),
}
"""Keys of obstacles, starts and densities. Keys whose values are objects are added below."""


def _build_model(described_class: Any, kind: str | None = None) -> type[Model]:
    """Build the model of a class from the fields of the class that are in `KEYS`.

    Fields with a default are optional. `kind` is the value of an additional key, by which the model is
    chosen.
    """
    defaults = {field.name: field.default for field in fields(described_class)}
    members: dict[str, Any] = {}
    if kind is not None:
        members["kind"] = (Literal[kind], _build_field("Kind, which determines the other keys", kind))
    for name, key in KEYS.items():
        if name not in defaults:
            continue
        # For pydantic, a field with the default `...` is required.
        default = ... if defaults[name] is MISSING else defaults[name]
        annotation = key.type | None if default is None else key.type
        members[name] = (annotation, _build_field(key.description, key.example, default))
    summary = str(described_class.__doc__).partition("\n")[0]
    model = create_model(described_class.__name__, __base__=Model, __doc__=summary, **members)
    model.described_class = described_class
    return model


NESTED_MODELS = {
    "path": _build_model(environment.ObstaclePath),
    "peaks": _build_model(density.Gaussian),
    "areas": _build_model(density.WeightedArea),
}
"""Models of objects inside obstacles and densities, by the key of the object or of the list that contains
it."""


def _specify_list_key(name: str, description: str, example: object) -> KeySpecification:
    """Build the specification of a key whose value is a list of objects."""
    model: Any = NESTED_MODELS[name]
    return KeySpecification(
        type=Annotated[list[model], Field(max_length=_MAX_FEATURES)],
        description=description,
        example=[example],
        expected=(f"a list of at most {_MAX_FEATURES} {name}", "an object"),
    )


KEYS["path"] = KeySpecification(
    NESTED_MODELS["path"],
    "Movement of the obstacle; none by default",
    _EXAMPLE_PATH,
    ("an object with points and speed",),
)
KEYS["peaks"] = _specify_list_key("peaks", "Peaks, which are added up", _EXAMPLE_PEAK)
KEYS["areas"] = _specify_list_key(
    "areas", "Polygons, the later ones on top", {"vertices": _EXAMPLE_CORNERS, "weight": 5}
)


class RasterModel(Model, title="raster density"):
    """A density on a grid of cells, given by rows of numbers or by an image file."""

    kind: Literal["raster"] = _build_field("Kind, which determines the other keys", "raster")
    extent: Extent | None = _build_field(
        "Covered rectangle [x_min, y_min, x_max, y_max] in m; the bounding box of the boundary by default",
        [0, 0, 10, 6],
        None,
    )
    interpolation: Interpolation = _build_field(
        "Bilinear between the centers of the cells, or constant in each cell", "bilinear", "bilinear"
    )
    rows: Rows | None = _build_field("Rows of numbers, the top one first", [[1, 1, 2], [1, 4, 2]], None)
    image: FileName | None = _build_field(
        "Instead of rows, a gray PNG or PGM file in the folder of the map", "density.png", None
    )
    black: Weight | None = _build_field("Weight of black; 0 by default", 0.1, None)
    white: Weight | None = _build_field("Weight of white; 1 by default", 5, None)

    @model_validator(mode="before")
    @classmethod
    def _rename_picture(cls, content: Any) -> Any:
        """Rename the key ``picture`` to ``image``; files of earlier versions use the old name."""
        if not isinstance(content, dict) or "picture" not in content or "image" in content:
            return content
        return {"image" if key == "picture" else key: value for key, value in content.items()}


_CLASSES: dict[str, dict[str, Any]] = {
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
MODELS_BY_KIND = {
    key: {kind: _build_model(described_class, kind) for kind, described_class in classes.items()}
    for key, classes in _CLASSES.items()
}
"""Models of obstacles, starts and densities, by the key of the map and by their kind."""
MODELS_BY_KIND["density"]["raster"] = RasterModel
_MODELS_BY_CLASS = {
    model.described_class: model for model in Model.__subclasses__() if model.described_class is not None
}
"""Models by the class that they describe."""


def _build_union(key: str, description: str) -> Any:
    """Build the annotation of an object whose kind determines its model."""
    models = tuple(MODELS_BY_KIND[key].values())
    return Annotated[Union[models], Field(discriminator="kind", description=description)]  # noqa: UP007


ObstacleModel: Any = _build_union("obstacles", "An obstacle")
StartModel: Any = _build_union("starts", "A start of a team")
DensityModel: Any = _build_union("density", "The weights of the points of a map")


class MapModel(Model, title="robocov map"):
    """A map of robocov: the outer boundary, obstacles, and named starts of the robots, in meters."""

    schema_: Text | None = _build_field(
        "Address of the schema, for text editors", "./map.json", None, alias="$schema"
    )
    format: Literal["robocov-map"] = _build_field("Format of the file", FORMAT)
    version: Literal[1] = _build_field("Version of the format", VERSION)
    name: Label = _build_field("Displayed name of the map", "Two rooms")
    description: Description = _build_field("Description of the map", "A wall with one door.", "")
    boundary: VertexRing = _build_field(
        "Outer boundary, convex or not; robots know its convex hull", [[0, 0], [10, 0], [10, 6], [0, 6]]
    )
    obstacles: list[ObstacleModel] = _build_field(
        "Obstacles, which may overlap, touch, and extend beyond the boundary", [_EXAMPLE_WALL], []
    )
    starts: dict[Label, StartModel] = _build_field(
        "Named starts; the first is the default", _EXAMPLE_STARTS, {}
    )
    density: DensityModel | None = _build_field(
        "Weights of the points; all the same by default", _EXAMPLE_DENSITY, None
    )
    extra: dict[str, Any] = _build_field("Your own keys, which are preserved", {"author": "Ada"}, {})


def to_json_value(value: Any) -> Any:
    """Convert an obstacle, start or density, or a part of one of these, to a JSON value.

    Parameters
    ----------
    value : object
        An obstacle, start or density; or a number, a string, or a sequence of such values.

    Returns
    -------
    object
        JSON value. Whole numbers are integers. Keys with empty values are left out.

    Examples
    --------
    >>> to_json_value(environment.CircleObstacle((2.0, 1.5), 0.5))
    {'kind': 'circle', 'center': [2, 1.5], 'radius': 0.5}
    """
    if isinstance(value, (float, int, np.integer, np.floating)):
        number = float(value)
        return int(number) if number.is_integer() and abs(number) < _MAX_INTEGER_FLOAT else number
    if isinstance(value, str):
        return value
    if hasattr(value, "__iter__"):
        return [to_json_value(item) for item in value]
    document = {}
    model = next(_MODELS_BY_CLASS[base] for base in type(value).__mro__ if base in _MODELS_BY_CLASS)
    for key, field in model.model_fields.items():
        if key == "kind":
            # The kind is a constant of the model, such as Literal["circle"], not an attribute of the object.
            item = get_args(field.annotation)[0]
        else:
            item = getattr(value, key)
        if item not in (None, (), []) or field.is_required():
            document[key] = to_json_value(item)
    return document


def build_map_schema() -> dict[str, Any]:
    """Build the JSON Schema (2020-12) of map files, with descriptions and examples for text editors.

    Returns
    -------
    dict
        The schema as a JSON document.

    See Also
    --------
    load_map : Check a map file against the schema and further rules.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.build_map_schema()["required"]
    ['format', 'version', 'name', 'boundary']
    """
    schema = MapModel.model_json_schema(by_alias=True)
    # The schema of pydantic checks only starts whose names match the pattern, and accepts any other names.
    # This change checks all starts, and their names too.
    starts = schema["properties"]["starts"]
    ((pattern, start),) = starts.pop("patternProperties").items()
    starts["additionalProperties"] = start
    starts["propertyNames"] = {
        "type": "string",
        "pattern": pattern,
        "minLength": 1,
        "maxLength": MAX_LABEL_CHARACTERS,
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
