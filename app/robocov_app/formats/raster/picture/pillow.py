"""Decoding PNG, JPEG, BMP, TIFF and PBM with Pillow."""

import io
import re
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL.Image import Image

from robocov.errors import MapError, to_one_line
from robocov_app.formats import files
from robocov_app.formats.colors import ColorKey
from robocov_app.formats.raster.picture.brightness import (
    STRIP_ROWS,
    Brightness,
    choose_thumbnail_step,
    to_rgb,
)

MAGIC_NUMBERS = {
    "PNG": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "JPEG": re.compile(rb"\xff\xd8\xff"),
    "BMP": re.compile(rb"BM.{12}[\x0c\x28\x34\x38\x40\x6c\x7c]\0\0\0", re.DOTALL),
    "TIFF": re.compile(rb"II[*+]\0|MM\0[*+]"),
    "PPM": re.compile(rb"P[14][\s#]"),
}
"""First bytes of the formats that are decoded with Pillow, keyed by Pillow's names."""
_MAX_JPEG_PIXELS_PER_BYTE = 512
"""A complete JPEG has at least one bit for 8 x 8 pixels. Pillow would fill missing pixels with gray."""
_WHITE_IS_ZERO = 0
"""Value of the TIFF tag PhotometricInterpretation if 0 is white (TIFF 6.0, section 3)."""
_MAX_16_BIT_LEVEL = 65535
_LOSSY_FORMATS = ("JPEG", "MPO")
"""Pillow's names of JPEGs. A JPEG with several pictures, as many cameras write them, is an MPO."""
_MODES_WITH_ALPHA = ("LA", "PA", "RGBA", "La", "RGBa")


def decode_with_pillow(data: bytes, name: str, source_name: str, key: ColorKey) -> Brightness:
    """Decode a picture of one of the formats in `MAGIC_NUMBERS`.

    Parameters
    ----------
    data : bytes
    name : str
        Name of the format in Pillow.
    source_name : str
        Name of the file for messages.
    key : ColorKey
        Declared colors, whose roles are found in the picture.

    Raises
    ------
    MapError
        If the picture is damaged, too large, or a TIFF whose samples are not brightness.
    """
    import PIL.Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the limit of this application is lower
            with PIL.Image.open(io.BytesIO(data), formats=(name,)) as image:
                files.require_cells(*image.size, source_name)
                if name == "JPEG" and image.width * image.height > _MAX_JPEG_PIXELS_PER_BYTE * len(data):
                    raise ValueError("cut off")
                return _convert(image, key)
    except MapError:
        raise
    except _UnclearSamplesError as error:
        way_out = "Convert it to 8 bits, for example with gdal_translate -ot Byte -scale"
        raise MapError(f"{source_name}: a TIFF whose brightness is unclear: {error}. {way_out}.") from None
    except PIL.Image.DecompressionBombError:
        millions = files.MAX_CELLS // 1_000_000
        raise MapError(f"{source_name}: expected at most {millions} million pixels, got more") from None
    except Exception as error:  # Pillow raises exceptions of any type for damaged chunks
        reason = to_one_line(error).partition(" <")[0][:100]
        raise MapError(f"{source_name}: expected a complete {name}, got a broken one: {reason}") from None


class _UnclearSamplesError(ValueError):
    """The samples of a TIFF do not say which values are black and white."""


def _convert_float_samples(image: Image, key: ColorKey) -> Brightness:
    """Convert a TIFF of floating-point samples from 0 (black) to 1 (white); nan is transparent.

    Raises
    ------
    _UnclearSamplesError
        If samples are outside this range, such as heights.
    """
    from PIL.ExifTags import Base

    max_level = _MAX_16_BIT_LEVEL
    is_white_zero = getattr(image, "tag_v2", {}).get(Base.PhotometricInterpretation) == _WHITE_IS_ZERO
    level = np.empty((image.height, image.width), np.uint16)
    alpha = np.empty((image.height, image.width), np.uint8)
    low = np.inf
    high = -np.inf
    for top in range(0, image.height, STRIP_ROWS):
        rows = slice(top, min(top + STRIP_ROWS, image.height))
        samples = np.asarray(image.crop((0, rows.start, image.width, rows.stop)))
        known = np.isfinite(samples)
        alpha[rows] = np.where(known, 255, 0)
        low = min(low, float(samples.min(initial=np.inf, where=known)))
        high = max(high, float(samples.max(initial=-np.inf, where=known)))
        shade = np.clip(np.where(known, samples, 0.0), 0.0, 1.0)
        if is_white_zero:
            shade = 1.0 - shade
        level[rows] = np.rint(max_level * shade)
    if not low <= high:
        raise _UnclearSamplesError("expected samples from 0 (black) to 1 (white), got none that is a number")
    if low < 0.0 or high > 1.0:
        expected = "expected floating-point samples from 0 (black) to 1 (white)"
        raise _UnclearSamplesError(f"{expected}, got {low:.6g} to {high:.6g}")
    shades = to_rgb(level[:, :, None], max_level)
    step = choose_thumbnail_step(image.width, image.height)
    return Brightness(
        level,
        max_level,
        alpha=None if (alpha == 255).all() else alpha,
        roles=key.classify(shades) if key else None,
        thumbnail=shades[::step, ::step].copy(),
    )


