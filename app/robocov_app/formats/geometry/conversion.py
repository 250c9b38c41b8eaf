"""From what a reader found to an environment, and how the two compare."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov import environment as env
from robocov.arrays import Array
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment, Ring
from robocov.errors import MapError, ParameterError, format_count, quote, to_one_line
from robocov.mapfile import from_json, to_json
from robocov.mapfile.check import MANY_VERTICES, count_vertices, describe_vertex_count
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M
from robocov_app.formats.base import ForeignMap, ImportReport, Options, Primitive, square_metres
from robocov_app.formats.geometry.cleaning import Cleaned, Deviation, measure_deviation, remove_hairs
from robocov_app.formats.geometry.corners import sharpen_corners
from robocov_app.formats.geometry.narrow_gaps import count_ray_crossings
from robocov_app.formats.geometry.polygons import (
    buffer_with_mitres,
    build_boundary,
    extract_sides,
    fill_holes,
    list_polygons,
    make_valid,
    round_polygons,
    tidy_ring,
    to_multipolygon,
    unite,
)
from robocov_app.formats.geometry.simplify import SimplifiedSpace, simplify_free_space

_CRUMB = 1e-4  # obstacles and parts that are smaller, in m², come of rounding
DEFAULT_TOLERANCE = 0.02  # by how much walls of vector formats may move, in metres
_GRID = 1e-4  # to so many metres coordinates are rounded, or to a hundredth of a cell if that is finer
_TINY, _MANY = 0.01, 10  # obstacles smaller than this, in m², are perhaps noise: so many are worth a word
# where less of the free area stays than the first, or a part of more than the second does not, it is said how
# to choose: so many of the largest parts that are left out are named, with a place in each
_LITTLE, _CONSIDERABLE, _OFFERED = 0.5, 0.1, 3
# the largest part of the free space is paper around a plan where it runs along so much of the page's edge,
# and encloses something so large beside it: less is the inside of an obstacle drawn as an outline
_PAGE_EDGE, _PLAN_SHARE = 0.2, 0.05
_HOLLOW_SHARE = (
    0.1  # of the page: the box around an obstacle that may be the walls of a plan with an open door
)
# of maps with more vertices it takes too long to say where robots do not pass, and the narrowest passage
_SOON, _MOST_VERTICES = 10_000, 20_000
MAX_OBSTACLES, MAX_KEPT = 8_000, 50_000  # obstacles, vertices of a map: to make as many takes seconds
MAX_PRIMITIVES = 5_000  # circles and walls that stay such; of more, to compare takes seconds
_Obstacle = TypeVar("_Obstacle", bound=env.Obstacle)
_MOST_ROBOTS = 1000  # of a file, so many are looked at
_ZERO = 1e-100  # coordinates nearer to zero, in metres, are zero; as of map files
_SQUARES, _MOST_RAYS = 1024, 5_000_000  # squares of each size that are cut; sides that rays may cross
_QUARTERS = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])
_BESIDE = 1e-3  # metres from a pocket to the obstacles beside it
_MAX_ROUNDS = 5  # of the search for primitives that leave no pockets
_SLIVER = 2.0  # tolerances of width below which a difference is a wall that moved, not one that was lost


@dataclass(frozen=True)
class Shaping(Options):
    """Parameters of the conversion of a foreign map to an environment."""

    simplify: float | None = None
    """Walls may move by so many metres where that saves vertices; 0 keeps all. By default one cell of a
    grid, 0.02 of the rest."""
    specks: float | None = None
    """Obstacles smaller than so many m² are dropped. By default single cells of ROS maps and JPEGs are, else
    none."""
    keep: Literal["largest", "all"] = "largest"
    """Which connected parts of the free space stay; where the file places robots, the one with most of them
    counts as the largest."""
    inside: tuple[float, float] | None = None
    """The part of the free space that holds this place, x and y in the map's metres, stays instead of the
    largest."""
    hull: bool = False
    """The boundary is the convex hull of the free space, not its outline."""
    margin: float = 0.0
    """So many metres around the free space are solid."""
    radius: float = DEFAULT_RADIUS_M
    """Radius of a robot in metres: where it passes in the file, it passes in the map."""
    default_start: Literal["room", "uniform"] = "room"
    """The map's default start: a disc at the roomiest place, or anywhere."""

    def __post_init__(self) -> None:
        self.require(
            simplify=(0, 10, "m"), specks=(0, 1e6, "m²"), margin=(0, 100, "m"), radius=(1e-3, 100, "m")
        )
        if self.inside is None:
            return
        if len(self.inside) != 2 or not all(abs(value) <= MAX_COORDINATE_M for value in self.inside):
            wanted = f"expected two numbers from {-MAX_COORDINATE_M:.0f} to {MAX_COORDINATE_M:.0f} (m)"
            raise ParameterError(f"inside: {wanted}, got {quote(self.inside)}")
        if self.keep == "all":
            raise ParameterError("inside: keeps one part of the free space, but keep is all")


