"""Cells from clipping the region along the bisectors to all neighbors, one robot at a time."""

from robocov.compiled import inlined_kernel, kernel
from robocov.observation.neighbors import NeighborPositions
from robocov.typing import FloatArray
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
    points: FloatArray, sides: FloatArray, neighbors: NeighborPositions, cells: CellArrays
) -> int:
    """Compute all cells by clipping the region along the bisectors between each robot and its neighbors.

    Parameters
    ----------
    points : (n, 2) array, m
        The generators.
    sides : (k, 5) array
        The region, as `Region.sides`.
    neighbors : NeighborPositions
        The neighbors of each robot.
    cells : CellArrays
        Overwritten by the cells.

    Returns
    -------
    int
        Number of edges of all cells.
    """
    workspace = create_workspace(len(points), len(sides))
    edge_count = 0
    for i in range(len(points)):
        if neighbors.is_complete:
            neighbor_count = _add_all_robots(workspace, points, i)
        else:
            neighbor_count = _add_listed_neighbors(workspace, points, neighbors, i)
        vertex_range = clip_cell(workspace, neighbor_count, points, sides, i)
        edge_count = write_cell(workspace, vertex_range, points, i, cells, edge_count)
    return edge_count


@inlined_kernel
def _add_listed_neighbors(
    workspace: Workspace, points: FloatArray, neighbors: NeighborPositions, i: int
) -> int:
    """Add the neighbors of robot i to the workspace; return their number.

    If there are reports, the neighbors are at the positions that are known to the robot.
    """
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
def _add_all_robots(workspace: Workspace, points: FloatArray, i: int) -> int:
    """Add all other robots to the workspace as neighbors of robot i; return their number.

    Robot i itself, and any robot at the same position, is left out by `add_neighbor`.
    """
    neighbor_rows = workspace.neighbors
    count = 0
    for j in range(len(points)):
        dx = points[j, 0] - points[i, 0]
        dy = points[j, 1] - points[i, 1]
        count = add_neighbor(neighbor_rows, count, dx, dy, j)
    return count
