"""Well-known text: its grammar (`parser`), conversion to free space (`reading`, `holes`), and `writing`."""

from robocov_app.formats.vector.wkt.parser import sniff
from robocov_app.formats.vector.wkt.reading import read
from robocov_app.formats.vector.wkt.writing import write

__all__ = ["read", "sniff", "write"]
