"""The density in the editor: loading, editing and saving it; drawing, moving and weighting hot spots."""

import json

import numpy as np
import pytest
from density_cases import KINDS
from drawn_sketches import list_problems
from driven_editor import build_sheet, open_editor
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from property_examples import count_examples

from robocov.density import Gaussian, Gaussians, Raster, Uniform, WeightedArea, WeightedPolygons
from robocov.environment import CircleObstacle, Environment, PolygonObstacle
from robocov.errors import MapError
from robocov.mapfile import dump_map, load_map, save_map, to_json
from robocov_app.editor.edits import density as density_edits
from robocov_app.editor.model.map_file import read_sketch, write_sketch
from robocov_app.editor.model.parser import build_sketch, parse_sketch
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch, dump_sketch

RING = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
ONE = Gaussians((Gaussian((3.0, 3.0), 2.0, sigma=1.0),), 0.5)


def build_dense_map(density=ONE) -> Sketch:
    return Sketch.from_environment(Environment("heavy", RING, density=density))


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_a_density_survives_editing_and_saving(density, tmp_path):
    path = tmp_path / "heavy.json"
    save_map(Environment("heavy", RING, density=density), path)
    sketch, disk = read_sketch(path)
    assert sketch.density == density and sketch.build_environment() == load_map(path)
    assert dump_sketch(sketch) == path.read_text() == dump_map(load_map(path))
    edited, _ = sketch.with_obstacles([CircleObstacle((5.0, 5.0), 0.5)])
    write_sketch(edited, path, disk)
    assert load_map(path).density == density and len(load_map(path).obstacles) == 1


def test_a_picture_is_read_when_the_map_is(tmp_path):
    Image.fromarray(np.array([[0, 255], [51, 102]], dtype=np.uint8)).save(tmp_path / "phi.png")
    document = to_json(Environment("heavy", RING)) | {
        "density": {"kind": "raster", "image": "phi.png", "white": 5}
    }
    path = tmp_path / "heavy.json"
    path.write_text(json.dumps(document))
    sketch, _ = read_sketch(path)
    assert sketch.density == load_map(path).density and isinstance(sketch.density, Raster)
    write_sketch(sketch, tmp_path / "elsewhere.json")
    (tmp_path / "phi.png").unlink()
    assert load_map(tmp_path / "elsewhere.json").density == sketch.density
    with pytest.raises(MapError, match=r"heavy.json:.*density.image: .phi.png.: no such file"):
        read_sketch(path)


def test_an_invalid_density_is_reported_with_its_path():
    text = json.dumps(to_json(Environment("heavy", RING)) | {"density": {"kind": "gausians"}})
    with pytest.raises(MapError, match=r"density\.kind"):
        parse_sketch(text, "mine.json")
    # A draft without a boundary may have a density.
    document = to_json(Environment("heavy", RING, density=ONE))
    del document["boundary"]
    assert build_sketch(document).density == ONE


def test_a_density_of_zero_in_the_free_space_is_a_problem():
    nothing = WeightedPolygons(KINDS["rooms"].areas[1:], 0.0)
    covering = build_sheet(CircleObstacle((7.0, 5.5), 3.5), density=nothing)
    grave = [problem.message for problem in list_problems(covering) if problem.is_error]
    assert grave and "at least one weight above 0" in grave[0]
    assert not [problem for problem in list_problems(build_dense_map()) if problem.is_error]


