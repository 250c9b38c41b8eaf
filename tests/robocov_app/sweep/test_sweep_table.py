"""The table of a sweep: columns, CSV and Parquet."""

from __future__ import annotations

import csv
import errno
import json
import math
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from small_studies import build_small_study, read_tables

from robocov.controllers import Rapf, get_gains
from robocov.errors import OutputError, RobocovError
from robocov.metrics.results import read_results
from robocov_app.cli import main
from robocov_app.sweep import table as table_module
from robocov_app.sweep.ledger import Entry
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.table import Table, build_columns, build_row, get_gain_column
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import METRICS

COMPLETED = Entry(
    {
        **dict.fromkeys(METRICS, 0.1 + 0.2),
        "contacts": 3,
        "stuck_robots": None,
        "settled_at_s": None,
        "cost_m3": 1e-320,
        "path_length_m": math.pi,
    },
    None,
)
FAILED = Entry({}, 'a "start", and no room')


def build_study_json(study: Study) -> bytes:
    return json.dumps(
        {"runs": len(study), "columns": [each._asdict() for each in build_columns(study)]}
    ).encode()


def write_table(folder: Path, study: Study, entries: list[Entry], *, parquet: bool = False) -> None:
    with Table(folder, build_columns(study), build_study_json(study), parquet=parquet) as table:
        for task, entry in zip(generate_tasks(study), entries, strict=True):
            table.add(build_row(task, entry))


def test_the_columns_depend_on_the_study() -> None:
    study = build_small_study(max_speed=[0.5, 1], controllers=("rpf", "rapf"), starts=("*",))
    assert [column.name for column in build_columns(study)] == [
        *("map", "controller", "robots", "start", "seed"),
        *get_gains(Rapf),
        "max_speed_m_s",
        "duration_s",
        *("mean_distance_m", "mean_distance_over_run_m", "cost_m3", "uncovered_area_m2", "settled_at_s"),
        *("contacts", "min_clearance_m", "path_length_m", "stuck_robots"),
        *("run", "error"),
    ]
    assert "max_speed_m_s" not in [column.name for column in build_columns(build_small_study())]


def test_a_gain_with_the_name_of_a_column_gets_a_prefix() -> None:
    assert get_gain_column("k_rep") == "k_rep"
    assert get_gain_column("seed") == "gain_seed"
    assert get_gain_column("radius_m") == "gain_radius_m"


def test_the_table_contains_every_metric_exactly(tmp_path: Path) -> None:
    study = build_small_study(max_speed=[0.5, 1.0], seeds=(2**63 - 1,))
    entries = [COMPLETED, FAILED, COMPLETED, COMPLETED]
    write_table(tmp_path, study, entries)
    rows = list(read_results(tmp_path).rows())
    with (tmp_path / "results.csv").open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(rows) == len(lines) == 4
    for row, line, task in zip(rows, lines, generate_tasks(study), strict=True):
        assert list(row) == list(line)
        for name, value in row.items():
            if value is None:
                assert line[name] == ""
            else:
                assert type(value)(line[name]) == value
        assert row["run"] == task.name
        assert row["max_speed_m_s"] == task.team["max_speed"]
        assert row["seed"] == 2**63 - 1
    assert rows[0]["mean_distance_m"] == 0.1 + 0.2
    assert rows[0]["cost_m3"] == 1e-320
    assert rows[1]["error"] == 'a "start", and no room'
    assert rows[1]["mean_distance_m"] is None
    assert rows[0]["attraction_limit"] == 2.0
    assert rows[1]["attraction_limit"] is None, "repulsion alone has none"


def test_texts_that_look_like_formulas_are_escaped(tmp_path: Path) -> None:
    study = build_small_study()
    task = replace(next(iter(generate_tasks(study))), map="=1+1", start="-1")
    with Table(tmp_path, build_columns(study), build_study_json(study), parquet=True) as table:
        table.add(build_row(task, FAILED._replace(error="+ of 'two'")))
    line = (tmp_path / "results.csv").read_text().splitlines()[1]
    assert line.startswith("'=1+1,")
    # No field starts with a formula character, except for negative numbers.
    assert not re.search(r'(^|,)"?[=@+-][^,0-9]', line)
    (row,) = read_results(tmp_path).rows()
    assert (row["map"], row["start"], row["error"]) == ("=1+1", "-1", "+ of 'two'")
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    assert parquet.read_table(tmp_path / "results.parquet").to_pylist()[0]["map"] == "=1+1"


