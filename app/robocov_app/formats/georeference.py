"""Coordinates on the globe, as metres about a place: what a robot's map is in."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.environment import Point
from robocov.errors import MapError, RobocovError, quote
from robocov.mapfile.models import MAX_SIZE_M
from robocov.optional_imports import import_optional
from robocov_app.formats.files import require_shapes
from robocov_app.formats.geometry.shapes import Shapes, SourceGeometry

DEGREES = "OGC:CRS84"  # longitude and latitude on WGS 84, as of all GeoJSON (RFC 7946, section 4)
_IN_DEGREES = (DEGREES, "EPSG:4326")
_AS_THEY_ARE = "--units metres takes coordinates as they are"
_AUTHORITIES = ("EPSG", "ESRI", "IGNF", "OGC")
_URN = re.compile(r"(?:urn:(?:x-)?ogc:def:crs:)?([A-Z]{3,4}):(?:[\d.]*:)?([A-Z]*\d{1,9})", re.IGNORECASE)
_ADDRESS = re.compile(r"https?://www\.opengis\.net/def/crs/([A-Za-z]+)/[\d.]+/([A-Za-z]*\d{1,9})")
_DIGITS = 6  # decimals of metres: free space is known to a micrometre
_EARTH = 6_371_000.0  # mean radius in metres, to tell degrees from metres; nothing else is computed with it


def in_metres(
    figures: list[SourceGeometry],
    shapes: Shapes,
    crs: str | None,
    globe: bool = False,
    origin: Point | None = None,
) -> list[SourceGeometry]:
    """Return figures with coordinates in metres; the notes of `shapes` say what was done to them.

    Options: ``units`` overrules the file; ``scale`` is metres a unit where it says nothing. `crs`: as
    ``EPSG:25832`` or an OGC URN. `globe`: coordinates without one are degrees where that makes a map of at
    most 10 km. `origin`: longitude and latitude of [0, 0] m, by default of the middle.
    """
    if not figures:
        return figures
    where, scale, units = shapes.where, shapes.options.scale, shapes.options.units
    require_shapes(sum(figure.kind != "point" for figure in figures), where)
    if units == "degrees" or (units is None and (crs is not None or _on_globe(figures, globe))):
        name = DEGREES if units == "degrees" or crs is None else _authority(crs, where)
        return _projected(figures, name, shapes, origin)
    shapes.notes += [] if scale in (None, 1.0) else [f"a unit is {scale:g} m"]
    if globe and units is None:
        shapes.notes.append("coordinates taken as metres: as degrees the map would be larger than 10 km")
    if crs is not None:
        shapes.notes.append(f"coordinates of {crs} taken as they are")
    return _with_points(figures, _points(figures) * (1.0 if scale is None else scale))


def _points(figures: Sequence[SourceGeometry]) -> Array:
    return np.concatenate([ring for figure in figures for ring in figure.rings])


def _with_points(figures: Sequence[SourceGeometry], points: Array) -> list[SourceGeometry]:
    rings = iter(np.split(points, np.cumsum([len(ring) for figure in figures for ring in figure.rings])[:-1]))
    return [replace(figure, rings=tuple(islice(rings, len(figure.rings)))) for figure in figures]


def _on_globe(figures: Sequence[SourceGeometry], possible: bool) -> bool:
    """Return whether coordinates are degrees of a place, not metres of a plan: a plan is metres wide."""
    points = _points(figures)
    if not possible or not (np.abs(points) <= [360.0, 90.0]).all():  # some go on beyond the antimeridian
        return False
    width, height = np.ptp(_unwrapped(points, points[0, 0]), axis=0)
    shrunk = math.cos(math.radians(float(np.abs(points[:, 1]).max())))
    return bool(max(width * shrunk, height) * math.radians(1.0) * _EARTH <= MAX_SIZE_M)


def _unwrapped(points: Array, about: float) -> Array:
    """Return longitudes without a jump at the antimeridian: all within 180 degrees of one."""
    return np.column_stack([about + (points[:, 0] - about + 180.0) % 360.0 - 180.0, points[:, 1]])


def _authority(crs: str, where: str) -> str:
    """Return a name as AUTHORITY:CODE: only codes are looked up, as definitions in full may name files."""
    match = _URN.fullmatch(crs.strip()) or _ADDRESS.fullmatch(crs.strip())
    if match is None or match[1].upper() not in _AUTHORITIES:
        wanted = f"expected a code as EPSG:25832 ({_AS_THEY_ARE})"
        raise MapError(f"{where}: {wanted}, got reference system {quote(crs)}")
    return f"{match[1].upper()}:{match[2].upper()}"


def _projected(
    figures: Sequence[SourceGeometry], name: str, shapes: Shapes, origin: Point | None
) -> list[SourceGeometry]:
    """Return figures in metres east and north of a place, by the azimuthal equidistant projection."""
    where, system = shapes.where, "degrees" if name in _IN_DEGREES else name
    try:
        pyproj = import_optional("pyproj", "geo")
    except RobocovError as error:
        what = "degrees" if name == DEGREES else name
        raise MapError(f"{where}: coordinates in {what}: {error} ({_AS_THEY_ARE})") from None
    points = _points(figures)
    if name not in _IN_DEGREES:
        try:
            authority = pyproj.CRS.from_authority(*name.split(":"))
            to_globe = pyproj.Transformer.from_crs(authority, DEGREES, always_xy=True)
        except pyproj.exceptions.ProjError:
            raise MapError(f"{where}: reference system {name} is unknown ({_AS_THEY_ARE})") from None
        points = np.column_stack(to_globe.transform(*points.T))
    good = (np.abs(points) <= [360.0, 90.0]).all(axis=1)  # what cannot be projected is inf
    if not good.all():
        x, y = _points(figures)[int(np.argmin(good))].tolist()
        wanted = "longitude and latitude in degrees" if name in _IN_DEGREES else f"coordinates of {name}"
        raise MapError(f"{where}: expected {wanted}, got a point at [{x:g}, {y:g}] ({_AS_THEY_ARE})")
    points = _unwrapped(points, points[0, 0])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    longitude, latitude = origin or (float(middle[0]), float(middle[1]))
    points = LocalPlane(pyproj, longitude, latitude).metres(points)
    longitude = (longitude + 180.0) % 360.0 - 180.0
    about = f"about longitude {longitude:.5f}, latitude {latitude:.5f} (azimuthal equidistant)"
    shapes.notes.append(f"{system} projected to metres {about}")
    return _with_points(figures, points)


class LocalPlane:
    """Metres east and north of a place on the globe, from degrees and back.

    Azimuthal equidistant on the ellipsoid of WGS 84 (Snyder 1987, Map Projections: A Working Manual,
    section 25): within 5 km of the place lengths are true to better than a millimetre.
    """

    def __init__(self, pyproj: Any, longitude: float, latitude: float) -> None:
        self._longitude = longitude
        self._project = pyproj.Proj(proj="aeqd", lon_0=longitude, lat_0=latitude, ellps="WGS84")

    def metres(self, degrees: Array) -> Array:
        """Return (n, 2) m of longitudes and latitudes, to the micrometre: walls that touch still do."""
        return np.round(np.column_stack(self._project(*degrees.T)), _DIGITS)

    def degrees(self, metres: Array) -> Array:
        """Return longitudes, all within 180 degrees of the place's, and latitudes of (n, 2) m."""
        return _unwrapped(np.column_stack(self._project(*metres.T, inverse=True)), self._longitude)
