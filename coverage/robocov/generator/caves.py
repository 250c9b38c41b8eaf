"""Maps of the kind `caves`: chambers and tunnels between smooth walls of rock, and pillars.

The core of a cave is the area where the center of a robot may be. First, the core is the area in which a
random field, raised along the boundary, is below some level. Tunnels are added to connect the parts of this
area. The free space is the core, dilated by at least half the requested gap (J. Serra, *Image Analysis and
Mathematical Morphology*, 1982). Two dilated parts of the core may still meet in a passage that is narrower
than the gap. Then a tunnel through this passage is added to the core.
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import compute_lengths
from robocov.environment import DiscStart, Gap, Obstacle, PolygonObstacle, Ring, find_narrow_gaps
from robocov.generator.request import BLOCKED_FRACTION_TOLERANCE, MapRequest
from robocov.typing import FloatArray

# Lengths in spacings are multiples of `MapRequest.mean_spacing`, the side of a square of which each chamber
# has one. Lengths in sides are multiples of the shorter side of the map.
_WAVE_COUNT = 48
"""Number of waves whose sum is the random field."""
_MIN_WAVELENGTH_SPACINGS = 0.7
_MAX_WAVELENGTH_SPACINGS = 1.7
"""Minimum and maximum length of these waves."""
_MIN_MESH_STEPS_PER_SPACING = 6
_MAX_MESH_STEPS_PER_SPACING = 12
"""Minimum and maximum resolution of the mesh on which the field is evaluated."""
_MAX_MESH_STEPS_PER_SIDE = 160
"""Maximum number of steps along the longer side of the map, unless the minimum resolution requires more."""
_MIN_ROCK_SIDES = 0.012
"""Minimum thickness of the rock along the boundary."""
_BORDER_SPACINGS = 0.35
_BORDER_RISE = 3.0
"""Width of the border along the boundary in which the field is raised, and the height of the rise."""
_START_SPACINGS = 0.35
_START_DEPTH = 1.5
"""Radius around the start within which the field is lowered, and the depth."""
_MAX_TOLERANCE_SPACINGS = 0.008
_MAX_TOLERANCE_SIDES = 0.0027
"""Maximum tolerance with which walls are simplified; the smaller one applies."""
_MIN_CHAMBER_AREA_RATIO = 0.03
_MIN_PILLAR_AREA_RATIO = 0.02
"""Minimum area of a chamber and of a pillar, relative to the area of the map per chamber."""
_SPIKE_SPACINGS = 0.05
"""Half of the maximum thickness of the spikes of rock that are removed."""
_MAX_BEND_RATIO = 0.25
"""Maximum offset of a tunnel's middle, relative to the length of the tunnel."""
_MAX_TUNNEL_RADII = 1.5
"""Maximum distance between a narrow gap and the parts of the core that a tunnel connects through it, relative
to the dilation of the core."""
_LEVEL_RADIUS_RATIO = 1.2
"""Dilation with which the level of the field is chosen, relative to the smallest dilation."""
_MAX_RADIUS_RATIO = 2.0
"""Maximum dilation, relative to the minimum one."""
_LEVEL_BISECTIONS = 8
"""Number of bisections by which the level of the field is chosen."""
_RADIUS_BISECTIONS = 12
"""Number of bisections by which the dilation is chosen."""
_MAX_ROUNDS = 12
"""Maximum number of rounds in which narrow gaps are widened before a layout is abandoned."""
_GAPS_PER_CHAMBER = 0.005
"""Number of gaps per chamber that are widened in one round, the narrowest first."""
_FRACTION_TOLERANCE = 0.5 * BLOCKED_FRACTION_TOLERANCE
"""Tolerance of the blocked fraction; the rest of the requested tolerance is left for rounding errors."""


