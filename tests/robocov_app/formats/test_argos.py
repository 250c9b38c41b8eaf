"""Arenas of ARGoS: boxes, cylinders, and distributions of bodies."""

from pathlib import Path

import pytest
import shapely
from shapely import affinity, box

from robocov.environment import CircleObstacle
from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions, Shaping, detect_format, import_map

IMPORTER = IMPORTERS["argos"]

WALL = '<box id="{}" size="{},{},0.5" movable="false"><body position="{},{},0" orientation="{},0,0"/></box>'
ROBOT = '<foot-bot id="fb"><body position="{},{},0" orientation="0,0,0"/><controller config="c"/></foot-bot>'


def write_arena(folder: Path, body: str, size: str = '"6, 4, 1" center="1,0,0.5"') -> Path:
    path = folder / "test.argos"
    path.write_text(
        '<?xml version="1.0" ?>\n<argos-configuration><framework/>\n'
        f"<arena size={size}>\n{body}\n</arena><loop_functions/></argos-configuration>"
    )
    assert detect_format(path) is IMPORTER
    return path


def read(folder: Path, body: str, **options: object) -> ForeignMap:
    return IMPORTER.read(write_arena(folder, body), ReadOptions(**options))  # type: ignore[arg-type]


ARENA = box(-2, -2, 4, 2)


def test_bodies_have_the_positions_of_the_file(tmp_path: Path) -> None:
    body = (
        WALL.format("long", 2, 0.5, 1, 1, 0)
        + WALL.format("turned", 1, 0.5, 2, -1, 30)
        + '<cylinder id="c" radius="0.3" height="1" movable="true"><body position="-1,-1,0"/></cylinder>'
        + ROBOT.format(0.5, -0.5)
        + '<light id="l" position="0,0,1"/>'
    )
    foreign = read(tmp_path, body)
    # Rotations are counter-clockwise, with y up.
    turned = affinity.rotate(box(1.5, -1.25, 2.5, -0.75), 30, origin="center")
    solid = [box(0, 0.75, 2, 1.25), turned, CircleObstacle((-1.0, -1.0), 0.3).polygon]
    assert foreign.free.symmetric_difference(ARENA - shapely.union_all(solid)).area < 1e-5
    assert foreign.boundary is not None and foreign.boundary.equals(ARENA)
    assert foreign.robots == ((0.5, -0.5),)
    assert read(tmp_path, body, skip=("c", "turned")).free.area == pytest.approx(24 - 1)


def test_tilted_bodies_are_left_out(tmp_path: Path) -> None:
    tilted = WALL.format("a", 1, 1, 0, 0, "0,45").replace("0,45,0,0", "0,45,0")
    over = WALL.format("b", 1, 1, 0, 0, "0,180").replace("0,180,0,0", "0,180,0")
    foreign = read(tmp_path, tilted + over)
    assert foreign.free.area == pytest.approx(24 - 1)
    assert foreign.dropped == ("1 box with a tilt",)


GRID = '<position method="grid" center="1,0,0" distances="2,1,0" layout="2,2,1"/>'
CHANCE = '<position method="uniform" min="-1,-1,0" max="1,1,0"/>'
POST = '<box id="post" size="0.5,0.5,1" movable="false"/>'


ALIKE = '<orientation method="constant" values="0,0,0"/>'
TURNED = '<orientation method="uniform" min="0,0,0" max="360,0,0"/>'
TILTED = '<orientation method="gaussian" mean="0,0,0" std_dev="0,20,0"/>'


def distribute(position: str, quantity: int, entity: str, orientation: str = ALIKE) -> str:
    return (
        f"<distribute>{position}{orientation}"
        f'<entity quantity="{quantity}" max_trials="100">{entity}</entity></distribute>'
    )


def test_grids_are_read_and_random_distributions_counted(tmp_path: Path) -> None:
    body = (
        distribute(GRID, 3, POST) + distribute(CHANCE, 30, POST) + distribute(CHANCE, 7, '<e-puck id="e"/>')
    )
    foreign = read(tmp_path, body)
    # ARGoS counts from the far corner, along x first.
    posts = [box(x - 0.25, y - 0.25, x + 0.25, y + 0.25) for x, y in ((2, 0.5), (0, 0.5), (2, -0.5))]
    assert foreign.free.equals(ARENA - shapely.union_all(posts))
    assert foreign.dropped == (
        "30 boxes that ARGoS places at random",
        "7 e-pucks that ARGoS places at random",
    )
    robots = read(tmp_path, distribute('<position method="constant" values="1,1,0"/>', 1, '<e-puck id="e"/>'))
    assert robots.robots == ((1.0, 1.0),)


@pytest.mark.parametrize("orientation", [TURNED, TILTED, '<orientation method="unknown"/>'])
def test_robots_in_grids_need_no_orientation(tmp_path: Path, orientation: str) -> None:
    foreign = read(tmp_path, distribute(GRID, 3, '<e-puck id="e"/>', orientation))
    assert foreign.robots == ((2.0, 0.5), (0.0, 0.5), (2.0, -0.5))
    assert foreign.dropped == ()


