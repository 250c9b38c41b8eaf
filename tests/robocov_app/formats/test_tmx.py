"""Maps of Tiled: which tiles and objects are solid, how they are packed, turned and scaled."""

import base64
import gzip
import math
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely import affinity, box

from robocov.environment import CircleObstacle
from robocov.errors import MapError, ParameterError
from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions, detect_format, import_map

IMPORTER = IMPORTERS["tmx"]

SOLID = '<properties><property name="{}" type="bool" value="{}"/></properties>'
TILES = (
    '<tileset firstgid="1" name="t" tilewidth="16" tileheight="16" tilecount="4" columns="2">'
    f'<tile id="1">{SOLID.format("collides", "true")}</tile>'
    f'<tile id="2">{SOLID.format("solid", "false")}</tile>'
    "{}</tileset>"
)
"""Of four tiles the second is solid."""

ROWS = "1,1,2,2,\n1,2,2,1,\n2,1,1,1"
WALLS = box(2, 2, 4, 3) | box(1, 1, 3, 2) | box(0, 0, 1, 1)
"""The tiles 2 in `ROWS`, y up, in tiles."""


def build_tiles(name: str, rows: str = ROWS, more: str = "", size: tuple[int, int] = (4, 3)) -> str:
    """Return a layer of tiles."""
    sized = f'width="{size[0]}" height="{size[1]}"'
    return f'<layer name="{name}" {sized} {more}><data encoding="csv">\n{rows}\n</data></layer>'


def build_objects(name: str, *given: str, more: str = "") -> str:
    return f'<objectgroup name="{name}" {more}>{"".join(given)}</objectgroup>'


def read(
    folder: Path, *parts: str, head: str = "", tile: str = 'tilewidth="16" tileheight="16"', **options: object
) -> ForeignMap:
    path = folder / "map.tmx"
    path.write_text(
        f'<?xml version="1.0"?>\n<map width="4" height="3" {tile} {head}>\n{"".join(parts)}</map>'
    )
    assert detect_format(path) is IMPORTER
    return IMPORTER.read(path, ReadOptions(**options))  # type: ignore[arg-type]


def compute_solid_area(foreign: ForeignMap, size: tuple[float, float] = (4, 3)) -> shapely.Geometry:
    """Return the area of a map that is not free; `size` in m."""
    return box(0, 0, *size) - foreign.free


def are_equal(one: shapely.Geometry, other: shapely.Geometry) -> bool:
    """Return whether two areas differ only by necks between cells that touch at a corner."""
    return bool(one.symmetric_difference(other).area < 0.01)


def test_tiles_declared_solid_are_solid(tmp_path: Path) -> None:
    foreign = read(tmp_path, TILES.format(""), build_tiles("Ground"))
    assert are_equal(compute_solid_area(foreign), WALLS)
    assert (foreign.cell, foreign.name) == (1.0, "map")
    assert foreign.notes == ("no tile size given; assuming tiles 1 m wide. Set it with --cell.",)


def test_layers_are_solid_by_name_property_or_option(tmp_path: Path) -> None:
    plain = '<tileset firstgid="1" tilewidth="16" tileheight="16"/>'
    floor = build_tiles("Floor", "1,1,1,1,1,1,1,1,1,1,1,1")
    upper = ROWS.replace("1", "0")
    for name in ("Walls", "collision", "Collision Layer 2", "is_solid"):
        assert are_equal(compute_solid_area(read(tmp_path, plain, floor, build_tiles(name, upper))), WALLS)
    marked = build_tiles("Things", upper).replace("<data", SOLID.format("collides", "") + "<data")
    assert are_equal(compute_solid_area(read(tmp_path, plain, floor, marked)), WALLS)
    grouped = f'<group name="obstacles">{build_tiles("Things", upper)}</group>'
    assert are_equal(compute_solid_area(read(tmp_path, plain, floor, grouped)), WALLS)
    things = build_tiles("Things", upper)
    with pytest.raises(MapError, match=r"nothing is solid .* --only LAYER.* 'Floor', 'Things'"):
        read(tmp_path, plain, floor, things)
    assert are_equal(compute_solid_area(read(tmp_path, plain, floor, things, only=("things",))), WALLS)
    with pytest.raises(ParameterError, match=r"only: unknown name 'thing': did you mean 'Things'\?"):
        read(tmp_path, plain, floor, things, build_tiles("Walls"), only=("thing",))
    assert are_equal(
        compute_solid_area(
            read(tmp_path, plain, floor, build_tiles("Walls"), things, skip=("walls",), only=("things",))
        ),
        WALLS,
    )


