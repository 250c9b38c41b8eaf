"""Pictures: dark is an obstacle.

PGM and PPM are read here: Pillow rounds what has another largest value than 255 to it, which the thresholds
of ROS notice, and takes half a second for a million of pixels. A picture that `robocov export` wrote says in
a text chunk what a pixel is in metres and where its lower left corner is, and so comes back to its place.
"""

import io
import json
import re
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL.Image import Image

from robocov.environment import Environment
from robocov.errors import MapError, one_line, shown
from robocov.files.atomic import written
from robocov.mapfile.models import FARTHEST
from robocov_app.formats import files
from robocov_app.formats.base import ExportReport, ForeignMap, ReadOptions, WriteOptions
from robocov_app.formats.geometry.rasterize import free_cells, grid_over, grid_report
from robocov_app.formats.geometry.vectorize import BLOCKED, FREE, UNKNOWN, foreign_map

_PIECE = 1 << 20  # bytes that are unpacked at a time
_STRIP = 512  # rows that are converted at a time, which bounds the memory
_BLANK = re.compile(rb"(?:[ \t\r\n\v\f]|#[^\r\n]*[\r\n])+")  # between the numbers of a PGM header
_DIGITS = re.compile(rb"\d+")
_NETPBM = re.compile(rb"P[2356][\s#]")
_PILLOW = {  # first bytes (magic numbers) of formats that Pillow reads, by its names for them
    "PNG": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "JPEG": re.compile(rb"\xff\xd8\xff"),
    "BMP": re.compile(rb"BM.{12}[\x0c\x28\x34\x38\x40\x6c\x7c]\0\0\0", re.DOTALL),
    "TIFF": re.compile(rb"II[*+]\0|MM\0[*+]"),
    "PPM": re.compile(rb"P[14][\s#]"),
}
_MOST_OF_JPEG = 512  # pixels a byte: 8 x 8 take a bit at least; what is not there would be made up in grey
CHUNK = "robocov"  # key of the text chunk that says where it belongs: JSON with ``cell_m`` and ``origin_m``
TITLE = "Title"  # key of the text chunk with the name of what is shown
_NOISE = 1.5  # single cells beside dark ones come of how a JPEG is saved
_OPAQUE = 128  # less opaque pixels count as transparent, of 255


@dataclass(frozen=True, eq=False)
class Brightness:
    """A picture without its colours, the top row first.

    `level`, (rows, columns): from 0, black, to `full`, white: the sum of red, green and blue. `alpha`: to
    255, opaque. `texts`: what a PNG says of itself. `lossy`: whether saving may change pixels, as in a JPEG.
    """

    level: NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.uint32]
    full: int
    alpha: NDArray[np.uint8] | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    lossy: bool = False


def is_picture(head: bytes) -> bool:
    return any(begin.match(head) for begin in (_NETPBM, *_PILLOW.values()))


def read_picture(path: Path, where: str) -> Brightness:
    """Return the picture at `path`, which messages call `where`; MapError where it is broken or too large."""
    data = files.content(path)
    if data[:2] in (b"P2", b"P3", b"P5", b"P6"):
        return _netpbm(data, where)
    for name, begin in _PILLOW.items():
        if begin.match(data):
            return _decoded(data, name, where)
    wanted = "a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM"
    raise MapError(f"{where}: begins with {shown(data[:8])}, but {wanted} was wanted")


