"""Edits of where things are: moved, turned, scaled, mirrored, copied, aligned, distributed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any, Final, Literal, Self, TypeAlias

import numpy as np
import shapely

from robocov.density import Gaussians, WeightedPolygons
from robocov.environment import CircleObstacle, DiscStart, Point, PolygonObstacle, Ring
from robocov.errors import MapError
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov_app.editor.edits.create import add_objects
from robocov_app.editor.edits.vertices import place_vertices
from robocov_app.editor.model import geometry, require
from robocov_app.editor.model.background import rotate_background
from robocov_app.editor.model.geometry import Box, compute_centre, enclose_boxes, round_length
from robocov_app.editor.model.selection import Change, Selection, find_position
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

Side: TypeAlias = Literal["left", "centre", "right", "top", "middle", "bottom"]
Axis: TypeAlias = Literal["x", "y"]
SIDES: Final = ("left", "centre", "right", "top", "middle", "bottom")
"""Left, centre and right move along x; top, middle and bottom along y."""

_ALONG_X = SIDES[:3]
_MOST_COPIES = 10_000
_MANY = 100
_ALIKE = 1e-12  # relative difference of what is the same but for rounding


@dataclass(frozen=True)
class Affine:
    """The map that takes (x, y) to (xx x + xy y + x0, yx x + yy y + y0); rings to tenths of a millimetre."""

    xx: float = 1.0
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 1.0
    x0: float = 0.0
    y0: float = 0.0

    @classmethod
    def turn(cls, degrees: float, about: Point) -> Self:
        """Return the counter-clockwise rotation about a point, exact at quarters of a turn."""
        cos, sin = geometry.compute_cos_sin(degrees)
        return cls(cos, -sin, sin, cos)._about(about)

    @classmethod
    def stretch(cls, fx: float, fy: float, about: Point) -> Self:
        return cls(fx, 0.0, 0.0, fy)._about(about)

    def _about(self, point: Point) -> Self:
        x, y = point
        return replace(self, x0=x - self.xx * x - self.xy * y, y0=y - self.yx * x - self.yy * y)

    @property
    def factor(self) -> float | None:
        """By how much it scales all lengths alike; None where it stretches some more than others."""
        a, b = math.hypot(self.xx, self.yx), math.hypot(self.xy, self.yy)
        skew = abs(self.xx * self.xy + self.yx * self.yy)
        if abs(a - b) > _ALIKE * max(a, b) or skew > _ALIKE * a * b:
            return None
        return 1.0 if abs(a - 1.0) <= _ALIKE else a

    def ring(self, ring: Sequence[Point]) -> Ring:
        x, y = geometry.to_array(ring).T
        to = [self.xx * x + self.xy * y + self.x0, self.yx * x + self.yy * y + self.y0]
        return geometry.round_ring(np.column_stack(to))

    def apply(self, thing: Any) -> Any:
        """Return where a thing or a density goes; stretched, circles become polygons, walls keep width."""
        factor = self.factor
        if factor is None and isinstance(thing, DiscStart):
            raise MapError("a start that is a disc stays one: scale it by the same factor both ways")
        if factor is None and isinstance(thing, CircleObstacle):
            thing = PolygonObstacle(thing.polygon.exterior.coords[:-1], (), thing.name, thing.path)
        found: dict[str, Any] = {}
        for name, value in ((field.name, getattr(thing, field.name)) for field in fields(thing)):
            if name in ("vertices", "points", "positions"):
                found[name] = self.ring(value)
            elif name == "holes":
                found[name] = tuple(map(self.ring, value))
            elif name == "center":
                (found[name],) = self.ring([value])
            elif name == "path" and value is not None:
                found[name] = self.apply(value)
            elif name in ("peaks", "areas"):
                found[name] = tuple(map(self.apply, value))
            elif name == "covariance" and value is not None:
                matrix = np.array([[self.xx, self.xy], [self.yx, self.yy]])
                (p, q), (_, r) = (matrix @ np.array(value) @ matrix.T).tolist()
                found[name] = ((p, q), (q, r))
            elif name in ("width", "radius") and factor not in (None, 1.0):
                found[name] = round_length(value * factor)
        return replace(thing, **found)


def move(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    return _change(sketch, selection, Affine(x0=dx, y0=dy), "moved")


def rotate(sketch: Sketch, selection: Selection, degrees: float, about: Point | None = None) -> Change:
    """Turn what is selected counter-clockwise, by default about the middle of its bounding box."""
    require(math.isfinite(degrees), "expected an angle in degrees")
    return _change(sketch, selection, Affine.turn(degrees, about or _middle(sketch, selection)), "turned")


def scale(sketch: Sketch, selection: Selection, fx: float, fy: float, about: Point | None = None) -> Change:
    """Scale by fx and fy about the middle or a point, see `Affine.thing`; factors below 0 mirror."""
    if not all(
        math.isfinite(f) and MIN_SIZE_M / MAX_SIZE_M <= abs(f) <= MAX_SIZE_M / MIN_SIZE_M for f in (fx, fy)
    ):
        raise MapError("expected a factor that is not 0")
    return _change(sketch, selection, Affine.stretch(fx, fy, about or _middle(sketch, selection)), "scaled")


def resize(sketch: Sketch, selection: Selection, width: float | None, height: float | None) -> Change:
    """Scale so that the bounding box has a width and height, m (None: in proportion), lower left fixed."""
    low_x, low_y, high_x, high_y = _bounds(sketch, selection)
    wide, high = high_x - low_x, high_y - low_y
    for wanted, there, name in ((width, wide, "width"), (height, high, "height")):
        if wanted is not None and not MIN_SIZE_M <= wanted <= MAX_SIZE_M:
            raise MapError(f"expected a {name} from {1000 * MIN_SIZE_M:g} mm to {MAX_SIZE_M / 1000:g} km")
        require(wanted is None or there >= MIN_SIZE_M, f"it has no {name} that could be scaled")
    require(width is not None or height is not None, "expected a width or a height")
    fx, fy = (width or 0.0) / max(wide, MIN_SIZE_M), (height or 0.0) / max(high, MIN_SIZE_M)
    # walls keep their width, so that the box does not quite grow by the factor: go nearer step by step
    for _ in range(20):
        change = _change(sketch, selection, Affine.stretch(fx or fy, fy or fx, (low_x, low_y)), "resized")
        if width is None or height is None:
            return change
        box = _bounds(change.sketch, change.selection)
        off = width - (box[2] - box[0]), height - (box[3] - box[1])
        if max(map(abs, off)) <= 2e-4:
            # what is put at its corner is there to the tenth of a millimetre
            shift = Affine(x0=low_x - box[0], y0=low_y - box[1])
            return replace(change, sketch=_placed(change.sketch, change.selection, shift))
        fx, fy = max(fx + off[0] / wide, 1e-9), max(fy + off[1] / high, 1e-9)
    raise MapError("it cannot get that size: walls keep their width when width and height change apart")


def place(sketch: Sketch, selection: Selection, x: float | None, y: float | None) -> Change:
    """Move what is selected so that its bounding box has its lower left corner there; None leaves it."""
    low_x, low_y, *_ = _bounds(sketch, selection)
    return move(sketch, selection, 0.0 if x is None else x - low_x, 0.0 if y is None else y - low_y)


def mirror(sketch: Sketch, selection: Selection, axis: str) -> Change:
    """Mirror what is selected about the middle of its box: axis "x" swaps left and right, "y" up and down."""
    require(axis in ("x", "y"), "expected an axis x or y")
    factors = (-1.0, 1.0) if axis == "x" else (1.0, -1.0)
    return _change(sketch, selection, Affine.stretch(*factors, _middle(sketch, selection)), "mirrored")


def duplicate(sketch: Sketch, selection: Selection, dx: float = 0.0, dy: float = 0.0) -> Change:
    chosen = Selection(items=selection.items, starts=selection.starts).restrict_to(sketch)
    whole = require(chosen, "select obstacles or starts to copy")
    return Change(*_copied(sketch, whole, Affine(x0=dx, y0=dy)), f"{whole.describe(sketch)} duplicated")


def copy_to_grid(
    sketch: Sketch, selection: Selection, columns: int, rows: int, spacing: tuple[float, float]
) -> Change:
    """Copy the selected obstacles into columns and rows, (dx, dy) m apart, the originals in a corner."""
    whole = require(Selection(items=selection.items), "select obstacles to copy")
    require(columns >= 1 and rows >= 1 and columns * rows >= 2, "expected at least two columns or rows")
    if columns * rows * len(whole.items) > _MOST_COPIES:
        raise MapError(f"that makes more than {_MOST_COPIES} obstacles")
    after, everything = sketch, whole
    for row, column in list(product(range(rows), range(columns)))[1:]:
        after, copies = _copied(after, whole, Affine(x0=column * spacing[0], y0=row * spacing[1]))
        everything = everything.union(copies)
    return Change(after, everything, f"{whole.describe(sketch)} copied into {columns} × {rows}")


def align(sketch: Sketch, selection: Selection, side: Side) -> Change:
    """Align selected obstacles and starts, or vertices, at a side of their box, or of a selected boundary."""
    require(side in SIDES, f"expected one of {', '.join(SIDES)}")
    words = {"centre": "by their centres", "middle": "by their middles"}.get(side, f"at the {side}")
    if selection.vertices and not selection.owners:
        places = {vertex: find_position(sketch, vertex) for vertex in selection.vertices}
        require(len(places) >= 2, "select two or more vertices to align")
        level = _level(enclose_boxes((*place, *place) for place in places.values()), side)
        new = {vertex: (level, y) if side in _ALONG_X else (x, level) for vertex, (x, y) in places.items()}
        return Change(place_vertices(sketch, new), selection, f"{selection.describe(sketch)} aligned {words}")
    boxes = _boxes(sketch, selection)
    frame = compute_box(sketch, BOUNDARY) if selection.boundary else None
    require(frame is not None or not selection.boundary, "there is no boundary to align with")
    if len(boxes) < (1 if frame else 2):
        raise MapError(f"select {'' if frame else 'two or more '}obstacles or starts to align")
    frame = frame or enclose_boxes(boxes.values())
    off = {owner: _level(frame, side) - _level(box, side) for owner, box in boxes.items()}
    after = _each_moved(sketch, off, along_x=side in _ALONG_X)
    return Change(after, selection, f"{Selection.of(*boxes).describe(sketch)} aligned {words}")


def distribute(sketch: Sketch, selection: Selection, axis: Axis) -> Change:
    """Spread three or more selected things, with equal gaps between their boxes; first and last stay."""
    require(axis in ("x", "y"), "expected an axis x or y")
    a = "xy".index(axis)
    boxes = sorted(_boxes(sketch, selection).items(), key=lambda pair: (pair[1][a], pair[1][a + 2]))
    require(len(boxes) >= 3, "select three or more obstacles or starts to distribute")
    low, sizes = boxes[0][1][a], [box[a + 2] - box[a] for _, box in boxes]
    gap = (boxes[-1][1][a + 2] - low - sum(sizes)) / (len(boxes) - 1)
    off: dict[Owner, float] = {}
    for (owner, box), size in zip(boxes, sizes, strict=True):
        off[owner] = low - box[a]
        low += size + gap
    after = _each_moved(sketch, off, along_x=axis == "x")
    return Change(after, selection, f"{Selection.of(*off).describe(sketch)} distributed")


def level_map(sketch: Sketch, a: Point, b: Point) -> Change:
    """Turn map, picture and density about `a`: the line to `b` becomes level or upright."""
    require(math.dist(a, b) >= MIN_SIZE_M, "expected two points that are apart")
    degrees = geometry.compute_levelling_angle(a, b)
    affine = Affine.turn(degrees, a)
    everything = Selection.of(*sketch.owners).restrict_to(sketch)
    picture = None if sketch.background is None else rotate_background(sketch.background, degrees, a)
    density = sketch.density
    if isinstance(density, Gaussians | WeightedPolygons):
        density = affine.apply(density)
    elif density is not None and not density.is_uniform:
        what = f"a density that is a {density.kind} cannot be turned"
        raise MapError(f"{what}: “density none” takes it away first")
    after = replace(_placed(sketch, everything, affine), background=picture, density=density)
    return Change(after, Selection(), f"map turned by {degrees:.2f}°")


def compute_box(sketch: Sketch, owner: Owner) -> Box | None:
    # a typed size is that of a circle, not of the polygon that stands for it
    if (
        isinstance(owner, int)
        and owner != BOUNDARY
        and not isinstance(sketch.find_object(owner), CircleObstacle)
    ):
        covered = sketch.get_item(owner).geometry
        return None if covered.is_empty else covered.bounds
    points = [point for ring in sketch.list_vertex_rings(owner) for point in ring]
    return enclose_boxes((*point, *point) for point in points) if points else None


def compute_bounds(sketch: Sketch, selection: Selection) -> Box | None:
    owners, boxes = selection.owners, list[Box]()
    if len(owners) > _MANY:  # all at once
        sharp = [k for k in selection.items if not isinstance(sketch.get_item(k).shape, CircleObstacle)]
        rows = shapely.bounds(sketch.geometries[[sketch.index_by_key[key] for key in sharp]])
        boxes = [(a, b, c, d) for a, b, c, d in rows[np.isfinite(rows).all(axis=1)].tolist()]
        owners = owners - frozenset(sharp)
    boxes += [box for owner in owners if (box := compute_box(sketch, owner)) is not None]
    boxes += [(*place, *place) for place in (find_position(sketch, vertex) for vertex in selection.vertices)]
    return enclose_boxes(boxes) if boxes else None


def _boxes(sketch: Sketch, selection: Selection) -> dict[Owner, Box]:
    things = selection.items | selection.starts
    return {owner: box for owner in sketch.owners if owner in things and (box := compute_box(sketch, owner))}


def _level(box: Box, side: Side) -> float:
    a = 0 if side in _ALONG_X else 1
    if side in ("centre", "middle"):
        return compute_centre(box)[a]
    return box[a] if side in ("left", "bottom") else box[a + 2]


def _copied(sketch: Sketch, whole: Selection, affine: Affine) -> tuple[Sketch, Selection]:
    shapes = [(affine.apply(item.shape), item.note) for item in whole.list_items(sketch)]
    return add_objects(
        sketch, shapes, [(n, affine.apply(spec)) for n, spec in sketch.starts if n in whole.starts]
    )


def _each_moved(sketch: Sketch, by: Mapping[Owner, float], *, along_x: bool) -> Sketch:
    shifts = {owner: Affine(x0=off) if along_x else Affine(y0=off) for owner, off in by.items() if off}
    things = {owner: shift.apply(sketch.find_object(owner)) for owner, shift in shifts.items()}
    return sketch.with_objects(things)


def _change(sketch: Sketch, selection: Selection, affine: Affine, words: str) -> Change:
    # an undo in the middle of a drag may have taken things away
    selection = require(selection.restrict_to(sketch), "select something first")
    return Change(_placed(sketch, selection, affine), selection, f"{selection.describe(sketch)} {words}")


def _placed(sketch: Sketch, selection: Selection, affine: Affine) -> Sketch:
    single = [vertex for vertex in selection.vertices if vertex.owner not in selection.owners]
    places = dict(zip(single, affine.ring([find_position(sketch, vertex) for vertex in single]), strict=True))
    things = selection.items | selection.starts
    sketch = sketch.with_objects({owner: affine.apply(sketch.find_object(owner)) for owner in things})
    if selection.boundary and sketch.boundary is not None:
        sketch = replace(sketch, boundary=affine.ring(sketch.boundary))
    return place_vertices(sketch, places) if places else sketch


def _bounds(sketch: Sketch, selection: Selection) -> Box:
    return require(compute_bounds(sketch, selection), "select something first")


def _middle(sketch: Sketch, selection: Selection) -> Point:
    return geometry.round_point(compute_centre(_bounds(sketch, selection)))
