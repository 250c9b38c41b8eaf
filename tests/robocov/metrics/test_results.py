"""Tables of results: columns, failed runs, finding runs, and invalid tables."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robocov as rc
from robocov import optional_imports
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
KINDS = {"k_rep": "double", "mean_distance_m": "double", "settled_at_s": "double"}


def write_table(folder: Path, rows: list[dict[str, Any]]) -> None:
    with (folder / "results.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(ROWS[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


@pytest.fixture
def folder(tmp_path: Path, cluttered: rc.Environment) -> Path:
    write_table(tmp_path, ROWS)
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
    columns = [{"name": name, "kind": kind} for name, kind in KINDS.items()]
    study = {"format": "robocov-study", "seeds": [0], "columns": columns}
    (tmp_path / "study.json").write_text(json.dumps(study))
    return tmp_path


def test_tables_are_read(folder: Path) -> None:
    results = rc.read_results(str(folder))
    assert isinstance(results, rc.Results)
    assert len(results) == 2
    assert results.columns == tuple(ROWS[0])
    assert list(results.rows()) == ROWS
    assert results.study["seeds"] == [0]
    assert repr(results) == f"<Results {folder}, 2 runs>"


def test_columns_can_be_selected(folder: Path) -> None:
    results = read_results(folder)
    assert list(results.rows(["seed", "map"])) == [{"seed": row["seed"], "map": row["map"]} for row in ROWS]
    assert [list(row) for row in results.rows(["seed", "map"])] == [["seed", "map"]] * 2
    with pytest.raises(InputError, match="unknown column 'mean_distance': did you mean 'mean_distance_m'"):
        results.rows(["mean_distance"])


def test_rows_are_a_data_frame(folder: Path) -> None:
    pytest.importorskip("pandas")
    frame = read_results(folder).to_pandas()
    assert list(frame) == list(ROWS[0])
    assert {str(frame[name].dtype) for name in ("k_rep", "mean_distance_m", "settled_at_s")} == {"float64"}
    assert frame["map"].to_list() == ["NA", "<b>rooms</b>"] and frame["seed"][0] == 2**60
    assert frame["error"].isna().to_list() == [True, False]
    few = read_results(folder).to_pandas(["controller", "mean_distance_m"])
    assert few.dropna().to_dict("list") == {"controller": ["rapf"], "mean_distance_m": [1.5]}


def test_no_columns_are_read_if_none_are_selected(folder: Path) -> None:
    assert list(read_results(folder).rows([])) == [{}, {}]


def test_columns_can_be_selected_by_an_array(folder: Path) -> None:
    rows = read_results(folder).rows(np.array(["seed", "map"]))
    assert [row["seed"] for row in rows] == [row["seed"] for row in ROWS]


def test_failures_returns_the_rows_of_failed_runs(folder: Path) -> None:
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
        ("..", "there is no run '..'"),
        (2, "there is no row 2 (of 2 rows)"),
        (-3, "there is no row -3 (of 2 rows)"),
        (1, "a-failure: the run failed: no room"),
        ("a-failure", "a-failure: the run failed: no room"),
        ({"controller": "rapf"}, "run: expected the name of a run, the index of its row, or a row with"),
        (None, "run: expected the name of a run, the index of its row, or a row with"),
    ],
)
def test_errors_name_missing_runs(folder: Path, run: Any, message: str) -> None:
    results = read_results(folder)
    for read in (results.record, results.history):
        with pytest.raises(InputError) as caught:
            read(run)
        assert message in str(caught.value)


@pytest.mark.parametrize("study", [None, "{", "[]", '{"columns": [1]}'])
def test_a_table_without_its_study_is_read_by_its_values(folder: Path, study: str | None) -> None:
    (folder / "study.json").unlink()
    if study is not None:
        (folder / "study.json").write_text(study)
    assert list(read_results(folder).rows()) == ROWS
    write_table(folder, [{**ROWS[0], "k_rep": "soft"}])
    assert next(read_results(folder).rows())["k_rep"] == "soft"


def test_errors_name_the_row_of_an_invalid_number(folder: Path) -> None:
    for change in ({"k_rep": "soft"}, {"seed": "1.5"}):
        write_table(folder, [ROWS[0], ROWS[0] | change])
        with pytest.raises(InputError, match=r"results.csv: row 1: cannot be read: "):
            list(read_results(folder).rows())


@pytest.mark.parametrize("line", ["NA", "", ",".join(["1"] * (len(ROWS[0]) + 1))])
def test_errors_name_a_row_with_too_few_or_too_many_cells(folder: Path, line: str) -> None:
    with (folder / "results.csv").open("a") as file:
        file.write(line + "\n")
    with pytest.raises(InputError, match=rf"results.csv: row 2: expected {len(ROWS[0])} cells, got "):
        list(read_results(folder).rows(["map"]))


def test_a_gain_declared_as_a_string_stays_a_string(folder: Path) -> None:
    (folder / "study.json").write_text('{"columns": [{"name": "k_rep", "kind": "string"}]}')
    assert [row["k_rep"] for row in read_results(folder).rows()] == ["0.30000000000000004", None]


def test_rows_are_read_one_by_one(tmp_path: Path) -> None:
    write_table(tmp_path, ROWS * 10_000)
    tracemalloc.start()
    results = read_results(tmp_path)
    assert len(results) == 20_000
    assert sum(row["seed"] == 0 for row in results.rows(["seed"])) == 10_000
    assert tracemalloc.get_traced_memory()[1] < 500_000
    tracemalloc.stop()


def test_notebooks_show_the_first_rows(folder: Path, tmp_path: Path) -> None:
    shown = read_results(folder)._repr_html_()
    assert "&lt;b&gt;rooms&lt;/b&gt;" in shown and "<b>" not in shown
    assert "2 runs of" in shown
    assert shown.count("<tr>") == 1 + 2
    many = tmp_path / "many"
    many.mkdir()
    write_table(many, ROWS * 20)
    shown = read_results(many)._repr_html_()
    assert shown.count("<tr>") == 1 + 10
    assert "40 runs of" in shown and "(first 10 shown)" in shown


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("notes.txt", b"", "expected the folder of a sweep, got a folder without results.csv"),
        (
            "results.csv",
            b"",
            "results.csv: line 1: expected the header of a table of results",
        ),
        ("results.csv", b"a,b\n1,2\n", "results.csv: line 1: "),
        ("results.csv", b"\xff\xfe", "results.csv: cannot be read: "),
    ],
)
def test_errors_name_files_that_are_not_tables(
    tmp_path: Path, name: str, content: bytes, message: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_results(tmp_path)
    assert str(caught.value).startswith(str(tmp_path)) and message in str(caught.value)


def test_errors_name_a_folder_whose_name_is_too_long() -> None:
    name = 1000 * "a"
    with pytest.raises(InputError, match=f"^{name}: cannot be read: "):
        read_results(name)


def test_errors_name_a_table_that_was_emptied_after_it_was_opened(folder: Path) -> None:
    results = read_results(folder)
    (folder / "results.csv").write_bytes(b"")
    with pytest.raises(InputError, match=r"results.csv: cannot be read: the file is empty"):
        list(results.rows())


def test_errors_name_an_unreadable_study(folder: Path) -> None:
    (folder / "study.json").write_text("{")
    with pytest.raises(InputError, match=r"study.json: cannot be read"):
        _ = read_results(folder).study
    for content in ("5", "null", "[1]", '"text"'):
        (folder / "study.json").write_text(content)
        with pytest.raises(InputError, match=r"study.json: expected a JSON object, got "):
            _ = read_results(folder).study


def test_errors_name_the_extra_that_installs_pandas(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def raise_missing(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr(optional_imports.importlib, "import_module", raise_missing)
    with pytest.raises(RobocovError, match=r'pip install "robocov\[pandas\]"'):
        read_results(folder).to_pandas()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: expected the header time_s,mean_distance_m,cost_m3,uncovered_area_m2"),
        ("time_s\n", "line 1: expected the header "),
        (
            "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n1,2,3,4\n1,2\n",
            "line 3: expected 4 numbers",
        ),
        (
            "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n",
            "line 2: expected 4 numbers, got the end of the file",
        ),
        (
            "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n1,2,three,4\n",
            "line 2: expected 4 numbers, got '1,2,three,4'",
        ),
    ],
)
def test_errors_name_the_line_of_an_invalid_history(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "cost.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_history(path)
    assert f"{path}: {message}" in str(caught.value)
    with pytest.raises(InputError, match=r"none.csv: cannot be read"):
        read_history(tmp_path / "none.csv")


@pytest.mark.slow
def test_reading_results_loads_no_heavy_packages(folder: Path) -> None:
    script = (
        "import sys, robocov as rc\n"
        f"results = rc.read_results({str(folder)!r})\n"
        "assert not {'matplotlib', 'pandas', 'pyarrow'} & set(sys.modules)\n"
        "print(len(results))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "2\n"
