"""OpenStreetMap extracts, in metres east and north of their middle.

Buildings, also those that relations make up of several ways, and water (unless the option ``water`` says that
it is free) are solid; walls, fences, hedges and the like are walls of their tag ``width``, or of the option
``thickness``; bollards, blocks and trees are points. The bounds are the boundary. What is below the ground,
roofs, and ways whose nodes the extract lacks are left out.
"""

import re
from array import array
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.errors import MapError, counted, one_line
from robocov_app.formats import files
from robocov_app.formats.base import ForeignMap, ReadOptions
from robocov_app.formats.geometry.shapes import BOUNDARY, Figure, Shapes
from robocov_app.formats.georeference import DEGREES, in_metres

ROOT = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*\?>\s*)?(?:<!--.*?-->\s*)*<osm[\s>]", re.DOTALL)
# barriers that are walls; gates, kerbs and chains are not
_WALLS = {"wall", "city_wall", "retaining_wall", "fence", "hedge", "guard_rail", "jersey_barrier"}
_POSTS = {"bollard", "block", "tree"}
_KEYS = {"area", "barrier", "building", "layer", "location", "name", "natural", "tunnel", "type", "width"}
_KEYS |= {"waterway", "water"}
_OPEN = {"no", "roof"}  # buildings that robots pass: a roof stands on posts
_METRES = re.compile(r"(\d{1,3}(?:\.\d+)?)\s*m?")


@dataclass(eq=False, slots=True)
class _Thing:
    """A node, a way with its nodes, or a relation with its ways."""

    kind: str
    number: int
    tags: dict[str, str] = field(default_factory=dict)
    members: list[int] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, ...]:
        found = [self.tags[key] for key in ("name", "barrier", "building", "natural") if key in self.tags]
        found += [key for key in ("barrier", "building", "natural", "waterway") if key in self.tags]
        return tuple(dict.fromkeys(one_line(label) for label in found if label != "yes"))


def read(path: Path, options: ReadOptions) -> ForeignMap:
    where = one_line(path)
    extract = _Extract(where, files.content(path, files.MAX_TEXT_BYTES))
    shapes = Shapes(where, options)
    figures = list(extract.figures(shapes, water=options.water != "free"))
    origin = None
    if extract.bounds:
        bounds = np.array(extract.bounds)
        (west, _, south, _), (_, east, _, north) = bounds.min(axis=0), bounds.max(axis=0)
        origin = (float(west + east) / 2, float(south + north) / 2)
        corners = np.array([[west, south], [east, south], [east, north], [west, north]])
        figures.append(Figure("polygon", (corners,), (BOUNDARY,), "bounds"))
    shapes.add_all(in_metres(figures, shapes, DEGREES, origin=origin))
    if extract.gates:
        shapes.notes.append(f"{counted(extract.gates, 'gate')} taken as closed")
    text = "Imported from OpenStreetMap, © OpenStreetMap contributors."
    return shapes.foreign_map(files.name_of_map(path), text, solid=True)


