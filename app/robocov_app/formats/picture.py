"""Pictures: dark is an obstacle.

PGM and PPM are read here: Pillow rounds what has another largest value than 255 to it, which the thresholds
of ROS notice, and takes half a second for a million of pixels. A picture that `robocov export` wrote says in
a text chunk what a pixel is in metres and where its lower left corner is, and so comes back to its place.
"""

import io
import json
import math
import re
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL.Image import Image
from scipy import ndimage

from robocov.arrays import BoolArray
from robocov.environment import Environment
from robocov.errors import MapError, format_count, quote, to_one_line
from robocov.files.writing import replace_file
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats import files
from robocov_app.formats.colours import NO_ROLE, PICTURE_TOLERANCE, ROLES, ColourKey
from robocov_app.formats.foreign_map import ForeignMap, Thumbnail
from robocov_app.formats.geometry.rasterize import build_grid, build_grid_report, find_free_cells
from robocov_app.formats.geometry.strokes import MAX_STROKE_PIXELS, remove_thin_strokes
from robocov_app.formats.geometry.vectorize import BLOCKED, FREE, UNKNOWN, Cells, build_grid_map
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport, format_area

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
_THUMBNAIL = 640  # pixels of the longer side of a thumbnail, at most, but for pictures beyond all measure
_FEW_LIGHT = 0.02  # light pixels for each dark one, at most, of a drawing without paper: soft edges
_FEW_LINES = 0.25  # of the pixels: lines that are walls cover less
_LINE_SHARE = 0.05  # of the shorter side of a picture: no line is as wide
_SOFT_EDGE = 2  # pixels from one colour to the next
_NO_KEY = ColourKey()
_OPAQUE = 128  # less opaque pixels count as transparent, of 255


@dataclass(frozen=True, eq=False)
class Brightness:
    """A picture without its colours, the top row first.

    `level`, (rows, columns): from 0, black, to `full`, white: the sum of red, green and blue. `alpha`: to
    255, opaque. `texts`: what a PNG says of itself. `lossy`: whether saving may change pixels, as in a JPEG.
    `roles`: of colours that were asked for, as of `ColourKey.classify`. `thumbnail`, (h, w, 3): its colours.
    """

    level: NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.uint32]
    full: int
    alpha: NDArray[np.uint8] | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    lossy: bool = False
    roles: NDArray[np.uint8] | None = None
    thumbnail: NDArray[np.uint8] | None = None


def is_picture(head: bytes) -> bool:
    return any(begin.match(head) for begin in (_NETPBM, *_PILLOW.values()))


def read_picture(path: Path, where: str, key: ColourKey = _NO_KEY) -> Brightness:
    """Return the picture at `path`, which messages call `where`; MapError where it is broken or too large.

    `key`: colours whose roles are wanted.
    """
    data = files.read_content(path)
    if data[:2] in (b"P2", b"P3", b"P5", b"P6"):
        return _netpbm(data, where, key)
    for name, begin in _PILLOW.items():
        if begin.match(data):
            return _decoded(data, name, where, key)
    wanted = "a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM"
    raise MapError(f"{where}: expected {wanted}, got a file that begins with {quote(data[:8])}")


def _netpbm(data: bytes, where: str, key: ColourKey) -> Brightness:
    """Return a PGM or PPM; see https://netpbm.sourceforge.net/doc/pgm.html."""
    numbers, at = [], 2
    for name in ("width", "height", "largest value"):
        blank = _BLANK.match(data, at)
        digits = _DIGITS.match(data, blank.end()) if blank else None
        if digits is None or len(digits[0]) > 9:
            found = quote(data[blank.end() if blank else at :][:12])
            raise MapError(f"{where}: {name}: expected a whole number, got {found}")
        numbers.append(int(digits[0]))
        at = digits.end()
    width, height, most = numbers
    files.require_cells(width, height, where)
    if not 1 <= most <= 65535:
        raise MapError(f"{where}: largest value: expected a number from 1 to 65535, got {most}")
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
        raise MapError(f"{where}: expected at most {most}, the largest value, got a pixel of {highest}")
    pixels = level.reshape(height, width, colours)
    roles = np.zeros((height, width), np.uint8) if key else None
    pieces = []
    step = _thumbnail_step(width, height)
    for top in range(0, height, _STRIP):
        strip = pixels[top : top + _STRIP]
        if roles is not None:
            roles[top : top + _STRIP] = key.classify(_in_colour(strip, most))
        pieces.append(_in_colour(strip[::step, ::step], most))
    thumbnail = np.concatenate(pieces)
    if colours == 1:
        return Brightness(pixels[:, :, 0], most, roles=roles, thumbnail=thumbnail)
    total = pixels.sum(axis=2, dtype=np.uint32)
    return Brightness(total, 3 * most, roles=roles, thumbnail=thumbnail)


