"""MovingAI grids that are written."""

from pathlib import Path

import pytest

from robocov.environment import Environment, PolygonObstacle
from robocov.mapfile import load_map
from robocov_app.formats import ReadOptions, Shaping, WriteOptions, detect_format, export_map, import_map

ROOM = Environment(
    "room", ((0.0, 0.0), (2.0, 0.0), (2.0, 1.5), (0.0, 1.5)),
    (PolygonObstacle(((0.5, 0.5), (1.0, 0.5), (1.0, 1.0), (0.5, 1.0))),),
)  # fmt: skip


def test_cells_are_written_as_characters(tmp_path: Path) -> None:
    path = tmp_path / "room.map"
    report = export_map(ROOM, path, options=WriteOptions(cell=0.5))
    assert path.read_text() == (
        "type octile\nheight 5\nwidth 6\nmap\n@@@@@@\n@....@\n@.@..@\n@....@\n@@@@@@\n"
    )
    assert report.dropped == ("the cell size, 0.5 m, and the lower left corner, [-0.5, -0.5]",)
    assert (report.area, report.area_written) == (2.75, 2.75)


def test_a_written_map_keeps_its_shape_without_its_origin(tmp_path: Path) -> None:
    path = tmp_path / "museum.map"
    museum = load_map("museum")
    report = export_map(museum, path)
    assert any(line.startswith("starts: ") for line in report.dropped)
    assert detect_format(path).name == "movingai"
    environment, _, foreign = import_map(path, options=ReadOptions(cell=0.05), shaping=Shaping(keep="all"))
    assert foreign.free.area == pytest.approx(report.area_written, abs=0.01)
    assert environment.free_area == pytest.approx(museum.free_area, abs=0.2 * 0.05 * museum.free.length)