def build_environment(foreign: ForeignMap, shaping: Shaping, where: str) -> tuple[Environment, ImportReport]:
    """Return the environment that `foreign` stands for, and what was done; MapError where it is no map."""
    return _Shaper(foreign, shaping, where).shaped()


class _Plan(NamedTuple):
    """A boundary, m, the polygons and the primitives in it that are solid, and what has moved for them."""

    boundary: Polygon
    solid: list[Polygon]
    primitives: list[Primitive]
    deviation: Deviation

    def find_free(self) -> MultiPolygon:
        """Return what is free, as `Environment` has it, m."""
        blocked = shapely.union_all(
            [*self.solid, *(primitive.polygon for primitive in self.primitives)], grid_size=env.GRID_M
        )
        return to_multipolygon(shapely.difference(self.boundary, blocked, grid_size=env.GRID_M))


class _Shaper:
    """Makes the environment, and notes what the report will say."""

    def __init__(self, foreign: ForeignMap, shaping: Shaping, where: str) -> None:
        self.foreign, self.shaping, self.where, self.radius = foreign, shaping, where, shaping.radius
        self.repaired, self.dropped, self.notes = [*foreign.repaired], [*foreign.dropped], [*foreign.notes]
        self.changed: list[str] = []
        self.is_enclosed = False  # whether an enclosed part stays in place of the largest
        self.others: list[tuple[float, float]] = []
        self.specks = foreign.specks if shaping.specks is None else shaping.specks
        # how far from walls a robot starts, m: the rules of maps want room for the usual one
        self.clearance = max(DEFAULT_RADIUS_M, self.radius) * (1 + env.MIN_START_GAP_RADII)
        grid = _GRID if foreign.cell is None else min(_GRID, foreign.cell / 100)
        self.digits = -math.floor(math.log10(grid) + 1e-9)

    def shaped(self) -> tuple[Environment, ImportReport]:
        """Return the environment, and the report on how it was made."""
        outlines = self._valid_boundary()
        read = self._valid(outlines)
        cleaned = self._remove_hairs(read)
        parts = self._without_specks(self._kept(cleaned.free))
        outer = self._choose_boundary(outlines, parts)
        self._require_few(sum(len(part.interiors) for part in parts), "obstacles", MAX_OBSTACLES)
        self._require_room(parts)
        before = MultiPolygon(parts)
        drawing = self._simplify(before, read)
        self._require_few(shapely.count_coordinates(drawing.free), "vertices", MAX_KEPT)
        plan = self._build(drawing, outer, before, read)
        self._report_deviation(plan.deviation, drawing.free)
        environment = self._to_environment(plan, drawing.free)
        self._report_reach(environment)
        kept = count_vertices(environment)
        self.notes += [describe_vertex_count(kept)] if kept > MANY_VERTICES else []
        width, height = np.ptp(np.array(environment.boundary), axis=0).tolist()
        return environment, ImportReport(
            source=self.where,
            format=self.foreign.format,
            vertices_read=self.foreign.vertices_read,
            vertices_kept=kept,
            area_read=float(read.area),
            area_kept=environment.free_area,
            size=(round(width, self.digits), round(height, self.digits)),
            obstacles=len(environment.obstacles),
            tolerance=drawing.tolerance,
            moved_area=plan.deviation.area,
            moved=plan.deviation.distance,
            removed=cleaned.number,
            removed_area=cleaned.area,
            others=tuple(self.others),
            repaired=tuple(self.repaired),
            dropped=tuple(self.dropped),
            changed=tuple(self.changed),
            notes=tuple(self.notes),
        )

    def _remove_hairs(self, free: MultiPolygon) -> Cleaned:
        """Return the free space without what is thinner than the decimals of a map; cells have no such."""
        if self.foreign.cell is not None:
            return Cleaned(free)
        grid = 10.0**-self.digits
        cleaned = remove_hairs(free, 2 * grid, max(self._tolerance(), 2 * grid))
        if cleaned.number:
            what = f"{format_count(cleaned.number, 'hair')} (slits, spurs) thinner than {2000 * grid:g} mm"
            self.changed.append(f"removed {what}, {square_metres(cleaned.area, 2)}")
        return cleaned

    def _choose_boundary(self, outlines: MultiPolygon | None, parts: list[Polygon]) -> Polygon | None:
        """Return the boundary around the parts that stay; None where it is the outline of these.

        A boundary counts as far as the free space reaches it. Where walls separate all of the free space from
        it, what is behind them is no concern of the robots: the known region would be larger than what they
        can cover, and draw them to the walls. So the boundary is then the inner edge of the walls, in all
        formats. Only a boundary that the file or the user calls so stays, unless the user chooses another
        part of the free space.
        """
        foreign, shaping = self.foreign, self.shaping
        outer = None
        if outlines is not None:
            around = [each for each in outlines.geoms if shapely.intersects(each, parts).all()]
            outer = around[0] if around else None
        is_chosen = shaping.inside is not None or (foreign.robots != () and shaping.keep == "largest")
        stays = foreign.has_named_boundary and not (is_chosen or self.is_enclosed)
        if outer is not None and len(parts) == 1 and not stays and outer.contains_properly(parts[0]):
            self.notes.insert(0, "the boundary is the inner edge of the walls around the free space")
            return None
        if outer is not None and foreign.boundary_source:
            self.notes.insert(0, f"the boundary is {foreign.boundary_source}")
        return outer

    def _simplify(self, before: MultiPolygon, read: MultiPolygon) -> SimplifiedSpace:
        """Return the free space with fewer vertices, rounded; walls moved by the tolerance at most."""
        foreign, tolerance = self.foreign, self._tolerance(report=True)
        sharp = before
        if foreign.cut_corners:
            sharp = MultiPolygon([sharpen_corners(part, tolerance) for part in before.geoms])
        grid = 10.0**-self.digits
        # where the steps add up to more than is allowed, they do less
        attempts = [(sharp, tolerance), (sharp, tolerance / 2), (before, tolerance / 2), (before, 0.0)]
        for plan, allowed in attempts:
            simple = simplify_free_space(plan, allowed, foreign.cell, self.radius)
            free = round_polygons(simple.free, self.digits)
            if free.is_empty:
                few = f"only {read.area:.3g} m² are free"
                raise MapError(f"{self.where}: {few}: is the scale right?")
            if measure_deviation(before, free).distance <= tolerance + grid:
                break
        self.changed += simple.changed
        return simple._replace(free=free)

    def _build(
        self, drawing: SimplifiedSpace, outer: Polygon | None, before: MultiPolygon, read: MultiPolygon
    ) -> _Plan:
        """Return boundary and obstacles that leave what is free in a drawing."""
        shaping, free = self.shaping, drawing.free
        if outer is not None:
            simple = simplify_free_space(
                MultiPolygon([outer]), self._tolerance(), self.foreign.cell, self.radius
            )
            base = fill_holes(simple.free)
        elif len(free.geoms) == 1 and self.foreign.primitives:
            base = self._fill_notches(free.geoms[0])
        else:
            base = None
        boundary, solid = build_boundary(
            free, base, hull=shaping.hull, margin=shaping.margin, digits=self.digits
        )
        if outer is not None:
            solid = _without_slivers(solid, shapely.difference(outer, read), drawing.tolerance)
        plan = _Plan(boundary, solid, [], measure_deviation(before, free))
        if not self.foreign.primitives or shapely.get_num_coordinates(free) > _SOON:
            return plan
        return self._with_primitives(plan, drawing, before)

    def _fill_notches(self, outline: Polygon) -> Polygon:
        """Return the outline of free space without the notches that walls of the file are.

        These walls stay what they are, obstacles. They lie in the convex hull of the outline, so that the
        region that robots know is the same.
        """
        outline = Polygon(outline.exterior)
        walls = [each for each in self.foreign.primitives if isinstance(each, env.WallObstacle)]
        if not walls:
            return outline
        reach = max(wall.width for wall in walls) / 2 + 2 * self._tolerance()
        grown = buffer_with_mitres(outline, reach)
        closed = buffer_with_mitres(grown, -reach)
        notches = np.array(
            list_polygons(shapely.difference(closed & outline.convex_hull, outline)), dtype=object
        )
        covered = shapely.union_all([wall.polygon for wall in walls]).buffer(2 * self._tolerance())
        notches = notches[shapely.covers(covered, notches)]
        return fill_holes(round_polygons(unite([outline, *notches.tolist()]), self.digits))

    def _to_environment(self, plan: _Plan, free: MultiPolygon) -> Environment:
        environment = Environment(
            name=to_one_line(self.foreign.name)[:100].strip() or "map",
            boundary=self._ring(plan.boundary.exterior),
            obstacles=(*self._obstacles(plan.solid), *plan.primitives),
            starts=self._starts(free),
            description=self.foreign.description[:10_000],
        )
        # through the rules of map files: what is imported can be saved and loaded
        return from_json(to_json(environment), self.where)

    def _report_deviation(self, deviation: Deviation, free: MultiPolygon) -> None:
        if deviation.distance >= 1e-3:
            part = f"{100 * deviation.area / free.area:.2g} % of the free area"
            walls = f"walls moved by at most {deviation.distance:.2g} m"
            self.changed.append(f"{walls}; {square_metres(deviation.area, 2)} changed sides, {part}")

    def _report_reach(self, environment: Environment) -> None:
        """Report which places a robot does not reach from the largest one, where that is soon known."""
        if shapely.get_num_coordinates(environment.free) > _SOON:
            return
        reached = sorted((place.area for place in find_rooms(environment.free, self.radius)), reverse=True)
        if len(reached) > 1:
            what = f"{format_count(len(reached) - 1, 'place')} of {square_metres(sum(reached[1:]), 3)}"
            self.notes.append(f"{what} no robot of radius {self.radius:g} m reaches from the largest one")

    def _valid_boundary(self) -> MultiPolygon | None:
        """Return the parts of the boundary, without holes; None where there is none."""
        given = self.foreign.boundary
        if given is None:
            return None
        if not given.is_valid:
            self.repaired.append(f"the boundary met itself: {_reason(given)}")
            given = make_valid(given)
        valid = [Polygon(part.exterior) for part in list_polygons(given)]
        return MultiPolygon(valid) if valid else None

    def _valid(self, outer: MultiPolygon | None) -> MultiPolygon:
        """Return the free space within `outer` as disjoint valid polygons, the largest first."""
        given = self.foreign.free
        if not np.isfinite(shapely.get_coordinates(given)).all():
            raise MapError(f"{self.where}: expected finite coordinates")
        # what is all but zero makes GEOS divide by zero
        free: BaseGeometry = shapely.transform(given, lambda xy: np.where(abs(xy) < _ZERO, 0.0, xy))
        if not free.is_valid:
            self.repaired.append(f"outlines met themselves or each other: {_reason(free)}")
            free = make_valid(free)
        if outer is not None and not shapely.covers(outer, free):
            inside = shapely.intersection(free, outer)
            lost = free.area - inside.area
            if lost > _CRUMB:
                self.dropped.append(f"{square_metres(lost, 3)} of free space outside the boundary")
            free = inside
        valid = to_multipolygon(free)
        if valid.is_empty:
            raise MapError(f"{self.where}: there is no free space")
        return valid

    def _kept(self, free: MultiPolygon) -> list[Polygon]:
        parts, robots, shaping = np.array(free.geoms, dtype=object), self.foreign.robots, self.shaping
        drop, note = self.dropped.append, self.notes.append
        area = shapely.area(parts)
        if shaping.keep == "all":
            stays = area >= max(self.specks, min(_CRUMB, area[0]))
        elif shaping.inside is not None:
            distance = shapely.distance(parts, shapely.Point(shaping.inside))
            nearest = int(np.argmin(distance))
            if distance[nearest] > 0.0:
                (a, b), (x, y) = shaping.inside, _place_in(parts[nearest])
                raise MapError(
                    f"{self.where}: inside: {a:.10g} {b:.10g} is solid, expected a free position; "
                    f"{x:.10g} {y:.10g} is one in the nearest part, {distance[nearest]:.3g} m away"
                )
            stays = np.arange(len(parts)) == nearest
        elif (enclosed := self._enclosed_part(parts)) is not None:
            stays = np.arange(len(parts)) == enclosed
        else:
            shapely.prepare(parts)
            places = shapely.points(np.array(robots[:_MOST_ROBOTS]).reshape(-1, 2))
            most = int(np.argmax([shapely.contains(part, places).sum() for part in parts])) if robots else 0
            stays = np.arange(len(parts)) == most
            if most:
                note("the part of the free space with most robots stays, which is not the largest")
        kept: list[Polygon] = parts[stays].tolist()
        left: list[Polygon] = parts[~stays].tolist()
        if not kept:
            found = f"no part of the free space is larger than {area[0]:.3g} m²"
            raise MapError(f"{self.where}: {found}, expected one of at least {self.specks:g} m²")
        if left:
            largest = f" (the largest {square_metres(left[0].area, 3)})" if len(left) > 1 else ""
            drop(f"{format_count(len(left), 'separate part')} of the free space, {_squared(left)}{largest}")
            share = area[stays].sum() / area.sum()
            if share < _LITTLE or left[0].area / area.sum() > _CONSIDERABLE:
                self.others = [_place_in(part) for part in left[:_OFFERED]]
                choices = " or ".join(
                    f"--inside {x:.10g} {y:.10g} ({square_metres(part.area, 3)})"
                    for (x, y), part in zip(self.others, left, strict=False)
                )
                stay = f"{'only ' if share < _LITTLE else ''}{100 * share:.2g} % of the free area stays"
                note(f"{stay}: {choices} keeps another part, --keep all every part")
        if len(kept) > 1:
            note(f"the free space is of {len(kept)} separate parts: robots cannot pass between them")
        return kept

    def _enclosed_part(self, parts: NDArray[np.object_]) -> int | None:
        """Return the index of the largest enclosed part, where the largest is the paper around a plan."""
        page = self.foreign.page
        if page is None or self.foreign.robots:
            return None
        touches = [_length_along(part, page) for part in parts]
        share = touches[0] / page.length
        if share < _PAGE_EDGE:
            return None
        x, y = _place_in(parts[0])
        edge = f"{100 * share:.0f} % of the edge of the picture"
        paper = f"{square_metres(parts[0].area, 3)}, runs along {edge}"
        enclosed = [k for k, length in enumerate(touches) if length == 0.0]
        if enclosed and parts[enclosed[0]].area >= _PLAN_SHARE * parts[0].area:
            self.notes.append(
                f"the largest part of the free space, {paper}: taken as the paper around a plan, of which "
                f"the largest enclosed part stays (--inside {x:.10g} {y:.10g}: the part along the edge)"
            )
            self.is_enclosed = True
            return enclosed[0]
        if _has_hollow_obstacle(parts[0], _HOLLOW_SHARE * page.area):
            self.notes.append(
                f"the largest part of the free space, {paper}: if that is the paper around a plan, an outer "
                "door may be open"
            )
        return None

    def _without_specks(self, parts: list[Polygon]) -> list[Polygon]:
        cell, least = self.foreign.cell, self.specks
        crumb = _CRUMB if cell is None else min(_CRUMB, cell * cell / 2)
        drop, note = self.dropped.append, self.notes.append
        result, specks, crumbs, tiny = [], [], [], 0
        for part in parts:
            holes = np.array([Polygon(hole) for hole in part.interiors], dtype=object)
            area = shapely.area(holes)
            specks += holes[(area < least) & (area >= crumb)].tolist()
            crumbs += holes[area < crumb].tolist()
            stays = area >= max(crumb, least)
            tiny += int(np.count_nonzero(stays & (area < _TINY)))
            rings = shapely.get_exterior_ring(holes[stays]).tolist()
            result.append(part if stays.all() else Polygon(part.exterior, rings))
        if specks:
            few = f"{format_count(len(specks), 'obstacle')} smaller than {least:.3g} m²"
            drop(f"{few}, {_squared(specks)} (--specks 0 keeps them)")
        if crumbs:
            drop(f"{format_count(len(crumbs), 'hole')} of {_squared(crumbs)}, which come of rounding")
        if tiny >= _MANY and least < _TINY:
            note(f"{tiny} obstacles are smaller than {_TINY:g} m² (--specks {_TINY:g} drops them)")
        return result

    def _tolerance(self, *, report: bool = False) -> float:
        """Return by how much walls may move, m: where cells are larger than robots, each one counts."""
        cell, width = self.foreign.cell, 2 * self.radius
        if self.shaping.simplify is not None:
            return self.shaping.simplify
        if cell is None:
            return DEFAULT_TOLERANCE
        if cell > width and report:
            what = f"walls move by at most {width:g} m, not by one (--simplify {cell:g})"
            self.notes.append(f"cells are larger than robots: {what}")
        return min(cell, width)

    def _require_few(self, count: int, what: str, most: int) -> None:
        if count > most:
            ways = "--specks AREA drops small obstacles, --simplify METRES draws walls with fewer vertices"
            raise MapError(f"{self.where}: expected at most {most}, got {count} {what}: {ways}")

    def _require_room(self, parts: list[Polygon]) -> None:
        widest = 0.0
        for part in parts:
            if math.sqrt(part.area / math.pi) > widest:
                widest = max(widest, find_roomiest_point(part, self.clearance / 50, self.clearance)[1])
            if widest >= self.clearance:
                return
        wanted, most = self.clearance / (1 + env.MIN_START_GAP_RADII), widest / (1 + env.MIN_START_GAP_RADII)
        found = f"(the widest is for one of {most:.3g} m): is the scale right?"
        raise MapError(f"{self.where}: no place is wide enough for a robot of radius {wanted:g} m {found}")

    def _obstacles(self, solid: list[Polygon]) -> list[env.PolygonObstacle]:
        """Return `solid` as obstacles, the largest first, without what is too small for a map."""
        kept = [part for part in solid if min(np.subtract(part.bounds[2:], part.bounds[:2])) >= MIN_SIZE_M]
        if len(kept) < len(solid):
            thin = format_count(len(solid) - len(kept), "obstacle")
            self.dropped.append(f"{thin} thinner than {MIN_SIZE_M * 1000:g} mm")
        kept.sort(key=lambda part: (-round(part.area, 6), part.bounds))
        ring = self._ring
        return [env.PolygonObstacle(ring(part.exterior), (*map(ring, part.interiors),)) for part in kept]

    def _ring(self, ring: BaseGeometry) -> Ring:
        """Return a closed ring as a map has it: counter-clockwise from its leftmost vertex."""
        points = np.round(shapely.get_coordinates(ring)[:-1], self.digits) + 0.0
        points = tidy_ring(points, self.digits)
        if not shapely.is_ccw(ring):
            points = points[::-1]
        first = int(np.lexsort((points[:, 1], points[:, 0]))[0])
        return tuple((float(x), float(y)) for x, y in np.roll(points, -first, axis=0))

    def _starts(self, free: MultiPolygon) -> dict[str, env.StartSpec]:
        """Return the starts: a disc at the roomiest place, everywhere, and where the file places robots."""
        clearance, robots, part = self.clearance, self.foreign.robots, free.geoms[0]
        # what is finer than this does not move a start by much
        (x, y), room = find_roomiest_point(part, max(0.01, math.sqrt(part.area) / 500))
        # the disc holds centres: one robot's radius stays between it and the walls
        radius = min(room - clearance, 2.0)
        starts: dict[str, env.StartSpec] = {"uniform": env.UniformStart()}
        if radius >= 0.02:
            disc = env.DiscStart((round(x, 2) + 0.0, round(y, 2) + 0.0), math.floor(100 * radius) / 100)
            both: dict[str, env.StartSpec] = {"room": disc, **starts}
            starts = both if self.shaping.default_start == "room" else dict(reversed(both.items()))
        if robots:
            given = np.array(list(dict.fromkeys(robots))[:_MOST_ROBOTS])
            fits = shapely.contains_properly(free, shapely.points(given))
            fits &= shapely.distance(free.boundary, shapely.points(given)) >= clearance
            for k in np.flatnonzero(fits).tolist():
                fits[k] = (np.hypot(*(given[:k][fits[:k]] - given[k]).T) >= 2 * clearance).all()
            if fits.any():
                starts["robots"] = env.PointsStart(tuple((x, y) for x, y in given[fits].tolist()))
            rest = "" if fits.sum() == len(robots) else "; there is no room at the others"
            many = f"{int(fits.sum())} of {format_count(len(robots), 'place')}"
            self.notes.append(f'start "robots": {many} of robots in the file{rest}')
        return starts

    def _with_primitives(self, plan: _Plan, drawing: SimplifiedSpace, before: MultiPolygon) -> _Plan:
        """Return a plan with circles and walls in place of the polygons that they make up.

        Not where a pocket would be left between one and what is beside it, nor any where walls would have
        moved by more than the tolerance.
        """
        places = max(len(find_rooms(space, self.radius)) for space in (before, drawing.free))
        unwanted: frozenset[Primitive] = frozenset()
        for _ in range(_MAX_ROUNDS):
            found = self._match_primitives(plan, drawing.tolerance, places, unwanted)
            if not found.primitives:
                return plan
            pockets = _find_pockets(found)
            beside = {
                each for each in found.primitives if (shapely.distance(each.polygon, pockets) < _BESIDE).any()
            }
            if not beside:
                # its vertices where polygons began that are gone
                boundary = round_polygons(found.boundary.simplify(0.0), self.digits).geoms[0]
                deviation = measure_deviation(before, found.find_free())
                # a circle stays within its sagitta, whatever number of sides it is drawn with
                limit = self._tolerance() + 10.0**-self.digits + env.MAX_SAGITTA_M
                if deviation.distance > max(limit, plan.deviation.distance):
                    return plan
                return found._replace(boundary=boundary, deviation=deviation)
            unwanted |= beside
        return plan

    def _match_primitives(
        self, plan: _Plan, tolerance: float, places: int, unwanted: frozenset[Primitive]
    ) -> _Plan:
        """Return a plan with the primitives that make up its polygons, in their order, and the others.

        A polygon goes where the primitives on it cover the same inside the boundary: neither reaches further
        than twice the tolerance beyond the other, as corners may, their areas differ by no more than the
        tolerance all along the outline, and the primitives have fewer points. Those of several primitives
        stay, or all of them, where a robot would have more than so many `places`, apart from each other.
        """
        boundary, solid = plan.boundary, plan.solid
        slack = tolerance + 10.0**-self.digits
        rounded_to = {
            transform_numbers(each, lambda value: round(value, self.digits) + 0.0): each
            for each in self.foreign.primitives
        }
        usable = [each for each in rounded_to if _fits(each) and each not in unwanted]
        if not usable or len(usable) > MAX_PRIMITIVES:
            return plan
        # of another radius, however near, a circle may be drawn with another number of sides
        covered = np.array([rounded_to[primitive].polygon for primitive in usable], dtype=object)
        shapely.prepare(boundary)
        outside = ~shapely.covers(boundary, covered)
        covered[outside] = shapely.intersection(covered[outside], boundary)
        piece, source = shapely.get_parts(covered, return_index=True)
        tree = STRtree(piece)
        made: list[set[int]] = []
        for part in solid:
            found = np.sort(tree.query(part.buffer(2 * slack), "covers"))
            own = set(source[found].tolist())
            union = shapely.union_all(piece[found])
            same = (
                sum(len(_points(usable[k])) for k in own) < shapely.get_num_coordinates(part)
                and union.buffer(2 * slack).covers(part)
                and shapely.symmetric_difference(part, union).area <= slack * part.length
            )
            made.append(own if same else set())
        # several may have a gap among them that was filled
        for most in (len(usable), 1):
            kept = [usable[k] for k in sorted(set().union(*(own for own in made if len(own) <= most)))]
            rest = [part for part, own in zip(solid, made, strict=True) if not 0 < len(own) <= most]
            found_plan = plan._replace(solid=rest, primitives=kept)
            if len(find_rooms(found_plan.find_free(), self.radius)) <= places:
                return found_plan
        return plan


