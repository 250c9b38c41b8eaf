"""The table of a sweep: ``results.csv``, which grows during the first sweep, and ``results.parquet``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from robocov.controllers import get_gains
from robocov.controllers.gains import Option
from robocov.errors import OutputError
from robocov.files.result_names import STUDY_FILE, SWEEP_PARQUET_FILE, SWEEP_TABLE_FILE
from robocov.files.writing import flush_to_disk, resolve_target
from robocov.metrics.results import read_rows
from robocov.optional_imports import import_optional
from robocov_app.sweep.ledger import Entry, count_rows, has_all_rows
from robocov_app.sweep.study.parameters import CONDITIONS, TEXT_PARAMETERS, UNITS, name_parameter_column
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import MEAN_TIME, METRICS
from robocov_app.terminal.output import format_csv_line

_TEMPORARY_CSV_FILE = ".results.part.csv"
_TEMPORARY_PARQUET_FILE = ".results.part.parquet"
_TEMPORARY_STUDY_FILE = ".study.part.json"
ROW_GROUP_SIZE = 4096
"""Number of rows in a Parquet row group, and maximum number of rows in memory."""


class Column(NamedTuple):
    """A column of the table."""

    name: str
    kind: str
    """Name of the Parquet type."""
    unit: str
    """Unit of the values; empty for numbers without unit and for text."""
    meaning: str
    """Short description, which the report displays."""


_RUN_COLUMNS = (
    Column("map", "string", "", "name of the map in the study"),
    Column("controller", "string", "", "the controller"),
    Column("robots", "int64", "", "number of robots"),
    Column("start", "string", "", "name of the start in the map"),
    Column("seed", "int64", "", "seed of the starting positions"),
)
_DURATION_COLUMN = Column("duration_s", "double", "s", "simulated time")
_METRIC_COLUMNS = tuple(Column(name, *facts) for name, facts in METRICS.items())
_FINAL_COLUMNS = (
    Column("run", "string", "", "the run's folder in runs/"),
    Column("error", "string", "", "why the run failed, null if it did not"),
)
_MEAN_TIME_COLUMN = Column(
    MEAN_TIME, "double", "s", "mean time until the first robot reaches a point, each at its top speed"
)
_OPTIONAL_METRIC_COLUMNS = (
    Column("sensed_area_m2", "double", "m²", "free area in a robot's sensing range and line of sight"),
    Column("range_area_m2", "double", "m²", "free area in a robot's sensing range, ignoring walls"),
    Column("visible_area_m2", "double", "m²", "free area in a robot's line of sight"),
    Column("work_J", "double", "J", "integral of |F v| of the controller's forces, sum over the robots"),
    Column("effort_N2_s", "double", "N² s", "integral of |F|² of these forces, sum over the robots"),
    Column("components", "double", "", "connected components of the communication graph"),
    Column("algebraic_connectivity", "double", "", "second smallest Laplacian eigenvalue of this graph"),
    Column(
        "robot_clearance_m", "double", "m", "smallest distance between two robots, null for a single robot"
    ),
    Column("sent_bytes_per_s", "double", "B/s", "size of a robot's messages per second, without positions"),
    Column(
        "near_final_s", "double", "s", "time after which the mean distance stays within 5% of its last value"
    ),
)

RESULT_COLUMNS = (*_METRIC_COLUMNS, _MEAN_TIME_COLUMN, *_OPTIONAL_METRIC_COLUMNS)
"""Columns with results of a run; not every table has all of them."""


def build_columns(study: Study) -> tuple[Column, ...]:
    """Return the columns of a study's table.

    They include the gains of the controllers, and the parameters of robots and conditions that are varied.
    """
    parameter_columns = []
    for name in study.varied_parameters:
        owner = "of the run" if name in CONDITIONS else "of the robots"
        meaning = f"{name.replace('_', ' ')} {owner}"
        kind = "string" if name in TEXT_PARAMETERS else "double"
        parameter_columns.append(Column(name_parameter_column(name), kind, UNITS[name], meaning))
    metric_columns = [*_METRIC_COLUMNS]
    if study.has_mixed_speeds:
        metric_columns.append(_MEAN_TIME_COLUMN)
    if study.metrics:
        metric_columns += _OPTIONAL_METRIC_COLUMNS
    return (
        *_RUN_COLUMNS,
        *_build_gain_columns(study),
        *parameter_columns,
        _DURATION_COLUMN,
        *metric_columns,
        *_FINAL_COLUMNS,
    )


def _build_gain_columns(study: Study) -> list[Column]:
    """Return a column for each gain of the study's controllers; gains of the same name share a column."""
    columns: dict[str, Column] = {}
    for controller in study.controllers:
        gains = get_gains(study.load_controller_class(controller))
        for name in study.get_gains(controller).choices[0]:
            kind = "string" if isinstance(gains[name], Option) else "double"
            column = Column(get_gain_column(name), kind, gains[name].unit, gains[name].meaning)
            if columns.setdefault(name, column).kind != kind:
                # The gain is a number for one controller and a word for another; text suits both.
                columns[name] = columns[name]._replace(kind="string")
    return list(columns.values())


