"""Grids of the Moving AI Lab's benchmarks: https://movingai.com/benchmarks/formats.html."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robocov.files.atomic import written
from robocov_app.exporters.cells import free_cells, grid_over, lost_passages, not_held
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions

if TYPE_CHECKING:
    from robocov.environment import Environment


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    grid = grid_over(environment, options.cell)
    free = free_cells(environment, grid)
    letters = np.full((grid.rows, grid.columns + 1), ord("@"), np.uint8)
    letters[:, :-1][free[::-1]] = ord(".")
    letters[:, -1] = ord("\n")
    head = f"type octile\nheight {grid.rows}\nwidth {grid.columns}\nmap\n"
    with written(path) as part:
        part.write_bytes(head.encode("ascii") + letters.tobytes())
    x, y = grid.origin
    return ExportReport(
        "movingai",
        (path,),
        environment.free_area,
        float(np.count_nonzero(free)) * grid.cell**2,
        dropped=(
            f"the cell size, {grid.cell:g} m, and the lower left corner, [{x:g}, {y:g}]",
            *not_held(environment),
        ),
        warnings=lost_passages(environment, grid, free),
    )


EXPORTER = Exporter(
    name="movingai",
    title="MovingAI grid: .map",
    suffixes=(".map",),
    write=_write,
    options=frozenset({"cell"}),
)
