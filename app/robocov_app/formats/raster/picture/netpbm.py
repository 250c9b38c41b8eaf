"""Decoding PGM and PPM: https://netpbm.sourceforge.net/doc/pgm.html.

Pillow is not used for them: it scales other maximum values than 255 to it by rounding, which changes what the
thresholds of ROS give, and takes half a second for a million pixels.
"""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocov.errors import MapError, quote
from robocov_app.formats import files
from robocov_app.formats.colors import ColorKey
from robocov_app.formats.raster.picture.brightness import (
    STRIP_ROWS,
    Brightness,
    choose_thumbnail_step,
    to_rgb,
)

_PIECE_BYTES = 1 << 20
"""Number of bytes of plain text that are parsed at a time."""
_BLANK = re.compile(rb"(?:[ \t\r\n\v\f]|#[^\r\n]*[\r\n])+")
"""Separator of the numbers in a header: white space or a comment."""
_DIGITS = re.compile(rb"\d+")
_MAX_NUMBER_DIGITS = 9
_MAX_LEVEL = 65535


def decode_netpbm(data: bytes, where: str, key: ColorKey) -> Brightness:
    """Decode a PGM or PPM, raw or plain.

    Parameters
    ----------
    data : bytes
    where : str
        Name of the file for messages.
    key : ColorKey
        Colors whose roles are needed.

    Raises
    ------
    MapError
        If the picture is broken or too large.
    """
    width, height, maximum, at = _parse_header(data, where)
    channels = 3 if data[1:2] in b"36" else 1
    count = width * height * channels
    if data[1:2] in b"56":
        levels: Any = _decode_raw(data, at, count, maximum, channels, where)
    else:
        levels = _parse_plain(data[at:], count, where)
    highest = int(levels.max())
    if highest > maximum:
        raise MapError(f"{where}: expected at most {maximum}, the largest value, got a pixel of {highest}")
    pixels = levels.reshape(height, width, channels)
    roles = np.zeros((height, width), np.uint8) if key else None
    pieces = []
    step = choose_thumbnail_step(width, height)
    for top in range(0, height, STRIP_ROWS):
        strip = pixels[top : top + STRIP_ROWS]
        if roles is not None:
            roles[top : top + STRIP_ROWS] = key.classify(to_rgb(strip, maximum))
        pieces.append(to_rgb(strip[::step, ::step], maximum))
    thumbnail = np.concatenate(pieces)
    if channels == 1:
        return Brightness(pixels[:, :, 0], maximum, roles=roles, thumbnail=thumbnail)
    total = pixels.sum(axis=2, dtype=np.uint32)
    return Brightness(total, 3 * maximum, roles=roles, thumbnail=thumbnail)


def _parse_header(data: bytes, where: str) -> tuple[int, int, int, int]:
    """Return the width, the height, the largest value, and where the header ends."""
    numbers = []
    at = 2
    for name in ("width", "height", "largest value"):
        blank = _BLANK.match(data, at)
        start = blank.end() if blank else at
        digits = _DIGITS.match(data, start) if blank else None
        if digits is None or len(digits[0]) > _MAX_NUMBER_DIGITS:
            actual = quote(data[start:][:12])
            raise MapError(f"{where}: {name}: expected a whole number, got {actual}")
        numbers.append(int(digits[0]))
        at = digits.end()
    width, height, maximum = numbers
    files.require_cells(width, height, where)
    if not 1 <= maximum <= _MAX_LEVEL:
        raise MapError(f"{where}: largest value: expected a number from 1 to {_MAX_LEVEL}, got {maximum}")
    return width, height, maximum, at


def _decode_raw(data: bytes, at: int, count: int, maximum: int, channels: int, where: str) -> Any:
    """Return `count` levels of one or two bytes each; what comes after the picture is ignored."""
    raw = np.dtype(np.uint8 if maximum < 256 else ">u2")
    size = count * raw.itemsize
    # One blank ends the header, or a line end of two bytes.
    has_long_line_end = data[at : at + 2] == b"\r\n" and len(data) - at - 2 >= size
    at += 2 if has_long_line_end else 1
    if len(data) - at < size:
        complete = max(0, len(data) - at) // raw.itemsize
        raise MapError(f"{where}: cut off after {complete // channels} of {count // channels} pixels")
    return np.frombuffer(data, raw, count, at).astype(raw.newbyteorder("="), copy=False)


def _parse_plain(text: bytes, count: int, where: str) -> NDArray[np.uint16]:
    """Return `count` levels that are written as text."""
    shortest = 2 * count - 1  # a digit and a blank for each
    if len(text) < shortest:
        raise MapError(f"{where}: cut off: {len(text)} bytes are too few for {count} pixels")
    if b"#" in text:
        text = re.sub(rb"#[^\r\n]*", b" ", text)
    values = np.empty(count, np.uint16)
    done = 0
    at = 0
    while done < count and at < len(text):
        blank = _BLANK.search(text, at + _PIECE_BYTES)
        end = blank.start() if blank else len(text)
        numbers = files.parse_integers(text[at:end], " ")
        at = blank.end() if blank else len(text)
        if numbers is None:
            raise MapError(f"{where}: pixels that are not whole numbers, of {count}")
        numbers = numbers[: count - done]
        invalid = numbers[(numbers < 0) | (numbers > _MAX_LEVEL)]
        if len(invalid):
            worst = min(invalid) if min(invalid) < 0 else max(invalid)
            raise MapError(f"{where}: expected a number from 0 to {_MAX_LEVEL}, got a pixel of {worst}")
        values[done : done + len(numbers)] = numbers
        done += len(numbers)
    if done < count:
        raise MapError(f"{where}: cut off after {done} of {count} pixels")
    return values
