"""`robocov metrics`: the table of a run, JSON and rejected folders."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
from command_calls import SHORT, read_error
from matplotlib.figure import Figure

from robocov.metrics.run_metrics import COLUMNS, compute_run_metrics
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.figures import metric_curves
from robocov_app.figures.metric_curves import MeasuredRun, plot_metrics
from robocov_app.runs import artifacts


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("metrics") / "both"
    arguments = [
        "compare",
        "rooms",
        "--controllers",
        "rapf",
        "rpf",
        "--robots",
        "3",
        *SHORT,
        "--out",
        str(out),
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(artifacts, "save_figures", lambda *_, **__: None)
        assert main(arguments) == 0
    return out


def test_metrics_of_each_run_are_saved_as_a_table(
    comparison: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["metrics", str(comparison), "--rate", "4", "--plot", str(comparison / "metrics.png")]) == 0
    output = capsys.readouterr().out
    assert "RAPF" in output
    assert "RPF" in output
    assert (comparison / "metrics.png").stat().st_size > 10_000
    for name in ("rapf", "rpf"):
        header, *rows = (comparison / name / "metrics.csv").read_text().splitlines()
        assert header.split(",") == list(COLUMNS.values())
        expected = compute_run_metrics(Record.load(comparison / name), 4.0)
        assert len(rows) == len(expected.time) == 5
        assert [float(cell) for cell in rows[-1].split(",")] == [float(x) for x in expected.rows()[-1]]


def test_the_figure_of_the_current_folder_has_its_name(
    comparison: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    titles: list[str] = []

    def record_title(runs: Sequence[MeasuredRun], theme: str, title: str) -> Figure:
        titles.append(title)
        return plot_metrics(runs, theme, title)

    monkeypatch.setattr(metric_curves, "plot_metrics", record_title)
    monkeypatch.chdir(comparison / "rapf")
    assert main(["metrics", ".", "--rate", "1", "--plot", str(tmp_path / "metrics.svg")]) == 0
    assert titles == ["Metrics  ·  rapf"]


def test_json_output_contains_the_final_metrics(comparison: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", str(comparison / "rapf"), "--rate", "0", "--json"]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    (run,) = json.loads(output.out)["runs"]
    assert 0 < run["sensed_area_m2"] <= run["range_area_m2"] < run["free_area_m2"]
    assert run["components"] == 1
    assert run["near_final_s"] is not None


def test_a_folder_without_a_run_is_reported(
    tmp_path: Path, comparison: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert str(tmp_path) in read_error(capsys, "metrics", str(tmp_path))
    assert read_error(capsys, "metrics", str(comparison), "--rate", "-1").startswith(
        "--rate: expected a number from 0 to 10000 Hz, got -1.0"
    )
    assert "picture.gif" in read_error(capsys, "metrics", str(comparison), "--plot", "picture.gif")