def test_parquet_has_the_same_rows_and_described_columns(tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    study = build_small_study(max_speed=[0.5, 1.0], seeds=(2**63 - 1,))
    write_table(tmp_path, study, [COMPLETED, FAILED, COMPLETED, COMPLETED], parquet=True)
    assert pq.read_table(tmp_path / "results.parquet").to_pylist() == list(read_results(tmp_path).rows())
    schema = pq.read_schema(tmp_path / "results.parquet")
    assert schema.metadata[b"format"] == b"robocov-results"
    for field in schema:
        assert field.metadata[b"meaning"]
    assert schema.field("mean_distance_m").metadata[b"unit"] == b"m"
    assert schema.field("k_rep").metadata == {
        b"unit": "N m³".encode(),
        b"meaning": b"strength of the repulsion, (24)",
    }
    assert str(schema.field("contacts").type) == "int64"


def test_equal_rows_give_equal_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr(table_module, "ROW_GROUP_SIZE", 3)
    study = build_small_study(seeds=range(5))
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_table(tmp_path / name, study, [COMPLETED] * len(study), parquet=True)
    assert len(read_tables(tmp_path / "one")) == 2
    assert read_tables(tmp_path / "one") == read_tables(tmp_path / "two")
    groups = pq.ParquetFile(tmp_path / "one" / "results.parquet").metadata
    assert [groups.row_group(k).num_rows for k in range(groups.num_row_groups)] == [3, 3, 3, 1]


@pytest.fixture
def no_pyarrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)


@pytest.mark.usefixtures("no_pyarrow")
def test_without_pyarrow_parquet_is_rejected_before_the_first_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = build_small_study()
    write_table(tmp_path, study, [COMPLETED] * len(study))
    assert [len(row) for row in read_results(tmp_path).rows()] == [len(build_columns(study))] * len(study)
    message = 'pyarrow is not installed: pip install "robocov[parquet]"'
    for options in ([], ["--dry-run"]):
        assert main(["sweep", "study.toml", "--parquet", *options]) == 2
        assert capsys.readouterr().err == f"robocov: error: {message}\n"
    before = read_tables(tmp_path)
    (tmp_path / "results.parquet").touch()  # an older file, which would not contain these rows
    for is_requested in (True, False):
        error = pytest.raises(RobocovError, match=re.escape(f"{tmp_path}/results.parquet: {message}"))
        with error, Table(tmp_path, build_columns(study), parquet=is_requested):
            pass
    assert read_tables(tmp_path) == [*before, b""]
    assert not list(tmp_path.glob(".*"))


