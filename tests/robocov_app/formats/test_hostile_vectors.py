"""Hostile files that would take forever or all memory: rejected at once, in one line."""

import base64
import json
import subprocess
import sys
import zlib
from pathlib import Path

import ezdxf
import numpy as np
import pytest

MB = 1_000_000
SECONDS = 4.0
"""CPU time: four times the documented limit (twice for files of 50 MB), because machines are busy."""


def _build_knot(count: int) -> list[list[float]]:
    return np.random.default_rng(0).random((count, 2)).round(3).tolist()


def _build_svg(body: str) -> bytes:
    return f'<svg xmlns="http://www.w3.org/2000/svg">{body}</svg>'.encode()


def _build_billion_laughs() -> bytes:
    entities = "".join(f'<!ENTITY l{k + 1} "{f"&l{k};" * 10}">' for k in range(9))
    return f'<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY l0 "lol">{entities}]><svg>&l9;</svg>'.encode()


def _uses(levels: int) -> bytes:
    groups = "".join(f'<g id="g{k + 1}">' + f'<use href="#g{k}"/>' * 10 + "</g>" for k in range(levels))
    return _build_svg(f'<defs><path id="g0" d="M0 0h1v1z"/>{groups}</defs><use href="#g{levels}"/>')


def _build_blocks(folder: Path, levels: int) -> bytes:
    document = ezdxf.new()
    document.blocks.new("b0").add_line((0, 0), (1, 1))
    for k in range(levels):
        block = document.blocks.new(f"b{k + 1}")
        for _ in range(10):
            block.add_blockref(f"b{k}", (0, 0))
    document.modelspace().add_blockref(f"b{levels}", (0, 0))
    document.saveas(folder / "made.dxf")
    return (folder / "made.dxf").read_bytes()


def _build_tmx(body: str, size: int = 4) -> bytes:
    sides = f'width="{size}" height="{size}" tilewidth="8" tileheight="8"'
    return f'<map {sides}><layer name="walls" width="{size}" height="{size}">{body}</layer></map>'.encode()


def _build_macros(levels: int) -> bytes:
    """Return a world of Stage in which each macro is ten of the next."""
    calls = "".join(f"define m{k} model ( {f'm{k + 1} ( ) ' * 10} )\n" for k in range(levels))
    return f"{calls}m0 ( )".encode()


