"""Small functions that readers and writers of maps share: texts, numbers, single outlines."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Polygon

from robocov.errors import format_area
from robocov_app.formats.files import parse_yaml
from robocov_app.formats.geometry.cells.corners import sharpen_corners
from robocov_app.formats.geometry.cells.grid_map import _format_share
from robocov_app.formats.geometry.cells.rasterize import _iterate_smaller_sizes
from robocov_app.formats.geometry.cells.vectorize import trace_outline
from robocov_app.formats.geometry.conversion.map_layout import build_boundary
from robocov_app.formats.geometry.curves import flatten_beziers
from robocov_app.formats.geometry.polygons import format_decimal
from robocov_app.formats.geometry.shapes.enclosed_area import Rule, find_enclosed_area
from robocov_app.formats.omissions import format_plural
from robocov_app.formats.preview.plotting import _format_number
from robocov_app.formats.unsupported import describe_unsupported_file
from robocov_app.formats.vector.svg.path_data import parse_path
from robocov_app.formats.vector.svg.style import parse_declarations


def test_numbers_are_formatted_readably() -> None:
    assert (format_area(30083.2), format_area(0.123456)) == ("30083 m²", "0.1235 m²")
    assert (format_area(999.6, 3), format_area(0.00001234, 2)) == ("1000 m²", "0.000012 m²")
    assert (format_decimal(1.5, 3), format_decimal(-0.0001, 3), format_decimal(1200.0, 0)) == (
        "1.5",
        "0",
        "1200",
    )
    assert (_format_share(1, 100_000), _format_share(500, 1000)) == ("<0.1%", "50.0%")
    assert (_format_number(1761234.5), _format_number(35.2789)) == ("1\u202f761\u202f234", "35.28")


@pytest.mark.parametrize(
    ("noun", "plural"),
    [
        ("hole", "holes"),
        ("box", "boxes"),
        ("empty geometry", "empty geometries"),
        ("way", "ways"),
        ("mesh", "meshes"),
        ("HATCH", "HATCHes"),
        ("y", "ys"),
    ],
)
def test_omitted_shapes_have_the_plural_of_their_kind(noun: str, plural: str) -> None:
    assert format_plural(1, noun) == f"1 {noun}"
    assert format_plural(2, noun) == f"2 {plural}"


def test_smaller_cells_have_round_sizes() -> None:
    assert list(islice(_iterate_smaller_sizes(0.15), 4)) == [0.1, 0.05, 0.02, 0.01]


def test_texts_are_cleaned() -> None:
    assert parse_yaml(b"image: a.pgm\norigin: [0, 1.5, 0]", "map.yaml") == {
        "image": "a.pgm",
        "origin": ["0", "1.5", "0"],
    }
    assert parse_declarations("fill: none; stroke-width:2px;") == {"fill": "none", "stroke-width": "2px"}
    ((points, closed),), _ = parse_path("m0 0h4v2z", 0.1, 100)
    assert points.tolist() == [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0]]
    assert closed


def test_an_unsupported_file_is_reported_with_a_way_out() -> None:
    assert describe_unsupported_file(Path("plan.pdf"), b"%PDF-1.7") == (
        "a PDF, which cannot be imported: pdftocairo -svg plan.pdf out.svg, or pdftoppm -png for a scan"
    )


def test_few_points_are_enough_for_a_flat_curve() -> None:
    control = np.array([[[0.0, 0.0], [2.0, 3.0], [4.0, 3.0], [6.0, 0.0]]])
    assert flatten_beziers(control, 0.6)[0].tolist() == [[3.0, 2.25], [6.0, 0.0]]


@pytest.mark.parametrize(("rule", "area"), [("holes", 12.0), ("evenodd", 12.0), ("nonzero", 16.0)])
def test_a_square_in_a_square_becomes_an_obstacle(rule: Rule, area: float) -> None:
    square = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
    assert find_enclosed_area([square, 1 + square / 2], rule).area.area == area


def test_the_outline_of_a_room_is_its_boundary() -> None:
    room = shapely.box(0, 0, 4, 3) - shapely.box(1, 1, 2, 2)
    boundary, solid = build_boundary(MultiPolygon([room]), None, hull=False, margin=0.0, digits=4)
    assert (boundary.area, [part.area for part in solid]) == (12.0, [1.0])


def test_three_cells_have_six_corners() -> None:
    free = trace_outline(np.array([[True, True], [True, False]]), "grid")
    assert free.wkt == "MULTIPOLYGON (((0 0, 2 0, 2 1, 1 1, 1 2, 0 2, 0 0)))"


def test_a_cut_corner_is_completed() -> None:
    assert sharpen_corners(Polygon([(0, 0), (4, 0), (4, 2.99), (3.99, 3), (0, 3)]), 0.02).area == 12.0
