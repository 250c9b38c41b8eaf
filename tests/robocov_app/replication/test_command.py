"""Bad input of `robocov paper`; `test_whole_study` tests the study itself."""

from command_calls import read_error

from robocov_app.commands.paper import _describe_forecast
from robocov_app.replication.execution.forecast import Forecast


def test_a_folder_with_other_files_is_rejected_and_unchanged(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    message = read_error(capsys, "paper", "--out", str(tmp_path))
    assert "expected an empty folder or a study of the paper" in message
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_study_needs_at_least_one_worker(capsys):
    message = read_error(capsys, "paper", "--out", "x", "--workers", "0")
    assert "--workers: expected a number from 1 to 1024, got 0" in message


def test_the_folder_is_required(capsys):
    assert "--out" in read_error(capsys, "paper")


def test_only_one_part_can_be_selected(capsys):
    message = read_error(capsys, "paper", "--out", "x", "--beyond-only", "--figures-only")
    assert "--figures-only and --beyond-only: expected one of them" in message


def test_a_forecast_for_one_worker_is_in_the_singular():
    forecast = Forecast(runs=40, left=30, seconds=600.0, seconds_per_run={"rapf": 20.0})
    text = _describe_forecast(forecast, 1, on_cluster=False)
    assert text.startswith("40 runs, 10 of them already done, about 10 min 0 s on 1 worker (")
