"""DXF drawings: loading with ezdxf (`document`), `reading` of maps, entities (`entity_reader`) and curves."""

from robocov_app.formats.vector.dxf.document import sniff
from robocov_app.formats.vector.dxf.reading import read

__all__ = ["read", "sniff"]
