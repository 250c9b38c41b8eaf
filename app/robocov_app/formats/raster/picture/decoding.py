"""Decoding of picture files of all supported formats."""

import re
from pathlib import Path

from robocov.errors import MapError, quote
from robocov_app.formats import files
from robocov_app.formats.colors import ColorKey
from robocov_app.formats.raster.picture.brightness import Brightness
from robocov_app.formats.raster.picture.netpbm import decode_netpbm
from robocov_app.formats.raster.picture.pillow import MAGIC_NUMBERS, decode_with_pillow

_NETPBM = re.compile(rb"P[2356][\s#]")
_NO_KEY = ColorKey()


def is_picture(head: bytes) -> bool:
    """Return whether a file that starts with `head` is a picture."""
    return any(start.match(head) for start in (_NETPBM, *MAGIC_NUMBERS.values()))


def read_picture(path: Path, source_name: str, key: ColorKey = _NO_KEY) -> Brightness:
    """Read and decode a picture file.

    Parameters
    ----------
    path : Path
    source_name : str
        Name of the file for messages.
    key : ColorKey
        Declared colors, whose roles are found in the picture.

    Raises
    ------
    MapError
        If the picture is damaged or too large.
    """
    data = files.read_content(path)
    if data[:2] in (b"P2", b"P3", b"P5", b"P6"):
        return decode_netpbm(data, source_name, key)
    for name, start in MAGIC_NUMBERS.items():
        if start.match(data):
            return decode_with_pillow(data, name, source_name, key)
    expected = "a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM"
    raise MapError(f"{source_name}: expected {expected}, got a file that begins with {quote(data[:8])}")
