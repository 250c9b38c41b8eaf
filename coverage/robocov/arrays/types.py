"""The array types that signatures use."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Floating point data; the docstring beside it gives shape and unit."""

IntArray: TypeAlias = NDArray[np.intp]
"""Indices."""

ComplexArray: TypeAlias = NDArray[np.complex128]
"""Plane vectors, x + i y."""

BoolArray: TypeAlias = NDArray[np.bool_]
"""Masks."""


def frozen(values: object) -> Array:
    """Return `values` as a read-only C-contiguous float array (a copy)."""
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array
