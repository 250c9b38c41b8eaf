"""Small files of every format to start from, all written here, and the words that make them up."""

from __future__ import annotations

import base64
import io
import json
import struct
import zipfile
import zlib
from dataclasses import dataclass, field
from typing import Any

MAP: dict[str, Any] = {
    "$schema": "./map.schema.json",
    "format": "robocov-map",
    "version": 1,
    "name": "hall",
    "description": "One of everything.",
    "boundary": [[0, 0], [10, 0], [10, 6], [5, 6.5], [0, 6]],
    "obstacles": [
        {
            "kind": "polygon",
            "name": "desk",
            "vertices": [[2, 2], [4, 2], [4, 4], [2, 4]],
            "holes": [[[2.5, 2.5], [3.5, 2.5], [3.5, 3.5]]],
        },
        {"kind": "circle", "center": [7, 2], "radius": 0.5},
        {"kind": "wall", "points": [[5, 0], [5, 2.4], [6, 3]], "width": 0.1},
    ],
    "starts": {
        "west": {"kind": "disc", "center": [1, 1], "radius": 0.8},
        "all": {"kind": "uniform"},
        "given": {"kind": "points", "positions": [[1, 1], [1.5, 1.25]]},
    },
    "extra": {"author": {"name": "Ada"}},
}

STUDY = """\
maps = ["square", "rooms"]
controllers = ["rapf", "lloyd"]
robots = [2, 4]
starts = "*"
seeds = 3
duration = 2.0

[gains.rapf]
k_rep = [0.1, 1.0]
k_att = {low = 3.0, high = 100.0, scale = "log"}

[sampling]
method = "sobol"
samples = 4

[team]
max_speed = [0.5, 1.0]
"""

PLAN = "\n".join(
    [
        *("@@@@@@@@@@@@", "@..........@", "@..TT..WW..@", "@..TT..WW..@", "@..........@", "@.SS....GG.@"),
        *("@.SS....GG.@", "@..........@", "@@@@@@@@@@@@"),
    ]
)

SVG = """\
<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="120mm" viewBox="0 0 20 12">
  <style>.wall { stroke: #333; stroke-width: 0.2; fill: none }</style>
  <defs><g id="chair"><circle cx="0" cy="0" r="0.4"/></g></defs>
  <rect id="boundary" x="0" y="0" width="20" height="12" fill="none" stroke="black"/>
  <g transform="translate(2 1) rotate(10) scale(1.2, 0.9)">
    <path id="desk" d="M 3 3 h 2 v 1.5 l -1 0.5 q -1 1 -1 0 z"/>
    <path class="wall" d="M8,1 C 9 2 9 4 8 5 S 10 8 11 6 A 1 2 30 0 1 13 7"/>
    <polygon points="5,6 7,6 6.5,8"/>
    <polyline class="wall" points="9 6 9 9 12 9"/>
  </g>
  <ellipse cx="15" cy="4" rx="1" ry="0.6" style="fill:#f00;opacity:0.5"/>
  <line x1="16" y1="8" x2="19" y2="8" stroke="blue" stroke-width="0.15"/>
  <use href="#chair" x="17" y="10"/>
</svg>
"""

COLORED = """<svg xmlns="http://www.w3.org/2000/svg" width="20000mm" height="12000mm" viewBox="0 0 20 12">
  <defs>
    <linearGradient id="shade">
      <stop offset="0" stop-color="#eee"/><stop offset="1" stop-color="#111"/>
    </linearGradient>
    <linearGradient id="again" href="#shade"/>
    <pattern id="hatch" width="1" height="1"><path d="M0 0L1 1" stroke="#000"/></pattern>
  </defs>
  <rect width="20" height="12" fill="#fff"/>
  <g id="rooms" opacity=".9">
    <rect x="1" y="1" width="8" height="10" fill="#e0e0ff" stroke="#000" stroke-width=".2"/>
    <rect x="9" y="1" width="10" height="10" fill="url(#again)" stroke="currentColor" color="#222"/>
  </g>
  <rect x="8.8" y="4" width=".4" height="1.5" fill="white"/>
  <circle cx="4" cy="5" r="1" fill="rgb(40 40 40 / 80%)" stroke="#888" stroke-width=".05"/>
  <rect x="12" y="3" width="3" height="2" fill="url(#hatch) gray"/>
  <path d="M10 8h4v2h-4z" fill="none" stroke="#777" stroke-width=".03" transform="skewX(10)"/>
</svg>
"""

