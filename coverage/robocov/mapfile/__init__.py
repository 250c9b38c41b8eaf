"""Map files: the map JSON, version 1, to and from `Environment`, pictures of densities; the bundled maps."""

import io
import json
import math
import re
from contextlib import suppress
from os import PathLike
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.density import MAX_RASTER_SIZE, Density, Raster
from robocov.environment import Environment, Ring
from robocov.errors import (
    InputError,
    MapError,
    Mistake,
    ParameterError,
    describe_error,
    describe_unknown_name,
    quote,
    quote_json,
    to_one_line,
)
from robocov.files.strictjson import located, parse, read_bytes, require_json
from robocov.files.writing import replace_file
from robocov.mapfile.check import check_rules
from robocov.mapfile.models import HEAD, LIGHTEST, NOTHING, DensityModel, RasterModel, plain, validate
from robocov.mapfile.models import build_map_schema as build_map_schema

_LINE = 100
"""Objects that fit in so many characters stand on one line of a dumped map, each number counted as two."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_MEASURED = ("boundary", "obstacles", "starts", "density")
"""Keys of numbers that `dump_map` writes short."""
_DIGITS = 9
"""Digits after the point of a coordinate in metres that may be meant: nobody means parts of a nanometre."""
_NOISE = 16
"""Largest rounding error of a few sums and a rotation, in units of the last place (of 1 m at least)."""
MOST_BYTES = 8_000_000
"""Largest picture of a density, in bytes."""
_GREY_DIGITS = 6
"""Digits after the point of the weights that greys stand for: a map that is written again stays short."""


def load_map(source: str | Path) -> Environment:
    """Return the map in a file, or the bundled map of that name: a str without suffix and separator.

    Raises `MapError`, one line: the file with line and column, the JSON path, the value and what was wanted.
    """
    path = map_file(source)
    return parse_map(read_bytes(path), str(path), path.parent)


def map_file(source: str | Path) -> Path:
    """Return the file of the map of `load_map`, which may be missing; raise MapError for unknown names."""
    if not isinstance(source, str | PathLike):
        raise ParameterError(f"map: {quote(source)}, but a path, or the name of a bundled map, was wanted")
    if not isinstance(source, str) or any(char in source for char in "./\\\0"):
        return Path(source)
    known = list_bundled_maps()
    if source in known:
        return known[source]
    with suppress(OSError):  # as of a name that is longer than any file's
        if Path(source).is_file():
            return Path(source)
    raise MapError(describe_unknown_name("map", source, known))


def list_bundled_maps() -> dict[str, Path]:
    """Return the files of the bundled maps by name, sorted: those in the package, else in the checkout."""
    here = Path(__file__).resolve()
    inside, beside = (sorted((here.parents[up] / "maps").glob("*.json")) for up in (1, 3))
    return {file.stem: file for file in inside or beside}


def parse_map(text: str | bytes, where: str, folder: Path | None = None) -> Environment:
    """Return the map in the JSON `text`, called `where`, with pictures in `folder`; raises as `load_map`."""
    document = parse(text, where)
    try:
        return _environment(document, to_one_line(where), folder)
    except MapError as error:
        raise located(error, text, where) from None


def from_json(document: dict[str, Any], where: str = "map", folder: Path | None = None) -> Environment:
    """Return the map in a parsed JSON `document`; see `parse_map`."""
    where = to_one_line(where)
    require_json(document, where)
    return _environment(document, where, folder)


def density_of(value: object, boundary: Ring, where: str = "map", folder: Path | None = None) -> Density:
    """Return the density that the JSON value at the ``density`` of a map with that boundary stands for."""
    rest = {"name": "map", "boundary": [[0, 0], [1, 0], [1, 1]]}
    model = validate({**HEAD, **rest, "density": value}, where)
    density: Density = _density(model.density, boundary, folder, where)
    return density


def _environment(document: object, where: str, folder: Path | None) -> Environment:
    model = validate(document, where)
    boundary: Any = model.boundary
    environment = Environment(
        name=model.name,
        boundary=boundary,
        obstacles=tuple(obstacle.built() for obstacle in model.obstacles),
        starts={name: start.built() for name, start in model.starts.items()},
        description=model.description,
        extra=json.loads(json.dumps(model.extra)),
        schema=model.schema_,
        density=None if model.density is None else _density(model.density, boundary, folder, where),
    )
    check_rules(environment, where)
    return environment


def to_json(environment: Environment) -> dict[str, Any]:
    """Return `environment` as a JSON document that `from_json` turns into an equal one."""
    density = environment.density
    return {
        **({} if environment.schema is None else {"$schema": environment.schema}),
        **HEAD,
        "name": environment.name,
        **({"description": environment.description} if environment.description else {}),
        "boundary": plain(environment.boundary),
        "obstacles": plain(environment.obstacles),
        "starts": {name: plain(spec) for name, spec in environment.starts.items()},
        **({} if density is None else {"density": _density_document(density)}),
        **({"extra": dict(environment.extra)} if environment.extra else {}),
    }


def save_map(environment: Environment, path: str | Path) -> None:
    """Write `environment` to `path`, whole or not at all; raise MapError where a rule is broken."""
    exact = to_json(environment)
    document = _shortened(exact)
    if document == exact and environment.density is None:
        # what is written is the map itself, whose free space may be known already
        require_json(document, str(path))
        validate(document, str(path))
        check_rules(environment, str(path))
    else:
        from_json(document, str(path))
    with replace_file(Path(path)) as part:
        part.write_bytes(dump_document(document).encode())


def dump_map(environment: Environment) -> str:
    """Return the text of a map file: keys in a fixed order, one list of vertices on a line.

    What is the result of a sum, as 0.30000000000000004, is written as the decimal that it misses by rounding
    errors alone, 0.3. What was written by hand stays as it is.
    """
    return dump_document(to_json(environment))


def dump_document(document: dict[str, Any]) -> str:
    """Return the text of a map file with this document, which may be a draft that no map can be made of.

    Line breaks do not depend on the lengths of numbers: a vertex that has moved changes one line of the file.
    """
    return _text(_shortened(document), "", 0, expanded=True) + "\n"


def _shortened(document: dict[str, Any]) -> dict[str, Any]:
    return document | {key: _short(document[key]) for key in _MEASURED if key in document}


def _short(value: Any) -> Any:
    """Return a JSON value with numbers as `dump_map` writes them."""
    if isinstance(value, float):
        decimal = round(value, _DIGITS)
        noise = _NOISE * math.ulp(max(abs(value), 1.0))
        return plain(decimal if abs(decimal - value) <= noise else value)
    if isinstance(value, list):
        return [_short(item) for item in value]
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    return value


def _text(value: Any, indent: str, used: int, *, expanded: bool = False) -> str:
    """Return `value` on one line where it fits or is a list of points, else one item on a line."""
    whole = not isinstance(value, (dict, list)) or not value
    if whole or not expanded:
        line = json.dumps(value, ensure_ascii=False, allow_nan=False)
        points = isinstance(value, list) and all(isinstance(x, list) and not _is_ring(x) for x in value)
        if whole or points or used + len(_NUMBER.sub("00", line)) <= _LINE:
            return line
    inner = indent + "  "
    items = []
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        head = f"{json.dumps(key, ensure_ascii=False)}: " if isinstance(value, dict) else ""
        # things stand on lines of their own, and so do the rows of a raster, which are no points
        rows = key == "rows" and isinstance(item, list) and len(item) > 1
        things = not indent and key in ("obstacles", "starts")
        items.append(inner + head + _text(item, inner, len(inner) + len(head), expanded=rows or things))
    left, right = "[]" if isinstance(value, list) else "{}"
    return left + "\n" + ",\n".join(items) + f"\n{indent}{right}"


def _is_ring(value: object) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list) and len(value[0]) == 2


def _density(model: DensityModel, boundary: Ring, folder: Path | None, where: str) -> Any:
    """Return the density that a model stands for; a raster without an extent covers the boundary's box.

    `folder` is where the map is, and a picture that it names; None when it came without a file.
    """
    if not isinstance(model, RasterModel):
        return model.built()
    if model.rows is not None:
        values = np.array(model.rows, dtype=float)
        values[values < LIGHTEST] = 0.0
    else:
        low, high = model.black or 0.0, 1.0 if model.white is None else model.white
        at = ("density", "picture")
        try:
            greys = _greys(_content(str(model.picture), folder))
        except InputError as error:
            raise MapError.from_mistakes(
                where, [Mistake.at_path(at, f"{quote_json(model.picture)}: {error}")]
            ) from None
        values = np.round(low + (high - low) * greys, _GREY_DIGITS)
        if not values.max() > 0.0:
            raise MapError.from_mistakes(where, [Mistake.at_path(at, NOTHING)])
    x, y = zip(*boundary, strict=True)
    x_min, y_min, x_max, y_max = model.extent or (min(x), min(y), max(x), max(y))
    return Raster(values[::-1], (x_min, y_min, x_max, y_max), model.interpolation)


def _density_document(density: Density) -> Any:
    """Return a density as a JSON document that `_density` makes an equal one of; it names no picture."""
    if not isinstance(density, Raster):
        return plain(density)
    return {
        "kind": "raster",
        "extent": plain(density.extent),
        "interpolation": density.interpolation,
        "rows": plain(density.values[::-1].tolist()),
    }


def _content(name: str, folder: Path | None) -> bytes:
    """Return the content of a file of that name in a folder or below it."""
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
            content = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {describe_error(error)}") from None
    if len(content) > MOST_BYTES:
        raise InputError(f"larger than {MOST_BYTES / 1e6:g} MB, but a smaller file was wanted")
    return content


def _greys(content: bytes) -> Array:
    """Return the greys of a picture from 0 (black) to 1 (white), (rows, columns), the top row first."""
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
