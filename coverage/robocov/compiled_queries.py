"""Compiled loops over the read-only queries of pymunk, which are faster than separate calls from Python.

A call of `pymunk.Space.point_query_nearest` or `pymunk.Space.segment_query_first` takes microseconds, mostly
to build the object for the result. The functions in this module call the same C functions of the pymunk
library in a compiled loop. This is the only module that uses a private interface of pymunk.

`is_usable` compares the results with those of the public queries. If they differ, `robocov.sensor` uses the
public queries. With the environment variable ``ROBOCOV_PUBLIC_QUERIES=1``, this module is never used.

Importing this module imports numba.
"""

from __future__ import annotations

import os
import platform
import sys
from typing import Any

import numpy as np
import pymunk
from llvmlite import ir
from pymunk._chipmunk_cffi import ffi, lib

from robocov.compiled import import_numba, kernel
from robocov.typing import BoolArray, FloatArray

numba = import_numba()

PUBLIC_QUERIES_VARIABLE = "ROBOCOV_PUBLIC_QUERIES"
"""Environment variable that selects pymunk's public queries."""

_PASSES_STRUCTS_IN_REGISTERS = sys.platform != "win32" and platform.machine() in (
    "x86_64",
    "aarch64",
    "arm64",
)
"""Whether C functions on this platform take a structure of two floats like two separate floats, and a filter
like two integers. The calls below rely on this."""
_POINT_INFO_FIELDS = {"shape": 0, "point": 8, "distance": 24, "gradient": 32}
"""Expected offsets, in bytes, of the fields of ``cpPointQueryInfo``, the result of a point query."""
_SEGMENT_INFO_FIELDS = {"shape": 0, "point": 8, "normal": 24, "alpha": 40}
"""Expected offsets, in bytes, of the fields of ``cpSegmentQueryInfo``, the result of a segment query."""
_INFO_SIZE = 6
"""Size of either structure as an array of floats of 8 bytes."""
_POINT_X = 1
_POINT_Y = 2
"""Indices of the coordinates of the point in a ``cpPointQueryInfo``."""
_ALPHA = 5
"""Index of the fraction of the segment in a ``cpSegmentQueryInfo``."""
_RAY_RADIUS_M = 0.0
"""Radius of a segment query, which makes it a ray."""
_NO_GROUP = 0
"""Group of a filter that belongs to no group."""
_ALL_CATEGORIES = -1
"""Categories and mask of a filter of all shapes: two integers of 32 bits, all set, as one integer of 64
bits."""


@numba.extending.intrinsic  # type: ignore[untyped-decorator]
def call_c_function(typing_context: Any, address: Any, arguments: Any) -> Any:
    """Call the C function at an address, with floats and integers as arguments.

    This is a numba intrinsic: when numba compiles a kernel with such a call, it calls this function with the
    types of the arguments, and receives a function that generates the code.

    Parameters
    ----------
    typing_context : numba typing context
        Not used.
    address : numba type
        Type of the address of the C function, an integer.
    arguments : numba type
        Type of the arguments of the C function, a tuple of floats and integers.

    Returns
    -------
    signature : numba signature
        Types of the call, which returns an integer.
    generate_code : callable
        Function that generates the code of the call.
    """
    argument_types = numba.types.Tuple([numba.types.unliteral(argument) for argument in arguments])
    signature = numba.types.intp(numba.types.intp, argument_types)

    def generate_code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        argument_values = [builder.extract_value(values[1], k) for k in range(len(argument_types))]
        function_type = ir.FunctionType(ir.IntType(64), [value.type for value in argument_values])
        function = builder.inttoptr(values[0], function_type.as_pointer())
        return builder.call(function, argument_values)

    return signature, generate_code


def is_usable() -> bool:
    """Return whether the compiled queries give the same results as the public queries on this machine.

    Both are called for a point and a ray near a triangle, and their results are compared.

    Returns
    -------
    bool
        False also if the user or the platform excludes the compiled queries.
    """
    if os.environ.get(PUBLIC_QUERIES_VARIABLE, "0") not in ("", "0"):
        return False
    if not _PASSES_STRUCTS_IN_REGISTERS:
        return False
    if _read_offsets("cpPointQueryInfo") != _POINT_INFO_FIELDS:
        return False
    if _read_offsets("cpSegmentQueryInfo") != _SEGMENT_INFO_FIELDS:
        return False
    space = pymunk.Space()
    space.add(pymunk.Poly(space.static_body, [(1.0, 0.0), (2.0, 0.25), (1.5, 1.0)]))
    position = (0.25, 0.5)
    nearest = space.point_query_nearest(position, 10.0, pymunk.ShapeFilter())
    hit = space.segment_query_first(position, (3.0, 0.5), 0.0, pymunk.ShapeFilter())
    positions = np.array([position])
    points = find_nearest_points(space, positions, np.array([10.0]))
    fractions, is_hit = cast_rays(space, positions, np.array([[[3.0, 0.5], [-3.0, 0.5]]]))
    return (
        nearest is not None
        and hit is not None
        and tuple(points[0].tolist()) == tuple(nearest.point)
        and is_hit.tolist() == [[True, False]]
        and float(fractions[0, 0]) == hit.alpha
    )


