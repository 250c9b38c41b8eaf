"""The table of a sweep: ``results.csv``, which grows in a first sweep, and as Parquet ``results.parquet``."""

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
from robocov.files.writing import flush_to_disk, resolve_target
from robocov.metrics.results import read_rows
from robocov.optional_imports import import_optional
from robocov_app.sweep.ledger import CSV, STUDY, Entry, has_all_rows, rows_in
from robocov_app.sweep.parameters import CONDITIONS, TEXT_PARAMETERS, UNITS, name_parameter_column
from robocov_app.sweep.study import Study
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import FIGURES, MEAN_TIME
from robocov_app.terminal.output import format_csv_line

PARQUET = "results.parquet"
_CSV_PART, _PARQUET_PART = ".results.part.csv", ".results.part.parquet"  # names while a table is written
ROW_GROUP = 4096  # rows of a row group of Parquet, and the most that are in memory


class Column(NamedTuple):
    """A column of the table."""

    name: str
    kind: str
    unit: str
    meaning: str


_BEFORE = (
    Column("map", "string", "", "the map, as the study calls it"),
    Column("controller", "string", "", "the controller"),
    Column("robots", "int64", "", "number of robots"),
    Column("start", "string", "", "the start, as the map calls it"),
    Column("seed", "int64", "", "seed of the starting positions"),
)
_DURATION = Column("duration_s", "double", "s", "simulated time")
_FIGURES = tuple(Column(name, *facts) for name, facts in FIGURES.items())
_AFTER = (
    Column("run", "string", "", "the run's folder in runs/"),
    Column("error", "string", "", "why the run failed, null if it did not"),
)
_TIME = Column(
    MEAN_TIME, "double", "s", "mean time until the first robot is at a place, each at its top speed"
)
_METRICS = (
    Column("sensed_area_m2", "double", "m²", "free area in a robot's sensing range and line of sight"),
    Column("range_area_m2", "double", "m²", "free area in a robot's sensing range, walls or not"),
    Column("visible_area_m2", "double", "m²", "free area in a robot's line of sight"),
    Column("work_J", "double", "J", "integral of |F v| of the forces asked for, all robots together"),
    Column("effort_N2_s", "double", "N² s", "integral of |F|² of these, all robots together"),
    Column("components", "double", "", "parts into which the team falls that hear each other"),
    Column("algebraic_connectivity", "double", "", "of the graph of who hears whom"),
    Column("robot_clearance_m", "double", "m", "smallest gap between two robots, null where there is one"),
    Column("near_final_s", "double", "s", "from when on the mean distance was within 5 % of that of the end"),
)


def columns_of(study: Study) -> tuple[Column, ...]:
    """Return the columns of a study's table: the gains and the teams that it tries among those of all."""
    gains: dict[str, Column] = {}
    for controller in study.controllers:
        known = get_gains(study.load_controller_class(controller))
        for name in study.get_gains(controller).choices[0]:
            kind = "string" if isinstance(known[name], Option) else "double"
            column = Column(gain_column(name), kind, known[name].unit, known[name].meaning)
            if gains.setdefault(name, column).kind != kind:
                # a number here and a word there: both can be written as words
                gains[name] = gains[name]._replace(kind="string")
    team = []
    for name in study.varied_parameters:
        meaning = f"{name.replace('_', ' ')} {'of the run' if name in CONDITIONS else 'of the robots'}"
        kind = "string" if name in TEXT_PARAMETERS else "double"
        team.append(Column(name_parameter_column(name), kind, UNITS[name], meaning))
    figures = (*_FIGURES, *((_TIME,) if study.has_mixed_speeds else ()), *(_METRICS if study.metrics else ()))
    return (*_BEFORE, *gains.values(), *team, _DURATION, *figures, *_AFTER)


def gain_column(name: str) -> str:
    """Return the name of the column of a gain: its own, unless another column has it."""
    taken = {column.name for column in (*_BEFORE, _DURATION, *_FIGURES, _TIME, *_METRICS, *_AFTER)}
    taken |= {name_parameter_column(name) for name in UNITS}
    return f"gain_{name}" if name in taken else name


def row_of(task: Task, entry: Entry) -> dict[str, Any]:
    row: dict[str, Any] = {column.name: getattr(task, column.name) for column in _BEFORE}
    row |= {gain_column(name): value for name, value in task.gains.items()}
    row |= {name_parameter_column(name): value for name, value in task.team.items()}
    return {**row, "duration_s": task.duration, **entry.figures, "run": task.name, "error": entry.error}


