"""The density of a map JSON: from its model to `Density` and back, with the pictures beside a map."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.density import FINEST, Density, Raster
from robocov.environment import Ring
from robocov.errors import InputError, JsonPath, MapError, Mistake, one_line, reason, shown_json
from robocov.mapfile.models import LARGEST, LIGHTEST, SMALLEST, DensityModel, Model, RasterModel, plain

MOST_BYTES = 8_000_000
"""Largest picture of a density, in bytes."""
_DIGITS = 6
"""Digits after the point of the weights that greys stand for: a map that is written again stays short."""
_LEAST_VARIANCE = SMALLEST**2
_BASES = {"uniform": "weight", "gaussians": "floor", "polygons": "background"}
"""Keys of what a place counts at least, by kind."""


def density_from(model: DensityModel, boundary: Ring, folder: Path | None, where: str) -> Density:
    """Return the density that a model stands for; a raster without an extent covers the boundary's box.

    `folder` is where the map is, and a picture that it names; None when it came without a file. Raises
    `MapError` when a rule is broken that the structure does not show, or a picture cannot be used.
    """
    raster = isinstance(model, RasterModel)
    found = list(_raster_mistakes(model) if raster else _weight_mistakes(model))
    if found:
        raise MapError.of(where, found)
    if not raster:
        density: Density = model.built()
        return density
    if model.rows is not None:
        values = np.array(model.rows, dtype=float)
        values[values < LIGHTEST] = 0.0
    else:
        low, high = model.black or 0.0, 1.0 if model.white is None else model.white
        at = ("density", "picture")
        try:
            greys = _greys(_content(model.picture, folder))
        except InputError as error:
            raise MapError.of(where, [Mistake.at(at, f"{shown_json(model.picture)}: {error}")]) from None
        values = np.round(low + (high - low) * greys, _DIGITS)
        if not values.max() > 0.0:
            raise MapError.of(where, [_nothing(at)])
    x, y = zip(*boundary, strict=True)
    x_min, y_min, x_max, y_max = model.extent or (min(x), min(y), max(x), max(y))
    return Raster(values[::-1], (x_min, y_min, x_max, y_max), model.interpolation)


def density_document(density: Density) -> Any:
    """Return a density as a JSON document that `density_from` makes an equal one of; it names no picture."""
    if not isinstance(density, Raster):
        return plain(density)
    return {
        "kind": "raster",
        "extent": plain(density.extent),
        "interpolation": density.interpolation,
        "rows": plain(density.values[::-1].tolist()),
    }


def _nothing(at: JsonPath) -> Mistake:
    return Mistake.at(at, "all places count 0, but a weight above 0 was wanted")


def _not_one_of(model: Model, one: str, other: str) -> str | None:
    """Return what is wrong where not exactly one of two keys is given."""
    given = [getattr(model, key) is not None for key in (one, other)]
    if sum(given) == 1:
        return None
    return f"{'both' if all(given) else 'neither'} of {one} and {other}, but one of them was wanted"


def _weight_mistakes(model: DensityModel) -> Iterator[Mistake]:
    peaks, areas = (getattr(model, key, []) for key in ("peaks", "areas"))
    for k, peak in enumerate(peaks):
        at: JsonPath = ("density", "peaks", k)
        if what := _not_one_of(peak, "sigma", "covariance"):
            yield Mistake.at(at, what)
        elif peak.covariance is not None:
            (a, b), (c, d) = peak.covariance
            smaller_eigenvalue = 0.5 * (a + d) - math.hypot(0.5 * (a - d), b)
            if b != c or not smaller_eigenvalue >= _LEAST_VARIANCE or a * d - b * c <= 1e-9 * a * d:
                wanted = (
                    f"a symmetric, positive definite matrix of at least ({SMALLEST * 1000:g} mm)² each way"
                )
                yield Mistake.at(
                    (*at, "covariance"), f"{shown_json(peak.covariance)}, but {wanted} was wanted"
                )
    if not getattr(model, _BASES[model.kind]) and not any(part.weight for part in (*peaks, *areas)):
        yield _nothing(("density", "weight") if model.kind == "uniform" else ("density",))


def _raster_mistakes(model: RasterModel) -> Iterator[Mistake]:
    if what := _not_one_of(model, "rows", "picture"):
        yield Mistake.at(("density",), what)
        return
    if model.extent is not None:
        x_min, y_min, x_max, y_max = model.extent
        sides = x_max - x_min, y_max - y_min
        if not (min(sides) >= SMALLEST and max(sides) <= LARGEST):
            wanted = f"[x_min, y_min, x_max, y_max] with sides from {SMALLEST:g} to {LARGEST:.0f} m"
            yield Mistake.at(("density", "extent"), f"{shown_json(model.extent)}, but {wanted} was wanted")
    if model.rows is not None:
        for name in ("black", "white"):
            if getattr(model, name) is not None:
                yield Mistake.at(("density", name), "is for a picture, but there are rows of numbers")
        widths = [len(row) for row in model.rows]
        for k, width in enumerate(widths):
            if width != widths[0]:
                what = f"{width} numbers, but {widths[0]}, as in the first row, were wanted"
                yield Mistake.at(("density", "rows", k), what)
                return
        if not max(map(max, model.rows)) >= LIGHTEST:
            yield _nothing(("density", "rows"))


def _content(name: str, folder: Path | None) -> bytes:
    """Return the content of a file of that name in a folder or below it."""
    if folder is None:
        raise InputError("a map that is no file has no folder, but rows of numbers were wanted")
    outside = InputError("leaves the folder of the map, but a file in it was wanted")
    # a drive, a root or a backslash means something on some system
    if "\0" in name or "\\" in name or PureWindowsPath(name).anchor:
        raise outside
    try:
        path = (folder / name).resolve()
        inside = path.is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # as of links in a circle
        inside = False
    if not inside:
        raise outside
    try:
        if not path.is_file():
            raise InputError("no such file")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason(error)}") from None
    if len(content) > MOST_BYTES:
        raise InputError(f"larger than {MOST_BYTES / 1e6:g} MB, but a smaller file was wanted")
    return content


def _greys(content: bytes) -> Array:
    """Return the greys of a picture from 0 (black) to 1 (white), (rows, columns), the top row first."""
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=("PNG", "PPM")) as image:
            width, height = image.size
            if not 1 <= min(width, height) <= max(width, height) <= FINEST:
                wanted = f"at most {FINEST} each way"
                raise InputError(f"{width} x {height} pixels, but {wanted} were wanted")
            if image.mode.startswith("I"):  # 16 bits
                return np.clip(np.asarray(image, dtype=float) / 65535.0, 0.0, 1.0)
            return np.asarray(image.convert("L"), dtype=float) / 255.0
    except InputError:
        raise
    except Exception as error:  # whatever a damaged picture makes of a decoder
        why = one_line(error) or type(error).__name__
        raise InputError(f"cannot be read as PNG or PGM: {why}") from None
