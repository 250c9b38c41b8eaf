"""Edits of positions: move, rotate, scale, mirror, copy, align and distribute objects."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any, Final, Literal, Self, TypeAlias

import numpy as np
import shapely

from robocov.density import Density, Gaussians, WeightedPolygons
from robocov.environment import CircleObstacle, DiscStart, Point, PolygonObstacle, Ring
from robocov.errors import MapError
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov_app.editor.edits.create import add_objects
from robocov_app.editor.edits.vertices import place_vertices
from robocov_app.editor.model import geometry, require
from robocov_app.editor.model.background import rotate_background
from robocov_app.editor.model.geometry import Box, compute_center, enclose_boxes, require_size, round_length
from robocov_app.editor.model.selection import Change, Selection, Vertex, find_position
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch
from robocov_app.toolkit.tools.geometry import compute_cos_sin

Side: TypeAlias = Literal["left", "center", "right", "top", "middle", "bottom"]
Axis: TypeAlias = Literal["x", "y"]
SIDES: Final = ("left", "center", "right", "top", "middle", "bottom")
"""Sides for alignment: the first three move objects along x, the others along y."""

ALONG_X = SIDES[:3]
MAX_COPIES = 10_000
MANY_OBJECTS = 100  # the bounds of more objects are computed together, which is faster
RELATIVE_TOLERANCE = 1e-12  # of scale factors that differ only by rounding errors
MAX_RESIZE_STEPS = 20
RESIZE_TOLERANCE_M = 2e-4
MIN_RESIZE_FACTOR = 1e-9


@dataclass(frozen=True)
class Affine:
    """Affine transformation from (x, y) to (xx x + xy y + x0, yx x + yy y + y0).

    Results are rounded to tenths of a millimeter.

    Attributes
    ----------
    xx, xy, yx, yy : float
        The linear part.
    x0, y0 : float
        The displacement, m.
    """

    xx: float = 1.0
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 1.0
    x0: float = 0.0
    y0: float = 0.0

    @classmethod
    def rotation(cls, degrees: float, about: Point) -> Self:
        """Return a counter-clockwise rotation about a point; multiples of 90° are exact."""
        cos, sin = compute_cos_sin(degrees)
        return cls(cos, -sin, sin, cos)._with_fixed_point(about)

    @classmethod
    def scaling(cls, factor_x: float, factor_y: float, about: Point) -> Self:
        """Return a scaling by a factor along each axis about a point."""
        return cls(factor_x, 0.0, 0.0, factor_y)._with_fixed_point(about)

    def _with_fixed_point(self, point: Point) -> Self:
        """Return the transformation with the same linear part that leaves a point in place."""
        x, y = point
        x0 = x - self.xx * x - self.xy * y
        y0 = y - self.yx * x - self.yy * y
        return replace(self, x0=x0, y0=y0)

    @property
    def factor(self) -> float | None:
        """Factor by which all lengths are scaled; None if it depends on the direction."""
        factor_x = math.hypot(self.xx, self.yx)
        factor_y = math.hypot(self.xy, self.yy)
        # The scale is uniform if the columns are equally long and perpendicular to each other.
        skew = abs(self.xx * self.xy + self.yx * self.yy)
        if abs(factor_x - factor_y) > RELATIVE_TOLERANCE * max(factor_x, factor_y):
            return None
        if skew > RELATIVE_TOLERANCE * factor_x * factor_y:
            return None
        if abs(factor_x - 1.0) <= RELATIVE_TOLERANCE:
            return 1.0
        return factor_x

    def transform_points(self, points: Sequence[Point]) -> Ring:
        """Transform a sequence of points, m."""
        x, y = geometry.to_array(points).T
        new_x = self.xx * x + self.xy * y + self.x0
        new_y = self.yx * x + self.yy * y + self.y0
        return geometry.round_ring(np.column_stack([new_x, new_y]))

    def transform(self, shape: Any) -> Any:
        """Transform an obstacle, a start, a path, or a density or part of it.

        Circles that are scaled unequally become polygons. Walls keep their width unless the scale is uniform.

        Raises
        ------
        MapError
            If a disc-shaped start would be scaled unequally.
        """
        if self.factor is None and isinstance(shape, DiscStart):
            raise MapError(
                "a disc-shaped start cannot be stretched: scale it by the same factor along both axes"
            )
        if self.factor is None and isinstance(shape, CircleObstacle):
            shape = PolygonObstacle(shape.polygon.exterior.coords[:-1], (), shape.name, shape.path)
        changes = {}
        for field in fields(shape):
            value = getattr(shape, field.name)
            if value is not None and field.name in _FIELD_MAPS:
                changes[field.name] = _FIELD_MAPS[field.name](self, value)
        return replace(shape, **changes)

    def _transform_rings(self, rings: tuple[Ring, ...]) -> tuple[Ring, ...]:
        return tuple(self.transform_points(ring) for ring in rings)

    def _transform_point(self, point: Point) -> Point:
        return self.transform_points([point])[0]

    def _transform_features(self, features: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(self.transform(feature) for feature in features)

    def _transform_covariance(self, covariance: Any) -> tuple[tuple[float, float], tuple[float, float]]:
        matrix = np.array([[self.xx, self.xy], [self.yx, self.yy]])
        (xx, xy), (_, yy) = (matrix @ np.array(covariance) @ matrix.T).tolist()
        return (xx, xy), (xy, yy)

    def _transform_length(self, length: float) -> float:
        factor = self.factor
        if factor is None or factor == 1.0:
            return length
        return round_length(length * factor)


# How to transform each field of obstacles, starts, paths and densities; other fields do not change.
_FIELD_MAPS: dict[str, Callable[[Affine, Any], Any]] = {
    "vertices": Affine.transform_points,
    "points": Affine.transform_points,
    "positions": Affine.transform_points,
    "holes": Affine._transform_rings,
    "center": Affine._transform_point,
    "path": Affine.transform,
    "peaks": Affine._transform_features,
    "areas": Affine._transform_features,
    "covariance": Affine._transform_covariance,
    "width": Affine._transform_length,
    "radius": Affine._transform_length,
}


def move(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    """Move the selection by a displacement, m."""
    return _transform(sketch, selection, Affine(x0=dx, y0=dy), "moved")


def rotate(sketch: Sketch, selection: Selection, degrees: float, about: Point | None = None) -> Change:
    """Rotate the selection counter-clockwise about a point, m, by default the center of its bounding box."""
    require(math.isfinite(degrees), "expected an angle in degrees")
    center = about or _compute_center(sketch, selection)
    return _transform(sketch, selection, Affine.rotation(degrees, center), "rotated")


def scale(
    sketch: Sketch, selection: Selection, factor_x: float, factor_y: float, about: Point | None = None
) -> Change:
    """Scale the selection about a point, m, by default the center of its bounding box.

    Negative factors mirror the selection.
    """
    for factor in (factor_x, factor_y):
        require(factor != 0.0, "expected a factor other than 0")
        if not MIN_SIZE_M / MAX_SIZE_M <= abs(factor) <= MAX_SIZE_M / MIN_SIZE_M:
            raise MapError(f"the factor {factor:g} is too small or too large")
    center = about or _compute_center(sketch, selection)
    return _transform(sketch, selection, Affine.scaling(factor_x, factor_y, center), "scaled")


def resize(sketch: Sketch, selection: Selection, width: float | None, height: float | None) -> Change:
    """Scale the selection to a given size of its bounding box; the lower left corner stays in place.

    Parameters
    ----------
    sketch : Sketch
        The map.
    selection : Selection
        Objects to scale.
    width, height : float or None
        Size of the bounding box, m; None to keep the proportions.
    """
    low_x, low_y, high_x, high_y = _require_bounds(sketch, selection)
    current_width = high_x - low_x
    current_height = high_y - low_y
    _check_size(width, current_width, "width")
    _check_size(height, current_height, "height")
    require(width is not None or height is not None, "expected a width or a height")
    if width is not None and height is not None:
        return _scale_to_size(sketch, selection, width, height)
    factor = 1.0
    if width is not None:
        factor = width / current_width
    elif height is not None:
        factor = height / current_height
    return _transform(sketch, selection, Affine.scaling(factor, factor, (low_x, low_y)), "resized")


def _scale_to_size(sketch: Sketch, selection: Selection, width: float, height: float) -> Change:
    """Scale the selection so that its bounding box has a width and a height, m.

    Walls keep their width, so the box does not scale exactly by the factors, which are found by iteration.
    """
    low_x, low_y, high_x, high_y = _require_bounds(sketch, selection)
    current_width = high_x - low_x
    current_height = high_y - low_y
    factor_x = width / current_width
    factor_y = height / current_height
    for _ in range(MAX_RESIZE_STEPS):
        affine = Affine.scaling(factor_x, factor_y, (low_x, low_y))
        change = _transform(sketch, selection, affine, "resized")
        box = _require_bounds(change.sketch, change.selection)
        missing_width = width - (box[2] - box[0])
        missing_height = height - (box[3] - box[1])
        if max(abs(missing_width), abs(missing_height)) <= RESIZE_TOLERANCE_M:
            shift = Affine(x0=low_x - box[0], y0=low_y - box[1])
            return replace(change, sketch=_apply_affine(change.sketch, change.selection, shift))
        factor_x = max(factor_x + missing_width / current_width, MIN_RESIZE_FACTOR)
        factor_y = max(factor_y + missing_height / current_height, MIN_RESIZE_FACTOR)
    raise MapError("this size is not possible: walls keep their width unless all lengths are scaled alike")


def _check_size(size: float | None, current: float, name: str) -> None:
    """Raise MapError if a size, m, is out of range, or if the current size is too small to be scaled."""
    if size is None:
        return
    require_size(name, size)
    require(current >= MIN_SIZE_M, f"the selection has no {name} that can be scaled")


def place(sketch: Sketch, selection: Selection, x: float | None, y: float | None) -> Change:
    """Move the lower left corner of the selection's bounding box to (x, y) m; None keeps a coordinate."""
    low_x, low_y, *_ = _require_bounds(sketch, selection)
    dx = 0.0
    dy = 0.0
    if x is not None:
        dx = x - low_x
    if y is not None:
        dy = y - low_y
    return move(sketch, selection, dx, dy)