PACKED: dict[str, Callable[[bytes], bytes]] = {"": bytes, "zlib": zlib.compress, "gzip": gzip.compress}


@pytest.mark.parametrize("packing", PACKED)
def test_tiles_may_be_packed(tmp_path: Path, packing: str) -> None:
    raw = struct.pack("<12I", *(int(gid) for gid in ROWS.split(",")))
    text = base64.b64encode(PACKED[packing](raw)).decode()
    layer = build_tiles("a", text).replace('"csv"', f'"base64" compression="{packing}"')
    assert are_equal(compute_solid_area(read(tmp_path, TILES.format(""), layer)), WALLS)


def test_tiles_may_be_elements(tmp_path: Path) -> None:
    inner = "".join(f'<tile gid="{int(gid)}"/>' if int(gid) > 1 else "<tile/>" for gid in ROWS.split(","))
    layer = f'<layer name="a" width="4" height="3"><data>{inner}</data></layer>'
    assert are_equal(compute_solid_area(read(tmp_path, TILES.format(""), layer)), WALLS)


def test_an_infinite_map_is_as_large_as_its_tiles(tmp_path: Path) -> None:
    chunks = (
        '<chunk x="-16" y="0" width="4" height="2">0,0,0,0,0,0,0,2</chunk>'
        '<chunk x="-12" y="-1" width="3" height="2">1,1,0,2,1,0</chunk>'
    )
    layer = f'<layer name="a" width="4" height="3"><data encoding="csv">{chunks}</data></layer>'
    foreign = read(tmp_path, TILES.format(""), layer, head='infinite="1"')
    # Columns -13 to -11, rows -1 to 1.
    assert are_equal(compute_solid_area(foreign, (3, 3)), box(0, 0, 1, 1) | box(1, 1, 2, 2))


def test_tiles_need_not_be_square(tmp_path: Path) -> None:
    tile = 'tilewidth="16" tileheight="8"'
    foreign = read(tmp_path, TILES.format(""), build_tiles("a"), tile=tile, cell=0.5)
    assert are_equal(compute_solid_area(foreign, (2, 0.75)), affinity.scale(WALLS, 0.5, 0.25, origin=(0, 0)))
    assert foreign.cell == 0.5
    foreign = read(tmp_path, TILES.format(""), build_tiles("a"), tile=tile, scale=0.25)
    assert are_equal(compute_solid_area(foreign, (16, 6)), affinity.scale(WALLS, 4, 2, origin=(0, 0)))
    with pytest.raises(ParameterError, match="both say how large a tile is"):
        read(tmp_path, TILES.format(""), build_tiles("a"), scale=0.25, cell=1.0)
    environment, _, _ = import_map(tmp_path / "map.tmx", options=ReadOptions(cell=2.0))
    assert environment.free_area <= 4 * 3 * 2 * 1


def test_tiles_have_the_shape_of_their_collision_objects(tmp_path: Path) -> None:
    # The lower left quarter of the tile is solid; the tile is placed with several flips.
    corner = '<tile id="3"><objectgroup><object x="0" y="8" width="8" height="8"/></objectgroup></tile>'
    flips = (0, 1 << 31, 1 << 30, 1 << 29)
    rows = ",".join(str(4 + flip) for flip in flips) + ",0" * 8
    foreign = read(tmp_path, TILES.format(corner), build_tiles("a", rows))
    quarters = [box(0, 2, 0.5, 2.5), box(1.5, 2, 2, 2.5), box(2, 2.5, 2.5, 3), box(3.5, 2.5, 4, 3)]
    assert compute_solid_area(foreign).symmetric_difference(shapely.union_all(quarters)).area < 1e-5
    # An object as large as the cell fills the cell.
    whole = corner.replace('y="8" width="8" height="8"', 'y="0" width="16" height="16"')
    assert compute_solid_area(read(tmp_path, TILES.format(whole), build_tiles("a", "4" + ",0" * 11))).equals(
        box(0, 2, 1, 3)
    )
    tall = (
        '<tileset firstgid="9" name="b" tilewidth="16" tileheight="32"><tileoffset x="4" y="0"/>'
        '<tile id="0"><objectgroup><object x="0" y="8" width="8" height="24"/></objectgroup></tile></tileset>'
    )
    foreign = read(tmp_path, tall, build_tiles("a", "0,0,0,0,0,9,0,0,0,0,0,0"))
    assert compute_solid_area(foreign).equals(box(1.25, 1, 1.75, 2.5))


