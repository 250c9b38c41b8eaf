"""OpenStreetMap: buildings, relations of several ways, barriers, bounds, and rejected files."""

import json
import math
from pathlib import Path
from typing import Any

import pyproj
import pytest
import shapely
from shapely import box

from robocov.environment import CircleObstacle, WallObstacle
from robocov.errors import MapError, ParameterError
from robocov_app.formats import IMPORTERS, ReadOptions, detect_format, import_map

PLANE = pyproj.Proj(proj="aeqd", lon_0=6.1, lat_0=50.7, ellps="WGS84")
HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6" generator="test">\n'


class Extract:
    """An extract around a point, with positions in meters east and north of it."""

    def __init__(self) -> None:
        self.nodes: list[str] = []
        self.ways: list[str] = []

    def node(self, x: float, y: float, **tags: str) -> int:
        longitude, latitude = PLANE(x, y, inverse=True)
        number = len(self.nodes) + 1
        self.nodes.append(
            f'<node id="{number}" lat="{latitude:.9f}" lon="{longitude:.9f}">{format_tags(tags)}</node>'
        )
        return number

    def way(self, points: list[tuple[float, float]], closed: bool = True, **tags: str) -> int:
        nodes = [self.node(*point) for point in points]
        nodes += nodes[:1] if closed else []
        return self.way_through(nodes, **tags)

    def way_through(self, nodes: list[int], **tags: str) -> int:
        number = 100 + len(self.ways)
        refs = "".join(f'<nd ref="{k}"/>' for k in nodes)
        self.ways.append(f'<way id="{number}">{refs}{format_tags(tags)}</way>')
        return number

    def relation(self, *members: tuple[int, str], **tags: str) -> None:
        ways = "".join(f'<member type="way" ref="{k}" role="{role}"/>' for k, role in members)
        self.ways.append(
            f'<relation id="{len(self.ways)}">{ways}{format_tags({"type": "multipolygon"} | tags)}</relation>'
        )

    def text(self, half: tuple[float, float] | None = (40.0, 30.0)) -> str:
        bounds = ""
        if half is not None:
            west, _ = PLANE(-half[0], 0, inverse=True)
            east, _ = PLANE(half[0], 0, inverse=True)
            _, south = PLANE(0, -half[1], inverse=True)
            _, north = PLANE(0, half[1], inverse=True)
            sides = {"minlat": south, "minlon": west, "maxlat": north, "maxlon": east}
            given = " ".join(f"{key}='{value:.9f}'" for key, value in sides.items())
            bounds = f"<bounds {given}/>\n"
        return HEAD + bounds + "\n".join([*self.nodes, *self.ways]) + "\n</osm>\n"


def format_tags(tags: dict[str, str]) -> str:
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())


def list_corners(x: float, y: float, side: float) -> list[tuple[float, float]]:
    return [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]


def read_solid_area(folder: Path, extract: Extract, **options: Any) -> Any:
    """Return the area of the town that is not free."""
    path = folder / "town.osm"
    path.write_text(extract.text())
    assert detect_format(path) is IMPORTERS["osm"]
    free = IMPORTERS["osm"].read(path, ReadOptions(**options)).free
    assert free.envelope.area == pytest.approx(80 * 60, rel=1e-5)
    return box(*free.bounds) - free


