"""The interface of a map format: how it is detected, read and written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from robocov.environment import Environment
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport


@dataclass(frozen=True)
class Importer:
    """A foreign format that can be read.

    Attributes
    ----------
    name : str
        Name of the format in the option ``--format``.
    title : str
        Name of the format for people to read.
    suffixes : tuple of str
        File suffixes in lower case.
    sniff : callable
        ``sniff(path, head)`` returns whether a file that starts with the bytes `head` has this format. It
        must be fast and never raise. `head` has `files.HEAD_BYTES` bytes, or is the whole file.
    reader : callable
        ``reader(path, options)`` returns the map in a file, or raises a MapError with a message of one line.
        It takes at most a second and 200 MB.
    options : frozenset of str
        The fields of `ReadOptions` that apply to the format.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    reader: Callable[[Path, ReadOptions], ForeignMap]
    options: frozenset[str] = frozenset()

    def read(self, path: Path, options: ReadOptions) -> ForeignMap:
        """Read the map in a file."""
        return replace(self.reader(path, options), format=self.name)


@dataclass(frozen=True)
class Exporter:
    """A foreign format that can be written.

    Attributes
    ----------
    name, title, suffixes
        See `Importer`.
    write : callable
        ``write(environment, path, options)`` writes the map completely or not at all, by means of
        `robocov.files.writing.replace_file`.
    options : frozenset of str
        The fields of `WriteOptions` that apply to the format.
    list_files : callable
        ``list_files(path, options)`` returns all files that would be written, with `path` first.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    write: Callable[[Environment, Path, WriteOptions], ExportReport]
    options: frozenset[str] = frozenset()
    list_files: Callable[[Path, WriteOptions], tuple[Path, ...]] = lambda path, _: (path,)
