"""Worlds of Stage: macros, includes, poses, blocks and bitmaps, as the manual describes them."""

from pathlib import Path

import pytest
import shapely
from PIL import Image
from raster_files import build_pgm, draw_pixels
from shapely import affinity, box

from robocov.environment import PointsStart
from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions, detect_format, import_map

IMPORTER = IMPORTERS["stage"]


def read(folder: Path, text: str, **options: object) -> ForeignMap:
    path = folder / "hall.world"
    path.write_text(text)
    assert detect_format(path) is IMPORTER
    return IMPORTER.read(path, ReadOptions(**options))  # type: ignore[arg-type]


ROOM = """
define room model ( size [20 10 1] boundary 1
                    block ( points 3 point[0] [0 0] point[1] [0 5] point[2] [9 5] ) )
"""
"""A model whose triangle fills its box, which is the boundary."""


def test_a_bitmap_is_scaled_to_the_size_of_its_model(tmp_path: Path) -> None:
    # The white margin is not part of the model, and its cells are not square.
    (tmp_path / "maps").mkdir()
    rooms = ".........\n.#######.\n.#..#..#.\n.#.....#.\n.#######.\n........."
    (tmp_path / "maps" / "rooms.pgm").write_bytes(build_pgm(draw_pixels(rooms)))
    foreign = read(
        tmp_path,
        "define floorplan model ( boundary 1 obstacle_return 0 ranger_return 0.5 )\n"
        'floorplan ( name "rooms" size [14.000 8.000 0.8] pose [1 2 0 0] bitmap "maps/rooms.pgm" )',
    )
    # With cells of 2 x 2 m, the box is 14 x 8 m around [1, 2].
    expected = (box(-4, 0, 6, 4)) - box(0, 2, 2, 4)
    assert shapely.equals(foreign.free, expected)
    assert (foreign.cell, foreign.vertices_read, foreign.name) == (2.0, 8, "hall")
    turned = read(
        tmp_path, 'model ( size [14 16] pose [1 2 0 90] obstacle_return 0 bitmap "maps/rooms.pgm" )'
    )
    expected = affinity.rotate(affinity.scale(expected, 1, 2, origin=(1, 2)), 90, origin=(1, 2))
    assert shapely.equals(shapely.set_precision(expected, 1e-9), turned.free)
    assert turned.cell == 4.0


def test_macros_are_inherited_and_overridden(tmp_path: Path) -> None:
    foreign = read(
        tmp_path,
        ROOM
        + """
        define thing model ( size [2 1 1] color "red" )
        define long_thing thing ( size [4 1 1] model ( size [0.5 0.5] pose [0 3 0 0] ) )
        room ( )
        thing ( pose [-2 3 0 0] )
        long_thing ( pose [4 -3 0 90] )
        """,
    )
    solid = box(-10, -5, 10, 5) - foreign.free
    triangle = shapely.Polygon([(-10, -5), (-10, 5), (10, 5)])
    # Children of a model are positioned in its frame.
    inside = [triangle, box(-3, 2.5, -1, 3.5), box(3.5, -5, 4.5, -1), box(0.75, -3.25, 1.25, -2.75)]
    assert shapely.equals(shapely.normalize(solid), shapely.normalize(shapely.union_all(inside)))
    assert foreign.boundary is not None and foreign.boundary.equals(box(-10, -5, 10, 5))


def test_blocks_fill_the_size_of_their_model_and_turn_about_its_origin(tmp_path: Path) -> None:
    text = """
        define table model
        (
          size [3 2 1]
          origin [1 0 0 0]
          block ( points 4 point[0] [0 0] point[1] [6 0] point[2] [6 1] point[3] [0 1] z [0 1] )
          block ( points 3 point[0] [0 1] point[1] [1 1] point[2] [0 2] )
        )
        table ( pose [5 1 0 90] )
    """
    foreign = read(tmp_path, text, around=0.5)
    # The blocks, which are 6 x 2, fill the size of 3 x 2 m.
    blocks = shapely.union_all([box(0, 0, 3, 1), shapely.Polygon([(0, 1), (0.5, 1), (0, 2)])])
    # The middle of the size is at (1.5, 1), and the origin of the model is at [1, 0] from there.
    about_origin = affinity.translate(blocks, 1 - 1.5, -1)
    turned = affinity.rotate(about_origin, 90, origin=(0, 0))
    table = affinity.translate(turned, 5, 1)
    low_x, low_y, high_x, high_y = table.bounds
    # The free space reaches 0.5 m around the table (option `around`).
    hull = box(low_x - 0.5, low_y - 0.5, high_x + 0.5, high_y + 0.5)
    solid = hull - foreign.free
    assert solid.symmetric_difference(table).area == pytest.approx(0, abs=1e-9)