def test_objects_of_every_shape_are_read(tmp_path: Path) -> None:
    given = (
        '<object x="8" y="8" width="16" height="8"/>',
        '<object x="32" y="8" width="16" height="8" rotation="90"/>',
        '<object x="40" y="32" width="8" height="8"><ellipse/></object>',
        '<object x="4" y="40"><polygon points="0,0 12,0 12,-8"/></object>',
        '<object x="56" y="4"><polyline points="0,0 0,16"/></object>',
        '<object gid="2" x="48" y="48" width="16" height="4"/>',
        '<object x="2" y="2" width="9" height="9"><text>no</text></object>',
        '<object name="robot" x="8" y="24"><point/></object>',
    )
    foreign = read(tmp_path, build_objects("things", *given), scale=1.0, thickness=2.0)
    expected = [
        box(8, 32, 24, 40),
        box(24, 24, 32, 40),  # clockwise about its upper left corner
        CircleObstacle((44.0, 12.0), 4.0).polygon,
        shapely.Polygon([(4, 8), (16, 8), (16, 16)]),
        box(55, 28, 57, 44),
        box(48, 0, 64, 4),  # of tiles the lower left corner is given
    ]
    assert compute_solid_area(foreign, (64, 48)).symmetric_difference(shapely.union_all(expected)).area < 1e-3
    assert foreign.robots == ((8.0, 24.0),)
    assert foreign.dropped == ("1 object with a text or template, or without an area",)
    assert foreign.cell is None


def test_obstacles_have_the_names_of_their_objects(tmp_path: Path) -> None:
    given = (
        '<object name="column" x="40" y="32" width="8" height="8"><ellipse/></object>',
        '<object name="fence" x="56" y="4"><polyline points="0,0 0,16"/></object>',
        '<object name="post" x="8" y="24"><point/></object>',
    )
    foreign = read(tmp_path, build_objects("things", *given), scale=1.0, thickness=2.0, pillar=1.0)
    assert [obstacle.name for obstacle in foreign.primitives] == ["column", "fence", "post"]


def test_objects_next_to_tiles_are_solid_only_if_declared(tmp_path: Path) -> None:
    square = '<object name="{}" x="0" y="0" width="16" height="16"/>'
    things = build_objects(
        "triggers", square.format("door"), square.format("wall").replace('x="0"', 'x="48"')
    )
    ground = build_tiles("Ground", ROWS.replace("2", "1"))
    foreign = read(tmp_path, ground, things)
    assert compute_solid_area(foreign).equals(box(3, 2, 4, 3))
    assert foreign.dropped == (
        "1 object without a name or property of a solid object (--only NAME selects by name)",
    )
    assert compute_solid_area(read(tmp_path, ground, things, only=("door",))).equals(box(0, 2, 1, 3))
    moved = build_objects("walls", square.format(""), more='offsetx="16" offsety="16"')
    assert compute_solid_area(read(tmp_path, ground, moved)).equals(box(1, 1, 2, 2))
    shifted = build_tiles("walls", "2" + ",0" * 11, 'offsetx="8" offsety="4"')
    assert compute_solid_area(read(tmp_path, ground, shifted)).equals(box(0.5, 1.75, 1.5, 2.75))