def find_nearest_points(space: pymunk.Space, positions: FloatArray, ranges: FloatArray) -> FloatArray:
    """Find the nearest point of any shape for each position, as `pymunk.Space.point_query_nearest` does.

    Parameters
    ----------
    space : pymunk.Space
        Space with the shapes.
    positions : (n, 2) array, m
        Positions of the queries.
    ranges : (n,) array, m
        Maximum distance of each point from its position, which must be finite.

    Returns
    -------
    (n, 2) array, m
        Nearest points; nan if no shape is within the range.
    """
    points = np.empty((len(positions), 2))
    _find_nearest_points(_get_address(space._space), _POINT_QUERY, positions, ranges, points)
    return points


def cast_rays(space: pymunk.Space, positions: FloatArray, ends: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Cast rays from each position, as `pymunk.Space.segment_query_first` does.

    Parameters
    ----------
    space : pymunk.Space
        Space with the shapes.
    positions : (n, 2) array, m
        Start of the rays of each row.
    ends : (n, rays, 2) array, m
        End of each ray.

    Returns
    -------
    fractions : (n, rays) array
        Fraction of each ray up to the first shape; 1 if it meets no shape.
    is_hit : (n, rays) bool array
        Whether each ray meets a shape.
    """
    fractions = np.ones(ends.shape[:2])
    is_hit = np.zeros(ends.shape[:2], dtype=np.bool_)
    _cast_rays(_get_address(space._space), _SEGMENT_QUERY, positions, ends, fractions, is_hit)
    return fractions, is_hit


def _get_address(pointer: Any) -> int:
    """Return the address of a C pointer."""
    return int(ffi.cast("intptr_t", pointer))


def _read_offsets(structure: str) -> dict[str, int]:
    """Return the offsets of the fields of a C structure, in bytes."""
    return {name: field.offset for name, field in ffi.typeof(structure).fields}


_POINT_QUERY = _get_address(ffi.addressof(lib, "cpSpacePointQueryNearest"))
_SEGMENT_QUERY = _get_address(ffi.addressof(lib, "cpSpaceSegmentQueryFirst"))
"""Addresses of the C functions."""


@kernel
def _find_nearest_points(
    space: int, query: int, positions: FloatArray, ranges: FloatArray, points: FloatArray
) -> None:
    """Write the nearest point to each position to `points`; see `find_nearest_points`.

    `space` and `query` are the addresses of the space and of the C function.
    """
    # The memory of a cpPointQueryInfo.
    info = np.empty(_INFO_SIZE)
    for i in range(len(positions)):
        arguments = (
            space,
            positions[i, 0],
            positions[i, 1],
            ranges[i],
            _NO_GROUP,
            _ALL_CATEGORIES,
            info.ctypes.data,
        )
        if call_c_function(query, arguments):
            points[i, 0] = info[_POINT_X]
            points[i, 1] = info[_POINT_Y]
        else:
            points[i, 0] = np.nan
            points[i, 1] = np.nan


@kernel
def _cast_rays(
    space: int, query: int, positions: FloatArray, ends: FloatArray, fractions: FloatArray, is_hit: BoolArray
) -> None:
    """Write the results of rays that meet a shape to `fractions` and `is_hit`; see `cast_rays`.

    `space` and `query` are the addresses of the space and of the C function.
    """
    # The memory of a cpSegmentQueryInfo.
    info = np.empty(_INFO_SIZE)
    for i in range(len(positions)):
        for ray in range(ends.shape[1]):
            arguments = (
                space,
                positions[i, 0],
                positions[i, 1],
                ends[i, ray, 0],
                ends[i, ray, 1],
                _RAY_RADIUS_M,
                _NO_GROUP,
                _ALL_CATEGORIES,
                info.ctypes.data,
            )
            if call_c_function(query, arguments):
                fractions[i, ray] = info[_ALPHA]
                is_hit[i, ray] = True
