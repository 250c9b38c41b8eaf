"""Pictures that densities are read from."""

import io
from pathlib import Path, PureWindowsPath

import numpy as np

from robocov.arrays import Array
from robocov.density import MAX_RASTER_SIZE
from robocov.errors import InputError, describe_error, to_one_line

MAX_PICTURE_BYTES = 8_000_000
"""Largest file of a picture."""


def read_picture_file(name: str, folder: Path | None) -> bytes:
    """Read the file of a picture in a folder or below it.

    Parameters
    ----------
    name : str
        Path relative to the folder.
    folder : Path or None
        None if the map did not come from a file.

    Returns
    -------
    bytes

    Raises
    ------
    InputError
        If the file cannot be read, is too large, or is not in the folder.
    """
    if folder is None:
        raise InputError("a map that is no file has no folder, but rows of numbers were wanted")
    # a drive, a root or a backslash means something on some system
    strange = "\0" in name or "\\" in name or PureWindowsPath(name).anchor
    try:
        path = None if strange else (folder / name).resolve()
    except (OSError, RuntimeError):  # as of links in a circle
        path = None
    if path is None or not path.is_relative_to(folder.resolve()):
        raise InputError("leaves the folder of the map, but a file in it was wanted")
    try:
        if not path.is_file():
            raise InputError("no such file")
        with path.open("rb") as file:
            content = file.read(MAX_PICTURE_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {describe_error(error)}") from None
    if len(content) > MAX_PICTURE_BYTES:
        raise InputError(f"larger than {MAX_PICTURE_BYTES / 1e6:g} MB, but a smaller file was wanted")
    return content


def read_gray_levels(content: bytes) -> Array:
    """Read the gray levels of a PNG or PGM picture.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    (rows, columns) array
        From 0 (black) to 1 (white), the top row first.

    Raises
    ------
    InputError
        If the content is no such picture, or has too many pixels.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=("PNG", "PPM")) as image:
            width, height = image.size
            if not 1 <= min(width, height) <= max(width, height) <= MAX_RASTER_SIZE:
                found = f"{width} x {height} pixels"
                raise InputError(f"{found}, but at most {MAX_RASTER_SIZE} each way were wanted")
            if image.mode.startswith("I"):  # 16 bits
                return np.clip(np.asarray(image, dtype=float) / 65535.0, 0.0, 1.0)
            return np.asarray(image.convert("L"), dtype=float) / 255.0
    except InputError:
        raise
    except Exception as error:  # whatever a damaged picture makes of a decoder
        why = to_one_line(error) or type(error).__name__
        raise InputError(f"cannot be read as PNG or PGM: {why}") from None
