"""Recording of the previews on the start page; ``python -m robocov_app.viewer.start.recording`` writes them.

Run it after a change of a bundled map or of a controller in `RECORDED_RUNS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.mapfile import list_bundled_maps, load_map
from robocov.scenario import run as simulate
from robocov.typing import FloatArray, IntArray
from robocov_app.look.hues import MAX_OWN_HUES, choose_robot_hues
from robocov_app.viewer.start.previews import PREVIEW_FILE

N_FRAMES = 25
"""Number of recorded frames of a run."""
GRID_SITES = 72
"""Number of cells of the grid of owners along the longer side of the map."""
_CENTIMETERS = 100.0
_TOLERANCE_M = 0.02
"""Distance by which a simplified outline may differ from the obstacle."""


@dataclass(frozen=True)
class RecordedRun:
    """A run that is recorded for a preview.

    Attributes
    ----------
    name : str
        Name of the preview.
    map_name : str
        Bundled map.
    controller : str
    robots : int
    start : str or None
        Start of the map; None for its first one.
    duration : float, s
    """

    name: str
    map_name: str
    controller: str
    robots: int
    duration: float
    start: str | None = None


RECORDED_RUNS = (
    RecordedRun("rooms", "rooms", "rapf", robots=6, duration=45.0),
    RecordedRun("trap", "trap", "rapf", robots=6, duration=40.0),
    RecordedRun("city", "city", "rapf", robots=50, duration=60.0, start="uniform"),
    RecordedRun("compare-rapf", "blocks-a", "rapf", robots=6, duration=60.0),
    RecordedRun("compare-rpf", "blocks-a", "rpf", robots=6, duration=60.0),
    RecordedRun("compare-lloyd", "blocks-a", "lloyd", robots=6, duration=60.0),
    RecordedRun("lesson", "courtyard", "rapf", robots=6, duration=45.0),
)


def record_outline(environment: Environment) -> list[FloatArray]:
    """Return the boundary of a map and the rings of its free space, (k, 2) in m each.

    The rings are in the order in which they are drawn: the exterior of a component of the free space, then
    the obstacles in it, then the next smaller component.
    """
    outlines = [np.asarray(environment.boundary_polygon.exterior.coords)]
    for component in shapely.get_parts(environment.free):
        simple = shapely.simplify(component, _TOLERANCE_M)
        outlines.append(np.asarray(simple.exterior.coords))
        outlines += [np.asarray(ring.coords) for ring in simple.interiors]
    return outlines


def record_run(run: RecordedRun) -> dict[str, Any]:
    """Simulate a run; return its positions in cm, the owner of each cell of a grid, and its hues.

    Returns
    -------
    dict
        ``positions``, (frames, n, 2); ``owners``, (frames, rows, columns), with the first row at the top of
        the map; ``hues``, (n,).
    """
    environment = load_map(run.map_name)
    record = simulate(environment, run.controller, robots=run.robots, start=run.start, duration=run.duration)
    steps = np.linspace(0, len(record.positions) - 1, N_FRAMES).round().astype(int)
    positions = record.positions[steps]
    cost = CoverageCost(environment, GRID_SITES)
    owners = np.stack([_build_owner_grid(environment, cost(points)) for points in positions])
    return {
        "positions": (positions * _CENTIMETERS).round().astype(np.uint16),
        "owners": owners.astype(np.uint8),
        "hues": _choose_hues(owners, run.robots).astype(np.uint8),
    }


def _build_owner_grid(environment: Environment, result: Any) -> IntArray:
    """Return the robot that covers each cell of a grid, (rows, columns); obstacles get a neighbor's robot."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    spacing = max(high_x - low_x, high_y - low_y) / GRID_SITES
    columns = round((high_x - low_x) / spacing)
    rows = round((high_y - low_y) / spacing)
    grid = np.full((rows, columns), -1)
    column = ((result.points[:, 0] - low_x) / spacing).astype(int).clip(0, columns - 1)
    row = ((high_y - result.points[:, 1]) / spacing).astype(int).clip(0, rows - 1)
    grid[row, column] = result.owners
    nearest = distance_transform_edt(grid < 0, return_distances=False, return_indices=True)
    filled: IntArray = grid[tuple(nearest)]
    return filled


def _choose_hues(owners: IntArray, robots: int) -> IntArray:
    """Choose the hue of each robot so that cells that share an edge in the last frame differ if possible."""
    if robots <= MAX_OWN_HUES:
        return choose_robot_hues(robots)
    pairs: list[tuple[int, int]] = []
    for first, second in _list_neighbors(owners[-1]):
        pairs.append((min(first, second), max(first, second)))
    return choose_robot_hues(robots, np.array(sorted(set(pairs))))


def _list_neighbors(grid: IntArray) -> Sequence[tuple[int, int]]:
    """Return the owners of all adjacent cells of a grid that have different owners."""
    horizontal = np.column_stack([grid[:, 1:].ravel(), grid[:, :-1].ravel()])
    vertical = np.column_stack([grid[1:].ravel(), grid[:-1].ravel()])
    pairs = np.concatenate([horizontal, vertical])
    return [(int(first), int(second)) for first, second in pairs if first != second]


def record_previews() -> dict[str, FloatArray]:
    """Record all previews; return their arrays by the names under which they are stored."""
    arrays: dict[str, FloatArray] = {}
    for name in list_bundled_maps():
        for number, outline in enumerate(record_outline(load_map(name))):
            arrays[f"map/{name}/{number}"] = np.asarray(outline * _CENTIMETERS).round().astype(np.int16)
    for run in RECORDED_RUNS:
        for key, values in record_run(run).items():
            arrays[f"run/{run.name}/{key}"] = values
        arrays[f"run/{run.name}/map"] = np.array(run.map_name)
    return arrays


def main() -> None:
    """Write all previews."""
    arrays: Any = record_previews()
    np.savez_compressed(PREVIEW_FILE, allow_pickle=False, **arrays)


if __name__ == "__main__":
    main()