def test_an_existing_parquet_file_is_updated(tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    for study in (build_small_study(), build_small_study(seeds=range(5))):
        write_table(tmp_path, study, [COMPLETED] * len(study), parquet=len(study) == 4)
        assert pq.read_table(tmp_path / "results.parquet").num_rows == len(study)


def test_a_table_without_rows_has_columns(tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    with Table(tmp_path, build_columns(build_small_study()), parquet=True):
        pass
    assert pq.read_table(tmp_path / "results.parquet").num_rows == len(read_results(tmp_path)) == 0


def test_in_a_first_sweep_csv_grows_and_parquet_appears_at_the_end(tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    study = build_small_study()
    tasks = list(generate_tasks(study))
    with Table(tmp_path, build_columns(study), b"{}", parquet=True) as table:
        for k, task in enumerate(tasks):
            table.add(build_row(task, COMPLETED))
            assert len((tmp_path / "results.csv").read_text().splitlines()) == k + 2
            assert not (tmp_path / "results.parquet").exists()
    assert pq.read_table(tmp_path / "results.parquet").num_rows == len(tasks)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("results.csv", "results.parquet"),
        "study.json",
    ]


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.parametrize(("complete", "rows"), [(True, 3), (False, 3), (False, 4)])
def test_a_table_is_not_replaced_by_an_incomplete_shorter_one(
    tmp_path: Path, complete: bool, rows: int, finished: bool
) -> None:
    study = build_small_study()
    write_table(tmp_path, study, [COMPLETED] * len(study))
    if not finished:  # as if the sweep had been killed
        (tmp_path / "study.json").write_bytes(build_study_json(build_small_study(seeds=range(5))))
    before = [(tmp_path / name).read_bytes() for name in ("results.csv", "study.json")]
    with Table(tmp_path, build_columns(study), b"{}") as table:
        for k, task in enumerate(list(generate_tasks(study))[:rows]):
            table.add(build_row(task, FAILED))
            if k == 3 and not finished:
                break  # the table is as long as the old one, which it now replaces
            assert [(tmp_path / name).read_bytes() for name in ("results.csv", "study.json")] == before
        table.is_complete = complete
    replaced = complete or rows == 4  # no shorter
    assert table.is_replaced == replaced == ((tmp_path / "study.json").read_bytes() == b"{}")
    text = (tmp_path / "results.csv").read_text()
    assert ("no room" in text) == replaced
    assert len(text.splitlines()) == (1 + rows if replaced else 5)
    assert not list(tmp_path.glob(".*"))


def test_a_growing_table_replaces_that_of_a_killed_sweep_of_equal_length(
    tmp_path: Path,
) -> None:
    study = build_small_study()
    write_table(tmp_path, study, [COMPLETED] * len(study))
    (tmp_path / "study.json").unlink()
    lengths = []
    with Table(tmp_path, build_columns(study)) as table:
        for task in [*generate_tasks(study)] * 2:
            table.add(build_row(task, FAILED))
            text = (tmp_path / "results.csv").read_text()
            lengths.append(text.count("\n") - 1 if "no room" in text else None)
    assert lengths == [None, None, None, 4, 5, 6, 7, 8]


@pytest.mark.parametrize("name", ["results.csv", "results.parquet"])
def test_folders_are_not_replaced(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    error = pytest.raises(OutputError, match=f"{name}: expected a file, got a folder")
    with error, Table(tmp_path, build_columns(build_small_study()), parquet=True):
        pass


def test_an_error_leaves_no_partial_table(tmp_path: Path) -> None:
    study = build_small_study()
    with pytest.raises(ZeroDivisionError), Table(tmp_path, build_columns(study)) as table:
        table.add(build_row(next(generate_tasks(study)), COMPLETED))
        raise ZeroDivisionError
    assert [path.name for path in tmp_path.iterdir()] == ["results.csv"]


class Full:
    """A file on a disk with room for a few more bytes."""

    def __init__(self, file: Any, room: int) -> None:
        self._file = file
        self._room = room

    def write(self, data: bytes) -> int:
        if not self._room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = self._file.write(data[: self._room])
        self._room -= count
        return count

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def test_a_full_disk_leaves_no_partial_row(tmp_path: Path) -> None:
    study = build_small_study()
    row = build_row(next(generate_tasks(study)), COMPLETED)
    full = pytest.raises(OutputError, match=r"results.csv: cannot be written: No space left")
    with full, Table(tmp_path, build_columns(study)) as table:
        table.add(row)
        whole = table._csv
        table._csv = Full(whole, 40)  # type: ignore[assignment]
        with pytest.raises(OutputError):
            table.add(row)
        table._csv = whole
        table.add(row)  # one is missing now
    lines = (tmp_path / "results.csv").read_text().splitlines()
    assert len(lines) == 2
    assert len(lines[0].split(",")) == len(lines[1].split(","))
    assert [path.name for path in tmp_path.iterdir()] == ["results.csv"]


@pytest.mark.parametrize("broken", ["write_table", "__exit__"])
def test_a_full_disk_leaves_no_partial_parquet_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: str
) -> None:
    def fail_as_disk_is_full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    pq = pytest.importorskip("pyarrow.parquet")
    study = build_small_study()
    error = pytest.raises(OutputError, match=r"results.parquet: cannot be written: No space left")
    with error, Table(tmp_path, build_columns(study), parquet=True) as table:
        monkeypatch.setattr(pq.ParquetWriter, broken, fail_as_disk_is_full)
        table.add(build_row(next(generate_tasks(study)), COMPLETED))
    monkeypatch.undo()
    assert [path.name for path in tmp_path.iterdir()] == ["results.csv"]


def test_a_table_in_a_missing_folder_is_rejected(tmp_path: Path) -> None:
    error = pytest.raises(OutputError, match=r"results.csv: cannot be written")
    with error, Table(tmp_path / "none", build_columns(build_small_study())):
        pass


def test_columns_have_unique_names_for_any_gains(tmp_path: Path) -> None:
    (tmp_path / "odd.py").write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Odd:\n"
        "    seed: float = 1.0\n"
        "    k_rep: float = 2.0\n"
        "    def force(self, own):\n"
        "        return own.centroid - own.position\n"
    )
    study = build_small_study(controllers=("rapf", "rpf", "lloyd", "odd.py:Odd"), folder=tmp_path)
    names = [column.name for column in build_columns(study)]
    assert len(set(names)) == len(names)
    rows = [build_row(task, COMPLETED) for task in generate_tasks(study) if task.seed == 1]
    assert [(row["seed"], row.get("gain_seed")) for row in rows] == [(1, None)] * 3 + [(1, 1.0)]
    assert rows[-1]["k_rep"] == 2.0
