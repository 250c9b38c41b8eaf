"""Foreign map formats: one module or package for each, with the name of the format.

They are in `vector` (SVG, DXF, well-known text, HouseExpo, rings), `raster` (ROS, pictures, Tiled, MovingAI),
`geodata` (GeoJSON, OpenStreetMap, IMDF) and `simulators` (ARGoS, IR-SIM, Stage); `registry` lists them.
Reading a file gives a `ForeignMap`: its free space. `geometry` converts it to an `Environment`, in the same
way for all formats.

`files` reads files safely, and `colors` assigns roles to the colors of pictures and drawings. `options`
defines the options of imports and exports, and `reports` their results; `preview` plots an import, and
`unsupported` recognizes files that no format reads.
"""

from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.conversion.conversion_options import Shaping
from robocov_app.formats.geometry.conversion.environment import build_environment
from robocov_app.formats.interface import Exporter, Importer
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.registry import (
    EXPORTERS,
    IMPORTERS,
    choose_exporter,
    detect_format,
    export_map,
    get_importer,
    import_map,
    read_map,
)
from robocov_app.formats.reports import ExportReport, ImportReport

__all__ = [
    "EXPORTERS",
    "IMPORTERS",
    "ExportReport",
    "Exporter",
    "ForeignMap",
    "ImportReport",
    "Importer",
    "ReadOptions",
    "Shaping",
    "WriteOptions",
    "build_environment",
    "choose_exporter",
    "detect_format",
    "export_map",
    "get_importer",
    "import_map",
    "read_map",
]
