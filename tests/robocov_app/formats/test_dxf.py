"""DXF drawings written by ezdxf: entities, blocks, layers, units, and rejected files."""

import codecs
import io
import logging
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import affinity, box
from shapely.geometry.base import BaseGeometry

from robocov.environment import CircleObstacle
from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions, detect_format
from robocov_app.formats.vector.dxf.curves import flatten_polyline
from robocov_app.formats.vector.dxf.reading import UNITS

METERS = 6
Draw = Callable[[Any, Any], Any]


def read_drawing(
    folder: Path, draw: Draw, *, unit: int = METERS, version: str = "R2010", hall: bool = True, **options: Any
) -> ForeignMap:
    """Read a drawing whose boundary is a hall of 20 x 10 units."""
    document = ezdxf.new(version)
    document.header["$INSUNITS"] = unit
    space = document.modelspace()
    if hall:
        space.add_polyline2d([(0, 0), (20, 0), (20, 10), (0, 10)], close=True)
    draw(document, space)
    path = folder / "plan.dxf"
    document.saveas(path)
    assert detect_format(path).name == "dxf"
    return IMPORTERS["dxf"].read(path, ReadOptions(**options))


def read_solid_area(folder: Path, draw: Draw, **options: Any) -> BaseGeometry:
    """Return the area of the hall that is not free."""
    foreign = read_drawing(folder, draw, **options)
    assert not any("damaged" in line for line in foreign.dropped)
    return box(0, 0, 20, 10) - foreign.free


@pytest.mark.parametrize(
    ("draw", "expected"),
    [
        (lambda d, m: m.add_line((5, 0), (5, 4)), box(4.95, 0, 5.05, 4)),
        (lambda d, m: m.add_lwpolyline([(5, 0), (5, 4)]), box(4.95, 0, 5.05, 4)),
        (
            lambda d, m: m.add_lwpolyline([(5, 0), (5, 4)], dxfattribs={"const_width": 0.4}),
            box(4.8, 0, 5.2, 4),
        ),
        (lambda d, m: m.add_lwpolyline([(5, 0, 0.4, 0.4), (5, 4, 0.4, 0.4)]), box(4.8, 0, 5.2, 4)),
        (lambda d, m: m.add_lwpolyline([(5, 2), (8, 2), (8, 4), (5, 4)], close=True), box(5, 2, 8, 4)),
        (lambda d, m: m.add_lwpolyline([(5, 2), (8, 2), (8, 4), (5, 4), (5, 2)]), box(5, 2, 8, 4)),
        (lambda d, m: m.add_polyline2d([(5, 2), (8, 2), (8, 4), (5, 4)], close=True), box(5, 2, 8, 4)),
        (
            lambda d, m: m.add_polyline2d(
                [(5, 0), (5, 4)], dxfattribs={"default_start_width": 0.1, "default_end_width": 0.4}
            ),
            box(4.8, 0, 5.2, 4),
        ),
        # Polylines in the vertical plane x = 5.
        (
            lambda d, m: m.add_lwpolyline(
                [(2, 1), (8, 1)], dxfattribs={"extrusion": (1, 0, 0), "elevation": 5}
            ),
            box(4.95, 2, 5.05, 8),
        ),
        (
            lambda d, m: m.add_polyline2d(
                [(2, 1), (8, 1)], dxfattribs={"extrusion": (1, 0, 0), "elevation": (0, 0, 5)}
            ),
            box(4.95, 2, 5.05, 8),
        ),
        (
            lambda d, m: m.add_polyline3d([(5, 2, 1), (8, 2, 1), (8, 4, 1), (5, 4, 1)], close=True),
            box(5, 2, 8, 4),
        ),
        (lambda d, m: m.add_polyline3d([(5, 0, 1), (5, 4, 2)]), box(4.95, 0, 5.05, 4)),
        (lambda d, m: m.add_solid([(5, 2), (8, 2), (5, 4), (8, 4)]), box(5, 2, 8, 4)),
        (lambda d, m: m.add_circle((5, 3), 1), CircleObstacle((5, 3), 1).polygon),
        (
            lambda d, m: m.add_lwpolyline(
                [(5, 2), (8, 2), (8, 4), (5, 4)], close=True, dxfattribs={"const_width": 0.2}
            ),
            box(4.9, 1.9, 8.1, 4.1) - box(5.1, 2.1, 7.9, 3.9),
        ),
        (
            lambda d, m: m.add_circle((-5, 3), 1, dxfattribs={"extrusion": (0, 0, -1)}),
            CircleObstacle((5, 3), 1).polygon,
        ),
    ],
)
def test_entities_become_areas_and_walls(tmp_path: Path, draw: Draw, expected: Any) -> None:
    assert read_solid_area(tmp_path, draw).symmetric_difference(expected).area < 1e-4


