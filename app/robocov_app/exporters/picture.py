"""A picture in black and white, which says in a text chunk where it belongs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robocov.files.atomic import written
from robocov_app.exporters.cells import free_cells, grid_over, lost_passages, not_held
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions
from robocov_app.importers.picture import CHUNK, TITLE

if TYPE_CHECKING:
    from robocov.environment import Environment


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    from PIL import Image, PngImagePlugin

    grid = grid_over(environment, options.cell)
    free = free_cells(environment, grid)
    texts = PngImagePlugin.PngInfo()
    texts.add_text(TITLE, environment.name)
    texts.add_text(CHUNK, json.dumps({"cell_m": grid.cell, "origin_m": list(grid.origin)}))
    with written(path) as part:
        Image.fromarray(free[::-1]).save(part, format="PNG", pnginfo=texts)
    return ExportReport(
        "picture",
        (path,),
        environment.free_area,
        float(np.count_nonzero(free)) * grid.cell**2,
        dropped=not_held(environment),
        warnings=lost_passages(environment, grid, free),
    )


EXPORTER = Exporter(
    name="picture",
    title="picture: PNG in black and white, with its scale and place",
    suffixes=(".png",),
    write=_write,
    options=frozenset({"cell"}),
)