class TestEdits:
    def test_the_first_hot_spot_stands_on_a_floor_of_one(self):
        change = density_edits.add_peak(build_sheet(), (3.0, 4.0), 1.5, 4.0)
        assert change.sketch.density == Gaussians((Gaussian((3.0, 4.0), 4.0, sigma=1.5),), 1.0)
        two = density_edits.add_peak(change.sketch, (6.0, 4.0), 0.5, 2.0).sketch
        assert len(density_edits.list_features(two)) == 2
        assert (
            density_edits.add_peak(build_dense_map(Uniform(3.0)), (6.0, 4.0), 0.5, 2.0).sketch.density.floor
            == 3.0
        )

    def test_removing_the_last_hot_spot_removes_the_density(self):
        assert density_edits.remove_feature(build_dense_map(), 0).sketch.density is None
        assert density_edits.remove_density(build_dense_map()).sketch.density is None
        with pytest.raises(MapError, match="the same weight already"):
            density_edits.remove_density(build_sheet())

    def test_hot_spots_are_moved_resized_and_weighted(self):
        moved = density_edits.move_feature(build_dense_map(), 0, 1.0, 2.0).sketch
        assert density_edits.list_features(moved)[0].center == (4.0, 5.0)
        sized = density_edits.resize_peak(moved, 0, 2.5).sketch
        assert density_edits.list_features(sized)[0].sigma == 2.5
        weighed = density_edits.set_weight(sized, 0, 7.0).sketch
        assert weighed.density == Gaussians((Gaussian((4.0, 5.0), 7.0, sigma=2.5),), 0.5)
        assert density_edits.set_floor(weighed, 0.0).sketch.density.floor == 0.0

    def test_an_elliptic_hot_spot_keeps_its_shape(self):
        slanted = Gaussian((3.0, 3.0), 2.0, covariance=((2.0, 0.6), (0.6, 1.0)))
        sketch = build_dense_map(Gaussians((slanted,), 0.5))
        spread = density_edits.compute_spread(slanted)
        twice = density_edits.list_features(density_edits.resize_peak(sketch, 0, 2.0 * spread).sketch)[0]
        assert density_edits.compute_spread(twice) == pytest.approx(2.0 * spread)
        assert np.array(twice.matrix) == pytest.approx(4.0 * np.array(slanted.matrix))

    @pytest.mark.parametrize(
        ("edit", "message"),
        [
            (lambda: density_edits.add_peak(build_dense_map(), (1.0, 1.0), 0.001, 4.0), "needs a size"),
            (
                lambda: density_edits.add_peak(build_dense_map(), (1.0, 1.0), 1e5, 4.0),
                "a size from 20 mm to 10 km",
            ),
            (
                lambda: density_edits.add_peak(build_dense_map(), (1.0, 1.0), 1.0, 0.0),
                "weight: expected .*, got 0",
            ),
            (lambda: density_edits.add_peak(build_dense_map(), (1e9, 1.0), 1.0, 1.0), "too far away"),
            (
                lambda: density_edits.set_weight(build_dense_map(), 0, float("nan")),
                "weight: expected .*, got nan",
            ),
            (
                lambda: density_edits.set_weight(build_dense_map(), 0, 1e9),
                r"weight: expected a number from 0\.000001 to 1000000, got 1e",
            ),
            (
                lambda: density_edits.set_floor(build_dense_map(), 1e9),
                "floor: expected a number from 0 to 1000000, got 1e",
            ),
            (lambda: density_edits.move_feature(build_dense_map(), 5, 1.0, 1.0), "hot spot no longer exists"),
            (lambda: density_edits.set_floor(build_sheet(), 0.0), "floor: expected .*, got 0"),
            (
                lambda: density_edits.add_peak(build_dense_map(KINDS["rooms"]), (1.0, 1.0), 1.0, 1.0),
                "hot spots cannot be added to a density of the kind “polygons”",
            ),
        ],
    )
    def test_impossible_edits_raise_a_map_error(self, edit, message):
        with pytest.raises(MapError, match=message):
            edit()

    @given(
        center=st.tuples(st.floats(0.5, 9.5), st.floats(0.5, 9.5)),
        sigma=st.floats(0.05, 20.0),
        weight=st.floats(0.001, 1000.0),
    )
    @settings(max_examples=count_examples(15), deadline=None)
    def test_any_drawn_density_can_be_saved(self, center, sigma, weight):
        sketch = density_edits.add_peak(build_dense_map(), center, sigma, weight).sketch
        assert parse_sketch(dump_sketch(sketch), "again").density == sketch.density
        assert sketch.build_environment().density == sketch.density

    def test_densities_are_described(self):
        assert density_edits.describe_density(None) == "none: equal everywhere"
        assert density_edits.describe_density(ONE) == "1 hot spot, floor 0.5"
        assert density_edits.describe_density(KINDS["bilinear"]) == "image, 13 x 11"
        assert density_edits.describe_density(KINDS["rooms"]) == "2 areas, 0.3 to 4"