def _in_colour(pixels: Any, most: int) -> NDArray[np.uint8]:
    """Return pixels, (rows, columns, 1 or 3), with levels to `most`, as red, green and blue to 255."""
    levels = pixels if most == 255 else pixels.astype(np.uint32) * 255 // most
    return np.broadcast_to(levels.astype(np.uint8), (*pixels.shape[:2], 3))


def _thumbnail_step(width: int, height: int) -> int:
    """Return how many pixels become one of the thumbnail: a power of 2, so that it fits into strips."""
    step = 1
    while max(width, height) > step * _THUMBNAIL and step < _STRIP:
        step *= 2
    return step


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
        numbers = files.parse_integers(text[at:end], " ")
        at = blank.end() if blank else len(text)
        if numbers is None:
            raise MapError(f"{where}: pixels that are not whole numbers, of {count}")
        numbers = numbers[: count - done]
        strange = numbers[(numbers < 0) | (numbers > 65535)]
        if len(strange):
            worst = min(strange) if min(strange) < 0 else max(strange)
            raise MapError(f"{where}: expected a number from 0 to 65535, got a pixel of {worst}")
        values[done : done + len(numbers)] = numbers
        done += len(numbers)
    if done < count:
        raise MapError(f"{where}: cut off after {done} of {count} pixels")
    return values


def _decoded(data: bytes, name: str, where: str, key: ColourKey) -> Brightness:
    import PIL.Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # our own limit is the lower one
            with PIL.Image.open(io.BytesIO(data), formats=(name,)) as image:
                files.require_cells(*image.size, where)
                if name == "JPEG" and image.width * image.height > _MOST_OF_JPEG * len(data):
                    raise ValueError("cut off")
                return _converted(image, key)
    except MapError:
        raise
    except _UnclearSamplesError as error:
        way_out = "Save it with 8 bits, as gdal_translate -ot Byte -scale does"
        raise MapError(f"{where}: a TIFF whose brightness is unclear: {error}. {way_out}.") from None
    except PIL.Image.DecompressionBombError:
        most = files.MAX_CELLS // 1_000_000
        raise MapError(f"{where}: expected at most {most} million pixels, got more") from None
    except Exception as error:  # of Pillow, which raises what it likes on nonsense in any chunk
        reason = to_one_line(error).partition(" <")[0][:100]
        raise MapError(f"{where}: expected a complete {name}, got a broken one: {reason}") from None


class _UnclearSamplesError(ValueError):
    """Samples of a TIFF do not say what is black and what is white."""


def _from_floats(image: Image, key: ColourKey) -> Brightness:
    """Return a TIFF of floating-point samples from 0, black, to 1, white; what is no number is transparent.

    Raises
    ------
    _UnclearSamplesError
        When there are other samples: heights, or whatever else such files hold.
    """
    from PIL.ExifTags import Base

    full = 65535
    is_white_zero = getattr(image, "tag_v2", {}).get(Base.PhotometricInterpretation) == 0
    level = np.empty((image.height, image.width), np.uint16)
    alpha = np.empty((image.height, image.width), np.uint8)
    low, high = np.inf, -np.inf
    for top in range(0, image.height, _STRIP):
        rows = slice(top, min(top + _STRIP, image.height))
        samples = np.asarray(image.crop((0, rows.start, image.width, rows.stop)))
        known = np.isfinite(samples)
        alpha[rows] = np.where(known, 255, 0)
        low = min(low, float(samples.min(initial=np.inf, where=known)))
        high = max(high, float(samples.max(initial=-np.inf, where=known)))
        shade = np.clip(np.where(known, samples, 0.0), 0.0, 1.0)
        level[rows] = np.rint(full * (1.0 - shade if is_white_zero else shade))
    if not low <= high:
        raise _UnclearSamplesError("expected samples from 0 (black) to 1 (white), got none that is a number")
    if low < 0.0 or high > 1.0:
        found = f"{low:.6g} to {high:.6g}"
        raise _UnclearSamplesError(
            f"expected floating-point samples from 0 (black) to 1 (white), got {found}"
        )
    shades = _in_colour(level[:, :, None], full)
    step = _thumbnail_step(image.width, image.height)
    return Brightness(
        level,
        full,
        alpha=None if (alpha == 255).all() else alpha,
        roles=key.classify(shades) if key else None,
        thumbnail=shades[::step, ::step].copy(),
    )


