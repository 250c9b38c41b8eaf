"""Arenas of the simulator ARGoS: https://www.argos-sim.info/user_manual.php.

C. Pinciroli et al., ARGoS: a modular, parallel, multi-engine simulator for multi-robot systems, Swarm
Intelligence 6 (2012), 271-295.

Boxes and cylinders are obstacles, whether they can be moved or not; other bodies are robots, whose places are
a start. Of what is distributed, the methods ``grid`` and ``constant`` are followed; what is distributed at
random is left out and counted: only ARGoS can tell from the seed where it puts it.
"""

import math
from pathlib import Path

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import Array
from robocov.errors import quote, to_one_line
from robocov.mapfile.models import MAX_SIZE_M
from robocov_app.formats.files.xml_tree import Element, read_xml_tree
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.frames import UNIT_SQUARE, build_frame, transform_points
from robocov_app.formats.geometry.shapes import Shapes
from robocov_app.formats.options import ReadOptions

MOST_PLACED = 4_000  # entities that a file places in a grid or at one place
_UPRIGHT = 1e-6  # bodies that are turned about other axes than z by more are tilted, in degrees


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return b"<argos-configuration" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    root = read_xml_tree(path, "argos-configuration", "an experiment of ARGoS")
    arena = root.find_child("arena")
    if arena is None:
        root.refuse("no <arena>")
    shapes = Shapes(root.where, options)
    size = _lengths(arena, "size")[:2]
    corner = arena.parse_numbers("center", count=3, default="0,0,0")[:2] - size / 2
    world = MultiPolygon([shapely.box(*corner, *(corner + size))])
    for child in arena.children:
        if child.tag == "distribute":
            _distribute(child, shapes)
        elif (body := child.find_child("body")) is not None:
            position = body.parse_numbers("position", count=3, default="0,0,0")
            _place(child, position, body.parse_numbers("orientation", count=3, default="0,0,0"), shapes)
    return shapes.build_foreign_map(path.stem, "An arena of ARGoS, imported.", solid=True, world=world)


def _distribute(element: Element, shapes: Shapes) -> None:
    parts = {tag: element.find_child(tag) for tag in ("position", "orientation", "entity")}
    position, orientation, entity = parts.values()
    if position is None or orientation is None or entity is None or not entity.children:
        element.refuse("expected <position>, <orientation> and <entity> with something in it")
    quantity = int(entity.parse_numbers("quantity", count=1)[0])
    thing = entity.children[0]
    methods = [part.attributes.get("method", "") for part in (position, orientation)]
    if methods[0] not in ("grid", "constant") or methods[1] != "constant":
        shapes.leave_out(to_one_line(thing.tag)[:30], "that ARGoS places at random", max(quantity, 0))
        return
    if not 0 <= quantity <= MOST_PLACED:
        entity.refuse(f"expected a number from 0 to {MOST_PLACED}, got quantity {quantity}")
    turn = orientation.parse_numbers("values", count=3)
    if methods[0] == "constant":
        places = [position.parse_numbers("values", count=3)] * quantity
    else:
        layout = position.parse_numbers("layout", count=3).astype(int)
        if not (layout > 0).all() or math.prod(layout.tolist()) < quantity:
            position.refuse(f"expected one for {quantity}, got layout {layout.tolist()}")
        gaps = position.parse_numbers("distances", count=3)
        first = position.parse_numbers("center", count=3) + (layout - 1) * gaps / 2
        k = np.arange(quantity)
        steps = [k % layout[0], k // layout[0] % layout[1], k // (layout[0] * layout[1])]
        places = [*(first - np.column_stack(steps) * gaps)]
    for place in places:
        _place(thing, place, turn, shapes)


def _place(element: Element, position: Array, turn: Array, shapes: Shapes) -> None:
    """Add a body at a position, m, turned about z, y, x, degrees."""
    tag = element.tag
    labels = [element.attributes.get("id", tag), tag]
    if not shapes.accept(labels):
        return
    if tag not in ("box", "cylinder"):
        shapes.robots.append((float(position[0]), float(position[1])))
    elif (np.abs((turn[1:] + 90) % 180 - 90) > _UPRIGHT).any():
        shapes.leave_out(tag, "that is tilted")
    elif tag == "box":
        ring = UNIT_SQUARE * _lengths(element, "size")[:2]
        place = build_frame(position[0], position[1], math.radians(turn[0]))
        shapes.add_outline([transform_points(place, ring)], labels, at=f"line {element.line}")
    else:
        radius = float(_lengths(element, "radius", count=1)[0])
        shapes.add_circle(position[:2], radius, labels, at=f"line {element.line}")


def _lengths(element: Element, name: str, count: int = 3) -> Array:
    values = element.parse_numbers(name, count=count)
    if not (values[:2].min() >= 1e-6 and values[:2].max() <= MAX_SIZE_M):
        element.refuse(f"expected lengths above 0, got {name} {quote(element.attributes[name])}")
    return values