def test_hot_spots_are_edited_by_mouse_and_keyboard(tmp_path):
    with open_editor(tmp_path, build_sheet()) as driver:
        plain = driver.copy_frame()
        driver.press_key("d")
        driver.drag(*(driver.find_pixel(point) for point in ((3, 3), (4, 3), (5, 3))))
        (peak,) = density_edits.list_features(driver.sketch)
        assert peak.center == pytest.approx((3.0, 3.0), abs=0.06)
        assert peak.sigma == pytest.approx(2.0, abs=0.1) and peak.weight == 4.0
        assert not driver.shows_frame(plain)
        driver.type("6.5")
        driver.press_key("return")
        assert density_edits.list_features(driver.sketch)[0].weight == 6.5
        # Dragging the rim changes the size.
        rim = driver.find_pixel((peak.center[0], peak.center[1] + peak.sigma))
        driver.wait()
        driver.drag(rim, *(driver.find_pixel((peak.center[0], peak.center[1] + away)) for away in (2.5, 3.0)))
        assert density_edits.list_features(driver.sketch)[0].sigma == pytest.approx(3.0, abs=0.1)
        # Dragging the middle moves the hot spot.
        driver.wait()
        driver.drag(*(driver.find_pixel(point) for point in (peak.center, (4, 4), (6, 5))))
        assert density_edits.list_features(driver.sketch)[0].center == pytest.approx((6.0, 5.0), abs=0.06)
        driver.wait()
        driver.drag(*(driver.find_pixel(point) for point in ((1.5, 8), (1.8, 8), (2, 8))))
        assert [each.weight for each in density_edits.list_features(driver.sketch)] == [6.5, 6.5]
        driver.press_key("backspace")
        assert len(density_edits.list_features(driver.sketch)) == 1
        driver.press_key("ctrl+z")
        assert len(density_edits.list_features(driver.sketch)) == 2
        driver.wait()
        driver.click_at((6.0, 5.0))
        assert driver.editor.tool.chosen == 0
        driver.press_key("escape")
        assert driver.editor.tool.chosen is None and driver.editor.tool.build_overlay(driver.editor).outlines
        driver.run_command("floor 0.2")
        driver.run_command("weight 3")
        assert driver.sketch.density.floor == 0.2 and driver.editor.tool.weight == 3.0
        assert density_edits.describe_density(driver.sketch.density) == "2 hot spots, floor 0.2"
        driver.run_command("density none")
        assert driver.sketch.density is None
        driver.run_command("density some")
        assert "expected none" in driver.read_dialog_error()
        driver.press_key("v")
        driver.run_frames(2)


def test_a_canceled_drag_changes_nothing(tmp_path):
    with open_editor(tmp_path, build_sheet()) as driver:
        driver.press_key("d")
        driver.press(*driver.find_pixel((3, 3)))
        driver.move(*driver.find_pixel((5, 3)), held=1)
        assert driver.editor.tool.change is not None
        driver.press_key("escape")
        driver.release()
        assert driver.sketch.density is None and not driver.editor.document.history.undo_descriptions


AREA = ((2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0))


