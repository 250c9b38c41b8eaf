"""Properties of every import: clean rings, no pockets, accurate walls, one rule for boundaries."""

import math
from itertools import pairwise, permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from fuzz_seeds import SEEDS, Case
from fuzz_structures import STRUCTURES
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import LineString, MultiPolygon, Point, box

from robocov.environment import MAX_SAGITTA_M, Environment
from robocov.errors import RobocovError
from robocov.mapfile import parse_map
from robocov.mapfile.check import check_map
from robocov_app.formats import IMPORTERS, ImportReport, ReadOptions, Shaping, build_environment, import_map
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.conversion.cleaning import remove_hairs
from robocov_app.formats.geometry.conversion.deviation import measure_deviation
from robocov_app.formats.geometry.polygons import round_polygons, tidy_ring
from robocov_app.formats.geometry.shapes.snapping import close_gaps, compute_default_snap, join_line_ends

GRID = 1e-4
MADE = sorted(STRUCTURES.keys() & IMPORTERS.keys())


def require_clean(environment: Environment, report: ImportReport) -> None:
    warnings = check_map(environment).warnings
    assert not [each for each in warnings if "same place" in each or "pocket" in each]
    # A circle may be approximated by a different number of sides.
    assert report.moved <= report.tolerance + GRID + MAX_SAGITTA_M


def import_file(case: Case, name: str, folder: Path, **options: Any) -> tuple[Environment, ImportReport]:
    for file, content in case.files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(content)
    first = next(iter(case.files))
    environment, report, _ = import_map(folder / first, format=name, options=ReadOptions(**options))
    return environment, report


@pytest.mark.parametrize("name", IMPORTERS)
def test_seeds_of_every_format_are_clean(name: str, tmp_path: Path) -> None:
    options = {"image": {"cell": 0.5}, "svg": {"scale": 0.5}}.get(name, {})
    for k, case in enumerate(SEEDS[name]):
        try:
            environment, report = import_file(case, name, tmp_path / str(k), **options)
        except RobocovError:
            continue
        require_clean(environment, report)


def _require_generated_clean(factory: pytest.TempPathFactory, name: str, case: Case) -> None:
    try:
        environment, report = import_file(case, name, factory.mktemp("made"))
    except RobocovError:
        return
    require_clean(environment, report)


_CASE = st.sampled_from(MADE).flatmap(lambda name: st.tuples(st.just(name), STRUCTURES[name]))
_CHECKS = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]


@settings(deadline=None, max_examples=count_examples(12), suppress_health_check=_CHECKS)
@given(_CASE)
def test_generated_files_are_clean(
    tmp_path_factory: pytest.TempPathFactory, given_case: tuple[str, Case]
) -> None:
    _require_generated_clean(tmp_path_factory, *given_case)


@pytest.mark.slow
@settings(deadline=None, max_examples=count_examples(250), suppress_health_check=_CHECKS)
@given(_CASE)
def test_many_generated_files_are_clean(
    tmp_path_factory: pytest.TempPathFactory, given_case: tuple[str, Case]
) -> None:
    _require_generated_clean(tmp_path_factory, *given_case)


_NUMBER = st.integers(0, 10**7).map(lambda value: value / 1e6)
_BLOCK = st.tuples(_NUMBER, _NUMBER, st.floats(0.001, 3.0), st.floats(0.001, 3.0), st.floats(0.0, 90.0))


@settings(deadline=None, max_examples=count_examples(40), suppress_health_check=_CHECKS)
@given(st.lists(_BLOCK, max_size=6), st.sampled_from([0.0, 0.02, 0.1]))
def test_walls_move_at_most_by_the_tolerance(blocks: list[Any], tolerance: float) -> None:
    solid = [
        shapely.affinity.rotate(box(x, y, x + width, y + height), angle)
        for x, y, width, height, angle in blocks
    ]
    room = box(0, 0, 10, 10) - shapely.union_all(solid)
    foreign = ForeignMap(
        "plan", "", MultiPolygon(shapely.get_parts(room).tolist()), boundary=box(0, 0, 10, 10)
    )
    try:
        environment, report = build_environment(foreign, Shaping(simplify=tolerance), "plan")
    except RobocovError:
        return
    require_clean(environment, report)


