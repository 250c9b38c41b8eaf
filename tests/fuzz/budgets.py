"""Measure the time and the memory of importing files that are hard to import.

    python tests/fuzz/budgets.py [NAME ...]

The table contains the processor time, the additional memory and the outcome of each file. Each file is
imported in a process of its own.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

REJECTED = (1.0, 200.0)
"""Limits of a rejected file: processor time in s, memory in MB."""

READ = (10.0, 500.0)
"""Limits of a file that is read."""

MAX_CPU_S = 300.0
"""Processor time after which an import is ended."""
MAX_ERROR_CHARS = 300


@dataclass(frozen=True)
class Cost:
    """Cost of an import.

    Attributes
    ----------
    seconds : float, s
        Processor time.
    megabytes : float, MB
        Increase of the peak memory.
    outcome : str
        Reason of the rejection, or number of vertices of the map.
    is_read : bool
        Whether the file was read. Maps without space for a robot are rejected only after that.
    """

    seconds: float
    megabytes: float
    outcome: str
    is_read: bool

    @property
    def share(self) -> float:
        """Fraction of the budget that was used."""
        limits = READ if self.is_read else REJECTED
        max_seconds, max_megabytes = limits
        return max(self.seconds / max_seconds, self.megabytes / max_megabytes)


def build_star(
    points: int, x: float = 0.0, y: float = 0.0, radius: float = 20.0
) -> list[tuple[float, float]]:
    """Return a star in which almost all sides cross each other."""
    angle = np.arange(points) * (points // 2) * math.tau / points
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]).round(3).tolist()


def build_path(ring: list[tuple[float, float]]) -> str:
    """Return a filled path."""
    return '<path d="M' + " ".join(f"{x:g} {y:g}" for x, y in ring) + 'z"/>'


def build_svg(*bodies: str) -> bytes:
    """Return a drawing."""
    return f'<svg xmlns="http://www.w3.org/2000/svg">{"".join(bodies)}</svg>'.encode()


def build_geojson(rings: list[Any]) -> bytes:
    """Return polygons in meters."""
    coordinates = [[[*ring, ring[0]]] for ring in rings]
    return json.dumps({"type": "MultiPolygon", "units": "meters", "coordinates": coordinates}).encode()


def build_wkt(ring: Any) -> bytes:
    """Return a polygon."""
    return f"POLYGON(({','.join(f'{x:.4f} {y:.4f}' for x, y in ring)}))".encode()


def build_comb(teeth: int) -> list[tuple[float, float]]:
    """Return a hall with a number of niches."""
    x = np.arange(teeth) * 0.02
    tooth = [(0.0, 0.0), (0.0, 5.0), (0.01, 5.0), (0.01, 0.0)]
    points = np.stack([np.column_stack([x + dx, np.full(teeth, y)]) for dx, y in tooth], axis=1)
    return [*map(tuple, points.reshape(-1, 2).tolist()), (teeth * 0.02, -3.0), (0.0, -3.0)]


def build_pgm(cells: np.ndarray) -> bytes:
    """Return a binary PGM image."""
    return b"P5 %d %d 255\n" % cells.shape[::-1] + cells.astype(np.uint8).tobytes()


def build_pillars(size: int) -> np.ndarray:
    """Return cells with pillars in every third column of every third row."""
    cells = np.full((size, size), 255)
    cells[1::3, 1::3] = 0
    return cells


def build_noise(size: int, share: float) -> np.ndarray:
    """Return cells, a random fraction of which is blocked."""
    return np.where(np.random.default_rng(0).random((size, size)) < share, 0, 255)


def build_white_png(size: int) -> bytes:
    """Return a white PNG image."""
    import io

    from PIL import Image

    file = io.BytesIO()
    Image.new("L", (size, size), 255).save(file, "PNG", compress_level=1)
    return file.getvalue()


def build_squares(size: int) -> list[list[tuple[float, float]]]:
    """Return squares that touch at their corners, as on a chess board."""
    return [
        [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
        for x in range(size)
        for y in range(size)
        if (x + y) % 2
    ]


def build_wavy_room(count: int) -> np.ndarray:
    """Return a round room with a wavy wall of a number of vertices."""
    angle = np.arange(count) * math.tau / count
    radius = 300 + 0.5 * np.sin(angle * count / 40)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def build_rooms(size: int) -> bytes:
    """Return cells with walls in every 16th row and column, and a door in each wall."""
    cells = np.full((size, size), 255)
    cells[::16] = cells[:, ::16] = 0
    cells[::16, 7::16] = cells[::16, 8::16] = cells[7::16, ::16] = cells[8::16, ::16] = 255
    cells[0] = cells[:, 0] = 0
    return build_pgm(cells)


def build_rectangles(count: int) -> bytes:
    """Return an SVG drawing with a number of desks."""
    side = math.isqrt(count) + 1
    desks = (f'<rect x="{2 * (k % side)}" y="{2 * (k // side)}" width="1" height="1"/>' for k in range(count))
    return build_svg(
        f'<rect id="boundary" x="-1" y="-1" width="{2 * side + 2}" height="{2 * side + 2}"/>', *desks
    )


def build_lines(count: int) -> bytes:
    """Return a DXF drawing with a number of separate walls."""
    side = math.isqrt(count) + 1
    text = ["0", "SECTION", "2", "ENTITIES"]
    for k in range(count):
        x = 2 * (k % side)
        y = 2 * (k // side)
        text += ["0", "LINE", "8", "walls", "10", f"{x}", "20", f"{y}", "11", f"{x + 1}", "21", f"{y + 0.5}"]
    return "\n".join([*text, "0", "ENDSEC", "0", "EOF", ""]).encode()


CASES: dict[str, tuple[str, Callable[[], bytes]]] = {
    "four stars of 201 points": (
        "stars.svg",
        lambda: build_svg(*(build_path(build_star(201, 45 * k)) for k in range(4))),
    ),
    "four of 201 on each other": (
        "starred.svg",
        lambda: build_svg(*(build_path(build_star(201, k)) for k in range(4))),
    ),
    "a star of 241 points": ("star.svg", lambda: build_svg(build_path(build_star(241)))),
    "a star of 241 points, WKT": ("star.wkt", lambda: build_wkt(build_star(241))),
    "a comb of 40,000 teeth": ("comb.wkt", lambda: build_wkt(build_comb(40_000))),
    "a comb of 12,000 teeth": ("short.wkt", lambda: build_wkt(build_comb(12_000))),
    "a comb of 4,000 teeth": ("shorter.wkt", lambda: build_wkt(build_comb(4_000))),
    "111,000 pillars": ("pillars.pgm", lambda: build_pgm(build_pillars(1000))),
    "7,900 pillars": ("some.pgm", lambda: build_pgm(build_pillars(267))),
    "140 x 140 squares that touch at corners": ("squares.geojson", lambda: build_geojson(build_squares(140))),
    "440 x 440 squares that touch at corners": ("board.geojson", lambda: build_geojson(build_squares(440))),
    "a white picture of 8000 x 8000": ("white.png", lambda: build_white_png(8000)),
    "noise on 1000 x 1000 cells, 5%": ("sparse.pgm", lambda: build_pgm(build_noise(1000, 0.05))),
    "noise on 700 x 700 cells, 40%": ("dense.pgm", lambda: build_pgm(build_noise(700, 0.4))),
    "rooms on 4000 x 4000 cells": ("rooms.pgm", lambda: build_rooms(4000)),
    "rooms on 1200 x 1200 cells": ("flats.pgm", lambda: build_rooms(1200)),
    "a wall of 490,000 vertices": ("wavy.wkt", lambda: build_wkt(build_wavy_room(490_000))),
    "7,900 desks": ("desks.svg", lambda: build_rectangles(7_900)),
    "90,000 desks": ("many.svg", lambda: build_rectangles(90_000)),
    "7,900 lines, DXF": ("lines.dxf", lambda: build_lines(7_900)),
    "49,000 lines, DXF": ("many.dxf", lambda: build_lines(49_000)),
    "100,000 lines, DXF": ("more.dxf", lambda: build_lines(100_000)),
}
"""File name and content of each case."""


def measure_cases(names: list[str], seconds: float = MAX_CPU_S) -> Iterator[tuple[str, Cost]]:
    """Yield the cost of each case. Imports that take more than some seconds of processor time are ended."""
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            file_name, build_content = CASES[name]
            path = Path(folder) / file_name
            path.write_bytes(build_content())
            process = subprocess.run(
                [sys.executable, __file__, "--read", str(path), "--seconds", str(seconds)],
                capture_output=True,
                text=True,
                check=False,
            )
            path.unlink()
            if process.returncode == 0:
                yield name, Cost(**json.loads(process.stdout))
            else:
                errors = process.stderr or f"status {process.returncode}"
                yield name, Cost(math.inf, math.inf, errors[-MAX_ERROR_CHARS:], True)


def read(path: Path, seconds: float) -> Cost:
    """Import a file in this process, and return its cost."""
    import resource

    from robocov.errors import RobocovError
    from robocov_app.formats import ReadOptions, Shaping, build_environment, detect_format, import_map

    # Small files load the modules of the importers, whose cost is not that of the file.
    small_files = (
        ("small.wkt", "POLYGON((0 0,9 0,9 9,0 9,0 0))", ReadOptions()),
        ("small.pgm", "P2 3 1 1 1 1 1", ReadOptions(cell=1.0)),
        ("small.dxf", build_lines(2).decode(), ReadOptions(scale=1.0)),
    )
    for name, text, small_options in small_files:
        small_path = path.with_name(name)
        small_path.write_text(text)
        import_map(small_path, options=small_options)
    importer = detect_format(path)
    options = ReadOptions(**{name: 1.0 for name in ("cell", "scale") if name in importer.options})
    if importer.name == "image":
        options = ReadOptions(cell=0.1)
    initial_mb = read_peak_mb()
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
    start_time = time.process_time()
    is_read = False
    try:
        foreign = importer.read(path, options)
        is_read = True
        _, report = build_environment(foreign, Shaping(), path.name)
        outcome = f"{report.vertices_kept} vertices"
    except RobocovError as error:
        outcome = f"rejected: {str(error).partition(': ')[2]}"
        if importer.name == "dxf" and " shapes" in outcome:
            # The shapes are counted after ezdxf has read the file.
            is_read = True
    elapsed = time.process_time() - start_time
    return Cost(elapsed, read_peak_mb() - initial_mb, outcome, is_read)


def read_peak_mb() -> float:
    """Return the peak memory of this process, MB. Works on Linux only."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


def main() -> int:
    """Print the table, and return 1 if a file exceeds its budget."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases to measure (default: all)")
    parser.add_argument("--seconds", type=float, default=MAX_CPU_S, help="maximum processor time of each, s")
    parser.add_argument("--read", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read is not None:
        print(json.dumps(vars(read(arguments.read, arguments.seconds))))
        return 0
    print(f"{'CPU s':>7} {'MB':>6}")
    max_share = 0.0
    for name, cost in measure_cases(arguments.names or list(CASES), arguments.seconds):
        print(f"{cost.seconds:7.2f} {cost.megabytes:6.0f}  {name}: {cost.outcome}", flush=True)
        max_share = max(max_share, cost.share)
    return int(max_share > 1.0)


if __name__ == "__main__":
    sys.exit(main())
