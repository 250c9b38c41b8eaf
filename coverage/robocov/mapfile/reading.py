"""Read maps from files, strings and JSON documents, and find the bundled ones."""

import json
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.density import Density, Raster
from robocov.environment import Environment, Ring
from robocov.errors import (
    InputError,
    Issue,
    MapError,
    ParameterError,
    describe_unknown_name,
    quote,
    quote_json,
    to_one_line,
)
from robocov.files.strictjson import locate_issues, parse_json, read_bytes, require_json
from robocov.mapfile.density_pictures import read_gray_levels, read_picture_file
from robocov.mapfile.models import HEADER, MIN_WEIGHT, DensityModel, RasterModel
from robocov.mapfile.rules import check_rules
from robocov.mapfile.structure import NO_WEIGHT, validate_document

_GRAY_DIGITS = 6
"""Decimal places of the weights of gray levels, so that a map that is saved again stays short."""


def load_map(source: str | Path) -> Environment:
    """Load a map.

    Parameters
    ----------
    source : str or Path
        Path of a map file, or the name of a bundled map, which is a str without suffix or separator.

    Returns
    -------
    Environment

    Raises
    ------
    MapError
        If the map cannot be read; the message has line, column and JSON path of the first issue.

    See Also
    --------
    list_bundled_maps : Names of the bundled maps.
    save_map : Write a map to a file.
    check_map : Look for likely mistakes in a valid map.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.load_map("rooms").name
    'Rooms'
    """
    path = find_map_file(source)
    return parse_map(read_bytes(path), str(path), path.parent)


def find_map_file(source: str | Path) -> Path:
    """Find the file of a map, as `load_map` does.

    Parameters
    ----------
    source : str or Path
        See `load_map`.

    Returns
    -------
    Path
        It may not exist.

    Raises
    ------
    MapError
        If there is no bundled map of this name.
    """
    if not isinstance(source, str | PathLike):
        raise ParameterError(f"map: expected a path, or the name of a bundled map, got {quote(source)}")
    if not isinstance(source, str) or any(character in source for character in "./\\\0"):
        return Path(source)
    bundled_maps = list_bundled_maps()
    if source in bundled_maps:
        return bundled_maps[source]
    with suppress(OSError):  # The name may be too long for a file.
        if Path(source).is_file():
            return Path(source)
    raise MapError(describe_unknown_name("map", source, bundled_maps))


def list_bundled_maps() -> dict[str, Path]:
    """List the bundled maps.

    Returns
    -------
    dict of str to Path
        Files by name, sorted: those in the installed package, otherwise those in the checkout.

    See Also
    --------
    load_map : Load one of them.

    Examples
    --------
    >>> import robocov as rc
    >>> maps = rc.list_bundled_maps()
    >>> maps["rooms"].name
    'rooms.json'
    """
    here = Path(__file__).resolve()
    in_package = sorted((here.parents[1] / "maps").glob("*.json"))
    in_checkout = sorted((here.parents[3] / "maps").glob("*.json"))
    return {file.stem: file for file in in_package or in_checkout}


def parse_map(text: str | bytes, where: str, folder: Path | None = None) -> Environment:
    """Parse the text of a map file.

    Parameters
    ----------
    text : str or bytes
    where : str
        Name of the file in messages.
    folder : Path or None
        Folder of the images named in the map; None if the map does not come from a file.

    Returns
    -------
    Environment

    Raises
    ------
    MapError
        See `load_map`.
    """
    document = parse_json(text, where)
    try:
        return _build_environment(document, to_one_line(where), folder)
    except MapError as error:
        raise locate_issues(error, text, where) from None


def from_json(document: dict[str, Any], where: str = "map", folder: Path | None = None) -> Environment:
    """Build the map that a JSON document describes.

    Parameters
    ----------
    document : dict
    where : str
        Name of the document in messages.
    folder : Path or None
        Folder of the images named in the map; None if the map does not come from a file.

    Returns
    -------
    Environment

    Raises
    ------
    MapError
        If the document is not a valid map.
    """
    where = to_one_line(where)
    require_json(document, where)
    return _build_environment(document, where, folder)


def parse_density(value: object, boundary: Ring, where: str = "map", folder: Path | None = None) -> Density:
    """Build the density that a JSON value describes.

    Parameters
    ----------
    value : object
        Value of the key ``density`` of a map.
    boundary : (k, 2) sequence, m
        Boundary of the map.
    where : str
        Name of the map in messages.
    folder : Path or None
        Folder of the image that the density may name; None if it does not come from a file.

    Returns
    -------
    Density

    Raises
    ------
    MapError
        If the value is not a valid density.
    """
    # The density is validated as part of a map.
    document = {**HEADER, "name": "map", "boundary": [[0, 0], [1, 0], [1, 1]], "density": value}
    model = validate_document(document, where)
    density: Density = _build_density(model.density, boundary, folder, where)
    return density


def _build_environment(document: object, where: str, folder: Path | None) -> Environment:
    model = validate_document(document, where)
    boundary: Any = model.boundary
    density = None
    if model.density is not None:
        density = _build_density(model.density, boundary, folder, where)
    # A copy with plain dicts, which does not share mutable objects with the document.
    extra = json.loads(json.dumps(model.extra))
    environment = Environment(
        name=model.name,
        boundary=boundary,
        obstacles=tuple(obstacle.build() for obstacle in model.obstacles),
        starts={name: start.build() for name, start in model.starts.items()},
        description=model.description,
        extra=extra,
        schema=model.schema_,
        density=density,
    )
    check_rules(environment, where)
    return environment


def _build_density(model: DensityModel, boundary: Ring, folder: Path | None, where: str) -> Any:
    """Return the density that a model describes.

    A raster without an extent covers the bounding box of the boundary. `folder` contains the map and its
    picture; it is None if the map did not come from a file.
    """
    if not isinstance(model, RasterModel):
        return model.build()
    if model.rows is not None:
        values = np.array(model.rows, dtype=float)
        # Weights of pictures are rounded when they are read, so none of them is as small as this.
        values[values < MIN_WEIGHT] = 0.0
    else:
        values = _read_weights(model, folder, where)
    x, y = zip(*boundary, strict=True)
    x_min, y_min, x_max, y_max = model.extent or (min(x), min(y), max(x), max(y))
    # A map lists the top row first, a `Raster` the lowest one.
    return Raster(values[::-1], (x_min, y_min, x_max, y_max), model.interpolation)


def _read_weights(model: RasterModel, folder: Path | None, where: str) -> Array:
    """Return the weights of the pixels of a picture, (rows, columns), the top row first."""
    path = ("density", "picture")
    black = 0.0 if model.black is None else model.black
    white = 1.0 if model.white is None else model.white
    try:
        gray_levels = read_gray_levels(read_picture_file(str(model.picture), folder))
    except InputError as error:
        issue = Issue.at_path(path, f"{quote_json(model.picture)}: {error}")
        raise MapError.from_issues(where, [issue]) from None
    weights = np.round(black + (white - black) * gray_levels, _GRAY_DIGITS)
    if not weights.max() > 0.0:
        raise MapError.from_issues(where, [Issue.at_path(path, NO_WEIGHT)])
    return np.asarray(weights)