def _find_pockets(plan: _Plan) -> Array:
    """Return parts of the free space that no file means: they are smaller than what comes of rounding."""
    parts = shapely.get_parts(plan.find_free())
    area = shapely.area(parts)
    return np.asarray(parts[area < min(_CRUMB, area.max(initial=0.0))])


def _reason(geometry: BaseGeometry) -> str:
    what, _, place = shapely.is_valid_reason(geometry).partition("[")
    x, _, y = place.rstrip("]").partition(" ")
    return f"{what.lower()} at [{float(x):.6g}, {float(y):.6g}]" if y else what.lower()


def _has_hollow_obstacle(part: Polygon, area: float) -> bool:
    """Return whether a hole of `part` fills little of its bounding box, of at least that area in m²."""
    holes = shapely.polygons(shapely.get_rings(part)[1:])
    low_x, low_y, high_x, high_y = shapely.bounds(holes).reshape(-1, 4).T
    boxes = (high_x - low_x) * (high_y - low_y)
    return bool(((boxes >= area) & (shapely.area(holes) < _LITTLE * boxes)).any())


def _length_along(part: Polygon, page: Polygon) -> float:
    """Return how much of the outline of a part runs along the edge of a page, an upright rectangle, m."""
    sides = extract_sides(part)
    low_x, low_y, high_x, high_y = page.bounds
    slack = 1e-6 * max(high_x - low_x, high_y - low_y)
    length = np.hypot(*(sides[:, 1] - sides[:, 0]).T)
    total = 0.0
    for axis, edge in ((0, low_x), (0, high_x), (1, low_y), (1, high_y)):
        on_edge = (np.abs(sides[:, :, axis] - edge) <= slack).all(axis=1)
        total += float(length[on_edge].sum())
    return total


