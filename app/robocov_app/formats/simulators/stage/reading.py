"""Worlds of the simulator Stage: https://player-stage-manual.readthedocs.io/en/latest/WORLDFILES/.

A world file contains a tree of models with properties, macros on which models are based, and includes of
other files. The property ``size`` determines the size of a model: its bitmap or blocks are scaled to it.

R. Vaughan, Massively multi-robot simulation in Stage, Swarm Intelligence 2 (2008), 189-208.

Models are obstacles unless nothing collides with them (``obstacle_return 0`` and no ``ranger_return``);
positions of robots (``position``) become starts; sensors and other devices are left out. The map is the
largest model with a bitmap or a ``boundary`` that contains most of the others.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import shapely
from shapely import MultiPolygon, Point

from robocov.errors import to_one_line
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.polygons import to_multipolygon
from robocov_app.formats.geometry.shapes.collection import ClosedOutline, Shapes
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.simulators.stage.entities import parse_world
from robocov_app.formats.simulators.stage.placement import Floorplan, ModelPlacer
from robocov_app.formats.simulators.stage.tokens import read_tokens

MODELS = re.compile(rb"^\s*(?:define\s+\S+\s+\S+|floorplan|model|position|window)\s*\(", re.MULTILINE)


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return path.suffix.lower() == ".world" and MODELS.search(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a world with its includes and bitmaps.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    shapes = Shapes(to_one_line(path), options)
    find_file = partial(
        files.find_named_file, path, notes=shapes.notes, allow_anywhere=shapes.options.anywhere
    )
    world = parse_world(read_tokens(path, find_file), shapes.source_name)
    placer = ModelPlacer(world, shapes, find_file)
    placer.place_all()
    floorplans = sorted(placer.floorplans, key=lambda floorplan: -floorplan.box.area)
    positions = [outline.area.representative_point() for outline in shapes.outlines]
    positions += [floorplan.box.centroid for floorplan in floorplans]
    positions += [Point(x, y) for x, y in shapes.robots]
    main = _choose_map(floorplans, positions)
    for floorplan in floorplans:
        if floorplan is not main:
            _add_walls(floorplan, shapes)
    shapes.cell = max((plan.cell for plan in floorplans if plan.cell is not None), default=None)
    name = world.root.get_text("name") or path.stem
    return _build_map(shapes, name, None if main is None else main.free)


def _choose_map(floorplans: Sequence[Floorplan], positions: Sequence[Point]) -> Floorplan | None:
    """Return the first floor plan that contains most of the positions, m, or None."""
    for floorplan in floorplans:
        if shapely.covers(floorplan.box, positions).mean() > 0.5:
            return floorplan
    return None


def _add_walls(floorplan: Floorplan, shapes: Shapes) -> None:
    """Add the dark part of a floor plan that is not the map."""
    walls = to_multipolygon(shapely.difference(floorplan.box, floorplan.free))
    if not walls.is_empty:
        shapes.outlines.append(ClosedOutline(walls, floorplan.labels))


def _build_map(shapes: Shapes, name: str, free: MultiPolygon | None) -> ForeignMap:
    """Build the map; if `free` is None, the free space is the area within the outer walls."""
    boundary_source = ""
    if free is None and shapes.outlines:
        surrounding = shapes.find_surrounding()
        free = surrounding.area
        boundary_source = surrounding.source
    foreign = shapes.build_foreign_map(name, "A world of Stage, imported.", solid=True, world=free)
    if boundary_source:
        foreign = replace(foreign, boundary_source=boundary_source)
    return foreign
