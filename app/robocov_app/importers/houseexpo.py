"""HouseExpo floor plans: one JSON file a house, its free space as one ring ``verts`` in metres."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import shapely
from shapely import Polygon

from robocov.environment import Environment, PolygonObstacle
from robocov.errors import MapError, ParameterError, shown
from robocov.mapfile import from_json, to_json
from robocov.mapmodels import FARTHEST
from robocov.robots import DEFAULT_RADIUS
from robocov.starts import GAP, DiscStart, StartSpec, UniformStart
from robocov.strictjson import one_line, parse, read_bytes, shown_json
from robocov_app.importers.report import ImportReport

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.environment import Point, Ring

FORMAT = "houseexpo"
DEFAULT_TOLERANCE = 0.02
"""Plans are drawn on a grid of 1 cm, with corners cut by a step or two of it."""

_MIN_HOLE = 1e-4
"""Holes smaller than this, in m², come of rounding."""


def is_houseexpo(path: Path, content: bytes) -> bool:
    """Return whether the file at `path` with this `content` looks like a HouseExpo plan."""
    return path.suffix.lower() == ".json" and b'"verts"' in content


def import_houseexpo(
    path: str | Path,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    default_start: Literal["room", "uniform"] = "room",
) -> tuple[Environment, ImportReport]:
    """Return the floor plan at `path` as an environment.

    The ring may be closed or not, repeat vertices and cross itself; of several parts the
    largest is kept. Doors and furniture are not in the format.

    Parameters
    ----------
    path : str or Path
    tolerance : float, m
        Walls may move by so much, and corners by twice as much, where that saves vertices; 0 keeps all.
    default_start : str
        Which start comes first: ``room``, a disc at the roomiest place, or ``uniform``.

    Raises
    ------
    MapError
        When the file cannot be read, is not such a plan, or has no room for a robot.
    ParameterError
        When an option is out of range.
    """
    if not 0.0 <= tolerance <= 10.0:
        raise ParameterError(f"tolerance: {shown(tolerance)}, but a number from 0 to 10 (m) was wanted")
    if default_start not in ("room", "uniform"):
        raise ParameterError(f"default start: {shown(default_start)}, but room or uniform was wanted")
    path = Path(path)
    where = one_line(path)
    document = parse(read_bytes(path), where)
    vertices = _vertices(document, where)

    repaired: list[str] = []
    dropped: list[str] = []
    parts = _parts(vertices, where, repaired)
    if len(parts) > 1:
        area = sum(part.area for part in parts[1:])
        dropped.append(f"{len(parts) - 1} separate parts of {area:.3g} m² together")
    plan = _simplified(parts[0], tolerance)
    holes = [Polygon(hole) for hole in plan.interiors]
    small = [hole for hole in holes if hole.area < _MIN_HOLE]
    if small:
        dropped.append(f"{len(small)} holes of {sum(hole.area for hole in small):.2g} m² together")
    environment = Environment(
        name=_name(document, path),
        description=_description(document),
        boundary=_points(plan.exterior),
        obstacles=tuple(PolygonObstacle(_points(hole.exterior)) for hole in holes if hole.area >= _MIN_HOLE),
    )
    environment = replace(environment, starts=_starts(environment, default_start, where))
    kept = sum(len(ring.coords) - 1 for ring in (plan.exterior, *plan.interiors))
    # through the rules of map files: what is imported can be saved and loaded
    environment = from_json(to_json(environment), where)
    report = ImportReport(
        source=str(path),
        format=FORMAT,
        vertices_read=len(vertices),
        vertices_kept=kept,
        area_read=float(sum(part.area for part in parts)),
        area_kept=environment.free_area,
        repaired=tuple(repaired),
        dropped=tuple(dropped),
    )
    return environment, report


def _vertices(document: Any, where: str) -> Array:
    """Return the vertices of the file as (k, 2) m."""
    if not isinstance(document, dict) or "verts" not in document:
        raise MapError(f'{where}: not a HouseExpo plan, but an object with "verts" was wanted')
    given = document["verts"]
    if not isinstance(given, list) or len(given) < 3:
        raise MapError(
            f"{where}: verts: {shown_json(given)}, but a list of at least 3 points [x, y] was wanted"
        )
    for k, point in enumerate(given):
        good = isinstance(point, list) and len(point) == 2
        if not good or not all(type(value) in (int, float) and abs(value) <= FARTHEST for value in point):
            raise MapError(
                f"{where}: verts[{k}]: {shown_json(point)}, but a point [x, y] in metres was wanted"
            )
    return np.array(given, dtype=float)


def _parts(vertices: Array, where: str, repaired: list[str]) -> list[Polygon]:
    """Return the valid polygons that the ring of `vertices` stands for, the largest first."""
    ring = vertices[(vertices != np.roll(vertices, 1, axis=0)).any(axis=1)]
    if len(ring) < len(vertices):
        repaired.append(f"{len(vertices) - len(ring)} repeated vertices taken out")
    if len(ring) < 3:
        raise MapError(f"{where}: verts: {len(ring)} different points, but at least 3 were wanted")
    polygon = Polygon(ring)
    if polygon.is_valid:
        return [polygon]
    repaired.append(f"the outline met itself: {shapely.is_valid_reason(polygon)}")
    valid = shapely.make_valid(polygon, method="structure", keep_collapsed=False)
    parts = [part for part in shapely.get_parts(valid) if part.area > 0.0]
    if not parts:
        raise MapError(f"{where}: verts: area 0 m², but an outline with an area was wanted")
    return sorted(parts, key=lambda part: (-part.area, part.bounds))


def _simplified(plan: Polygon, tolerance: float) -> Polygon:
    """Return `plan` with fewer vertices, or as it is where that would break it."""
    rings = [_sharpened(np.asarray(ring.coords)[:-1], tolerance) for ring in (plan.exterior, *plan.interiors)]
    sharp = Polygon(rings[0], rings[1:])
    simple = (sharp if sharp.is_valid else plan).simplify(tolerance, preserve_topology=True)
    return simple if simple.is_valid and not simple.is_empty else plan


def _sharpened(ring: Array, tolerance: float) -> Array:
    """Return the (k, 2) ring with its cut corners made whole.

    A run of edges of at most 1.5 `tolerance` becomes the point where the long edges before and
    after it meet when they are drawn on, if all of the run is within 2 `tolerance` of that
    point: unlike a plain simplification, it keeps the directions of the walls.
    """
    points: list[Point] = [(float(x), float(y)) for x, y in ring]
    count = len(points)
    long = [k for k in range(count) if math.dist(points[k], points[(k + 1) % count]) > 1.5 * tolerance]
    if len(long) < 3:
        return ring
    sharp: list[Point] = []
    for this, following in zip(long, [*long[1:], long[0] + count], strict=True):
        run = [points[k % count] for k in range(this + 1, following + 1)]
        beyond = points[(following + 1) % count]
        corner = _meeting(points[this], run[0], run[-1], beyond) if len(run) > 1 else None
        if corner is not None and max(math.dist(corner, point) for point in run) <= 2 * tolerance:
            run = [corner]
        sharp += run
    return np.array(sharp)


def _meeting(a: Point, b: Point, c: Point, d: Point) -> Point | None:
    """Return where the lines a-b and c-d meet, or None where they are nearly parallel."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    cross = ux * vy - uy * vx
    if abs(cross) <= 0.1 * math.hypot(ux, uy) * math.hypot(vx, vy):
        return None
    part = ((c[0] - a[0]) * vy - (c[1] - a[1]) * vx) / cross
    return (a[0] + part * ux, a[1] + part * uy)


