"""Hypothesis strategies for documents of each format, with parts that are random or nearly valid."""

import copy
import json
from typing import Any

from fuzz_seeds import DEGREES, GEOJSON, IMDF, MAP, OVERPASS, Case, build_imdf_files
from hypothesis import strategies as st

_WHOLE = st.integers(-3, 12)
_NUMBER = (
    _WHOLE
    | st.floats(-12, 12, allow_nan=False).map(lambda value: round(value, 3))
    | st.sampled_from([0.0, 1e-9, 1e-4, 1e7, -1e7, 1e300, 0.1 + 0.2, 10**30])
)
_PLAIN: list[Any] = [
    None,
    True,
    "",
    "x",
    -1,
    0,
    1e-9,
    1e9,
    [],
    {},
    [[]],
    [0, 0],
    [[0, 0]] * 4,
    "ä\n",
    10**400,
]
_JUNK = st.sampled_from(_PLAIN) | st.recursive(
    st.none() | st.booleans() | _NUMBER | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=5,
)
_POINT = st.tuples(_NUMBER, _NUMBER).map(list)
_NEAR = st.tuples(_WHOLE, _WHOLE).map(list)
"""Points on a small grid, so that points coincide and edges overlap."""

_RING = st.lists(_NEAR, min_size=3, max_size=7) | st.lists(_POINT, max_size=6)
_BOX = st.tuples(_WHOLE, _WHOLE, st.integers(1, 8), st.integers(1, 8)).map(
    lambda box: [
        [box[0], box[1]],
        [box[0] + box[2], box[1]],
        [box[0] + box[2], box[1] + box[3]],
        [box[0], box[1] + box[3]],
    ]
)
_AREA = st.lists(_BOX | _RING, min_size=1, max_size=4)


