"""OpenStreetMap: buildings, relations of several ways, barriers, bounds, and what is refused."""

import math
from pathlib import Path
from typing import Any

import pyproj
import pytest
import shapely
from shapely import box

from robocov.environment import CircleObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ReadOptions, detect, import_map

PLANE = pyproj.Proj(proj="aeqd", lon_0=6.1, lat_0=50.7, ellps="WGS84")
HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6" generator="test">\n'


class Extract:
    """An extract about a place, given in metres east and north of it."""

    def __init__(self) -> None:
        self.nodes: list[str] = []
        self.ways: list[str] = []

    def node(self, x: float, y: float, **tags: str) -> int:
        longitude, latitude = PLANE(x, y, inverse=True)
        number = len(self.nodes) + 1
        self.nodes.append(
            f'<node id="{number}" lat="{latitude:.9f}" lon="{longitude:.9f}">{said(tags)}</node>'
        )
        return number

    def way(self, points: list[tuple[float, float]], closed: bool = True, **tags: str) -> int:
        nodes = [self.node(*point) for point in points]
        nodes += nodes[:1] if closed else []
        return self.way_of(nodes, **tags)

    def way_of(self, nodes: list[int], **tags: str) -> int:
        number = 100 + len(self.ways)
        refs = "".join(f'<nd ref="{k}"/>' for k in nodes)
        self.ways.append(f'<way id="{number}">{refs}{said(tags)}</way>')
        return number

    def relation(self, *members: tuple[int, str], **tags: str) -> None:
        ways = "".join(f'<member type="way" ref="{k}" role="{role}"/>' for k, role in members)
        self.ways.append(
            f'<relation id="{len(self.ways)}">{ways}{said({"type": "multipolygon"} | tags)}</relation>'
        )

    def text(self, half: tuple[float, float] | None = (40.0, 30.0)) -> str:
        bounds = ""
        if half is not None:
            (west, _), (east, _) = (PLANE(x, 0, inverse=True) for x in (-half[0], half[0]))
            (_, south), (_, north) = (PLANE(0, y, inverse=True) for y in (-half[1], half[1]))
            sides = {"minlat": south, "minlon": west, "maxlat": north, "maxlon": east}
            given = " ".join(f"{key}='{value:.9f}'" for key, value in sides.items())
            bounds = f"<bounds {given}/>\n"
        return HEAD + bounds + "\n".join([*self.nodes, *self.ways]) + "\n</osm>\n"


def said(tags: dict[str, str]) -> str:
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())


def square(x: float, y: float, side: float) -> list[tuple[float, float]]:
    return [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]


def solid(folder: Path, extract: Extract, **options: Any) -> Any:
    path = folder / "town.osm"
    path.write_text(extract.text())
    assert detect(path) is IMPORTERS["osm"]
    free = IMPORTERS["osm"].read(path, ReadOptions(**options)).free
    assert free.envelope.area == pytest.approx(80 * 60, rel=1e-5)
    return box(*free.bounds) - free


