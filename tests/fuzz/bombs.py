"""Decompression bombs and similar: small files that include each other, repeat parts, or unpack to a lot."""

import base64
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable

from fuzz_reading import Job
from fuzz_seeds import Case, build_imdf_files


def _build_mutual_includes() -> Case:
    """Return eleven files of Stage, each of which includes ten of them."""
    names = [f"part{k}.inc" for k in range(10)]
    body = "".join(f'include "{name}"\n' for name in names)
    parts = {name: body.encode() for name in names}
    return Case({"hall.world": f"{body}model ( )\n".encode(), **parts})


def _build_nested_includes() -> Case:
    """Return files of Stage, each of which includes the next one ten times."""
    parts = {f"part{k}.inc": (f'include "part{k + 1}.inc"\n' * 10).encode() for k in range(9)}
    return Case({"hall.world": b'include "part0.inc"\nmodel ( )\n', **parts, "part9.inc": b"# nothing\n"})


def _build_long_includes() -> Case:
    """Return a file of Stage that includes a file of 0.5 MB twenty times."""
    return Case({"hall.world": b'include "long.inc"\n' * 20 + b"model ( )", "long.inc": b"#" * 500_000})


def _build_macros() -> Case:
    """Return macros of Stage, each of which calls the next one ten times."""
    calls = "".join(f"define m{k} model ( {f'm{k + 1} ( ) ' * 10} )\n" for k in range(12))
    return Case({"hall.world": f"{calls}m0 ( )".encode()})


def _build_tilesets(tiles: int, count: int) -> Case:
    """Return a map of Tiled that refers to a tileset repeatedly."""
    named = "".join(f'<tileset firstgid="{k + 1}" source="t.tsx"/>' for k in range(count))
    sides = 'width="1" height="1" tilewidth="8" tileheight="8"'
    layer = '<layer name="walls" width="1" height="1"><data encoding="csv">1</data></layer>'
    tileset = '<tileset tilewidth="8" tileheight="8">' + '<tile id="1"/>' * tiles + "</tileset>"
    return Case({"map.tmx": f"<map {sides}>{named}{layer}</map>".encode(), "t.tsx": tileset.encode()})


def _build_tile_shapes() -> Case:
    """Return a map of Tiled with 250,000 tiles of 20,000 kinds. Each kind has its own shape."""
    size = 500
    kinds = 20_000
    shape = "<objectgroup><object width='4' height='8'/></objectgroup>"
    tiles = "".join(f'<tile id="{k}">{shape}</tile>' for k in range(kinds))
    ids = struct.pack(f"<{size * size}I", *(k % kinds + 1 for k in range(size * size)))
    data = base64.b64encode(zlib.compress(ids)).decode()
    sides = f'width="{size}" height="{size}"'
    layer = f'<data encoding="base64" compression="zlib">{data}</data>'
    tileset = f'<tileset firstgid="1" tilewidth="8" tileheight="8">{tiles}</tileset>'
    body = f'{tileset}<layer name="a" {sides}>{layer}</layer>'
    return Case({"map.tmx": f'<map {sides} tilewidth="8" tileheight="8">{body}</map>'.encode()})


def _build_aliases(head: str) -> bytes:
    """Return YAML with lists, each of which contains the previous list ten times."""
    lists = [f"l{k}: &l{k} [{', '.join([f'*l{k - 1}'] * 10)}]" for k in range(1, 10)]
    return "\n".join([head, "l0: &l0 [x, x]", *lists, ""]).encode()


def _build_compound() -> bytes:
    """Return a world of 4,000 objects of 4,000 parts each."""
    parts = ", ".join(["*one"] * 4000)
    head = "world: {width: 9, height: 9}\none: &one {name: circle, random_shape: true}\n"
    return f"{head}obstacle:\n  - {{number: 4000, shape: {{name: compound, parts: [{parts}]}}}}".encode()


def _build_uses() -> bytes:
    """Return groups of SVG, each of which uses the previous group ten times."""
    groups = "".join(f'<g id="g{k + 1}">' + f'<use href="#g{k}"/>' * 10 + "</g>" for k in range(12))
    body = f'<path id="g0" d="M0 0h1v1z"/>{groups}<use href="#g12"/>'
    return f'<svg xmlns="http://www.w3.org/2000/svg">{body}</svg>'.encode()


