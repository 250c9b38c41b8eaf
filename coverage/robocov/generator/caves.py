"""Maps of the kind `caves`: chambers and tunnels between smooth walls of rock, and pillars.

The core is where a random field, raised along the boundary, is below a level. Its parts are joined by
tunnels, and it is dilated (J. Serra, *Image Analysis and Mathematical Morphology*, 1982) by at least half the
gap. Where two parts of it then meet in a window that is narrower, a tunnel is led through that.
"""

import math

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import DiscStart, Gap, Obstacle, PolygonObstacle, find_narrow_gaps
from robocov.generator.request import AREA_TOLERANCE, Request

_WAVES, _LENGTHS = 48, (0.7, 1.7)  # of a field; shortest and longest, in sides of a usual chamber
# steps of the mesh: in the side of a usual chamber, at most in the longer side of the map, but at least
_FINENESS, _MOST, _COARSEST = 12, 160, 6
_RIM = 0.012  # least thickness of rock at the boundary, in shorter sides of the map
_SHORE, _RAISED = 0.35, 3.0  # belt where rock is likelier, in sides of a usual chamber, and how much
_HALL, _LOWERED = 0.35, 1.5  # radius around the start where it is less likely, and how much
_FINE, _FINEST = 0.008, 0.0027  # walls are simplified by so many sides of a usual chamber, and of the map
_CHAMBER, _PILLAR = 0.03, 0.02  # least areas of a chamber, and of a pillar, in squares of usual chambers
_SPIKE = 0.05  # spikes of rock of half that thickness are rounded off, in sides of a usual chamber
_BEND = 0.25  # tunnels bend by at most so much of their length
_USUAL, _WIDEST = 1.2, 2.0  # radius by which the level is chosen, and the largest, in the least ones
_LEVELS, _RADII = 8, 12  # halvings of the level, and of the radius
_ROUNDS, _PER_ROUND = 12, 0.005  # of widening windows, before a draw is given up; windows per chamber in each
_CLOSE = 0.5  # part of the tolerance of the blocked area that is made use of; rounding takes of the rest


def cave(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return the rock around a cave and the pillars in it; None where a draw leads nowhere."""
    unit, width, height = request.unit, float(request.width), float(request.height)
    fine = min(_FINE * unit, _FINEST * min(width, height))
    # what is lost when walls are simplified and rounded
    lost = fine + 2.0 * request.step
    least = request.gap / 2.0 + lost

    def inside(distance: float) -> Polygon:
        off = _RIM * min(width, height) + distance
        return shapely.box(off, off, width - off, height - off)

    if inside(2.0 * least).is_empty:
        return None
    start = Point(corner.center).buffer(corner.radius + 2.0 * lost).intersection(inside(0.0))
    points, values = random_field(request, rng)
    off = np.minimum(points, points[-1, -1] - points).min(axis=-1)
    values += _RAISED * np.exp(-((off / (_SHORE * unit)) ** 2))
    off = np.hypot(*np.moveaxis(points - np.array(corner.center), -1, 0))
    values -= _LOWERED * np.exp(-((off / (_HALL * unit)) ** 2))
    seed = int(rng.integers(2**32))

    def core(level: float) -> BaseGeometry:
        """Return where the middle of a robot may be: what is below a level, in one piece."""
        low = shapely.simplify(below(points, values - level), fine).intersection(inside(least))
        parts = [part for part in shapely.get_parts(low) if part.area >= _CHAMBER * unit**2]
        hall = start.buffer(-least)
        whole = shapely.union_all([*parts, start.centroid if hall.is_empty else hall])
        return shapely.union_all([whole, *tunnels(shapely.get_parts(whole), np.random.default_rng(seed))])

    def free(core: BaseGeometry, radius: float) -> Polygon:
        """Return what is nearer to the core than a radius, with smooth walls."""
        spike = _SPIKE * unit
        wide = core.buffer(radius + spike).buffer(-spike).intersection(inside(0.0)) | start
        outer = max(shapely.get_parts(wide), key=lambda part: float(part.area))
        pillars = [ring for ring in outer.interiors if Polygon(ring).area >= _PILLAR * unit**2]
        return shapely.simplify(Polygon(outer.exterior, pillars), fine)

    def blocked(space: Polygon) -> float:
        return 1.0 - float(space.area) / (width * height)

    # the level, and then the radius, are such that about as much is blocked as is wanted
    low, high = float(values.min()), float(values.max())
    for _ in range(_LEVELS):
        level = (low + high) / 2.0
        more = blocked(free(core(level), _USUAL * least)) > request.area
        low, high = (level, high) if more else (low, level)
    middle = core((low + high) / 2.0)
    for _ in range(_ROUNDS):
        low, high = least, _WIDEST * least
        for _ in range(_RADII):
            radius = (low + high) / 2.0
            low, high = (radius, high) if blocked(free(middle, radius)) > request.area else (low, radius)
        radius = (low + high) / 2.0
        space = free(middle, radius)
        rings = space.exterior, *space.interiors
        outline, *pillars = (request.build_ring(shapely.get_coordinates(ring)[:-1]) for ring in rings)
        space = Polygon(outline, pillars)
        if abs(blocked(space) - request.area) > _CLOSE * AREA_TOLERANCE:
            return None
        narrow = [
            gap for gap in find_narrow_gaps(MultiPolygon([space]), request.gap) if gap.width < request.gap
        ]
        if not narrow:
            around = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
            rock = PolygonObstacle(around, (outline,), "rock")
            return [rock, *(PolygonObstacle(ring, name="pillar") for ring in pillars)]
        count = math.ceil(_PER_ROUND * request.obstacles)
        middle = shapely.union_all([middle, *(through(gap, middle, radius) for gap in narrow[:count])])
    return None


def random_field(request: Request, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a mesh over the map, (rows, columns, 2) m, and a field on it of mean 0 and variance 1.

    It is a sum of waves of random direction, length and phase (M. Shinozuka and G. Deodatis, *Simulation of
    stochastic processes by spectral representation*, Applied Mechanics Reviews 44, 1991).
    """
    sides = request.width, request.height
    step = max(request.unit / _FINENESS, min(max(sides) / _MOST, request.unit / _COARSEST))
    x, y = (np.linspace(0.0, side, math.ceil(side / step) + 1) for side in sides)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    length = request.unit * rng.uniform(*_LENGTHS, _WAVES)
    angle, phase = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES))
    values = np.zeros(points.shape[:2])
    for k in range(_WAVES):
        along = points[..., 0] * math.cos(angle[k]) + points[..., 1] * math.sin(angle[k])
        values += np.cos(2.0 * np.pi / length[k] * along + phase[k])
    return points, values * math.sqrt(2.0 / _WAVES)


