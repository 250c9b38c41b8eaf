"""Well-known text: the grammar (`parser`), free space from polygons (`reading`, `holes`), and `writing`."""

from robocov_app.formats.vector.wkt.parser import sniff
from robocov_app.formats.vector.wkt.reading import read
from robocov_app.formats.vector.wkt.writing import write

__all__ = ["read", "sniff", "write"]
