"""Worlds of the simulator CoverageControl: https://github.com/KumarRobotics/CoverageControl.

S. Agarwal, R. Muthukrishnan, W. Gosrich, V. Kumar and A. Ribeiro, LPAC: learnable
perception-action-communication loops with applications to coverage control (2024).

A world is a square without obstacles. A file ``.env`` contains the features of its density. Gaussians end at
two sigmas: ``CircularBND`` with x, y, sigma and mass, ``BND`` with x, y, both sigmas, correlation and mass.
Polygons are ``Uniform`` with their number of corners, their weight, and the corners. A file of the same name
with the suffix ``.pos`` contains the positions of the robots, one x and y per line. The size of the world is
in neither: it has 1024 cells along each side, of 1 m by default.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from scipy.special import ndtr
from shapely import MultiPolygon, Polygon

from robocov.density import Raster
from robocov.errors import MapError, format_count, quote
from robocov.typing import FloatArray
from robocov_app.formats.files import (
    get_map_name,
    parse_number,
    read_text,
    require_coordinate,
    require_shapes,
)
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.options import ReadOptions, get_or_default

WORLD_CELLS = 1024
"""Number of cells along a side of a world."""
DEFAULT_CELL_M = 1.0
RASTER_SIZE = 256
"""Number of pixels along a side of the density."""
TRUNCATION = 2.0
"""Distance from its center at which a Gaussian ends, in standard deviations."""
POSITIONS_SUFFIX = ".pos"
MAX_FEATURES = 1000
"""Maximum number of Gaussians and polygons of a world; each takes up to a millisecond."""
_MAX_POLYGON_PIXELS = 4_000_000
"""Maximum number of pixels in the bounding boxes of all polygons."""
_WEIGHT_DIGITS = 6
_MIN_CORNERS = 3
_MAX_CORRELATION = 0.999999


class Gaussian(NamedTuple):
    """A Gaussian that ends at `TRUNCATION` standard deviations."""

    x: float
    """m"""
    y: float
    """m"""
    sigma_x: float
    """m"""
    sigma_y: float
    """m"""
    correlation: float
    mass: float
    """Integral over the plane without the end."""


class UniformArea(NamedTuple):
    """A polygon with a constant weight."""

    polygon: Polygon
    weight: float


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return head.split(maxsplit=1)[:1] in ([b"CircularBND"], [b"BND"], [b"Uniform"])


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the world in a file, and its robots in the file of the same name, if there is one.

    Raises
    ------
    MapError
        If a file cannot be read, or if the density is 0 everywhere.
    """
    features = _FeatureReader(path)
    gaussians: list[Gaussian] = []
    areas: list[UniformArea] = []
    while features.has_more:
        if len(gaussians) + len(areas) >= MAX_FEATURES:
            raise MapError(f"{features.source_name}: expected at most {MAX_FEATURES} features, got more")
        feature = features.read_feature()
        if isinstance(feature, Gaussian):
            gaussians.append(feature)
        else:
            areas.append(feature)
    side = WORLD_CELLS * get_or_default(options.cell, DEFAULT_CELL_M)
    weights = _compute_weights(gaussians, areas, side, features.source_name)
    if not weights.max() > 0.0:
        raise MapError(f"{features.source_name}: expected a feature with a weight inside the world, got none")
    robots = _read_positions(path.with_suffix(POSITIONS_SUFFIX))
    world = shapely.box(0.0, 0.0, side, side)
    return ForeignMap(
        name=get_map_name(path),
        description="A world of CoverageControl, imported.",
        free=MultiPolygon([world]),
        boundary=world,
        boundary_source=f"the square of {side:g} m",
        vertices_read=4,
        robots=robots,
        density=Raster(weights, extent=(0.0, 0.0, side, side), interpolation="cells"),
        notes=(
            f"density: {format_count(len(gaussians), 'Gaussian')} and {format_count(len(areas), 'polygon')}, "
            f"as {RASTER_SIZE} x {RASTER_SIZE} cells",
        ),
    )


