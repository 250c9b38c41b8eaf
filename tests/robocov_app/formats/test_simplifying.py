"""Simplification: fewer vertices, but accurate walls, obstacles of the same size, and open gaps."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import MultiPolygon, Polygon, affinity

from robocov_app.formats.geometry.cells.vectorize import trace_outline
from robocov_app.formats.geometry.conversion.starts import find_center_regions
from robocov_app.formats.geometry.simplification.checks import MAX_OUTLINE_CHANGE
from robocov_app.formats.geometry.simplification.narrow_gaps import find_closed_gaps
from robocov_app.formats.geometry.simplification.original_outline import OriginalOutline
from robocov_app.formats.geometry.simplification.simplify import simplify_free_space

CELL = 0.05


def build_cells(shape: shapely.Geometry, cell: float = CELL, rim: int = 2) -> MultiPolygon:
    """Return the outline of the cells whose centers are in `shape`."""
    low_x, low_y, high_x, high_y = shape.bounds
    columns = int((high_x - low_x) / cell) + 2 * rim
    rows = int((high_y - low_y) / cell) + 2 * rim
    x, y = np.meshgrid(
        low_x + (np.arange(columns) - rim + 0.5) * cell, low_y + (np.arange(rows) - rim + 0.5) * cell
    )
    outline = trace_outline(shapely.contains_xy(shape, x, y), "grid")
    return affinity.affine_transform(outline, [cell, 0, 0, cell, low_x - rim * cell, low_y - rim * cell])


def count_vertices(shape: shapely.Geometry) -> int:
    rings = shapely.get_rings(shapely.get_parts(shape))
    return int(shapely.get_num_coordinates(rings).sum()) - len(rings)


@pytest.mark.parametrize("angle", [0, 3, 10, 22.5, 30, 45, 57, 70, 89])
@pytest.mark.parametrize("shift", [0.0, 0.021])
def test_walls_at_any_angle_are_straight(angle: float, shift: float) -> None:
    room = affinity.rotate(shapely.box(0, 0, 6, 4), angle, origin=(shift, shift))
    stairs = build_cells(room)
    result = simplify_free_space(stairs, CELL, CELL, 0.1)
    assert result.changed == ()
    # Four walls; sharp corners of cells may stay beveled.
    assert count_vertices(result.free) <= 8
    long = [
        line
        for line in map(shapely.LineString, np.stack([np.array(result.free.geoms[0].exterior.coords)[:-1],
                                                      np.array(result.free.geoms[0].exterior.coords)[1:]], 1))
        if line.length > 1
    ]  # fmt: skip
    assert len(long) == 4
    for line in long:
        (x0, y0), (x1, y1) = line.coords
        turn = np.degrees(np.arctan2(y1 - y0, x1 - x0)) - angle
        assert min(turn % 90, -turn % 90) < 0.5
    assert result.free.area == pytest.approx(24, abs=0.1 * CELL * 20)
    assert shapely.hausdorff_distance(result.free.boundary, room.boundary) < 2 * CELL


def test_straight_walls_stay_where_they_are() -> None:
    room = shapely.box(0, 0, 6, 4) - shapely.box(2, 1, 2.1, 3) - shapely.box(4, 2, 5, 4)
    stairs = build_cells(room)
    result = simplify_free_space(stairs, CELL, CELL, 0.1)
    assert shapely.equals_exact(result.free.normalize(), MultiPolygon([room]).normalize(), 1e-9)


def test_a_bump_of_a_cell_is_removed() -> None:
    free = np.ones((40, 60), dtype=bool)
    free[0, 20:23] = free[39, 10] = free[7, 0] = False
    result = simplify_free_space(
        affinity.scale(trace_outline(free, "grid"), CELL, CELL, origin=(0, 0)), CELL, CELL, 0.1
    )
    assert count_vertices(result.free) == 4
    assert shapely.equals_exact(
        result.free.normalize(), MultiPolygon([shapely.box(0, 0, 3, 2)]).normalize(), 1e-9
    )


def test_round_obstacles_keep_their_size() -> None:
    for radius in (0.16, 0.2, 0.35, 1.0):
        pillar = shapely.Point(2.013, 1.987).buffer(radius, quad_segs=64)
        stairs = build_cells(shapely.box(0, 0, 4, 4) - pillar)
        result = simplify_free_space(stairs, CELL, CELL, 0.1)
        (hole,) = result.free.geoms[0].interiors
        was = Polygon(stairs.geoms[0].interiors[0]).area
        assert Polygon(hole).area == pytest.approx(was, rel=MAX_OUTLINE_CHANGE)
        assert 5 <= len(hole.coords) - 1 <= 24
        assert shapely.hausdorff_distance(Polygon(hole).boundary, pillar.boundary) < 2 * CELL


@pytest.mark.parametrize("length", [3, 4, 17])
@pytest.mark.parametrize("turned", [False, True])
def test_a_wall_of_one_cell_keeps_its_shape(length: int, turned: bool) -> None:
    free = np.ones((30, 40), dtype=bool)
    free[:length, 19] = False
    free[20, 10 : 10 + length] = False
    cells = trace_outline(free.T if turned else free, "grid")
    outline = affinity.scale(cells, CELL, CELL, origin=(0, 0))
    result = simplify_free_space(outline, CELL, CELL, 0.1)
    assert result.free.symmetric_difference(outline).area < 1e-9
    assert count_vertices(result.free) == 12


@pytest.mark.parametrize("angle", [0.0, 5.0, 30.0, 45.0])
def test_a_thin_wall_at_an_angle_keeps_its_area(angle: float) -> None:
    wall = affinity.rotate(shapely.box(1, 1.95, 4, 2.05), angle)
    stairs = build_cells(shapely.box(0, 0, 5, 4) - wall)
    solid = shapely.box(*stairs.bounds) - stairs
    result = simplify_free_space(stairs, CELL, CELL, 0.1)
    assert (shapely.box(*stairs.bounds) - result.free).area == pytest.approx(
        solid.area, rel=MAX_OUTLINE_CHANGE
    )


@pytest.mark.parametrize("thickness", [0.012, 0.02, 0.028])
def test_a_thin_wall_of_a_drawing_keeps_its_shape(thickness: float) -> None:
    room = shapely.box(0, 0, 6, 4) - shapely.box(3, 2, 3 + thickness, 4)
    result = simplify_free_space(MultiPolygon([room]), 0.02, None, 0.1)
    assert shapely.equals_exact(result.free.normalize(), MultiPolygon([room]).normalize(), 1e-9)


def test_a_narrow_alcove_keeps_its_shape() -> None:
    room = shapely.box(0, 0, 6, 4) | shapely.box(3, 4, 3.02, 5)
    result = simplify_free_space(MultiPolygon([room]), 0.02, None, 0.1)
    assert shapely.equals_exact(result.free.normalize(), MultiPolygon([room]).normalize(), 1e-9)


def test_a_door_as_wide_as_a_robot_stays_open() -> None:
    # A door of 0.25 m in a wall with ends that are ragged by one cell.
    free = np.ones((60, 80), dtype=bool)
    free[:, 38:42] = False
    free[28:33, 38:42] = True
    free[33, 38:40] = free[27, 40:42] = True
    outline = affinity.scale(trace_outline(free, "grid"), CELL, CELL, origin=(0, 0))
    for tolerance in (CELL, 2 * CELL, 4 * CELL):
        result = simplify_free_space(outline, tolerance, CELL, 0.124)
        assert len(find_center_regions(result.free, 0.124)) == 1, tolerance
    assert len(find_center_regions(outline, 0.126)) == 2


def test_reduced_simplification_is_noted() -> None:
    # A winding corridor of 0.3 m between two halls.
    free = np.zeros((60, 200), dtype=bool)
    free[4:56, :40] = free[4:56, 160:] = True
    for column in range(40, 160):
        low = int(28 + 4 * np.sin((column - 40) / 40 * np.pi))
        free[low : low + 6, column] = True
    outline = affinity.scale(trace_outline(free, "grid"), CELL, CELL, origin=(0, 0))
    assert len(find_center_regions(outline, 0.115)) == 1
    result = simplify_free_space(outline, 3 * CELL, CELL, 0.115)
    assert len(find_center_regions(result.free, 0.115)) == 1
    (line,) = [line for line in result.changed if "narrow" in line]
    assert line.endswith("so that a robot of radius 0.115 m still fits through")
    assert count_vertices(result.free) < count_vertices(outline) / 2
    # For a smaller robot, the simplification is not reduced.
    assert simplify_free_space(outline, 3 * CELL, CELL, 0.05).changed == ()


ragged = st.tuples(
    st.integers(0, 2**32 - 1), st.floats(0.05, 0.6), st.integers(1, 3), st.sampled_from([0.05, 0.1, 0.2])
)


def build_caves(seed: int, share: float, smooth: int, rows: int = 40, columns: int = 50) -> np.ndarray:
    """Return cells of caves."""
    from scipy import ndimage

    noise = np.random.default_rng(seed).random((rows, columns))
    field = ndimage.uniform_filter(noise, 2 * smooth + 1)
    free = field > np.quantile(field, share)
    free[[0, -1]] = free[:, [0, -1]] = False
    return free


@settings(deadline=None, max_examples=count_examples(25))
@given(ragged)
def test_in_any_cave_walls_stay_near_and_robots_pass(cave: tuple[int, float, int, float]) -> None:
    seed, share, smooth, tolerance = cave
    outline = affinity.scale(
        trace_outline(build_caves(seed, share, smooth), "grid"), CELL, CELL, origin=(0, 0)
    )
    radius = 0.1
    result = simplify_free_space(outline, tolerance, CELL, radius).free
    assert result.is_valid
    assert len(result.geoms) == len(outline.geoms)
    # Every corner of the cells is within the tolerance of a wall.
    corners = shapely.points(shapely.get_coordinates(outline))
    assert shapely.distance(result.boundary, corners).max() <= tolerance * (1 + 1e-6) + CELL / 16
    # Every corner of a wall is near the cells.
    corners = shapely.points(shapely.get_coordinates(result))
    assert shapely.distance(outline.boundary, corners).max() <= tolerance * (1 + 1e-6) + CELL / 16
    assert abs(result.area - outline.area) <= 0.02 * outline.area + 1e-9
    # Positions between which a robot of this size can drive are still connected.
    before = find_center_regions(outline, radius * 1.0001)
    after = shapely.union_all(find_center_regions(result, radius * 0.99))
    parts = shapely.get_parts(after)
    for room in before:
        if room.area < 4 * radius * radius:
            continue
        cores = shapely.get_parts(room.buffer(-3 * tolerance))
        met = {int(k) for core in cores for k in np.flatnonzero(shapely.intersects(parts, core))}
        assert len(met) <= 1


@settings(deadline=None, max_examples=count_examples(30))
@given(ragged)
def test_ring_vertices_are_consistent(cave: tuple[int, float, int, float]) -> None:
    seed, share, smooth, _ = cave
    cells = trace_outline(build_caves(seed, share, smooth), "grid")
    outline = OriginalOutline(list(cells.geoms), 1.0)
    assert outline.areas.sum() == pytest.approx(cells.area, abs=0.01 * outline.is_neck.sum() + 1e-9)
    everything = np.zeros(len(outline.points))
    nothing = np.zeros(len(outline.points), dtype=bool)
    # Without tolerance, the outline stays the same, including necks.
    restored = outline.to_polygons(outline.restore_necks(outline.simplify_outline(everything, nothing)))
    assert shapely.equals_exact(restored.normalize(), cells.normalize(), 1e-9)


def test_fixed_vertices_are_kept() -> None:
    angles = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    outline = OriginalOutline([Polygon(np.column_stack([np.cos(angles), np.sin(angles)]))], None)
    fixed_vertices = {7, 33, 90}
    is_fixed = np.zeros(len(angles), dtype=bool)
    is_fixed[list(fixed_vertices)] = True
    kept = set(outline.simplify_outline(np.full(len(angles), 0.5), is_fixed).source)
    assert fixed_vertices <= kept
    # A tolerance of half the radius leaves few other vertices.
    assert len(kept) <= 12


def test_a_gap_that_has_closed_is_found() -> None:
    def build_wall(*points: tuple[float, float]) -> np.ndarray:
        return np.stack([np.array(points[:-1]), np.array(points[1:])], axis=1)

    room = MultiPolygon(
        [shapely.box(0, 0, 4, 4) - shapely.box(1.9, 0, 2.1, 1.9) - shapely.box(1.9, 2.09, 2.1, 4)]
    )
    sides = np.concatenate(
        [build_wall((1.9, 1.9), (2.1, 1.9)), build_wall((2.1, 2.09), (1.9, 2.09)), build_wall((0, 0), (0, 4))]
    )
    wide = np.array([
        shapely.LineString([(1.9, 1.85), (2.1, 1.9)]),
        shapely.LineString([(2.1, 2.12), (1.9, 2.15)]),
        shapely.LineString([(0, 0), (0, 4)]),
    ])  # fmt: skip
    pairs, places = find_closed_gaps(sides, wide, room, 0.2, 0.05)
    assert pairs.tolist() == [[0, 1]]
    assert places[0, 1] == pytest.approx(1.995)
    assert len(find_closed_gaps(sides, shapely.linestrings(sides), room, 0.2, 0.05)[0]) == 0
    # Sides that face each other through a wall have no gap between them.
    solid = MultiPolygon([shapely.box(0, 0, 4, 1.9), shapely.box(0, 2.09, 4, 4)])
    assert len(find_closed_gaps(sides, wide, solid, 0.2, 0.05)[0]) == 0


@pytest.mark.slow
def test_a_comb_of_many_teeth_does_not_exhaust_the_stack() -> None:
    # With teeth of equal height, the usual recursion is as deep as the number of teeth.
    teeth = 20_000
    x = np.arange(2 * teeth) / 2.0
    y = np.where(np.arange(2 * teeth) % 2 == 0, 5.0, 5.4)
    shape = Polygon([*zip(x, y, strict=True), (x[-1], 0.0), (0.0, 0.0)])
    result = simplify_free_space(MultiPolygon([shape]), 0.02, None, 0.1)
    assert count_vertices(result.free) == count_vertices(shape)


def test_drawings_are_simplified_too() -> None:
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    round_room = Polygon(np.column_stack([np.cos(angle), np.sin(angle)]) * 3)
    result = simplify_free_space(MultiPolygon([round_room]), 0.02, None, 0.1)
    assert 15 < count_vertices(result.free) < 60
    assert shapely.hausdorff_distance(result.free.boundary, round_room.boundary) <= 0.02
    assert simplify_free_space(MultiPolygon([round_room]), 0.0, None, 0.1).free.geoms[0] is not None
    assert count_vertices(simplify_free_space(MultiPolygon([round_room]), 0.0, None, 0.1).free) == 400


@pytest.mark.parametrize("sides", [(0.05, 0.08), (0.1, 0.03)])
def test_cells_need_not_be_square(sides: tuple[float, float]) -> None:
    # Two obstacles touch at a corner, and the neck between them becomes that corner.
    free = np.ones((12, 12), dtype=bool)
    free[4, 4] = free[5, 5] = False
    cells = affinity.scale(trace_outline(free, "grid"), *sides, origin=(0, 0))
    turned = affinity.rotate(cells, 20, origin=(0, 0))
    for shape, turn in ((cells, 0), (turned, 20)):
        outline = OriginalOutline(list(shape.geoms), max(sides))
        expected = affinity.rotate(shapely.Point(5 * sides[0], 5 * sides[1]), turn, origin=(0, 0))
        assert outline.is_neck.sum() == 2
        assert outline.points[outline.is_neck] == pytest.approx(np.repeat([expected.coords[0]], 2, axis=0))
    # Slanted walls become straight.
    room = affinity.rotate(shapely.box(0, 0, 6, 4), 20, origin=(0, 0))
    stretched = affinity.scale(room, 1 / sides[0], 1 / sides[1], origin=(0, 0))
    stairs = affinity.scale(build_cells(stretched, 1.0), *sides, origin=(0, 0))
    result = simplify_free_space(stairs, max(sides), max(sides), 0.1)
    assert count_vertices(result.free) <= 8
    assert result.free.area == pytest.approx(24, rel=0.01)
    assert shapely.hausdorff_distance(result.free.boundary, room.boundary) < 2 * max(sides)
