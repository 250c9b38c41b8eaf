"""The service that imports maps in a separate process."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TypeAlias

from robocov.environment import Environment
from robocov.errors import to_one_line
from robocov_app.editor.ui.importing.file_colors import ColorSheet, build_color_sheet
from robocov_app.formats import (
    ForeignMap,
    ImportReport,
    ReadOptions,
    Shaping,
    build_environment,
    read_map,
)
from robocov_app.formats.geometry.conversion.comparison import ImportComparison, compare_maps
from robocov_app.jobs.messages import Channel

ImportRequest: TypeAlias = tuple[Path, str, ReadOptions, Shaping]
"""File, name of its format, and settings for reading and shaping."""


@dataclass(frozen=True, eq=False)
class Imported:
    """An imported map.

    Attributes
    ----------
    environment : Environment
        The map.
    report : ImportReport
        Items that were read, changed and left out.
    comparison : ImportComparison
        The free space before and after the import.
    sheet : ColorSheet or None
        The file in its own colors; None if it has none.
    """

    environment: Environment
    report: ImportReport
    comparison: ImportComparison
    sheet: ColorSheet | None = None


class _ReadKey(NamedTuple):
    """Everything that determines the result of reading a file."""

    path: Path
    format: str
    options: ReadOptions


class ImportService:
    """Service that imports maps. The latest file is cached, because shaping is faster than reading."""

    failure_message = "the map could not be imported"

    def __init__(self) -> None:
        self._read: tuple[_ReadKey, ForeignMap] | None = None
        self._sheet: tuple[_ReadKey, ColorSheet | None] | None = None

    def __call__(self, requests: list[ImportRequest], channel: Channel) -> Imported:
        """Import the file of the newest request."""
        newest = requests[-1]
        path, format_name, options, shaping = newest
        key = _ReadKey(path, format_name, options)
        foreign = self._read_map(key)
        sheet = self._build_sheet(key, foreign)
        environment, report = build_environment(foreign, shaping, to_one_line(path.name))
        return Imported(environment, report, compare_maps(foreign, environment, report), sheet)

    def _read_map(self, key: _ReadKey) -> ForeignMap:
        if self._read is None or self._read[0] != key:
            # Free the memory of the previous file first.
            self._read = None
            self._read = (key, read_map(key.path, format=key.format, options=key.options))
        return self._read[1]

    def _build_sheet(self, key: _ReadKey, foreign: ForeignMap) -> ColorSheet | None:
        """Return the file in its own colors, including shapes that the options leave out; cached."""
        options = replace(
            key.options,
            free_color=None,
            solid_color=None,
            ignore_color=None,
            color_tolerance=None,
            min_stroke=None,
        )
        plain_key = key._replace(options=options)
        if self._sheet is None or self._sheet[0] != plain_key:
            source = foreign
            if plain_key != key:
                source = read_map(key.path, format=key.format, options=options)
            self._sheet = (plain_key, build_color_sheet(source))
        return self._sheet[1]