def _place_in(part: Polygon) -> tuple[float, float]:
    point = shapely.point_on_surface(part)
    return round(point.x, 2) + 0.0, round(point.y, 2) + 0.0


def _squared(parts: list[Polygon]) -> str:
    return f"{square_metres(sum(part.area for part in parts), 3)}{' together' if len(parts) > 1 else ''}"


def _without_slivers(solid: list[Polygon], before: BaseGeometry, tolerance: float) -> list[Polygon]:
    """Return `solid` without what lies between a boundary and a free space that ran along it.

    Walls of the two have moved apart there: it is thinner than they may move, and was not solid `before`.
    """
    if not solid or tolerance == 0.0:
        return solid
    parts = np.array(solid, dtype=object)
    thin = shapely.is_empty(shapely.buffer(parts, -tolerance, quad_segs=2))
    fresh = shapely.area(shapely.intersection(parts[thin], before)) < shapely.area(parts[thin]) / 2
    return list(np.delete(parts, np.flatnonzero(thin)[fresh]))


def transform_numbers(obstacle: _Obstacle, number: Callable[[float], float]) -> _Obstacle:
    """Return an obstacle with other numbers for all that it has."""

    def ring(points: Ring) -> Ring:
        return tuple((number(x), number(y)) for x, y in points)

    if isinstance(obstacle, env.CircleObstacle):
        return replace(obstacle, center=ring((obstacle.center,))[0], radius=number(obstacle.radius))
    if isinstance(obstacle, env.WallObstacle):
        return replace(obstacle, points=ring(obstacle.points), width=number(obstacle.width))
    assert isinstance(obstacle, env.PolygonObstacle)
    return replace(obstacle, vertices=ring(obstacle.vertices), holes=tuple(map(ring, obstacle.holes)))