def test_repeated_and_straight_vertices_are_removed() -> None:
    ring = np.array([(0, 0), (0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (2, 2), (0, 2), (0, 1)], dtype=float)
    assert tidy_ring(ring, 4).tolist() == [[0, 0], [2, 0], [2, 2], [0, 2]]
    spike = np.array([(0, 0), (2, 0), (2, 2), (2, 5), (2, 2), (0, 2)], dtype=float)
    assert tidy_ring(spike, 4).tolist() == [[0, 0], [2, 0], [2, 2], [0, 2]]
    # A vertex that is off the line by one digit is kept.
    bent = np.array([(0, 0), (1, 0.0001), (2, 0), (2, 2), (0, 2)])
    assert len(tidy_ring(bent, 4)) == 5
    twice = round_polygons(box(0, 0, 1, 1) | box(1, 0, 2.00001, 1), 4)
    assert shapely.get_num_coordinates(twice) == 5


SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {0}" width="{0}pt" height="{0}pt">{1}</svg>'


def test_boundaries_of_files_have_each_corner_once(tmp_path: Path) -> None:
    (tmp_path / "page.svg").write_text(
        SVG.format(283.4646, '<rect x="70.86615" y="70.86615" width="141.7323" height="141.7323"/>')
    )
    environment, _, _ = import_map(tmp_path / "page.svg", options=ReadOptions(scale=0.1))
    assert len(environment.boundary) == 4


HALVES = "[[[[0,0],[5,0],[5,6],[0,6],[0,0]]],[[[{0},0],[10,0],[10,6],[{0},6],[{0},0]]]]"
TABLE = '{"type":"Polygon","coordinates":[[[2,2],[3,2],[3,3],[2,3],[2,2]]]}'


@pytest.mark.parametrize("start", [5, 5.00001, 5.005])
def test_a_boundary_of_two_parts_keeps_its_obstacle(tmp_path: Path, start: float) -> None:
    """The two halves of a hall of 10 m by 6 m touch, or are up to 5 mm apart."""
    halves = f'{{"type":"MultiPolygon","coordinates":{HALVES.format(start)}}}'
    text = f'{{"type":"GeometryCollection","geometries":[{halves},{TABLE}]}}'
    (tmp_path / "hall.geojson").write_text(text)
    for outlines in (None, "solid"):
        options = ReadOptions(units="meters", outlines=outlines)
        environment, _, _ = import_map(tmp_path / "hall.geojson", options=options)
        # The table covers 1 m².
        assert environment.free_area == pytest.approx(59.0, abs=1e-3)
    # This file has no table.
    wkt = f"GEOMETRYCOLLECTION(MULTIPOLYGON(((0 0,5 0,5 6,0 6,0 0)),(({start} 0,10 0,10 6,{start} 6,{start} 0))))"  # noqa: E501
    (tmp_path / "hall.wkt").write_text(wkt)
    assert import_map(tmp_path / "hall.wkt")[0].free_area == pytest.approx(60.0, abs=1e-3)


def test_an_outline_cut_at_the_antimeridian_is_one(tmp_path: Path) -> None:
    east = "[[[179.9999,0],[180,0],[180,0.0001],[179.9999,0.0001],[179.9999,0]]]"
    west = "[[[-180,0],[-179.9999,0],[-179.9999,0.0001],[-180,0.0001],[-180,0]]]"
    desk = "[[[179.99995,0.00004],[179.99996,0.00004],[179.99996,0.00005],[179.99995,0.00005],[179.99995,0.00004]]]"  # noqa: E501
    features = [
        f'{{"type":"Feature","properties":{{}},"geometry":{{"type":"{kind}","coordinates":{rings}}}}}'
        for kind, rings in (("MultiPolygon", f"[{east},{west}]"), ("Polygon", desk))
    ]
    (tmp_path / "pier.geojson").write_text(
        f'{{"type":"FeatureCollection","features":[{",".join(features)}]}}'
    )
    environment, _, _ = import_map(tmp_path / "pier.geojson")
    assert len(environment.obstacles) == 1
    assert np.ptp(np.array(environment.boundary), axis=0) == pytest.approx([22.26, 11.06], abs=0.01)


@pytest.mark.parametrize(
    ("gap", "parts"), [(1e-5, 1), (1e-3, 1), (5e-3, 1), (9.9e-3, 1), (0.011, 2), (0.1, 2)]
)
def test_hairline_gaps_between_rooms_are_closed(gap: float, parts: int) -> None:
    closed = close_gaps([box(0, 0, 5, 5), box(5 + gap, 0, 10, 5)], 0.01)
    assert len(closed.area.geoms) == parts
    assert closed.number == 2 - parts
    assert closed.widest == pytest.approx(gap if parts == 1 else 0.0)
    assert len(close_gaps([box(0, 0, 5, 5), box(5 + gap, 0, 10, 5)], 0.0).area.geoms) == 2


def test_a_thin_wall_with_a_door_is_not_a_gap() -> None:
    rooms = [box(0, 0, 5, 5), box(5.005, 0, 10, 5)]
    door = box(4.9, 2, 5.1, 3)
    closed = close_gaps([*rooms, door], 0.01)
    assert closed.number == 0
    assert closed.area.area == pytest.approx(25 + 4.995 * 5 + 0.005)
    # Walls of maps are at least a millimeter thick.
    assert close_gaps([rooms[0], box(5.0005, 0, 10, 5), door], 0.01).number == 1


def test_intended_gaps_are_kept() -> None:
    slit = box(0, 0, 5, 5) - box(2.5, 1, 2.505, 5)
    assert close_gaps([slit, box(20, 0, 25, 5)], 0.01).area.area == pytest.approx(slit.area + 25)
    wedge = shapely.Polygon([(5, 0), (10, 0), (10, 5), (5.2, 5)])
    assert close_gaps([box(0, 0, 5, 5), wedge], 0.01).number == 0


def test_rooms_of_a_grid_with_gaps_are_joined() -> None:
    rooms = [box(5.002 * i, 5.003 * j, 5.002 * i + 5, 5.003 * j + 5) for i in range(4) for j in range(4)]
    closed = close_gaps(rooms, 0.01)
    assert (len(closed.area.geoms), closed.number) == (1, 24)
    assert closed.widest == pytest.approx(0.003)
    assert not closed.area.geoms[0].interiors


def test_the_snapping_tolerance_follows_the_size() -> None:
    assert compute_default_snap([box(0, 0, 30, 10)]) == 0.01
    assert compute_default_snap([box(0, 0, 1, 0.5)]) == pytest.approx(0.001)


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize("is_reversed", [False, True])
def test_three_line_ends_in_a_chain_move_to_one_point(order: tuple[int, ...], is_reversed: bool) -> None:
    sides = [
        LineString([(0.0, 0.0), (10.0, 0.0)]),
        LineString([(10.0, 0.008), (10.0, 5.0), (0.0, 0.0)]),
        # Within the tolerance of the second side, but not of the first one.
        LineString([(10.0, 0.016), (15.0, 5.0)]),
    ]
    lines = [sides[k].reverse() if is_reversed else sides[k] for k in order]
    joined = join_line_ends(lines, 0.01)
    corner = Point(10.0, 0.0)
    corners = {point for line in joined for point in line.coords if Point(point).distance(corner) < 0.1}
    assert len(corners) == 1
    (area,) = shapely.polygonize(joined).geoms
    assert area.area == pytest.approx(25.0, abs=0.1)


@pytest.mark.parametrize("sides", [40, 1000])
def test_curves_of_short_lines_keep_their_shape(sides: int) -> None:
    circle = Point(0.0, 0.0).buffer(1.0, quad_segs=sides // 4)
    points = list(circle.exterior.coords)
    lines = [LineString(pair) for pair in pairwise(points)]
    # The last line ends next to the start of the curve, and another line next to one of its vertices.
    lines[-1] = LineString([points[-2], (1.0, 0.005)])
    lines.append(LineString([(-1.008, 0.0), (-3.0, 0.0)]))
    joined = join_line_ends(lines, 0.01)
    (area,) = shapely.polygonize(shapely.get_parts(shapely.union_all(joined))).geoms
    assert area.hausdorff_distance(circle) < 0.03
    assert area.touches(joined[-1])


def test_hairs_are_removed_and_counted(tmp_path: Path) -> None:
    (tmp_path / "spur.wkt").write_text("POLYGON((0 0,20 0,20 10,5.00001 10,5.000005 3,5 10,0 10,0 0))")
    environment, report, _ = import_map(tmp_path / "spur.wkt")
    assert report.removed == 1
    assert report.removed_area == pytest.approx(3.5e-5)
    assert report.moved < 1e-4
    assert report.changed == ("removed 1 hair (slits, spurs) thinner than 0.2 mm, 0.000035 m²",)
    assert len(environment.boundary) == 4
    spur = MultiPolygon([box(0, 0, 5, 5) | box(4, 2, 9, 2.0001)])
    assert remove_hairs(spur, 2e-4, 0.02).hair_count == 1
    real = MultiPolygon([box(0, 0, 5, 5) | box(4, 2, 9, 2.001)])
    assert remove_hairs(real, 2e-4, 0.02).hair_count == 0


def test_the_deviation_is_measured_along_edges_too() -> None:
    room = MultiPolygon([box(0, 0, 10, 5)])
    assert measure_deviation(room, MultiPolygon([box(0, 0, 10, 5.25)])).distance == pytest.approx(0.25)
    # Every corner of one is near the other, but the middle of a long wall is not.
    niche = box(0, 0, 10, 5) | box(0.1, 5, 9.9, 8)
    assert measure_deviation(room, MultiPolygon([niche])).distance == pytest.approx(3.0, abs=0.01)


WALLS = [(-2.05, 1.95, 4.1, 0.1), (-2.05, -2.05, 4.1, 0.1), (1.95, -2.05, 0.1, 4.1), (-2.05, -2.05, 0.1, 4.1)]


def build_walled_files() -> dict[str, str]:
    """Return the same room, 3.9 x 3.9 m within walls of 0.1 m, in several formats."""
    boxes = [
        f'<box id="{k}" size="{w},{h},1" movable="false"><body position="{x + w / 2},{y + h / 2},0"/></box>'
        for k, (x, y, w, h) in enumerate(WALLS)
    ]
    argos = f'<argos-configuration><arena size="5,5,1" center="0,0,0">{"".join(boxes)}</arena></argos-configuration>'  # noqa: E501
    rects = "".join(f'<rect x="{x}" y="{y}" width="{w}" height="{h}"/>' for x, y, w, h in WALLS)
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="5000mm" height="5000mm" viewBox="-2.5 -2.5 5 5">{}</svg>'  # noqa: E501
    lines = "-2 -2,2 -2,2 2,-2 2,-2 -2"
    rows = ["@" * 50] * 5 + ["@" * 5 + "." * 39 + "@" * 6] * 39 + ["@" * 50] * 6
    return {
        "plan.argos": argos,
        "plan.svg": svg.format(rects),
        "line.svg": svg.format('<rect x="-2" y="-2" width="4" height="4" fill="none" stroke="black" stroke-width=".1"/>'),  # noqa: E501
        "line.wkt": f"LINESTRING({lines})",
        "hall.wkt": f"GEOMETRYCOLLECTION(POLYGON((-2.5 -2.5,2.5 -2.5,2.5 2.5,-2.5 2.5,-2.5 -2.5)),LINESTRING({lines}))",  # noqa: E501
        "plan.map": "type octile\nheight 50\nwidth 50\nmap\n" + "\n".join(rows) + "\n",
    }  # fmt: skip


@pytest.mark.parametrize("name", build_walled_files())
def test_walls_around_the_free_space_are_the_boundary(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(build_walled_files()[name])
    options = ReadOptions(cell=0.1) if name.endswith(".map") else ReadOptions()
    environment, _, _ = import_map(tmp_path / name, options=options)
    assert environment.free_area == pytest.approx(3.9**2, abs=1e-6)
    assert environment.area == pytest.approx(3.9**2, abs=1e-6)
    place = environment.boundary_polygon.representative_point()
    again, _, _ = import_map(tmp_path / name, options=options, shaping=Shaping(inside=(place.x, place.y)))
    assert again.boundary == environment.boundary


def test_partitions_stay_walls_within_the_boundary(tmp_path: Path) -> None:
    lines = "MULTILINESTRING((0 0,10 0,10 6,0 6,0 0),(5 0,5 4))"
    (tmp_path / "plan.wkt").write_text(lines)
    environment, _, _ = import_map(tmp_path / "plan.wkt", options=ReadOptions(thickness=0.2))
    assert environment.boundary_polygon.equals(box(0.1, 0.1, 9.9, 5.9))
    assert [type(each).__name__ for each in environment.obstacles] == ["WallObstacle"]
    assert environment.region.area == pytest.approx(environment.free.convex_hull.area)


def test_widths_of_stretched_strokes_are_those_of_the_walls(tmp_path: Path) -> None:
    line = '<g transform="scale(2 1)"><path d="M10 10V90" stroke="#000" stroke-width="2" fill="none"/></g>'
    (tmp_path / "pen.svg").write_text(SVG.format(100, line))
    _, report, _ = import_map(tmp_path / "pen.svg", options=ReadOptions(scale=0.1))
    assert any("treated as a wall, 0.4 m wide" in note for note in report.notes)


def test_no_gap_is_at_minus_zero() -> None:
    text = """{"format": "robocov-map", "version": 1, "name": "flush",
        "boundary": [[-10, 6.5], [-10, -6.5], [6, -6.5], [6, 6.5]],
        "obstacles": [
          {"kind": "polygon", "vertices": [[0, 6.5], [0, 0.35], [2.2, 0.35], [2.2, 6.5]]},
          {"kind": "polygon", "vertices": [[0, -6.5], [0, -0.35], [2.2, -0.35], [2.2, -6.5]]}]}"""
    gap = check_map(parse_map(text, "flush")).narrowest_gap
    assert gap is not None
    values = [value for point in gap.between for value in point]
    assert not any(value == 0.0 and math.copysign(1.0, value) < 0.0 for value in values)
