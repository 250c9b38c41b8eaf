"""Arenas of the simulator ARGoS: https://www.argos-sim.info/user_manual.php.

C. Pinciroli et al., ARGoS: a modular, parallel, multi-engine simulator for multi-robot systems, Swarm
Intelligence 6 (2012), 271-295.

Boxes and cylinders are obstacles, whether or not they can be moved. Other bodies are robots, and their
positions become starts. Entities distributed by the methods ``grid`` and ``constant`` are placed. Randomly
placed entities are left out and counted: only ARGoS can compute their positions from the seed.
"""

import math
from pathlib import Path

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.errors import quote, to_one_line
from robocov.mapfile.models import MAX_SIZE_M
from robocov.typing import FloatArray
from robocov_app.formats.files.xml_tree import Element, read_xml_tree
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.frames import UNIT_SQUARE, build_frame, transform_points
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions

MAX_PLACED_ENTITIES = 4_000
"""Maximum number of entities that a file distributes in a grid or at one position."""
_MAX_TILT_DEG = 1e-6
"""Bodies rotated by more than this about an axis other than z are tilted."""
_MAX_TAG_CHARACTERS = 30
_MIN_LENGTH_M = 1e-6


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return b"<argos-configuration" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the arena of an experiment.

    Raises
    ------
    MapError
        If the file is not an experiment, or has no arena.
    """
    root = read_xml_tree(path, "argos-configuration", "an experiment of ARGoS")
    arena = root.find_child("arena")
    if arena is None:
        root.raise_error("no <arena>")
    shapes = Shapes(root.source_name, options)
    size = _parse_lengths(arena, "size")[:2]
    corner = arena.parse_numbers("center", count=3, default="0,0,0")[:2] - size / 2
    world = MultiPolygon([shapely.box(*corner, *(corner + size))])
    for child in arena.children:
        if child.tag == "distribute":
            _distribute(child, shapes)
            continue
        body = child.find_child("body")
        if body is not None:
            position = body.parse_numbers("position", count=3, default="0,0,0")
            orientation = body.parse_numbers("orientation", count=3, default="0,0,0")
            _place(child, position, orientation, shapes)
    return shapes.build_foreign_map(path.stem, "An arena of ARGoS, imported.", solid=True, world=world)


def _distribute(element: Element, shapes: Shapes) -> None:
    """Place the entities of a <distribute>, or count them as left out if ARGoS places them at random."""
    position = element.find_child("position")
    orientation = element.find_child("orientation")
    entity = element.find_child("entity")
    if position is None or orientation is None or entity is None or not entity.children:
        element.raise_error("expected <position>, <orientation> and <entity> with something in it")
    quantity = int(entity.parse_numbers("quantity", count=1)[0])
    body = entity.children[0]
    method = position.attributes.get("method", "")
    if method not in ("grid", "constant"):
        count = max(quantity, 0)
        if shapes.accept(_list_labels(body), count):
            tag = to_one_line(body.tag)[:_MAX_TAG_CHARACTERS]
            shapes.count_omission(tag, "that ARGoS places at random", count)
        return
    if not 0 <= quantity <= MAX_PLACED_ENTITIES:
        entity.raise_error(f"expected a number from 0 to {MAX_PLACED_ENTITIES}, got quantity {quantity}")
    angles = _parse_common_angles(orientation)
    if method == "constant":
        positions = [position.parse_numbers("values", count=3)] * quantity
    else:
        positions = list(_compute_grid_positions(position, quantity))
    for point in positions:
        _place(body, point, angles, shapes)


def _parse_common_angles(element: Element) -> FloatArray:
    """Return the angles of all entities of a <distribute>, (3,) degrees about z, y and x; nan if random."""
    method = element.attributes.get("method", "")
    if method == "constant":
        return element.parse_numbers("values", count=3)
    if method == "uniform":
        lowest = element.parse_numbers("min", count=3)
        highest = element.parse_numbers("max", count=3)
        return np.where(lowest == highest, lowest, np.nan)
    if method == "gaussian":
        means = element.parse_numbers("mean", count=3)
        deviations = element.parse_numbers("std_dev", count=3)
        return np.where(deviations == 0.0, means, np.nan)
    return np.full(3, np.nan)


def _compute_grid_positions(element: Element, quantity: int) -> FloatArray:
    """Return the positions of entities in a grid, (quantity, 3) m, in the order in which ARGoS fills it."""
    layout = element.parse_numbers("layout", count=3).astype(int)
    if not (layout > 0).all() or math.prod(layout.tolist()) < quantity:
        element.raise_error(f"expected one for {quantity}, got layout {layout.tolist()}")
    columns, rows, _ = layout
    distances = element.parse_numbers("distances", count=3)
    first = element.parse_numbers("center", count=3) + (layout - 1) * distances / 2
    k = np.arange(quantity)
    steps = np.column_stack([k % columns, k // columns % rows, k // (columns * rows)])
    positions: FloatArray = first - steps * distances
    return positions


def _list_labels(element: Element) -> list[str]:
    """Return the names by which an entity can be selected: its id if it has one, and its tag."""
    tag = element.tag
    return [element.attributes.get("id", tag), tag]


def _place(element: Element, position: FloatArray, angles: FloatArray, shapes: Shapes) -> None:
    """Add a body as an obstacle or a robot.

    Parameters
    ----------
    element : Element
        The body.
    position : (3,) array, m
    angles : (3,) array, degrees
        Angles of rotation about z, y and x; nan if only ARGoS knows them.
    shapes : Shapes
    """
    tag = element.tag
    labels = _list_labels(element)
    if not shapes.accept(labels):
        return
    if tag not in ("box", "cylinder"):
        shapes.robots.append((float(position[0]), float(position[1])))
        return
    # Rotations by 180 degrees do not tilt boxes and cylinders.
    tilt = np.abs((angles[1:] + 90) % 180 - 90)
    if (tilt > _MAX_TILT_DEG).any():
        shapes.count_omission(tag, "with a tilt")
        return
    # Turning a cylinder about z does not change its outline.
    outline_angles = angles if tag == "box" else angles[1:]
    if np.isnan(outline_angles).any():
        shapes.count_omission(tag, "that ARGoS turns at random")
    elif tag == "box":
        ring = UNIT_SQUARE * _parse_lengths(element, "size")[:2]
        frame = build_frame(position[0], position[1], math.radians(angles[0]))
        shapes.add_outline([transform_points(frame, ring)], labels, location=f"line {element.line}")
    else:
        radius = float(_parse_lengths(element, "radius", count=1)[0])
        shapes.add_circle(position[:2], radius, labels, location=f"line {element.line}")


def _parse_lengths(element: Element, name: str, count: int = 3) -> FloatArray:
    """Return the lengths in an attribute, m; the first two must be positive and at most `MAX_SIZE_M`."""
    values = element.parse_numbers(name, count=count)
    lengths = values[:2]
    if not (lengths.min() >= _MIN_LENGTH_M and lengths.max() <= MAX_SIZE_M):
        expected = f"expected lengths above 0 and up to {MAX_SIZE_M:g} m"
        element.raise_error(f"{expected}, got {name} {quote(element.attributes[name])}")
    return values
