"""Image files from which densities are read."""

import io
from pathlib import Path, PureWindowsPath

import numpy as np

from robocov.density import MAX_RASTER_SIZE
from robocov.errors import InputError, describe_error, to_one_line
from robocov.typing import FloatArray

MAX_IMAGE_BYTES = 8_000_000
"""Maximum size of an image file."""
_WHITE_8_BIT = 255.0
"""Gray level of white in images with 8 bits per pixel."""
_WHITE_16_BIT = 65535.0
"""Gray level of white in images with 16 bits per pixel."""


def read_image_file(name: str, folder: Path | None) -> bytes:
    """Read an image file in the folder of a map, or in a folder inside it.

    Parameters
    ----------
    name : str
        Path of the image, relative to the folder of the map.
    folder : Path or None
        Folder of the map; None if the map was not loaded from a file.

    Returns
    -------
    bytes
        Content of the file.

    Raises
    ------
    InputError
        If the file cannot be read, is too large, or is not in the folder.
    """
    if folder is None:
        raise InputError("image densities require a map loaded from a file; use rows of numbers instead")
    path = _resolve_inside(name, folder)
    try:
        if not path.is_file():
            raise InputError("no such file")
        with path.open("rb") as file:
            content = file.read(MAX_IMAGE_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {describe_error(error)}") from None
    if len(content) > MAX_IMAGE_BYTES:
        raise InputError(f"expected at most {MAX_IMAGE_BYTES / 1e6:g} MB, got more")
    return content


def _resolve_inside(name: str, folder: Path) -> Path:
    """Return the path of a file in a folder; raise an error if the path leads out of the folder."""
    path = None
    # On some systems, a drive, a root or a backslash leads out of the folder.
    if "\0" not in name and "\\" not in name and not PureWindowsPath(name).anchor:
        try:
            path = (folder / name).resolve()
        except (OSError, RuntimeError):  # The path contains circular links.
            path = None
    if path is None or not path.is_relative_to(folder.resolve()):
        raise InputError("expected a file in the folder of the map, got a path outside it")
    return path


def read_gray_levels(content: bytes) -> FloatArray:
    """Read the gray levels of a PNG or Netpbm (PBM, PGM, PPM) image. Colors are converted to gray.

    Parameters
    ----------
    content : bytes
        Content of the image file.

    Returns
    -------
    (rows, columns) array
        Gray levels from 0 (black) to 1 (white), the top row first.

    Raises
    ------
    InputError
        If the content is not such an image, or has too many pixels.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=("PNG", "PPM")) as image:
            width, height = image.size
            if min(width, height) < 1 or max(width, height) > MAX_RASTER_SIZE:
                raise InputError(
                    f"expected at most {MAX_RASTER_SIZE} x {MAX_RASTER_SIZE} pixels, got {width} x {height}"
                )
            # Pillow opens all Netpbm formats as "PPM", including PFM with floating-point values.
            if image.mode == "F":
                raise InputError("expected 8 or 16 bits per pixel, got floating-point values")
            # The modes "I" and "I;16" are those of 16-bit gray levels.
            if image.mode.startswith("I"):
                return np.clip(np.asarray(image, dtype=float) / _WHITE_16_BIT, 0.0, 1.0)
            return np.asarray(image.convert("L"), dtype=float) / _WHITE_8_BIT
    except InputError:
        raise
    except Exception as error:  # Damaged images raise various errors in decoders.
        reason = to_one_line(error) or type(error).__name__
        raise InputError(f"cannot be read as PNG or PGM: {reason}") from None