def _points(primitive: Primitive) -> np.ndarray:
    return np.array([primitive.center] if isinstance(primitive, env.CircleObstacle) else primitive.points)


def _fits(primitive: Primitive) -> bool:
    points = _points(primitive)
    if isinstance(primitive, env.CircleObstacle):
        sizes = [primitive.radius]
    else:
        sizes = [primitive.width, np.ptp(points, axis=0).max()]
    return bool(
        min(sizes) >= MIN_SIZE_M and max(sizes) <= MAX_SIZE_M and np.abs(points).max() <= MAX_COORDINATE_M
    )


@dataclass(frozen=True, eq=False)
class ImportComparison:
    """Free space as it was read and as it became, m; what is `lost` and `opened`, but for walls that moved.

    `region`: convex, around all of it. `gap`: the narrowest passage that is left, if that is soon known.
    """

    before: BaseGeometry
    after: BaseGeometry
    lost: BaseGeometry
    opened: BaseGeometry
    region: BaseGeometry
    gap: env.Gap | None

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        x, y, right, top = self.region.bounds
        return x, y, right, top


def compare_maps(foreign: ForeignMap, environment: Environment, report: ImportReport) -> ImportComparison:
    before, after = foreign.free, environment.free
    before = before if before.is_valid else make_valid(before)
    everything = [before, after, environment.region.polygon, foreign.boundary or before]
    lost, opened = _changed(before, after, report.tolerance), _changed(after, before, report.tolerance)
    gap = env.find_narrowest_gap(after) if report.vertices_kept <= _MOST_VERTICES else None
    return ImportComparison(
        before, after, lost, opened, shapely.GeometryCollection(everything).convex_hull, gap
    )