def mirror(sketch: Sketch, selection: Selection, axis: Axis) -> Change:
    """Mirror the selection about the center of its bounding box.

    "x" swaps left and right, "y" swaps top and bottom.
    """
    require(axis in ("x", "y"), "expected an axis x or y")
    factor_x = -1.0 if axis == "x" else 1.0
    affine = Affine.scaling(factor_x, -factor_x, _compute_center(sketch, selection))
    return _transform(sketch, selection, affine, "mirrored")


def duplicate(sketch: Sketch, selection: Selection, dx: float = 0.0, dy: float = 0.0) -> Change:
    """Copy the selected obstacles and starts, and move the copies by a displacement, m."""
    objects = Selection(items=selection.items, starts=selection.starts).restrict_to(sketch)
    require(objects, "select obstacles or starts to copy")
    copied, copies = _copy(sketch, objects, Affine(x0=dx, y0=dy))
    return Change(copied, copies, f"{objects.describe(sketch)} duplicated")


def copy_to_grid(
    sketch: Sketch, selection: Selection, columns: int, rows: int, spacing: tuple[float, float]
) -> Change:
    """Copy the selected obstacles to a grid of columns and rows with a spacing, (x, y) m."""
    obstacles = Selection(items=selection.items)
    require(obstacles, "select obstacles to copy")
    require(columns >= 1 and rows >= 1 and columns * rows >= 2, "expected at least two columns or rows")
    if columns * rows * len(obstacles.items) > MAX_COPIES:
        raise MapError(f"that makes more than {MAX_COPIES} obstacles")
    copied = sketch
    everything = obstacles
    # The originals are the first cell of the grid.
    for row, column in list(product(range(rows), range(columns)))[1:]:
        shift = Affine(x0=column * spacing[0], y0=row * spacing[1])
        copied, copies = _copy(copied, obstacles, shift)
        everything = everything.union(copies)
    return Change(copied, everything, f"{obstacles.describe(sketch)} copied into {columns} × {rows}")


