"""Measurement of sketches: reachable space, narrow gaps and warnings."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, drafts, list_problems, valid_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy import ndimage
from shapely import MultiPolygon

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle, WallObstacle
from robocov.mapfile import list_bundled_maps, load_map
from robocov.mapfile.check import check_map
from robocov_app.editor.model import measurement
from robocov_app.editor.model.measurement import compute_reach, measure
from robocov_app.editor.model.sketch import Sketch

FAR = ((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0))


def build_hall_with_doors(*widths: float) -> Sketch:
    """Build a hall of 12 x 8 m divided into rooms, with doors of some widths in the walls at y = 4."""
    shapes = []
    for k, width in enumerate(widths):
        x = 12.0 * (k + 1) / (len(widths) + 1)
        shapes.append(WallObstacle(((x, -1.0), (x, 4.0 - width / 2)), 0.2))
        shapes.append(WallObstacle(((x, 4.0 + width / 2), (x, 9.0)), 0.2))
    return Sketch("Doors", boundary=HALL).with_obstacles(shapes)[0]


def test_passages_beyond_the_limit_share_a_warning(monkeypatch):
    monkeypatch.setattr(measurement, "_MAX_GAPS", 1)
    for doors, summary in ((2, "1 more passage is "), (3, "2 more passages are ")):
        problems = measure(build_hall_with_doors(*[0.1] * doors), 0.1).problems
        assert any(problem.message.startswith(summary) for problem in problems)


def rasterize_reach(free: shapely.Geometry, radius: float, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the possible centers of a robot on a raster, labeled by part, and the cells that it sweeps."""
    xs = np.arange(cell / 2, 12.0, cell)
    ys = np.arange(cell / 2, 8.0, cell)
    x, y = np.meshgrid(xs, ys)
    inside = shapely.contains_xy(free, x.ravel(), y.ravel()).reshape(x.shape)
    distance = shapely.distance(free.boundary, shapely.points(x.ravel(), y.ravel())).reshape(x.shape)
    centers = inside & (distance >= radius)
    parts, _ = ndimage.label(centers, np.ones((3, 3)))
    swept = ndimage.distance_transform_edt(~centers) * cell <= radius if centers.any() else centers
    return parts, swept & inside


@pytest.mark.slow
@settings(max_examples=count_examples(25))
@given(valid_sketches(min_size=1, max_size=6), st.sampled_from([0.1, 0.25, 0.6]))
def test_reach_agrees_with_a_raster(sketch, radius):
    free = sketch.build_unchecked_environment().free
    if free.is_empty:
        return
    cell = 0.05
    parts, swept = rasterize_reach(free, radius, cell)
    reached, untouched = compute_reach(free, radius)
    opened = shapely.union_all(reached)
    perimeter = free.length
    assert opened.area == pytest.approx(swept.sum() * cell**2, abs=2.0 * perimeter * cell)
    # Parts that are clear on a raster are found.
    sizes = ndimage.sum_labels(np.ones_like(parts), parts, np.arange(1, parts.max() + 1))
    assert len(reached) >= (sizes * cell**2 > 4 * cell).sum() - 1
    assert free.buffer(1e-6).covers(opened)
    assert (untouched - free).area < 1e-6
    # The opened space hardly overlaps the space that robots never touch.
    assert shapely.intersection(opened, untouched).area < 1e-3 * perimeter
    # The remainder is small: none of its points is farther from the swept space than the radius.
    remainder = free - opened - untouched.buffer(2e-3)
    for part in shapely.get_parts(remainder):
        if part.area > 1e-4:
            points = shapely.points(shapely.get_coordinates(part))
            assert shapely.distance(opened, points).max() <= radius + 2e-3


@pytest.mark.parametrize(
    ("width", "radius", "passes"),
    [(0.9, 0.4, True), (0.9, 0.45, True), (0.9, 0.4501, False), (0.5, 0.3, False)],
)
def test_robots_pass_doors_wider_than_they_are(width, radius, passes):
    result = measure(build_hall_with_doors(width), radius)
    assert result.gap.width == pytest.approx(width)
    assert result.components == pytest.approx([96.0 - 0.2 * (8.0 - width)])
    assert len(result.reached) == (1 if passes else 2)
    words = [problem.message for problem in result.problems]
    if passes:
        assert result.impassable.is_empty
        assert result.cut_off.is_empty
        assert words == []
    else:
        # Only the door is marked, and one of the two rooms is cut off.
        (mark,) = result.impassable.geoms
        assert mark.distance(shapely.Point(6.0, 4.0)) == 0.0
        assert math.pi * (width / 2) ** 2 * 0.99 <= mark.area <= width * (0.2 + 2 * radius)
        assert result.cut_off.area == pytest.approx(5.9 * 8.0, abs=0.5)
        assert words[0] == (
            f"the passage at (5.9, 4) is {width:.3g} m wide: too narrow for robots of radius {radius:g} m"
        )
        assert words[1].startswith(
            f"robots of radius {radius:g} m cannot pass between 2 parts of the free space"
        )
        assert len(words) == 2