def _points(ring: BaseGeometry) -> Ring:
    # a tenth of a millimetre is finer than any plan, and reads well
    return tuple((round(x, 4), round(y, 4)) for x, y in list(ring.coords)[:-1])


def _starts(environment: Environment, default: str, where: str) -> dict[str, StartSpec]:
    """Return the starts: a disc at the roomiest place, and everywhere."""
    free = environment.free
    clearance = DEFAULT_RADIUS * (1 + GAP)
    if free.is_empty or free.buffer(-clearance).is_empty:
        raise MapError(f"{where}: no place is wide enough for a robot of radius {DEFAULT_RADIUS:g} m")
    spoke = shapely.maximum_inscribed_circle(max(free.geoms, key=lambda part: part.area), tolerance=0.01)
    x, y = spoke.coords[0]
    # the disc holds centres: one robot's radius stays between it and the walls
    radius = max(spoke.length - clearance, 0.01)
    disc = DiscStart((round(x, 2), round(y, 2)), math.floor(100 * min(radius, 2.0)) / 100)
    starts: dict[str, StartSpec] = {"room": disc, "uniform": UniformStart()}
    return starts if default == "room" else dict(reversed(starts.items()))


def _name(document: dict[str, Any], path: Path) -> str:
    given = document.get("id")
    name = given if isinstance(given, str) and given else path.stem
    return f"HouseExpo {one_line(name)[:60]}"


def _description(document: dict[str, Any]) -> str:
    rooms = document.get("room_num")
    counted = f" of {rooms} rooms" if type(rooms) is int and rooms > 1 else ""
    return f"A floor plan{counted}, imported from HouseExpo."
