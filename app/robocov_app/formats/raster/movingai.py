"""MovingAI benchmark grids.

Each cell is a character: ``.``, ``G`` and ``S`` (swamp) are passable; ``@`` and ``O`` are out of bounds;
``T`` (trees) and ``W`` (water) are obstacles unless an option makes them free.

N. R. Sturtevant, Benchmarks for grid-based pathfinding, IEEE Transactions on Computational Intelligence
and AI in Games 4 (2012), 144-148.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocov.environment import Environment
from robocov.errors import MapError, quote, to_one_line
from robocov.files.writing import replace_file
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.cells.grid_map import BLOCKED, FREE, GridFrame, build_grid_map
from robocov_app.formats.geometry.cells.rasterize import build_grid, build_grid_report, find_free_cells
from robocov_app.formats.options import ReadOptions, WriteOptions, get_or_default
from robocov_app.formats.reports import ExportReport

DEFAULT_CELL_M = 1.0
"""Default side of a cell: files do not contain it."""
_PASSABLE_CHARACTERS = b".GS"
_SOLID_CHARACTERS = b"@O"
_UNKNOWN_CHARACTER = 255
"""Value in the table of characters for characters that are not part of the format."""
_BLANKS = b" \t\r"
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_MAX_HEADER_LINES = 19
_MAX_HEADER_LINE_BYTES = 200
_MAX_SIZE_DIGITS = 9


@dataclass(frozen=True)
class _Header:
    """The header of a grid.

    Attributes
    ----------
    columns, rows : int
    body : bytes
        The rows of cells, which follow the header.
    body_line : int
        Number of the first line of the body, from 1.
    """

    columns: int
    rows: int
    body: bytes
    body_line: int


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    words = head.removeprefix(_BYTE_ORDER_MARK).split(None, 3)
    return len(words) > 2 and words[0].lower() == b"type" and words[2].lower() in (b"height", b"width")


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a grid.

    Raises
    ------
    MapError
        If the header is incomplete, a row has the wrong length, or a character is unknown.
    """
    source_name = to_one_line(path)
    content = files.read_content(path, files.MAX_CELLS + files.HEAD_BYTES).removeprefix(_BYTE_ORDER_MARK)
    header = _parse_header(content, source_name)
    characters = _parse_rows(header, source_name)
    cells = _build_character_table(options)[characters]
    is_unknown = cells == _UNKNOWN_CHARACTER
    if is_unknown.any():
        row, column = np.argwhere(is_unknown)[0].tolist()
        location = f"{source_name}: line {header.body_line + row}, column {column + 1}"
        raise MapError(
            f"{location}: expected one of . G S @ O T W, got {quote(chr(characters[row, column]))}"
        )
    cell = get_or_default(options.cell, DEFAULT_CELL_M)
    notes: tuple[str, ...] = ()
    if options.cell is None:
        notes = (f"no cell size given; assuming {DEFAULT_CELL_M:g} m. Set it with --cell.",)
    return build_grid_map(
        cells,
        GridFrame(cell),
        source_name,
        name=path.stem,
        description=f"A grid with cells of {cell:g} m, imported from a MovingAI file.",
        notes=notes,
    )


def _build_character_table(options: ReadOptions) -> NDArray[np.uint8]:
    """Return a table, (256,), of the kind of cell that each character stands for."""
    table = np.full(256, _UNKNOWN_CHARACTER, np.uint8)
    table[list(_PASSABLE_CHARACTERS)] = FREE
    table[list(_SOLID_CHARACTERS)] = BLOCKED
    table[[ord("T"), ord("W")]] = BLOCKED
    if options.trees == "free":
        table[ord("T")] = FREE
    if options.water == "free":
        table[ord("W")] = FREE
    return table


def _parse_rows(header: _Header, source_name: str) -> NDArray[np.uint8]:
    """Return the characters of a grid, (rows, columns), the top row first."""
    rows = header.rows
    columns = header.columns
    lines = header.body.replace(b"\r\n", b"\n").split(b"\n", rows)
    for k in range(rows):
        width = 0
        if k < len(lines):
            width = len(lines[k].rstrip(_BLANKS))
        if width != columns:
            is_end = k >= len(lines) or (width == 0 and k == len(lines) - 1)
            actual = "end of file" if is_end else f"{width} characters"
            line = header.body_line + k
            raise MapError(f"{source_name}: line {line}: expected {columns} characters, got {actual}")
    if len(lines) > rows and lines[rows].strip():
        raise MapError(f"{source_name}: line {header.body_line + rows}: expected {rows} rows, got more")
    joined = b"".join(line.rstrip(_BLANKS) for line in lines[:rows])
    return np.frombuffer(joined, np.uint8).reshape(rows, columns)


def _parse_header(content: bytes, source_name: str) -> _Header:
    """Parse the header, which ends with the line ``map``."""
    sizes: dict[str, int] = {}
    at = 0
    for number in range(1, _MAX_HEADER_LINES + 1):
        limit = at + _MAX_HEADER_LINE_BYTES
        end = content.find(b"\n", at, limit)
        if end >= 0:
            line = content[at:end]
            at = end + 1
        else:
            line = content[at:limit]
            at = len(content)
        words = line.decode("ascii", "replace").split()
        location = f"{source_name}: line {number}"
        if not words:
            continue
        if len(words) == 1 and words[0].lower() == "map":
            for key in ("height", "width"):
                if key not in sizes:
                    raise MapError(f"{location}: expected {key} first")
            files.require_cells(sizes["width"], sizes["height"], source_name)
            return _Header(sizes["width"], sizes["height"], content[at:], number + 1)
        _parse_header_line(words, sizes, location)
    raise MapError(f"{source_name}: expected a line map after type, height and width, got none")


def _parse_header_line(words: list[str], sizes: dict[str, int], location: str) -> None:
    """Parse a line of the header; a height or width is added to `sizes`."""
    key = words[0].lower()
    value = words[1] if len(words) == 2 else ""
    if key == "type" and value:
        if value.lower() not in ("octile", "tile"):
            raise MapError(f"{location}: expected octile, got type {quote(value)}")
    elif key in ("height", "width") and value.isascii() and value.isdigit():
        if len(value) > _MAX_SIZE_DIGITS:
            raise MapError(f"{location}: expected a smaller {key}, got {quote(value)}")
        sizes[key] = int(value)
    else:
        expected = "expected type octile, height N, width N or map"
        raise MapError(f"{location}: {expected}, got {quote(' '.join(words))}")


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write an environment as a grid.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    # One more column for the line ends. The top row comes first in the file.
    characters = np.full((grid.rows, grid.columns + 1), ord("@"), np.uint8)
    characters[:, :-1][free[::-1]] = ord(".")
    characters[:, -1] = ord("\n")
    header = f"type octile\nheight {grid.rows}\nwidth {grid.columns}\nmap\n"
    with replace_file(path) as temporary:
        temporary.write_bytes(header.encode("ascii") + characters.tobytes())
    x, y = grid.origin
    georeference = f"the cell size, {grid.cell:g} m, and the lower left corner, [{x:g}, {y:g}]"
    report = build_grid_report("movingai", (path,), environment, grid, free)
    return replace(report, dropped=(georeference, *report.dropped))
