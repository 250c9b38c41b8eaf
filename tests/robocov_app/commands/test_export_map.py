"""The command `robocov export`."""

import json
from pathlib import Path

import pytest
from command_calls import read_error, read_json

from robocov.mapfile import load_map, save_map
from robocov_app.cli import main


@pytest.mark.parametrize(
    "name", ["plan.svg", "plan.geojson", "plan.wkt", "plan.yaml", "plan.map", "plan.png"]
)
def test_a_map_is_exported_in_each_format(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / name
    summary = read_json(capsys, "export", "square", "-o", str(out))
    assert summary["files"][0] == str(out)
    assert summary["area_written_m2"] == pytest.approx(100.0, rel=0.1)
    assert set(map(str, tmp_path.iterdir())) == set(summary["files"])
    assert main(["export", "square", "-o", str(out), "--overwrite"]) == 0
    output = capsys.readouterr().out
    assert output.startswith(f"{summary['format']}: free area 100 m², written")
    assert f"saved in {out}" in output


def test_options_are_passed_to_the_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan.txt"
    read_json(capsys, "export", "office", "-o", str(out), "--format", "wkt", "--digits", "0")
    assert "." not in out.read_text()
    geojson = tmp_path / "plan.geojson"
    read_json(capsys, "export", "office", "-o", str(geojson), "--origin", "8.4", "49")
    assert json.loads(geojson.read_text())["origin"] == [8.4, 49.0]


def test_closed_gaps_are_reported_on_standard_error_and_in_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["export", "office", "-o", str(tmp_path / "office.yaml"), "--cell", "1"]
    assert main(arguments) == 0
    output = capsys.readouterr()
    assert output.err.startswith("robocov: warning: gaps close: the free space has ")
    assert "warning" not in output.out
    assert main([*arguments, "--overwrite", "--json"]) == 0
    output = capsys.readouterr()
    assert json.loads(output.out)["warnings"] == [output.err.removeprefix("robocov: warning: ").strip()]


def test_errors_are_reported_in_one_line_and_leave_no_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments, part in (
        ("export square", "this option is required"),
        ("export square -o x.doc", "x.doc: unknown format, expected a file ending in one of"),
        ("export square -o x.svg --format doc", "--format: expected one of"),
        ("export square -o x.svg --cell 1", "--cell: not supported by the format svg"),
        ("export square -o none/x.svg", "cannot be written"),
        ("export nowhere -o x.svg", "nowhere"),
        ("export square -o x.svg --digits 99", "digits: expected a number from 0 to 12, got 99"),
    ):
        assert part in read_error(capsys, *arguments.split())
    assert list(tmp_path.iterdir()) == []


def test_no_file_is_overwritten_without_the_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "plan.json"
    out.write_text("precious")
    assert "already exists" in read_error(capsys, "export", "square", "-o", str(out), "--format", "wkt")
    assert out.read_text() == "precious"
    save_map(load_map("square"), out)
    message = read_error(capsys, "export", str(out), "-o", str(out), "--format", "wkt", "--overwrite")
    assert "is the map being read" in message
    assert load_map(out) == load_map("square")