class TestAreas:
    def test_areas_are_added_moved_weighted_and_removed(self):
        sketch = density_edits.add_area(build_sheet(), WeightedArea(AREA, 3.0)).sketch
        assert sketch.density == WeightedPolygons((WeightedArea(AREA, 3.0),), 1.0)
        moved = density_edits.move_feature(sketch, 0, 1.0, -1.0).sketch
        assert moved.density.areas[0].vertices[0] == (3.0, 1.0)
        bent = density_edits.move_corner(sketch, 0, 2, (7.0, 7.0)).sketch
        assert bent.density.areas[0].vertices[2] == (7.0, 7.0)
        lighter = density_edits.set_weight(sketch, 0, 0.0).sketch
        assert lighter.density.areas[0].weight == 0.0 and lighter.density.background == 1.0
        assert density_edits.set_floor(sketch, 0.0).sketch.density.background == 0.0
        assert density_edits.remove_feature(sketch, 0).sketch.density is None
        assert parse_sketch(dump_sketch(bent), "again").density == bent.density

    def test_the_weight_outside_areas_is_not_called_a_minimum(self):
        """The weights of areas may be lower."""
        sketch = density_edits.add_area(build_sheet(), WeightedArea(AREA, 0.5)).sketch
        assert density_edits.set_floor(sketch, 2.0).description == "the weight is 2 outside all areas"
        peak = density_edits.add_peak(build_sheet(), (3.0, 4.0), 1.5, 4.0).sketch
        assert density_edits.set_floor(peak, 2.0).description == "the weight is at least 2 everywhere"

    def test_polygons_become_areas_with_their_holes_and_names(self):
        hole = ((3.0, 3.0), (4.0, 3.0), (4.0, 4.0))
        sketch, keys = build_sheet().with_obstacles(
            [PolygonObstacle(AREA, (hole,), "ward"), CircleObstacle((8.0, 8.0), 0.5)]
        )
        change = density_edits.convert_polygons(sketch, Selection.of(keys[0]), 5.0)
        assert change.sketch.density == WeightedPolygons((WeightedArea(AREA, 5.0, (hole,), "ward"),), 1.0)
        assert len(change.sketch.obstacles) == 1
        with pytest.raises(MapError, match="select polygons"):
            density_edits.convert_polygons(sketch, Selection.of(keys[1]), 5.0)

    @pytest.mark.parametrize(
        ("edit", "message"),
        [
            (lambda s: density_edits.add_area(s, WeightedArea(AREA[:2], 1.0)), "three corners"),
            (
                lambda s: density_edits.add_area(s, WeightedArea((*AREA[:2], AREA[3], AREA[2]), 1.0)),
                "crossings",
            ),
            (
                lambda s: density_edits.add_area(build_dense_map(), WeightedArea(AREA, 1.0)),
                "areas cannot be added to a density of the kind “gaussians”",
            ),
            (
                lambda s: density_edits.add_peak(
                    density_edits.set_weight(s, 0, 1.0).sketch, (8.0, 8.0), 1.0, 4.0
                ),
                "hot spots cannot be added",
            ),
            (lambda s: density_edits.move_corner(s, 0, 9, (0.0, 0.0)), "corner no longer exists"),
            (lambda s: density_edits.resize_peak(s, 0, 1.0), "hot spot no longer exists"),
            (lambda s: density_edits.set_weight(density_edits.set_floor(s, 0.0).sketch, 0, 0.0), "above 0"),
        ],
    )
    def test_impossible_edits_raise_a_map_error(self, edit, message):
        with pytest.raises(MapError, match=message):
            edit(density_edits.add_area(build_sheet(), WeightedArea(AREA, 3.0)).sketch)

    def test_the_bundled_hospital_is_edited_with_the_mouse_and_by_typing(self, tmp_path):
        sketch = Sketch.from_environment(load_map("hospital"))
        with open_editor(tmp_path, sketch) as driver:
            driver.press_key("d")
            first = driver.sketch.density.areas[0]
            driver.click_at((5.5, 2.0))
            assert driver.editor.tool.chosen == 0
            driver.type("6")
            driver.press_key("return")
            assert driver.sketch.density.areas[0].weight == 6.0
            driver.type("0")
            driver.press_key("return")
            assert driver.sketch.density.areas[0].weight == 0.0
            driver.type("6")
            driver.press_key("return")
            driver.wait()
            driver.drag(
                *(driver.find_pixel(point) for point in (first.vertices[2], (11.5, 6.0), (12.0, 6.0)))
            )
            assert driver.sketch.density.areas[0].vertices[2] == pytest.approx((12.0, 6.0), abs=0.2)
            driver.wait()
            driver.drag(*(driver.find_pixel(point) for point in ((13.0, 9.0), (14.0, 10.0), (15.0, 11.0))))
            assert len(driver.sketch.density.areas) == len(sketch.density.areas) + 1
            driver.press_key("backspace")
            assert len(driver.sketch.density.areas) == len(sketch.density.areas)
            assert driver.sketch.build_environment().density == driver.sketch.density