def _build_files(folder: Path) -> dict[str, bytes]:
    head = b"0\nSECTION\n2\nENTITIES\n"
    circle = b"0\nCIRCLE\n8\n0\n10\n0\n20\n0\n40\n9e6\n"
    knot = _build_knot(5000)
    ring = ",".join(f"{x} {y}" for x, y in knot)
    return {
        "lol.svg": _build_billion_laughs(),
        "uses.svg": _uses(9),
        "loop.svg": _build_svg('<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g>'),
        "deep.svg": b"<svg>" + b"<g>" * 500_000,
        "many.svg": _build_svg("<g/>" * 1_000_000),
        "attributes.svg": b"<svg " + b" ".join(b"a%d='1'" % k for k in range(1_100_000)) + b"/>",
        "path.svg": _build_svg(f'<path d="M0 0{"l1 1" * (10 * MB)}"/>'),
        "arcs.svg": _build_svg('<path d="M0 0' + "A1e7 1e7 0 1 1 0 1A1e7 1e7 0 1 0 0 0" * 5000 + 'z"/>'),
        "circles.svg": _build_svg('<circle r="9e6"/>' * 50_000),
        "knot.svg": _build_svg('<path d="M' + " ".join(f"{x} {y}" for x, y in knot) + 'z"/>'),
        "knots.svg": _build_svg(
            '<path fill="none" stroke="red" d="M' + " ".join(f"{x} {y}" for x, y in knot) + '"/>'
        ),
        "rules.svg": _build_svg("<style>" + "*{fill:red}" * 9000 + "</style>" + "<rect/>" * 90_000),
        "digits.svg": _build_svg(f'<rect width="{"1" * MB}!" height="1"/>'),
        "spaces.svg": _build_svg(f'<rect width="1{" " * MB}!" height="1"/>'),
        "style.svg": _build_svg("<style>" + "x" * (MB - 10) + "</style>"),
        "comments.svg": _build_svg("<style>" + "/*" * (MB // 2 - 10) + "</style>"),
        "important.svg": _build_svg("<style>a{b:" + " " * (MB - 50) + "x}</style>"),
        "huge.svg": _build_svg('<rect width="1e300" height="1e300"/>'),
        "scales.svg": _build_svg(
            '<g transform="scale(1e25)">' * 20 + '<rect width="1" height="1"/>' + "</g>" * 20
        ),
        "vertices.wkt": b"POLYGON((" + b"0 0," * (12 * MB) + b"0 0))",
        "deep.wkt": b"GEOMETRYCOLLECTION(" * 200_000,
        "knot.wkt": f"POLYGON(({ring}))".encode(),
        "knots.wkt": f"LINESTRING({ring})".encode(),
        "nan.wkt": b"POLYGON((0 0, nan 0, 1 1, 0 0))",
        "huge.wkt": b"POLYGON((0 0, 1e300 0, 1 1, 0 0))",
        "spaces.wkt": b"POLYGON((" + b" " * (49 * MB),
        "words.wkt": b"POINT" * MB,
        "vertices.geojson": b'{"type":"Polygon","coordinates":[[' + b"[0,0]," * (8 * MB) + b"[0,0]]]}",
        "numbers.geojson": b'{"type":"Polygon","coordinates":[' + b"0," * (4 * MB) + b"0]}",
        "deep.geojson": b'{"type":"Polygon","coordinates":' + b"[" * 400_000,
        "objects.geojson": b'{"type":"Polygon","x":' + b'{"a":' * 500_000,
        "knot.geojson": json.dumps({"type": "Polygon", "coordinates": [knot]}).encode(),
        "far.geojson": b'{"type":"Polygon","units":"meters","coordinates":[[[0,0],[1e99,0],[1,1]]]}',
        "knot.json": json.dumps([knot]).encode(),
        "plan.json": json.dumps({"verts": knot}).encode(),
        "vertices.json": b'{"verts":[' + b"[0,0]," * MB + b"[0,0]]}",
        "bomb.tmx": _build_tmx(
            '<data encoding="base64" compression="zlib">'
            + base64.b64encode(zlib.compress(bytes(500 * MB // 2), 9)).decode()
            + "</data>"
        ),
        "wide.tmx": _build_tmx('<data encoding="csv">1</data>', 10**9),
        "chunks.tmx": _build_tmx(
            '<data encoding="csv">'
            + "".join(f'<chunk x="{x}" y="{x}" width="1" height="1">1</chunk>' for x in (-(10**7), 10**7))
            + "</data>"
        ).replace(b"<map", b'<map infinite="1"'),
        "numbers.tmx": _build_tmx(f'<data encoding="csv">{"1," * (20 * MB)}1</data>'),
        "rough.tmx": _build_tmx(f'<data encoding="csv">{",".join(("01" * MB)[: 1413**2])}</data>', 1413),
        "macros.world": _build_macros(30),
        "words.world": b"model ( a 1 ) " * (MB // 3),
        "deep.world": b"model ( " * (MB // 2),
        "blank.world": b"#\n" * (5 * MB // 2),
        "include.world": b'include "include.world"\n' * 1000,
        "points.world": b"model ( block ( "
        + b" ".join(b"point[%d] [%d 1]" % (k, k) for k in range(100_000))
        + b" ) )",
        "placed.argos": b'<argos-configuration><arena size="9,9,1"><distribute><position method="constant" '
        b'values="0,0,0"/><orientation method="constant" values="0,0,0"/><entity quantity="2000000000">'
        b'<box size="1,1,1" id="b"/></entity></distribute></arena></argos-configuration>',
        "far.argos": b'<argos-configuration><arena size="1e300,1,1"/></argos-configuration>',
        "number.yaml": b"world: {}\nobstacle: [{number: 100000000}]",
        "deep.yaml": b"world:\n" + b"[" * 200_000,
        "keys.yaml": b"world: {" + b"{a: 1}, " * 30_000,
        "knot.yaml": b"world: {}\nobstacle: {shape: {name: polygon, vertices: "
        + json.dumps(knot).encode()
        + b"}}",
        "blocks.dxf": _build_blocks(folder, 9),
        "towers.dxf": _build_blocks(folder, 31),
        "vertices.dxf": head + b"10\n0\n20\n0\n" * MB,
        "lines.dxf": head + b"1\n\n" * (9 * MB),
        "circles.dxf": head + circle * 5_000 + b"0\nENDSEC\n0\nEOF\n",
        "knot.dxf": head
        + b"0\nLWPOLYLINE\n5\n1F\n8\n0\n100\nAcDbEntity\n100\nAcDbPolyline\n90\n%d\n70\n1\n" % len(knot)
        + b"".join(b"10\n%g\n20\n%g\n" % (x, y) for x, y in knot)
        + b"0\nENDSEC\n0\nEOF\n",
    }


@pytest.mark.slow
def test_hostile_files_are_rejected_within_seconds_and_200_mb(tmp_path: Path) -> None:
    files = _build_files(tmp_path)
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        assert len(content) <= 52 * MB
    script = Path(__file__).with_name("hostile_files.py")
    done = subprocess.run(
        [sys.executable, str(script), *(str(tmp_path / name) for name in files)],
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stderr == ""
    answer = json.loads(done.stdout)
    for name, (seconds, message) in answer["files"].items():
        assert message.startswith(str(tmp_path / name)), f"{name}: {message}"
        assert "\n" not in message
        assert len(message) < 500
        assert seconds < SECONDS, f"{name}: {seconds:.2f} s"
    assert answer["grown_mb"] < 200, answer["grown_mb"]


@pytest.mark.parametrize("size", [51, 60])
def test_files_beyond_50_mb_are_not_opened(tmp_path: Path, size: int) -> None:
    from robocov.errors import MapError
    from robocov_app.formats import IMPORTERS, ReadOptions

    for kind in ("svg", "wkt", "geojson", "dxf", "rings", "houseexpo"):
        path = tmp_path / f"large{IMPORTERS[kind].suffixes[0]}"
        with path.open("wb") as file:
            file.truncate(size * MB)
        with pytest.raises(MapError, match="expected at most 50 MB, got more"):
            IMPORTERS[kind].read(path, ReadOptions())
        path.unlink()