class Table:
    """Writes the rows of a sweep in the order in which they come; a context.

    The files are written aside, and replace earlier ones, with ``study.json``, when the context ends well;
    if not `complete`, none with more rows. A first ``results.csv`` appears as soon as it is no shorter than
    what is there, and grows. `replaced`: whether the files are of these rows. No half of a row is ever left.
    Parquet is written on request, and where a file of it is there already.
    """

    def __init__(
        self, folder: Path, columns: Sequence[Column], study: bytes | None = None, *, parquet: bool = False
    ) -> None:
        self.complete, self.replaced = True, False
        self._names = (CSV, *[PARQUET] * (parquet or (folder / PARQUET).exists()))
        self._folder, self._columns, self._study = folder, columns, study
        self._broken: OutputError | None = None
        self._size, self._count = 0, -1  # the header is no row

    def __enter__(self) -> Table:
        for name in self._names:
            resolve_target(self._folder / name)
            if name == PARQUET:
                import_optional("pyarrow", "parquet", f"{self._folder / name}: ")
        # rows of an earlier table, which only one that grows replaces before the end
        self._former = rows_in(self._folder)
        self._shown_from = math.inf if has_all_rows(self._folder) else self._former
        with ExitStack() as stack:
            for part in (_CSV_PART, _PARQUET_PART):
                stack.callback((self._folder / part).unlink, missing_ok=True)
            with _told(self._folder / CSV):
                self._csv = (self._folder / _CSV_PART).open("wb", buffering=0)
            stack.callback(lambda: self._csv.close())  # it may be another one by then
            self._write(format_csv_line(column.name for column in self._columns))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *exception: Any) -> None:
        """Replace the files of an earlier sweep by those of this one, all after another at once."""
        with self._stack:
            if exception[0] is not None:
                return
            self._csv.close()
            if not self.complete and self._count < self._former and not self.replaced:
                return
            names = {} if self.replaced else {CSV: _CSV_PART}
            with _told(self._folder / self._names[-1]):
                if PARQUET in self._names:
                    names = {PARQUET: _PARQUET_PART} | names
                    self._write_parquet(self._folder / names.get(CSV, CSV))
                study = self._folder / STUDY
                if self._study is not None and not (study.is_file() and study.read_bytes() == self._study):
                    names[STUDY] = ".study.part.json"
                    (self._folder / names[STUDY]).write_bytes(self._study)
                grown = [self._folder / CSV] * self.replaced
                flush_to_disk([self._folder / part for part in names.values()] + grown)
                for name, part in names.items():
                    (self._folder / part).replace(self._folder / name)
                flush_to_disk([self._folder])
            self.replaced = True

    def add(self, row: Mapping[str, Any]) -> None:
        """Append a row; what it does not hold is null."""
        if self._broken is not None:
            raise self._broken
        try:
            self._write(format_csv_line(row.get(column.name) for column in self._columns))
        except OutputError as error:
            self._broken = error
            raise

    def _write(self, line: str) -> None:
        """Append a line to the CSV file, all of it or nothing, and show the file when it is time."""
        rest = memoryview(line.encode())
        size = self._size + len(rest)
        with _told(self._folder / CSV):
            try:
                while rest:
                    rest = rest[self._csv.write(rest) :]
            except OSError:
                with suppress(OSError):
                    os.ftruncate(self._csv.fileno(), self._size)
                raise
            self._size, self._count = size, self._count + 1
            if self._count >= self._shown_from:
                self._csv.close()  # open files cannot be renamed everywhere
                (self._folder / _CSV_PART).replace(self._folder / CSV)
                self._csv = (self._folder / CSV).open("ab", buffering=0)
                self._shown_from, self.replaced = math.inf, True

    def _write_parquet(self, table: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        fields = (
            pa.field(name, kind, metadata={"unit": unit, "meaning": meaning})
            for name, kind, unit, meaning in self._columns
        )
        schema = pa.schema(fields, metadata={"format": "robocov-results", "version": "1"})
        rows = read_rows(table, {column.name: column.kind for column in self._columns})
        with pq.ParquetWriter(self._folder / _PARQUET_PART, schema) as writer:
            while group := list(islice(rows, ROW_GROUP)):
                writer.write_table(pa.Table.from_pylist(group, schema))


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Raise OutputError where the system refuses to write a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
