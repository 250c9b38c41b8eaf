"""Lists of rings, nested and flat."""

import json
from pathlib import Path
from typing import Any

import pytest
from shapely import Polygon, box
from vector_files import build_square, read

from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ReadOptions, detect_format

HALL = [build_square(0, 0, 20, 10), build_square(1, 1, 2, 2), build_square(5, 5, 1, 1)]


@pytest.mark.parametrize(
    "document",
    [
        HALL,
        [HALL],
        [ring[:-1] for ring in HALL],
        {
            "vertices": [n for ring in HALL for point in ring for n in point],
            "holes": [5, 10],
            "dimensions": 2,
        },
        {
            "vertices": [n for ring in HALL for point in ring for n in [*point, 3.0]],
            "holes": [5, 10],
            "dimensions": 3,
        },
    ],
    ids=["rings", "polygons", "open", "flat", "flat with heights"],
)
def test_the_first_ring_is_the_outline(tmp_path: Path, document: Any) -> None:
    foreign = read(tmp_path, "rings", document)
    assert foreign.free.equals(Polygon(HALL[0], HALL[1:]))
    assert foreign.notes[0] == "no unit in the file; assuming 1 m. Set it with --scale."
    assert foreign.dropped == (
        ("15 third coordinates, z from 3 to 3",)
        if "dimensions" in document and document["dimensions"] == 3
        else ()
    )
    assert detect_format(tmp_path / "plan.json").name == "rings"


def test_a_single_ring_is_free_space(tmp_path: Path) -> None:
    for document in (HALL[0], [n for point in HALL[0] for n in point]):
        foreign = read(tmp_path, "rings", document, scale=0.1)
        assert foreign.free.equals(box(0, 0, 2, 1))
        assert foreign.notes[0] == "a unit is 0.1 m"


def test_several_polygons_are_free_together(tmp_path: Path) -> None:
    assert read(tmp_path, "rings", [HALL, [build_square(20, 0, 5, 5)]]).free.area == pytest.approx(195 + 25)


def test_a_self_crossing_hole_beyond_the_outline_is_repaired(tmp_path: Path) -> None:
    bad = [build_square(0, 0, 20, 10), [[15, 2], [25, 4], [25, 2], [15, 4]]]
    foreign = read(tmp_path, "rings", bad)
    # The hole is a bow tie of two triangles of 5 m²; only the left one is inside the outline.
    assert foreign.free.area == pytest.approx(195.0)
    assert foreign.repaired[0].startswith(
        "the outline crossed or touched itself: polygon 1: Self-intersection"
    )


@pytest.mark.parametrize(
    ("document", "expected"),
    [
        ([], "expected a list of rings"),
        ([[]], "expected at least 3 times 2 numbers"),
        ("hall", "expected a list of rings"),
        ([HALL[0], 7], "[1]: expected a list of at least 1 point"),
        ([[[0, 0], [1, 0], [1]]], "[0][2]: expected a point"),
        ([[[0, 0], [1, 0], [1, None]]], "[0][2]: expected a point"),
        ([0, 0, 1, 0, 1], "expected at least 3 times 2 numbers"),
        ([0, 0, 1, 0, 1, "1"], "[2]: expected a point"),
        (
            {"vertices": [0, 0, 1, 0, 1, 1], "holes": [4]},
            "holes: expected growing indices of vertices, from 1 to 2",
        ),
        ({"vertices": [0, 0, 1, 0, 1, 1], "holes": [2, 1]}, "holes: expected growing indices"),
        ({"vertices": [0, 0, 1, 0, 1, 1], "holes": [True]}, "holes: expected growing indices"),
        ({"vertices": [0, 0, 1, 0, 1, 1], "dimensions": 4}, "dimensions: expected 2 or 3"),
        ({"vertices": 3}, "vertices: expected at least 3 times 2 numbers"),
        ([[[[[0, 0]]]]], "expected a list of rings [[x, y], ...], got [[[[[0, 0]]]]]"),
        ([[[0, 0], [1, 1], [2, 2]]], "1 outline without an area"),
    ],
)
def test_invalid_rings_are_rejected(tmp_path: Path, document: Any, expected: str) -> None:
    path = tmp_path / "plan.json"
    path.write_text(json.dumps(document))
    with pytest.raises(MapError) as caught:
        IMPORTERS["rings"].read(path, ReadOptions())
    assert str(caught.value).startswith(str(path))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)
