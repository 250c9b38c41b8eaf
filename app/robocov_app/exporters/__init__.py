"""Environments, written in foreign map formats: each is one module with an `Exporter`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import ParameterError, counted, one_line, unknown_name
from robocov_app.exporters import geojson, movingai, picture, ros, svg, wkt
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions

if TYPE_CHECKING:
    from robocov.environment import Environment

__all__ = ["EXPORTERS", "ExportReport", "Exporter", "WriteOptions", "export_map", "exporter"]

_ALL: tuple[Exporter, ...] = (
    ros.EXPORTER,
    movingai.EXPORTER,
    picture.EXPORTER,
    svg.EXPORTER,
    wkt.EXPORTER,
    geojson.EXPORTER,
)

EXPORTERS: dict[str, Exporter] = {exporter.name: exporter for exporter in _ALL}
"""The formats that can be written, by name."""


def exporter(path: str | Path, name: str | None = None) -> Exporter:
    """Return the format called `name`, or else that of the suffix of `path`.

    Raises
    ------
    ParameterError
        When there is none; the message names the known ones.
    """
    if name is not None:
        if name not in EXPORTERS:
            raise ParameterError(unknown_name("format", name, EXPORTERS))
        return EXPORTERS[name]
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

    Parameters
    ----------
    environment : Environment
    path : str or Path
    format : str or None
        Name of the format; None goes by the suffix.
    options : WriteOptions

    Raises
    ------
    ParameterError
        When the format is unknown, or an option is given that it does not have.
    OutputError
        When a file cannot be written; what was there before is then untouched.
    """
    path = Path(path)
    chosen = exporter(path, format)
    strange = [name for name in options.given() if name not in chosen.options]
    if strange:
        known = ", ".join(f"--{name}" for name in sorted(chosen.options)) or "none"
        raise ParameterError(
            f"--{strange[0]}: no option of the format {chosen.name}, whose options are: {known}"
        )
    report = chosen.write(environment, path, options)
    dropped = list(report.dropped)
    if environment.density is not None:
        dropped.append(f"the density ({environment.density.kind})")
    if environment.moves:
        count = sum(shape.path is not None for shape in environment.obstacles)
        dropped.append(f"the {counted(count, 'path')} of obstacles, which stand where they are at time zero")
    return replace(report, dropped=tuple(dropped))
