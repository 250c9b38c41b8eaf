"""Cells that are clipped along the bisectors to all neighbors, one robot at a time."""

from robocov.arrays import Array
from robocov.compiled import inlined_kernel, kernel
from robocov.observation.neighbors import NeighborPositions
from robocov.voronoi.clipping import (
    CellArrays,
    Workspace,
    add_neighbor,
    clip_cell,
    create_workspace,
    write_cell,
)


@kernel
def compute_clipped_cells(
    points: Array, sides: Array, neighbors: NeighborPositions, cells: CellArrays
) -> int:
    """Compute all cells, each clipped along the bisectors to the neighbors of its robot.

    Parameters
    ----------
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    neighbors : NeighborPositions
    cells : CellArrays
        Changed in place.

    Returns
    -------
    int
        Number of edges.
    """
    workspace = create_workspace(len(points), len(sides))
    edge_count = 0
    for i in range(len(points)):
        if neighbors.is_complete:
            neighbor_count = _add_all_robots(workspace, points, i)
        else:
            neighbor_count = _add_listed_neighbors(workspace, points, neighbors, i)
        polygon = clip_cell(workspace, neighbor_count, points, sides, i)
        edge_count = write_cell(workspace, polygon, points, i, cells, edge_count)
    return edge_count


@inlined_kernel
def _add_listed_neighbors(workspace: Workspace, points: Array, neighbors: NeighborPositions, i: int) -> int:
    """Add the listed neighbors of robot i at their positions as known to it; return their number."""
    neighbor_rows = workspace.neighbors
    reported_positions = neighbors.positions
    count = 0
    for k in range(neighbors.indptr[i], neighbors.indptr[i + 1]):
        j = neighbors.indices[k]
        if neighbors.has_reports:
            dx = reported_positions[k, 0] - points[i, 0]
            dy = reported_positions[k, 1] - points[i, 1]
        else:
            dx = points[j, 0] - points[i, 0]
            dy = points[j, 1] - points[i, 1]
        count = add_neighbor(neighbor_rows, count, dx, dy, j)
    return count


@inlined_kernel
def _add_all_robots(workspace: Workspace, points: Array, i: int) -> int:
    """Add all robots as neighbors of robot i; return their number."""
    neighbor_rows = workspace.neighbors
    count = 0
    for j in range(len(points)):
        dx = points[j, 0] - points[i, 0]
        dy = points[j, 1] - points[i, 1]
        count = add_neighbor(neighbor_rows, count, dx, dy, j)
    return count
