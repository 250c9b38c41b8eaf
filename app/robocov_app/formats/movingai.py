"""MovingAI benchmark grids.

A letter a cell: ``.`` and ``G`` are passable, ``S`` is swamp, passable too; ``@`` and ``O`` are out of
bounds, ``T`` is trees and ``W`` water, which are obstacles unless an option says otherwise.

N. R. Sturtevant, Benchmarks for grid-based pathfinding, IEEE Transactions on Computational Intelligence
and AI in Games 4 (2012), 144-148.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from robocov.environment import Environment
from robocov.errors import MapError, quote, to_one_line
from robocov.files.writing import replace_file
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.rasterize import build_grid, build_grid_report, find_free_cells
from robocov_app.formats.geometry.vectorize import BLOCKED, FREE, build_grid_map
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport

CELL = 1.0  # side of a cell in metres where none is given: the format has no unit
_PASSABLE, _SOLID = b".GS", b"@O"
_BAD = 255


def sniff(path: Path, head: bytes) -> bool:
    words = head.removeprefix(b"\xef\xbb\xbf").split(None, 3)
    return len(words) > 2 and words[0].lower() == b"type" and words[2].lower() in (b"height", b"width")


def read(path: Path, options: ReadOptions) -> ForeignMap:
    where = to_one_line(path)
    data = files.read_content(path, files.MAX_CELLS + files.HEAD_BYTES).removeprefix(b"\xef\xbb\xbf")
    columns, rows, body, line = _header(data, where)
    table = np.full(256, _BAD, np.uint8)
    table[list(_PASSABLE)] = FREE
    table[list(_SOLID)] = BLOCKED
    table[ord("T")] = FREE if options.trees == "free" else BLOCKED
    table[ord("W")] = FREE if options.water == "free" else BLOCKED
    lines = body.replace(b"\r\n", b"\n").split(b"\n", rows)
    for k in range(rows):
        found = len(lines[k].rstrip(b" \t\r")) if k < len(lines) else 0
        if found != columns:
            what = f"{found} letters" if k < len(lines) and (found or k < len(lines) - 1) else "end of file"
            raise MapError(f"{where}: line {line + k}: expected {columns} letters, got {what}")
    if len(lines) > rows and lines[rows].strip():
        raise MapError(f"{where}: line {line + rows}: expected {rows} rows, got more")
    joined = b"".join(lines[k].rstrip(b" \t\r") for k in range(rows))
    letters = np.frombuffer(joined, np.uint8).reshape(rows, columns)
    cells = table[letters]
    bad = cells == _BAD
    if bad.any():
        row, column = (int(k) for k in np.argwhere(bad)[0])
        place = f"{where}: line {line + row}, column {column + 1}"
        raise MapError(f"{place}: expected one of . G S @ O T W, got {quote(chr(letters[row, column]))}")
    cell = CELL if options.cell is None else options.cell
    notes = () if options.cell is not None else (f"no cell size was given: {CELL:g} m taken",)
    text = f"A grid of {cell:g} m a cell, imported from Moving AI's format."
    return build_grid_map(cells, where, path.stem, text, cell, notes=notes)


def _header(data: bytes, where: str) -> tuple[int, int, bytes, int]:
    """Return columns, rows, what comes after the header, and the line that it begins in, from 1."""
    sizes: dict[str, int] = {}
    at = 0
    for number in range(1, 20):
        end = data.find(b"\n", at, at + 200)
        words = data[at : end if end >= 0 else at + 200].decode("ascii", "replace").split()
        place = f"{where}: line {number}"
        at = end + 1 if end >= 0 else len(data)
        key = words[0].lower() if words else ""
        if key == "map" and len(words) == 1:
            for wanted in ("height", "width"):
                if wanted not in sizes:
                    raise MapError(f"{place}: expected {wanted} first")
            files.require_cells(sizes["width"], sizes["height"], where)
            return sizes["width"], sizes["height"], data[at:], number + 1
        if not words:
            continue
        if key == "type" and len(words) == 2:
            if words[1].lower() not in ("octile", "tile"):
                raise MapError(f"{place}: expected octile, got type {quote(words[1])}")
        elif key in ("height", "width") and len(words) == 2 and words[1].isascii() and words[1].isdigit():
            if len(words[1]) > 9:
                raise MapError(f"{place}: expected a smaller {key}, got {quote(words[1])}")
            sizes[key] = int(words[1])
        else:
            wanted = "expected type octile, height N, width N or map"
            raise MapError(f"{place}: {wanted}, got {quote(' '.join(words))}")
    raise MapError(f"{where}: expected a line map after type, height and width, got none")


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    letters = np.full((grid.rows, grid.columns + 1), ord("@"), np.uint8)
    letters[:, :-1][free[::-1]] = ord(".")
    letters[:, -1] = ord("\n")
    head = f"type octile\nheight {grid.rows}\nwidth {grid.columns}\nmap\n"
    with replace_file(path) as part:
        part.write_bytes(head.encode("ascii") + letters.tobytes())
    x, y = grid.origin
    place = f"the cell size, {grid.cell:g} m, and the lower left corner, [{x:g}, {y:g}]"
    report = build_grid_report("movingai", (path,), environment, grid, free)
    return replace(report, dropped=(place, *report.dropped))
