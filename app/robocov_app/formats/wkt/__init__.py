"""Well-known text: the grammar (`parser`), free space from polygons (`reading`, `holes`), and `writing`."""

from robocov_app.formats.wkt.parser import sniff
from robocov_app.formats.wkt.reading import read
from robocov_app.formats.wkt.writing import write

__all__ = ["read", "sniff", "write"]