def test_buildings_are_projected_with_north_up(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(list_corners(10, 5, 8), building="yes")
    extract.way(list_corners(-30, -20, 5), building="church", name="St. Anna")
    found = read_solid_area(tmp_path, extract)
    expected = shapely.union_all([box(10, 5, 18, 13), box(-30, -20, -25, -15)])
    assert found.symmetric_difference(expected).area < 0.05
    assert read_solid_area(tmp_path, extract, skip=("church",)).area == pytest.approx(64, abs=0.05)


@pytest.mark.parametrize("roles", [("outer", "outer", "inner"), ("", "", "")])
def test_a_relation_is_made_up_of_ways(tmp_path: Path, roles: tuple[str, str, str]) -> None:
    extract = Extract()
    corners = [extract.node(*place) for place in list_corners(0, 0, 20)]
    one = extract.way_through(corners[:3])
    other = extract.way_through([corners[0], corners[3], corners[2]])  # against its direction
    court = extract.way(list_corners(5, 5, 10))
    extract.relation(*zip((one, other, court), roles, strict=True), building="school")
    found = read_solid_area(tmp_path, extract)
    assert found.symmetric_difference(box(0, 0, 20, 20) - box(5, 5, 15, 15)).area < 0.1


def test_barriers_are_walls_and_posts_are_points(tmp_path: Path) -> None:
    extract = Extract()
    extract.way([(0, 0), (10, 0)], closed=False, barrier="wall", width="0.5 m")
    extract.way([(0, 10), (10, 10)], closed=False, barrier="hedge")
    extract.way([(0, 15), (10, 15)], closed=False, barrier="kerb")
    extract.way(list_corners(20, 10, 4), barrier="hedge", area="yes")
    extract.node(-10, 0, barrier="bollard")
    extract.node(0, 5, barrier="gate")
    path = tmp_path / "town.osm"
    path.write_text(extract.text())
    environment, report, _ = import_map(path, options=ReadOptions(pillar=0.2))
    walls = {one.name: one for one in environment.obstacles if isinstance(one, WallObstacle)}
    assert {name: wall.width for name, wall in walls.items()} == {"wall": 0.5, "hedge": 0.1}
    assert any(isinstance(one, CircleObstacle) and one.radius == 0.2 for one in environment.obstacles)
    assert environment.free_area == pytest.approx(4800 - 5 - 1 - 16 - math.pi * 0.04, abs=0.1)
    assert "1 gate treated as closed" in report.notes


def test_water_is_an_obstacle_and_other_areas_are_not(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(list_corners(0, 0, 10), natural="water")
    extract.way(list_corners(20, 0, 10), building="roof")
    extract.way(list_corners(20, 0, 10), building="yes", layer="-1")
    extract.way(list_corners(-20, 0, 10), highway="residential")
    extract.way_through([1, 2, 999, 1], building="yes")
    extract.way([(0, 20), (5, 20), (5, 25)], closed=False, building="yes")
    assert read_solid_area(tmp_path, extract).area == pytest.approx(100, abs=0.05)
    assert read_solid_area(tmp_path, extract, water="free").area < 0.05
    foreign = IMPORTERS["osm"].read(tmp_path / "town.osm", ReadOptions())
    assert foreign.dropped == (
        "1 element below the ground",
        "1 way with missing nodes",
        "1 way without a closed outline",
    )


def test_data_without_bounds_gets_a_rectangle(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(list_corners(-10, -10, 5), building="yes")
    extract.way(list_corners(5, 5, 5), building="yes")
    path = tmp_path / "town.osm"
    path.write_text(extract.text(None))
    free = IMPORTERS["osm"].read(path, ReadOptions(around=2.0)).free
    assert free.area == pytest.approx(24 * 24 - 50, abs=0.1)


def test_the_bounds_of_single_elements_are_not_those_of_the_extract(tmp_path: Path) -> None:
    """Overpass writes bounds into each way and relation for ``out bb`` and ``out geom``."""
    extract = Extract()
    extract.way(list_corners(35, 0, 10), building="yes")
    sides = "minlat='50.7' minlon='6.1' maxlat='50.71' maxlon='6.11'"
    extract.ways[0] = extract.ways[0].replace("<nd", f"<bounds {sides}/><nd", 1)
    assert read_solid_area(tmp_path, extract).area == pytest.approx(50, abs=0.05)


def test_ways_and_relations_may_contain_the_positions_of_their_nodes(tmp_path: Path) -> None:
    """Overpass writes them for ``out geom``: with ids in ways, without ids in relations."""

    def format_line(points: list[tuple[float, float]], ids: list[int | None]) -> str:
        nodes = ""
        for (x, y), node_id in zip(points, ids, strict=True):
            longitude, latitude = PLANE(x, y, inverse=True)
            ref = "" if node_id is None else f'ref="{node_id}" '
            nodes += f'<nd {ref}lat="{latitude:.9f}" lon="{longitude:.9f}"/>'
        return nodes

    extract = Extract()
    house = list_corners(-30, -20, 5)
    way = format_line(house, [1, 2, 3, 4])
    extract.ways.append(f'<way id="5">{way}<nd ref="1"/><tag k="building" v="yes"/></way>')
    members = ""
    for number, (corners, role) in enumerate(
        [(list_corners(0, 0, 20), "outer"), (list_corners(5, 5, 10), "inner")], start=6
    ):
        line = format_line([*corners, corners[0]], [None] * 5)
        members += f'<member type="way" ref="{number}" role="{role}">{line}</member>'
    tags = format_tags({"type": "multipolygon", "building": "yes"})
    extract.ways.append(f'<relation id="8">{members}{tags}</relation>')
    found = read_solid_area(tmp_path, extract)
    expected = shapely.union_all([box(-30, -20, -25, -15), box(0, 0, 20, 20) - box(5, 5, 15, 15)])
    assert found.symmetric_difference(expected).area < 0.1


def build_crowded_extract() -> str:
    """Return 3,000 relations of one way of 3,000 nodes."""
    extract = Extract()
    way = extract.way([(20 * math.cos(k / 500), 20 * math.sin(k / 500)) for k in range(3000)])
    for _ in range(3000):
        extract.relation((way, "outer"), building="yes")
    return extract.text()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (HEAD, "town.osm:3: not XML: no element found"),
        (
            HEAD.replace("<osm", "<!DOCTYPE osm [<!ENTITY a 'b'>]><osm"),
            "osm:2: document type declarations are not supported",
        ),
        ("<osmChange/>", "town.osm:1: expected <osm>, got <osmChange>"),
        (HEAD + "<node id='1' lat='x' lon='1'/></osm>", "3: <node>: could not convert string to float: 'x'"),
        (HEAD + "<node id='1' lat='91' lon='1'/></osm>", "3: <node>: lat: expected degrees, got '91'"),
        (HEAD + "<node id='1' lat='nan' lon='1'/></osm>", "3: <node>: lat: expected degrees, got 'nan'"),
        (HEAD + "<node id='1' lat='1'/></osm>", "3: <node>: no lon"),
        (HEAD + "<way id='1'><nd ref='a'/></way></osm>", "3: <nd>: invalid literal for int()"),
        (HEAD + "</osm>", "expected at least one closed outline or line, got none"),
        (HEAD + "<node id='1' lat='0' lon='0'/>" * 500_001, "500000 vertices, got about 500001"),
        (build_crowded_extract(), "expected at most 500000 vertices, got about 2001667"),
        (HEAD.replace("UTF-8", "UTF-99"), "not XML: unknown encoding"),
        (HEAD + "<bounds minlat='0' minlon='0' maxlat='9' maxlon='9'/></osm>", "expected at most 10 km"),
    ],
    ids=map(str, range(13)),
)  # fmt: skip
def test_invalid_data_is_rejected(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "town.osm"
    path.write_text(text)
    with pytest.raises(MapError) as caught:
        IMPORTERS["osm"].read(path, ReadOptions())
    assert expected in str(caught.value)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


# Degenerate ways


@pytest.mark.parametrize("tags", [{"building": "yes"}, {"barrier": "wall"}, {"natural": "water"}])
def test_a_way_of_one_repeated_node_is_omitted(tmp_path: Path, tags: dict[str, str]) -> None:
    extract = Extract()
    node = extract.node(0, 0)
    extract.way_through([node] * 4, **tags)
    path = tmp_path / "town.osm"
    path.write_text(extract.text(None))
    with pytest.raises(MapError, match="expected at least one closed outline or line, got none"):
        IMPORTERS["osm"].read(path, ReadOptions())


def test_a_degenerate_way_is_omitted(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(list_corners(0, 0, 5), building="yes")
    extract.way_through([1, 1, 1], building="yes")
    extract.way_through([1, 2, 1], building="yes")
    extract.relation((999, "outer"), building="yes")
    extract.ways.append('<way id="999">' + '<nd ref="1"/>' * 3 + "</way>")
    assert read_solid_area(tmp_path, extract).area == pytest.approx(25, abs=0.05)
    foreign = IMPORTERS["osm"].read(tmp_path / "town.osm", ReadOptions())
    expected = ("1 outline without an area", "1 relation without an area", "1 way without an area")
    assert foreign.dropped == expected


# JSON of Overpass


def build_overpass(*elements: dict[str, Any], **more: Any) -> str:
    return json.dumps({"version": 0.6, "generator": "Overpass API 0.7.62", "elements": elements, **more})


def build_nodes(points: list[tuple[float, float]], first: int = 1) -> list[dict[str, Any]]:
    found = []
    for k, (x, y) in enumerate(points):
        longitude, latitude = PLANE(x, y, inverse=True)
        found.append({"type": "node", "id": first + k, "lat": latitude, "lon": longitude})
    return found


def build_geometry(points: list[tuple[float, float]]) -> list[dict[str, float]]:
    return [{"lat": each["lat"], "lon": each["lon"]} for each in build_nodes(points)]


def compute_bounds(points: list[tuple[float, float]]) -> dict[str, float]:
    low, _, high, _ = build_geometry(points)
    return {"minlat": low["lat"], "minlon": low["lon"], "maxlat": high["lat"], "maxlon": high["lon"]}


ROOM = list_corners(-20, -20, 40)
DESK = list_corners(0, 0, 10)


@pytest.mark.parametrize("style", ["out", "out geom", "out ids geom"])
def test_overpass_json_agrees_with_xml(tmp_path: Path, style: str) -> None:
    ring = [*DESK, DESK[0]]
    way: dict[str, Any] = {"type": "way", "id": 10, "tags": {"building": "yes"}}
    post = {**build_nodes([(-10, -10)], 50)[0], "tags": {"barrier": "bollard"}}
    before: list[dict[str, Any]] = [post]
    if style == "out":
        before += build_nodes(DESK)
    if style != "out ids geom":
        way["nodes"] = [1, 2, 3, 4, 1]
    if style != "out":
        way["geometry"] = build_geometry(ring)
    path = tmp_path / "town.json"
    path.write_text(
        build_overpass(*before, way, bounds=compute_bounds(ROOM), remark="runtime error: Query timed out")
    )
    assert detect_format(path) is IMPORTERS["osm"]
    foreign = IMPORTERS["osm"].read(path, ReadOptions(pillar=0.5))
    assert foreign.free.area == pytest.approx(1600 - 100 - math.pi / 4, rel=1e-3)
    assert "Overpass says: runtime error: Query timed out" in foreign.notes


def test_overpass_relations_contain_their_ways(tmp_path: Path) -> None:
    members = [
        {"type": "way", "ref": 7, "role": "outer", "geometry": build_geometry([*ROOM, ROOM[0]])},
        {"type": "way", "ref": 8, "role": "inner", "geometry": build_geometry([*DESK, DESK[0]])},
        {"type": "node", "ref": 9, "role": "label"},
    ]
    tags = {"type": "multipolygon", "building": "yes"}
    path = tmp_path / "town.json"
    house = {"type": "relation", "id": 1, "members": members, "tags": tags}
    path.write_text(build_overpass(house, bounds=compute_bounds(list_corners(-30, -30, 60))))
    foreign = IMPORTERS["osm"].read(path, ReadOptions())
    assert foreign.free.area == pytest.approx(3600 - 1600 + 100, rel=1e-3)


@pytest.mark.parametrize(
    ("elements", "expected"),
    [
        ("{}", ": elements: expected a list of elements, got {}"),
        ("[3]", ": elements[0]: expected an element"),
        ('[{"type": "node", "id": "1"}]', "elements[0].id: expected a whole number"),
        ('[{"type": "node", "id": 1, "lat": 91, "lon": 0}]', "elements[0].lat: expected degrees"),
        ('[{"type": "node", "id": 1, "lat": true, "lon": 0}]', "elements[0].lat: expected degrees"),
        ('[{"type": "way", "id": 1, "nodes": 5}]', "elements[0].nodes: expected a list"),
        (
            '[{"type": "way", "id": 1, "geometry": [[0, 1]]}]',
            "elements[0].geometry[0]: expected lat and lon",
        ),
        ('[{"type": "way", "id": 1, "tags": []}]', "elements[0].tags: expected an object"),
        ('[{"type": "relation", "id": 1, "members": [1]}]', "elements[0].members[0]: expected a member"),
        ('[{"type": "area", "id": 1}]', "expected at least one closed outline or line, got none"),
    ],
)
def test_invalid_overpass_json_is_rejected(tmp_path: Path, elements: str, expected: str) -> None:
    path = tmp_path / "town.json"
    path.write_text('{"osm3s": {}, "elements": ' + elements + "}")
    with pytest.raises(MapError) as caught:
        import_map(path, format="osm")
    assert expected in str(caught.value)


# Indoors


def build_floor_plan(doors: bool = True) -> Extract:
    """Return a corridor with a room north of it, entered by a door, one south of it, and stairs."""
    extract = Extract()
    names = ("a", "b", "c", "d", "e", "f")
    corner = dict(
        zip(
            names,
            (extract.node(*at) for at in ((0, 0), (20, 0), (20, 4), (10, 4), (0, 4), (0, 10))),
            strict=True,
        )
    )
    door = extract.node(5, 4, door="yes", width="1.2", level="0") if doors else extract.node(5, 4)
    north = extract.node(10, 10)
    south = [extract.node(0, -6), extract.node(20, -6)]
    corridor = [corner[name] for name in ("a", "b", "c", "d")] + [door, corner["e"], corner["a"]]
    extract.way_through(corridor, indoor="corridor", level="0")
    extract.way_through(
        [corner["e"], door, corner["d"], north, corner["f"], corner["e"]], indoor="room", level="0"
    )
    extract.way_through(
        [corner["a"], *south, corner["b"], corner["a"]], indoor="room", level="0;1", name="store"
    )
    extract.way([(16, 1), (18, 1), (18, 3), (16, 3)], indoor="area", room="stairs", level="0")
    extract.way([(0, 0), (20, 0), (20, 4), (0, 4)], indoor="corridor", level="2")
    extract.way([(0, -6), (20, -6), (20, 10), (0, 10)], building="yes")
    return extract


def read_indoors(folder: Path, extract: Extract, **options: Any) -> Any:
    path = folder / "house.osm"
    path.write_text(extract.text(None))
    return IMPORTERS["osm"].read(path, ReadOptions(**options))


def move_to_plan(free: Any) -> Any:
    """Return free space of the whole ground floor as `floor_plan` has it."""
    return shapely.transform(free, lambda points: points + [10, 2])


def test_rooms_of_a_level_are_free_and_joined_by_doors(tmp_path: Path) -> None:
    foreign = read_indoors(tmp_path, build_floor_plan(), thickness=0.1)
    free = move_to_plan(foreign.free)
    corridor = next(part for part in free.geoms if part.contains(shapely.Point(5, 2)))
    assert corridor.contains(shapely.Point(5, 8)), "the north room has a door"
    assert not corridor.contains(shapely.Point(5, -3)), "the south room has none"
    assert not free.contains(shapely.Point(17, 2)), "stairs are solid"
    # The door has the width of its tag.
    assert corridor.contains(box(4.42, 3.9, 5.58, 4.1))
    assert not free.intersects(box(1, 3.98, 4.38, 4.02)) and not free.intersects(box(5.62, 3.98, 9, 4.02))
    assert "level 0 of 0, 1, 2 (--level)" in foreign.notes
    assert "stairs and elevators treated as solid: 1" in foreign.notes


def test_rooms_without_doors_are_open_to_adjacent_spaces(tmp_path: Path) -> None:
    foreign = read_indoors(tmp_path, build_floor_plan(doors=False))
    assert len(foreign.free.geoms) == 1
    assert foreign.free.area == pytest.approx(20 * 10 + 10 * 6 - 4, rel=1e-3)


def test_a_level_is_chosen(tmp_path: Path) -> None:
    assert read_indoors(tmp_path, build_floor_plan(), level="1").free.area == pytest.approx(120, rel=1e-3)
    assert read_indoors(tmp_path, build_floor_plan(), level="2").free.area == pytest.approx(80, rel=1e-3)
    for asked in ("3", "x", "nan"):
        with pytest.raises(ParameterError, match=f"level: expected one of 0, 1, 2, got '{asked}'"):
            read_indoors(tmp_path, build_floor_plan(), level=asked)
    town = Extract()
    town.way(list_corners(0, 0, 9), building="yes")
    with pytest.raises(ParameterError, match="level: expected no level, got '0'"):
        read_indoors(tmp_path, town, level="0")


def test_a_town_with_one_house_from_inside_is_read_outdoors(tmp_path: Path) -> None:
    extract = build_floor_plan()
    extract.way(list_corners(30, 0, 25), building="yes")
    extract.way(list_corners(30, 30, 25), building="yes")
    foreign = read_indoors(tmp_path, extract)
    assert "indoor spaces on level 0, 1, 2 left out (--level reads a floor)" in foreign.notes
    assert read_indoors(tmp_path, extract, level="2").free.area == pytest.approx(80, rel=1e-3)


def test_spellings_of_walls_columns_and_levels_are_accepted(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(list_corners(0, 0, 10), indoor="area", level="-1-1")
    extract.way([(5, 0), (5, 6)], closed=False, indoor="wall", level="1", width="0.5")
    extract.way(list_corners(8, 8, 1), indoor="column", repeat_on="0,1")
    extract.node(2, 2, indoor="column", level="1")
    extract.way(list_corners(0, 0, 10), indoor="corridor", level="7--3")
    found = {
        level: read_indoors(tmp_path, extract, level=level, pillar=0.1).free.area
        for level in ("-1", "0", "1")
    }
    assert found["-1"] == pytest.approx(100, rel=1e-3)
    assert found["0"] == pytest.approx(99, rel=1e-3)
    assert found["1"] == pytest.approx(100 - 1 - 6 * 0.1 - math.pi / 100, rel=1e-3)