def build_cave(
    request: MapRequest, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Build the rock around a cave, and the pillars in it.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    corner_disc : DiscStart
        Disc that stays free.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of Obstacle or None
        The rock, then the pillars. None if the map is too small, the blocked fraction is missed, or narrow
        gaps remain.
    """
    builder = _create_builder(request, corner_disc)
    if _build_inner_rectangle(request, 2.0 * builder.min_radius).is_empty:
        return None
    points, values = sample_random_field(request, rng)
    values += _compute_border_rise(request, points)
    values -= _compute_start_depth(request, corner_disc, points)
    # The tunnels are sampled from the same random numbers at every level of the field.
    tunnel_seed = int(rng.integers(2**32))
    core = _choose_core(builder, points, values, tunnel_seed)
    # Dilate the core by the radius that blocks the requested fraction. While gaps are too narrow, cut tunnels
    # through the narrowest ones, and dilate the core again.
    for _ in range(_MAX_ROUNDS):
        radius = _choose_radius(builder, core)
        outline, pillars = _round_rings(request, builder.dilate(core, radius))
        free_space = Polygon(outline, pillars)
        if abs(builder.compute_excess_fraction(free_space)) > _FRACTION_TOLERANCE:
            return None
        gaps = find_narrow_gaps(MultiPolygon([free_space]), request.gap)
        # Widths are rounded, so that a gap may appear to be exactly as wide as required.
        narrow_gaps = [gap for gap in gaps if gap.width < request.gap]
        if not narrow_gaps:
            return _build_obstacles(request, outline, pillars)
        tunnel_count = math.ceil(_GAPS_PER_CHAMBER * request.obstacle_count)
        tunnels = [build_gap_tunnel(gap, core, radius) for gap in narrow_gaps[:tunnel_count]]
        core = shapely.union_all([core, *tunnels])
    return None


def _compute_border_rise(request: MapRequest, points: FloatArray) -> FloatArray:
    """Return the height by which the field is raised at each point, which is largest at the boundary."""
    upper_right = points[-1, -1]
    distances = np.minimum(points, upper_right - points).min(axis=-1)
    return np.asarray(_BORDER_RISE * np.exp(-((distances / (_BORDER_SPACINGS * request.mean_spacing)) ** 2)))


def _compute_start_depth(request: MapRequest, corner_disc: DiscStart, points: FloatArray) -> FloatArray:
    """Return the depth by which the field is lowered at each point, which is largest at the start."""
    distances = compute_lengths(points - np.array(corner_disc.center))
    return np.asarray(_START_DEPTH * np.exp(-((distances / (_START_SPACINGS * request.mean_spacing)) ** 2)))


@dataclass(frozen=True)
class _CaveBuilder:
    """Builds the core and the free space of a cave.

    Attributes
    ----------
    request : MapRequest
        Parameters of the map.
    tolerance : float, m
        Tolerance with which walls are simplified.
    min_radius : float, m
        Minimum dilation of the core: half the gap, plus an allowance for simplification and rounding.
    start_area : geometry
        Area that stays free around the start.
    """

    request: MapRequest
    tolerance: float
    min_radius: float
    start_area: BaseGeometry

    def build_core(self, points: FloatArray, values: FloatArray, seed: int) -> BaseGeometry:
        """Build the core of a cave: the connected area where the center of a robot may be.

        The core consists of chambers, an area around the start, and tunnels that connect them. The chambers
        are the areas where the field, given by its `values` at the `points` of a mesh, is negative. `seed`
        determines the bends of the tunnels.
        """
        low_area = shapely.simplify(extract_area_below_zero(points, values), self.tolerance)
        low_area = low_area.intersection(_build_inner_rectangle(self.request, self.min_radius))
        min_area = _MIN_CHAMBER_AREA_RATIO * self.request.mean_spacing**2
        chambers = [chamber for chamber in shapely.get_parts(low_area) if chamber.area >= min_area]
        # Dilating the core by `min_radius` or more will restore the start area, which is eroded here.
        eroded_start = self.start_area.buffer(-self.min_radius)
        if eroded_start.is_empty:
            eroded_start = self.start_area.centroid
        separate_parts = shapely.union_all([*chambers, eroded_start])
        tunnels = build_tunnels(shapely.get_parts(separate_parts), np.random.default_rng(seed))
        return shapely.union_all([separate_parts, *tunnels])

    def dilate(self, core: BaseGeometry, radius: float) -> Polygon:
        """Return the free space that results from dilating a core by a radius, with smooth walls.

        The free space is the largest part of the dilated core and the start area. Pillars that are too small
        are left out.
        """
        spacing = self.request.mean_spacing
        spike_radius = _SPIKE_SPACINGS * spacing
        inner_rectangle = _build_inner_rectangle(self.request, 0.0)
        # Dilating too far, then eroding by the difference, removes spikes of rock.
        dilated_core = core.buffer(radius + spike_radius).buffer(-spike_radius)
        free_area = dilated_core.intersection(inner_rectangle).union(self.start_area)
        largest_part = max(shapely.get_parts(free_area), key=lambda polygon: float(polygon.area))
        min_area = _MIN_PILLAR_AREA_RATIO * spacing**2
        pillars = [ring for ring in largest_part.interiors if Polygon(ring).area >= min_area]
        return shapely.simplify(Polygon(largest_part.exterior, pillars), self.tolerance)

    def compute_excess_fraction(self, free_space: Polygon) -> float:
        """Return the fraction of the map that is blocked, outside a free space, minus the requested one."""
        map_area = float(self.request.width) * float(self.request.height)
        blocked_fraction = 1.0 - float(free_space.area) / map_area
        return blocked_fraction - self.request.blocked_fraction


def _create_builder(request: MapRequest, corner_disc: DiscStart) -> _CaveBuilder:
    """Create the builder for a request and the start disc in a corner."""
    side = min(float(request.width), float(request.height))
    tolerance = min(_MAX_TOLERANCE_SPACINGS * request.mean_spacing, _MAX_TOLERANCE_SIDES * side)
    max_error = tolerance + 2.0 * request.rounding_step
    disc = Point(corner_disc.center).buffer(corner_disc.radius + 2.0 * max_error)
    return _CaveBuilder(
        request=request,
        tolerance=tolerance,
        min_radius=request.gap / 2.0 + max_error,
        start_area=disc.intersection(_build_inner_rectangle(request, 0.0)),
    )


def _build_inner_rectangle(request: MapRequest, distance: float) -> Polygon:
    """Return the rectangle at a distance, m, from a layer of rock of minimum thickness along the boundary."""
    width = float(request.width)
    height = float(request.height)
    offset = _MIN_ROCK_SIDES * min(width, height) + distance
    return shapely.box(offset, offset, width - offset, height - offset)


def _choose_core(builder: _CaveBuilder, points: FloatArray, values: FloatArray, seed: int) -> BaseGeometry:
    """Choose the level of the field at which about the requested fraction is blocked; return the core.

    The chambers of the core are the areas where the field is below the level. A higher level enlarges the
    chambers, so that less of the map is blocked. The level can therefore be found by bisection.
    """
    radius = _LEVEL_RADIUS_RATIO * builder.min_radius
    low = float(values.min())
    high = float(values.max())
    for _ in range(_LEVEL_BISECTIONS):
        level = (low + high) / 2.0
        core = builder.build_core(points, values - level, seed)
        free_space = builder.dilate(core, radius)
        if builder.compute_excess_fraction(free_space) > 0.0:
            low = level
        else:
            high = level
    return builder.build_core(points, values - (low + high) / 2.0, seed)


def _choose_radius(builder: _CaveBuilder, core: BaseGeometry) -> float:
    """Choose the radius, m, by which to dilate a core so that about the requested fraction is blocked.

    A larger radius blocks less of the map. The radius can therefore be found by bisection.
    """
    low = builder.min_radius
    high = _MAX_RADIUS_RATIO * builder.min_radius
    for _ in range(_RADIUS_BISECTIONS):
        radius = (low + high) / 2.0
        free_space = builder.dilate(core, radius)
        if builder.compute_excess_fraction(free_space) > 0.0:
            low = radius
        else:
            high = radius
    return (low + high) / 2.0


def _round_rings(request: MapRequest, polygon: Polygon) -> tuple[Ring, list[Ring]]:
    """Return the outline and the holes of a polygon, in rounded coordinates."""
    outline = request.build_ring(shapely.get_coordinates(polygon.exterior)[:-1])
    holes = [request.build_ring(shapely.get_coordinates(ring)[:-1]) for ring in polygon.interiors]
    return outline, holes


def _build_obstacles(request: MapRequest, outline: Ring, pillars: list[Ring]) -> list[Obstacle]:
    """Return the rock between the boundary and the outline of the free space, and the pillars."""
    width = float(request.width)
    height = float(request.height)
    boundary = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    rock = PolygonObstacle(boundary, (outline,), "rock")
    return [rock, *(PolygonObstacle(ring, name="pillar") for ring in pillars)]


def sample_random_field(request: MapRequest, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Sample a smooth random field of mean 0 and variance 1.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    points : (rows, columns, 2) array, m
        Points of a mesh that covers the map.
    values : (rows, columns) array
        Values of the field at these points.

    Notes
    -----
    The field is a sum of waves of random direction, length and phase (M. Shinozuka and G. Deodatis,
    *Simulation of stochastic processes by spectral representation*, Applied Mechanics Reviews 44, 1991).
    """
    min_step = request.mean_spacing / _MAX_MESH_STEPS_PER_SPACING
    max_step = request.mean_spacing / _MIN_MESH_STEPS_PER_SPACING
    step = max(request.width, request.height) / _MAX_MESH_STEPS_PER_SIDE
    step = max(min(step, max_step), min_step)
    x = np.linspace(0.0, request.width, math.ceil(request.width / step) + 1)
    y = np.linspace(0.0, request.height, math.ceil(request.height / step) + 1)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    wavelengths = request.mean_spacing * rng.uniform(
        _MIN_WAVELENGTH_SPACINGS, _MAX_WAVELENGTH_SPACINGS, _WAVE_COUNT
    )
    directions, phases = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVE_COUNT))
    values = np.zeros(points.shape[:2])
    for wavelength, direction, phase in zip(wavelengths, directions, phases, strict=True):
        distances = points[..., 0] * math.cos(direction) + points[..., 1] * math.sin(direction)
        values += np.cos(2.0 * np.pi / wavelength * distances + phase)
    return points, values * math.sqrt(2.0 / _WAVE_COUNT)


