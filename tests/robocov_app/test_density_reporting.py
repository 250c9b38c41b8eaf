"""Densities in the output of commands, in reports and in exported files."""

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
WEIGHTED = PLAIN.with_density(Gaussians((Gaussian((5.0, 5.0), 4.0, sigma=1.0),), 0.5))


@pytest.fixture
def maps(tmp_path: Path) -> tuple[str, str, str]:
    """Write a map without a density, one with a density, and positions; return the paths of the files."""
    plain = tmp_path / "plain.json"
    save_map(PLAIN, plain)
    weighted = tmp_path / "weighted.json"
    save_map(WEIGHTED, weighted)
    robots = tmp_path / "robots.json"
    robots.write_text("[[1, 1], [4, 4.5]]")
    return str(plain), str(weighted), str(robots)


def read_opacity(address: str) -> np.ndarray:
    """Return the alpha channel of an image in a data URL."""
    head, _, data = address.partition(",")
    assert head == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        pixels = np.asarray(image)
    assert pixels.shape[2] == 4
    return pixels[..., 3]


def read_output(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main([*arguments]) in (0, None)
    return capsys.readouterr().out


def test_only_a_varying_density_is_described() -> None:
    assert list(list_density_lines(PLAIN)) == []
    assert list(list_density_lines(PLAIN.with_density(Uniform(2.0)))) == []
    assert list_density_lines(WEIGHTED) == ["weighted by φ   gaussians, 0.5 to 4.5"]
    assert get_density_kind(PLAIN) is None
    assert get_density_kind(WEIGHTED) == "gaussians"


def test_the_cost_is_weighted_by_the_density(maps, capsys) -> None:
    plain, weighted, robots = maps
    assert "φ" not in read_output(capsys, "cost", plain, "--positions", robots)
    assert "weighted by φ   gaussians, 0.5 to 4.5" in read_output(
        capsys, "cost", weighted, "--positions", robots
    )
    answer = json.loads(read_output(capsys, "cost", weighted, "--positions", robots, "--json"))
    result = CoverageCost(WEIGHTED)([[1.0, 1.0], [4.0, 4.5]])
    assert answer["mean_distance_m"] == pytest.approx(result.mean_distance)
    assert answer["cost_m3"] == pytest.approx(result.value)
    assert answer["density"] == "gaussians"


def test_check_and_maps_report_the_density(maps, capsys) -> None:
    plain, weighted, _ = maps
    assert "density" not in read_output(capsys, "check", plain)
    output = read_output(capsys, "check", weighted)
    mean = WEIGHTED.free_masses.sum() / WEIGHTED.free_area
    assert f"gaussians, 0.5 to 4.5, mean {mean:.4g}" in output
    report = json.loads(read_output(capsys, "check", weighted, "--json"))["maps"][0]
    assert report["density"] == "gaussians"
    assert report["density_range"] == [0.5, 4.5]
    assert report["mean_density"] == pytest.approx(mean)
    rows = json.loads(read_output(capsys, "maps", "--json"))["maps"]
    assert {row["name"]: row["density"] for row in rows}["hospital"] == "polygons"
    assert {row["density"] for row in rows} == {None, "polygons"}


@pytest.mark.slow
def test_a_run_reports_and_records_the_density(maps, capsys, tmp_path) -> None:
    _, weighted, _ = maps
    out = tmp_path / "out"
    output = read_output(
        capsys, "run", weighted, "--robots", "3", "--duration", "1", "--lattice", "16", "--out", str(out)
    )
    assert "weighted by φ   gaussians, 0.5 to 4.5" in output
    run = json.loads((out / "run.json").read_text())
    assert run["map"]["density"]["kind"] == "gaussians"
    from robocov.record import Record

    record = Record.load(out)
    assert record.environment == load_map(weighted)
    assert record.snapshot(0).seen.density == WEIGHTED.density


def test_the_optimum_depends_on_the_density(maps, capsys) -> None:
    plain, weighted, _ = maps
    options = ("--robots", "2", "--restarts", "2", "--lattice", "16")
    assert "weighted by φ" in read_output(capsys, "optimum", weighted, *options)
    weighted_optimum = json.loads(read_output(capsys, "optimum", weighted, *options, "--json"))
    plain_optimum = json.loads(read_output(capsys, "optimum", plain, *options, "--json"))
    assert weighted_optimum["density"] == "gaussians"
    assert plain_optimum["density"] is None
    weighted_reach = np.sum(weighted_optimum["positions_m"], axis=1).max()
    plain_reach = np.sum(plain_optimum["positions_m"], axis=1).max()
    assert weighted_reach > plain_reach + 0.5, "robots are nearer to the peak"


@pytest.mark.slow
def test_a_report_shows_and_describes_the_density(maps, capsys, tmp_path) -> None:
    plain, weighted, _ = maps
    for name, path in (("plain", plain), ("weighted", weighted)):
        out = str(tmp_path / name)
        options = ("--controllers", "rapf", "lloyd", "--robots", "2", "--duration", "1", "--lattice", "12")
        read_output(capsys, "compare", path, *options, "--out", out)
        read_output(capsys, "report", out)
        page = (tmp_path / name / "report.html").read_text()
        is_weighted = name == "weighted"
        assert ("Final mean distance to the nearest robot, weighted by φ: " in page) == is_weighted
        assert ("density φ, 0.5 to 4.5" in page) == is_weighted
        assert ("data:image/png;base64," in page) == is_weighted


def test_pages_contain_an_image_of_the_density() -> None:
    assert build_density_image(PLAIN) == ""
    assert build_density_image(PLAIN.with_density(Uniform(2.0))) == ""
    assert "density" not in embed_map(PLAIN)
    opacity = read_opacity(embed_map(WEIGHTED)["density"])
    assert opacity.shape == (80, 80)
    row, column = np.unravel_index(opacity.argmax(), opacity.shape)
    # The peak is at (5, 5) m of 6 x 6 m; the first row is at the top.
    assert abs(row - 13) <= 2
    assert abs(column - 66) <= 2


def test_the_image_of_the_density_is_transparent_outside_the_region() -> None:
    triangle = Environment("triangle", ((0.0, 0.0), (6.0, 0.0), (0.0, 6.0)), density=WEIGHTED.density)
    opacity = read_opacity(build_density_image(triangle))
    assert not opacity[5:20, 60:].any()


def test_an_export_without_the_density_is_reported(maps, capsys, tmp_path) -> None:
    plain, weighted, _ = maps
    assert "the density" not in read_output(capsys, "export", plain, "-o", str(tmp_path / "plain.wkt"))
    assert "dropped: the density (gaussians)" in read_output(
        capsys, "export", weighted, "-o", str(tmp_path / "a.svg")
    )
