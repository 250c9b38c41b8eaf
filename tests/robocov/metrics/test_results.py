from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from pyarrow.compute import field

import robocov as rc
from robocov import extras
from robocov.errors import InputError, RobocovError
from robocov.metrics.results import read_history, read_results

ROWS = [
    {
        "map": "NA",  # as good a name as any
        "controller": "rapf",
        "robots": 6,
        "start": "corner",
        "seed": 2**60,
        "k_rep": 0.1 + 0.2,
        "mean_distance_m": 1.5,
        "contacts": 3,
        "settled_at_s": None,
        "run": "a-run",
        "error": None,
    },
    {
        "map": "<b>rooms</b>",
        "controller": "lloyd",
        "robots": 6,
        "start": "corner",
        "seed": 0,
        "k_rep": None,
        "mean_distance_m": None,
        "contacts": None,
        "settled_at_s": None,
        "run": "a-failure",
        "error": 'no "room", none',
    },
]
SCHEMA = pa.schema(
    [
        *((name, pa.string()) for name in ("map", "controller")),
        ("robots", pa.int64()),
        ("start", pa.string()),
        ("seed", pa.int64()),
        *((name, pa.float64()) for name in ("k_rep", "mean_distance_m")),
        ("contacts", pa.int64()),
        ("settled_at_s", pa.float64()),
        *((name, pa.string()) for name in ("run", "error")),
    ]
)


def table(times: int = 1) -> pa.Table:
    return pa.Table.from_pylist(ROWS * times, schema=SCHEMA)


@pytest.fixture
def folder(tmp_path: Path, cluttered: rc.Environment) -> Path:
    pq.write_table(table(), tmp_path / "results.parquet")
    run = tmp_path / "runs" / "a-run"
    run.mkdir(parents=True)
    simulation = rc.Simulation(cluttered, rc.Rapf(), cluttered.start().sample(2), dt=0.1)
    simulation.run(1.0).save(run)
    (run / "cost.csv").write_text(
        "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n0.0,2.5,100.0,0.0\n1.0,2.0,80.0,nan\n"
    )
    failure = tmp_path / "runs" / "a-failure"
    failure.mkdir()
    (failure / "error.json").write_text('{"error": "no room"}')
    (tmp_path / "study.json").write_text('{"format": "robocov-study", "seeds": [0]}')
    return tmp_path


def test_a_table_is_read(folder: Path) -> None:
    results = rc.read_results(str(folder))
    assert isinstance(results, rc.Results)
    assert len(results) == 2
    assert results.columns == tuple(SCHEMA.names)
    assert results.to_table().to_pylist() == ROWS
    assert results.study["seeds"] == [0]
    assert repr(results) == f"<Results {folder}, 2 runs>"


def test_columns_and_rows_can_be_chosen(folder: Path) -> None:
    results = read_results(folder)
    assert results.to_table(["seed", "map"]).column_names == ["seed", "map"]
    assert results.to_table(filter=field("contacts") > 1)["run"].to_pylist() == ["a-run"]
    frame = results.to_pandas(["controller", "mean_distance_m"], field("controller") == "rapf")
    assert frame.to_dict("list") == {"controller": ["rapf"], "mean_distance_m": [1.5]}
    with pytest.raises(InputError, match="unknown column 'mean_distance': did you mean 'mean_distance_m'"):
        results.to_table(["mean_distance"])


def test_failures_are_rows(folder: Path) -> None:
    assert read_results(folder).failures() == ROWS[1:]


def test_runs_are_found_by_name_by_number_and_by_row(folder: Path) -> None:
    results = read_results(folder)
    for run in ("a-run", 0, -2, np.int64(0), ROWS[0]):
        record = results.record(run)
        assert len(record) == 11
        history = results.history(run)
        assert history.mean_distance.tolist() == [2.5, 2.0]
        assert np.isnan(history.uncovered_area[1])


@pytest.mark.parametrize(
    ("run", "message"),
    [
        ("another", "there is no run 'another'"),
        ("../runs/a-run", "there is no run '../runs/a-run'"),
        ("", "there is no run ''"),
        (2, "row 2, but there are 2 rows"),
        (-3, "row -3, but there are 2 rows"),
        (1, "a-failure: the run failed: no room"),
        ("a-failure", "a-failure: the run failed: no room"),
    ],
)
def test_runs_that_are_not_there_are_named(folder: Path, run: Any, message: str) -> None:
    results = read_results(folder)
    for read in (results.record, results.history):
        with pytest.raises(InputError) as caught:
            read(run)
        assert message in str(caught.value)