def test_buildings_stand_where_they_are_north_up(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(square(10, 5, 8), building="yes")
    extract.way(square(-30, -20, 5), building="church", name="St. Anna")
    found = solid(tmp_path, extract)
    wanted = shapely.union_all([box(10, 5, 18, 13), box(-30, -20, -25, -15)])
    assert found.symmetric_difference(wanted).area < 0.05
    assert solid(tmp_path, extract, skip=("church",)).area == pytest.approx(64, abs=0.05)


@pytest.mark.parametrize("roles", [("outer", "outer", "inner"), ("", "", "")])
def test_a_relation_is_made_up_of_ways(tmp_path: Path, roles: tuple[str, str, str]) -> None:
    extract = Extract()
    corners = [extract.node(*place) for place in square(0, 0, 20)]
    one = extract.way_of(corners[:3])
    other = extract.way_of([corners[0], corners[3], corners[2]])  # against its direction
    court = extract.way(square(5, 5, 10))
    extract.relation(*zip((one, other, court), roles, strict=True), building="school")
    found = solid(tmp_path, extract)
    assert found.symmetric_difference(box(0, 0, 20, 20) - box(5, 5, 15, 15)).area < 0.1


def test_barriers_are_walls_and_posts_are_points(tmp_path: Path) -> None:
    extract = Extract()
    extract.way([(0, 0), (10, 0)], closed=False, barrier="wall", width="0.5 m")
    extract.way([(0, 10), (10, 10)], closed=False, barrier="hedge")
    extract.way([(0, 15), (10, 15)], closed=False, barrier="kerb")
    extract.way(square(20, 10, 4), barrier="hedge", area="yes")
    extract.node(-10, 0, barrier="bollard")
    extract.node(0, 5, barrier="gate")
    path = tmp_path / "town.osm"
    path.write_text(extract.text())
    environment, report, _ = import_map(path, options=ReadOptions(pillar=0.2))
    walls = {one.name: one for one in environment.obstacles if isinstance(one, WallObstacle)}
    assert {name: wall.width for name, wall in walls.items()} == {"wall": 0.5, "hedge": 0.1}
    assert any(isinstance(one, CircleObstacle) and one.radius == 0.2 for one in environment.obstacles)
    assert environment.free_area == pytest.approx(4800 - 5 - 1 - 16 - math.pi * 0.04, abs=0.1)
    assert "1 gate taken as closed" in report.notes


def test_water_and_what_is_no_obstacle(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(square(0, 0, 10), natural="water")
    extract.way(square(20, 0, 10), building="roof")
    extract.way(square(20, 0, 10), building="yes", layer="-1")
    extract.way(square(-20, 0, 10), highway="residential")
    extract.way_of([1, 2, 999, 1], building="yes")
    extract.way([(0, 20), (5, 20), (5, 25)], closed=False, building="yes")
    assert solid(tmp_path, extract).area == pytest.approx(100, abs=0.05)
    assert solid(tmp_path, extract, water="free").area < 0.05
    foreign = IMPORTERS["osm"].read(tmp_path / "town.osm", ReadOptions())
    assert foreign.dropped == (
        "1 thing below the ground",
        "1 way of which the file does not have all",
        "1 way that does not close",
    )


def test_without_bounds_a_rectangle_is_around(tmp_path: Path) -> None:
    extract = Extract()
    extract.way(square(-10, -10, 5), building="yes")
    extract.way(square(5, 5, 5), building="yes")
    path = tmp_path / "town.osm"
    path.write_text(extract.text(None))
    free = IMPORTERS["osm"].read(path, ReadOptions(around=2.0)).free
    assert free.area == pytest.approx(24 * 24 - 50, abs=0.1)


def crowd() -> str:
    """Return 3,000 relations of one way of 3,000 nodes."""
    extract = Extract()
    way = extract.way([(20 * math.cos(k / 500), 20 * math.sin(k / 500)) for k in range(3000)])
    for _ in range(3000):
        extract.relation((way, "outer"), building="yes")
    return extract.text()


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (HEAD, "town.osm:3: not XML: no element found"),
        (HEAD.replace("<osm", "<!DOCTYPE osm [<!ENTITY a 'b'>]><osm"), "osm:2: expected no document type"),
        ("<osmChange/>", "town.osm:1: expected <osm>, got <osmChange>"),
        (HEAD + "<node id='1' lat='x' lon='1'/></osm>", "3: <node>: could not convert string to float: 'x'"),
        (HEAD + "<node id='1' lat='91' lon='1'/></osm>", "3: <node>: lat: expected degrees, got '91'"),
        (HEAD + "<node id='1' lat='nan' lon='1'/></osm>", "3: <node>: lat: expected degrees, got 'nan'"),
        (HEAD + "<node id='1' lat='1'/></osm>", "3: <node>: no lon"),
        (HEAD + "<way id='1'><nd ref='a'/></way></osm>", "3: <nd>: invalid literal for int()"),
        (HEAD + "</osm>", "no closed outline and no line"),
        (HEAD + "<node id='1' lat='0' lon='0'/>" * 500_001, "some 500001 vertices"),
        (crowd(), "vertices, but at most 500000 were wanted"),
        (HEAD.replace("UTF-8", "UTF-99"), "not XML: unknown encoding"),
        (HEAD + "<bounds minlat='0' minlon='0' maxlat='9' maxlon='9'/></osm>", "at most 10 km was wanted"),
    ],
    ids=map(str, range(13)),
)  # fmt: skip
def test_what_is_refused(tmp_path: Path, text: str, wanted: str) -> None:
    path = tmp_path / "town.osm"
    path.write_text(text)
    with pytest.raises(MapError) as caught:
        IMPORTERS["osm"].read(path, ReadOptions())
    assert wanted in str(caught.value)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)
