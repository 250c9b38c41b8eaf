"""Cells of the robots, each computed from the knowledge of its robot."""

from typing import Any

from robocov.controllers.gains import choice
from robocov.observation import Observations
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time
from robocov.voronoi.delaunay import Mesh


def cells_choice() -> Any:
    """Declare the gain that decides how the region is divided into cells, as a dataclass field."""
    return choice(
        "distance",
        ("distance", "time"),
        "owner of a point: the nearest robot, or the first to reach it at its own speed",
    )


def compute_known_cells(
    seen: Observations, metric: str, triangulation: Mesh | None
) -> VoronoiPartition | WeightedCells:
    """Compute the cell of each robot from the positions that it knows.

    Parameters
    ----------
    seen : Observations
    metric : {"distance", "time"}
        Whether a point belongs to the nearest robot, or to the one that reaches it first. Cells by time are
        multiplicatively weighted by the maximum speeds. If all robots are equally fast, or no speeds are
        known, they equal the cells by distance, bit for bit.
    triangulation : (2, 8 n + 4) int32 array or None
        `Cells.triangulation` of the previous step, which saves time.

    Returns
    -------
    VoronoiPartition or WeightedCells
    """
    if metric == "time" and seen.max_speeds is not None:
        return partition_by_travel_time(
            seen.positions,
            seen.max_speeds,
            seen.region,
            neighbors=seen.neighbors,
            triangulation=triangulation,
            reported_positions=seen.reported_positions,
            density=seen.density,
        )
    return partition(
        seen.positions,
        seen.region,
        neighbors=seen.neighbors,
        triangulation=triangulation,
        reported_positions=seen.reported_positions,
        density=seen.density,
    )
