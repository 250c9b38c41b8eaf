"""Worlds of CoverageControl: their density, their robots, and rejected files."""

from pathlib import Path

import numpy as np
import pytest

from robocov.environment import PointsStart
from robocov.errors import MapError
from robocov.mapfile import load_map, save_map
from robocov_app.formats import ReadOptions, detect_format, import_map

SIDE_M = 1024.0


def write_world(folder: Path, content: str, positions: str | None = None) -> Path:
    path = folder / "world.env"
    path.write_text(content)
    if positions is not None:
        path.with_suffix(".pos").write_text(positions)
    return path


def test_a_world_becomes_a_map_with_its_density_and_robots(tmp_path: Path) -> None:
    path = write_world(tmp_path, "CircularBND\n300 400 50 8\n", "10.5 20\n30 40.25\n")
    assert detect_format(path).name == "coverage-control"
    environment, report, _ = import_map(path)
    assert environment.free_area == pytest.approx(SIDE_M**2)
    assert not environment.obstacles
    assert environment.starts["robots"] == PointsStart(((10.5, 20.0), (30.0, 40.25)))
    assert "density: 1 Gaussian and 0 polygons, as 256 x 256 cells" in report.notes
    save_map(environment, tmp_path / "world.json")
    assert load_map(tmp_path / "world.json").density == environment.density


def test_gaussians_have_their_shape_and_end_at_two_sigmas(tmp_path: Path) -> None:
    path = write_world(tmp_path, "CircularBND\n502 502 50 8\nBND\n202 802 20 60 0.5 8\n")
    density = import_map(path)[0].density
    assert density is not None
    points = np.array([[502.0, 502.0], [542.0, 502.0], [598.0, 502.0], [606.0, 502.0]])
    weights = density.evaluate(points)
    assert weights[1:3] / weights[0] == pytest.approx(np.exp([-0.5 * 0.8**2, -0.5 * 1.92**2]), rel=2e-3)
    assert weights[3] == 0.0
    # Equal masses, but the peak of the second Gaussian is higher, because it is narrower.
    peak_ratio = (50.0 * 50.0) / (20.0 * 60.0 * np.sqrt(1.0 - 0.5**2))
    peak, along, across = density.evaluate(np.array([[202.0, 802.0], [210.0, 826.0], [210.0, 778.0]]))
    assert peak / weights[0] == pytest.approx(peak_ratio, rel=5e-3)
    assert along / peak == pytest.approx(np.exp(-0.5 * 0.4**2 / 0.75), rel=5e-3)
    assert across / peak == pytest.approx(np.exp(-0.5 * 0.4**2 * 3.0 / 0.75), rel=5e-3)


def test_polygons_add_their_highest_weight(tmp_path: Path) -> None:
    square = "4 {}\n100 100\n{} 100\n{} 200\n100 200\n"
    content = "".join(f"Uniform\n{square.format(weight, x, x)}" for weight, x in ((0.5, 300), (2.0, 200)))
    density = import_map(write_world(tmp_path, content))[0].density
    assert density is not None
    assert density.evaluate(np.array([[150.0, 150.0], [250.0, 150.0], [350.0, 150.0]])).tolist() == [
        1,
        0.25,
        0,
    ]


def test_the_size_of_a_cell_scales_the_world(tmp_path: Path) -> None:
    path = write_world(tmp_path, "CircularBND\n3 4 0.5 8\n")
    environment = import_map(path, options=ReadOptions(cell=0.01))[0]
    assert environment.region.bounds == pytest.approx((0.0, 0.0, 10.24, 10.24))


@pytest.mark.parametrize(
    ("content", "positions", "message"),
    [
        ("BND\n1 2 3\n", None, "BND: expected 6 numbers, got '1 2 3'"),
        ("CircularBND\n1 2 -3 4\n", None, "expected sigmas above 0"),
        ("Uniform\n2 1\n0 0\n1 1\n", None, "expected a number of at least 3 corners"),
        ("Uniform\n3 1\n0 0\n1 nan\n1 0\n", None, "Uniform: expected 6 numbers"),
        ("CircularBND\n1 2 3 4\nSquare\n", None, "expected CircularBND, BND or Uniform, got 'Square'"),
        ("CircularBND\n1 2 3 0\n", None, "expected a feature with a weight inside the world"),
        ("CircularBND\n1 2 3 4\n" * 1001, None, "expected at most 1000 features"),
        ("Uniform\n3 1\n0 0\n1024 0\n0 1024\n" * 70, None, "expected smaller or fewer polygons"),
        (
            "CircularBND\n1 2 3 4\n",
            "1 2\n3\n",
            "world.pos: expected an x and a y for each robot, got 3",
        ),
        ("CircularBND\n1 2 3 4\n", "1 2 x 3\n", "world.pos: expected a number, got 'x'"),
    ],
)
def test_other_files_are_rejected(tmp_path: Path, content: str, positions: str | None, message: str) -> None:
    with pytest.raises(MapError, match=message):
        import_map(write_world(tmp_path, content, positions))