# fmt: off
_DXF = [
    *(0, "SECTION", 2, "HEADER", 9, "$ACADVER", 1, "AC1015", 9, "$INSUNITS", 70, 6, 0, "ENDSEC"),
    *(0, "SECTION", 2, "BLOCKS", 0, "BLOCK", 8, "0", 2, "CHAIR", 70, 0, 10, 0.0, 20, 0.0),
    *(0, "CIRCLE", 8, "0", 10, 0.0, 20, 0.0, 40, 0.4, 0, "ENDBLK", 8, "0", 0, "ENDSEC"),
    *(0, "SECTION", 2, "ENTITIES"),
    *(0, "LWPOLYLINE", 100, "AcDbEntity", 8, "boundary", 100, "AcDbPolyline", 90, 4, 70, 1),
    *(10, 0.0, 20, 0.0, 10, 10.0, 20, 0.0, 10, 10.0, 20, 6.0, 10, 0.0, 20, 6.0),
    *(0, "LINE", 8, "walls", 10, 5.0, 20, 0.0, 11, 5.0, 21, 2.5),
    *(0, "ARC", 8, "walls", 10, 7.0, 20, 4.0, 40, 1.0, 50, 30.0, 51, 200.0),
    *(0, "CIRCLE", 8, "pillars", 10, 3.0, 20, 3.0, 40, 0.5),
    *(0, "LWPOLYLINE", 100, "AcDbEntity", 8, "walls", 100, "AcDbPolyline", 90, 2, 70, 0, 43, 0.2),
    *(10, 1.0, 20, 5.0, 42, 0.5, 10, 2.0, 20, 5.0),
    *(0, "ELLIPSE", 100, "AcDbEntity", 8, "pillars", 100, "AcDbEllipse", 10, 6.0, 20, 1.0, 11, 0.5, 21,
        0.2, 40, 0.5, 41, 0.0, 42, 6.28),
    *(0, "SPLINE", 100, "AcDbEntity", 8, "walls", 100, "AcDbSpline", 70, 8, 71, 2, 72, 6, 73, 3, 40, 0,
        40, 0, 40, 0, 40, 1, 40, 1, 40, 1),
    *(10, 1.0, 20, 1.0, 10, 2.0, 20, 2.0, 10, 3.0, 20, 1.0),
    *(0, "INSERT", 8, "chairs", 2, "CHAIR", 10, 8.0, 20, 1.5, 41, 1.0, 42, 1.0, 50, 45.0),
    *(0, "ENDSEC", 0, "EOF"),
]
# fmt: on