def test_units_and_older_syntax_are_accepted(tmp_path: Path) -> None:
    foreign = read(
        tmp_path,
        ROOM.replace("20 10 1", "2000 1000")
        + """
        unit_length "cm"  unit_angle "radians"
        room ( )
        model ( size [200 100] pose [400 0 1.5707963267948966]
                block[0].points 3 block[0].point[0] [0 0] block[0].point[1] [1 0] block[0].point[2] [0 1] )
        """,
    )
    triangle = shapely.Polygon([(3.5, -1), (4.5, -1), (4.5, 1)])
    assert shapely.area(foreign.free) == pytest.approx(100 - 1, abs=1e-9)
    assert not foreign.free.intersects(triangle.buffer(-1e-6))


def test_robots_are_starts_and_sensors_are_omitted(tmp_path: Path) -> None:
    text = (
        ROOM
        + """
        define pioneer position ( size [0.4 0.4] ranger ( size [0.1 0.1] ) )
        define zone model ( obstacle_return 0 ranger_return -1 )
        window ( size [600 400] )
        room ( )
        pioneer ( name "r0" pose [2 -2 0 45] )
        pioneer ( name "r1" pose [-9.5 4.5 0 0] )
        zone ( pose [5 -3 0 0] size [2 2 0.01] )
        laser ( pose [0 0 0 0] )
        """
    )
    foreign = read(tmp_path, text)
    assert foreign.robots == ((2.0, -2.0), (-9.5, 4.5))
    assert foreign.free.area == pytest.approx(100)
    assert foreign.dropped == ("1 laser", "1 model that nothing collides with")
    environment, report, _ = import_map(tmp_path / "hall.world")
    # One of the robots is inside the triangle.
    assert environment.starts["robots"] == PointsStart(((2.0, -2.0),))
    assert list(environment.starts)[-1] == "robots"
    assert (
        'start "robots": 1 of 2 positions of robots in the file; robots do not fit at the others'
        in report.notes
    )
    (tmp_path / "hall.world").write_text(text.replace('pioneer ( name "r0" pose [2 -2 0 45] )', ""))
    environment, report, _ = import_map(tmp_path / "hall.world")
    assert "robots" not in environment.starts
    assert 'no start "robots": no robot fits at the position of the robot in the file' in report.notes
    # Names are those of models and of their macros.
    assert read(tmp_path, text, skip=("pioneer",)).robots == ()
    # Long names are shortened in the report.
    assert len(read(tmp_path, ROOM + "room ( )" + "x" * 5000 + " ( )").dropped[0]) < 50


