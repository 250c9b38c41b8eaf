"""Foreign map formats, read and written.

A format is one module with an `Importer`, an `Exporter` or both. What is read is a `ForeignMap`: what is
free, as the file has it; `robocov_app.formats.geometry.conversion` makes the `Environment` of it, in the same
way for all.
"""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

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

_Format = TypeVar("_Format", Importer, Exporter)

# the first whose `sniff` says yes has it: the surest come first
_SURE = (irsim, ros, movingai, stage, argos, tmx, picture, osm, svg, dxf, wkt, geojson)

IMPORTERS: dict[str, Importer] = {each.IMPORTER.name: each.IMPORTER for each in (*_SURE, houseexpo, rings)}
"""The formats that can be read, by name."""

_EXPORT = (ros, movingai, picture, svg, wkt, geojson)

EXPORTERS: dict[str, Exporter] = {each.EXPORTER.name: each.EXPORTER for each in _EXPORT}
"""The formats that can be written, by name."""


def importer(name: str) -> Importer:
    """Return the format called `name`; the ParameterError where there is none names the nearest."""
    return _named(IMPORTERS, name)


def _named(formats: dict[str, _Format], name: str) -> _Format:
    if name not in formats:
        raise ParameterError(unknown_name("format", name, formats))
    return formats[name]


def detect(path: str | Path) -> Importer:
    """Return the format of the file at `path`: by its content, or else by its suffix."""
    path = Path(path)
    head = files.head(path)
    kind = named_kind(path, head)
    if kind is not None:
        raise MapError(f"{one_line(path)}: {one_line(kind)}")
    for candidate in IMPORTERS.values():
        if candidate.sniff(path, head):
            return candidate
    named = [candidate for candidate in IMPORTERS.values() if path.suffix.lower() in candidate.suffixes]
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
    _require_known(options.given(), chosen.options, chosen.name)
    return chosen.read(path, options)


def _require_known(given: Collection[str], known: Collection[str], name: str) -> None:
    strange = [each for each in given if each not in known]
    if strange:
        words = ", ".join(f"--{each}" for each in sorted(known)) or "none"
        raise ParameterError(f"--{strange[0]}: no option of the format {name}, whose options are: {words}")


def exporter(path: str | Path, name: str | None = None) -> Exporter:
    """Return the format called `name`, or else that of the suffix of `path`."""
    if name is not None:
        return _named(EXPORTERS, name)
    suffix = Path(path).suffix.lower()
    for candidate in EXPORTERS.values():
        if suffix in candidate.suffixes:
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
    _require_known(options.given(), chosen.options, chosen.name)
    report = chosen.write(environment, path, options)
    dropped = list(report.dropped)
    if environment.density is not None:
        dropped.append(f"the density ({environment.density.kind})")
    if environment.moves:
        count = sum(shape.path is not None for shape in environment.obstacles)
        dropped.append(f"the {counted(count, 'path')} of obstacles, which stand where they are at time zero")
    return replace(report, dropped=tuple(dropped))
