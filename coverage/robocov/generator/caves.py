"""Maps of the kind `caves`: chambers and tunnels between smooth walls of rock, and pillars.

The core of a cave, where the center of a robot may be, is the area in which a random field, raised along the
boundary, is below a level. Its parts are joined by tunnels, and it is dilated (J. Serra, *Image Analysis and
Mathematical Morphology*, 1982) by at least half the gap. Where two dilated parts meet in a window that
is narrower than the gap, a tunnel is cut through it.
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, compute_lengths
from robocov.environment import DiscStart, Gap, Obstacle, PolygonObstacle, Ring, find_narrow_gaps
from robocov.generator.request import AREA_TOLERANCE, Request

# A unit is the side of a chamber of mean area, `Request.unit`. A side is the shorter side of the map.
_WAVES = 48
"""Number of waves whose sum is the random field."""
_MIN_WAVELENGTH_UNITS = 0.7
_MAX_WAVELENGTH_UNITS = 1.7
"""Range of their lengths."""
_MAX_MESH_STEPS_PER_UNIT = 12
_MIN_MESH_STEPS_PER_UNIT = 6
"""Range of the resolution of the mesh on which the field is evaluated."""
_MAX_MESH_STEPS_PER_SIDE = 160
"""Number of steps along the longer side from which the mesh becomes coarser."""
_RIM_SIDES = 0.012
"""Smallest thickness of the rock along the boundary."""
_SHORE_UNITS = 0.35
_SHORE_RISE = 3.0
"""Width of the belt along the boundary in which the field is raised, and the height of the rise."""
_HALL_UNITS = 0.35
_HALL_DEPTH = 1.5
"""Radius around the start within which the field is lowered, and the depth."""
_MAX_TOLERANCE_UNITS = 0.008
_MAX_TOLERANCE_SIDES = 0.0027
"""Tolerance with which walls are simplified."""
_MIN_CHAMBER_UNIT_AREAS = 0.03
_MIN_PILLAR_UNIT_AREAS = 0.02
"""Smallest area of a chamber and of a pillar, in areas of a square whose side is a unit."""
_SPIKE_UNITS = 0.05
"""Half of the maximum thickness of the spikes of rock that are removed."""
_MAX_BEND = 0.25
"""Largest offset of a tunnel's middle, relative to its length."""
_WINDOW_REACH = 1.5
"""Maximum distance between a window and the parts that it connects, relative to the dilation."""
_LEVEL_RADIUS = 1.2
_MAX_RADIUS = 2.0
"""Dilation with which the level is chosen, and the largest dilation, relative to the smallest one."""
_LEVEL_STEPS = 8
_RADIUS_STEPS = 12
"""Steps of the bisections."""
_MAX_ROUNDS = 12
"""Maximum number of rounds in which windows are widened before a layout is abandoned."""
_WINDOWS_PER_CHAMBER = 0.005
"""Number of windows per chamber that are widened in one round, the narrowest first."""
_USED_AREA_TOLERANCE = 0.5 * AREA_TOLERANCE
"""The rest of the tolerance is left for rounding errors."""