class _Extract:
    """Handlers for expat that collect nodes, ways, and the relations that are areas."""

    def __init__(self, where: str, content: bytes) -> None:
        self.where = where
        for start in (b"<node", b"<nd", b"<tag"):  # to count takes a moment, to parse seconds
            files.require_vertices(content.count(start) // (2 if start == b"<tag" else 1), where)
        self.bounds: list[list[float]] = []
        self.gates = self.drawn = 0
        self.places: dict[int, int] = {}
        self.coordinates = array("d")
        self.things: dict[str, dict[int, _Thing]] = {"node": {}, "way": {}, "relation": {}}
        self.thing: _Thing | None = None
        self.depth = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = lambda *_: self._refuse("a document type, but none was wanted")
        try:
            self.parser.Parse(content, True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            line = self.parser.ErrorLineNumber
            raise MapError(f"{where}:{line}: not XML: {one_line(error)[:80]}") from None

    def figures(self, shapes: Shapes, *, water: bool) -> Iterable[Figure]:
        """Yield what stands on the ground, in degrees; tell `shapes` what is left out."""
        points = np.array(self.coordinates).reshape(-1, 2)
        for thing in (thing for kind in self.things.values() for thing in kind.values()):
            at, tags = f"{thing.kind} {thing.number}", thing.tags
            built = tags.get("building", "no") not in _OPEN
            wet = tags.get("natural") == "water" or tags.get("waterway") == "riverbank"
            wall = tags.get("barrier") in _WALLS
            post = thing.kind == "node" and bool(_POSTS & {tags.get("barrier"), tags.get("natural")})
            if not (built or wall or post or (wet and water)):
                continue
            under = tags.get("location") == "underground" or tags.get("layer", "0").startswith("-")
            if under or tags.get("tunnel", "no") != "no":
                shapes.leave_out("thing", "below the ground")
            elif thing.kind == "node":
                if post:
                    yield Figure("point", (points[[self.places[thing.number]]],), thing.labels, at)
            elif (lines := self._lines(thing, points)) is None:
                shapes.leave_out(thing.kind, "of which the file does not have all")
            elif thing.kind == "way" and wall and not built and tags.get("area") != "yes":
                width = _METRES.fullmatch(tags.get("width", "").strip())
                yield Figure("line", (lines[0],), thing.labels, at, width=float(width[1]) if width else None)
            else:
                merged = shapely.line_merge(shapely.MultiLineString([shapely.LineString(x) for x in lines]))
                rings = [shapely.get_coordinates(part) for part in shapely.get_parts(merged)]
                if all((ring[0] == ring[-1]).all() for ring in rings):
                    yield Figure("polygon", tuple(rings), thing.labels, at, rule="evenodd")
                else:
                    shapes.leave_out(thing.kind, "that does not close")

    def _lines(self, thing: _Thing, points: Array) -> list[Array] | None:
        """Return the points of each way of something, None where some are missing."""
        ways = [self.things["way"].get(k) for k in thing.members] if thing.kind == "relation" else [thing]
        self.drawn += sum(len(way.members) for way in ways if way)  # a way may be a part of many relations
        files.require_vertices(self.drawn, self.where)
        found = [[self.places.get(k, -1) for k in way.members] if way else [] for way in ways]
        if not found or any(len(places) < 2 or min(places) < 0 for places in found):
            return None
        return [points[places] for places in found]

    def _start(self, name: str, given: dict[str, str]) -> None:
        self.depth += 1
        if self.depth == 1 and name != "osm":
            self._refuse(f"<{one_line(name)[:40]}>, but <osm> was wanted")
        try:
            self._take(name, given)
        except (KeyError, ValueError) as error:
            what = f"no {error.args[0]}" if isinstance(error, KeyError) else one_line(error)[:80]
            self._refuse(f"<{name}>: {what}, but what OpenStreetMap writes was wanted")

    def _take(self, name: str, given: dict[str, str]) -> None:
        thing = self.thing
        if name == "bounds":
            most = {"minlon": 360.0, "maxlon": 360.0, "minlat": 90.0, "maxlat": 90.0}
            self.bounds.append([_degrees(given, key, value) for key, value in most.items()])
        elif self.depth == 2 and name in self.things:
            number = int(given["id"])
            self.thing = _Thing(name, number)
            if given.get("action") == "delete" or given.get("visible") == "false":
                return
            if name == "node":
                self.places[number] = len(self.coordinates) // 2
                self.coordinates.extend((_degrees(given, "lon", 360.0), _degrees(given, "lat", 90.0)))
            else:
                self.things[name][number] = self.thing
        elif thing is None:
            return
        elif name == "nd" or (name == "member" and given["type"] == "way"):
            thing.members.append(int(given["ref"]))
        elif name == "tag" and given["k"] in _KEYS:
            thing.tags[given["k"]] = given["v"]

    def _end(self, name: str) -> None:
        self.depth -= 1
        thing = self.thing
        if self.depth != 1 or thing is None:
            return
        self.thing = None
        if thing.kind == "node" and thing.tags and thing.number in self.places:
            self.gates += thing.tags.get("barrier") in ("gate", "lift_gate")
            self.things["node"][thing.number] = thing
        elif thing.kind == "relation" and thing.tags.get("type") != "multipolygon":
            self.things["relation"].pop(thing.number, None)

    def _refuse(self, what: str) -> NoReturn:
        raise MapError(f"{self.where}:{self.parser.CurrentLineNumber}: {what}")


def _degrees(given: dict[str, str], key: str, most: float) -> float:
    value = float(given[key])
    if not abs(value) <= most:
        raise ValueError(f"{key} {value:g}")
    return value
