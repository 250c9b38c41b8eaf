"""Field types of session files, including fields whose values are represented differently in files."""

from collections.abc import Callable
from typing import Annotated, Any, TypeAlias

from pydantic import Field, GetPydanticSchema
from pydantic_core import PydanticCustomError, core_schema

MAX_TEXT_CHARS = 10_000
MAX_COORDINATE_M = 1e6
MAX_ROBOT_NUMBER = 1_000_000
MAX_STEP = 100_000_000

Text: TypeAlias = Annotated[str, Field(strict=True, max_length=MAX_TEXT_CHARS)]
Coordinate: TypeAlias = Annotated[
    float, Field(strict=True, ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M, allow_inf_nan=False)
]
Position: TypeAlias = Annotated[tuple[Coordinate, Coordinate], Field(description="[x, y] in meters")]
RobotNumber: TypeAlias = Annotated[
    int, Field(strict=True, ge=1, le=MAX_ROBOT_NUMBER, description="Number of a robot")
]
Step: TypeAlias = Annotated[
    int, Field(strict=True, ge=0, le=MAX_STEP, description="Control steps since time 0")
]


def convert_field(
    json_type: Any, load: Callable[[Any, Any], object], dump: Callable[[Any, Any], object]
) -> Any:
    """Build the annotation of a field whose value is represented differently in files.

    Parameters
    ----------
    json_type : type
        Type of the representation in files.
    load : callable
        Called with the validated representation and the file's context; returns the value.
    dump : callable
        Called with the value and the file's context; returns the representation.

    Returns
    -------
    GetPydanticSchema
        For use in `Annotated`.
    """

    def build_schema(_: object, handler: Any) -> Any:
        return core_schema.with_info_after_validator_function(
            lambda content, info: load(content, info.context),
            handler.generate_schema(json_type),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value, info: dump(value, info.context), info_arg=True
            ),
        )

    return GetPydanticSchema(build_schema)


def keep_none(convert: Callable[[Any, Any], object]) -> Callable[[Any, Any], object]:
    """Wrap a conversion for `convert_field` so that None is left unchanged."""

    def convert_unless_none(value: Any, context: Any) -> object:
        if value is None:
            return None
        return convert(value, context)

    return convert_unless_none


def build_refusal(error: object) -> PydanticCustomError:
    """Build the validation error for an unusable value, with the message of another error."""
    return PydanticCustomError("invalid", "{message}", {"message": str(error)})
