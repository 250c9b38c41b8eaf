"""DXF drawings, read by ezdxf: closed outlines are areas, lines and arcs are walls."""

from __future__ import annotations

import logging
import re
from itertools import islice
from typing import TYPE_CHECKING, Any

from robocov.errors import MapError, RobocovError, one_line
from robocov.extras import extra
from robocov_app.importers import limits
from robocov_app.importers.dxf_drawing import DxfDrawing
from robocov_app.importers.enclosing import foreign_map
from robocov_app.importers.reading import Importer, ReadOptions
from robocov_app.importers.shapes import Shapes

if TYPE_CHECKING:
    from pathlib import Path

    from robocov_app.importers.foreign import ForeignMap

MOST_LINES = 8_000_000
"""Of text: a line of the drawing takes about 24, a vertex 4."""

MOST_ENTITIES = 50_000
"""In the file, on whatever layer: ezdxf takes an eighth of a millisecond and 5 kB for each."""

UNITS = {
    1: ("inches", 0.0254),
    2: ("feet", 0.3048),
    3: ("miles", 1609.344),
    4: ("millimetres", 0.001),
    5: ("centimetres", 0.01),
    6: ("metres", 1.0),
    7: ("kilometres", 1000.0),
    9: ("mils", 2.54e-5),
    10: ("yards", 0.9144),
    13: ("micrometres", 1e-6),
    14: ("decimetres", 0.1),
    15: ("decametres", 10.0),
    16: ("hectometres", 100.0),
    21: ("US survey feet", 1200 / 3937),
}
"""What the header's $INSUNITS stands for, with its metres."""

_BINARY = b"AutoCAD Binary DXF"
_TEXT = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:999[ \t]*\r?\n[^\n]*\n\s*)*0[ \t]*\r?\n[ \t]*SECTION\b")
_ENTITY = re.compile(rb"\n[ \t]*0[ \t]*\r?\n[ \t]*[A-Z]")
_POINT = re.compile(rb"\n[ \t]*10[ \t]*\r?\n")


def is_dxf(path: Path, head: bytes) -> bool:
    """Return whether a file that begins with `head` looks like DXF."""
    return head.startswith(_BINARY) or _TEXT.match(head) is not None


def read_dxf(path: Path, options: ReadOptions) -> ForeignMap:
    """Return the map that the model space of a DXF file draws.

    Closed outlines (polylines, circles, ellipses, closed splines, filled quadrilaterals) are solid, but for
    the boundary; lines, arcs and open polylines are walls as wide as they are drawn, or as the option
    ``thickness``. Names are those of layers and blocks: see `robocov_app.importers.enclosing.foreign_map`.
    Blocks are carried out wherever they are inserted. Layers that are off or frozen, texts, dimensions and
    what has a third dimension are left out; so are hatches without the option ``hatches``. Curves become
    lines that stay within a millimetre.

    Parameters
    ----------
    path : Path
    options : ReadOptions
        ``scale`` overrules the unit of the file's header; without either the file is refused.

    Raises
    ------
    MapError
        When the file cannot be read or understood, has no unit, or ezdxf is not installed.
    """
    where = one_line(path)
    _check(path, where)
    document = _document(path, where)
    code = document.header.get("$INSUNITS", 0)
    if options.scale is not None:
        unit, scale = f"a unit is {options.scale:g} m", options.scale
    elif code in UNITS:
        unit, scale = f"in {UNITS[code][0]}", UNITS[code][1]
    else:
        raise MapError(
            f"{where}: $INSUNITS: {code}, but a unit was wanted: --scale METRES says what it is, as in "
            f"--scale 0.001 for millimetres"
        )
    shapes = Shapes(where, options)
    drawing = DxfDrawing(document, where, shapes, scale)
    drawing.draw()
    shapes.join_lines()
    limits.require_shapes(len(shapes.lines) + len(shapes.outlines), where)
    return foreign_map(
        shapes,
        format=IMPORTER.name,
        name=one_line(path.stem)[:60] or "map",
        description="Imported from DXF.",
        solid=True,
        notes=[unit, *drawing.notes()],
    )


def _check(path: Path, where: str) -> None:
    """Refuse what would take long, before ezdxf sees it."""
    content = limits.content(path, limits.MAX_TEXT_BYTES)
    if not content.startswith(_BINARY):
        if not _TEXT.match(content):
            raise MapError(f"{where}: begins with {content[:20]!r}, but a DXF with sections was wanted")
        entities = sum(1 for _ in islice(_ENTITY.finditer(content), MOST_ENTITIES + 1))
        if entities > MOST_ENTITIES:
            raise MapError(f"{where}: more than {MOST_ENTITIES} entities, but fewer layers were wanted")
        points = islice(_POINT.finditer(content), limits.MAX_VERTICES + 1)
        limits.require_vertices(sum(1 for _ in points), where)
    lines = content.count(b"\n")
    if lines > MOST_LINES:
        raise MapError(f"{where}: {lines} lines, but at most {MOST_LINES} were wanted")


def _document(path: Path, where: str) -> Any:
    """Return the drawing as ezdxf has it; one with faults as far as it can be recovered."""
    try:
        ezdxf = extra("ezdxf", "dxf")
    except RobocovError as error:
        raise MapError(f"{where}: {error}") from None
    recover = extra("ezdxf.recover", "dxf")
    logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # what it notes is no answer of ours
    for read in (ezdxf.readfile, lambda file: recover.readfile(file)[0]):
        try:
            return read(path)
        except OSError as error:
            raise MapError(f"{where}: cannot be read: {error.strerror or error}") from None
        except Exception as error:  # it raises what it likes on nonsense
            reason = one_line(error) or type(error).__name__
    raise MapError(f"{where}: no DXF that can be read: {reason[:200]}")


IMPORTER = Importer(
    name="dxf",
    title="DXF drawings (with ezdxf): closed outlines, lines as walls, blocks",
    suffixes=(".dxf",),
    sniff=is_dxf,
    read=read_dxf,
    options=frozenset(
        {"scale", "thickness", "pillar", "outlines", "boundary", "around", "only", "skip", "hatches"}
    ),
)