def _build_entities(root: str) -> bytes:
    """Return XML with entities that refer to other entities."""
    entities = "".join(f'<!ENTITY l{k + 1} "{f"&l{k};" * 10}">' for k in range(9))
    return (
        f'<?xml version="1.0"?><!DOCTYPE {root} [<!ENTITY l0 "lol">{entities}]><{root}>&l9;</{root}>'.encode()
    )


def _build_external_entity(root: str, name: str) -> Case:
    """Return XML with an entity that refers to a file with the same content."""
    text = f'<!DOCTYPE {root} [<!ENTITY a SYSTEM "b{name}">]><{root} tilewidth="1">&a;</{root}>'.encode()
    return Case({name: text, f"b{name}": text})


def _build_blocks() -> bytes:
    """Return blocks of DXF, each of which inserts the previous block ten times."""
    pairs: list[object] = [0, "SECTION", 2, "BLOCKS"]
    for k in range(12):
        point = [0, "POINT", 8, "0", 10, 0, 20, 0]
        inner = [0, "INSERT", 8, "0", 2, f"B{k - 1}", 10, 0, 20, 0] * 10 if k else point
        pairs += [0, "BLOCK", 8, "0", 2, f"B{k}", 70, 0, 10, 0, 20, 0, *inner, 0, "ENDBLK", 8, "0"]
    pairs += [0, "ENDSEC", 0, "SECTION", 2, "ENTITIES", 0, "INSERT", 8, "0", 2, "B11", 10, 0, 20, 0]
    return "\n".join(map(str, [*pairs, 0, "ENDSEC", 0, "EOF", ""])).encode()


def _build_relations() -> bytes:
    """Return OSM with 5,000 rooms, all with the same outline of 5,000 nodes."""
    nodes = "".join(f'<node id="{k}" lat="{48 + k % 71 / 1e5}" lon="{11 + k / 1e7}"/>' for k in range(5000))
    way = '<way id="1">' + "".join(f'<nd ref="{k}"/>' for k in range(5000)) + "</way>"
    tags = '<tag k="type" v="multipolygon"/><tag k="indoor" v="room"/>'
    member = '<member type="way" ref="1" role="outer"/>'
    relations = "".join(f'<relation id="{k}">{member}{tags}</relation>' for k in range(5000))
    return f'<osm version="0.6">{nodes}{way}{relations}</osm>'.encode()


def _build_collections() -> bytes:
    """Return GeoJSON with 40 nested collections."""
    geometry: object = {"type": "Point", "coordinates": [0, 0]}
    for _ in range(40):
        geometry = {"type": "GeometryCollection", "geometries": [geometry]}
    return json.dumps(geometry).encode()