def extract_area_below_zero(points: FloatArray, values: FloatArray) -> BaseGeometry:
    """Extract the area in which a scalar field, given at the points of a mesh, is negative.

    Parameters
    ----------
    points : (rows, columns, 2) array, m
        Points of the mesh.
    values : (rows, columns) array
        Values of the field. On the border of the mesh, they are raised to at least 1.

    Returns
    -------
    geometry
        Polygons that do not touch the border of the mesh.

    Notes
    -----
    Each square of the mesh is divided into two triangles, in which the contour is a line ("marching
    triangles"). In a triangle, unlike in a square, the contour is never ambiguous.
    """
    # No contour reaches the border of the mesh if all values there are positive, so that contours are closed.
    raised_values = np.maximum(values, 1.0)
    raised_values[1:-1, 1:-1] = values[1:-1, 1:-1]
    values = raised_values

    def find_crossings(start: tuple[slice, slice], end: tuple[slice, slice]) -> FloatArray:
        """Return the points at which edges of the mesh cross 0, (..., 2) m; nan if they do not."""
        start_values = values[start]
        end_values = values[end]
        is_crossing = (start_values < 0.0) != (end_values < 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            fractions = np.where(is_crossing, start_values / (start_values - end_values), np.nan)
        return np.asarray(points[start] + (points[end] - points[start]) * fractions[..., None])

    # Edges of the mesh run from each point to the right, up, and diagonally up to the right.
    horizontal = find_crossings(np.s_[:, :-1], np.s_[:, 1:])
    vertical = find_crossings(np.s_[:-1, :], np.s_[1:, :])
    diagonal = find_crossings(np.s_[:-1, :-1], np.s_[1:, 1:])
    lower_triangles = np.stack([horizontal[:-1], vertical[:, 1:], diagonal], axis=2).reshape(-1, 3, 2)
    upper_triangles = np.stack([diagonal, horizontal[1:], vertical[:, :-1]], axis=2).reshape(-1, 3, 2)
    crossings = np.concatenate([lower_triangles, upper_triangles])
    # A contour that enters a triangle also leaves it, so that crossings come in pairs.
    segments = crossings[~np.isnan(crossings[..., 0])].reshape(-1, 2, 2)
    return shapely.build_area(shapely.multilinestrings(shapely.linestrings(segments)))


def build_tunnels(components: FloatArray, rng: np.random.Generator) -> list[LineString]:
    """Build tunnels that connect all components, along the edges of a minimum spanning tree.

    Parameters
    ----------
    components : array of geometries
        Separate parts of the core.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of LineString
        Lines with a bend in the middle; one fewer than the number of components.
    """
    tunnels: list[LineString] = []
    tree = shapely.STRtree(components)
    connected = DisjointSet(range(len(components)))
    # Kruskal's algorithm: components are connected by lines in the order of length. Lines up to a maximum
    # length are processed at once, and this length is doubled until all components are connected.
    extent = np.ptp(shapely.total_bounds(components).reshape(2, 2), axis=0)
    max_length = float(extent.max()) / len(components)
    while connected.n_subsets > 1:
        # Pairs (i, j) of components that are near enough. The query returns each pair in both orders.
        i, j = tree.query(components, "dwithin", max_length)
        is_ordered = i < j
        i = i[is_ordered]
        j = j[is_ordered]
        lines = shapely.shortest_line(components[i], components[j])
        by_length = np.lexsort((j, i, shapely.length(lines)))
        for k in by_length.tolist():
            were_separate = connected.merge(i[k], j[k])
            if were_separate:
                tunnels.append(_bend_line(lines[k], rng))
        max_length *= 2.0
    return tunnels


def _bend_line(line: LineString, rng: np.random.Generator) -> LineString:
    """Bend a line of two points: move its middle sideways by a random distance."""
    start, end = shapely.get_coordinates(line)
    direction = end - start
    normal = np.array([-direction[1], direction[0]])
    offset = rng.uniform(-_MAX_BEND_RATIO, _MAX_BEND_RATIO) * normal
    return LineString([start, (start + end) / 2.0 + offset, end])


def build_gap_tunnel(gap: Gap, core: BaseGeometry, radius: float) -> BaseGeometry:
    """Build a tunnel through a narrow gap.

    A gap is too narrow where two dilated parts of the core barely meet. A line that connects these parts,
    added to the core, makes the gap wider when the core is dilated again.

    Parameters
    ----------
    gap : Gap
        A gap of the free space that is narrower than requested.
    core : geometry
        Area where the center of a robot may be.
    radius : float, m
        Dilation of the core.

    Returns
    -------
    geometry
        A line from one part of the core to another. If a part is missing on one side of the gap, only the
        middle point of the gap.
    """
    # The vector `across` leads from wall to wall, and `through` from one part of the core to the other. Both
    # are as long as the largest distance at which parts of the core are considered.
    first_wall = np.array(gap.between[0])
    second_wall = np.array(gap.between[1])
    middle = (first_wall + second_wall) / 2.0
    across = second_wall - first_wall
    across = across / np.hypot(across[0], across[1]) * (_MAX_TUNNEL_RADII * radius)
    through = np.array([-across[1], across[0]])
    left = middle + across
    right = middle - across
    # The parts of the core in two rectangles, one on either side of the gap.
    front = core.intersection(Polygon([left, right, right + through, left + through]))
    back = core.intersection(Polygon([left, right, right - through, left - through]))
    if front.is_empty or back.is_empty:
        return Point(middle)
    start = shapely.shortest_line(Point(middle), front).coords[-1]
    end = shapely.shortest_line(Point(middle), back).coords[-1]
    return LineString([start, middle, end])
