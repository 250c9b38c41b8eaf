"""SVG drawings as maps (`reading`), and maps as SVG drawings (`writing`)."""

from robocov_app.formats.vector.svg.reading import ROOT, read
from robocov_app.formats.vector.svg.writing import write

__all__ = ["ROOT", "read", "write"]
