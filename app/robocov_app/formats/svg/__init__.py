"""SVG drawings as maps (`reading`), and maps as SVG drawings (`writing`)."""

from robocov_app.formats.svg.reading import ROOT, read
from robocov_app.formats.svg.writing import write

__all__ = ["ROOT", "read", "write"]
