"""The coverage cost (22): the mean distance that the nearest robot must travel to reach a point.

`CoverageCost` computes a `CoverageResult` for the positions of a team; `TimeVaryingCost` does the same on
maps with moving obstacles. The cost is a mean over the `Sites` of a lattice (`lattice`). The kernels in
`corner_views` and `site_paths` find the nearest robot of each site.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from robocov.cost.coverage_cost import CoverageCost
from robocov.cost.lattice import MAX_LATTICE, Sites
from robocov.cost.result import CoverageResult
from robocov.cost.time_varying_cost import TimeVaryingCost

__all__ = [
    "MAX_LATTICE",
    "CoverageCost",
    "CoverageResult",
    "Sites",
    "TimeVaryingCost",
]