def test_one_of_three_doors_is_too_narrow():
    result = measure(build_hall_with_doors(1.0, 0.5, 2.0), 0.3)
    assert result.gap.width == pytest.approx(0.5)
    (mark,) = result.impassable.geoms
    assert mark.distance(shapely.Point(6.0, 4.0)) == 0.0
    assert [round(area) for area in result.reached] == [46, 46]
    assert result.vertices == 4 + 6 * 2


def test_a_passage_that_returns_to_the_same_room_is_marked():
    # Two blocks 0.3 m apart in the middle of the hall; a robot can drive around them.
    blocks = [
        PolygonObstacle(((3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0))),
        PolygonObstacle(((5.3, 3.0), (7.3, 3.0), (7.3, 5.0), (5.3, 5.0))),
    ]
    result = measure(Sketch(boundary=HALL).with_obstacles(blocks)[0], 0.2)
    assert len(result.reached) == 1
    (mark,) = result.impassable.geoms
    # The mark consists of the slot and half a disc at each end.
    assert mark.area == pytest.approx(0.3 * 2.0 + math.pi * 0.15**2, abs=0.01)
    # Blocks with a gap of 1.5 mm count as touching.
    closed = [blocks[0], PolygonObstacle(((5.0015, 3.0), (7.3, 3.0), (7.3, 5.0), (5.0015, 5.0)))]
    result = measure(Sketch(boundary=HALL).with_obstacles(closed)[0], 0.2)
    assert result.impassable.is_empty
    assert result.gap.width == pytest.approx(3.0)


def test_niches_and_sealed_pockets_are_marked_but_not_corners():
    niche = PolygonObstacle(
        ((3.0, 0.0), (5.0, 0.0), (5.0, 3.0), (4.2, 3.0), (4.2, 1.0), (4.0, 1.0), (4.0, 3.0), (3.0, 3.0))
    )
    frame = PolygonObstacle(
        ((8.0, 4.0), (9.0, 4.0), (9.0, 5.0), (8.0, 5.0)), (((8.4, 4.4), (8.6, 4.4), (8.6, 4.6), (8.4, 4.6)),)
    )
    pillar = CircleObstacle((10.0, 2.0), 0.5)
    result = measure(Sketch(boundary=HALL).with_obstacles([niche, frame, pillar])[0], 0.3)
    marks = sorted(result.impassable.geoms, key=lambda part: part.centroid.x)
    assert len(marks) == 2
    assert marks[0].area == pytest.approx(0.2 * 2.0, abs=0.03)
    assert marks[1].area == pytest.approx(0.04, abs=0.002)
    assert len(result.reached) == 1
    assert measure(Sketch(boundary=HALL), 0.3).impassable.is_empty


def test_a_map_in_which_no_robot_fits_has_a_warning():
    result = measure(Sketch("n", boundary=((0.0, 0.0), (9.0, 0.0), (9.0, 0.3), (0.0, 0.3))), 0.2)
    assert result.reached == ()
    assert result.impassable.area == pytest.approx(2.7)
    assert "no robot of radius 0.2 m fits anywhere" in [problem.message for problem in result.problems]


@pytest.mark.parametrize("name", ["rooms", "office", "gaps", "cave", "museum"])
def test_measurements_agree_with_the_check_command(name):
    environment = load_map(name)
    report = check_map(environment, 0.1)
    result = measure(Sketch.from_environment(environment), 0.1)
    assert result.free_area == report.free_area
    assert result.components == report.components
    assert result.gap == report.narrowest_gap
    assert sum(result.reached) <= report.free_area
    assert name in list_bundled_maps()


@settings(max_examples=count_examples(50))
@given(drafts(), st.sampled_from([0.05, 0.3]))
def test_every_draft_can_be_measured(sketch, radius):
    result = measure(sketch, radius)
    assert isinstance(result.impassable, MultiPolygon)
    assert result.free_area == pytest.approx(sum(result.components))
    assert sum(result.reached) <= result.free_area + 1e-6
    assert [problem.message for problem in result.problems][: len(list_problems(sketch, radius))] == [
        problem.message for problem in list_problems(sketch, radius)
    ]


def test_invalid_parts_count_as_far_as_they_are_valid():
    assert measure(Sketch()).free_area == 0.0
    bow_tie = PolygonObstacle(((1.0, 1.0), (3.0, 3.0), (3.0, 1.0), (1.0, 3.0)))
    result = measure(Sketch("n", boundary=HALL).with_obstacles([bow_tie, WallObstacle((), 0.1)])[0])
    assert result.free_area == pytest.approx(96.0 - 2.0)
    crossing = measure(Sketch("n", boundary=((0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0))))
    assert crossing.components == pytest.approx((4.0, 4.0))


@pytest.mark.parametrize("huge", [1e5, 1e12, 1e300])
def test_sizes_that_no_map_has_are_measured(huge):
    shapes = [CircleObstacle((1.0, 1.0), huge), WallObstacle(((1.0, 1.0), (huge, 1.0)), huge)]
    sketch = Sketch("n", boundary=HALL, starts=(("a", DiscStart((huge, 1.0), huge)),)).with_obstacles(shapes)[
        0
    ]
    result = measure(sketch)
    assert result.free_area == pytest.approx(96.0)
    assert len([problem for problem in result.problems if problem.is_error]) >= 3
    far = measure(replace(sketch, boundary=((0.0, 0.0), (huge, 0.0), (0.0, huge))))
    assert far.free_area == 0.0
