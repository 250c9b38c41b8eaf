"""The command `robocov export`."""

import json
from pathlib import Path

import pytest
from called import read_error, read_json

from robocov.mapfile import load_map
from robocov_app.cli import main


@pytest.mark.parametrize(
    "name", ["plan.svg", "plan.geojson", "plan.wkt", "plan.yaml", "plan.map", "plan.png"]
)
def test_every_format(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / name
    found = read_json(capsys, "export", "square", "-o", str(out))
    assert found["files"][0] == str(out)
    assert found["area_written_m2"] == pytest.approx(100.0, rel=0.1)
    assert set(map(str, tmp_path.iterdir())) == set(found["files"])
    assert main(["export", "square", "-o", str(out), "--overwrite"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{found['format']}: free area 100 m², written")
    assert f"saved in {out}" in said


def test_options_reach_the_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan.txt"
    read_json(capsys, "export", "office", "-o", str(out), "--format", "wkt", "--digits", "0")
    assert "." not in out.read_text()
    here = tmp_path / "plan.geojson"
    read_json(capsys, "export", "office", "-o", str(here), "--origin", "8.4", "49")
    assert json.loads(here.read_text())["origin"] == [8.4, 49.0]


def test_closed_gaps_are_reported_next_to_the_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", "office", "-o", str(tmp_path / "office.yaml"), "--cell", "1"]
    assert main(words) == 0
    said = capsys.readouterr()
    assert said.err.startswith("robocov: warning: gaps close: the free space has ")
    assert "warning" not in said.out
    assert main([*words, "--overwrite", "--json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["warnings"] == [said.err.removeprefix("robocov: warning: ").strip()]


def test_errors_are_reported_in_one_line_and_leave_no_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for words, part in (
        ("export square", "this option is required"),
        ("export square -o x.doc", "x.doc: unknown format, expected a file ending in one of"),
        ("export square -o x.svg --format doc", "--format: expected one of"),
        ("export square -o x.svg --cell 1", "--cell: no option of the format svg"),
        ("export square -o none/x.svg", "cannot be written"),
        ("export nowhere -o x.svg", "nowhere"),
        ("export square -o x.svg --digits 99", "digits: expected a number from 0 to 12, got 99"),
    ):
        assert part in read_error(capsys, *words.split())
    assert list(tmp_path.iterdir()) == []


def test_no_file_is_overwritten_without_the_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "plan.json"
    out.write_text("precious")
    assert "already exists" in read_error(capsys, "export", "square", "-o", str(out), "--format", "wkt")
    assert out.read_text() == "precious"
    from robocov.mapfile import save_map

    save_map(load_map("square"), out)
    line = read_error(capsys, "export", str(out), "-o", str(out), "--format", "wkt", "--overwrite")
    assert "is the map being read" in line
    assert load_map(out) == load_map("square")
