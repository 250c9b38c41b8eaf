"""What commands say where places do not count all the same."""

import base64
import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians, Uniform
from robocov.environment import Environment
from robocov.mapfile import load_map, save_map
from robocov_app.cli import main
from robocov_app.render.density_text import get_density_kind, list_density_lines
from robocov_app.report.embedding import embed_map
from robocov_app.report.pictures import build_density_image

PLAIN = Environment("plain", ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)))
HEAVY = PLAIN.with_density(Gaussians((Gaussian((5.0, 5.0), 4.0, sigma=1.0),), 0.5))


@pytest.fixture
def maps(tmp_path: Path) -> tuple[str, str, str]:
    paths = tmp_path / "plain.json", tmp_path / "heavy.json", tmp_path / "robots.json"
    save_map(PLAIN, paths[0])
    save_map(HEAVY, paths[1])
    paths[2].write_text("[[1, 1], [4, 4.5]]")
    return str(paths[0]), str(paths[1]), str(paths[2])


def read_output(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main([*words]) in (0, None)
    return capsys.readouterr().out


def test_the_line() -> None:
    assert list(list_density_lines(PLAIN)) == list(list_density_lines(PLAIN.with_density(Uniform(2.0)))) == []
    assert list_density_lines(HEAVY) == ["weighted by φ   gaussians, 0.5 to 4.5"]
    assert get_density_kind(PLAIN) is None and get_density_kind(HEAVY) == "gaussians"


def test_cost(maps, capsys) -> None:
    plain, heavy, robots = maps
    assert "φ" not in read_output(capsys, "cost", plain, "--positions", robots)
    assert "weighted by φ   gaussians, 0.5 to 4.5" in read_output(
        capsys, "cost", heavy, "--positions", robots
    )
    answer = json.loads(read_output(capsys, "cost", heavy, "--positions", robots, "--json"))
    result = CoverageCost(HEAVY)([[1.0, 1.0], [4.0, 4.5]])
    assert answer["mean_distance_m"] == pytest.approx(result.mean_distance)
    assert answer["cost_m3"] == pytest.approx(result.value) and answer["density"] == "gaussians"


def test_check_and_maps(maps, capsys) -> None:
    plain, heavy, _ = maps
    assert "density" not in read_output(capsys, "check", plain)
    said = read_output(capsys, "check", heavy)
    mean = HEAVY.free_masses.sum() / HEAVY.free_area
    assert f"gaussians, 0.5 to 4.5, mean {mean:.4g}" in said
    report = json.loads(read_output(capsys, "check", heavy, "--json"))["maps"][0]
    assert report["density"] == "gaussians" and report["density_range"] == [0.5, 4.5]
    assert report["mean_density"] == pytest.approx(mean)
    rows = json.loads(read_output(capsys, "maps", "--json"))["maps"]
    assert {row["name"]: row["density"] for row in rows}["hospital"] == "polygons"
    assert {row["density"] for row in rows} == {None, "polygons"}


@pytest.mark.slow
def test_a_run_keeps_the_density_and_says_so(maps, capsys, tmp_path) -> None:
    _, heavy, _ = maps
    out = tmp_path / "out"
    said = read_output(
        capsys, "run", heavy, "--robots", "3", "--duration", "1", "--lattice", "16", "--out", str(out)
    )
    assert "weighted by φ   gaussians, 0.5 to 4.5" in said
    run = json.loads((out / "run.json").read_text())
    assert run["map"]["density"]["kind"] == "gaussians"
    from robocov.record import Record

    record = Record.load(out)
    assert record.environment == load_map(heavy)
    assert record.snapshot(0).seen.density == HEAVY.density


def test_the_optimum_by_another_density_is_another(maps, capsys) -> None:
    plain, heavy, _ = maps
    words = ("--robots", "2", "--restarts", "2", "--lattice", "16")
    assert "weighted by φ" in read_output(capsys, "optimum", heavy, *words)
    first = json.loads(read_output(capsys, "optimum", heavy, *words, "--json"))
    second = json.loads(read_output(capsys, "optimum", plain, *words, "--json"))
    assert first["density"] == "gaussians" and second["density"] is None
    assert max(x + y for x, y in first["positions_m"]) > max(x + y for x, y in second["positions_m"]) + 0.5


@pytest.mark.slow
def test_a_report_shows_and_tells_it(maps, capsys, tmp_path) -> None:
    plain, heavy, _ = maps
    for name, path in (("plain", plain), ("heavy", heavy)):
        out = str(tmp_path / name)
        words = ("--controllers", "rapf", "lloyd", "--robots", "2", "--duration", "1", "--lattice", "12")
        read_output(capsys, "compare", path, *words, "--out", out)
        read_output(capsys, "report", out)
        page = (tmp_path / name / "report.html").read_text()
        is_heavy = name == "heavy"
        assert ("Final mean distance to the nearest robot, weighted by φ: " in page) == is_heavy
        assert ("density φ, 0.5 to 4.5" in page) == is_heavy
        assert ("data:image/png;base64," in page) == is_heavy


def test_the_picture_in_pages() -> None:
    assert build_density_image(PLAIN) == build_density_image(PLAIN.with_density(Uniform(2.0))) == ""
    assert "density" not in embed_map(PLAIN)
    address = embed_map(HEAVY)["density"]
    head, _, data = address.partition(",")
    assert head == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        dots = np.asarray(image)
    assert dots.shape == (80, 80, 4)
    row, column = np.unravel_index(dots[..., 3].argmax(), dots.shape[:2])
    # the top row first: the peak at (5, 5) m of 6 x 6 m
    assert abs(row - 13) <= 2 and abs(column - 66) <= 2
    cut = Environment("cut", ((0.0, 0.0), (6.0, 0.0), (0.0, 6.0)), density=HEAVY.density)
    with Image.open(io.BytesIO(base64.b64decode(build_density_image(cut).partition(",")[2]))) as image:
        assert not np.asarray(image)[5:20, 60:, 3].any()


def test_what_other_formats_cannot_hold_is_said(maps, capsys, tmp_path) -> None:
    plain, heavy, _ = maps
    assert "the density" not in read_output(capsys, "export", plain, "-o", str(tmp_path / "plain.wkt"))
    assert "dropped: the density (gaussians)" in read_output(
        capsys, "export", heavy, "-o", str(tmp_path / "a.svg")
    )
