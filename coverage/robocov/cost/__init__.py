"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a place."""

from __future__ import annotations

from robocov.cost.coverage import MAX_LATTICE, CoverageCost, CoverageResult

__all__ = ["MAX_LATTICE", "CoverageCost", "CoverageResult"]
