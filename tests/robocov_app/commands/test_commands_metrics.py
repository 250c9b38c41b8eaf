import json
from pathlib import Path

import pytest
from called import SHORT, read_error

from robocov.metrics.run_metrics import COLUMNS, compute_run_metrics
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.runs import artifacts


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("metrics") / "both"
    words = ["compare", "rooms", "--controllers", "rapf", "rpf", "--robots", "3", *SHORT, "--out", str(out)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(artifacts, "save_figures", lambda *_, **__: None)
        assert main(words) == 0
    return out


def test_each_run_gets_its_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", str(folder), "--rate", "4", "--plot", str(folder / "metrics.png")]) == 0
    said = capsys.readouterr().out
    assert "RAPF" in said
    assert "RPF" in said
    assert (folder / "metrics.png").stat().st_size > 10_000
    for name in ("rapf", "rpf"):
        header, *rows = (folder / name / "metrics.csv").read_text().splitlines()
        assert header.split(",") == list(COLUMNS.values())
        expected = compute_run_metrics(Record.load(folder / name), 4.0)
        assert len(rows) == len(expected.time) == 5
        assert [float(cell) for cell in rows[-1].split(",")] == [float(x) for x in expected.rows()[-1]]


def test_json_has_the_figures_of_the_end(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", str(folder / "rapf"), "--rate", "0", "--json"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    (run,) = json.loads(said.out)["runs"]
    assert 0 < run["sensed_area_m2"] <= run["range_area_m2"] < run["free_area_m2"]
    assert run["components"] == 1
    assert run["near_final_s"] is not None


def test_a_folder_without_a_run_is_reported(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert str(tmp_path) in read_error(capsys, "metrics", str(tmp_path))
    assert read_error(capsys, "metrics", str(folder), "--rate", "-1").startswith(
        "--rate: expected a number from 0 to 10000 Hz, got -1.0"
    )
    assert "picture.gif" in read_error(capsys, "metrics", str(folder), "--plot", "picture.gif")
