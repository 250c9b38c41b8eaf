"""Writing the free cells of maps as black-and-white images."""

import json
from pathlib import Path

from robocov.environment import Environment
from robocov.files.writing import replace_file
from robocov_app.formats.geometry.cells.rasterize import build_grid, build_grid_report, find_free_cells
from robocov_app.formats.options import WriteOptions
from robocov_app.formats.raster.picture.reading import GEOREFERENCE_CHUNK, TITLE_CHUNK
from robocov_app.formats.reports import ExportReport


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write an environment as a black-and-white PNG, in which free cells are white.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from PIL import Image, PngImagePlugin

    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    texts = PngImagePlugin.PngInfo()
    texts.add_text(TITLE_CHUNK, environment.name)
    texts.add_text(GEOREFERENCE_CHUNK, json.dumps({"cell_m": grid.cell, "origin_m": list(grid.origin)}))
    with replace_file(path) as temporary:
        Image.fromarray(free[::-1]).save(temporary, format="PNG", pnginfo=texts)
    return build_grid_report("image", (path,), environment, grid, free)