def get_gain_column(name: str) -> str:
    """Return the column name of a gain: its name, with a prefix if another column has the same name."""
    other_columns = (*_RUN_COLUMNS, _DURATION_COLUMN, *RESULT_COLUMNS, *_FINAL_COLUMNS)
    other_names = {column.name for column in other_columns}
    other_names |= {name_parameter_column(parameter) for parameter in UNITS}
    if name in other_names:
        return f"gain_{name}"
    return name


def build_row(task: Task, entry: Entry) -> dict[str, Any]:
    """Return the values of a task's row in the table, by the name of the column."""
    row: dict[str, Any] = {column.name: getattr(task, column.name) for column in _RUN_COLUMNS}
    row |= {get_gain_column(name): value for name, value in task.gains.items()}
    row |= {name_parameter_column(name): value for name, value in task.team.items()}
    row["duration_s"] = task.duration
    row |= entry.metrics
    row["run"] = task.name
    row["error"] = entry.error
    return row


class Table:
    """Writes the rows of a sweep in the order in which they are added; a context manager.

    The files are written under temporary names. When the context ends without an exception, they replace
    earlier files, together with ``study.json``. An incomplete table does not replace one with more rows.

    If the earlier ``results.csv`` is incomplete or missing, the new file replaces it during the sweep, as
    soon as it has as many rows, and then grows. It never ends in an incomplete row.

    Parameters
    ----------
    folder : Path
        Folder of the sweep.
    columns : sequence of Column
        The columns, in order.
    study : bytes, optional
        Content of ``study.json``.
    parquet : bool
        Whether to write a Parquet file as well. An existing Parquet file is always replaced.

    Attributes
    ----------
    is_complete : bool
        Whether all rows have been added; set by the caller before the context ends.
    is_replaced : bool
        Whether the files under their final names contain these rows.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """

    def __init__(
        self, folder: Path, columns: Sequence[Column], study: bytes | None = None, *, parquet: bool = False
    ) -> None:
        self.is_complete = True
        self.is_replaced = False
        self._folder = folder
        self._columns = columns
        self._study = study
        self._writes_parquet = parquet or (folder / SWEEP_PARQUET_FILE).exists()
        self._error: OutputError | None = None
        self._size = 0  # bytes
        self._row_count = -1  # The header is not a row.

    def __enter__(self) -> Table:
        """Open the temporary CSV file and write its header; temporary files are removed at the end."""
        resolve_target(self._folder / SWEEP_TABLE_FILE)
        if self._writes_parquet:
            resolve_target(self._folder / SWEEP_PARQUET_FILE)
            import_optional("pyarrow", "parquet", f"{self._folder / SWEEP_PARQUET_FILE}: ")
        # A complete earlier table stays until the end, an incomplete one until the new table is as long.
        self._earlier_row_count = count_rows(self._folder)
        self._min_rows_to_publish = math.inf if has_all_rows(self._folder) else self._earlier_row_count
        with ExitStack() as stack:
            for name in (_TEMPORARY_CSV_FILE, _TEMPORARY_PARQUET_FILE):
                stack.callback((self._folder / name).unlink, missing_ok=True)
            with _report_write_errors(self._folder / SWEEP_TABLE_FILE):
                self._csv = (self._folder / _TEMPORARY_CSV_FILE).open("wb", buffering=0)
            # A lambda, because `self._csv` may be another file when the callback is called.
            stack.callback(lambda: self._csv.close())
            self._write_line(format_csv_line(column.name for column in self._columns))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, error_type: type[BaseException] | None, *_: object) -> None:
        """Replace earlier files, unless there was an exception, or this table is incomplete and shorter."""
        with self._stack:
            if error_type is not None:
                return
            self._csv.close()
            is_shorter = self._row_count < self._earlier_row_count
            if not self.is_complete and is_shorter:
                return
            self._replace_files()
            self.is_replaced = True

    def _replace_files(self) -> None:
        """Replace the files of an earlier sweep in quick succession, so that the files always match."""
        temporary_names = {}
        main_file = SWEEP_PARQUET_FILE if self._writes_parquet else SWEEP_TABLE_FILE
        with _report_write_errors(self._folder / main_file):
            if self._writes_parquet:
                temporary_names[SWEEP_PARQUET_FILE] = _TEMPORARY_PARQUET_FILE
                csv_file = SWEEP_TABLE_FILE if self.is_replaced else _TEMPORARY_CSV_FILE
                self._write_parquet(self._folder / csv_file)
            if not self.is_replaced:
                temporary_names[SWEEP_TABLE_FILE] = _TEMPORARY_CSV_FILE
            if self._study is not None and not self._has_study(self._study):
                temporary_names[STUDY_FILE] = _TEMPORARY_STUDY_FILE
                (self._folder / _TEMPORARY_STUDY_FILE).write_bytes(self._study)
            written = [self._folder / name for name in temporary_names.values()]
            if self.is_replaced:
                written.append(self._folder / SWEEP_TABLE_FILE)
            flush_to_disk(written)
            for name, temporary_name in temporary_names.items():
                (self._folder / temporary_name).replace(self._folder / name)
            flush_to_disk([self._folder])

    def _has_study(self, content: bytes) -> bool:
        """Return whether ``study.json`` has this content."""
        path = self._folder / STUDY_FILE
        return path.is_file() and path.read_bytes() == content

    def add(self, row: Mapping[str, Any]) -> None:
        """Append a row.

        Parameters
        ----------
        row : mapping
            Values by the name of the column; missing values are null.

        Raises
        ------
        OutputError
            If this row or an earlier one could not be written.
        """
        if self._error is not None:
            raise self._error
        try:
            self._write_line(format_csv_line(row.get(column.name) for column in self._columns))
        except OutputError as error:
            self._error = error
            raise

    def _write_line(self, line: str) -> None:
        """Append a complete line, or nothing, to the CSV file; publish the file once it is long enough."""
        remaining = memoryview(line.encode())
        new_size = self._size + len(remaining)
        with _report_write_errors(self._folder / SWEEP_TABLE_FILE):
            try:
                while remaining:
                    remaining = remaining[self._csv.write(remaining) :]
            except OSError:
                with suppress(OSError):
                    os.ftruncate(self._csv.fileno(), self._size)
                raise
            self._size = new_size
            self._row_count += 1
            if self._row_count >= self._min_rows_to_publish:
                self._publish()

    def _publish(self) -> None:
        """Give the growing CSV file its final name, and open it again to append further rows."""
        # Some systems cannot rename open files.
        self._csv.close()
        (self._folder / _TEMPORARY_CSV_FILE).replace(self._folder / SWEEP_TABLE_FILE)
        self._csv = (self._folder / SWEEP_TABLE_FILE).open("ab", buffering=0)
        self._min_rows_to_publish = math.inf
        self.is_replaced = True

    def _write_parquet(self, csv_path: Path) -> None:
        """Convert a CSV file to Parquet."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        fields = [
            pa.field(column.name, column.kind, metadata={"unit": column.unit, "meaning": column.meaning})
            for column in self._columns
        ]
        schema = pa.schema(fields, metadata={"format": "robocov-results", "version": "1"})
        rows = read_rows(csv_path, {column.name: column.kind for column in self._columns})
        with pq.ParquetWriter(self._folder / _TEMPORARY_PARQUET_FILE, schema) as writer:
            while group := list(islice(rows, ROW_GROUP_SIZE)):
                writer.write_table(pa.Table.from_pylist(group, schema))


@contextmanager
def _report_write_errors(path: Path) -> Iterator[None]:
    """Convert an OSError in the context to an OutputError about a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
