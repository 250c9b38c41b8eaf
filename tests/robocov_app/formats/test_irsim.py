"""Worlds of IR-SIM: shapes at their states, groups, images with cells that are not square."""

import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image
from raster_files import build_pgm, draw_pixels
from shapely import affinity, box

from robocov.environment import CircleObstacle
from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions, detect_format, import_map

IMPORTER = IMPORTERS["irsim"]

WORLD = "world:\n  height: 6  # along y\n  width: 10\n  offset: [-1, 2]\n  step_time: 0.1\n"
SPACE = box(-1, 2, 9, 8)


def read(folder: Path, text: str, world: str = WORLD, **options: object) -> ForeignMap:
    path = folder / "world.yaml"
    path.write_text(world + text)
    assert detect_format(path) is IMPORTER
    return IMPORTER.read(path, ReadOptions(**options))  # type: ignore[arg-type]


def compute_solid_area(foreign: ForeignMap) -> shapely.Geometry:
    """Return the area of the space that is not free."""
    return SPACE - foreign.free


def test_only_some_of_very_many_robots_become_starts(tmp_path: Path) -> None:
    world = "world: {width: 100, height: 100}\n"
    states = [[1 + 1.5 * (k % 60), 1 + 1.5 * (k // 60), 0] for k in range(1200)]
    read(tmp_path, f"robot: {{number: 1200, state: {states}}}\nobstacle: []\n", world)
    environment, report, _ = import_map(tmp_path / "world.yaml")
    assert len(environment.starts["robots"].positions) == 1000  # type: ignore[union-attr]
    note = 'start "robots": 1000 of 1200 positions of robots in the file; only the first 1000 are read'
    assert note in report.notes


def test_shapes_are_rotated_and_moved_to_their_states(tmp_path: Path) -> None:
    foreign = read(
        tmp_path,
        """
obstacle:
  - shape: {name: 'circle', radius: 0.5, center: [1, 0]}
    state: [1, 4, 1.5707963267948966]
  - {shape: {name: rectangle, length: 2, width: 1}, state: [4, 4, 0.5]}
  - shape:
      name: 'polygon'
      vertices:
        - [0, 0]
        - [1, 0]
        - [1, 2]
    state: [7, 5]
  - shape: {name: linestring, vertices: [[0, 2], [0, 4]]}
    state: [6, 1, 0]
""",
        thickness=0.2,
    )
    expected = [
        CircleObstacle((1.0, 5.0), 0.5).polygon,
        affinity.rotate(box(3, 3.5, 5, 4.5), 0.5, origin=(4, 4), use_radians=True),
        shapely.Polygon([(7, 5), (8, 5), (8, 7)]),
        box(5.9, 3, 6.1, 5),
    ]
    assert compute_solid_area(foreign).symmetric_difference(shapely.union_all(expected)).area < 1e-5
    assert foreign.boundary is not None and foreign.boundary.equals(SPACE)


def test_the_last_item_of_a_list_applies_to_the_rest_of_a_group(tmp_path: Path) -> None:
    foreign = read(
        tmp_path,
        """
obstacle:
  - number: 3
    distribution: {name: manual}
    state: [[1, 4], [4, 4], [7, 4]]
    shape:
      - {name: rectangle, length: 2, width: 1}
      - {name: rectangle, length: 1, width: 1}
  - number: 4
    distribution: {name: circle, radius: 2.5, center: [4, 5]}
    shape: {name: rectangle, length: 0.5, width: 0.1}
""",
    )
    expected = [box(0, 3.5, 2, 4.5), box(3.5, 3.5, 4.5, 4.5), box(6.5, 3.5, 7.5, 4.5)]
    expected += [box(6.25, 4.95, 6.75, 5.05), box(1.25, 4.95, 1.75, 5.05)]
    expected += [box(3.95, 7.25, 4.05, 7.75), box(3.95, 2.25, 4.05, 2.75)]
    assert compute_solid_area(foreign).symmetric_difference(shapely.union_all(expected)).area < 1e-5


def test_parts_of_a_compound_have_poses_of_their_own(tmp_path: Path) -> None:
    foreign = read(
        tmp_path,
        """
obstacle:
  shape:
    name: compound
    parts:
      - {name: rectangle, length: 2, width: 0.5}
      - {name: rectangle, length: 1, width: 0.5, pose: [0, 1, 0]}
  state: [4, 5, 1.5707963267948966]
""",
    )
    expected = shapely.MultiPolygon([box(3.75, 4, 4.25, 6), box(2.75, 4.5, 3.25, 5.5)])
    assert compute_solid_area(foreign).symmetric_difference(expected).area < 1e-5


def test_random_and_non_colliding_shapes_are_counted(tmp_path: Path) -> None:
    text = """
robot:
  - kinematics: {name: diff}
    state: [[0, 3, 0], [1, 3, 0]]
    number: 2
  - {number: 5, distribution: {name: random}}
obstacle:
  - {number: 10, distribution: {name: random, range_low: [0, 0, 0]}}
  - {number: 2, shape: [{name: polygon, random_shape: true}], state: [5, 5]}
  - {name: ghost, shape: {name: circle, radius: 1}, unobstructed: True, state: [5, 5]}
  - {name: [post], group_name: posts, shape: {name: rectangle}, state: [7, 5], kinematics: {name: omni}}
  - {number: -3, distribution: {name: random}}
"""
    foreign = read(tmp_path, text)
    assert compute_solid_area(foreign).equals(box(6.5, 4.5, 7.5, 5.5))
    assert foreign.robots == ((0.0, 3.0), (1.0, 3.0))
    assert foreign.dropped == (
        "10 obstacles that IR-SIM places at random",
        "1 obstacle that nothing collides with",
        "5 robots that IR-SIM places at random",
        "2 shapes of random form",
    )
    assert foreign.notes == ("1 obstacle with kinematics treated as fixed at their initial positions",)
    assert read(tmp_path, text, skip=("posts",)).free.equals(SPACE)
    environment, _, _ = import_map(tmp_path / "world.yaml")
    assert environment.starts["robots"].positions == ((0.0, 3.0), (1.0, 3.0))  # type: ignore[union-attr]


def test_obstacles_that_are_left_out_are_not_counted_as_fixed(tmp_path: Path) -> None:
    text = """
obstacle:
  - {shape: {name: circle, random_shape: true}, kinematics: {name: omni}, state: [5, 5]}
  - {number: 0, distribution: {name: random}}
"""
    foreign = read(tmp_path, text)
    assert foreign.notes == ()
    assert foreign.dropped == ("1 shape of random form",)


def test_a_picture_fills_the_world_for_any_cell_size(tmp_path: Path) -> None:
    (tmp_path / "grid.pgm").write_bytes(build_pgm(draw_pixels("#...\n....\n...#")))
    foreign = read(tmp_path, "  obstacle_map: 'grid.pgm'\n")
    # The cells are 2.5 x 2 m, and the first row of the image is at the top.
    assert foreign.free.equals(SPACE - box(-1, 6, 1.5, 8) - box(6.5, 2, 9, 4))
    assert foreign.cell == 2.5
    foreign = read(tmp_path, "  obstacle_map: {name: image, path: grid.pgm}\n  mdownsample: 2\n")
    # Rows are counted from the bottom: the rows ...# and #... are left, with every other column.
    assert foreign.free.equals(SPACE - box(-1, 5, 4, 8))
    obstacle = "  obstacle_map: grid.pgm\nobstacle:\n  - {shape: {name: rectangle}, state: [4, 5]}\n"
    assert read(tmp_path, obstacle).free.area == pytest.approx(60 - 10 - 1)


def test_pictures_are_only_read_from_the_folder(tmp_path: Path) -> None:
    (tmp_path / "far.pgm").write_bytes(build_pgm(draw_pixels("#.\n..")))
    folder = tmp_path / "worlds"
    folder.mkdir()
    with pytest.raises(MapError, match=r"world\.obstacle_map: '\.\./far\.pgm' is outside"):
        read(folder, "  obstacle_map: ../far.pgm\n")
    assert read(folder, "  obstacle_map: ../far.pgm\n", anywhere=True).free.area == pytest.approx(45)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("  obstacle_map: {name: perlin, seed: 1}", "world.obstacle_map: expected an image, got 'perlin'"),
        ("  mdownsample: 0\n  obstacle_map: a.pgm", "world.mdownsample: expected a number from 1"),
        ("obstacle: 5", "obstacle: expected a mapping"),
        ("obstacle:\n  - {shape: {name: blob}}", "obstacle[0].shape.name: expected circle, rectangle"),
        ("obstacle:\n  - {shape: {radius: -1}}", "obstacle[0].shape.radius: expected a number from"),
        (
            "obstacle:\n  - {shape: {radius: x}}",
            "obstacle[0].shape.radius: expected a number from -1e7 to 1e7",
        ),
        (
            "obstacle:\n  - {state: [1, a]}",
            "obstacle[0].state[1]: expected a number from -1e7 to 1e7, got 'a'",
        ),
        ("obstacle:\n  - {state: 1}", "obstacle[0].state: expected a list, got '1'"),
        ("obstacle:\n  - {state: [1]}", "obstacle[0].state: expected a list of 3 numbers"),
        ("obstacle:\n  - {state: [.nan, 1]}", "obstacle[0].state[0]: expected a number"),
        ("obstacle:\n  - {state: [1e9, 1]}", "obstacle[0].state[0]: expected a number from -1e7 to 1e7"),
        ("obstacle:\n  - {number: 9e6}", "obstacle[0].number: expected a number of at most 4000"),
        ("obstacle:\n  - {distribution: {name: x}}", "obstacle[0].distribution.name: expected manual"),
        ("obstacle:\n  shape: {name: polygon, vertices: [[0, 0]]}", "shape.vertices: expected "),
        ("obstacle:\n  - &a {shape: *a}", "line 7: expected the name of an anchor before it"),
        ("obstacle: " + "[" * 20, "nested too deeply, expected at most 12 levels"),
    ],
)  # fmt: skip
def test_invalid_values_are_reported_with_their_place(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "a.pgm").write_bytes(build_pgm(np.full((2, 2), 255, np.uint8)))
    with pytest.raises(MapError) as caught:
        read(tmp_path, text)
    assert expected in str(caught.value) and "\n" not in str(caught.value)


def test_a_world_is_not_mistaken_for_a_map_of_ros(tmp_path: Path) -> None:
    # The generated map has a resolution, and a comment mentions an image.
    path = tmp_path / "world.yaml"
    path.write_text(WORLD + "  obstacle_map:\n    name: perlin # or an image: a.png\n    resolution: 0.1\n")
    assert detect_format(path) is IMPORTER


def test_rotations_are_in_radians() -> None:
    from robocov_app.formats.geometry.frames import build_frame

    assert build_frame(1.0, 2.0, math.pi / 2) == pytest.approx(np.array([[0, -1, 1], [1, 0, 2], [0, 0, 1]]))


def test_anchors_and_aliases_repeat_shapes(tmp_path: Path) -> None:
    foreign = read(
        tmp_path,
        """
obstacle:
  - shape: &box {name: 'rectangle', length: 1.0, width: 0.5}
    state: [2, 5, 0]
  - shape: *box
    state: [6, 5, 0]
  - {shape: {<<: *box, length: 2}, state: [4, 3.5]}
""",
    )
    expected = shapely.union_all(
        [box(1.5, 4.75, 2.5, 5.25), box(5.5, 4.75, 6.5, 5.25), box(3, 3.25, 5, 3.75)]
    )
    assert compute_solid_area(foreign).symmetric_difference(expected).area < 1e-6


PARTS = ", ".join(["*a"] * 100)


@pytest.mark.parametrize(
    "text",
    [
        # 4,000 objects of 100 parts, or of 10,000
        f"parts:\n  - &a {{name: circle, random_shape: true}}\n  - &b [{PARTS}]\nobstacle:\n"
        "  - {number: 4000, shape: {name: compound, parts: *b}}",
        "obstacle:\n  - {number: 4000, shape: {name: compound, parts: ["
        + "{name: compound}, " * 10_000
        + "]}}",
    ],
    ids=["aliases", "parts"],
)
def test_parts_of_many_objects_are_counted_together(tmp_path: Path, text: str) -> None:
    with pytest.raises(MapError, match="expected at most 20000 shapes, got 20001"):
        read(tmp_path, text)


# Maps that are installed with IR-SIM


def install_irsim(folder: Path, monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    """Put a package that looks like IR-SIM, and may not be imported, where Python looks for packages."""
    maps = folder / "site" / "irsim" / "world" / "map" / "more"
    maps.mkdir(parents=True)
    (folder / "site" / "irsim" / "__init__.py").write_text("raise RuntimeError('imported')")
    (maps / "cave.png").write_bytes(content)
    monkeypatch.syspath_prepend(folder / "site")


BUNDLED = "  obstacle_map: cave.png\n"


def test_a_bundled_map_is_found_where_irsim_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cells = np.full((6, 10), 255, np.uint8)
    cells[0, 0] = 0
    install_irsim(tmp_path, monkeypatch, build_pgm(cells))
    foreign = read(tmp_path, BUNDLED)
    assert compute_solid_area(foreign).equals(box(-1, 7, 0, 8))
    assert "world.obstacle_map: 'cave.png' read from the installed ir-sim" in foreign.notes
    with pytest.raises(
        MapError, match=r"got 'hall.png'. The installed IR-SIM has no such image \(it has cave.png\)"
    ):
        read(tmp_path, "  obstacle_map: hall.png\n")
    # A picture next to the file has priority.
    (tmp_path / "cave.png").write_bytes(build_pgm(np.full((6, 10), 255, np.uint8)))
    assert compute_solid_area(read(tmp_path, BUNDLED)).is_empty


def test_a_bundled_map_requires_irsim(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MapError) as caught:
        read(tmp_path, BUNDLED)
    place = f"{tmp_path / 'world.yaml'}: world.obstacle_map: "
    expected = "expected an image next to the file, or an image of IR-SIM, got 'cave.png'. "
    assert str(caught.value) == place + expected + "IR-SIM is not installed (pip install ir-sim)."


def test_transparency_is_reported_as_the_cause(tmp_path: Path) -> None:
    Image.new("LA", (4, 4), (0, 0)).save(tmp_path / "dark.png")
    cause = "no cell is free: 100% of the pixels are transparent; their hidden color is used"
    with pytest.raises(MapError, match=cause):
        read(tmp_path, "  obstacle_map: dark.png\n")