def below(points: Array, values: Array) -> BaseGeometry:
    """Return the polygons where a field on a mesh is below 0; the edge of the mesh counts as above it.

    By marching triangles, two to each square: there are no cases that leave open what hangs together.
    """
    inner = values[1:-1, 1:-1]
    values = np.maximum(values, 1.0)
    values[1:-1, 1:-1] = inner

    def crossed(start: tuple[slice, slice], end: tuple[slice, slice]) -> Array:
        """Return where edges of the mesh cross the level 0, (..., 2) m, nan where they do not."""
        here, there = values[start], values[end]
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.where((here < 0.0) != (there < 0.0), here / (here - there), np.nan)
        return np.asarray(points[start] + (points[end] - points[start]) * part[..., None])

    # the edges from each point to the right, upwards, and to the point above the right one
    right, up = crossed(np.s_[:, :-1], np.s_[:, 1:]), crossed(np.s_[:-1, :], np.s_[1:, :])
    aslant = crossed(np.s_[:-1, :-1], np.s_[1:, 1:])
    triangles = ((right[:-1], up[:, 1:], aslant), (aslant, right[1:], up[:, :-1]))
    edges = np.concatenate([np.stack(three, axis=2).reshape(-1, 3, 2) for three in triangles])
    # a contour that enters a triangle leaves it
    segments = edges[~np.isnan(edges[..., 0])].reshape(-1, 2, 2)
    return shapely.build_area(shapely.multilinestrings(shapely.linestrings(segments)))


def tunnels(parts: Array, rng: np.random.Generator) -> list[LineString]:
    """Return lines that join all parts, as short as can be, with a bend in each: a spanning tree."""
    found: list[LineString] = []
    tree, joined = shapely.STRtree(parts), DisjointSet(range(len(parts)))
    reach = float(np.ptp(shapely.total_bounds(parts).reshape(2, 2), axis=0).max()) / len(parts)
    while joined.n_subsets > 1:
        i, j = tree.query(parts, "dwithin", reach)
        i, j = i[i < j], j[i < j]
        lines = shapely.shortest_line(parts[i], parts[j])
        length = shapely.length(lines)
        short = [k for k in np.lexsort((j, i, length)).tolist() if joined.merge(i[k], j[k])]
        for begin, end in shapely.get_coordinates(lines[short]).reshape(-1, 2, 2):
            along = end - begin
            bend = rng.uniform(-_BEND, _BEND) * np.array([-along[1], along[0]])
            found.append(LineString([begin, (begin + end) / 2.0 + bend, end]))
        reach *= 2.0
    return found


def through(gap: Gap, core: BaseGeometry, radius: float) -> BaseGeometry:
    """Return a line through a window between two parts of a core, or its middle where there are no two."""
    one, other = np.array(gap.between)
    middle = (one + other) / 2.0
    across = (other - one) / np.hypot(*(other - one)) * (1.5 * radius)
    along = np.array([-across[1], across[0]])
    left, right = middle + across, middle - across
    # what is in the halves of a square on either side of the window
    near = [core.intersection(Polygon([left, right, right + side, left + side])) for side in (along, -along)]
    if any(part.is_empty for part in near):
        return Point(middle)
    begin, end = (shapely.shortest_line(Point(middle), part).coords[-1] for part in near)
    return LineString([begin, middle, end])