def build_cave(request: Request, corner_disc: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Build the rock around a cave, and the pillars in it.

    Parameters
    ----------
    request : Request
    corner_disc : DiscStart
        Disc that stays free.
    rng : numpy.random.Generator

    Returns
    -------
    list of Obstacle or None
        None if the map is too small, too much or too little is blocked, or narrow windows remain.
    """
    # Choose the core, where the center of a robot may be, then dilate it by a radius that blocks the
    # requested area. While some passages are narrower than the gap, cut tunnels through the narrowest ones,
    # and dilate again.
    builder = _create_builder(request, corner_disc)
    if _build_inner_rectangle(request, 2.0 * builder.min_radius).is_empty:
        return None
    points, values = draw_random_field(request, rng)
    values += _compute_shore_rise(request, points)
    values -= _compute_hall_depth(request, corner_disc, points)
    # The tunnels are drawn from the same random numbers at every level of the field.
    tunnel_seed = int(rng.integers(2**32))
    core = _choose_core(builder, points, values, tunnel_seed)
    for _ in range(_MAX_ROUNDS):
        radius = _choose_radius(builder, core)
        outline, pillars = _round_rings(request, builder.dilate(core, radius))
        space = Polygon(outline, pillars)
        if abs(builder.compute_excess(space)) > _USED_AREA_TOLERANCE:
            return None
        gaps = find_narrow_gaps(MultiPolygon([space]), request.gap)
        narrow_gaps = [gap for gap in gaps if gap.width < request.gap]
        if not narrow_gaps:
            return _build_obstacles(request, outline, pillars)
        count = math.ceil(_WINDOWS_PER_CHAMBER * request.count)
        tunnels = [build_window_tunnel(gap, core, radius) for gap in narrow_gaps[:count]]
        core = shapely.union_all([core, *tunnels])
    return None


def _compute_shore_rise(request: Request, points: Array) -> Array:
    """Return the height by which the field is raised at each point because of the boundary."""
    upper_right = points[-1, -1]
    distances = np.minimum(points, upper_right - points).min(axis=-1)
    return np.asarray(_SHORE_RISE * np.exp(-((distances / (_SHORE_UNITS * request.unit)) ** 2)))


def _compute_hall_depth(request: Request, corner_disc: DiscStart, points: Array) -> Array:
    """Return the depth by which the field is lowered at each point because of the start."""
    distances = compute_lengths(points - np.array(corner_disc.center))
    return np.asarray(_HALL_DEPTH * np.exp(-((distances / (_HALL_UNITS * request.unit)) ** 2)))


@dataclass(frozen=True)
class _CaveBuilder:
    """Builds the core and the free space of a cave. Nothing in it is random.

    Attributes
    ----------
    request : Request
    tolerance : float, m
        Tolerance with which walls are simplified.
    min_radius : float, m
        Smallest dilation of the core: half the gap, plus an allowance for simplification and rounding.
    start_area : geometry
        Area that stays free around the start.
    """

    request: Request
    tolerance: float
    min_radius: float
    start_area: BaseGeometry

    def build_core(self, points: Array, values: Array, seed: int) -> BaseGeometry:
        """Build the core of a cave: the connected area where the center of a robot may be.

        The core is the union of the chambers, which are the areas where a random field on a mesh is below 0,
        the hall, which is the area around the start, and tunnels that connect them. `seed` determines the
        shapes of the tunnels.
        """
        low_area = shapely.simplify(extract_area_below_zero(points, values), self.tolerance)
        low_area = low_area.intersection(_build_inner_rectangle(self.request, self.min_radius))
        min_area = _MIN_CHAMBER_UNIT_AREAS * self.request.unit**2
        chambers = [chamber for chamber in shapely.get_parts(low_area) if chamber.area >= min_area]
        # Dilating the core by at least `min_radius` will later turn it into the free space. The hall is
        # therefore the start area eroded by `min_radius`: dilation restores the entire start area, and little
        # else.
        hall = self.start_area.buffer(-self.min_radius)
        if hall.is_empty:
            hall = self.start_area.centroid
        separate_parts = shapely.union_all([*chambers, hall])
        tunnels = build_tunnels(shapely.get_parts(separate_parts), np.random.default_rng(seed))
        return shapely.union_all([separate_parts, *tunnels])

    def dilate(self, core: BaseGeometry, radius: float) -> Polygon:
        """Return the free space that results from dilating a core, with smooth walls.

        It includes the start. Only its largest part is returned, without small pillars.
        """
        unit = self.request.unit
        spike = _SPIKE_UNITS * unit
        inner_rectangle = _build_inner_rectangle(self.request, 0.0)
        # Dilating too far, then eroding by the difference, removes spikes of rock.
        dilated_core = core.buffer(radius + spike).buffer(-spike)
        space = dilated_core.intersection(inner_rectangle).union(self.start_area)
        largest = max(shapely.get_parts(space), key=lambda polygon: float(polygon.area))
        min_area = _MIN_PILLAR_UNIT_AREAS * unit**2
        pillars = [ring for ring in largest.interiors if Polygon(ring).area >= min_area]
        return shapely.simplify(Polygon(largest.exterior, pillars), self.tolerance)

    def compute_excess(self, space: Polygon) -> float:
        """Return the blocked fraction of the map, outside a free space, minus the requested fraction."""
        map_area = float(self.request.width) * float(self.request.height)
        blocked_fraction = 1.0 - float(space.area) / map_area
        return blocked_fraction - self.request.area


def _create_builder(request: Request, corner_disc: DiscStart) -> _CaveBuilder:
    """Return the builder for a request and the start in a corner."""
    side = min(float(request.width), float(request.height))
    tolerance = min(_MAX_TOLERANCE_UNITS * request.unit, _MAX_TOLERANCE_SIDES * side)
    max_error = tolerance + 2.0 * request.step
    disc = Point(corner_disc.center).buffer(corner_disc.radius + 2.0 * max_error)
    return _CaveBuilder(
        request=request,
        tolerance=tolerance,
        min_radius=request.gap / 2.0 + max_error,
        start_area=disc.intersection(_build_inner_rectangle(request, 0.0)),
    )


def _build_inner_rectangle(request: Request, distance: float) -> Polygon:
    """Return the rectangle inside the rim of rock, at the given distance from the rim."""
    width = float(request.width)
    height = float(request.height)
    offset = _RIM_SIDES * min(width, height) + distance
    return shapely.box(offset, offset, width - offset, height - offset)


def _choose_core(builder: _CaveBuilder, points: Array, values: Array, seed: int) -> BaseGeometry:
    """Return the core of a cave that leaves about the requested fraction of the map blocked after dilation.

    The chambers of the core are the areas where a random field is below some level. Raising the level
    enlarges them, so that less of the map is blocked. The level is therefore found by bisection.
    """
    radius = _LEVEL_RADIUS * builder.min_radius
    low = float(values.min())
    high = float(values.max())
    for _ in range(_LEVEL_STEPS):
        level = (low + high) / 2.0
        core = builder.build_core(points, values - level, seed)
        space = builder.dilate(core, radius)
        if builder.compute_excess(space) > 0.0:
            low = level
        else:
            high = level
    return builder.build_core(points, values - (low + high) / 2.0, seed)


def _choose_radius(builder: _CaveBuilder, core: BaseGeometry) -> float:
    """Return the radius of dilation, m, that leaves about the requested fraction of the map blocked.

    Dilating the core by a larger radius blocks less of the map. The radius is found by bisection.
    """
    low = builder.min_radius
    high = _MAX_RADIUS * builder.min_radius
    for _ in range(_RADIUS_STEPS):
        radius = (low + high) / 2.0
        space = builder.dilate(core, radius)
        if builder.compute_excess(space) > 0.0:
            low = radius
        else:
            high = radius
    return (low + high) / 2.0


def _round_rings(request: Request, space: Polygon) -> tuple[Ring, list[Ring]]:
    """Return the outline and the holes of a polygon in rounded coordinates."""
    outline = request.build_ring(shapely.get_coordinates(space.exterior)[:-1])
    holes = [request.build_ring(shapely.get_coordinates(ring)[:-1]) for ring in space.interiors]
    return outline, holes


def _build_obstacles(request: Request, outline: Ring, pillars: list[Ring]) -> list[Obstacle]:
    """Return the rock between the boundary and an outline, and the pillars."""
    width = float(request.width)
    height = float(request.height)
    boundary = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    rock = PolygonObstacle(boundary, (outline,), "rock")
    return [rock, *(PolygonObstacle(ring, name="pillar") for ring in pillars)]


def draw_random_field(request: Request, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draw a smooth random field of mean 0 and variance 1.

    Parameters
    ----------
    request : Request
    rng : numpy.random.Generator

    Returns
    -------
    points : (rows, columns, 2) array, m
        A mesh over the map.
    values : (rows, columns) array
        The field at the points.

    Notes
    -----
    The field is a sum of waves of random direction, length and phase (M. Shinozuka and G. Deodatis,
    *Simulation of stochastic processes by spectral representation*, Applied Mechanics Reviews 44, 1991).
    """
    min_step = request.unit / _MAX_MESH_STEPS_PER_UNIT
    max_step = request.unit / _MIN_MESH_STEPS_PER_UNIT
    step = max(request.width, request.height) / _MAX_MESH_STEPS_PER_SIDE
    step = max(min(step, max_step), min_step)
    x = np.linspace(0.0, request.width, math.ceil(request.width / step) + 1)
    y = np.linspace(0.0, request.height, math.ceil(request.height / step) + 1)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    wavelengths = request.unit * rng.uniform(_MIN_WAVELENGTH_UNITS, _MAX_WAVELENGTH_UNITS, _WAVES)
    directions, phases = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES))
    values = np.zeros(points.shape[:2])
    for wavelength, direction, phase in zip(wavelengths, directions, phases, strict=True):
        distances = points[..., 0] * math.cos(direction) + points[..., 1] * math.sin(direction)
        values += np.cos(2.0 * np.pi / wavelength * distances + phase)
    return points, values * math.sqrt(2.0 / _WAVES)


