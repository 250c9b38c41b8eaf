"""Foreign map formats, turned into environments.

Each format is one module with an `Importer`, whose ``read`` gives a `ForeignMap`: what is free, as the
file has it. `robocov_app.importers.shaping` makes the `Environment` of it, the same way for all.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import MapError, ParameterError, one_line, unknown_name
from robocov_app.importers import (
    argos,
    dxf,
    geojson,
    houseexpo,
    irsim,
    limits,
    movingai,
    osm,
    picture,
    rings,
    ros,
    stage,
    svg,
    tmx,
    wkt,
)
from robocov_app.importers.foreign import ForeignMap
from robocov_app.importers.reading import Importer, ReadOptions
from robocov_app.importers.report import ImportReport
from robocov_app.importers.shaping import Shaping, shaped
from robocov_app.importers.unreadable import described, named_kind

if TYPE_CHECKING:
    from robocov.environment import Environment

__all__ = [
    "IMPORTERS",
    "ForeignMap",
    "ImportReport",
    "Importer",
    "ReadOptions",
    "Shaping",
    "detect",
    "import_map",
    "importer",
    "read_map",
    "shaped",
]

# the first whose `sniff` says yes has it: the surest come first
_ALL: tuple[Importer, ...] = (
    irsim.IMPORTER,
    ros.IMPORTER,
    movingai.IMPORTER,
    stage.IMPORTER,
    argos.IMPORTER,
    tmx.IMPORTER,
    picture.IMPORTER,
    osm.IMPORTER,
    svg.IMPORTER,
    dxf.IMPORTER,
    wkt.IMPORTER,
    geojson.IMPORTER,
    houseexpo.IMPORTER,
    rings.IMPORTER,
)

IMPORTERS: dict[str, Importer] = {importer.name: importer for importer in _ALL}
"""The known formats by name."""


def importer(name: str) -> Importer:
    """Return the format called `name`.

    Raises
    ------
    ParameterError
        When there is none; the message names the nearest.
    """
    if name not in IMPORTERS:
        raise ParameterError(unknown_name("format", name, IMPORTERS))
    return IMPORTERS[name]


def detect(path: str | Path) -> Importer:
    """Return the format of the file at `path`: by its content, or else by its suffix.

    Raises
    ------
    MapError
        When the file cannot be read, or is of no known format; the message names what it is where it can,
        and the way to a format that is known.
    """
    path = Path(path)
    head = limits.head(path)
    kind = named_kind(path, head)
    if kind is not None:
        raise MapError(f"{one_line(path)}: {one_line(kind)}")
    for candidate in IMPORTERS.values():
        if candidate.sniff(path, head):
            return candidate
    named = [candidate for candidate in IMPORTERS.values() if path.suffix.lower() in candidate.suffixes]
    if len(named) == 1:  # its reader says best what is missing
        return named[0]
    raise MapError(
        f"{one_line(path)}: unknown format ({described(head)}), but one of {', '.join(IMPORTERS)} was wanted"
    )


def import_map(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: ReadOptions = ReadOptions(),
    shaping: Shaping = Shaping(),
) -> tuple[Environment, ImportReport, ForeignMap]:
    """Return the foreign map at `path` as an environment, what was done to it, and what was read.

    Parameters
    ----------
    path : str or Path
    format : str or None
        Name of the format; None looks at the file.
    options : ReadOptions
        What the file does not say of itself.
    shaping : Shaping
        How it becomes an environment.

    Raises
    ------
    MapError
        When the file cannot be read or understood, or has no room for a robot.
    ParameterError
        When the format is unknown, or an option is given that it does not have.
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
    strange = [name for name in options.given() if name not in chosen.options]
    if strange:
        known = ", ".join(f"--{name}" for name in sorted(chosen.options)) or "none"
        raise ParameterError(
            f"--{strange[0]}: no option of the format {chosen.name}, whose options are: {known}"
        )
    return chosen.read(path, options)