def _build_zip(files: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return file.getvalue()


def _build_png() -> bytes:
    """Return a PNG of 12,000 x 12,000 pixels in 140 kB."""
    size = 12_000

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(bytes(size + 1)) for _ in range(size)) + packer.flush()
    head = struct.pack(">IIBBBBB", size, size, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def _build_study() -> bytes:
    """Return a study of 10^12 runs."""
    values = ", ".join(f"{1 + k / 1000:.3f}" for k in range(100))
    names = ("radius", "max_speed", "max_acceleration", "viscosity", "sensing_range", "communication_range")
    axes = "\n".join(f"{name} = [{values}]" for name in names)
    return f'maps = ["square"]\ncontrollers = ["rapf"]\n[team]\n{axes}\n'.encode()


def _build_case(name: str, make: Callable[[], bytes]) -> Callable[[], Case]:
    return lambda: Case({name: make()})


_ARGOS = b"""<argos-configuration><arena size="9,9,9"><distribute>
<position method="constant" values="0,0,0"/><orientation method="constant" values="0,0,0"/>
<entity quantity="999999999"><box size="1,1,1"/></entity></distribute></arena></argos-configuration>"""
_ROS = "image: map.yaml\nresolution: 0.1\norigin: [0, 0, 0]"
_READ = Job("import")
_POINT = b'{"type": "Point", "coordinates": [0, 0]}\n'
_LEVELS = {"level": [{"properties": {}}] * 400_000, "unit": []}

BOMBS: dict[str, tuple[Callable[[], Case], Job, str]] = {
    "stage: each other": (_build_mutual_includes, _READ, "does not include itself"),
    "stage: tenfold": (_build_nested_includes, _READ, "expected at most 200 (a file read twice"),
    "stage: much": (_build_long_includes, _READ, "expected at most 5 MB in total"),
    "stage: macros": (_build_macros, _READ, "expected at most 10000 models and blocks"),
    "tmx: many tilesets": (
        lambda: _build_tilesets(1, 30_000),
        _READ,
        "expected at most 200 (a file read twice",
    ),
    "tmx: long tilesets": (
        lambda: _build_tilesets(90_000, 9),
        _READ,
        "at most 100000 elements in all tilesets",
    ),
    "tmx: shapes of tiles": (_build_tile_shapes, _READ, "expected at most 10000 parts of tiles"),
    "tmx: entities": (
        _build_case("a.tmx", lambda: _build_entities("map")),
        Job("import", "tmx"),
        "to other entities",
    ),
    "tmx: a file": (
        lambda: _build_external_entity("map", "a.tmx"),
        Job("import", "tmx"),
        "refers to another file",
    ),
    "argos: quantity": (_build_case("a.argos", lambda: _ARGOS), _READ, "a number from -1e7 to 1e7"),
    "argos: a file": (
        lambda: _build_external_entity("argos-configuration", "a.argos"),
        _READ,
        "refers to another file",
    ),
    "irsim: aliases": (
        _build_case("a.yaml", lambda: _build_aliases("world: {}")),
        _READ,
        "expected at most 50000 values",
    ),
    "irsim: parts": (_build_case("a.yaml", _build_compound), _READ, "expected at most 20000"),
    "irsim: itself": (_build_case("a.yaml", lambda: b"world: {obstacle_map: a.yaml}"), _READ, "begins with"),
    "ros: aliases": (
        _build_case("map.yaml", lambda: _build_aliases(_ROS)),
        _READ,
        "expected at most 50000 values",
    ),
    "ros: itself": (_build_case("map.yaml", _ROS.encode), _READ, "begins with"),
    "svg: uses": (
        _build_case("a.svg", _build_uses),
        Job("import", None, {"scale": 1.0}),
        "to draw, including uses",
    ),
    "svg: entities": (
        _build_case("a.svg", lambda: _build_entities("svg")),
        _READ,
        "refers to other entities",
    ),
    "svg: a file": (lambda: _build_external_entity("svg", "a.svg"), _READ, "refers to another file"),
    "dxf: blocks": (
        _build_case("a.dxf", _build_blocks),
        Job("import", None, {"scale": 1.0}),
        "including those in blocks",
    ),
    "osm: relations": (_build_case("a.osm", _build_relations), _READ, "expected at most 500000"),
    "osm: entities": (
        _build_case("a.osm", lambda: _build_entities("osm")),
        Job("import", "osm"),
        "document type declarations",
    ),
    "geojson: collections": (_build_case("a.geojson", _build_collections), _READ, "nested too deeply"),
    "geojson: records": (_build_case("a.geojsonl", lambda: _POINT * 600_000), _READ, "expected at most"),
    "wkt: collections": (
        _build_case("a.wkt", lambda: b"GEOMETRYCOLLECTION(" * 9000),
        _READ,
        "nested too deeply",
    ),
    "imdf: unpacked": (
        _build_case("a.zip", lambda: _build_zip({"unit.geojson": b" " * 200_000_000})),
        _READ,
        "50 MB when unpacked",
    ),
    "imdf: many files": (
        _build_case("a.zip", lambda: _build_zip({f"{k}/unit.geojson": b"" for k in range(5000)})),
        _READ,
        "1000 files",
    ),
    "imdf: levels": (lambda: Case(build_imdf_files(_LEVELS)), Job("folder"), "objects"),
    "image: unpacked": (_build_case("a.png", _build_png), Job("import", None, {"cell": 1.0}), "million"),
    "study: runs": (
        _build_case("study.toml", _build_study),
        Job("study"),
        "expected at most 100000, got 1e+12",
    ),
}
"""Files, job and expected error message of each bomb."""