def describe_transparency(picture: Brightness) -> str:
    """Return what is transparent in a picture, in words, for formats that do not look at it; or nothing."""
    if picture.alpha is None:
        return ""
    share = 100 * np.count_nonzero(picture.alpha < _OPAQUE) / picture.alpha.size
    if share == 0.0:
        return ""
    return f"{share:.3g} % of the pixels are transparent, and count by the colour that is hidden in them"


def _converted(image: Image, key: ColourKey) -> Brightness:
    """Return a picture without its colours, turned as it says; only a strip of it is copied at a time."""
    import PIL.ImageOps
    from PIL.ExifTags import Base

    lossy, tags = image.format == "JPEG", getattr(image, "tag_v2", {})
    image.load()
    if image.getexif().get(Base.Orientation, 1) != 1:
        PIL.ImageOps.exif_transpose(image, in_place=True)
    texts = {str(key): value for key, value in image.info.items() if isinstance(value, str)}
    transparent = "transparency" in image.info
    if image.mode == "F":
        return _from_floats(image, key)
    if image.mode == "I" and tags:
        raise _UnclearSamplesError("expected samples of up to 16 bits without a sign, got others")
    if image.mode.startswith("I") and not transparent:
        full = (1 << tags[Base.BitsPerSample][0]) - 1 if tags else 65535
        deep = np.asarray(image).astype(np.uint16)
        dark = tags.get(Base.PhotometricInterpretation) == 0
        deep = full - deep if dark else deep
        shades = _in_colour(deep[:, :, None], full)
        step = _thumbnail_step(image.width, image.height)
        roles = key.classify(shades) if key else None
        return Brightness(deep, full, roles=roles, thumbnail=shades[::step, ::step].copy())
    has_alpha = transparent or image.mode in ("LA", "PA", "RGBA", "La", "RGBa")
    grey = image.mode in ("1", "L", "LA") and not transparent
    mode = ("LA" if has_alpha else "L") if grey else ("RGBA" if has_alpha else "RGB")
    colours = 1 if grey else 3
    shape = (image.height, image.width)
    level: Any = np.empty(shape, np.uint8 if grey else np.uint16)
    alpha = np.empty(shape, np.uint8) if has_alpha else None
    roles = np.empty(shape, np.uint8) if key else None
    step = _thumbnail_step(image.width, image.height)
    pieces = []
    for top in range(0, image.height, _STRIP):
        rows = slice(top, min(top + _STRIP, image.height))
        part = image.crop((0, rows.start, image.width, rows.stop)).convert(mode)
        strip = np.asarray(part)
        strip = strip.reshape(strip.shape[0], strip.shape[1], -1)
        level[rows] = strip[:, :, :colours].sum(axis=2, dtype=level.dtype)
        if alpha is not None:
            alpha[rows] = strip[:, :, colours]
        if roles is not None:
            roles[rows] = key.classify(_in_colour(strip[:, :, :colours], 255))
        pieces.append(_shrink(part, step))
    return Brightness(level, 255 * colours, alpha, texts, lossy, roles, np.concatenate(pieces))


def _shrink(part: Image, step: int) -> NDArray[np.uint8]:
    """Return a part of a picture in its colours on white, `step` times smaller, (rows, columns, 3)."""
    import PIL.Image

    small = part.reduce(step) if step > 1 else part
    if small.mode in ("LA", "RGBA"):
        small = small.convert("RGBA")
        white = PIL.Image.new("RGBA", small.size, "white")
        small = PIL.Image.alpha_composite(white, small)
    return np.asarray(small.convert("RGB"))


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return is_picture(head)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    where = to_one_line(path)
    key = options.build_colour_key(PICTURE_TOLERANCE)
    picture = read_picture(path, where, key)
    cell, origin = _place(picture)
    cell = options.cell if options.cell is not None else cell
    if cell is None:
        beside = path.with_suffix(".yaml")
        hint = f" (or import {to_one_line(beside.name)} beside it)" if beside.is_file() else ""
        raise MapError(f"{where}: a picture has no scale, expected --cell, the metres per pixel{hint}")
    cells, notes = _classify(picture, options)
    unknown = options.unknown or "obstacle"
    if options.unknown is None and _is_drawn_on_nothing(cells):
        unknown = "free"
        notes.append("nothing but dark paint on a transparent ground, so what is transparent is free")
    dropped = _drop_strokes(cells, options, cell, where) if options.min_stroke is not None else ()
    _require_both(cells, unknown, picture, options, where, notes)
    foreign = build_grid_map(
        cells,
        where,
        picture.texts.get(TITLE, "").strip() or path.stem,
        f"A picture of {cell:g} m a pixel, imported.",
        cell,
        origin=origin,
        unknown=unknown,
        unknown_name="transparent",
        noise=_NOISE if picture.lossy else 0.0,
        notes=tuple(notes),
    )
    rows, columns = cells.shape
    bounds = (origin[0], origin[1], origin[0] + columns * cell, origin[1] + rows * cell)
    thumbnail = None if picture.thumbnail is None else Thumbnail(picture.thumbnail, bounds)
    return replace(
        foreign,
        dropped=(*dropped, *foreign.dropped),
        page=shapely.box(*bounds),
        thumbnail=thumbnail,
    )


