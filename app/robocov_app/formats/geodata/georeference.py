"""Conversion of coordinates on the globe to meters in a local plane."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from robocov.environment import Point
from robocov.errors import MapError, RobocovError, quote
from robocov.mapfile.models import MAX_SIZE_M
from robocov.optional_imports import import_optional
from robocov.typing import FloatArray
from robocov_app.formats.files import require_shapes
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry
from robocov_app.formats.options import get_or_default

DEGREES = "OGC:CRS84"
"""Longitude and latitude on WGS 84, the system of all GeoJSON (RFC 7946, section 4)."""
_SYSTEMS_IN_DEGREES = (DEGREES, "EPSG:4326")
_UNITS_HINT = "--units meters uses coordinates without conversion"
_AUTHORITIES = ("EPSG", "ESRI", "IGNF", "OGC")
_URN = re.compile(r"(?:urn:(?:x-)?ogc:def:crs:)?([A-Z]{3,4}):(?:[\d.]*:)?([A-Z]*\d{1,9})", re.IGNORECASE)
_ADDRESS = re.compile(r"https?://www\.opengis\.net/def/crs/([A-Za-z]+)/[\d.]+/([A-Za-z]*\d{1,9})")
_DIGITS = 6
"""Decimals of coordinates in meters: they are rounded to a micrometer."""
_EARTH_RADIUS_M = 6_371_000.0
"""Mean radius, used only to tell degrees from meters."""
_MAX_DEGREES = (360.0, 90.0)
"""Maximum longitude and latitude. Longitudes exceed 180 in files that continue beyond the antimeridian."""


def convert_to_meters(
    geometries: list[SourceGeometry],
    shapes: Shapes,
    crs: str | None,
    *,
    may_be_degrees: bool = False,
    origin: Point | None = None,
) -> list[SourceGeometry]:
    """Convert the coordinates of geometries to meters, and add notes on the conversion to `shapes`.

    The option ``units`` takes precedence over the file. If coordinates are neither degrees nor in a reference
    system, the option ``scale`` is the length of their unit in meters.

    Parameters
    ----------
    geometries : list of SourceGeometry
    shapes : Shapes
        Contains the options, and collects the notes.
    crs : str or None
        Reference system that the file names, such as ``EPSG:25832`` or an OGC URN.
    may_be_degrees : bool
        Whether to take coordinates without a reference system as degrees if the map is then at most 10 km
        wide.
    origin : (longitude, latitude), degrees
        Point that becomes [0, 0] of the map. By default, the center of the geometries' bounding box.

    Raises
    ------
    MapError
        If the reference system is unknown, pyproj is missing, or a point cannot be projected.
    """
    if not geometries:
        return geometries
    source_name = shapes.source_name
    scale = shapes.options.scale
    units = shapes.options.units
    require_shapes(sum(geometry.kind != "point" for geometry in geometries), source_name)
    if units == "degrees":
        return _project(geometries, DEGREES, shapes, origin)
    if units is None and crs is not None:
        return _project(geometries, _parse_reference_system(crs, source_name), shapes, origin)
    if units is None and may_be_degrees and _are_degrees(geometries):
        return _project(geometries, DEGREES, shapes, origin)
    if scale not in (None, 1.0):
        shapes.notes.append(f"a unit is {scale:g} m")
    elif may_be_degrees and units is None:
        shapes.notes.append("coordinates treated as meters, because in degrees the map would exceed 10 km")
    if crs is not None:
        shapes.notes.append(f"coordinates of {crs} used without conversion")
    meters_per_unit = get_or_default(scale, 1.0)
    return _replace_points(geometries, _join_points(geometries) * meters_per_unit)


def _join_points(geometries: Sequence[SourceGeometry]) -> FloatArray:
    return np.concatenate([ring for geometry in geometries for ring in geometry.rings])


def _replace_points(geometries: Sequence[SourceGeometry], points: FloatArray) -> list[SourceGeometry]:
    """Replace the points of geometries; the new ones are in the order of `_join_points`."""
    lengths = [len(ring) for geometry in geometries for ring in geometry.rings]
    rings = iter(np.split(points, np.cumsum(lengths)[:-1]))
    replaced = []
    for geometry in geometries:
        new_rings = tuple(islice(rings, len(geometry.rings)))
        replaced.append(replace(geometry, rings=new_rings))
    return replaced


def _are_degrees(geometries: Sequence[SourceGeometry]) -> bool:
    """Return whether coordinates are degrees: they are valid, and the map would be small enough.

    A plan in meters would be hundreds of kilometers wide if its coordinates were taken as degrees.
    """
    points = _join_points(geometries)
    if not (np.abs(points) <= _MAX_DEGREES).all():
        return False
    width, height = np.ptp(_unwrap_longitudes(points, points[0, 0]), axis=0)
    shrinkage = math.cos(math.radians(float(np.abs(points[:, 1]).max())))
    size_rad = max(width * shrinkage, height) * math.radians(1.0)
    return bool(size_rad * _EARTH_RADIUS_M <= MAX_SIZE_M)


def _unwrap_longitudes(points: FloatArray, center: float) -> FloatArray:
    """Return longitudes and latitudes, with all longitudes within 180 degrees of `center`.

    This way, shapes that cross the antimeridian have no jump there.
    """
    longitudes = center + (points[:, 0] - center + 180.0) % 360.0 - 180.0
    return np.column_stack([longitudes, points[:, 1]])


def _parse_reference_system(crs: str, source_name: str) -> str:
    """Return the name of a reference system as AUTHORITY:CODE.

    Full definitions are rejected, because they may name files.
    """
    match = _URN.fullmatch(crs.strip()) or _ADDRESS.fullmatch(crs.strip())
    if match is None or match[1].upper() not in _AUTHORITIES:
        expected = f"expected a code such as EPSG:25832 ({_UNITS_HINT})"
        raise MapError(f"{source_name}: {expected}, got reference system {quote(crs)}")
    return f"{match[1].upper()}:{match[2].upper()}"


def _project(
    geometries: Sequence[SourceGeometry], system: str, shapes: Shapes, origin: Point | None
) -> list[SourceGeometry]:
    """Project geometries to meters east and north of an origin (azimuthal equidistant projection)."""
    pyproj = _import_pyproj(system, shapes.source_name)
    points = _join_points(geometries)
    if system not in _SYSTEMS_IN_DEGREES:
        points = _transform_to_degrees(pyproj, points, system, shapes.source_name)
    is_on_globe = (np.abs(points) <= _MAX_DEGREES).all(axis=1)  # points that cannot be projected are inf
    if not is_on_globe.all():
        x, y = _join_points(geometries)[int(np.argmin(is_on_globe))].tolist()
        expected = f"coordinates of {system}"
        if system in _SYSTEMS_IN_DEGREES:
            expected = "longitude and latitude in degrees"
        raise MapError(
            f"{shapes.source_name}: expected {expected}, got a point at [{x:g}, {y:g}] ({_UNITS_HINT})"
        )
    points = _unwrap_longitudes(points, points[0, 0])
    if origin is None:
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        origin = (float(middle[0]), float(middle[1]))
    longitude, latitude = origin
    points = LocalPlane(pyproj, longitude, latitude).to_meters(points)
    longitude = (longitude + 180.0) % 360.0 - 180.0
    about = f"about longitude {longitude:.5f}, latitude {latitude:.5f} (azimuthal equidistant)"
    label = "degrees" if system in _SYSTEMS_IN_DEGREES else system
    shapes.notes.append(f"{label} projected to meters {about}")
    return _replace_points(geometries, points)


def _import_pyproj(system: str, source_name: str) -> Any:
    try:
        return import_optional("pyproj", "geo")
    except RobocovError as error:
        label = "degrees" if system == DEGREES else system
        raise MapError(f"{source_name}: coordinates in {label}: {error} ({_UNITS_HINT})") from None


def _transform_to_degrees(pyproj: Any, points: FloatArray, system: str, source_name: str) -> FloatArray:
    """Convert points of a reference system to longitude and latitude; inf if that is impossible."""
    try:
        source = pyproj.CRS.from_authority(*system.split(":"))
        transformer = pyproj.Transformer.from_crs(source, DEGREES, always_xy=True)
    except pyproj.exceptions.ProjError:
        raise MapError(f"{source_name}: reference system {system} is unknown ({_UNITS_HINT})") from None
    return np.column_stack(transformer.transform(*points.T))


class LocalPlane:
    """Conversion between degrees and meters east and north of an origin on the globe.

    Azimuthal equidistant on the ellipsoid of WGS 84 (Snyder 1987, Map Projections: A Working Manual,
    section 25): within 5 km of the origin lengths are true to better than a millimeter.
    """

    def __init__(self, pyproj: Any, longitude: float, latitude: float) -> None:
        self._longitude = longitude
        self._project = pyproj.Proj(proj="aeqd", lon_0=longitude, lat_0=latitude, ellps="WGS84")

    def to_meters(self, coordinates: FloatArray) -> FloatArray:
        """Convert longitudes and latitudes, (n, 2), to meters, rounded so that touching walls still touch."""
        return np.round(np.column_stack(self._project(*coordinates.T)), _DIGITS)

    def to_degrees(self, coordinates: FloatArray) -> FloatArray:
        """Convert positions in meters, (n, 2), to longitudes and latitudes.

        Longitudes are within 180 degrees of the origin's.
        """
        return _unwrap_longitudes(
            np.column_stack(self._project(*coordinates.T, inverse=True)), self._longitude
        )