def align(sketch: Sketch, selection: Selection, side: Side) -> Change:
    """Align the selected objects, or vertices if only vertices are selected, at a side.

    Objects are aligned at the boundary if it is selected, otherwise at their common bounding box.
    """
    require(side in SIDES, f"expected one of {', '.join(SIDES)}")
    if selection.vertices and not selection.owners:
        return _align_vertices(sketch, selection, side)
    boxes = _list_boxes(sketch, selection)
    if selection.boundary:
        frame = require(compute_box(sketch, BOUNDARY), "there is no boundary to align with")
    else:
        require(len(boxes) >= 2, "select two or more obstacles or starts to align")
        frame = enclose_boxes(boxes.values())
    require(boxes, "select obstacles or starts to align")
    level = _compute_level(frame, side)
    offsets = {owner: level - _compute_level(box, side) for owner, box in boxes.items()}
    aligned = _move_objects(sketch, offsets, along_x=side in ALONG_X)
    objects = Selection.of(*boxes).describe(sketch)
    return Change(aligned, selection, f"{objects} aligned {_describe_side(side)}")


def _align_vertices(sketch: Sketch, selection: Selection, side: Side) -> Change:
    """Align the selected vertices at a side of their common bounding box."""
    positions = {vertex: find_position(sketch, vertex) for vertex in selection.vertices}
    require(len(positions) >= 2, "select two or more vertices to align")
    frame = enclose_boxes((*position, *position) for position in positions.values())
    level = _compute_level(frame, side)
    moved: dict[Vertex, Point] = {}
    for vertex, (x, y) in positions.items():
        if side in ALONG_X:
            moved[vertex] = (level, y)
        else:
            moved[vertex] = (x, level)
    description = f"{selection.describe(sketch)} aligned {_describe_side(side)}"
    return Change(place_vertices(sketch, moved), selection, description)