def _list_paths(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all values in a document, as tuples of keys and indices."""
    paths = [path] if path else []
    keys: list[Any] = []
    if isinstance(value, dict):
        keys = list(value)
    elif isinstance(value, list):
        keys = list(range(len(value)))
    for key in keys:
        paths += _list_paths(value[key], (*path, key))
    return paths


@st.composite
def _altered(draw: st.DrawFn, document: Any, values: st.SearchStrategy[Any]) -> Any:
    """Draw a document with some values replaced, removed or added."""
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 4))):
        paths = _list_paths(document)
        if not paths:
            break
        *parent_path, last_key = draw(st.sampled_from(paths))
        parent = document
        for key in parent_path:
            parent = parent[key]
        change = draw(st.integers(0, 3))
        if change == 0:
            del parent[last_key]
        elif change == 1 and isinstance(parent, dict):
            value = copy.deepcopy(draw(values))
            new_key = draw(st.text(max_size=3) | st.sampled_from(["type", "kind", "name", "holes"]))
            parent[new_key] = value
        elif change == 1:
            parent.insert(last_key, copy.deepcopy(draw(values)))
        else:
            parent[last_key] = copy.deepcopy(draw(values))
    return document


def _dump_json(document: Any) -> bytes:
    return json.dumps(document).encode("utf-8", "surrogatepass")


_OBSTACLE = st.one_of(
    st.fixed_dictionaries(
        {"kind": st.just("polygon"), "vertices": _BOX | _RING},
        optional={"holes": st.lists(_RING, max_size=2)},
    ),
    st.fixed_dictionaries(
        {"kind": st.just("circle"), "center": _NEAR, "radius": st.sampled_from([0.001, 0.5, 1, 2, 30])}
    ),
    st.fixed_dictionaries(
        {
            "kind": st.just("wall"),
            "points": st.lists(_NEAR, min_size=2, max_size=5),
            "width": st.sampled_from([0.001, 0.1, 1, 9]),
        }
    ),
)
_START = st.one_of(
    st.just({"kind": "uniform"}),
    st.fixed_dictionaries(
        {"kind": st.just("disc"), "center": _NEAR, "radius": st.sampled_from([0.01, 0.5, 3])}
    ),
    st.fixed_dictionaries({"kind": st.just("points"), "positions": st.lists(_NEAR, min_size=1, max_size=4)}),
)
_MAP = st.fixed_dictionaries(
    {
        "format": st.just("robocov-map"),
        "version": st.just(1),
        "name": st.just("drawn"),
        "boundary": _BOX | _RING,
        "obstacles": st.lists(_OBSTACLE, max_size=5),
        "starts": st.dictionaries(st.text(max_size=3), _START, max_size=2),
    }
) | _altered(MAP, _JUNK | _RING | _OBSTACLE)


def _geometry() -> st.SearchStrategy[Any]:
    def of(kind: str, coordinates: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
        return st.fixed_dictionaries({"type": st.just(kind), "coordinates": coordinates})

    closed = (_BOX | _RING).map(lambda ring: [*ring, *ring[:1]])
    area = st.lists(closed, min_size=1, max_size=3)
    single = st.one_of(
        of("Point", _POINT),
        of("MultiPoint", st.lists(_POINT, max_size=3)),
        of("LineString", st.lists(_NEAR, max_size=5)),
        of("MultiLineString", st.lists(st.lists(_NEAR, max_size=4), max_size=3)),
        of("Polygon", area),
        of("MultiPolygon", st.lists(area, max_size=3)),
    )
    return st.recursive(
        single,
        lambda inner: st.fixed_dictionaries(
            {"type": st.just("GeometryCollection"), "geometries": st.lists(inner, max_size=3)}
        ),
        max_leaves=4,
    )


_FEATURES = st.fixed_dictionaries(
    {
        "type": st.just("FeatureCollection"),
        "features": st.lists(
            st.fixed_dictionaries(
                {
                    "type": st.just("Feature"),
                    "geometry": _geometry() | st.none(),
                    "properties": st.none()
                    | st.dictionaries(st.sampled_from(["name", "class", "id"]), _JUNK, max_size=2),
                }
            ),
            max_size=4,
        ),
    }
)


def _format_wkt_points(points: list[Any], more: str = "") -> str:
    return "(" + ", ".join(f"{x} {y}{more}" for x, y in points) + ")"


def _format_wkt_area(rings: list[Any]) -> str:
    return "(" + ", ".join(_format_wkt_points([*ring, *ring[:1]]) for ring in rings) + ")"


_WKT = st.recursive(
    st.one_of(
        _AREA.map(lambda rings: f"POLYGON {_format_wkt_area(rings)}"),
        st.lists(_AREA, max_size=3).map(
            lambda areas: f"MULTIPOLYGON ({', '.join(map(_format_wkt_area, areas))})"
        ),
        st.lists(_POINT, max_size=4).map(lambda points: f"LINESTRING {_format_wkt_points(points)}"),
        st.lists(_NEAR, max_size=3).map(lambda points: f"MULTIPOINT Z {_format_wkt_points(points, ' 5')}"),
        st.sampled_from(
            [
                "POINT EMPTY",
                "POLYGON EMPTY",
                "POINT (1 2)",
                "MULTIPOLYGON (EMPTY)",
                "GEOMETRYCOLLECTION EMPTY",
            ]
        ),
    ),
    lambda inner: st.lists(inner, max_size=3).map(lambda parts: f"GEOMETRYCOLLECTION ({', '.join(parts)})"),
    max_leaves=5,
)

_LENGTH = st.sampled_from(["0", "1", "-1", "2.5", "50%", "1e9", "3mm", "2in", "4em", "nan", ""])
_COMMAND = st.tuples(
    st.sampled_from(list("MmLlHhVvCcSsQqTtAaZz")), st.lists(_NUMBER | st.sampled_from(["", "."]), max_size=7)
).map(lambda pair: pair[0] + " ".join(map(str, pair[1])))
_TRANSFORM = st.tuples(
    st.sampled_from(["translate", "rotate", "scale", "skewX", "skewY", "matrix", "spin"]),
    st.lists(_NUMBER, max_size=6),
).map(lambda pair: f"{pair[0]}({','.join(map(str, pair[1]))})")
_ATTRIBUTES = st.dictionaries(
    st.sampled_from(
        ["x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "x1", "y1", "x2", "y2", "stroke-width"]
    ),
    _LENGTH | _NUMBER.map(str),
    max_size=6,
)
_PAINT = st.sampled_from(
    [
        "black",
        "white",
        "#c8c8c8",
        "#eef",
        "none",
        "url(#a)",
        "url(#b) red",
        "rgba(0,0,0,.5)",
        "hsl(9,9%,9%)",
        "x",
    ]
)
_BOXES = st.tuples(_WHOLE, _WHOLE, st.integers(1, 8), st.integers(1, 8), _PAINT, _PAINT).map(
    lambda box: (
        f"<rect x='{box[0]}' y='{box[1]}' width='{box[2]}' height='{box[3]}' "
        f"fill='{box[4]}' stroke='{box[5]}'/>"
    )
)
"""Rooms, floors and furniture on a small grid, so that they overlap."""

_ELEMENT = st.recursive(
    st.one_of(
        _BOXES,
        st.tuples(
            st.sampled_from(["rect", "circle", "ellipse", "line", "use", "image", "text"]), _ATTRIBUTES
        ).map(
            lambda pair: (
                f"<{pair[0]} fill='black' {' '.join(f'{key}={value!r}' for key, value in pair[1].items())}/>"
            )
        ),
        st.lists(_COMMAND, max_size=6).map(lambda commands: f"<path d='{' '.join(commands)}' stroke='red'/>"),
        _RING.map(lambda ring: f"<polygon points='{' '.join(f'{x},{y}' for x, y in ring)}'/>"),
    ),
    lambda inner: st.tuples(_TRANSFORM, st.lists(inner, max_size=3)).map(
        lambda pair: f"<g id='a' transform='{pair[0]}'>{''.join(pair[1])}<use href='#a'/></g>"[:4000]
    ),
    max_leaves=5,
)
_SVG = st.tuples(_LENGTH, _LENGTH, st.lists(_NUMBER, max_size=4), st.lists(_ELEMENT, max_size=5)).map(
    lambda parts: (
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{parts[0]}' height='{parts[1]}' "
        f"viewBox='{' '.join(map(str, parts[2]))}'>{''.join(parts[3])}</svg>"
    )
)

_GROUP = st.one_of(
    st.tuples(st.sampled_from([10, 11, 20, 21, 40, 41, 42, 50, 51, 70, 90]), _NUMBER),
    st.tuples(st.sampled_from([2, 6, 8]), st.sampled_from(["0", "boundary", "walls", "CHAIR", "*U1", ""])),
)
# fmt: off
_ENTITY = st.tuples(
    st.sampled_from(
        ["LINE", "LWPOLYLINE", "CIRCLE", "ARC", "ELLIPSE", "SPLINE", "INSERT", "POLYLINE", "VERTEX",
            "SEQEND", "HATCH", "POINT"]
    ),
    st.lists(_GROUP, max_size=10),
).map(lambda pair: [(0, pair[0]), *pair[1]])
# fmt: on


def _format_dxf(parts: tuple[list[Any], list[Any]]) -> str:
    block, entities = parts
    groups: list[tuple[int, Any]] = [
        (0, "SECTION"),
        (2, "BLOCKS"),
        (0, "BLOCK"),
        (2, "CHAIR"),
        (10, 0),
        (20, 0),
    ]
    groups += [group for entity in block for group in entity]
    groups += [(0, "ENDBLK"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]
    groups += [group for entity in entities for group in entity]
    groups += [(0, "ENDSEC"), (0, "EOF")]
    return "\n".join(f"{code}\n{value}" for code, value in groups) + "\n"


_GRID = st.tuples(
    st.integers(0, 9), st.integers(0, 9), st.lists(st.text(".@TWSG", max_size=9), max_size=9)
).map(lambda parts: f"type octile\nheight {parts[0]}\nwidth {parts[1]}\nmap\n" + "\n".join(parts[2]))

_SETTING = st.one_of(
    _JUNK.filter(lambda value: value is not None and not isinstance(value, dict)),
    st.lists(st.sampled_from(["rapf", "rpf", "lloyd", "square", "*", "nobody", "none.py:X"]), max_size=3),
)


def _format_toml(value: Any) -> str:
    if isinstance(value, dict):
        return (
            "{" + ", ".join(f"{json.dumps(key)} = {_format_toml(item)}" for key, item in value.items()) + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(map(_format_toml, value)) + "]"
    return json.dumps(value) if value is not None else '""'


# fmt: off
_KEYS = ["maps", "controllers", "robots", "starts", "seeds", "duration", "dt", "lattice", "team.radius",
    "gains.rapf.k_rep"]
# fmt: on
_STUDY = st.dictionaries(st.sampled_from(_KEYS), _SETTING, max_size=5).map(
    lambda settings: (
        "".join(f"{key} = {_format_toml(value)}\n" for key, value in settings.items())
        + ('maps = ["square"]\n' if "maps" not in settings else "")
        + ('controllers = ["rapf"]\n' if "controllers" not in settings else "")
    )
)


def _build_case(name: str, texts: st.SearchStrategy[Any]) -> st.SearchStrategy[Case]:
    return texts.map(
        lambda text: Case({name: text if isinstance(text, bytes) else text.encode("utf-8", "replace")})
    )


_INDOOR_TAGS: list[dict[str, str]] = [
    *({"indoor": kind} for kind in ("room", "corridor", "area", "wall", "column", "yes")),
    *({"indoor": "room", "level": level} for level in ("1", "0;1", "-1-1", "x")),
    *({"building": "yes"}, {"barrier": "wall"}, {"indoor": "area", "room": "stairs"}, {}),
]
_DOORS: list[dict[str, str]] = [{}, {}, {"door": "yes"}, {"door": "yes", "width": "90"}, {"indoor": "column"}]


@st.composite
def _overpass(draw: st.DrawFn) -> dict[str, Any]:
    """Draw ways through few nodes, some of them doors, so that rooms overlap, touch, or have no area."""
    elements: list[Any] = []
    for number, (x, y) in enumerate(draw(st.lists(_NEAR, min_size=1, max_size=9))):
        node = {"type": "node", "id": number, "lat": 48 + y * 1e-5, "lon": 11 + x * 1e-5}
        elements.append({**node, "tags": draw(st.sampled_from(_DOORS))})
    among = st.integers(0, len(elements))
    for number in range(draw(st.integers(1, 5))):
        nodes = draw(st.lists(among, max_size=7))
        closed = [*nodes, *nodes[:1]] if draw(st.booleans()) else nodes
        elements.append(
            {"type": "way", "id": number, "nodes": closed, "tags": draw(st.sampled_from(_INDOOR_TAGS))}
        )
    if draw(st.booleans()):
        members = [{"type": "way", "ref": ref, "role": "outer"} for ref in draw(st.lists(among, max_size=3))]
        tags = {"type": "multipolygon", **draw(st.sampled_from(_INDOOR_TAGS))}
        elements.append({"type": "relation", "id": 1, "members": members, "tags": tags})
    return {"generator": "Overpass API", "elements": elements}


@st.composite
def _venue(draw: st.DrawFn) -> dict[str, Any]:
    """Draw units on a small grid with openings anywhere."""

    def build_geometry(kind: str, points: Any) -> dict[str, Any]:
        return {"type": kind, "coordinates": points}

    def convert_to_degrees(points: Any) -> Any:
        return [[8.4 + x * 1e-5, 49.0 + y * 1e-5] for x, y in points]

    def build_features(kind: str, geometries: list[Any]) -> list[Any]:
        categories = st.sampled_from(["walkway", "office", "stairs", "column", "room", "lobby"])
        return [
            {
                "type": "Feature",
                "id": kind,
                "geometry": each,
                "properties": {"level_id": "a", "category": draw(categories)},
            }
            for each in geometries
        ]

    rings = [
        convert_to_degrees([*ring, *ring[:1]])
        for ring in draw(st.lists(_BOX | st.lists(_NEAR, min_size=1), max_size=5))
    ]
    lines = [
        convert_to_degrees(line)
        for line in draw(st.lists(st.lists(_NEAR, min_size=2, max_size=3), max_size=3))
    ]
    level = {"type": "Feature", "id": "a", "geometry": None, "properties": {"ordinal": 0}}
    return {
        "level": [level],
        "unit": build_features("unit", [build_geometry("Polygon", [ring]) for ring in rings]),
        "opening": build_features("opening", [build_geometry("LineString", line) for line in lines]),
        "fixture": build_features("fixture", [build_geometry("Polygon", [ring]) for ring in rings[:1]]),
    }


def _build_archive(given: dict[str, Any]) -> Case:
    """Return the files that IMDF knows of an altered archive."""
    known = {name: given[name] for name in IMDF if name in given}
    return Case(build_imdf_files(known) or {"unit.geojson": b""})


STRUCTURES: dict[str, st.SearchStrategy[Case]] = {
    "map": _build_case("map.json", _MAP.map(_dump_json)),
    "check": _build_case("map.json", _MAP.map(_dump_json)),
    "study": _build_case("study.toml", _STUDY),
    "movingai": _build_case("plan.map", _GRID),
    "houseexpo": _build_case(
        "plan.json",
        st.fixed_dictionaries({"verts": _RING | _BOX, "id": _JUNK, "room_num": _JUNK}).map(_dump_json),
    ),
    "rings": _build_case("plan.json", (_AREA | st.lists(_AREA, max_size=3) | _RING).map(_dump_json)),
    "wkt": _build_case("plan.wkt", _WKT),
    "geojson": _build_case(
        "plan.geojson",
        (_FEATURES | _geometry() | _altered(GEOJSON, _JUNK | _RING) | _altered(DEGREES, _JUNK | _RING)).map(
            _dump_json
        ),
    ),
    "osm": _build_case("plan.json", (_overpass() | _altered(OVERPASS, _JUNK)).map(_dump_json)),
    "imdf": (_venue() | _altered(IMDF, _JUNK)).map(_build_archive),
    "svg": _build_case("plan.svg", _SVG),
    "dxf": _build_case(
        "plan.dxf", st.tuples(st.lists(_ENTITY, max_size=2), st.lists(_ENTITY, max_size=6)).map(_format_dxf)
    ),
}
"""Strategies by target, for targets that mutations explore too slowly."""