def _classify(picture: Brightness, options: ReadOptions) -> tuple[Cells, list[str]]:
    """Return the pixels as cells, and notes on colours that were asked for."""
    threshold = 0.5 if options.threshold is None else options.threshold
    shade = np.arange(picture.full + 1) / picture.full
    light = shade > 1.0 - threshold if options.invert else shade >= threshold
    table = np.where(light ^ bool(options.invert), FREE, BLOCKED).astype(np.uint8)
    cells = table[picture.level]
    transparent = None
    if picture.alpha is not None:
        transparent = picture.alpha < _OPAQUE
    notes: list[str] = []
    if picture.roles is not None:
        if transparent is not None:
            # what cannot be seen has no colour
            picture.roles[transparent] = NO_ROLE
        for code, role in enumerate(ROLES, 1):
            names = getattr(options, f"{role}_colour")
            if names:
                share = np.count_nonzero(picture.roles == code) / cells.size
                what = {"free": "free", "solid": "obstacles", "ignore": "left out"}[role]
                notes.append(f"{100 * share:.3g} % of the pixels are {', '.join(names)}, taken as {what}")
        cells[picture.roles == ROLES.index("free") + 1] = FREE
        cells[picture.roles == ROLES.index("solid") + 1] = BLOCKED
        if not options.invert:
            _free_soft_edges(cells, picture, picture.roles, options)
    if transparent is not None:
        cells[transparent] = UNKNOWN
    if picture.roles is not None and options.ignore_colour:
        ignored = picture.roles == ROLES.index("ignore") + 1
        _fill_from_around(cells, ignored)
    return cells, notes


def _free_soft_edges(
    cells: Cells, picture: Brightness, roles: NDArray[np.uint8], options: ReadOptions
) -> None:
    """Free what lies between a dark colour that is declared and light paint, and mixes the two.

    It is neither the one nor the other: without this, soft edges would become walls around such colours.
    """
    declared = [sum(colour) / 765 for colour, role in options.build_colour_key().entries if role != "solid"]
    if not declared or min(declared) >= 0.5:
        return
    mixed = (cells == BLOCKED) & (roles == NO_ROLE) & (picture.level > min(declared) * picture.full)
    around = np.ones((3, 3), dtype=bool)
    is_declared = (roles == ROLES.index("free") + 1) | (roles == ROLES.index("ignore") + 1)
    mixed &= ndimage.binary_dilation(is_declared, around, iterations=_SOFT_EDGE)
    mixed &= ndimage.binary_dilation((cells == FREE) & (roles == NO_ROLE), around, iterations=_SOFT_EDGE)
    cells[mixed] = FREE


def _fill_from_around(cells: Cells, ignored: BoolArray) -> None:
    """Give ignored cells the value of the nearest other one, and make them free where there is none near."""
    halo = _STRIP // 4
    given = cells.copy()
    for top in range(0, len(cells), _STRIP):
        low, high = max(top - halo, 0), min(top + _STRIP + halo, len(cells))
        strip = ignored[low:high]
        own = ignored[top : top + _STRIP]
        if not own.any():
            continue
        if strip.all():
            cells[top : top + _STRIP] = FREE
            continue
        found = ndimage.distance_transform_edt(strip, return_distances=False, return_indices=True)
        row, column = found[:, top - low : top - low + len(own)][:, own]
        cells[top : top + _STRIP][own] = given[low:high][row, column]


