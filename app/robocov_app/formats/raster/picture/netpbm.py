"""Decoding PGM and PPM: https://netpbm.sourceforge.net/doc/pgm.html.

Pillow is not used for these formats. It rescales pixels whose maximum is not 255, with rounding that changes
the result of ROS's thresholds, and it takes half a second for a million pixels.
"""

import re
from typing import Any, NamedTuple

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
"""Number of bytes of a plain (text) file that are parsed at a time."""
_BLANK = re.compile(rb"(?:[ \t\r\n\v\f]|#[^\r\n]*[\r\n])+")
"""Separator of the numbers in a header: white space or a comment."""
_DIGITS = re.compile(rb"\d+")
_MAX_NUMBER_DIGITS = 9
_MAX_LEVEL = 65535


def decode_netpbm(data: bytes, source_name: str, key: ColorKey) -> Brightness:
    """Decode a PGM or PPM, whose levels may be binary ("raw") or text ("plain").

    Parameters
    ----------
    data : bytes
    source_name : str
        Name of the file for messages.
    key : ColorKey
        Declared colors, whose roles are found in the picture.

    Raises
    ------
    MapError
        If the picture is damaged or too large.
    """
    header = _parse_header(data, source_name)
    maximum = header.maximum
    if data[1:2] in b"56":  # P5 and P6 are binary, P2 and P3 are text
        levels: Any = _decode_raw(data, header, source_name)
    else:
        levels = _parse_plain(data, header, source_name)
    highest = int(levels.max())
    if highest > maximum:
        expected = f"expected pixels of at most {maximum} (the maximum in the header)"
        raise MapError(f"{source_name}: {expected}, got {highest}")
    pixels = levels.reshape(header.height, header.width, header.channels)
    roles = None
    if key:
        roles = np.zeros((header.height, header.width), np.uint8)
    pieces = []
    step = choose_thumbnail_step(header.width, header.height)
    for top in range(0, header.height, STRIP_ROWS):
        strip = pixels[top : top + STRIP_ROWS]
        if roles is not None:
            roles[top : top + STRIP_ROWS] = key.classify(to_rgb(strip, maximum))
        pieces.append(to_rgb(strip[::step, ::step], maximum))
    thumbnail = np.concatenate(pieces)
    if header.channels == 1:
        return Brightness(pixels[:, :, 0], maximum, roles=roles, thumbnail=thumbnail)
    total = pixels.sum(axis=2, dtype=np.uint32)
    return Brightness(total, 3 * maximum, roles=roles, thumbnail=thumbnail)


class _Header(NamedTuple):
    """The header of a picture.

    Attributes
    ----------
    width, height : int, px
    channels : int
        1 for gray, 3 for red, green and blue.
    maximum : int
        Level of white.
    end : int
        Index of the byte after the header.
    """

    width: int
    height: int
    channels: int
    maximum: int
    end: int

    @property
    def level_count(self) -> int:
        """Number of levels, one for each pixel and channel."""
        return self.width * self.height * self.channels


def _parse_header(data: bytes, source_name: str) -> _Header:
    """Parse the header: type (P2, P3, P5 or P6), width, height and maximum level."""
    numbers = []
    position = 2  # after the type
    for name in ("width", "height", "maximum"):
        blank = _BLANK.match(data, position)
        start = position
        digits = None
        if blank is not None:
            start = blank.end()
            digits = _DIGITS.match(data, start)
        if digits is None or len(digits[0]) > _MAX_NUMBER_DIGITS:
            actual = quote(data[start:][:12])
            raise MapError(f"{source_name}: {name}: expected a whole number, got {actual}")
        numbers.append(int(digits[0]))
        position = digits.end()
    width, height, maximum = numbers
    files.require_cells(width, height, source_name)
    if not 1 <= maximum <= _MAX_LEVEL:
        raise MapError(f"{source_name}: maximum: expected a number from 1 to {_MAX_LEVEL}, got {maximum}")
    channels = 1
    if data[1:2] in b"36":  # P3 and P6 are in color
        channels = 3
    return _Header(width, height, channels, maximum, position)


def _decode_raw(data: bytes, header: _Header, source_name: str) -> Any:
    """Return the levels of a binary picture, of one or two bytes each; bytes after them are ignored."""
    raw: np.dtype[Any] = np.dtype(np.uint8)
    if header.maximum > 255:
        raw = np.dtype(">u2")
    count = header.level_count
    size = count * raw.itemsize
    # One character of white space ends the header; some programs write a line end of two bytes.
    start = header.end + 1
    if data[header.end : header.end + 2] == b"\r\n" and len(data) - header.end - 2 >= size:
        start = header.end + 2
    if len(data) - start < size:
        complete = max(0, len(data) - start) // raw.itemsize // header.channels
        raise MapError(f"{source_name}: expected {count // header.channels} pixels, got {complete}")
    return np.frombuffer(data, raw, count, start).astype(raw.newbyteorder("="), copy=False)


def _parse_plain(data: bytes, header: _Header, source_name: str) -> NDArray[np.uint16]:
    """Parse levels that are written as text, piece by piece to limit the memory."""
    text = data[header.end :]
    count = header.level_count
    expected = f"expected {count // header.channels} pixels"
    min_bytes = 2 * count - 1  # one digit for each level, with blanks between them
    if len(text) < min_bytes:
        raise MapError(f"{source_name}: {expected}, got only {len(text)} bytes")
    if b"#" in text:
        text = re.sub(rb"#[^\r\n]*", b" ", text)
    values = np.empty(count, np.uint16)
    parsed_count = 0
    position = 0
    while parsed_count < count and position < len(text):
        blank = _BLANK.search(text, position + _PIECE_BYTES)
        piece = text[position:]
        next_piece = len(text)
        if blank is not None:
            piece = text[position : blank.start()]
            next_piece = blank.end()
        numbers = files.parse_integers(piece, " ")
        position = next_piece
        if numbers is None:
            raise MapError(f"{source_name}: expected {count} whole numbers, got other text")
        numbers = numbers[: count - parsed_count]
        invalid = numbers[(numbers < 0) | (numbers > _MAX_LEVEL)]
        if len(invalid):
            worst = max(invalid)
            if min(invalid) < 0:
                worst = min(invalid)
            raise MapError(f"{source_name}: expected pixels from 0 to {_MAX_LEVEL}, got {worst}")
        values[parsed_count : parsed_count + len(numbers)] = numbers
        parsed_count += len(numbers)
    if parsed_count < count:
        raise MapError(f"{source_name}: {expected}, got {parsed_count // header.channels}")
    return values
