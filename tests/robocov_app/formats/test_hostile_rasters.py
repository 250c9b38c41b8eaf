"""Hostile files: each is rejected in one line, within a second and 200 MB, in a process of its own."""

import io
import json
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from raster_files import PLAN, build_chunk, build_pgm, draw_pixels, encode_png

MEMORY = 200 * 2**20
SECONDS = 3.0
"""CPU time: three times the documented limit, because machines are busy."""

WATCHED = """
import json, re, sys, time
from pathlib import Path
from robocov.errors import RobocovError
from robocov_app.formats import import_map, ReadOptions
import PIL.PngImagePlugin, yaml

def import_map_file(path, cell):
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    began = time.process_time()
    try:
        import_map(Path(path), options=ReadOptions(cell=cell))
    except RobocovError as error:
        answer = str(error)
    else:
        answer = "accepted"
    status = Path("/proc/self/status").read_text()
    return answer, time.process_time() - began, 1024 * int(re.search(r"VmHWM:\\s*(\\d+) kB", status)[1])

print(json.dumps([import_map_file(path, cell) for path, cell in json.loads(sys.argv[1])]))
"""


def measure_import(files: list[tuple[Path, float | None]]) -> list[tuple[str, float, int]]:
    """Import files in another process; return the message and seconds of each, and the peak in bytes."""
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, json.dumps([(str(path), cell) for path, cell in files])],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-500:]
    return [(answer, seconds, memory) for answer, seconds, memory in json.loads(done.stdout)]


def write_sparse_file(path: Path, head: bytes, size: int) -> Path:
    with path.open("wb") as file:
        file.write(head)
        file.truncate(size)
    return path


def build_text_bomb() -> bytes:
    """Return a PNG whose text unpacks to 40 MB."""
    packed = zlib.compress(b"a" * 40_000_000)
    good = encode_png(4, 4, 8, 0, (b"\0" + b"\xff" * 4) * 4)
    return good[:33] + build_chunk(b"zTXt", b"Comment\0\0" + packed) + good[33:]


def paint(kind: str, side: int, keep: int | None = None, **options: object) -> bytes:
    """Return a white picture, complete or only its first bytes."""
    stream = io.BytesIO()
    Image.new("1" if options.get("compression") == "group4" else "L", (side, side), 255).save(
        stream, kind, **options
    )
    return stream.getvalue()[:keep]


def write_header(data: bytes, old: int, new: int) -> bytes:
    """Return an image whose header contains another size."""
    form = ">H" if data.startswith(b"\xff") else "<H"
    return data.replace(struct.pack(form, old), struct.pack(form, new))


def build_deep_yaml() -> bytes:
    return b"image: a.pgm\nresolution: 1\norigin: " + b"[" * 30_000


def build_yaml_bomb() -> bytes:
    lines = [b"image: a.pgm", b"resolution: 1", b"a: &a [lol, lol, lol, lol, lol, lol, lol, lol, lol]"]
    lines += [b"%c: &%c [%s]" % (k, k, b", ".join([b"*%c" % (k - 1)] * 9)) for k in range(98, 107)]
    return b"\n".join(lines)


TOO_MANY = "at most 64 million"
CHESS_BOARD = 255 * (np.indices((2500, 2500)).sum(axis=0) % 2)
GRID = b"type octile\nheight %d\nwidth %d\nmap\n"

