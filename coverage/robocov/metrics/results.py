"""The results of a sweep, which are read from its folder: a table of any size, and the run of each row."""

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
from robocov.files.documents import read_json_object
from robocov.files.result_folder import require_result
from robocov.files.result_names import COST_FILE, ERROR_FILE, RUNS_FOLDER, STUDY_FILE, SWEEP_TABLE_FILE
from robocov.metrics.cost_history import CostHistory
from robocov.optional_imports import import_optional
from robocov.record import Record
from robocov.text import escape_controls

if TYPE_CHECKING:
    from pandas import DataFrame

_HISTORY_COLUMNS = ("time_s", "mean_distance_m", "cost_m3", "uncovered_area_m2")
"""Columns of ``cost.csv``."""
_MEAN_TIME_COLUMN = "mean_time_s"
"""Additional last column if robots have different maximum speeds."""

_COLUMN_KINDS = {
    "map": "string",
    "controller": "string",
    "start": "string",
    "run": "string",
    "error": "string",
    "robots": "int64",
    "seed": "int64",
    "contacts": "int64",
    "stuck_robots": "int64",
}
"""Kinds of the columns that any study may have, except for columns of floats."""

_MAX_SHOWN_ROWS = 10
"""Maximum number of rows that notebooks show."""


class Results:
    """The table of a sweep, with one row for each run, and the folders of the runs.

    Files are read only when they are needed.

    Parameters
    ----------
    folder : Path
        The folder of the sweep.

    Attributes
    ----------
    folder : Path
        The folder of the sweep.
    columns : tuple of str
        Names of the columns of the table: parameters that vary (``map``, ``controller``, ``robots``,
        ``start``, ``seed``, gains, ...), results whose names end in their units, the name of the run's folder
        (``run``), and the message of a run that failed (``error``).

    Raises
    ------
    InputError
        If the table cannot be read, or has no columns `run` and `error`.

    See Also
    --------
    read_results : Read the results of a sweep.
    Record : A run of the sweep, see `Results.record`.

    Examples
    --------
    >>> import robocov as rc
    >>> results = rc.read_results("study")  # doctest: +SKIP
    >>> results.to_pandas().groupby("controller")["mean_distance_m"].median()  # doctest: +SKIP
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._table = folder / SWEEP_TABLE_FILE
        self.columns: tuple[str, ...] = tuple(next(_read_lines(self._table), ()))
        if not {"run", "error"} <= set(self.columns):
            raise InputError(f"{self._table}: line 1: expected the header of a table of results")

    def __len__(self) -> int:
        """Return the number of runs, including failed ones."""
        return sum(1 for _ in _read_lines(self._table)) - 1

    def __repr__(self) -> str:
        return f"<Results {self.folder}, {format_count(len(self), 'run')}>"

    @property
    def study(self) -> dict[str, Any]:
        """Content of ``study.json``, which describes the sweep.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        return read_json_object(self.folder / STUDY_FILE)

    def rows(self, columns: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
        """Read the rows of the table one after another.

        Parameters
        ----------
        columns : sequence of str, or None
            Names of the columns to read; by default, all columns.

        Returns
        -------
        iterator of dict
            The values of each row by column. Empty cells are None.

        Raises
        ------
        InputError
            If there is no such column; the message suggests the most similar name.
        """
        if columns is not None:
            for name in columns:
                if name not in self.columns:
                    message = describe_unknown_name("column", name, self.columns)
                    raise InputError(f"{self.folder}: {message}")
        return read_rows(self._table, self._read_kinds(), columns)

    def to_pandas(self, columns: Sequence[str] | None = None) -> DataFrame:
        """Read the table as a data frame.

        Requires ``robocov[pandas]``.

        Parameters
        ----------
        columns : sequence of str, or None
            Names of the columns to read; by default, all columns.

        Returns
        -------
        pandas.DataFrame
            One row for each run.

        Raises
        ------
        InputError
            If there is no such column; the message suggests the most similar name.
        """
        pandas = import_optional("pandas", "pandas")
        names = list(self.columns if columns is None else columns)
        frame: DataFrame = pandas.DataFrame(list(self.rows(names)), columns=names)
        kinds = self._read_kinds()
        # Columns without any value would otherwise have the type object.
        empty_columns = [name for name in names if kinds.get(name) != "string" and frame[name].isna().all()]
        return frame.astype(dict.fromkeys(empty_columns, float))

    def failures(self) -> list[dict[str, Any]]:
        """Return the rows of the runs that failed.

        Returns
        -------
        list of dict
            The values of each row by column. ``error`` is the message of the error.
        """
        return [row for row in self.rows() if row["error"] is not None]

    def record(self, run: str | int | Mapping[str, Any]) -> Record:
        """Read the record of a run.

        Parameters
        ----------
        run : str, int or mapping
            The name of the run's folder, the index of its row, or the row itself.

        Returns
        -------
        Record
            The record of the run.

        Raises
        ------
        InputError
            If there is no such run, or it failed.
        """
        return Record.load(self._find_run_folder(run))

    def history(self, run: str | int | Mapping[str, Any]) -> CostHistory:
        """Read the coverage cost over a run.

        Parameters
        ----------
        run : str, int or mapping
            The name of the run's folder, the index of its row, or the row itself.

        Returns
        -------
        CostHistory
            The coverage cost over the run.

        Raises
        ------
        InputError
            If there is no such run, or it failed.
        """
        return read_history(self._find_run_folder(run) / COST_FILE)

    def _read_kinds(self) -> dict[str, str]:
        """Return the kinds of columns by name; without a readable study, only those in `_COLUMN_KINDS`."""
        try:
            study_kinds = {column["name"]: str(column["kind"]) for column in self.study["columns"]}
        except (InputError, KeyError, TypeError, ValueError):
            return _COLUMN_KINDS
        return _COLUMN_KINDS | study_kinds

    def _find_run_folder(self, run: str | int | Mapping[str, Any]) -> Path:
        """Find the folder of a run; raise InputError if there is no such folder, or the run failed."""
        name = self._find_run_name(run)
        folder = self.folder / RUNS_FOLDER / name
        # A name with a separator, or "..", could lead out of the folder of the sweep.
        is_plain_name = name not in ("", "..") and Path(name).name == name
        if not is_plain_name or not folder.is_dir():
            raise InputError(f"{self.folder}: there is no run {quote(name)}")
        error_file = folder / ERROR_FILE
        if error_file.is_file():
            raise InputError(f"{folder}: the run failed: {_read_error(error_file)}")
        return folder

    def _find_run_name(self, run: str | int | Mapping[str, Any]) -> str:
        """Return the name of a run that is given by its name, the index of its row, or its row."""
        if isinstance(run, str):
            return run
        if not isinstance(run, int | np.integer):
            return self._get_name_in_row(run)
        index = int(run)
        row_count = len(self)
        if not -row_count <= index < row_count:
            raise InputError(f"{self.folder}: there is no row {index} (of {format_count(row_count, 'row')})")
        row = next(islice(self.rows(["run"]), index % row_count, None))
        return str(row["run"])

    def _get_name_in_row(self, row: Mapping[str, Any]) -> str:
        try:
            return str(row["run"])
        except (KeyError, TypeError):
            raise InputError(
                f"{self.folder}: run: expected the name of a run, the index of its row, or a row with the "
                f"column 'run', got {quote(row)}"
            ) from None

    def _repr_html_(self) -> str:
        """Return the first rows as HTML, for notebooks."""
        first_rows = list(islice(self.rows(), _MAX_SHOWN_ROWS))
        header = "".join(f"<th>{escape(name)}</th>" for name in self.columns)
        body = []
        for row in first_rows:
            cells = "".join(f"<td>{escape(_format_cell(row[name]))}</td>" for name in self.columns)
            body.append(f"<tr>{cells}</tr>")
        run_count = len(self)
        caption = f"{format_count(run_count, 'run')} of {escape(str(self.folder))}"
        if run_count > len(first_rows):
            caption += f" (first {len(first_rows)} shown)"
        return escape_controls(
            f'<div style="overflow-x: auto"><table style="white-space: nowrap"><caption>{caption}</caption>'
            f"<thead><tr>{header}</tr></thead><tbody>{''.join(body)}</tbody></table></div>"
        )


def read_results(folder: Path | str) -> Results:
    r"""Read the results of a sweep.

    If the sweep is still running or was interrupted, the results contain only finished runs.

    Parameters
    ----------
    folder : Path or str
        Folder that `robocov sweep` wrote.

    Returns
    -------
    Results
        The table and the runs.

    Raises
    ------
    InputError
        If the folder is not the folder of a sweep, or its table cannot be read.

    See Also
    --------
    Results : Rows, data frames, records and cost histories.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import robocov as rc
    >>> table = "controller,mean_distance_m,run,error\nrapf,1.25,0001,\nlloyd,1.31,0002,\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "results.csv").write_text(table)
    ...     results = rc.read_results(folder)
    ...     print(len(results), list(results.rows(["controller", "mean_distance_m"])))
    2 [{'controller': 'rapf', 'mean_distance_m': 1.25}, {'controller': 'lloyd', 'mean_distance_m': 1.31}]
    """
    folder = Path(folder)
    require_result(folder, "the folder of a sweep", (SWEEP_TABLE_FILE,))
    return Results(folder)


def read_rows(
    table: Path, kinds: Mapping[str, str], columns: Sequence[str] | None = None
) -> Iterator[dict[str, Any]]:
    """Read the rows of ``results.csv`` one after another.

    Parameters
    ----------
    table : Path
        The file.
    kinds : mapping of str to str
        Kinds of the columns by name, as in Parquet: "string", "int64" or "double".
    columns : sequence of str, or None
        Names of the columns to read; by default, all columns.

    Yields
    ------
    dict
        The values of a row by column. Empty cells are None.

    Raises
    ------
    InputError
        If the table cannot be read; the message names the row.
    """
    lines = _read_lines(table)
    names = next(lines, None)
    if names is None:
        raise InputError(f"{table}: cannot be read: the file is empty")
    selected = list(names if columns is None else columns)
    column_indices = [names.index(name) for name in selected]
    for row_index, cells in enumerate(lines):
        if len(cells) != len(names):
            expected = format_count(len(names), "cell")
            raise InputError(f"{table}: row {row_index}: expected {expected}, got {len(cells)}")
        row = {}
        try:
            for name, column_index in zip(selected, column_indices, strict=True):
                row[name] = _parse_value(cells[column_index], kinds.get(name))
        except ValueError as error:
            raise InputError(f"{table}: row {row_index}: cannot be read: {error}") from error
        yield row


def _read_lines(table: Path) -> Iterator[list[str]]:
    """Yield the header and then the rows of a table, as lists of strings.

    Raise an InputError if the table cannot be read.
    """
    try:
        with table.open(encoding="utf-8", newline="") as file:
            yield from csv.reader(file)
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{table}: cannot be read: {error}") from error


def read_history(path: Path) -> CostHistory:
    """Read the coverage cost over a run from a file ``cost.csv``.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    CostHistory
        The coverage cost over the run.

    Raises
    ------
    InputError
        If the file cannot be read; the message names the line.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    names = lines[0].split(",") if lines else []
    required_names = list(_HISTORY_COLUMNS)
    if names not in (required_names, [*required_names, _MEAN_TIME_COLUMN]):
        raise InputError(f"{path}: line 1: expected the header {','.join(_HISTORY_COLUMNS)}")
    if len(lines) == 1:
        raise InputError(f"{path}: line 2: expected {len(names)} numbers, got the end of the file")
    rows = np.empty((len(lines) - 1, len(names)))
    for row, line in enumerate(lines[1:]):
        cells = line.split(",")
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            # No values are too few values, which is reported below.
            values = []
        if len(values) != len(names):
            raise InputError(f"{path}: line {row + 2}: expected {len(names)} numbers, got {quote(line)}")
        rows[row] = values
    columns = dict(zip(names, rows.T, strict=True))
    return CostHistory(
        time=columns["time_s"],
        mean_distance=columns["mean_distance_m"],
        cost=columns["cost_m3"],
        uncovered_area=columns["uncovered_area_m2"],
        mean_time=columns.get(_MEAN_TIME_COLUMN),
    )


def _parse_value(text: str, kind: str | None) -> Any:
    """Convert the text of a cell to a value of the given kind; return None if the cell is empty."""
    if not text or kind == "string":
        return unquote_cell(text) or None
    if kind == "int64":
        return int(text)
    try:
        return float(text)
    except ValueError:
        if kind is None:
            # If the study does not list the kinds of its columns, this may be a column of text.
            return unquote_cell(text)
        raise


def _read_error(path: Path) -> str:
    """Read the message of a run that failed."""
    try:
        return str(json.loads(path.read_bytes())["error"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return "the reason cannot be read"


def _format_cell(value: object) -> str:
    """Format a value of a table for HTML: numbers with four digits, missing values empty."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
