"""The kinds of values in a map JSON: lengths, points, rings, labels, weights."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

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

Coordinate: TypeAlias = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST, description="metres")
]
Size: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=SMALLEST, le=LARGEST)]
Vertex: TypeAlias = Annotated[list[Coordinate], Field(min_length=2, max_length=2, examples=[[1.5, 2]])]
VertexRing: TypeAlias = Annotated[list[Vertex], Field(min_length=3)]
Label: TypeAlias = Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_LABEL, pattern=_NAME)]

POINT = "a point [x, y] in metres"
COORDINATE = f"a number from {-FARTHEST:.0f} to {FARTHEST:.0f} (m)"
SIZE = f"a number from {SMALLEST:g} to {LARGEST:.0f} (m)"
RING = "a list of at least 3 points [x, y]"
LABEL = f"a text of 1 to {LONGEST_LABEL} characters on one line"


class Model(BaseModel):
    """An object of a map JSON: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", populate_by_name=False)


def kind_field(name: str) -> Any:
    """Return the field that says which kind of obstacle, start or density an object is."""
    return Field(description="Which kind it is; the other keys follow from it", examples=[name])
