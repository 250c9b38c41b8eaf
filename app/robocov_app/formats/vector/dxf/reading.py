"""DXF drawings as maps.

Closed outlines (polylines, circles, ellipses, closed splines, filled quadrilaterals) are solid, except for
the boundary; lines, arcs and open polylines are walls with the width in the drawing, or with that of the
option ``thickness``. Shapes have the names of their layers and blocks: see `Shapes.build_foreign_map`. A
block is drawn at each position where it is inserted. Left out are layers that are off or frozen, texts,
dimensions, three-dimensional objects and, without the option ``hatches``, hatches. Curves become lines within
a millimeter of them. The unit is that of the header, unless the option ``scale`` is given.
"""

from pathlib import Path
from typing import Any

from robocov.errors import MapError, to_one_line
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.vector.dxf.document import load_document
from robocov_app.formats.vector.dxf.entity_reader import EntityReader

UNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 3: ("miles", 1609.344), 4: ("millimeters", 0.001),
    5: ("centimeters", 0.01), 6: ("meters", 1.0), 7: ("kilometers", 1000.0), 9: ("mils", 2.54e-5),
    10: ("yards", 0.9144), 13: ("micrometers", 1e-6), 14: ("decimeters", 0.1), 15: ("decameters", 10.0),
    16: ("hectometers", 100.0), 21: ("US survey feet", 1200 / 3937),
}  # fmt: skip
"""Names of units and their sizes in meters, keyed by their codes in the header ($INSUNITS)."""


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a drawing.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    source_name = to_one_line(path)
    document = load_document(path, source_name)
    scale, unit = _choose_scale(document, options.scale, source_name)
    shapes = Shapes(source_name, options)
    shapes.notes.append(unit)
    EntityReader(document, shapes, scale).add_all()
    shapes.join_lines()
    files.require_shapes(len(shapes.lines) + len(shapes.outlines), source_name)
    return shapes.build_foreign_map(files.get_map_name(path), "Imported from DXF.", solid=True)


def _choose_scale(document: Any, scale: float | None, source_name: str) -> tuple[float, str]:
    """Return the size of a unit in meters, and a note about it; raise MapError if it is unknown."""
    if scale is not None:
        return scale, f"a unit is {scale:g} m"
    code = document.header.get("$INSUNITS", 0)
    if code in UNITS:
        name, size = UNITS[code]
        return size, f"in {name}"
    hint = "--scale METERS gives it, as in --scale 0.001 for millimeters"
    raise MapError(f"{source_name}: $INSUNITS: expected a unit, got {code}: {hint}")