def build_png(rows: list[list[int]], depth: int = 8) -> bytes:
    """Return a gray picture of one channel as PNG."""
    width = len(rows[0])
    height = len(rows)
    size = {8: "B", 16: "H"}[depth]
    raw = b"".join(b"\0" + struct.pack(f">{width}{size}", *row) for row in rows)
    header = struct.pack(">IIBBBBB", width, height, depth, 0, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(raw)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(build_chunk(kind, data) for kind, data in chunks)


def build_chunk(kind: bytes, data: bytes) -> bytes:
    """Return a chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def build_pgm(rows: list[list[int]], *, text: bool = False) -> bytes:
    """Return a gray picture as PGM."""
    head = f"{'P2' if text else 'P5'}\n# a comment\n{len(rows[0])} {len(rows)}\n255\n".encode()
    if text:
        return head + "\n".join(" ".join(map(str, row)) for row in rows).encode() + b"\n"
    return head + b"".join(map(bytes, rows))


GRAY = [
    [{"@": 0, "T": 0, "W": 205}.get(letter, 254) for letter in row for _ in range(2)]
    for row in PLAN.split("\n")
    for _ in range(2)
]

ROS = (
    "image: {}\nresolution: 0.25\norigin: [-1.0, -2.0, 0.1]\n"
    "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


@dataclass(frozen=True)
class Case:
    """An input: files beside each other, the first of which is read.

    Attributes
    ----------
    files : dict of name to bytes
    """

    files: dict[str, bytes] = field(default_factory=dict)

    @property
    def main(self) -> str:
        """The name of the file that is read."""
        return next(iter(self.files))

    def with_file(self, name: str, content: bytes) -> Case:
        """Return the case with another content of one file."""
        return Case({**self.files, name: content})


def _build_cases(name: str, *contents: str | bytes) -> list[Case]:
    return [Case({name: text.encode() if isinstance(text, str) else text}) for text in contents]


def _build_rgba() -> bytes:
    from PIL import Image

    file = io.BytesIO()
    picture = Image.new("LA", (12, 9), (255, 255))
    picture.putpixel((3, 4), (0, 255))
    picture.putpixel((5, 5), (90, 0))
    picture.save(file, "PNG")
    return file.getvalue()


def _build_float_tiff() -> bytes:
    """Return a TIFF of floating-point samples, one of which is none."""
    import numpy as np
    from PIL import Image

    samples = np.array(GRAY, dtype=np.float32) / 255
    samples[0, 0] = np.nan
    file = io.BytesIO()
    Image.fromarray(samples).save(file, "TIFF")
    return file.getvalue()


def _save_picture(kind: str, **options: Any) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    picture = Image.frombytes("L", (len(GRAY[0]), len(GRAY)), b"".join(map(bytes, GRAY)))
    picture.convert("1" if kind == "PPM" else "RGB").save(file, kind, **options)
    return file.getvalue()


OSM = """\
<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6">
 <bounds minlat="50.7" minlon="6.1" maxlat="50.7003" maxlon="6.1004"/>
 <node id="1" lat="50.7001" lon="6.1001"/><node id="2" lat="50.7001" lon="6.1002"/>
 <node id="3" lat="50.7002" lon="6.1002"/><node id="4" lat="50.7002" lon="6.1001"/>
 <node id="5" lat="50.70005" lon="6.1003"><tag k="natural" v="tree"/></node>
 <way id="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/></way>
 <way id="2"><nd ref="3"/><nd ref="4"/><nd ref="1"/></way>
 <way id="3"><nd ref="3"/><nd ref="5"/><tag k="barrier" v="wall"/><tag k="width" v="0.5 m"/></way>
 <way id="4"><nd ref="4"/><nd ref="5"/><nd ref="3"/><nd ref="4"/><tag k="natural" v="water"/></way>
 <relation id="1"><member type="way" ref="1" role="outer"/><member type="way" ref="2" role="outer"/>
  <tag k="type" v="multipolygon"/><tag k="building" v="yes"/></relation>
</osm>
"""


INDOOR = """\
<osm version="0.6">
 <node id="1" lat="48" lon="11"/><node id="2" lat="48" lon="11.0002"/>
 <node id="3" lat="48.0001" lon="11.0002"/><node id="4" lat="48.0001" lon="11"/>
 <node id="5" lat="48.0002" lon="11.0002"/><node id="6" lat="48.0002" lon="11"/>
 <node id="7" lat="48.0001" lon="11.0001"><tag k="door" v="yes"/><tag k="width" v="1.2"/></node>
 <node id="8" lat="48.00005" lon="11.00005"><tag k="indoor" v="column"/><tag k="level" v="0;1"/></node>
 <way id="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="7"/><nd ref="4"/><nd ref="1"/>
  <tag k="indoor" v="corridor"/><tag k="level" v="0"/></way>
 <way id="2"><nd ref="4"/><nd ref="7"/><nd ref="3"/><nd ref="5"/><nd ref="6"/><nd ref="4"/>
  <tag k="indoor" v="room"/><tag k="level" v="-1-1"/><tag k="name" v="office"/></way>
 <way id="3"><nd ref="7"/><nd ref="8"/><tag k="indoor" v="wall"/><tag k="repeat_on" v="0"/></way>
 <way id="4"><nd ref="1"/><nd ref="8"/><nd ref="2"/><nd ref="1"/><tag k="indoor" v="area"/>
  <tag k="room" v="stairs"/></way>
</osm>
"""


def _build_elements() -> list[dict[str, Any]]:
    """Return a building, whose way has nodes and places, a wall, and a relation that holds its way."""
    places = [
        {"lat": 48.0 + y * 1e-4, "lon": 11.0 + x * 1e-4} for x, y in ((0, 0), (2, 0), (2, 1), (0, 1), (0, 0))
    ]
    nodes = [{"type": "node", "id": k, **place} for k, place in enumerate(places[:4], start=1)]
    wall = {"type": "way", "id": 11, "nodes": [1, 3], "tags": {"barrier": "wall", "width": "0.3"}}
    house = {
        "type": "way",
        "id": 10,
        "nodes": [1, 2, 3, 4, 1],
        "geometry": places,
        "tags": {"building": "yes"},
    }
    member = {"type": "way", "ref": 12, "role": "outer", "geometry": [*places[:2], places[2], places[0]]}
    tags = {"type": "multipolygon", "natural": "water"}
    pond = {"type": "relation", "id": 13, "members": [member, {"type": "node", "ref": 1}], "tags": tags}
    return [*nodes, house, wall, pond]


OVERPASS: dict[str, Any] = {
    "version": 0.6,
    "generator": "Overpass API",
    "bounds": {"minlat": 47.9999, "minlon": 10.9999, "maxlat": 48.0003, "maxlon": 11.0004},
    "elements": _build_elements(),
    "remark": "runtime error: none",
}


def _build_feature(kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


_SQUARE = [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]
_HOLE = [[2, 2], [2, 4], [4, 4], [4, 2], [2, 2]]

GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        _build_feature("Polygon", [_SQUARE, _HOLE], name="boundary"),
        _build_feature("MultiPolygon", [[[[7, 1], [8, 1], [8, 2], [7, 1]]]], name="desk"),
        _build_feature("LineString", [[5, 0], [5, 2.5], [6, 3]], name="wall"),
        _build_feature("MultiLineString", [[[1, 5], [2, 5]], [[3, 5], [4, 5.5]]]),
        _build_feature("Point", [8, 4], name="pillar"),
        {"type": "Feature", "properties": None, "geometry": None},
    ],
}
DEGREES = {
    "type": "Polygon",
    "coordinates": [[[6.1, 50.7], [6.1004, 50.7], [6.1004, 50.7003], [6.1, 50.7003], [6.1, 50.7]]],
}

WKT = (
    "POLYGON ((0 0, 10 0, 10 6, 0 6, 0 0), (2 2, 2 4, 4 4, 4 2, 2 2))",
    "SRID=25832;GEOMETRYCOLLECTION (POLYGON ((0 0, 10 0, 10 6, 0 6, 0 0)), "
    "LINESTRING (5 0, 5 2.5), POINT (8 4))",
    "MULTIPOLYGON Z (((0 0 1, 10 0 1, 10 6 1, 0 0 1)), ((20 0 1, 30 0 1, 30 6 1, 20 0 1)))\n"
    "MULTIPOINT ((1 1), (2 2))\n",
)

STAGE = """\
include "things.inc"
name "hall"
unit_angle "degrees"
window ( size [ 600 400 ] scale 30.5 )
floorplan ( name "cave" size [12.000 9.000 0.8] pose [0 0 0 0] bitmap "map.png" )
table ( pose [1 -1 0 30] )  # a comment
zone ( pose [2 2 0 0] size [1 1 0.01] )
robot ( name "r0" pose [-2 -1 0 45] sensor ( range [0 5] ) )
"""
THINGS = """\
define floorplan model ( color "gray30" boundary 1 obstacle_return 0 ranger_return 0.5 )
define zone model ( obstacle_return 0 ranger_return -1 )
define robot position ( drive "diff" size [0.3 0.3] )
define table model
(
  size [1.5 0.8 0.7]
  origin [0.1 0 0 0]
  block ( points 4 point[0] [0 0] point[1] [2 0] point[2] [2 1] point[3] [0 1] z [0 1] )
  block ( points 3 point[0] [0 1] point[1] [1 1] point[2] [0 2] )
)
"""

ARGOS = """\
<?xml version="1.0" ?>
<argos-configuration>
  <framework><experiment length="0" random_seed="124" /></framework>
  <arena size="8, 6, 1" center="1,0,0.5">
    <box id="wall" size="4,0.1,0.5" movable="false"><body position="0,1,0" orientation="30,0,0" /></box>
    <cylinder id="c" radius="0.3" height="0.5" movable="true" mass="2"><body position="2,-1,0" /></cylinder>
    <foot-bot id="fb"><body position="-1,-1,0" orientation="0,0,0" /></foot-bot>
    <distribute>
      <position method="grid" center="1,2,0" distances="1,0.5,0" layout="3,1,1" />
      <orientation method="constant" values="0,0,0" />
      <entity quantity="3" max_trials="100"><box id="b" size="0.2,0.2,0.2" movable="true" /></entity>
    </distribute>
    <distribute>
      <position method="uniform" min="-1,-1,0" max="1,1,0" />
      <orientation method="constant" values="0,0,0" />
      <entity quantity="5" max_trials="100"><foot-bot id="f" /></entity>
    </distribute>
  </arena>
</argos-configuration>
"""

IRSIM = """\
world:
  height: 9
  width: 12
  offset: [-1, 2]
  step_time: 0.1
robot:
  - number: 2
    distribution: {name: 'circle', radius: 3}
    kinematics: {name: 'diff'}
obstacle:
  - shape: {name: 'circle', radius: 0.5}
    state: [5, 5, 0]
  - number: 2
    shape:
      - {name: 'rectangle', length: 1.5, width: 0.4}
      - {name: 'polygon', vertices: [[0, 0], [1, 0], [1, 1]]}
    state: [[2, 4, 0.5], [8, 8]]
  - shape: {name: 'linestring', vertices: [[3, 3], [4, 9], [6, 9]]}
    state: [0, 0, 0]
    unobstructed: False
  - number: 4
    distribution: {name: 'random', range_low: [0, 0, -3.14]}
"""

TMX = """\
<?xml version="1.0" encoding="UTF-8"?>
<map version="1.10" orientation="orthogonal" width="4" height="3" tilewidth="16" tileheight="12">
 <tileset firstgid="1" name="t" tilewidth="16" tileheight="12" tilecount="4" columns="2">
  <tile id="1"><properties><property name="collides" type="bool" value="true"/></properties></tile>
  <tile id="2"><objectgroup><object x="4" y="2" width="6" height="5" rotation="10"/></objectgroup></tile>
 </tileset>
 <tileset firstgid="5" source="more.tsx"/>
 <layer id="1" name="Ground" width="4" height="3"><data encoding="csv">
2,2,1,1,
2,0,3,1,
2,5,2147483651,2
</data></layer>
 <layer id="2" name="Walls" width="4" height="3">
  <data encoding="base64" compression="{}">{}</data></layer>
 <objectgroup id="3" name="obstacles" offsetx="1">
  <object id="1" x="20" y="14" width="9" height="9"><ellipse/></object>
  <object id="2" x="40" y="4"><polygon points="0,0 8,0 8,6"/></object>
  <object id="3" name="robot" x="30" y="30"><point/></object>
  <object id="4" x="2" y="20"><polyline points="0,0 8,0 8,6"/></object>
 </objectgroup>
</map>
"""
CHUNKS = """\
<map orientation="orthogonal" width="2" height="2" tilewidth="16" tileheight="16" infinite="1">
 <group name="collision"><layer name="a" width="2" height="2"><data encoding="csv">
  <chunk x="-2" y="0" width="2" height="2">0,1,1,0</chunk>
  <chunk x="1" y="-3" width="3" height="1">1,0,1</chunk>
 </data></layer></group>
</map>
"""
MORE = """\
<tileset name="more" tilewidth="16" tileheight="24" tilecount="1" columns="1">
 <tileoffset x="1" y="2"/><tile id="0" class="wall"/>
</tileset>
"""
_TILES = struct.pack("<12I", *(0, 0, 0, 1) * 3)


def _build_indoor_feature(kind: str, geometry: Any, number: str = "1", **properties: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "id": number,
        "feature_type": kind,
        "geometry": geometry,
        "properties": properties,
    }


def _build_indoor_area(left: float, bottom: float, right: float, top: float) -> dict[str, Any]:
    """Return a rectangle in degrees, given its sides in 1e-5 degrees from a corner of the building."""
    ring = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    return {"type": "Polygon", "coordinates": [[[8.4 + x * 1e-5, 49.0 + y * 1e-5] for x, y in ring]]}


_OPENING = {"type": "LineString", "coordinates": [[8.40001, 49.0001], [8.40003, 49.0001]]}
IMDF: dict[str, list[dict[str, Any]]] = {
    "level": [
        _build_indoor_feature(
            "level", _build_indoor_area(0, 0, 20, 30), "a", ordinal=0, short_name={"en": "G"}
        ),
        _build_indoor_feature("level", None, "b", ordinal=1, name={"en": "First"}),
    ],
    "unit": [
        _build_indoor_feature("unit", _build_indoor_area(0, 0, 20, 10), category="walkway", level_id="a"),
        _build_indoor_feature(
            "unit", _build_indoor_area(0, 10, 10, 30), category="office", level_id="a", name={"en": "A"}
        ),
        _build_indoor_feature("unit", _build_indoor_area(10, 10, 20, 30), category="stairs", level_id="a"),
        _build_indoor_feature("unit", _build_indoor_area(0, 0, 9, 9), category="room", level_id="b"),
    ],
    "opening": [_build_indoor_feature("opening", _OPENING, category="pedestrian", level_id="a")],
    "fixture": [
        _build_indoor_feature("fixture", _build_indoor_area(2, 2, 4, 4), category="desk", level_id="a")
    ],
    "venue": [_build_indoor_feature("venue", None, name={"en": "Mill"})],
}


def build_imdf_files(given: dict[str, Any]) -> dict[str, bytes]:
    """Return the files of an archive."""
    return {
        f"{name}.geojson": json.dumps({"type": "FeatureCollection", "features": features}).encode()
        for name, features in given.items()
    }


def build_imdf_zip(given: dict[str, Any]) -> bytes:
    """Return an archive as a zip, some of it packed."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for k, (name, content) in enumerate(build_imdf_files(given).items()):
            entry = zipfile.ZipInfo(name)
            entry.compress_type = zipfile.ZIP_DEFLATED if k % 2 else zipfile.ZIP_STORED
            archive.writestr(entry, content)
    return file.getvalue()


def _build_sequence(separator: bytes) -> bytes:
    lines = [json.dumps(feature).encode() for feature in GEOJSON["features"]]
    return b"".join(separator + line + b"\n" for line in lines)


ANCHORS = """\
world: &world
  height: 6
  width: 10
  robots: &state [1, 1, 0]
obstacle:
  - shape: &box {name: 'rectangle', length: 1.0, width: 0.5}
    state: [3, 3, 0]
  - {shape: {<<: *box, length: 2}, state: [7, 3, 1.57]}
robot: [{state: *state}, {<<: [*world], state: [2, 2, 0]}]
"""

COVERAGE_WORLD = "CircularBND\n30 40 5 2\nBND\n60 20 4 8 0.5 3\nUniform\n3 0.5\n10 10\n50 10\n10 50\n"

SEEDS: dict[str, list[Case]] = {
    "map": _build_cases(
        "map.json", json.dumps(MAP, indent=2), json.dumps({**MAP, "obstacles": [], "starts": {}})
    ),
    "check": _build_cases("map.json", json.dumps(MAP, indent=1)),
    "study": _build_cases("study.toml", STUDY, 'maps = "*"\ncontrollers = ["rpf"]\n'),
    "movingai": _build_cases("plan.map", f"type octile\nheight 9\nwidth 12\nmap\n{PLAN}\n"),
    "image": [
        *_build_cases(
            "plan.png",
            build_png(GRAY),
            build_png([[257 * value for value in row] for row in GRAY], 16),
            _build_rgba(),
        ),
        *_build_cases("plan.pgm", build_pgm(GRAY), build_pgm(GRAY, text=True)),
        *_build_cases("plan.jpg", _save_picture("JPEG"), _save_picture("JPEG", progressive=True)),
        *_build_cases("plan.bmp", _save_picture("BMP"), _save_picture("PPM")),
        *_build_cases(
            "plan.tif",
            _save_picture("TIFF"),
            _build_float_tiff(),
            *(_save_picture("TIFF", compression=f"tiff_{way}") for way in ("lzw", "deflate")),
        ),
    ],
    "ros": [
        Case({"map.yaml": ROS.format("map.pgm").encode(), "map.pgm": build_pgm(GRAY)}),
        Case({"map.yaml": (ROS.format("map.png") + "mode: scale\n").encode(), "map.png": build_png(GRAY)}),
    ],
    "coverage-control": [
        Case({"world.env": COVERAGE_WORLD.encode(), "world.pos": b"10 20\n30 40\n"}),
        Case({"world.env": COVERAGE_WORLD.encode()}),
    ],
    "houseexpo": _build_cases(
        "plan.json",
        json.dumps(
            {
                "id": "ours",
                "room_num": 2,
                "bbox": {"min": [0, 0], "max": [6, 7]},
                "verts": [[0, 0], [6, 0], [6, 4], [3, 4], [3, 7], [0, 7], [0, 0]],
                "room_category": {"Kitchen": [[0, 0, 3, 4]]},
            }
        ),
    ),
    "rings": _build_cases(
        "plan.json",
        json.dumps([_SQUARE, _HOLE]),
        json.dumps([[_SQUARE, _HOLE]]),
        json.dumps({"vertices": [0, 0, 10, 0, 10, 6, 0, 6, 2, 2, 2, 4, 4, 4], "holes": [4], "dimensions": 2}),
    ),
    "wkt": _build_cases("plan.wkt", *WKT),
    "geojson": [
        *_build_cases(
            "plan.geojson", json.dumps(GEOJSON, indent=1), json.dumps(DEGREES), _build_sequence(b"\x1e")
        ),
        *_build_cases("plan.geojsonl", _build_sequence(b"")),
    ],
    "imdf": [Case(build_imdf_files(IMDF)), Case({"venue.zip": build_imdf_zip(IMDF)})],
    "svg": _build_cases("plan.svg", SVG, COLORED),
    "osm": [
        *_build_cases("plan.osm", OSM, INDOOR),
        *_build_cases("plan.json", json.dumps(OVERPASS, indent=1)),
    ],
    "dxf": _build_cases("plan.dxf", "\n".join(map(str, _DXF)) + "\n"),
    "stage": [
        Case({"hall.world": STAGE.encode(), "things.inc": THINGS.encode(), "map.png": build_png(GRAY)}),
        Case({"hall.world": (THINGS + "table ( ) table ( pose [4 2 0 0] )").encode()}),
    ],
    "argos": _build_cases("arena.argos", ARGOS),
    "irsim": [
        *_build_cases("world.yaml", IRSIM, ANCHORS),
        Case(
            {
                "world.yaml": IRSIM.replace(
                    "step_time: 0.1", "obstacle_map: map.png\n  mdownsample: 2"
                ).encode(),
                "map.png": build_png(GRAY),
            }
        ),
    ],
    "tmx": [
        Case({"map.tmx": text.encode(), "more.tsx": MORE.encode()})
        for text in (
            TMX.format("zlib", base64.b64encode(zlib.compress(_TILES)).decode()),
            TMX.format("", base64.b64encode(_TILES).decode()),
            CHUNKS,
        )
    ],
}
"""The seeds of each target."""

# fmt: off
_JSON = ['"', "[", "]", "{", "}", ",", ":", "null", "true", "[]", "{}", '""', "[[]]", "NaN", "Infinity",
    "\\u0000", "\\ud800"]
# fmt: on

# fmt: off
TOKENS: dict[str, list[str]] = {
    "map": [*_JSON, '"kind"', '"polygon"', '"wall"', '"circle"', '"disc"', '"points"', '"holes"', '"extra"'],
    "study": ["[", "]", "{", "}", "=", '"*"', "[[gains.rapf]]", "[team]", "inf", "nan", "seeds",
        "1979-05-27", "'''", "low"],
    "movingai": ["type", "octile", "height", "width", "map", "@", ".", "T", "W", "S", "G", "\r\n", "\t", "?"],
    "image": ["P2", "P5", "P6", "#", "\n", "255", "65535", "IHDR", "IDAT", "PLTE", "tRNS", "iCCP", "zTXt"],
    "ros": [
        *("image:", "resolution:", "origin:", "negate:", "mode: raw", "mode: trinary", "free_thresh:",
            "---\n"),
        *("&a", "*a", "!!python/object/apply:os.system", "[", "]", "{", "}", "../", "/dev/zero", "|", ">",
            ".inf", "~"),
    ],
    "coverage-control": ["CircularBND", "BND", "Uniform", "\n", "0", "-1", "1e308", "nan", "inf", "3 0.5"],
    "houseexpo": [*_JSON, '"verts"', '"id"', '"bbox"', '"room_num"'],
    "rings": [*_JSON, '"vertices"', '"holes"', '"dimensions"', "[0, 0]"],
    "wkt": [
        *("POLYGON", "MULTIPOLYGON", "GEOMETRYCOLLECTION", "LINESTRING", "POINT", "EMPTY", " Z ", "ZM", "M"),
        *("(", ")", ",", "((", "))", "SRID=4326;", "CURVEPOLYGON", "CIRCULARSTRING", "nan", "inf", "\n",
            "--"),
    ],
    "geojson": [
        *_JSON,
        *(
            '"type"',
            '"coordinates"',
            '"geometry"',
            '"Polygon"',
            '"GeometryCollection"',
            '"geometries"',
            '"features"',
        ),
        *('"Feature"', '"crs"', '"urn:ogc:def:crs:EPSG::4326"', '"MultiPoint"', '"properties"', "180", "-90"),
    ],
    "svg": [
        *("<g>", "</g>", "<path d='M0 0", "/>", "<rect", "<use href='#chair'/>", "transform='",
            "matrix(1 0 0 1 0 0)"),
        *("scale(0)", "skewX(90)", "rotate(45 1 1)", "z", "A", "a0 0 0 0 0 0 0", "M", "m", "C", "Q", "T",
            "viewBox='0 0 0 0'"),
        *("<!DOCTYPE a>", '<!ENTITY a "b">', "&a;", "<![CDATA[", "]]>", "<!--", "-->", "100%", "1e3em",
            "px", "style='", "#"),
        *('href="#boundary"', 'id="chair"', "<symbol", "<clipPath", "<mask", "<svg", "display:none",
            "url(#a)"),
    ],
    "osm": [
        *(
            "<node",
            "<way",
            "<relation",
            "<nd ref='1'/>",
            "<member",
            "type='way'",
            "<tag k='building' v='yes'/>",
        ),
        *("action='delete'", "lat='90'", "lon='180'", "nan", "<bounds", "<!DOCTYPE a>", "&amp;", "/>",
            "</way>"),
        *("<tag k='area' v='yes'/>", "multipolygon", "ref='-1'", "id='1'", "layer", "-1", "<osm>", "</osm>"),
    ],
    "dxf": [
        *("\n0\n", "SECTION", "ENDSEC", "EOF", "LINE", "LWPOLYLINE", "INSERT", "CIRCLE", "ARC", "SPLINE",
            "HATCH"),
        *("ELLIPSE", "POLYLINE", "VERTEX", "SEQEND", "BLOCK", "ENDBLK", "TABLES", "AC1027", "$ACADVER",
            "CHAIR", "999"),
    ],
}
# fmt: on
# fmt: off
_XML = ["<", ">", "/>", "</", '"', "<!--", "<!DOCTYPE a>", '<!ENTITY a "b">', "&a;", "<![CDATA[", "&#0;",
    "\n"]
# fmt: on
# fmt: off
TOKENS["imdf"] = [
    *_JSON,
    *('"level_id"', '"ordinal"', '"features"', '"geometry"', '"coordinates"', '"Polygon"', '"walkway"'),
    *('"stairs"', '"office"', '"LineString"', '"properties"', "PK\x03\x04", "PK\x01\x02", "PK\x05\x06"),
    *("unit.geojson", "level.geojson", "opening.geojson", "1e300", "0.00001", "8.4", "49.0"),
]
TOKENS["osm"] += [
    *('"elements"', '"nodes"', '"geometry"', '"members"', '"type": "way"', '"lat"', '"tags"', '"bounds"'),
    *("<tag k='indoor' v='room'/>", "<tag k='indoor' v='wall'/>", "<tag k='door' v='yes'/>"),
    *("<tag k='level' v='0;1'/>", "<tag k='level' v='-200-200'/>", "<tag k='room' v='stairs'/>"),
]
TOKENS["geojson"] += ["\x1e", "\n", "}\n{"]
TOKENS["stage"] = [
    *("(", ")", "[", "]", '"', "#", "\n", "define", "model", "position", "block", "points", "point[0]",
        "size"),
    *(
        'include "hall.world"',
        'include "../a"',
        "table ( )",
        "define table table ( )",
        "bitmap",
        "boundary 1",
    ),
    *("noblocks 1", "unit_length", '"mm"', "block[0].point[1] [1 2]", "pose [1 1 30]", "origin"),
]
# fmt: on
TOKENS["argos"] = [
    *_XML,
    *("<arena", "</arena>", "<box", "<body", "</box>", "<distribute>", "quantity='9999999'", "size='1,1,1'"),
    *("method='grid'", "layout='0,1,1'", "orientation='0,90,0'", "radius='0'", ",", "-1"),
]
TOKENS["irsim"] = [
    *("world:", "obstacle:", "robot:", "- ", "[", "]", "{", "}", ":", ",", "&a ", "*a", "!!str ", "---\n"),
    *("number: 9999999", "name: 'compound', parts: [{name: circle}]", "state: [1]", "null", ".nan", "\n  "),
    *("obstacle_map: {name: perlin}", "obstacle_map: ../a.png", "mdownsample: 0", "random_shape: true"),
]
TOKENS["tmx"] = [
    *_XML,
    *("<layer", "</layer>", "<data>", "<tile gid='1'/>", "<chunk x='9' y='9' width='1' height='1'>1</chunk>"),
    *(
        "infinite='1'",
        "orientation='isometric'",
        "compression='zstd'",
        "compression='gzip'",
        "encoding='csv'",
    ),
    *(
        "source='../a.tsx'",
        "firstgid='4294967295'",
        "<ellipse/>",
        "<text/>",
        "gid='3'",
        "points='0,0 1'",
        ",",
    ),
    *("4294967295", "width='100000'", "<group offsetx='3'>", "</group>", "value='false'"),
]
TOKENS["check"] = TOKENS["map"]