def extract_area_below_zero(points: Array, values: Array) -> BaseGeometry:
    """Extract the area in which a scalar field, given at the points of a mesh, is negative.

    Parameters
    ----------
    points : (rows, columns, 2) array, m
    values : (rows, columns) array
        Values of the field. On the border of the mesh, they are raised to at least 1.

    Returns
    -------
    geometry

    Notes
    -----
    Each square of the mesh is divided into two triangles, in which the contour is a line ("marching
    triangles"). In a triangle, unlike in a square, the contour is never ambiguous.
    """
    # No contour reaches the border of the mesh if all values there are positive, so that contours are closed.
    raised_values = np.maximum(values, 1.0)
    raised_values[1:-1, 1:-1] = values[1:-1, 1:-1]
    values = raised_values

    def find_crossings(start: tuple[slice, slice], end: tuple[slice, slice]) -> Array:
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


def build_tunnels(components: Array, rng: np.random.Generator) -> list[LineString]:
    """Build lines that join all components, along a minimum spanning tree, each with a bend in its middle.

    Parameters
    ----------
    components : array of geometries
    rng : numpy.random.Generator

    Returns
    -------
    list of LineString
        One fewer than the number of components.
    """
    tunnels: list[LineString] = []
    index = shapely.STRtree(components)
    joined = DisjointSet(range(len(components)))
    # Kruskal's algorithm for the pairs within a distance, which is doubled until all components are joined.
    extent = np.ptp(shapely.total_bounds(components).reshape(2, 2), axis=0)
    distance = float(extent.max()) / len(components)
    while joined.n_subsets > 1:
        # Pairs of components within the distance, each pair once.
        i, j = index.query(components, "dwithin", distance)
        is_ordered = i < j
        i = i[is_ordered]
        j = j[is_ordered]
        lines = shapely.shortest_line(components[i], components[j])
        by_length = np.lexsort((j, i, shapely.length(lines)))
        for k in by_length.tolist():
            were_separate = joined.merge(i[k], j[k])
            if were_separate:
                tunnels.append(_bend_line(lines[k], rng))
        distance *= 2.0
    return tunnels