HOSTILE: dict[str, tuple[str, Callable[[], bytes] | None, str, str]] = {
    # Name: (file, content, options, part of the message).
    "pixels of a bomb": ("a.png", lambda: encode_png(20_000, 20_000, 8, 6, b"\0" * 10**7), "cell", TOO_MANY),
    "GBs of pixels": ("a.png", lambda: encode_png(8000, 8000, 16, 6, b"\0" * 10**7), "cell", "truncated"),
    "more than it says": ("a.png", lambda: encode_png(10, 10, 8, 0, b"\0" * 4 * 10**7), "cell", "no cell is"),
    "text": ("a.png", build_text_bomb, "cell", "expected a complete PNG"),
    "10^9 cells": ("a.pgm", lambda: b"P5 31623 31623 255\n" + b"\xff" * 1000, "cell", TOO_MANY),
    "10^9 plain cells": ("a.pgm", lambda: b"P2 1 999999999 255\n" + b"1 " * 1000, "cell", TOO_MANY),
    "cut off": ("a.pgm", lambda: b"P5 8000 8000 65535\n" + b"\xff" * 1000, "cell", "pixels, got 500"),
    "a grid of 10^9": ("a.map", lambda: GRID % (31623, 31623), "", TOO_MANY),
    "a grid cut off": ("a.map", lambda: GRID % (8000, 8000) + b"." * 9000, "", "9000 characters"),
    "noise": ("a.pgm", lambda: build_pgm(CHESS_BOARD), "cell", "vertices"),
    "10^9 of a JPEG": ("a.jpg", lambda: write_header(paint("JPEG", 997), 997, 31_623), "cell", TOO_MANY),
    "a JPEG cut off": ("a.jpg", lambda: write_header(paint("JPEG", 997), 997, 8000), "cell", "complete JPEG"),
    "a BMP cut off": ("a.bmp", lambda: write_header(paint("BMP", 997), 997, 8000), "cell", "complete BMP"),
    "a TIFF cut off": (
        "a.tif", lambda: paint("TIFF", 4000, 9000, compression="packbits"), "cell", "complete TIFF"
    ),
    "10^9 of a TIFF": ("a.tif", lambda: write_header(paint("TIFF", 997), 997, 31_623), "cell", TOO_MANY),
    "a TIFF of nothing": (
        "a.tif",
        lambda: write_header(paint("TIFF", 997, compression="tiff_lzw"), 997, 8000),
        "cell",
        "complete TIFF",
    ),
    "a wide TIFF": (
        "a.tif",
        lambda: write_header(paint("TIFF", 997, compression="group4"), 997, 8000),
        "cell",
        "complete TIFF",
    ),
    "a PPM cut off": ("a.ppm", lambda: b"P6 8000 8000 255\n" + b"\xff" * 1000, "cell", "pixels, got 333"),
    "a PBM cut off": ("a.pbm", lambda: b"P1 8000 8000\n" + b"1 " * 1000, "cell", "complete PPM"),
    "laughs": ("a.yaml", build_yaml_bomb, "", "expected at most 50000 values, including those of aliases"),
    "depth": ("a.yaml", build_deep_yaml, "", "nested too deeply"),
    "a large yaml": ("a.yaml", lambda: b"image: a\nresolution: 1\n" + b"# " * 10**7, "", "most 0.262 MB"),
    "a terabyte": ("a.pgm", None, "cell", "expected at most 256 MB"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="memory is measured by /proc")
def test_hostile_rasters_are_rejected(tmp_path: Path) -> None:
    files: list[tuple[Path, float | None]] = []
    for name, (file, content, options, _) in HOSTILE.items():
        folder = tmp_path / name.replace("^", "")
        folder.mkdir()
        (folder / "a.pgm").touch()
        if content is None:
            write_sparse_file(folder / file, b"P5 4000 4000 255\n", 10**12)
        else:
            (folder / file).write_bytes(content())
        files.append((folder / file, 1.0 if options == "cell" else None))
    for (name, case), (path, _), (answer, seconds, memory) in zip(
        HOSTILE.items(), files, measure_import(files), strict=True
    ):
        assert case[3] in answer, name
        assert answer.startswith(str(path)), name
        assert "\n" not in answer, name
        assert seconds < SECONDS, name
        assert memory < MEMORY, name


@pytest.mark.slow
def test_a_valid_raster_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.pgm"
    path.write_bytes(build_pgm(draw_pixels(PLAN)))
    ((answer, _, memory),) = measure_import([(path, 1.0)])
    assert answer == "accepted"
    assert memory < MEMORY
