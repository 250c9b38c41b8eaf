"""Small grids and the files that hold them, drawn for the tests."""

import struct
import zlib
from pathlib import Path

import numpy as np

FREE = 254
UNKNOWN = 205
OCCUPIED = 0
"""What map savers write."""

PLAN = """
????????????????
?##############?
?#......#.....#?
?#......#.....#?
?#............#?
?#............#?
?#......#.....#?
?#......#.....#?
?##############?
????????????????
"""
"""Two rooms of 6 x 6 and 5 x 6 cells with a door of two: wall #, unknown ?."""

VALUES = {".": FREE, "?": UNKNOWN, "#": OCCUPIED}


def draw_pixels(text: str, values: dict[str, int] = VALUES) -> np.ndarray:
    """Return the pixels of a drawing, the top row first."""
    return np.array([[values[letter] for letter in line] for line in text.split()], dtype=np.uint8)


def build_pgm(pixels: np.ndarray, most: int = 255, head: str = "# drawn for a test\n") -> bytes:
    rows, columns = pixels.shape
    kind = np.uint8 if most < 256 else ">u2"
    return f"P5\n{head}{columns} {rows}\n{most}\n".encode() + pixels.astype(kind).tobytes()


def write_ros_map(
    folder: Path, pixels: np.ndarray | bytes, name: str = "plan", image: str | None = None, **keys: object
) -> Path:
    """Write a ROS map; return its YAML. Keys replace those of the YAML, None takes them out."""
    if image is None:
        image = f"{name}.pgm"
        (folder / image).write_bytes(pixels if isinstance(pixels, bytes) else build_pgm(pixels))
    given = {
        "image": image, "resolution": 0.25, "origin": [0.0, 0.0, 0.0], "negate": 0,
        "occupied_thresh": 0.65, "free_thresh": 0.196,
    } | keys  # fmt: skip
    path = folder / f"{name}.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in given.items() if value is not None))
    return path


def build_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def encode_png(width: int, height: int, bits: int, colors: int, rows: bytes, interlaced: int = 0) -> bytes:
    """Return a PNG of rows that are ready, filter bytes and all."""
    head = struct.pack(">IIBBBBB", width, height, bits, colors, 0, 0, interlaced)
    return (
        b"\x89PNG\r\n\x1a\n"
        + build_chunk(b"IHDR", head)
        + build_chunk(b"IDAT", zlib.compress(rows))
        + build_chunk(b"IEND", b"")
    )