def _bend_line(line: LineString, rng: np.random.Generator) -> LineString:
    """Return a line of two points with its middle moved sideways at random."""
    start, end = shapely.get_coordinates(line)
    along = end - start
    offset = rng.uniform(-_MAX_BEND, _MAX_BEND) * np.array([-along[1], along[0]])
    return LineString([start, (start + end) / 2.0 + offset, end])


def build_window_tunnel(gap: Gap, core: BaseGeometry, radius: float) -> BaseGeometry:
    """Build a tunnel through a window between two dilated parts of a core.

    A window is a passage that is narrower than the requested gap, where two dilated parts of the core barely
    meet. A line between these parts, added to the core, makes it wider when the core is dilated again.

    Parameters
    ----------
    gap : Gap
        The window.
    core : geometry
    radius : float, m
        Dilation of the core.

    Returns
    -------
    geometry
        A line from part to part; the middle of the window if no part is near on one of its sides.
    """
    # `across` leads along the window from wall to wall, and `through` from one of the parts to the other.
    first_wall = np.array(gap.between[0])
    second_wall = np.array(gap.between[1])
    middle = (first_wall + second_wall) / 2.0
    across = second_wall - first_wall
    across = across / np.hypot(across[0], across[1]) * (_WINDOW_REACH * radius)
    through = np.array([-across[1], across[0]])
    left = middle + across
    right = middle - across
    # The parts of the core in two rectangles, one on either side of the window.
    front = core.intersection(Polygon([left, right, right + through, left + through]))
    back = core.intersection(Polygon([left, right, right - through, left - through]))
    if front.is_empty or back.is_empty:
        return Point(middle)
    start = shapely.shortest_line(Point(middle), front).coords[-1]
    end = shapely.shortest_line(Point(middle), back).coords[-1]
    return LineString([start, middle, end])