def test_only_files_in_the_folder_are_included(tmp_path: Path) -> None:
    folder = tmp_path / "worlds"
    folder.mkdir()
    (tmp_path / "far.inc").write_text(ROOM)
    (folder / "near.inc").write_text('include "more.inc"\n')
    (folder / "more.inc").write_text(ROOM)
    assert read(folder, 'include "near.inc"\nroom ( )').free.area == pytest.approx(100)
    far = 'window ( )\ninclude "../far.inc"\nroom ( )'
    with pytest.raises(
        MapError, match=r"hall.world:2: .../far.inc. is outside the folder of the file, expected the"
    ):
        read(folder, far)
    assert read(folder, far, anywhere=True).free.area == pytest.approx(100)
    # An absolute path is replaced if the world was moved together with its includes.
    moved = read(folder, f'include "{tmp_path}/elsewhere/near.inc"\nroom ( )')
    assert "near.inc' next to the file" in moved.notes[0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("model (\n", ":1: expected a \\) to close this bracket, got the end of the file"),
        ("model ( )\n)", ":2: expected the name of a model"),
        ("model (\n] )", ":2: expected the name of a model or a property, or \\), got ']'"),
        ("model ( pose [1 2 0 0 )", ":1: expected a \\] after the values of 'pose', got '\\)'"),
        ("model ( pose [1 2 0 0", ":1: expected a \\] after the values of 'pose', got the end of the file"),
        ("model ( pose [1 x 0 0] )", ":1: expected a value of 'pose', got 'x'"),
        ("model size [1 1 1]", ":1: expected a value or \\( after 'model', got 'size'"),
        ("model", ":1: expected a value or \\( after 'model', got the end of the file"),
        ('model ( size ["a" 1] )', ":1: expected numbers from -1e7 to 1e7"),
        ("model ( size [0 1] )", ":1: size: expected a number from"),
        ("model ( ) ~", ":1: expected a word, a number or a bracket"),
        ("\ndefine a b ( )\ndefine b a ( )\na ( )", ":4: the model 'a' is defined in terms of itself"),
        ("model ( block ( points 4 point[0] [0 0] ) )", ":1: expected 4 points as stated"),
        ('\nmodel ( bitmap "no.png" )', r"no\.png: no such file"),
        ('include "hall.world"\nmodel ( )', "expected a file that does not include itself"),
        ("include model\nmodel ( )", "a file to include"),
        ("model ( )\ninclude", ":2: expected a file to include, got the end of the file"),
        ("window ( )", "expected at least one closed outline or line, got none"),
        ("model ( " * 40, "nested deeper than 32"),
        ("define a model ( a ( ) )\na ( )", ":1: nested in more than 32 models"),
        ("model ( pose [1e300 0 0 0] )", "expected numbers from -1e7"),
        (
            "define a model ( b ( ) b ( ) ) define b model ( c ( ) c ( ) )" + "a ( )" * 9000,
            "expected at most 10000 models and blocks, got more",
        ),
    ],
    ids=range(22),
)
def test_mistakes_are_reported_with_the_line(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "hall.world"
    path.write_text(text)
    with pytest.raises(
        MapError, match=f"hall.world.*{expected}" if expected[0] == ":" else expected
    ) as caught:
        IMPORTER.read(path, ReadOptions())
    assert "\n" not in str(caught.value)


def test_a_bitmap_without_walls_is_rejected_and_one_that_is_all_wall_is_solid(tmp_path: Path) -> None:
    (tmp_path / "a.pgm").write_bytes(build_pgm(draw_pixels("...\n...")))
    with pytest.raises(MapError, match=r"a\.pgm: expected an image with dark walls, got only light pixels"):
        read(tmp_path, 'model ( bitmap "a.pgm" )')
    (tmp_path / "a.pgm").write_bytes(build_pgm(draw_pixels("###\n###")))
    foreign = read(tmp_path, ROOM + 'room ( ) model ( bitmap "a.pgm" size [2 1] pose [5 -3 0 0] )')
    assert foreign.free.area == pytest.approx(100 - 2)


# Files that include each other


def test_exponentially_nested_includes_are_rejected(tmp_path: Path) -> None:
    names = [f"part{k}.inc" for k in range(10)]
    body = "".join(f'include "{name}"\n' for name in names)
    for name in names:
        (tmp_path / name).write_text(body)
    with pytest.raises(MapError, match="that does not include itself"):
        read(tmp_path, body + "model ( )")


def test_included_files_are_limited_together(tmp_path: Path) -> None:
    for k in range(9):
        (tmp_path / f"part{k}.inc").write_text(f'include "part{k + 1}.inc"\n' * 10)
    (tmp_path / "part9.inc").write_text("# nothing\n")
    with pytest.raises(MapError, match="included files: expected at most 200"):
        read(tmp_path, 'include "part0.inc"\nmodel ( )')
    (tmp_path / "long.inc").write_text("#" * 500_000)
    with pytest.raises(MapError, match="included files: expected at most 5 MB in total, got more"):
        read(tmp_path, 'include "long.inc"\n' * 11 + "model ( )")
    # Including a file twice is not an error.
    assert read(tmp_path, 'include "long.inc"\n' * 2 + "model ( )").free.area > 0


def test_transparency_is_reported_as_the_cause(tmp_path: Path) -> None:
    Image.new("LA", (4, 4), (0, 0)).save(tmp_path / "dark.png")
    cause = "got only dark pixels: 100% of the pixels are transparent; their hidden color is used"
    with pytest.raises(MapError, match=cause):
        read(tmp_path, 'model ( size [4 4 1] bitmap "dark.png" )')
