"""Well-known text: the free space as a polygon with holes, JuPedSim's walkable area."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov.files.atomic import written
from robocov_app.exporters.cells import not_held
from robocov_app.exporters.coordinates import DIGITS, decimal, free_on_grid, rings
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions

if TYPE_CHECKING:
    from pathlib import Path

    from shapely import Polygon

    from robocov.environment import Environment


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    digits = DIGITS if options.digits is None else options.digits
    free = free_on_grid(environment, digits)
    parts = [_text(part, digits) for part in free.geoms]
    text = f"POLYGON {parts[0]}" if len(parts) == 1 else f"MULTIPOLYGON ({', '.join(parts)})"
    with written(path) as part:
        part.write_text(text + "\n", encoding="ascii")
    notes = [f"in metres, {digits} decimals"]
    if len(parts) > 1:
        notes.append(f"the free space has {len(parts)} parts: some programs take one polygon only")
    return ExportReport(
        EXPORTER.name,
        (path,),
        environment.free_area,
        float(free.area),
        dropped=(
            *not_held(environment),
            "the boundary and the obstacles as such: only what is free is there",
        ),
        notes=tuple(notes),
    )


def _text(polygon: Polygon, digits: int) -> str:
    parts = (
        ", ".join(f"{decimal(x, digits)} {decimal(y, digits)}" for x, y in ring) for ring in rings(polygon)
    )
    return f"({', '.join(f'({part})' for part in parts)})"


EXPORTER = Exporter(
    name="wkt",
    title="well-known text (JuPedSim): the free space as polygons with holes",
    suffixes=(".wkt",),
    write=_write,
    options=frozenset({"digits"}),
)