def test_tilesets_of_the_same_folder_are_read(tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    folder.mkdir()
    text = TILES.format("").replace('firstgid="1" ', "")
    (tmp_path / "far.tsx").write_text(text)
    (folder / "near.tsx").write_text(text)
    near = '<tileset firstgid="1" source="near.tsx"/>'
    far = '<tileset firstgid="1" source="../far.tsx"/>'
    assert are_equal(compute_solid_area(read(folder, near, build_tiles("a"))), WALLS)
    with pytest.raises(
        MapError, match=r"map.tmx:3: .../far.tsx. is outside the folder of the file, expected the"
    ):
        read(folder, far, build_tiles("a"))
    assert are_equal(compute_solid_area(read(folder, far, build_tiles("a"), anywhere=True)), WALLS)
    (folder / "near.tsx").write_text("<map/>")
    with pytest.raises(MapError, match=r"near\.tsx: expected <tileset>, got <map>"):
        read(folder, near, build_tiles("a"))


BOMB = base64.b64encode(zlib.compress(bytes(50_000_000), 9)).decode()


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        (build_tiles("walls", "1,2"), "map.tmx:3: <data>: expected 12 tiles as stated, got 2"),
        (build_tiles("walls", "1,x" + ",1" * 10), "expected whole numbers from 0, separated by commas"),
        (build_tiles("walls", "-1" + ",1" * 11), "expected whole numbers from 0, separated by commas"),
        (build_tiles("walls", ROWS, size=(3, 4)), "expected layers of 4 x 3 tiles"),
        (build_tiles("walls").replace("csv", "base64"), "not base64: Only base64 data is allowed"),
        (build_tiles("walls", BOMB).replace('"csv"', '"base64" compression="zlib"'), "expected 12"),
        (build_tiles("walls", "QUJD").replace('"csv"', '"base64" compression="gzip"'), "not gzip: Error -3"),
        (build_tiles("walls").replace('"csv"', '"base64" compression="zstd"'), "expected CSV, or base64"),
        (build_tiles("walls", "A").replace("csv", "base64"), "not base64"),
        (build_tiles("walls", size=(4, "9" * 9)), "expected at most 16000000 tiles in all, got more"),  # type: ignore[arg-type]
        (build_tiles("walls", more='offsetx="x"'), "offsetx: expected a number from -1e7 to 1e7"),
        (build_tiles("walls", size=(4, -3)), "expected a whole number from 1"),
        (build_objects("a", '<object x="nan" y="1"/>'), "x: expected a number from -1e7 to 1e7"),
        (build_objects("a", '<object><polygon points="1,2 3"/></object>'), "points: expected 3 points"),
        (build_objects("a", '<object><polyline points="1,2"/></object>'), "points: expected 2 points"),
        ('<tileset source="a.tsx"/>', "expected a whole number from 1"),
        ("", "expected --only LAYER with one of walls: there is none"),
        (build_tiles("walls", ROWS.replace("1", "2")), "no cell is free"),
    ],
    ids=range(18),
)
def test_mistakes_are_reported_with_the_line(tmp_path: Path, parts: str, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        read(tmp_path, parts)
    assert expected in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("orientation", ["isometric", "staggered", "hexagonal"])
def test_other_maps_are_rejected_by_their_names(tmp_path: Path, orientation: str) -> None:
    with pytest.raises(MapError, match=rf"map\.tmx:2: <map>: expected an orthogonal map, got {orientation}"):
        read(tmp_path, build_tiles("walls"), head=f'orientation="{orientation}"')


@pytest.mark.slow
def test_too_many_collision_objects_are_rejected(tmp_path: Path) -> None:
    corner = '<tile id="3"><objectgroup><object x="0" y="8" width="8" height="8"/></objectgroup></tile>'
    rows = ",".join(["4"] * 150 * 150)
    path = tmp_path / "map.tmx"
    path.write_text(
        f'<map width="150" height="150" tilewidth="16" tileheight="16">{TILES.format(corner)}'
        f"{build_tiles('a', rows, size=(150, 150))}</map>"
    )
    with pytest.raises(MapError, match="expected at most 10000 parts of tiles, got more"):
        IMPORTER.read(path, ReadOptions())


def test_a_large_map_is_read(tmp_path: Path) -> None:
    cells = np.ones((300, 400), int)
    cells[1:-1, 1:-1] = np.random.default_rng(1).random((298, 398)) < 0.1
    path = tmp_path / "map.tmx"
    rows = ",".join(map(str, cells.ravel().tolist()))
    path.write_text(
        '<map width="400" height="300" tilewidth="8" tileheight="8">'
        f"{build_tiles('walls', rows, size=(400, 300))}</map>"
    )
    foreign = IMPORTER.read(path, ReadOptions(cell=0.1))
    # The areas differ only by the necks.
    assert math.isclose(foreign.free.area, 0.01 * (cells == 0).sum(), rel_tol=1e-3)


def test_tilesets_are_limited_together(tmp_path: Path) -> None:
    sides = 'width="1" height="1" tilewidth="8" tileheight="8"'
    layer = f'<layer name="walls" {sides}><data encoding="csv">1</data></layer>'
    path = tmp_path / "plan.tmx"
    for tiles, count, expected in (
        (1, 201, "included files: expected at most 200"),
        (60_000, 2, "at most 100000 elements in all tilesets"),
    ):
        named = "".join(f'<tileset firstgid="{k + 1}" source="t.tsx"/>' for k in range(count))
        path.write_text(f"<map {sides}>{named}{layer}</map>")
        (tmp_path / "t.tsx").write_text('<tileset tilewidth="8">' + '<tile id="1"/>' * tiles + "</tileset>")
        with pytest.raises(MapError, match=expected):
            import_map(path)
