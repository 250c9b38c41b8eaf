"""DXF drawings: loading by ezdxf (`document`), the map (`reading`), entities (`entity_reader`) and curves."""

from robocov_app.formats.dxf.document import sniff
from robocov_app.formats.dxf.reading import read

__all__ = ["read", "sniff"]