@pytest.mark.parametrize(
    "draw",
    [
        lambda d, m: m.add_arc((5, 5), 2, 0, 180),
        lambda d, m: m.add_arc((5, 5), 2, 350, 170),
        lambda d, m: m.add_arc((-5, 5), 2, 10, 190, dxfattribs={"extrusion": (0, 0, -1)}),
        lambda d, m: m.add_ellipse((5, 5), (2, 0), 1, 0, math.pi),
        lambda d, m: m.add_lwpolyline([(7, 5, 1), (3, 5, 0)], format="xyb"),
        lambda d, m: m.add_polyline2d([(7, 5, 1), (3, 5, 0)], format="xyb"),
    ],
)
def test_arcs_are_walls_of_half_a_ring(tmp_path: Path, draw: Draw) -> None:
    wall = read_solid_area(tmp_path, draw, thickness=0.2)
    assert wall.area == pytest.approx(math.pi * 2 * 0.2, rel=2e-3)
    away = shapely.distance(shapely.Point(5, 5), shapely.points(shapely.get_coordinates(wall)))
    assert (away >= 1.9 - 2e-3).all()
    assert (away <= 2.1 + 1e-3).all()


def test_closed_curves_are_areas(tmp_path: Path) -> None:
    oval = read_solid_area(tmp_path, lambda d, m: m.add_ellipse((5, 5), (3, 0), 0.5))
    assert oval.area == pytest.approx(math.pi * 3 * 1.5, rel=1e-3)
    turned = read_solid_area(tmp_path, lambda d, m: m.add_ellipse((5, 5), (0, 3), 0.5))
    assert turned.area == pytest.approx(oval.area, rel=1e-6)
    lens = read_solid_area(
        tmp_path, lambda d, m: m.add_lwpolyline([(3, 5, 1), (7, 5, 1)], format="xyb", close=True)
    )
    assert lens.area == pytest.approx(math.pi * 4, rel=1e-3)
    points = [(5, 3, 0), (8, 5, 0), (5, 7, 0), (2, 5, 0)]
    spline = read_solid_area(tmp_path, lambda d, m: m.add_spline().set_closed(points))
    assert 4 < spline.area < 12
    assert spline.centroid.coords[0] == pytest.approx((5, 5), abs=1e-3)
    center = ezdxf.math.OCS((1, 0, 1)).from_wcs((5, 5, 0))
    tilted = read_solid_area(
        tmp_path, lambda d, m: m.add_circle(center, 1, dxfattribs={"extrusion": (1, 0, 1)})
    )
    assert tilted.area == pytest.approx(math.pi * math.sqrt(0.5), rel=2e-3)


def test_splines_stay_near_their_curve(tmp_path: Path) -> None:
    control = [(2, 2), (6, 9), (10, 1), (14, 8)]
    wall = read_solid_area(tmp_path, lambda d, m: m.add_open_spline(control, degree=3), thickness=0.02)
    t = np.linspace(0, 1, 500)[:, None]
    weights = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
    exact = shapely.points(sum(w * np.array(c) for w, c in zip(weights, control, strict=True)))
    assert shapely.distance(wall.buffer(1e-3), exact).max() == 0.0


@settings(max_examples=count_examples(60))
@given(
    st.tuples(st.integers(-9, 9), st.integers(-9, 9)),
    st.tuples(st.integers(-9, 9), st.integers(-9, 9)),
    st.floats(-3, 3),
)
def test_a_bulge_is_the_tangent_of_a_quarter_of_the_angle(
    a: tuple[int, int], b: tuple[int, int], bulge: float
) -> None:
    points = flatten_polyline(np.array([a, b], dtype=float), np.array([bulge, 0.0]), 1e-3)
    assert points[0].tolist() == list(a)
    assert points[-1].tolist() == list(b)
    chord = math.dist(a, b)
    if chord == 0.0 or abs(bulge) < 1e-3:
        return
    # The height of the arc over its chord is the bulge times half the chord, to the right if positive.
    x, y = a
    u, v = b
    height = ((points[:, 0] - x) * (v - y) - (points[:, 1] - y) * (u - x)) / chord
    assert (height.max() if bulge > 0 else -height.min()) == pytest.approx(abs(bulge) * chord / 2, abs=2e-3)


