"""Global IDs of the tiles of a layer: CSV, base64 with or without compression, or elements."""

import binascii
import zlib
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.errors import to_one_line
from robocov_app.formats import files
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.raster.tmx.attributes import parse_integer

GlobalIDs: TypeAlias = NDArray[np.uint32]
"""Array of global IDs: the number of a tile, with flags for its flips; 0 if there is no tile."""
FLIPPED_HORIZONTALLY = 0x80000000
FLIPPED_VERTICALLY = 0x40000000
FLIPPED_DIAGONALLY = 0x20000000
ID_MASK = 0x0FFFFFFF
"""Mask of the bits that hold the number of a tile."""
_MAX_NAME_CHARACTERS = 20


def decode_ids(piece: Element, data: Element, count: int) -> GlobalIDs:
    """Decode the global IDs of the tiles of a layer or chunk.

    Parameters
    ----------
    piece : Element
        The element that contains the tiles, which is `data` or a chunk in it.
    data : Element
        The element whose attributes specify the encoding.
    count : int
        Expected number of tiles.

    Returns
    -------
    (count,) array

    Raises
    ------
    MapError
        If the encoding is unknown, the data are damaged, or the number of tiles is not `count`.
    """
    encoding = data.attributes.get("encoding", "")
    compression = data.attributes.get("compression", "")
    ids: GlobalIDs | None
    if encoding == "base64" and compression in ("", "zlib", "gzip"):
        ids = _decode_base64_ids(piece, compression, count)
    elif encoding == "csv":
        ids = _decode_csv_ids(piece, count)
    elif not encoding:
        tiles = [child for child in piece.children if child.tag == "tile"]
        ids = np.array([parse_integer(tile, "gid", 0, "0") for tile in tiles], np.uint32)
    else:
        words = [to_one_line(word)[:_MAX_NAME_CHARACTERS] for word in (encoding, compression) if word]
        name = " ".join(words)
        piece.raise_error(f"expected CSV, or base64 with zlib or gzip or neither, got {name}")
    if ids is None or len(ids) != count:
        actual = "more" if ids is None else len(ids)
        piece.raise_error(f"expected {count} tiles as stated, got {actual}")
    return ids


def _decode_base64_ids(piece: Element, compression: str, count: int) -> GlobalIDs | None:
    """Decode base64 to global IDs; return None if there are more than `count`."""
    size = 4 * count
    try:
        raw = binascii.a2b_base64("".join(piece.text.split()), strict_mode=True)
        if compression:  # never unpacked to more than expected
            # wbits=47 accepts zlib and gzip.
            raw = zlib.decompressobj(wbits=47).decompress(raw, size + 1)
    except (ValueError, zlib.error) as error:
        piece.raise_error(f"not {compression or 'base64'}: {to_one_line(error)[:60]}")
    if len(raw) > size:
        return None
    return np.frombuffer(raw, "<u4", min(count, len(raw) // 4))


def _decode_csv_ids(piece: Element, count: int) -> GlobalIDs | None:
    """Parse comma-separated global IDs; return None if there are more than `count`."""
    if piece.text.count(",") > count:  # a comma may end the text
        return None
    numbers = files.parse_integers(piece.text, ",")
    if numbers is None or not ((numbers >= 0) & (numbers < 2**32)).all():
        piece.raise_error("expected whole numbers from 0, separated by commas")
    return numbers.astype(np.uint32)
