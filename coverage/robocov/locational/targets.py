"""What a robot heads for in its cell: the point from which the cell's locational cost (4) is best.

Of a convex cell with density 1 each of them is the best point of the whole cell, wherever the robot is (see
`best_points`). They are different aims nevertheless: centroid and median count how far away places
are, f = 1/(r²+h²) counts what is within a few h, and hardly anything beyond. In a cell that is large against
h, "sensing" gives up the far ends of the cell; for h well above the size of the cells it is the centroid.

Where nothing is in the way that hardly changes the coverage cost (22). Walls magnify it: a goal behind a wall
holds a robot in front of it when the goal's foot on the wall lies between the wall's ends, and where it lies
beyond one of them, the robot gets round. Centimetres between two targets then decide how a run ends, mostly
against "sensing" with h of a metre or less, whose goals differ most from the centroids.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov.errors import ParameterError, unknown_name
from robocov.locational.best_points import best_points, weighed_best_points
from robocov.locational.cost import Distance, Sensing

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.density import Density
    from robocov.observation.cells import Cells

TARGETS = ("centroid", "sensing", "median")
"""The optima for f = r², (12); f = 1/(r²+h²), (14); and f = r, by which the coverage cost (22) counts."""

MEANING = "what a robot heads for in its cell: the optimum for r², for 1/(r²+h²), or for r"
HEIGHT = "h of (14), for the target sensing: how high the sensor is; what is much farther counts little"


def targets(cells: Cells, density: Density | None, target: str, height: float) -> Array:
    """Return where each robot heads for, (n, 2) m: within its cell, if that is convex.

    An empty cell's is its generator.

    Parameters
    ----------
    cells : Cells
        With the density, if there is one.
    density : Density or None
        φ; None for 1 everywhere.
    target : one of `TARGETS`
    height : float, m
        h of equation (14), for "sensing".

    Raises
    ------
    ParameterError
        On another target, or a height that is not above 0.
    """
    if target == "centroid":
        return cells.centroid
    if target not in TARGETS:
        raise ParameterError(f"target: {unknown_name('target', target, TARGETS)}")
    f = Distance() if target == "median" else Sensing(height)
    if density is not None and not density.uniform:
        return weighed_best_points(cells, density, f)
    return best_points(cells, f)
