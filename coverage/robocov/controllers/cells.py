"""The cells that a law goes by: of the nearest robot, or of the one that is there first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robocov.controllers.gains import choice
from robocov.voronoi import partition
from robocov.voronoi.weighted_cells import weighted_partition

if TYPE_CHECKING:
    from robocov.observation import Observations
    from robocov.voronoi import VoronoiPartition
    from robocov.voronoi.delaunay import Mesh
    from robocov.voronoi.weighted_cells import WeightedCells


def choice_of_cells() -> Any:
    """Declare the gain that says by what the cells of a law are divided, as a dataclass field."""
    return choice(
        "distance",
        ("distance", "time"),
        "whose a place is: the nearest robot's, or the one's that is there first at its own largest speed",
    )


def cells_seen(seen: Observations, measure: str, warm: Mesh | None) -> VoronoiPartition | WeightedCells:
    """Return each robot's cell as it knows it.

    Parameters
    ----------
    seen : Observations
    measure : "distance" or "time"
        By time the cells are multiplicatively weighted, with the speeds that robots tell each other; where
        all are equally fast, or no speed is told, they are the same as by distance, bit for bit.
    warm : Mesh or None
        From which to start.
    """
    if measure == "time" and seen.max_speeds is not None:
        return weighted_partition(
            seen.positions,
            seen.max_speeds,
            seen.region,
            seen.neighbours,
            warm,
            heard=seen.reported_positions,
            density=seen.density,
        )
    return voronoi_cells(seen, warm)


def voronoi_cells(seen: Observations, warm: Mesh | None) -> VoronoiPartition:
    """Return each robot's cell of the places that are nearer to it, as it knows it."""
    return partition(
        seen.positions,
        seen.region,
        seen.neighbours,
        warm=warm,
        heard=seen.reported_positions,
        density=seen.density,
    )
