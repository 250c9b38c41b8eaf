"""`robocov import` of grids and images: results, messages and invalid options."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_calls import read_error, read_json
from raster_files import PLAN, build_pgm, draw_pixels, write_ros_map

from robocov.mapfile import load_map
from robocov_app.cli import main
from robocov_app.formats import IMPORTERS

GRID = "type octile\nheight 4\nwidth 5\nmap\n@@@@@\n@..T@\n@...@\n@@@@@\n"


def run_command(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    assert main(list(arguments)) == 0
    out = capsys.readouterr()
    assert out.err == ""
    return out.out.splitlines()


def test_a_ros_map_is_imported_with_a_preview(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN))
    out = tmp_path / "out.json"
    preview = tmp_path / "preview.png"
    lines = run_command(capsys, "import", str(path), "-o", str(out), "--preview", str(preview))
    assert lines == [
        "ros: 12 vertices read, 12 kept; free area 4.25 m² read, 4.25 m² kept",
        "3 x 1.5 m, 0 obstacles",
        "note: 16 x 10 cells of 0.25 m: 42.5% free, 27.5% blocked, 30.0% unknown, treated as obstacles",
        "note: cells are larger than robots: walls move by at most 0.2 m instead of one cell "
        "(--simplify 0.25)",
        f"saved in {out} and {preview}",
    ]
    assert load_map(out).free_area == pytest.approx(4.25)
    assert load_map(out).name == "plan"
    assert preview.read_bytes().startswith(b"\x89PNG")


def test_an_import_is_reported_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN))
    row = read_json(
        capsys, "import", str(path), "-o", str(tmp_path / "a.json"), "--unknown", "cut", "--simplify", "0"
    )
    assert (row["out"], row["source"], row["format"]) == (str(tmp_path / "a.json"), str(path), "ros")
    assert row["size_m"] == [3.0, 1.5]  # up to the inner edge of the walls
    assert row["area_kept_m2"] == pytest.approx(4.25)
    assert row["tolerance_m"] == 0.0
    assert any(note.endswith("30.0% unknown, cut away") for note in row["notes"])


def test_the_default_output_is_named_after_the_source(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "maps").mkdir()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "maps" / "grid.map").write_text(GRID)
    assert run_command(capsys, "import", "maps/grid.map", "--cell", "0.5")[-1] == "saved in grid.json"
    assert load_map(Path("grid.json")).free_area == 1.25
    assert "grid.json: already exists; choose another -o or pass --overwrite" in read_error(
        capsys, "import", "maps/grid.map"
    )
    arguments = ("import", "maps/grid.map", "--trees", "free", "--overwrite", "--json")
    assert main(list(arguments)) == 0
    assert json.loads(capsys.readouterr().out)["area_kept_m2"] == 6


def test_the_source_file_is_never_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "plan.map"
    path.write_text(GRID)
    message = read_error(capsys, "import", str(path), "--overwrite", "-o", str(path))
    assert f"{path}: is the file being read; choose another -o" in message
    image = tmp_path / "plan.png"
    image.write_bytes(b"")
    arguments = ("-o", str(tmp_path / "a.json"), "--overwrite", "--preview", str(image))
    assert "choose another --preview" in read_error(capsys, "import", str(image), *arguments)
    assert path.read_text() == GRID
    assert set(tmp_path.iterdir()) == {path, image}


@pytest.mark.parametrize(
    ("file", "arguments", "expected"),
    [
        ("plan.yaml", "--water free", "--water: not supported by the format ros (supported: --anywhere"),
        ("plan.yaml", "--cell 1", "--cell: not supported by the format ros"),
        ("plan.yaml", "--invert", "--invert: not supported by the format ros"),
        ("grid.map", "--unknown free", "--unknown: not supported by the format movingai (supported: --"),
        ("grid.map", "--min-stroke 3px", "--min-stroke: not supported by the format movingai"),
        ("plan.pgm", "--trees obstacle", "format image (supported: --cell, --color-tolerance, --"),
        ("plan.pgm", "", "expected --cell, the meters per pixel (or import plan.yaml next to it)"),
        ("plan.pgm", "--cell nan", "--cell: expected a number from 0.000001 to 10000 m"),
        ("plan.pgm", "--cell 1 --threshold 3", "--threshold: expected a number from 0 to 1"),
        ("plan.pgm", "--cell 0.001", "no position has enough clearance for a robot of radius 0.1 m"),
        ("plan.yaml", "--inside 1", "--inside: expected two numbers, got '1'"),
        ("plan.yaml", "--inside 1 x", "--inside: expected two numbers, got '1', 'x'"),
        ("plan.yaml", "--radius 1", "no position has enough clearance for a robot of radius 1 m"),
        ("plan.yaml", "--simplify -1", "--simplify: expected a number from 0 to 10"),
        ("plan.yaml", "--keep some", "--keep: expected largest or all, got 'some'"),
        ("plan.yaml", "--format bmp", "--format: expected one of "),
        ("plan.yaml", "--format movingai", "line 1: expected type octile, height N, width N or map"),
        ("none.yaml", "", "none.yaml: no such file"),
        ("plan.yaml", "--preview a.bmp", "a.bmp"),
    ],
)  # fmt: skip
def test_invalid_options_are_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, arguments: str, expected: str
) -> None:
    write_ros_map(tmp_path, draw_pixels(PLAN))
    (tmp_path / "grid.map").write_text(GRID)
    out = tmp_path / "out.json"
    assert expected in read_error(capsys, "import", str(tmp_path / file), "-o", str(out), *arguments.split())
    assert not out.exists()


def test_the_help_lists_every_format(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "-h"]) == 0
    text = capsys.readouterr().out
    for name in IMPORTERS:
        assert name in text


@pytest.mark.slow
def test_a_large_map_is_simplified(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # 1200 x 1200 cells: halls with pillars and doors. The time limit of tests bounds the duration.
    pixels = np.full((1200, 1200), 254, dtype=np.uint8)
    y, x = np.mgrid[0:1200, 0:1200]
    pixels[(x % 60 - 30) ** 2 + (y % 60 - 30) ** 2 < 49] = 0
    pixels[:, ::300] = pixels[::300, :] = 0
    for door in range(90, 1200, 300):
        pixels[door : door + 20, ::300] = pixels[::300, door : door + 20] = 254
    path = write_ros_map(tmp_path, build_pgm(pixels), resolution=0.05)
    row = read_json(capsys, "import", str(path), "-o", str(tmp_path / "a.json"))
    assert row["vertices_kept"] < row["vertices_read"] / 2
    assert row["area_kept_m2"] == pytest.approx(row["area_read_m2"], rel=0.01)