def _changed(first: BaseGeometry, second: BaseGeometry, tolerance: float) -> MultiPolygon:
    """Return what is in the first and not in the second, without the slivers along walls that moved."""
    parts = shapely.get_parts(shapely.difference(first, second))
    parts = parts[shapely.area(parts) > 0.0]
    # of a long strip this is its width
    width = 2.0 * shapely.area(parts) / shapely.length(parts)
    return MultiPolygon(parts[width > max(_SLIVER * tolerance, 1e-3) / 2].tolist())


def find_rooms(free: MultiPolygon, radius: float) -> list[Polygon]:
    """Return where the centre of a robot may be, each place that it cannot leave, but for tiny ones."""
    inner = free.buffer(-radius, quad_segs=4)
    return [part for part in shapely.get_parts(inner).tolist() if part.area > radius * radius / 4]


def find_roomiest_point(
    free: Polygon, tolerance: float, enough: float = math.inf
) -> tuple[tuple[float, float], float]:
    """Return the place farthest from the walls, and how far that is, m; or any that is far `enough`.

    Squares that may hold one better by `tolerance` are cut into four, the `_SQUARES` most promising of them.
    """
    sides = shapely.linestrings(extract_sides(free))
    walls = STRtree(sides)
    shapely.prepare(free)
    low_x, low_y, high_x, high_y = free.bounds
    width, height = high_x - low_x, high_y - low_y
    some = np.linspace(low_y, high_y, _SQUARES)
    squares = max(min(_SQUARES, _SQUARES * _MOST_RAYS // max(count_ray_crossings(sides, some), 1)), 16)
    side = max(min(width, height), max(width, height) / squares)
    corners = np.meshgrid(np.arange(low_x, high_x, side), np.arange(low_y, high_y, side))
    centres = np.stack(corners, axis=-1).reshape(-1, 2) + side / 2
    best, place = -math.inf, centres[0]
    while len(centres) and best < enough:
        _, away = walls.query_nearest(shapely.points(centres), return_distance=True, all_matches=False)
        away = np.where(shapely.contains_xy(free, *centres.T), away, -away)
        if away.max() > best:
            best, place = float(away.max()), centres[away.argmax()]
        hopeful = away + side * math.sqrt(0.5)
        order = np.argsort(-hopeful, kind="stable")[:squares]
        better = best + tolerance if enough == math.inf else max(best + tolerance, enough)
        centres = centres[order[hopeful[order] > better]]
        side /= 2
        centres = (centres[:, None] + side / 2 * _QUARTERS).reshape(-1, 2)
    return (float(place[0]), float(place[1])), best
