"""The array types that signatures use, and groups of entries in flat arrays."""

from __future__ import annotations

from robocov.arrays.types import Array, BoolArray, ComplexArray, IntArray, frozen

__all__ = ["Array", "BoolArray", "ComplexArray", "IntArray", "frozen"]