def _describe_side(side: Side) -> str:
    return {"center": "by their centers", "middle": "by their middles"}.get(side, f"at the {side}")


def distribute(sketch: Sketch, selection: Selection, axis: Axis) -> Change:
    """Move three or more selected objects along an axis, so that the gaps between their boxes are equal.

    The first and the last object stay in place.
    """
    require(axis in ("x", "y"), "expected an axis x or y")
    # Indices of the minimum and maximum along the axis in a box.
    low_index = "xy".index(axis)
    high_index = low_index + 2
    boxes = sorted(
        _list_boxes(sketch, selection).items(), key=lambda pair: (pair[1][low_index], pair[1][high_index])
    )
    require(len(boxes) >= 3, "select three or more obstacles or starts to distribute")
    start = boxes[0][1][low_index]
    end = boxes[-1][1][high_index]
    sizes = [box[high_index] - box[low_index] for _, box in boxes]
    gap = (end - start - sum(sizes)) / (len(boxes) - 1)
    offsets: dict[Owner, float] = {}
    position = start
    for (owner, box), size in zip(boxes, sizes, strict=True):
        offsets[owner] = position - box[low_index]
        position += size + gap
    distributed = _move_objects(sketch, offsets, along_x=axis == "x")
    return Change(distributed, selection, f"{Selection.of(*offsets).describe(sketch)} distributed")


def level_map(sketch: Sketch, a: Point, b: Point) -> Change:
    """Rotate map, background image and density about `a` to make the line to `b` horizontal or vertical."""
    require(math.dist(a, b) >= MIN_SIZE_M, "expected two different points")
    degrees = geometry.compute_leveling_angle(a, b)
    affine = Affine.rotation(degrees, a)
    everything = Selection.of(*sketch.owners).restrict_to(sketch)
    background = sketch.background
    if background is not None:
        background = rotate_background(background, degrees, a)
    rotated = _apply_affine(sketch, everything, affine)
    density = _rotate_density(sketch.density, affine)
    rotated = replace(rotated, background=background, density=density)
    return Change(rotated, Selection(), f"map rotated by {degrees:.2f}°")


def _rotate_density(density: Density | None, affine: Affine) -> Density | None:
    if isinstance(density, Gaussians | WeightedPolygons):
        rotated: Density = affine.transform(density)
        return rotated
    if density is not None and not density.is_uniform:
        kind = density.kind
        raise MapError(
            f"a density of the kind “{kind}” cannot be rotated: remove it first with “density none”"
        )
    return density


def compute_box(sketch: Sketch, owner: Owner) -> Box | None:
    """Return the bounding box of an object, m; None if it is empty."""
    # The box of a circle is computed from its radius, not from the polygon that approximates it.
    is_obstacle = isinstance(owner, int) and owner != BOUNDARY
    if is_obstacle and not isinstance(sketch.get_shape(owner), CircleObstacle):
        assert isinstance(owner, int)
        covered = sketch.get_item(owner).geometry
        if covered.is_empty:
            return None
        bounds: Box = covered.bounds
        return bounds
    points = [point for ring in sketch.list_vertex_rings(owner) for point in ring]
    if not points:
        return None
    return enclose_boxes((*point, *point) for point in points)