def _netpbm(data: bytes, where: str) -> Brightness:
    """Return a PGM or PPM; see https://netpbm.sourceforge.net/doc/pgm.html."""
    numbers, at = [], 2
    for name in ("width", "height", "largest value"):
        blank = _BLANK.match(data, at)
        digits = _DIGITS.match(data, blank.end()) if blank else None
        if digits is None or len(digits[0]) > 9:
            found = shown(data[blank.end() if blank else at :][:12])
            raise MapError(f"{where}: {name}: {found}, but a whole number was wanted")
        numbers.append(int(digits[0]))
        at = digits.end()
    width, height, most = numbers
    files.require_cells(width, height, where)
    if not 1 <= most <= 65535:
        raise MapError(f"{where}: largest value: {most}, but a number from 1 to 65535 was wanted")
    colours = 3 if data[1:2] in b"36" else 1
    count = width * height * colours
    if data[1:2] in b"56":
        raw = np.dtype(np.uint8 if most < 256 else ">u2")
        # one blank ends the header, or a line end of two; what comes after the picture is not looked at
        at += 2 if data[at : at + 2] == b"\r\n" and len(data) - at - 2 >= count * raw.itemsize else 1
        if len(data) - at < count * raw.itemsize:
            have = max(0, len(data) - at) // raw.itemsize
            raise MapError(f"{where}: cut off after {have // colours} of {count // colours} pixels")
        level: Any = np.frombuffer(data, raw, count, at).astype(raw.newbyteorder("="), copy=False)
    else:
        level = _plain(data[at:], count, where)
    highest = int(level.max())
    if highest > most:
        raise MapError(f"{where}: a pixel of {highest}, but at most {most}, the largest value, was wanted")
    if colours == 1:
        return Brightness(level.reshape(height, width), most)
    return Brightness(level.reshape(height, width, 3).sum(axis=2, dtype=np.uint32), 3 * most)


def _plain(text: bytes, count: int, where: str) -> NDArray[np.uint16]:
    # a digit and a blank each
    if len(text) < 2 * count - 1:
        raise MapError(f"{where}: cut off: {len(text)} bytes are too few for {count} pixels")
    if b"#" in text:
        text = re.sub(rb"#[^\r\n]*", b" ", text)
    values = np.empty(count, np.uint16)
    done = at = 0
    while done < count and at < len(text):
        blank = _BLANK.search(text, at + _PIECE)
        end = blank.start() if blank else len(text)
        numbers = files.whole_numbers(text[at:end], " ")
        at = blank.end() if blank else len(text)
        if numbers is None:
            raise MapError(f"{where}: pixels that are not whole numbers, of {count}")
        numbers = numbers[: count - done]
        strange = numbers[(numbers < 0) | (numbers > 65535)]
        if len(strange):
            worst = min(strange) if min(strange) < 0 else max(strange)
            raise MapError(f"{where}: a pixel of {worst}, but a number from 0 to 65535 was wanted")
        values[done : done + len(numbers)] = numbers
        done += len(numbers)
    if done < count:
        raise MapError(f"{where}: cut off after {done} of {count} pixels")
    return values


def _decoded(data: bytes, name: str, where: str) -> Brightness:
    import PIL.Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # our own limit is the lower one
            with PIL.Image.open(io.BytesIO(data), formats=(name,)) as image:
                files.require_cells(*image.size, where)
                if name == "JPEG" and image.width * image.height > _MOST_OF_JPEG * len(data):
                    raise ValueError("cut off")
                return _converted(image)
    except MapError:
        raise
    except PIL.Image.DecompressionBombError:
        most = files.MAX_CELLS // 1_000_000
        raise MapError(f"{where}: too many pixels, but at most {most} million were wanted") from None
    except Exception as error:  # of Pillow, which raises what it likes on nonsense in any chunk
        reason = one_line(error).partition(" <")[0][:100]
        raise MapError(f"{where}: broken, but a whole {name} was wanted: {reason}") from None


