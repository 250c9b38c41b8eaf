"""OpenStreetMap extracts, in meters east and north of their middle.

Outdoors, buildings (including relations of several ways) and water (unless the option ``water`` makes it
free) are solid; walls, fences, hedges and the like are walls with the width of their tag ``width`` or of the
option ``thickness``; bollards, blocks and trees are points. The bounds are the boundary. Underground
elements, roofs, and ways whose nodes are missing from the extract are left out.

Indoors (https://wiki.openstreetmap.org/wiki/Simple_Indoor_Tagging), the rooms, corridors and areas of one
level are free; rooms have walls, interrupted by doors; ``indoor=wall`` is a wall; stairs and elevators are
solid. The inside is read if the option ``level`` names a floor, or if spaces cover most of the buildings'
area.
"""

from pathlib import Path

from robocov.errors import ParameterError, quote
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geodata.building_floor import build_floor, choose_floor, list_floors
from robocov_app.formats.geodata.osm.indoors import is_indoor, list_floor_elements, measure_floors
from robocov_app.formats.geodata.osm.outdoors import add_outdoors
from robocov_app.formats.geodata.osm.parsing import is_osm, read_osm
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions

_DESCRIPTION = "Imported from OpenStreetMap, © OpenStreetMap contributors."


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return is_osm(head)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read an extract: a floor of a building, or the outdoors.

    Raises
    ------
    MapError
        If the file is not an extract, or contains no shapes.
    ParameterError
        If the option ``level`` names a floor that the extract does not have.
    """
    data = read_osm(path)
    shapes = Shapes(data.source_name, options)
    shapes.notes += data.notes
    floors = measure_floors(data)
    if options.level is not None and not floors:
        actual = quote(options.level)
        raise ParameterError(
            f"{data.source_name}: level: expected no level, got {actual}. The file has no indoor spaces."
        )
    name = files.get_map_name(path)
    if floors and (options.level is not None or is_indoor(data, floors)):
        floor = choose_floor(floors, options.level, data.source_name)
        if len(floors) > 1:
            shapes.notes.append(f"level {floor:g} of {list_floors(floors)} (--level)")
        return build_floor(shapes, list_floor_elements(data, floor, shapes), name, _DESCRIPTION)
    if floors:
        levels = list_floors(floors)
        shapes.notes.append(f"indoor spaces on level {levels} left out (--level reads a floor)")
    add_outdoors(data, shapes)
    return shapes.build_foreign_map(name, _DESCRIPTION, solid=True)
