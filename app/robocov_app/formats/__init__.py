"""Foreign map formats, read and written.

A format is one module with an `Importer`, an `Exporter` or both. What is read is a `ForeignMap`: what is
free, as the file has it; `robocov_app.formats.geometry.conversion` makes the `Environment` of it, in the same
way for all.
"""

from dataclasses import replace
from pathlib import Path

from robocov.environment import Environment
from robocov.errors import MapError, ParameterError, counted, one_line, unknown_name
from robocov_app.formats import (
    argos,
    dxf,
    files,
    geojson,
    houseexpo,
    irsim,
    movingai,
    osm,
    picture,
    rings,
    ros,
    stage,
    tmx,
    wkt,
)
from robocov_app.formats.base import (
    Exporter,
    ExportReport,
    ForeignMap,
    Importer,
    ImportReport,
    ReadOptions,
    WriteOptions,
)
from robocov_app.formats.geometry.conversion import Shaping, shaped
from robocov_app.formats.svg import drawing as svg
from robocov_app.formats.unreadable import described, named_kind

__all__ = [
    "EXPORTERS", "IMPORTERS", "ExportReport", "Exporter", "ForeignMap", "ImportReport", "Importer",
    "ReadOptions", "Shaping", "WriteOptions", "detect", "export_map", "exporter", "import_map", "importer",
    "read_map", "shaped",
]  # fmt: skip
# the first whose `sniff` says yes has it: the surest come first
_SURE = (irsim, ros, movingai, stage, argos, tmx, picture, osm, svg, dxf, wkt, geojson)
# the formats that can be read, by name
IMPORTERS: dict[str, Importer] = {each.IMPORTER.name: each.IMPORTER for each in (*_SURE, houseexpo, rings)}
_EXPORT = (ros, movingai, picture, svg, wkt, geojson)
# the formats that can be written, by name
EXPORTERS: dict[str, Exporter] = {each.EXPORTER.name: each.EXPORTER for each in _EXPORT}


def importer(name: str) -> Importer:
    if name not in IMPORTERS:
        raise ParameterError(unknown_name("format", name, IMPORTERS))
    return IMPORTERS[name]


def detect(path: str | Path) -> Importer:
    """Return the format of the file at `path`: by its content, or else by its suffix."""
    path = Path(path)
    head = files.head(path)
    if (kind := named_kind(path, head)) is not None:
        raise MapError(f"{one_line(path)}: {one_line(kind)}")
    for candidate in IMPORTERS.values():
        if candidate.sniff(path, head):
            return candidate
    named = [each for each in IMPORTERS.values() if path.suffix.lower() in each.suffixes]
    if len(named) == 1:  # its reader says best what is missing
        return named[0]
    wanted = f"one of {', '.join(IMPORTERS)} was wanted"
    raise MapError(f"{one_line(path)}: unknown format ({described(head)}), but {wanted}")


def import_map(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: ReadOptions = ReadOptions(),
    shaping: Shaping = Shaping(),
) -> tuple[Environment, ImportReport, ForeignMap]:
    """Return the foreign map at `path` as an environment, what was done to it, and what was read.

    `format` is its name; None looks at the file. Raises MapError when the file cannot be read, understood or
    driven in; ParameterError when the format is unknown, or does not have an option that is given.
    """
    foreign = read_map(path, format=format, options=options)
    environment, report = shaped(foreign, shaping, one_line(path))
    return environment, report, foreign


def read_map(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: ReadOptions = ReadOptions(),
) -> ForeignMap:
    """Return the foreign map at `path` as it was read; parameters and errors are those of `import_map`."""
    path = Path(path)
    chosen = detect(path) if format is None else importer(format)
    options.require_known(chosen)
    return chosen.read(path, options)


def exporter(path: str | Path, name: str | None = None) -> Exporter:
    if name is not None and name not in EXPORTERS:
        raise ParameterError(unknown_name("format", name, EXPORTERS))
    suffix = Path(path).suffix.lower()
    for candidate in EXPORTERS.values():
        if candidate.name == name or (name is None and suffix in candidate.suffixes):
            return candidate
    known = ", ".join(suffix for candidate in EXPORTERS.values() for suffix in candidate.suffixes)
    raise ParameterError(f"{one_line(path)}: unknown format, but a file ending in one of {known} was wanted")


def export_map(
    environment: Environment,
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: WriteOptions = WriteOptions(),
) -> ExportReport:
    """Write `environment` to `path` in a foreign format, and return what came of it.

    `format` is its name; None goes by the suffix. Raises ParameterError as `import_map`; OutputError when a
    file cannot be written: what was there before is then untouched.
    """
    path = Path(path)
    chosen = exporter(path, format)
    options.require_known(chosen)
    report = chosen.write(environment, path, options)
    dropped = list(report.dropped)
    if environment.density is not None:
        dropped.append(f"the density ({environment.density.kind})")
    if environment.moves:
        count = sum(shape.path is not None for shape in environment.obstacles)
        dropped.append(f"the {counted(count, 'path')} of obstacles, which stand where they are at time zero")
    return replace(report, dropped=tuple(dropped))