def _converted(image: Image) -> Brightness:
    """Return a picture without its colours, turned as it says; only a strip of it is copied at a time."""
    import PIL.ImageOps
    from PIL.ExifTags import Base

    lossy, tags = image.format == "JPEG", getattr(image, "tag_v2", {})
    image.load()
    if image.getexif().get(Base.Orientation, 1) != 1:
        PIL.ImageOps.exif_transpose(image, in_place=True)
    texts = {str(key): value for key, value in image.info.items() if isinstance(value, str)}
    transparent = "transparency" in image.info
    if image.mode == "F" or (image.mode == "I" and tags):
        raise ValueError("samples of 32 bits or with a sign, but up to 16 bits without were wanted")
    if image.mode.startswith("I") and not transparent:
        full = (1 << tags[Base.BitsPerSample][0]) - 1 if tags else 65535
        deep = np.asarray(image).astype(np.uint16)
        dark = tags.get(Base.PhotometricInterpretation) == 0
        return Brightness(full - deep if dark else deep, full, None, texts)
    has_alpha = transparent or image.mode in ("LA", "PA", "RGBA", "La", "RGBa")
    grey = image.mode in ("1", "L", "LA") and not transparent
    mode = ("LA" if has_alpha else "L") if grey else ("RGBA" if has_alpha else "RGB")
    colours = 1 if grey else 3
    shape = (image.height, image.width)
    level: Any = np.empty(shape, np.uint8 if grey else np.uint16)
    alpha = np.empty(shape, np.uint8) if has_alpha else None
    for top in range(0, image.height, _STRIP):
        rows = slice(top, min(top + _STRIP, image.height))
        strip = np.asarray(image.crop((0, rows.start, image.width, rows.stop)).convert(mode))
        strip = strip.reshape(strip.shape[0], strip.shape[1], -1)
        level[rows] = strip[:, :, :colours].sum(axis=2, dtype=level.dtype)
        if alpha is not None:
            alpha[rows] = strip[:, :, colours]
    return Brightness(level, 255 * colours, alpha, texts, lossy)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    where = one_line(path)
    picture = read_picture(path, where)
    cell, origin = _place(picture)
    cell = options.cell if options.cell is not None else cell
    if cell is None:
        beside = path.with_suffix(".yaml")
        hint = f" (or import {one_line(beside.name)} beside it)" if beside.is_file() else ""
        raise MapError(f"{where}: a picture has no scale, but --cell, the metres a pixel, was wanted{hint}")
    threshold = 0.5 if options.threshold is None else options.threshold
    shade = np.arange(picture.full + 1) / picture.full
    light = shade > 1.0 - threshold if options.invert else shade >= threshold
    table = np.where(light ^ bool(options.invert), FREE, BLOCKED).astype(np.uint8)
    cells = table[picture.level]
    if picture.alpha is not None:
        cells[picture.alpha < _OPAQUE] = UNKNOWN
    return foreign_map(
        cells,
        where,
        picture.texts.get(TITLE, "").strip() or path.stem,
        f"A picture of {cell:g} m a pixel, imported.",
        cell,
        origin=origin,
        unknown=options.unknown or "obstacle",
        called="transparent",
        noise=_NOISE if picture.lossy else 0.0,
    )


def _place(picture: Brightness) -> tuple[float | None, tuple[float, float]]:
    """Return what the picture says of itself: metres a pixel, and its lower left corner."""
    with suppress(ValueError, KeyError, TypeError, RecursionError, OverflowError):
        given = json.loads(picture.texts.get(CHUNK, ""))
        cell, (x, y) = float(given["cell_m"]), map(float, given["origin_m"])
        if 1e-6 <= cell <= 1e4 and abs(x) <= FARTHEST and abs(y) <= FARTHEST:
            return cell, (x, y)
    return None, (0.0, 0.0)


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    from PIL import Image, PngImagePlugin

    grid = grid_over(environment, options.cell)
    free = free_cells(environment, grid)
    texts = PngImagePlugin.PngInfo()
    texts.add_text(TITLE, environment.name)
    texts.add_text(CHUNK, json.dumps({"cell_m": grid.cell, "origin_m": list(grid.origin)}))
    with written(path) as part:
        Image.fromarray(free[::-1]).save(part, format="PNG", pnginfo=texts)
    return grid_report("picture", (path,), environment, grid, free)
