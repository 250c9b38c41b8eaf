"""The picture of a world of IR-SIM, whose dark cells are obstacles."""

import importlib.util
from pathlib import Path

import numpy as np

from robocov.errors import MapError, quote, to_one_line
from robocov.typing import BoolArray
from robocov_app.formats import files
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.raster.picture import describe_transparency, read_picture
from robocov_app.formats.simulators.irsim.node import Node

_MAX_LISTED_PICTURES = 20


def read_obstacle_map(world: Node, path: Path, shapes: Shapes) -> BoolArray:
    """Read the picture of a world.

    Parameters
    ----------
    world : Node
    path : Path
        File of the world.
    shapes : Shapes
        Contains the options, and collects the notes.

    Returns
    -------
    (rows, columns) array of bool
        Whether cells are free, the top row first.

    Raises
    ------
    MapError
        If there is no such picture, or it cannot be read.
    """
    source = _get_source(world["obstacle_map"])
    # Notes name the location without the file.
    _, _, location = source.location.rpartition(": ")
    file = files.find_named_file(
        path,
        source.get_text(),
        "image",
        location=source.location,
        notes=shapes.notes,
        allow_anywhere=shapes.options.anywhere,
    )
    if not file.is_file():
        file = _find_packaged_picture(source)
        shapes.notes.append(f"{location}: {quote(file.name)} read from the installed ir-sim")
    picture = read_picture(file, to_one_line(file))
    step = int(world["mdownsample"].parse_number(1.0))
    if step < 1:
        world["mdownsample"].raise_error("a number from 1")
    is_free = 2 * picture.level.astype(np.uint32) >= picture.max_level
    transparency = describe_transparency(picture)
    if transparency:
        shapes.notes.append(f"{location}: {transparency}")
        if not is_free.any():
            raise MapError(f"{to_one_line(file)}: no cell is free: {transparency}")
    # IR-SIM takes every nth row, counted from the bottom.
    return is_free[::-1][::step, ::step][::-1]


def _get_source(obstacle_map: Node) -> Node:
    """Return the node with the name of the picture: `obstacle_map` itself, or the ``path`` in it."""
    if not isinstance(obstacle_map.value, dict):
        return obstacle_map
    if obstacle_map["name"].get_text() != "image":
        name = quote(obstacle_map["name"].value)
        raise MapError(f"{obstacle_map.location}: expected an image, got {name}, which IR-SIM generates")
    return obstacle_map["path"]


def _find_packaged_picture(source: Node) -> Path:
    """Return a picture that is installed with IR-SIM, as IR-SIM does if there is no such file.

    The package IR-SIM is only located, not imported.

    Raises
    ------
    MapError
        If IR-SIM is not installed, or has no such picture.
    """
    name = source.get_text()
    missing = (
        f"{source.location}: expected an image next to the file, or an image of IR-SIM, got {quote(name)}"
    )
    package = importlib.util.find_spec("irsim")
    if package is None or not package.submodule_search_locations:
        raise MapError(f"{missing}. IR-SIM is not installed (pip install ir-sim).")
    folder = Path(package.submodule_search_locations[0]) / "world" / "map"
    pictures = {file.name: file for file in sorted(folder.rglob("*.png"), reverse=True)}
    if name not in pictures:
        listed = ", ".join(sorted(pictures)[:_MAX_LISTED_PICTURES])
        known = f" (it has {listed})" if pictures else ""
        raise MapError(f"{missing}. The installed IR-SIM has no such image{known}.")
    return pictures[name]
