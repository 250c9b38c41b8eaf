"""Types for annotations: arrays by the type of their elements, points and rings.

`help` and the handbook show these names in signatures, instead of the types that they stand for. The shape
and the unit of an array are documented where it is used.

Examples
--------
>>> from robocov.typing import FloatArray
>>> def compute_mean(values: FloatArray) -> float:
...     return float(values.mean())
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

FloatArray = TypeAliasType("FloatArray", NDArray[np.float64])
"""Array of floating-point numbers in double precision."""

IntArray = TypeAliasType("IntArray", NDArray[np.intp])
"""Array of whole numbers that count or index."""

BoolArray = TypeAliasType("BoolArray", NDArray[np.bool_])
"""Array of truth values, often a mask."""

Float32Array = TypeAliasType("Float32Array", NDArray[np.float32])
"""Array of floating-point numbers in single precision."""

Int32Array = TypeAliasType("Int32Array", NDArray[np.int32])
"""Array of whole numbers with 32 bits."""

AnyArray = TypeAliasType("AnyArray", NDArray[Any])
"""Array with elements of any type."""

Point: TypeAlias = tuple[float, float]
"""x and y, m."""

Ring: TypeAlias = tuple[Point, ...]
"""Points of a polyline, or of a closed ring, whose first point is not repeated."""