def _is_drawn_on_nothing(cells: Cells) -> bool:
    """Return whether a picture has transparent pixels, dark ones, and no others: a drawing without paper."""
    counts = np.bincount(cells.ravel(), minlength=3)
    return bool(counts[FREE] < _FEW_LIGHT * counts[BLOCKED] and counts[UNKNOWN] > counts[BLOCKED] > 0)


def _drop_strokes(cells: Cells, options: ReadOptions, cell: float, where: str) -> tuple[str, ...]:
    """Make thin strokes free in `cells`, and return what was dropped."""
    width = options.compute_stroke_width(cell)
    pixels = math.ceil(width / cell - 1e-9)
    if pixels > MAX_STROKE_PIXELS:
        few = f"expected at most {MAX_STROKE_PIXELS} pixels, got {pixels}"
        raise MapError(f"{where}: min_stroke: {few}")
    solid = cells == BLOCKED
    thin = solid & ~remove_thin_strokes(solid, pixels)
    count = int(np.count_nonzero(thin))
    if not count:
        return ()
    cells[thin] = FREE
    pieces = ndimage.label(thin, structure=np.ones((3, 3)))[1]
    area = format_area(count * cell * cell, 3)
    what = f"strokes thinner than {pixels * cell:.3g} m ({pixels} px)"
    return (f"{what} in {format_count(pieces, 'piece')}, {area} (--min-stroke)",)


def _is_line_drawing(cells: Cells) -> bool:
    """Return whether what is free are thin lines on a dark ground, as in a blueprint."""
    free = cells == FREE
    if not 0.0 < free.mean() < _FEW_LINES:
        return False
    width = min(max(round(_LINE_SHARE * min(cells.shape)), 3), MAX_STROKE_PIXELS)
    return not remove_thin_strokes(free, width).any()


def _require_both(
    cells: Cells,
    unknown: str,
    picture: Brightness,
    options: ReadOptions,
    where: str,
    notes: list[str],
) -> None:
    """Name the cause where all of a picture is solid, in a MapError, or free, in a note."""
    counts = np.bincount(cells.ravel(), minlength=3)
    share = 100 * counts[UNKNOWN] / cells.size
    if not counts[FREE] and not (unknown == "free" and counts[UNKNOWN]):
        if counts[UNKNOWN]:
            cause = f"{share:.3g} % of the pixels are transparent, which counts as solid"
            raise MapError(
                f"{where}: no cell is free: {cause} (--unknown free takes transparent cells as free)"
            )
        levels = picture.level.min() / picture.full, picture.level.max() / picture.full
        cause = f"its brightness is from {levels[0]:.2g} to {levels[1]:.2g}"
        ways = "--threshold, --invert or --free-colour choose otherwise"
        raise MapError(f"{where}: no cell is free: {cause} ({ways})")
    if not counts[BLOCKED] and unknown == "free" and counts[UNKNOWN]:
        notes.append(
            f"nothing is solid: {share:.3g} % of the pixels are transparent (less than half opaque), "
            "which --unknown free takes as free"
        )
    elif _is_line_drawing(cells):
        part = f"only {100 * counts[FREE] / cells.size:.2g} % of the pixels are light, all of them thin lines"
        notes.append(f"{part}: if they are the walls, --invert takes them as such")
    elif not counts[BLOCKED] and not counts[UNKNOWN]:
        least = picture.level.min() / picture.full
        notes.append(f"nothing is solid: the darkest pixel has a brightness of {least:.2g} (--threshold)")


def _place(picture: Brightness) -> tuple[float | None, tuple[float, float]]:
    """Return what the picture says of itself: metres a pixel, and its lower left corner."""
    with suppress(ValueError, KeyError, TypeError, RecursionError, OverflowError):
        given = json.loads(picture.texts.get(CHUNK, ""))
        cell, (x, y) = float(given["cell_m"]), map(float, given["origin_m"])
        if 1e-6 <= cell <= 1e4 and abs(x) <= MAX_COORDINATE_M and abs(y) <= MAX_COORDINATE_M:
            return cell, (x, y)
    return None, (0.0, 0.0)


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    from PIL import Image, PngImagePlugin

    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    texts = PngImagePlugin.PngInfo()
    texts.add_text(TITLE, environment.name)
    texts.add_text(CHUNK, json.dumps({"cell_m": grid.cell, "origin_m": list(grid.origin)}))
    with replace_file(path) as part:
        Image.fromarray(free[::-1]).save(part, format="PNG", pnginfo=texts)
    return build_grid_report("picture", (path,), environment, grid, free)