def _convert(image: Image, key: ColorKey) -> Brightness:
    """Convert an opened picture to its brightness, rotated as its metadata says."""
    import PIL.ImageOps
    from PIL.ExifTags import Base

    is_lossy = image.format in _LOSSY_FORMATS
    tiff_tags = getattr(image, "tag_v2", {})
    image.load()
    if image.getexif().get(Base.Orientation, 1) != 1:
        PIL.ImageOps.exif_transpose(image, in_place=True)
    texts = {str(name): text for name, text in image.info.items() if isinstance(text, str)}
    is_transparent = "transparency" in image.info
    if image.mode == "F":
        return _convert_float_samples(image, key)
    if image.mode == "I" and tiff_tags:
        raise _UnclearSamplesError("expected unsigned samples of up to 16 bits")
    if image.mode.startswith("I") and not is_transparent:
        return _convert_16_bit_samples(image, tiff_tags, key)
    has_alpha = is_transparent or image.mode in _MODES_WITH_ALPHA
    is_gray = image.mode in ("1", "L", "LA") and not is_transparent
    return _convert_bytes(image, key, texts, is_lossy=is_lossy, is_gray=is_gray, has_alpha=has_alpha)


def _convert_16_bit_samples(image: Image, tiff_tags: Any, key: ColorKey) -> Brightness:
    """Convert a gray picture with samples of up to 16 bits."""
    from PIL.ExifTags import Base

    max_level = _MAX_16_BIT_LEVEL
    level = np.asarray(image).astype(np.uint16)
    if tiff_tags:
        max_level = (1 << tiff_tags[Base.BitsPerSample][0]) - 1
        if tiff_tags.get(Base.PhotometricInterpretation) == _WHITE_IS_ZERO:
            level = max_level - level
    shades = to_rgb(level[:, :, None], max_level)
    step = choose_thumbnail_step(image.width, image.height)
    roles = key.classify(shades) if key else None
    return Brightness(level, max_level, roles=roles, thumbnail=shades[::step, ::step].copy())


def _convert_bytes(
    image: Image,
    key: ColorKey,
    texts: dict[str, str],
    *,
    is_lossy: bool,
    is_gray: bool,
    has_alpha: bool,
) -> Brightness:
    """Convert a picture with 8 bits per channel, strip by strip to limit the memory."""
    shape = (image.height, image.width)
    level: Any
    if is_gray:
        mode = "L"
        channels = 1
        level = np.empty(shape, np.uint8)
    else:
        mode = "RGB"
        channels = 3
        level = np.empty(shape, np.uint16)
    alpha = None
    if has_alpha:
        mode += "A"
        alpha = np.empty(shape, np.uint8)
    roles = None
    if key:
        roles = np.empty(shape, np.uint8)
    step = choose_thumbnail_step(image.width, image.height)
    pieces = []
    for top in range(0, image.height, STRIP_ROWS):
        rows = slice(top, min(top + STRIP_ROWS, image.height))
        strip = image.crop((0, rows.start, image.width, rows.stop)).convert(mode)
        pixels = np.asarray(strip)
        pixels = pixels.reshape(pixels.shape[0], pixels.shape[1], -1)
        colors = pixels[:, :, :channels]
        level[rows] = colors.sum(axis=2, dtype=level.dtype)
        if alpha is not None:
            alpha[rows] = pixels[:, :, channels]
        if roles is not None:
            roles[rows] = key.classify(to_rgb(colors, 255))
        pieces.append(_shrink(strip, step))
    return Brightness(
        level,
        255 * channels,
        alpha=alpha,
        texts=texts,
        lossy=is_lossy,
        roles=roles,
        thumbnail=np.concatenate(pieces),
    )


def _shrink(strip: Image, step: int) -> NDArray[np.uint8]:
    """Return a strip of a picture in color on white, reduced by the factor `step`, (rows, columns, 3)."""
    import PIL.Image

    small = strip
    if step > 1:
        small = strip.reduce(step)
    if small.mode in ("LA", "RGBA"):
        small = small.convert("RGBA")
        white = PIL.Image.new("RGBA", small.size, "white")
        small = PIL.Image.alpha_composite(white, small)
    return np.asarray(small.convert("RGB"))
