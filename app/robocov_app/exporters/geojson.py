"""GeoJSON: the boundary and the obstacles as features with their names, in metres or in degrees."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.errors import ParameterError, RobocovError, shown
from robocov.extras import extra
from robocov.files.atomic import written
from robocov_app.exporters.cells import not_held
from robocov_app.exporters.coordinates import DIGITS, free_area, on_grid, rings
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions
from robocov_app.importers.georeference import LocalPlane

if TYPE_CHECKING:
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

    from robocov.environment import Environment

_FINER = 6
"""So many more decimals have degrees: one is about a hundred kilometres."""


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    origin = options.origin
    digits = DIGITS + (_FINER if origin else 0) if options.digits is None else options.digits
    shapes: list[tuple[str, str | None, BaseGeometry]] = [("boundary", None, environment.boundary_polygon)]
    shapes += [("obstacle", obstacle.name, obstacle.polygon) for obstacle in environment.obstacles]
    features, areas, lost, across = [], [], 0, False
    plane = None if origin is None else _plane(environment, origin)
    for kind, name, shape in shapes:
        if plane is None:
            parts = on_grid(shape, digits)
            areas.append(MultiPolygon(parts))
        else:
            # rounded in metres first, as a reader finds it: what touches there still touches
            exact = MultiPolygon(on_grid(shape, DIGITS))
            parts = on_grid(shapely.transform(exact, plane.degrees), digits)
            areas.append(shapely.transform(MultiPolygon(parts), plane.metres))
            across |= any(max(map(abs, part.bounds[::2])) > 180.0 for part in parts)
        lost += not parts
        if parts:
            features.append(_feature(kind, name, [rings(part) for part in parts]))
    notes = [f"in metres, {digits} decimals; other programs take GeoJSON for degrees (--origin makes them)"]
    if origin is not None:
        notes = [f"in degrees about longitude {origin[0]:.10g}, latitude {origin[1]:.10g}"]
    if across:
        notes.append("longitudes go on beyond 180 degrees: shapes are not cut at the antimeridian")
    if lost:
        notes.append(f"{lost} shapes are nothing with {digits} decimals")
    with written(path) as part:
        part.write_text(_text(environment, options, features), encoding="utf-8")
    return ExportReport(
        EXPORTER.name,
        (path,),
        environment.free_area,
        free_area(areas[0], areas[1:]),
        dropped=tuple(thing for thing in not_held(environment) if not thing.startswith("names")),
        notes=tuple(notes),
    )


def _plane(environment: Environment, origin: tuple[float, float]) -> LocalPlane:
    """Return the plane about a place, if longitudes do not run all around in the map."""
    try:
        plane = LocalPlane(extra("pyproj", "geo"), *origin)
    except RobocovError as error:
        raise ParameterError(f"origin: degrees need more: {error}") from None
    if np.ptp(plane.degrees(np.array(environment.boundary, dtype=float))[:, 0]) >= 180.0:
        wanted = "a place farther from the pole was wanted"
        raise ParameterError(f"origin: {shown(origin)}: longitudes run all around on the map, but {wanted}")
    return plane


def _feature(kind: str, name: str | None, polygons: list[list[list[tuple[float, float]]]]) -> dict[str, Any]:
    many = len(polygons) > 1
    return {
        "type": "Feature",
        "properties": {"kind": kind} if name is None else {"kind": kind, "name": name},
        "geometry": {
            "type": "MultiPolygon" if many else "Polygon",
            "coordinates": polygons if many else polygons[0],
        },
    }


def _text(environment: Environment, options: WriteOptions, features: list[dict[str, Any]]) -> str:
    """Return the document, a feature on a line."""
    head: dict[str, Any] = {"type": "FeatureCollection", "name": environment.name}
    if environment.description:
        head["description"] = environment.description
    head["units"] = "metres" if options.origin is None else "degrees"
    if options.origin is not None:
        head["origin"] = list(options.origin)
    lines = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    members = json.dumps(head, ensure_ascii=False, indent=1).removesuffix("\n}")
    return f'{members},\n "features": [\n{lines}\n]}}\n'


EXPORTER = Exporter(
    name="geojson",
    title="GeoJSON: boundary and obstacles as features, in metres or degrees",
    suffixes=(".geojson",),
    write=_write,
    options=frozenset({"digits", "origin"}),
)