def test_obstacles_in_grids_need_a_known_outline(tmp_path: Path) -> None:
    pillar = '<cylinder id="pillar" radius="0.3" height="1" movable="false"/>'
    foreign = read(tmp_path, distribute(GRID, 1, pillar, TURNED))
    assert foreign.free.symmetric_difference(ARENA - CircleObstacle((2.0, 0.5), 0.3).polygon).area < 1e-5
    body = distribute(GRID, 4, pillar, TILTED) + distribute(GRID, 2, POST, TURNED)
    foreign = read(tmp_path, body)
    assert foreign.free.equals(ARENA)
    assert foreign.dropped == (
        "2 boxes that ARGoS turns at random",
        "4 cylinders that ARGoS turns at random",
    )


def test_randomly_placed_entities_can_be_skipped(tmp_path: Path) -> None:
    body = distribute(CHANCE, 30, POST) + distribute(CHANCE, 7, '<e-puck id="e"/>')
    foreign = read(tmp_path, body, skip=("post",))
    assert foreign.dropped == (
        "7 e-pucks that ARGoS places at random",
        "30 shapes by their names (--only, --skip)",
    )


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (POST, None),  # without a body it is nowhere
        (WALL.format("a", 0, 1, 0, 0, 0), "test.argos:4: <box> 'a': expected lengths above 0"),
        (WALL.format("a", "x", 1, 0, 0, 0), "size: expected 3 numbers from -1e7 to 1e7, got 'x,1,0.5'"),
        (WALL.format("a", 1, 1, "0,0", 0, 0), "position: expected 3 numbers from -1e7 to 1e7, got '0,0,0,0'"),
        (
            '<cylinder id="c" height="1"><body/></cylinder>',
            "radius: missing, expected a number from -1e7 to 1e7",
        ),
        (WALL.format("a", 1, 1, "nan", 0, 0), "position: expected 3 numbers"),
        (WALL.format("a", 1, 1, "1e8", 0, 0), "position: expected 3 numbers from -1e7 to 1e7"),
        (distribute(GRID, 5, POST), "<position>: expected one for 5, got layout [2, 2, 1]"),
        (distribute(GRID, 10**6, POST), "expected a number from 0 to 4000"),
        (
            distribute("", 5, POST),
            "<distribute>: expected <position>, <orientation> and <entity> with something in it",
        ),
        ("<box>", "not XML: mismatched tag"),
    ],
)
def test_mistakes_are_reported_with_the_line(tmp_path: Path, body: str, expected: str | None) -> None:
    if expected is None:
        assert read(tmp_path, body).free.equals(ARENA)
        return
    with pytest.raises(MapError) as caught:
        read(tmp_path, body)
    assert expected in str(caught.value) and "\n" not in str(caught.value)


def test_a_file_without_an_arena_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "test.argos"
    path.write_text("<argos-configuration/>")
    with pytest.raises(MapError, match="no <arena>"):
        IMPORTER.read(path, ReadOptions())
    with pytest.raises(MapError, match="expected lengths above 0"):
        IMPORTER.read(write_arena(tmp_path, "", '"0,4,1"'), ReadOptions())


def test_an_arena_that_is_too_large_is_rejected(tmp_path: Path) -> None:
    expected = "expected lengths above 0 and up to 10000 m, got size '100000,5,1'"
    with pytest.raises(MapError, match=expected):
        IMPORTER.read(write_arena(tmp_path, "", '"100000,5,1"'), ReadOptions())


def test_the_map_has_obstacles_and_a_start(tmp_path: Path) -> None:
    environment, report, _ = import_map(
        write_arena(tmp_path, WALL.format("a", 1, 1, 2, 0, 0) + ROBOT.format(0, 0))
    )
    assert environment.free_area == pytest.approx(23)
    assert len(environment.obstacles) == 1
    assert (environment.starts["robots"].positions, report.size) == (((0.0, 0.0),), (6.0, 4.0))  # type: ignore[union-attr]


def test_the_room_with_the_robots_is_kept(tmp_path: Path) -> None:
    # As in most experiments, the walls are inside the arena, with more free space outside than inside.
    walls = [WALL.format(k, 2.1, 0.1, 0, y, 0) for k, y in enumerate((-1, 1))]
    walls += [WALL.format(k, 0.1, 2.1, x, 0, 0) for k, x in enumerate((-1, 1))]
    path = write_arena(tmp_path, "".join(walls) + ROBOT.format(0.25, 0.5), '"3,3,1"')
    environment, report, _ = import_map(path)
    assert shapely.Polygon(environment.boundary).equals(box(-0.95, -0.95, 0.95, 0.95))
    assert environment.obstacles == ()
    assert "kept the part of the free space with the most robots, which is not the largest" in report.notes
    environment, _, _ = import_map(path, shaping=Shaping(keep="all"))
    assert environment.free_area == pytest.approx(1.9**2 + 9 - 2.1**2, abs=0.02)
