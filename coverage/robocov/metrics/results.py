"""The results of a sweep, read back: a table that need not fit into memory, and the runs behind its rows."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import InputError, describe_unknown_name, format_count, quote
from robocov.files.csv_cells import unquote_cell
from robocov.metrics import CostHistory
from robocov.optional_imports import import_optional
from robocov.record import Record
from robocov.text import escape_controls

if TYPE_CHECKING:
    from pandas import DataFrame

_HISTORY = ("time_s", "mean_distance_m", "cost_m3", "uncovered_area_m2")
_TIME = "mean_time_s"
"""A last column, where robots are not equally fast."""

_KINDS = dict.fromkeys(("map", "controller", "start", "run", "error"), "string")
_KINDS |= dict.fromkeys(("robots", "seed", "contacts", "stuck_robots"), "int64")
"""Kinds of columns of every study, where they hold no floats."""

_SHOWN_ROWS = 10
"""Rows that notebooks show."""


class Results:
    """The table of a sweep, one row a run, and the folders of the runs; all is read when it is asked for.

    Its `columns` say what was run (``map``, ``controller``, ``robots``, ``start``, ``seed``, gains, whatever
    else was varied), the figures with their units, the name of the run's folder (``run``), and its ``error``.

    >>> results = read_results("study")  # doctest: +SKIP
    >>> results.to_pandas().groupby("controller")["mean_distance_m"].median()  # doctest: +SKIP
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._table = folder / "results.csv"
        self.columns: tuple[str, ...] = tuple(next(_lines(self._table), ()))
        if not {"run", "error"} <= set(self.columns):
            raise InputError(f"{self._table}: line 1: the header of a table of results was wanted")

    def __len__(self) -> int:
        """Number of runs, failed ones included."""
        return sum(1 for _ in _lines(self._table)) - 1

    def __repr__(self) -> str:
        return f"<Results {self.folder}, {format_count(len(self), 'run')}>"

    @property
    def study(self) -> dict[str, Any]:
        """The content of ``study.json``: what was to be run; an InputError where it cannot be read."""
        path = self.folder / "study.json"
        try:
            return dict(json.loads(path.read_bytes()))
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"{path}: cannot be read: {error}") from error

    def rows(self, columns: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
        """Yield the rows in order, as dicts by column, all columns or those named; None where nothing is.

        Raises InputError when there is no such column; the message gives the nearest.
        """
        for name in columns or ():
            if name not in self.columns:
                raise InputError(f"{self.folder}: {describe_unknown_name('column', name, self.columns)}")
        return read_rows(self._table, self._kinds(), columns)

    def to_pandas(self, columns: Sequence[str] | None = None) -> DataFrame:
        """Return the rows as a data frame, as `rows`; pandas comes with ``robocov[pandas]``."""
        pandas, names, kinds = (
            import_optional("pandas", "pandas"),
            list(columns or self.columns),
            self._kinds(),
        )
        frame: DataFrame = pandas.DataFrame(list(self.rows(names)), columns=names)
        empty = [name for name in names if kinds.get(name) != "string" and frame[name].isna().all()]
        return frame.astype(dict.fromkeys(empty, float))

    def failures(self) -> list[dict[str, Any]]:
        """Return the rows of the runs that failed, as dicts by column; why is in ``error``."""
        return [row for row in self.rows() if row["error"] is not None]

    def record(self, run: str | int | Mapping[str, Any]) -> Record:
        """Return the record of a run; its moments are as far apart as the study wanted it.

        A run is named by its folder, the number of its row, or the row. Raises InputError when there is no
        such run, or it failed.
        """
        return Record.load(self._folder_of(run))

    def history(self, run: str | int | Mapping[str, Any]) -> CostHistory:
        """Return the coverage cost along a run, which is named as in `record`; it raises the same."""
        return read_history(self._folder_of(run) / "cost.csv")

    def _kinds(self) -> dict[str, str]:
        """Return the kinds of columns that are known; a table without its study is read all the same."""
        try:
            return _KINDS | {each["name"]: str(each["kind"]) for each in self.study["columns"]}
        except (InputError, KeyError, TypeError, ValueError):
            return _KINDS

    def _folder_of(self, run: str | int | Mapping[str, Any]) -> Path:
        if isinstance(run, int | np.integer):
            number, count = int(run), len(self)
            if not -count <= number < count:
                raise InputError(f"{self.folder}: row {number}, but there are {format_count(count, 'row')}")
            run = str(next(islice(self.rows(["run"]), number % count, None))["run"])
        elif not isinstance(run, str):
            run = str(run["run"])
        folder = self.folder / "runs" / run
        if not run or Path(run).name != run or not folder.is_dir():
            raise InputError(f"{self.folder}: there is no run {quote(run)}")
        error = folder / "error.json"
        if error.is_file():
            raise InputError(f"{folder}: the run failed: {_reason(error)}")
        return folder

    def _repr_html_(self) -> str:
        """Show the first rows in notebooks."""
        head, count = list(islice(self.rows(), _SHOWN_ROWS)), len(self)
        cells = [[f"<th>{escape(name)}</th>" for name in self.columns]]
        cells += [[f"<td>{escape(_cell(row[name]))}</td>" for name in self.columns] for row in head]
        rows = [f"<tr>{''.join(row)}</tr>" for row in cells]
        caption = f"{format_count(count, 'run')} of {escape(str(self.folder))}"
        if count > len(head):
            caption += f"; the first {len(head)}"
        return escape_controls(
            f'<div style="overflow-x: auto"><table style="white-space: nowrap"><caption>{caption}</caption>'
            f"<thead>{rows[0]}</thead><tbody>{''.join(rows[1:])}</tbody></table></div>"
        )


def read_results(folder: Path | str) -> Results:
    """Return the results in the folder of a sweep.

    While the sweep is still going on, or was killed, they are those that are there. Raises InputError when
    the folder holds no sweep, or its table cannot be read.
    """
    folder = Path(folder)
    if not (folder / "results.csv").is_file():
        raise InputError(f"{folder}: not the folder of a sweep (there is no results.csv)")
    return Results(folder)


def read_rows(
    table: Path, kinds: Mapping[str, str], columns: Sequence[str] | None = None
) -> Iterator[dict[str, Any]]:
    """Yield the rows of ``results.csv`` as dicts; `kinds` are those that Parquet has, by column."""
    lines = _lines(table)
    names = next(lines)
    chosen = [(name, names.index(name), kinds.get(name)) for name in columns or names]
    for k, line in enumerate(lines):
        try:
            yield {name: _value(line[at], kind) for name, at, kind in chosen}
        except (ValueError, IndexError) as error:
            raise InputError(f"{table}: row {k}: cannot be read: {error}") from error


def _lines(table: Path) -> Iterator[list[str]]:
    """Yield the header, and then the rows as texts."""
    try:
        with table.open(encoding="utf-8", newline="") as file:
            yield from csv.reader(file)
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{table}: cannot be read: {error}") from error


def read_history(path: Path) -> CostHistory:
    """Return what is in a file ``cost.csv``; the InputError where it is none names the line."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    names = lines[0].split(",") if lines else []
    if names not in (list(_HISTORY), [*_HISTORY, _TIME]):
        raise InputError(f"{path}: line 1: the header {','.join(_HISTORY)} was wanted")
    rows = np.empty((len(lines) - 1, len(names)))
    for k, line in enumerate(lines[1:]):
        cells = line.split(",")
        try:
            # a single number would do for all columns
            rows[k] = [float(cells[column]) for column in range(max(len(cells), len(names)))]
        except (ValueError, IndexError):
            wanted = f"{len(names)} numbers were wanted"
            raise InputError(f"{path}: line {k + 2}: {quote(line)}, but {wanted}") from None
    return CostHistory(*rows.T)


def _value(text: str, kind: str | None) -> Any:
    if not text or kind == "string":
        return unquote_cell(text) or None
    if kind == "int64":
        return int(text)
    try:
        return float(text)
    except ValueError:
        if kind is None:  # the table of an earlier version, whose study does not say that these are words
            return unquote_cell(text)
        raise


def _reason(path: Path) -> str:
    try:
        return str(json.loads(path.read_bytes())["error"])
    except (OSError, ValueError, KeyError, TypeError):
        return "why cannot be read"


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)
