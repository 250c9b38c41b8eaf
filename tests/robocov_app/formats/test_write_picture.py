"""Exported images contain their scale and position."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from robocov.environment import Environment
from robocov.mapfile import load_map
from robocov_app.formats import Shaping, WriteOptions, export_map, import_map


def test_the_picture_is_black_and_white_and_has_its_position(tmp_path: Path) -> None:
    room = Environment("Zimmer α", ((3.0, -2.0), (5.0, -2.0), (5.0, -1.0), (3.0, -1.0)))
    report = export_map(room, tmp_path / "room.png", options=WriteOptions(cell=0.5))
    assert report.area_written == report.area == 2
    with Image.open(tmp_path / "room.png") as image:
        assert image.mode == "1"
        assert json.loads(image.info["robocov"]) == {"cell_m": 0.5, "origin_m": [2.5, -2.5]}
        assert image.info["Title"] == "Zimmer α"
        expected = np.zeros((4, 6), dtype=bool)
        expected[1:3, 1:5] = True
        np.testing.assert_array_equal(np.asarray(image), expected)


@pytest.mark.parametrize("name", ["museum", "city", "cave"])
def test_a_written_picture_keeps_its_position(tmp_path: Path, name: str) -> None:
    given = load_map(name)
    export_map(given, tmp_path / "a.png")
    imported, _, _ = import_map(tmp_path / "a.png", shaping=Shaping(keep="all"))
    assert imported.name == given.name
    moved = imported.free.symmetric_difference(given.free).area
    # The walls move by much less than a row of cells.
    assert moved < 0.2 * 0.05 * given.free.length
