"""The results of a sweep, read back: a table that need not fit into memory, and the runs behind its rows."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import InputError, counted, shown, unknown_name
from robocov.extras import extra
from robocov.metrics import CostHistory
from robocov.record import Record

if TYPE_CHECKING:
    import pyarrow as pa
    from pandas import DataFrame
    from pyarrow.compute import Expression
    from pyarrow.dataset import Dataset

_HISTORY = ("time_s", "mean_distance_m", "cost_m3", "uncovered_area_m2")
_TIME = "mean_time_s"
"""A last column, where robots are not equally fast."""

_TEXTS = frozenset(("map", "controller", "start", "run", "error"))
_WHOLES = frozenset(("robots", "seed", "contacts", "stuck_robots"))
"""Columns that hold no floats."""

_SHOWN_ROWS = 10
"""Rows that notebooks show."""


class Results:
    """The table of a sweep, one row a run, and the folders of the runs; all is read when it is asked for.

    `dataset` is the table as pyarrow knows it, with the `columns`: where a run stands (``map``,
    ``controller``, ``robots``, ``start``, ``seed``), gains and whatever else was varied; figures with their
    units; ``run``, the name of its folder, and ``error``.

    >>> results = read_results("study")  # doctest: +SKIP
    >>> results.to_pandas().groupby("controller")["mean_distance_m"].median()  # doctest: +SKIP
    """

    def __init__(self, folder: Path, dataset: Dataset) -> None:
        self.folder = folder
        self.dataset = dataset
        self.columns: tuple[str, ...] = tuple(dataset.schema.names)

    def __len__(self) -> int:
        """Number of runs, failed ones included."""
        return int(self.dataset.count_rows())

    def __repr__(self) -> str:
        return f"<Results {self.folder}, {counted(len(self), 'run')}>"

    @property
    def study(self) -> dict[str, Any]:
        """The content of ``study.json``: what was to be run; an InputError where it cannot be read."""
        path = self.folder / "study.json"
        try:
            return dict(json.loads(path.read_bytes()))
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"{path}: cannot be read: {error}") from error

    def to_table(self, columns: Sequence[str] | None = None, filter: Expression | None = None) -> pa.Table:
        """Return rows as a pyarrow Table, by default all, with all columns.

        A filter is as in ``pyarrow.compute.field("robots") == 6``. Raises InputError when there is no such
        column; the message gives the nearest.
        """
        return self.dataset.to_table(columns=self._known(columns), filter=filter)

    def to_pandas(self, columns: Sequence[str] | None = None, filter: Expression | None = None) -> DataFrame:
        """Return the rows as a data frame, as `to_table`; pandas comes with ``robocov[pandas]``."""
        extra("pandas", "pandas")
        frame: DataFrame = self.to_table(columns, filter).to_pandas()
        return frame

    def batches(
        self, columns: Sequence[str] | None = None, filter: Expression | None = None
    ) -> Iterator[pa.RecordBatch]:
        """Yield the rows part by part, in order; the parameters are those of `to_table`."""
        yield from self.dataset.to_batches(columns=self._known(columns), filter=filter)

    def failures(self) -> list[dict[str, Any]]:
        """Return the rows of the runs that failed, as dicts by column; why is in ``error``."""
        from pyarrow.compute import field

        return list(self.to_table(filter=field("error").is_valid()).to_pylist())

    def record(self, run: str | int | Mapping[str, Any]) -> Record:
        """Return the record of a run; its moments are as far apart as the study wanted it.

        A run is named by its folder, the number of its row, or the row. Raises InputError when there is no
        such run, or it failed.
        """
        return Record.load(self._folder_of(run))

    def history(self, run: str | int | Mapping[str, Any]) -> CostHistory:
        """Return the coverage cost along a run, which is named as in `record`; it raises the same."""
        return read_history(self._folder_of(run) / "cost.csv")

    def _known(self, columns: Sequence[str] | None) -> list[str] | None:
        for name in columns or ():
            if name not in self.columns:
                raise InputError(f"{self.folder}: {unknown_name('column', name, self.columns)}")
        return None if columns is None else list(columns)

    def _folder_of(self, run: str | int | Mapping[str, Any]) -> Path:
        if isinstance(run, int | np.integer):
            number, count = int(run), len(self)
            if not -count <= number < count:
                raise InputError(f"{self.folder}: row {number}, but there are {counted(count, 'row')}")
            run = str(self.dataset.take([number % count], columns=["run"])["run"][0].as_py())
        elif not isinstance(run, str):
            run = str(run["run"])
        folder = self.folder / "runs" / run
        if not run or Path(run).name != run or not folder.is_dir():
            raise InputError(f"{self.folder}: there is no run {shown(run)}")
        error = folder / "error.json"
        if error.is_file():
            raise InputError(f"{folder}: the run failed: {_reason(error)}")
        return folder

    def _repr_html_(self) -> str:
        """Show the first rows in notebooks."""
        head, count = self.dataset.head(_SHOWN_ROWS).to_pylist(), len(self)
        cells = [[f"<th>{escape(name)}</th>" for name in self.columns]]
        cells += [[f"<td>{escape(_cell(row[name]))}</td>" for name in self.columns] for row in head]
        rows = [f"<tr>{''.join(row)}</tr>" for row in cells]
        caption = f"{counted(count, 'run')} of {escape(str(self.folder))}"
        if count > len(head):
            caption += f"; the first {len(head)}"
        return (
            f'<div style="overflow-x: auto"><table style="white-space: nowrap"><caption>{caption}</caption>'
            f"<thead>{rows[0]}</thead><tbody>{''.join(rows[1:])}</tbody></table></div>"
        )


def read_results(folder: Path | str) -> Results:
    """Return the results in the folder of a sweep.

    While the sweep is still going on, or was killed, they are those in ``results.csv``, which grows. Raises
    InputError when the folder holds no sweep, or its table cannot be read.
    """
    from pyarrow import ArrowException
    from pyarrow import dataset as datasets

    folder = Path(folder)
    whole, growing = folder / "results.parquet", folder / "results.csv"
    path = whole if whole.is_file() else growing
    if not path.is_file():
        raise InputError(f"{folder}: not the folder of a sweep (there is no results.parquet)")
    try:
        form = "parquet" if path is whole else _csv_format(path)
        return Results(folder, datasets.dataset(path, format=form))
    except (OSError, ArrowException, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error


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
            raise InputError(f"{path}: line {k + 2}: {shown(line)}, but {wanted}") from None
    return CostHistory(*rows.T)


def _csv_format(path: Path) -> Any:
    """Return how a table is to be read of which CSV does not say what its columns hold."""
    from pyarrow import csv as csv_files
    from pyarrow import dataset as datasets
    from pyarrow import float64, int64, string

    with path.open(encoding="utf-8", newline="") as file:
        names = next(csv.reader(file), [])
    if not {"run", "error"} <= set(names):
        raise ValueError("line 1: the header of a table of results was wanted")
    texts = _TEXTS | _word_columns(path.with_name("study.json"))
    types = {name: string() if name in texts else int64() if name in _WHOLES else float64() for name in names}
    # a map may be called NA
    options = csv_files.ConvertOptions(
        column_types=types, null_values=[""], strings_can_be_null=True, quoted_strings_can_be_null=False
    )
    return datasets.CsvFileFormat(convert_options=options)


def _word_columns(study: Path) -> set[str]:
    """Return which columns hold gains that are words, by the content of ``study.json``."""
    try:
        laws = json.loads(study.read_bytes())["gains"].values()
        choices = [choice for law in laws for choice in law["choices"]]
        names = {name for choice in choices for name, value in choice.items() if isinstance(value, str)}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return set()  # a table without its study is read all the same, as one of numbers
    return names | {f"gain_{name}" for name in names}


def _reason(path: Path) -> str:
    try:
        return str(json.loads(path.read_bytes())["error"])
    except (OSError, ValueError, KeyError, TypeError):
        return "why cannot be read"


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)