def compute_bounds(sketch: Sketch, selection: Selection) -> Box | None:
    """Return the bounding box of all selected objects and vertices, m; None if there are none."""
    owners = selection.owners
    boxes: list[Box] = []
    if len(owners) > MANY_OBJECTS:
        keys = _list_uncurved_keys(sketch, selection)
        indices = [sketch.index_by_key[key] for key in keys]
        bounds = shapely.bounds(sketch.geometries[indices])
        bounds = bounds[np.isfinite(bounds).all(axis=1)]
        boxes += [(low_x, low_y, high_x, high_y) for low_x, low_y, high_x, high_y in bounds.tolist()]
        owners = owners - frozenset(keys)
    for owner in owners:
        box = compute_box(sketch, owner)
        if box is not None:
            boxes.append(box)
    for vertex in selection.vertices:
        position = find_position(sketch, vertex)
        boxes.append((*position, *position))
    if not boxes:
        return None
    return enclose_boxes(boxes)


def _list_uncurved_keys(sketch: Sketch, selection: Selection) -> list[int]:
    """Return the keys of selected obstacles that are not circles."""
    return [key for key in selection.items if not isinstance(sketch.get_item(key).shape, CircleObstacle)]


def _list_boxes(sketch: Sketch, selection: Selection) -> dict[Owner, Box]:
    """Return the bounding boxes of the selected obstacles and starts, m."""
    objects = selection.items | selection.starts
    boxes: dict[Owner, Box] = {}
    for owner in sketch.owners:
        if owner not in objects:
            continue
        box = compute_box(sketch, owner)
        if box is not None:
            boxes[owner] = box
    return boxes


def _compute_level(box: Box, side: Side) -> float:
    """Return the coordinate of a side of a box, or of its center line, m."""
    x, y = compute_center(box)
    levels = {
        "left": box[0],
        "center": x,
        "right": box[2],
        "bottom": box[1],
        "middle": y,
        "top": box[3],
    }
    return levels[side]


def _copy(sketch: Sketch, objects: Selection, affine: Affine) -> tuple[Sketch, Selection]:
    shapes = [(affine.transform(item.shape), item.note) for item in objects.list_items(sketch)]
    starts = [(name, affine.transform(start)) for name, start in sketch.starts if name in objects.starts]
    return add_objects(sketch, shapes, starts)


def _move_objects(sketch: Sketch, offsets: Mapping[Owner, float], *, along_x: bool) -> Sketch:
    """Move each object by its own offset, m, along x or y."""
    moved = {}
    for owner, offset in offsets.items():
        if offset:
            shift = Affine(y0=offset)
            if along_x:
                shift = Affine(x0=offset)
            moved[owner] = shift.transform(sketch.get_shape(owner))
    return sketch.with_objects(moved)


def _transform(sketch: Sketch, selection: Selection, affine: Affine, action: str) -> Change:
    # Undo during a drag may have removed selected objects.
    existing = selection.restrict_to(sketch)
    require(existing, "select something first")
    return Change(_apply_affine(sketch, existing, affine), existing, f"{existing.describe(sketch)} {action}")


def _apply_affine(sketch: Sketch, selection: Selection, affine: Affine) -> Sketch:
    """Transform the selected objects, and the selected vertices of other objects."""
    vertices = [vertex for vertex in selection.vertices if vertex.owner not in selection.owners]
    positions = affine.transform_points([find_position(sketch, vertex) for vertex in vertices])
    objects = selection.items | selection.starts
    sketch = sketch.with_objects({owner: affine.transform(sketch.get_shape(owner)) for owner in objects})
    if selection.boundary and sketch.boundary is not None:
        sketch = replace(sketch, boundary=affine.transform_points(sketch.boundary))
    if vertices:
        sketch = place_vertices(sketch, dict(zip(vertices, positions, strict=True)))
    return sketch


def _require_bounds(sketch: Sketch, selection: Selection) -> Box:
    return require(compute_bounds(sketch, selection), "select something first")


def _compute_center(sketch: Sketch, selection: Selection) -> Point:
    return geometry.round_point(compute_center(_require_bounds(sketch, selection)))
