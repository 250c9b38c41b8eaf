"""GeoJSON: the boundary and the obstacles as features with their names, in metres or in degrees."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.errors import ParameterError, RobocovError
from robocov.extras import extra
from robocov.files.atomic import written
from robocov_app.exporters.cells import not_held
from robocov_app.exporters.coordinates import DIGITS, free_area, on_grid, rings
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions
from robocov_app.importers.georeference import local_plane

if TYPE_CHECKING:
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.environment import Environment

_FINER = 5
"""So many more decimals have degrees: one is about a hundred kilometres."""


class _Plane:
    """Coordinates of the file, from metres and back."""

    def __init__(self, origin: tuple[float, float] | None) -> None:
        self.origin = origin
        if origin is not None:
            try:
                self._local = local_plane(extra("pyproj", "geo"), *origin)
            except RobocovError as error:
                raise ParameterError(f"origin: degrees need more: {error}") from None

    def outward(self, geometry: BaseGeometry) -> BaseGeometry:
        """Return a geometry in metres as the file has it."""
        return geometry if self.origin is None else shapely.transform(geometry, self._degrees)

    def back(self, geometry: BaseGeometry) -> BaseGeometry:
        """Return a geometry of the file in metres."""
        return geometry if self.origin is None else shapely.transform(geometry, self._metres)

    def _degrees(self, points: Array) -> Array:
        return np.column_stack(self._local(*points.T, inverse=True))

    def _metres(self, points: Array) -> Array:
        return np.column_stack(self._local(*points.T))


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    plane = _Plane(options.origin)
    digits = DIGITS + (_FINER if options.origin else 0) if options.digits is None else options.digits
    shapes: list[tuple[str, str | None, BaseGeometry]] = [("boundary", None, environment.boundary_polygon)]
    shapes += [("obstacle", obstacle.name, obstacle.polygon) for obstacle in environment.obstacles]
    features, areas, lost = [], [], 0
    for kind, name, shape in shapes:
        parts = on_grid(plane.outward(shape), digits)
        lost += not parts
        areas.append(plane.back(MultiPolygon(parts)))
        if parts:
            features.append(_feature(kind, name, [rings(part) for part in parts]))
    notes = [f"in metres, {digits} decimals; other programs take GeoJSON for degrees (--origin makes them)"]
    if options.origin is not None:
        notes = [f"in degrees about longitude {options.origin[0]:g}, latitude {options.origin[1]:g}"]
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
