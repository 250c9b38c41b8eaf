"""Foreign map formats: one module for each, named as the format.

`registry` lists them. Reading gives a `ForeignMap`: the free space in the file. `geometry` turns it into an
`Environment`, in the same way for all formats.

Shared parts are `files` (limits, JSON, YAML, XML), `geometry` (shapes, grids, polygons), `colors`,
`georeference` (degrees to meters) and `building_floor` (rooms, walls and doors). `options` and `reports` are
what a user gives and gets, `preview` draws an import, and `unsupported` names files that no format reads.
"""

from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.conversion import build_environment
from robocov_app.formats.geometry.shaping import Shaping
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
