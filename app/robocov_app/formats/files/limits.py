"""Size limits of foreign files and of the maps in them."""

from robocov.errors import MapError, require_number
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M

MAX_FILE_BYTES = 256_000_000
"""Maximum size of a raster file: enough for `MAX_CELLS` cells written as plain text."""
MAX_TEXT_BYTES = 50_000_000
"""Maximum size of a file of a vector format; the limit for robocov's own map files is the same."""
MAX_CELLS = 64_000_000
"""Maximum size of a raster: 8000 x 8000 cells."""
MAX_VERTICES = 500_000
"""Maximum number of vertices of a foreign map."""
MAX_SHAPES = 20_000
"""Maximum number of shapes in a file. Even a small shape takes a quarter of a millisecond."""
MAX_DEPTH = 32
"""Deepest nesting of collections, groups, blocks and lists."""


def require_cells(width: int, height: int, source_name: str) -> None:
    """Raise MapError if a raster has no cell or more than `MAX_CELLS`; `source_name` names the file."""
    if width < 1 or height < 1:
        raise MapError(f"{source_name}: expected at least 1 x 1 cells, got {width} x {height}")
    if width * height > MAX_CELLS:
        millions = MAX_CELLS // 1_000_000
        raise MapError(f"{source_name}: expected at most {millions} million cells, got {width} x {height}")


def require_vertices(count: int, source_name: str) -> None:
    """Raise MapError if there are more than `MAX_VERTICES` vertices."""
    if count > MAX_VERTICES:
        raise MapError(f"{source_name}: expected at most {MAX_VERTICES} vertices, got about {count}")


def require_shapes(count: int, source_name: str) -> None:
    """Raise MapError if there are more than `MAX_SHAPES` shapes."""
    if count > MAX_SHAPES:
        raise MapError(f"{source_name}: expected at most {MAX_SHAPES} shapes, got {count:.6g}")


def require_length(
    value: float, source_name: str, minimum: float = 1e-6, maximum: float = MAX_SIZE_M
) -> None:
    """Raise MapError if a length, in m, is out of range."""
    require_number(source_name, value, minimum, maximum, "(m)", error_type=MapError)


def require_coordinate(value: float, source_name: str) -> None:
    """Raise MapError if a coordinate, in m, is out of range."""
    require_length(value, source_name, -MAX_COORDINATE_M, MAX_COORDINATE_M)