class _FeatureReader:
    """Reads the features of a file word by word."""

    def __init__(self, path: Path) -> None:
        text, self.source_name = read_text(path, b"\n")
        self._words = text.split()
        self._next = 0

    @property
    def has_more(self) -> bool:
        """Whether there are more words."""
        return self._next < len(self._words)

    def read_feature(self) -> Gaussian | UniformArea:
        """Read the next feature."""
        kind = self._words[self._next]
        self._next += 1
        if kind == "CircularBND":
            x, y, sigma, mass = self._read_numbers(4, kind)
            return self._check_gaussian(Gaussian(x, y, sigma, sigma, 0.0, mass))
        if kind == "BND":
            x, y, sigma_x, sigma_y, correlation, mass = self._read_numbers(6, kind)
            return self._check_gaussian(Gaussian(x, y, sigma_x, sigma_y, correlation, mass))
        if kind == "Uniform":
            return self._read_area()
        raise MapError(f"{self.source_name}: expected CircularBND, BND or Uniform, got {quote(kind)}")

    def _read_numbers(self, count: int, kind: str) -> list[float]:
        """Read the next numbers, which belong to a feature of the given kind."""
        words = self._words[self._next : self._next + count]
        self._next += count
        numbers = [parse_number(word) for word in words]
        if len(numbers) < count or not np.isfinite(numbers).all():
            raise MapError(
                f"{self.source_name}: {kind}: expected {count} numbers, got {quote(' '.join(words))}"
            )
        return numbers

    def _check_gaussian(self, gaussian: Gaussian) -> Gaussian:
        """Return a Gaussian after a check of its numbers."""
        x, y, sigma_x, sigma_y, correlation, mass = gaussian
        for value in (x, y):
            require_coordinate(value, self.source_name)
        is_valid = min(sigma_x, sigma_y) > 0.0 and abs(correlation) <= _MAX_CORRELATION and mass >= 0.0
        if not is_valid:
            raise MapError(
                f"{self.source_name}: Gaussian at {x:g}, {y:g}: "
                "expected sigmas above 0, a correlation between -1 and 1, and a mass of at least 0, "
                f"got {sigma_x:g}, {sigma_y:g}, {correlation:g} and {mass:g}"
            )
        return gaussian

    def _read_area(self) -> UniformArea:
        """Read a polygon with its number of corners, its weight and its corners."""
        count, weight = self._read_numbers(2, "Uniform")
        if count != int(count) or count < _MIN_CORNERS or weight < 0.0:
            raise MapError(
                f"{self.source_name}: Uniform: "
                f"expected a number of at least {_MIN_CORNERS} corners and a weight of at least 0, "
                f"got {count:g} and {weight:g}"
            )
        coordinates = self._read_numbers(2 * int(count), "Uniform")
        for value in coordinates:
            require_coordinate(value, self.source_name)
        return UniformArea(Polygon(np.reshape(coordinates, (-1, 2))), weight)


def _compute_weights(
    gaussians: list[Gaussian], areas: list[UniformArea], side: float, source_name: str
) -> FloatArray:
    """Compute the weights of the pixels, relative to the largest.

    Returns
    -------
    (RASTER_SIZE, RASTER_SIZE) array
        The lowest row first.
    """
    edges = np.linspace(0.0, side, RASTER_SIZE + 1)
    weights = np.zeros((RASTER_SIZE, RASTER_SIZE))
    for gaussian in gaussians:
        weights += _compute_gaussian_masses(gaussian, edges)
    # In CoverageControl, the weight of a cell is the mass of the Gaussians in it, plus that of a polygon.
    weights *= (RASTER_SIZE / WORLD_CELLS) ** 2
    weights += _compute_area_weights(areas, edges, source_name)
    highest = weights.max()
    return np.round(weights / highest, _WEIGHT_DIGITS) if highest > 0.0 else weights


def _compute_area_weights(areas: list[UniformArea], edges: FloatArray, source_name: str) -> FloatArray:
    """Compute the highest weight of the polygons at each pixel, (RASTER_SIZE, RASTER_SIZE)."""
    centers = 0.5 * (edges[:-1] + edges[1:])
    weights = np.zeros((len(centers), len(centers)))
    pixel_count = 0
    for polygon, weight in areas:
        min_x, min_y, max_x, max_y = polygon.bounds
        columns = slice(*np.searchsorted(centers, [min_x, max_x]).tolist())
        rows = slice(*np.searchsorted(centers, [min_y, max_y]).tolist())
        x, y = np.meshgrid(centers[columns], centers[rows])
        pixel_count += x.size
        if pixel_count > _MAX_POLYGON_PIXELS:
            raise MapError(
                f"{source_name}: expected smaller or fewer polygons, got more than the import can draw"
            )
        shapely.prepare(polygon)
        inner_weights = np.where(shapely.intersects_xy(polygon, x, y), weight, 0.0)
        weights[rows, columns] = np.maximum(weights[rows, columns], inner_weights)
    return weights


def _compute_gaussian_masses(gaussian: Gaussian, edges: FloatArray) -> FloatArray:
    """Compute the mass of a Gaussian in each pixel, (RASTER_SIZE, RASTER_SIZE)."""
    u = (edges - gaussian.x) / gaussian.sigma_x
    v = (edges - gaussian.y) / gaussian.sigma_y
    center_u = 0.5 * (u[:-1] + u[1:])
    center_v = 0.5 * (v[:-1] + v[1:])[:, None]
    rho = gaussian.correlation
    squared_distance = (center_u**2 - 2.0 * rho * center_u * center_v + center_v**2) / (1.0 - rho**2)
    if rho:
        pixel_area = np.diff(u) * np.diff(v)[:, None]
        masses = np.exp(-0.5 * squared_distance) * pixel_area / (2.0 * np.pi * np.sqrt(1.0 - rho**2))
    else:
        masses = np.diff(ndtr(u)) * np.diff(ndtr(v))[:, None]
    return np.where(squared_distance <= TRUNCATION**2, gaussian.mass * masses, 0.0)


def _read_positions(path: Path) -> tuple[tuple[float, float], ...]:
    """Return the positions in a file, m; none if there is no such file."""
    if not path.exists():
        return ()
    text, source_name = read_text(path, b"\n")
    numbers = []
    for word in text.split():
        number = parse_number(word)
        if not np.isfinite(number):
            raise MapError(f"{source_name}: expected a number, got {quote(word)}")
        numbers.append(number)
    if len(numbers) % 2:
        raise MapError(
            f"{source_name}: expected an x and a y for each robot, got {format_count(len(numbers), 'number')}"
        )
    require_shapes(len(numbers) // 2, source_name)
    for value in numbers:
        require_coordinate(value, source_name)
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))
