"""Reading of maps from files, texts and JSON documents, and the bundled maps."""

import json
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

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
from robocov.files.paths import is_existing_file
from robocov.files.strictjson import locate_issues, parse_json, read_bytes, require_json
from robocov.mapfile.density_images import read_gray_levels, read_image_file
from robocov.mapfile.models import HEADER, MIN_WEIGHT, DensityModel, RasterModel
from robocov.mapfile.rules import check_rules
from robocov.mapfile.structure import NO_WEIGHT, validate_document
from robocov.typing import FloatArray

_WEIGHT_DECIMALS = 6
"""Decimal places of the weights that are read from an image. They keep the file short if the map is saved."""
_BLANK_BYTES = b"\xef\xbb\xbf \t\r\n"
"""A byte order mark and blanks, which may precede the content of a JSON file."""


def load_map(source: str | Path) -> Environment:
    """Load a map.

    Parameters
    ----------
    source : str or Path
        Path of a map file; or the name of a bundled map, which is a str without a suffix or separator.

    Returns
    -------
    Environment
        The map, which is valid.

    Raises
    ------
    MapError
        If the map cannot be read or is not valid. The message contains the line, the column and the JSON path
        of each issue.
    ParameterError
        If `source` is neither a str nor a path.

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
    content = read_bytes(path)
    stripped = content.lstrip(_BLANK_BYTES)
    # The parser reports an empty file.
    if path.suffix.lower() != ".json" and stripped and not stripped.startswith(b"{"):
        raise MapError(
            f"{to_one_line(str(path))}: expected a robocov map, got a file in another format. "
            "Convert it with `robocov import`."
        )
    return parse_map(content, str(path), path.parent)


def find_map_file(source: str | Path) -> Path:
    """Find the file of a map, as `load_map` does.

    Parameters
    ----------
    source : str or Path
        Path of a map file, or the name of a bundled map; see `load_map`.

    Returns
    -------
    Path
        Path of the file, which may not exist.

    Raises
    ------
    MapError
        If there is no bundled map of this name.
    ParameterError
        If `source` is neither a str nor a path.
    """
    if not isinstance(source, str | PathLike):
        raise ParameterError(f"map: expected a path, or the name of a bundled map, got {quote(source)}")
    if not isinstance(source, str) or any(character in source for character in "./\\\0"):
        return Path(source)
    bundled_maps = list_bundled_maps()
    if source in bundled_maps:
        return bundled_maps[source]
    if is_existing_file(Path(source)):
        return Path(source)
    raise MapError(describe_unknown_name("map", source, bundled_maps))


def list_bundled_maps() -> dict[str, Path]:
    """List the bundled maps.

    Returns
    -------
    dict of str to Path
        Files by the name of the map, sorted by name.

    See Also
    --------
    load_map : Load a map by name or from a file.

    Examples
    --------
    >>> import robocov as rc
    >>> maps = rc.list_bundled_maps()
    >>> maps["rooms"].name
    'rooms.json'
    """
    module_path = Path(__file__).resolve()
    # An installed package contains the maps. In a checkout, they are in a folder next to the sources.
    installed_files = sorted((module_path.parents[1] / "maps").glob("*.json"))
    checkout_files = sorted((module_path.parents[3] / "maps").glob("*.json"))
    return {file.stem: file for file in installed_files or checkout_files}


def parse_map(text: str | bytes, source_name: str, folder: Path | None = None) -> Environment:
    """Parse the text of a map file.

    Parameters
    ----------
    text : str or bytes
        Text of the file.
    source_name : str
        Name of the source in messages, such as the path of the file.
    folder : Path or None
        Folder of the images that the map names; None if the map was not loaded from a file.

    Returns
    -------
    Environment
        The map, which is valid.

    Raises
    ------
    MapError
        If the text is not a valid map; see `load_map`.
    """
    document = parse_json(text, source_name)
    try:
        return _build_environment(document, to_one_line(source_name), folder)
    except MapError as error:
        raise locate_issues(error, text, source_name) from None


def from_json(document: dict[str, Any], source_name: str = "map", folder: Path | None = None) -> Environment:
    """Build the map that a JSON document describes.

    Parameters
    ----------
    document : dict
        Content of a map file.
    source_name : str
        Name of the source in messages, such as the path of the file.
    folder : Path or None
        Folder of the images that the map names; None if the map was not loaded from a file.

    Returns
    -------
    Environment
        The map, which is valid.

    Raises
    ------
    MapError
        If the document is not a valid map.
    """
    source_name = to_one_line(source_name)
    require_json(document, source_name)
    return _build_environment(document, source_name, folder)


def parse_density(
    value: object, boundary: Ring, source_name: str = "map", folder: Path | None = None
) -> Density:
    """Build the density that a JSON value describes.

    Parameters
    ----------
    value : object
        Value of the key ``density`` of a map, not None.
    boundary : (k, 2) sequence, m
        Boundary of the map.
    source_name : str
        Name of the source in messages, such as the path of the file.
    folder : Path or None
        Folder of the image that the density may name; None if the map was not loaded from a file.

    Returns
    -------
    Density
        The density.

    Raises
    ------
    MapError
        If the value is not a valid density.
    """
    # The density is validated as part of a map.
    document = {**HEADER, "name": "map", "boundary": [[0, 0], [1, 0], [1, 1]], "density": value}
    model = validate_document(document, source_name)
    density: Density = _build_density(model.density, boundary, folder, source_name)
    return density


def _build_environment(document: object, source_name: str, folder: Path | None) -> Environment:
    """Build and check the map that a document describes."""
    model = validate_document(document, source_name)
    boundary: Any = model.boundary
    density = None
    if model.density is not None:
        density = _build_density(model.density, boundary, folder, source_name)
    # Make a copy of plain dicts that shares no objects with the document.
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
    check_rules(environment, source_name)
    return environment


def _build_density(model: DensityModel, boundary: Ring, folder: Path | None, source_name: str) -> Any:
    """Build the density that a model describes.

    A raster without an extent covers the bounding box of the boundary. The folder contains the map and its
    image; it is None if the map was not loaded from a file.
    """
    if not isinstance(model, RasterModel):
        return model.build()
    if model.rows is not None:
        values = np.array(model.rows, dtype=float)
        # Smaller weights are read as 0. Those of an image are rounded to multiples of more than `MIN_WEIGHT`.
        values[values < MIN_WEIGHT] = 0.0
    else:
        values = _read_weights(model, folder, source_name)
    x_min, y_min, x_max, y_max = model.extent or _find_extent(boundary, source_name)
    # A map lists the top row first, a `Raster` the lowest one.
    return Raster(values[::-1], (x_min, y_min, x_max, y_max), model.interpolation)


def _find_extent(boundary: Ring, source_name: str) -> tuple[float, float, float, float]:
    """Return the bounding box of a boundary; raise MapError if it has no width or no height."""
    x, y = zip(*boundary, strict=True)
    width = max(x) - min(x)
    height = max(y) - min(y)
    if not (width > 0.0 and height > 0.0):
        message = f"expected a width and a height above 0, got {width:g} m x {height:g} m"
        raise MapError.from_issues(source_name, [Issue.at_path(("boundary",), message)])
    return min(x), min(y), max(x), max(y)


def _read_weights(model: RasterModel, folder: Path | None, source_name: str) -> FloatArray:
    """Read the weights of the pixels of an image, (rows, columns), the top row first."""
    path = ("density", "image")
    black = 0.0 if model.black is None else model.black
    white = 1.0 if model.white is None else model.white
    try:
        gray_levels = read_gray_levels(read_image_file(str(model.image), folder))
    except InputError as error:
        issue = Issue.at_path(path, f"{quote_json(model.image)}: {error}")
        raise MapError.from_issues(source_name, [issue]) from None
    weights = np.round(black + (white - black) * gray_levels, _WEIGHT_DECIMALS)
    if not weights.max() > 0.0:
        raise MapError.from_issues(source_name, [Issue.at_path(path, NO_WEIGHT)])
    return np.asarray(weights)
