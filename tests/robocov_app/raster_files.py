"""Small occupancy grids, and files with them."""

import struct
import zlib
from pathlib import Path

import numpy as np

FREE = 254
UNKNOWN = 205
OCCUPIED = 0
"""Values that map savers write."""

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
"""Two rooms of 6 x 6 and 5 x 6 cells with a door of two cells; # is a wall, and ? is unknown."""

VALUES = {".": FREE, "?": UNKNOWN, "#": OCCUPIED}


def draw_pixels(text: str, values: dict[str, int] = VALUES) -> np.ndarray:
    """Return the pixels of a text drawing, starting with the top row."""
    return np.array([[values[character] for character in line] for line in text.split()], dtype=np.uint8)


def build_pgm(pixels: np.ndarray, max_value: int = 255, head: str = "# drawn for a test\n") -> bytes:
    """Return a binary PGM image."""
    rows, columns = pixels.shape
    dtype = np.uint8 if max_value < 256 else ">u2"
    return f"P5\n{head}{columns} {rows}\n{max_value}\n".encode() + pixels.astype(dtype).tobytes()


def write_ros_map(
    folder: Path, pixels: np.ndarray | bytes, name: str = "plan", image: str | None = None, **keys: object
) -> Path:
    """Write a ROS map, and return the path of its YAML file.

    Further keys replace those of the YAML; None removes a key.
    """
    if image is None:
        image = f"{name}.pgm"
        (folder / image).write_bytes(pixels if isinstance(pixels, bytes) else build_pgm(pixels))
    document = {
        "image": image,
        "resolution": 0.25,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
        **keys,
    }
    path = folder / f"{name}.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in document.items() if value is not None))
    return path


def build_chunk(kind: bytes, data: bytes) -> bytes:
    """Return a chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def encode_png(width: int, height: int, bits: int, colors: int, rows: bytes, interlaced: int = 0) -> bytes:
    """Return a PNG. The rows include their filter bytes."""
    head = struct.pack(">IIBBBBB", width, height, bits, colors, 0, 0, interlaced)
    return (
        b"\x89PNG\r\n\x1a\n"
        + build_chunk(b"IHDR", head)
        + build_chunk(b"IDAT", zlib.compress(rows))
        + build_chunk(b"IEND", b"")
    )