def test_a_growing_table_is_read_as_it_is(folder: Path) -> None:
    (folder / "results.parquet").unlink()
    pyarrow.csv.write_csv(table(), folder / "results.csv", pa.csv.WriteOptions(quoting_style="needed"))
    results = read_results(folder)
    assert results.to_table().to_pylist() == ROWS
    assert results.to_table().schema.remove_metadata() == SCHEMA
    assert len(results) == 2


def test_rows_come_part_by_part_and_only_when_they_are_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pq.ParquetWriter(tmp_path / "results.parquet", SCHEMA) as writer:
        for _ in range(50):
            writer.write_table(table(500), row_group_size=1000)
    before = pa.total_allocated_bytes()
    results = read_results(tmp_path)
    assert len(results) == 50_000
    assert pa.total_allocated_bytes() - before < 100_000
    batches = results.batches(["seed"])
    first = next(batches)
    assert first.num_rows == 1000
    assert first.schema.names == ["seed"]
    assert 1000 + sum(batch.num_rows for batch in batches) == 50_000
    assert sum(batch.num_rows for batch in results.batches(filter=field("seed") == 0)) == 25_000


def test_notebooks_show_the_first_rows(folder: Path, tmp_path: Path) -> None:
    shown = read_results(folder)._repr_html_()
    assert "&lt;b&gt;rooms&lt;/b&gt;" in shown and "<b>" not in shown
    assert "2 runs of" in shown
    assert shown.count("<tr>") == 1 + 2
    many = tmp_path / "many"
    many.mkdir()
    pq.write_table(table(20), many / "results.parquet")
    shown = read_results(many)._repr_html_()
    assert shown.count("<tr>") == 1 + 10
    assert "40 runs of" in shown and "the first 10" in shown


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("notes.txt", b"", "not the folder of a sweep (there is no results.parquet)"),
        ("results.parquet", b"no parquet", "results.parquet: cannot be read: "),
        (
            "results.csv",
            b"",
            "results.csv: cannot be read: line 1: the header of a table of results was wanted",
        ),
        ("results.csv", b"a,b\n1,2\n", "results.csv: cannot be read: line 1: "),
        ("results.csv", b"\xff\xfe", "results.csv: cannot be read: "),
    ],
)
def test_what_is_no_table_is_named(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_results(tmp_path)
    assert str(caught.value).startswith(str(tmp_path)) and message in str(caught.value)


def test_a_study_that_cannot_be_read_is_named(folder: Path) -> None:
    (folder / "study.json").write_text("{")
    with pytest.raises(InputError, match=r"study.json: cannot be read"):
        _ = read_results(folder).study


def test_without_pandas_the_extra_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr(extras.importlib, "import_module", missing)
    with pytest.raises(RobocovError, match=r'pip install "robocov\[pandas\]"'):
        read_results(folder).to_pandas()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the header time_s,mean_distance_m,cost_m3,uncovered_area_m2 was wanted"),
        ("time_s\n", "line 1: the header "),
        ("time_s,mean_distance_m,cost_m3,uncovered_area_m2\n1,2,3,4\n1,2\n", "line 3: '1,2', but 4 numbers"),
        (
            "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n1,2,three,4\n",
            "line 2: '1,2,three,4', but 4 num",
        ),
    ],
)
def test_a_file_that_is_no_history_is_named_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "cost.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_history(path)
    assert f"{path}: {message}" in str(caught.value)
    with pytest.raises(InputError, match=r"none.csv: cannot be read"):
        read_history(tmp_path / "none.csv")


@pytest.mark.slow
def test_reading_does_not_load_what_is_not_needed(folder: Path) -> None:
    script = (
        "import sys, robocov as rc\n"
        "assert 'pyarrow' not in sys.modules\n"
        f"results = rc.read_results({str(folder)!r})\n"
        "assert 'matplotlib' not in sys.modules\n"
        "print(len(results))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "2\n"