def add_chair(document: Any, name: str = "chair") -> Any:
    block = document.blocks.new(name)
    block.add_lwpolyline([(0, 0), (1, 0), (1, 0.5), (0, 0.5)], close=True)
    return block


def test_blocks_are_drawn_where_they_are_inserted(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        add_chair(document)
        pair = document.blocks.new("pair")
        pair.add_blockref("chair", (0, 0))
        pair.add_blockref("chair", (2, 0), dxfattribs={"rotation": 90, "xscale": 2.0, "yscale": 2.0})
        space.add_blockref("pair", (3, 3))
        space.add_blockref("pair", (12, 3), dxfattribs={"xscale": -1.0})
        space.add_blockref("chair", (15, 1), dxfattribs={"row_count": 3, "column_count": 2, "row_spacing": 2,
                                                         "column_spacing": 1.5})  # fmt: skip

    seat = box(0, 0, 1, 0.5)
    pair = shapely.union_all(
        [seat, affinity.translate(affinity.rotate(affinity.scale(seat, 2, 2, origin=(0, 0)), 90, (0, 0)), 2)]
    )
    rows = [affinity.translate(seat, 15 + 1.5 * k, 1 + 2 * j) for k in range(2) for j in range(3)]
    mirrored = affinity.scale(pair, -1, 1, origin=(0, 0))
    expected = shapely.union_all([affinity.translate(pair, 3, 3), affinity.translate(mirrored, 12, 3), *rows])
    assert read_solid_area(tmp_path, draw).symmetric_difference(expected).area < 1e-6


def test_circles_in_stretched_blocks_become_ellipses(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        document.blocks.new("table").add_circle((0, 0), 1)
        space.add_blockref("table", (5, 5), dxfattribs={"xscale": 3.0})

    oval = read_solid_area(tmp_path, draw)
    assert oval.area == pytest.approx(math.pi * 3, rel=2e-3)
    assert oval.bounds == pytest.approx((2, 4, 8, 6), abs=2e-3)


def test_layers_are_selected_and_hidden_ones_omitted(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        for name in ("WALLS", "Furniture", "hidden", "frozen"):
            document.layers.add(name)
        document.layers.get("hidden").off()
        document.layers.get("frozen").freeze()
        for k, name in enumerate(("WALLS", "Furniture", "hidden", "frozen")):
            space.add_lwpolyline(
                [(k, 1), (k + 1, 1), (k + 1, 2), (k, 2)], close=True, dxfattribs={"layer": name}
            )
        add_chair(document)
        space.add_blockref("chair", (10, 5), dxfattribs={"layer": "Furniture"})

    assert read_solid_area(tmp_path, draw).area == pytest.approx(2.5)
    assert read_solid_area(tmp_path, draw, skip=("furniture",)).area == pytest.approx(1.0)
    assert read_solid_area(tmp_path, draw, skip=("CHAIR",)).area == pytest.approx(2.0)
    foreign = read_drawing(tmp_path, draw, only=("0", "walls"))
    assert foreign.free.area == pytest.approx(199.0)
    assert foreign.dropped == (
        "2 shapes by their names (--only, --skip)",
        "2 shapes hidden, or on layers that are off",
    )


def test_a_layer_of_lines_is_the_boundary(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        for a, b in (((0, 0), (9, 0)), ((9, 6), (9, 0)), ((9, 6), (0, 6)), ((0, 6), (0, 0))):
            space.add_line(a, b, dxfattribs={"layer": "Outer walls"})
        space.add_line((4, 0), (4, 3))

    named = read_drawing(tmp_path, draw, hall=False, boundary="outer walls", thickness=0.2)
    assert named.free.area == pytest.approx(54 - 0.6)
    walls = read_drawing(tmp_path, draw, hall=False, thickness=0.2)
    assert walls.free.area == pytest.approx(8.8 * 5.8 - 0.2 * 2.9)
    assert walls.boundary is not None
    assert walls.boundary.bounds == pytest.approx((-0.1, -0.1, 9.1, 6.1))


def test_unsupported_entities_are_counted(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        space.add_text("Kitchen")
        space.add_mtext("Bath")
        space.add_point((1, 1))
        space.add_3dface([(0, 0), (1, 0), (1, 1)])
        space.add_hatch().paths.add_polyline_path([(7, 1), (8, 1), (8, 2), (7, 2)])
        space.add_blockref("nothing", (0, 0))
        space.add_line((3, 3, 2.5), (3, 4, 2.5))

    foreign = read_drawing(tmp_path, draw)
    assert foreign.dropped == (
        "1 3DFACE",
        "1 HATCH (--hatches imports them as areas)",
        "1 MTEXT",
        "1 TEXT",
        "1 block missing from the file",
        "1 point (--pillar RADIUS makes pillars of them)",
        "2 third coordinates, z from 2.5 to 2.5",
    )
    assert read_drawing(tmp_path, draw, hatches=True, pillar=0.5).free.area == pytest.approx(
        200 - 0.1 - 1 - 0.7854, abs=0.01
    )


def test_obstacles_are_named_after_their_layers(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        space.add_circle((3, 3), 0.5, dxfattribs={"layer": "columns"})
        space.add_line((6, 6), (8, 6), dxfattribs={"layer": "partitions"})
        space.add_point((5, 5), dxfattribs={"layer": "posts"})

    obstacles = read_drawing(tmp_path, draw, pillar=0.2).primitives
    assert [obstacle.name for obstacle in obstacles] == ["columns", "partitions", "posts"]


def test_multilines_are_their_lines(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        line = space.add_mline([(5, 2), (9, 2)])
        line.set_justification(1)

    assert read_solid_area(tmp_path, draw).area > 0.5


@pytest.mark.parametrize("unit", sorted(UNITS))
def test_units_are_converted(tmp_path: Path, unit: int) -> None:
    scale = UNITS[unit][1]
    size = 10.0 / scale

    def draw(document: Any, space: Any) -> None:
        space.add_lwpolyline([(0, 0), (size, 0), (size, size / 2), (0, size / 2)], close=True)

    foreign = read_drawing(tmp_path, draw, unit=unit, hall=False)
    assert foreign.free.area == pytest.approx(50.0)
    assert foreign.notes[0] == f"in {UNITS[unit][0]}"
    if unit not in (9, 21):  # ezdxf does not convert these units
        assert ezdxf.units.conversion_factor(ezdxf.units.InsertUnits(unit), ezdxf.units.M) == pytest.approx(
            scale
        )
    given = read_drawing(tmp_path, draw, unit=unit, hall=False, scale=2 * scale)
    assert given.free.area == pytest.approx(200.0)


def test_a_drawing_without_a_unit_needs_one(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"plan.dxf: .INSUNITS: expected a unit, got 0: --scale METERS"):
        read_drawing(tmp_path, lambda d, m: None, unit=0)
    assert read_drawing(tmp_path, lambda d, m: None, unit=0, scale=0.5).free.area == pytest.approx(50.0)
    assert read_drawing(
        tmp_path, lambda d, m: None, unit=0, scale=0.5, version="R12"
    ).free.area == pytest.approx(50.0)


def test_a_binary_file_is_read(tmp_path: Path) -> None:
    document = ezdxf.new()
    document.modelspace().add_lwpolyline([(0, 0), (9, 0), (9, 6), (0, 6)], close=True)
    document.saveas(tmp_path / "plan.dxf", fmt="bin")
    assert IMPORTERS["dxf"].read(tmp_path / "plan.dxf", ReadOptions()).free.area == pytest.approx(54.0)


def format_drawing(draw: Draw) -> str:
    document = ezdxf.new()
    draw(document, document.modelspace())
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def draw_recursive_block(document: Any, space: Any) -> None:
    document.blocks.new("a").add_blockref("b", (0, 0))
    document.blocks.new("b").add_blockref("A", (0, 0))
    space.add_blockref("a", (0, 0))


def draw_bomb(document: Any, space: Any) -> None:
    add_chair(document, "b0")
    for k in range(9):
        block = document.blocks.new(f"b{k + 1}")
        for _ in range(10):
            block.add_blockref(f"b{k}", (0, 0))
    space.add_blockref("b9", (0, 0))


def draw_nested_blocks(document: Any, space: Any) -> None:
    add_chair(document, "b0")
    for k in range(40):
        document.blocks.new(f"b{k + 1}").add_blockref(f"b{k}", (0, 0))
    space.add_blockref("b40", (0, 0))


def test_a_file_may_start_with_a_byte_order_mark(tmp_path: Path) -> None:
    area = read_drawing(tmp_path, lambda d, m: m.add_circle((5, 5), 1)).free.area
    path = tmp_path / "plan.dxf"
    path.write_bytes(codecs.BOM_UTF8 + path.read_bytes())
    assert detect_format(path).name == "dxf"
    assert IMPORTERS["dxf"].read(path, ReadOptions()).free.area == pytest.approx(area)


def draw_many_entities(document: Any, space: Any) -> None:
    add_chair(document)
    space.add_blockref("chair", (0, 0), dxfattribs={"row_count": 30000, "column_count": 30000})


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "expected a DXF with sections, got a file that begins with b''"),
        (b"hello", "expected a DXF with sections, got a file that begins with b'hello'"),
        (b"AutoCAD Binary DXF\r\n\x1a\0oops", "expected a readable DXF, got a damaged one"),
        (b"\n0\nSECTION\n0\nEOF\n", "expected a readable DXF, got a damaged one"),
        (
            b"0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\nabc\n",
            "expected at least one closed outline or line, got none",
        ),
        (b"0\nSECTION\n", "expected at least one closed outline or line, got none"),
        (b"0\nSECTION\n" + b" 10\n0\n" * 600_000, "expected at most 500000"),
        (b"0\nSECTION\n" + b"1\n\n" * 4_000_100, "expected at most 8000000"),
        (draw_recursive_block, "block 'a' is inserted into itself"),
        (draw_bomb, "expected at most 200000 entities to draw"),
        (draw_many_entities, "entities to draw, including those in blocks"),
        (draw_nested_blocks, "blocks are nested deeper than 32"),
        (lambda d, m: m.add_line((0, 0), (1e300, 0)), "expected coordinates"),
        (lambda d, m: m.add_line((0, 0), (math.nan, 0)), "expected coordinates"),
        (
            lambda d, m: m.add_lwpolyline([(0, 0), (5, 2)], dxfattribs={"const_width": 1e308}),
            "width: expected a number from 0 to 10000 (m), got 1e+308",
        ),
        (lambda d, m: m.add_arc((0, 0), 1e300, 0, 10), "a curve beyond 10000000 m"),
        (lambda d, m: m.add_circle((0, 0), 1e30), "a curve beyond 10000000 m"),
        (lambda d, m: m.add_ellipse((0, 0), (1e30, 0), 0.5), "a curve beyond 10000000 m"),
        (lambda d, m: m.add_spline([(0, 0), (math.inf, 0), (1, 1)]), "a curve beyond 10000000 m"),
        (
            lambda d, m: m.add_lwpolyline([(0, 0, 1e-8), (9e6, 0, 0)], format="xyb"),
            "expected at most 10 km, got 9e+06 x 0.0625 m: is the scale right?",
        ),
        (
            lambda d, m: m.add_lwpolyline([(0, 0, 1e9), (9, 0, 0)], format="xyb"),
            "(1 damaged shape (LWPOLYLINE",
        ),
        (
            lambda d, m: m.add_lwpolyline([(k % 2, 0, 1e6) for k in range(3000)], format="xyb"),
            "(1 damaged shape (LWPOLYLINE",
        ),
        (lambda d, m: None, "expected at least one closed outline or line, got none"),
    ],
    ids=lambda value: value if isinstance(value, str) else "content",
)
def test_unusable_files_are_rejected(tmp_path: Path, content: Any, expected: str) -> None:
    path = tmp_path / "plan.dxf"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(format_drawing(content))
    with pytest.raises(MapError) as caught:
        IMPORTERS["dxf"].read(path, ReadOptions(scale=1.0))
    assert str(caught.value).startswith(str(path))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_ezdxf_is_reported_with_the_command_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "plan.dxf"
    path.write_text(format_drawing(lambda d, m: m.add_line((0, 0), (1, 1))))
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MapError, match=r'plan.dxf: ezdxf is not installed: pip install "robocov\[dxf\]"'):
        IMPORTERS["dxf"].read(path, ReadOptions())


def test_ezdxf_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "plan.dxf").write_bytes(b"0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\nabc\n")
    with pytest.raises(MapError):
        IMPORTERS["dxf"].read(tmp_path / "plan.dxf", ReadOptions(scale=1.0))
    assert any(isinstance(handler, logging.NullHandler) for handler in logging.getLogger("ezdxf").handlers)
    assert capfd.readouterr() == ("", "")
