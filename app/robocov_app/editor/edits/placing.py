"""Where what is selected lies: moved, turned, scaled, mirrored, copied.

As in `robocov_app.editor.edits.edits`: a `Change`, or a MapError with a sentence for people.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.environment import CircleObstacle, DiscStart, PointsStart
from robocov.errors import MapError
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov_app.editor.edits.adding import free_name
from robocov_app.editor.edits.affine import Affine
from robocov_app.editor.edits.vertices import with_places
from robocov_app.editor.model.document import BOUNDARY, Sketch
from robocov_app.editor.model.plane import rounded
from robocov_app.editor.model.selection import Change, Selection, place_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.environment import Point
    from robocov_app.editor.model.document import Owner

_MOST_COPIES = 10_000


def moved(sketch: Sketch, selection: Selection, dx: float, dy: float) -> Change:
    """Move what is selected by (dx, dy) m; single vertices too."""
    return _change(sketch, selection, Affine.shift(dx, dy), "moved")


def rotated(sketch: Sketch, selection: Selection, degrees: float, about: Point | None = None) -> Change:
    """Turn what is selected counter-clockwise, about the middle of its bounding box unless a point is given.

    Circles and discs keep their shape; a start in the whole free space stays as it is.
    """
    if not math.isfinite(degrees):
        raise MapError("an angle in degrees was wanted")
    affine = Affine.turn(degrees, _middle(sketch, selection) if about is None else about)
    return _change(sketch, selection, affine, "turned")


def scaled(
    sketch: Sketch, selection: Selection, fx: float, fy: float | None = None, about: Point | None = None
) -> Change:
    """Scale what is selected by fx (and fy, by default the same), about its middle unless a point is given.

    With both the same, radii and the widths of walls grow too. Else walls keep their width, a circle becomes
    a polygon, and a start that is a disc is refused. A factor below 0 mirrors.
    """
    fy = fx if fy is None else fy
    if not all(math.isfinite(f) and SMALLEST / LARGEST <= abs(f) <= LARGEST / SMALLEST for f in (fx, fy)):
        raise MapError("a factor that is not 0 was wanted")
    affine = Affine.stretch(fx, fy, _middle(sketch, selection) if about is None else about)
    return _change(sketch, selection, affine, "scaled")


def resized(
    sketch: Sketch,
    selection: Selection,
    width: float | None,
    height: float | None,
    about: Point | None = None,
) -> Change:
    """Scale what is selected so that its bounding box is so many metres wide and high.

    None keeps the proportions by the other. `about` stays where it is: by default the lower left corner.
    """
    bounds = _bounds(sketch, selection)
    now = bounds[2] - bounds[0], bounds[3] - bounds[1]
    for wanted, there, name in ((width, now[0], "width"), (height, now[1], "height")):
        if wanted is not None and not SMALLEST <= wanted <= LARGEST:
            raise MapError(f"a {name} from {1000 * SMALLEST:g} mm to {LARGEST / 1000:g} km was wanted")
        if wanted is not None and there < SMALLEST:
            raise MapError(f"it has no {name} that could be scaled")
    fixed = (bounds[0], bounds[1]) if about is None else about
    if width is None or height is None:
        factors = [
            wanted / there for wanted, there in ((width, now[0]), (height, now[1])) if wanted is not None
        ]
        if not factors:
            raise MapError("a width or a height was wanted")
        return _change(sketch, selection, Affine.stretch(factors[0], factors[0], fixed), "resized")

    # walls keep their width, so that the box does not quite grow by the factor: go nearer step by step
    fx, fy = width / now[0], height / now[1]
    for _ in range(20):
        change = _change(sketch, selection, Affine.stretch(fx, fy, fixed), "resized")
        box = _bounds(change.sketch, change.selection)
        off = width - (box[2] - box[0]), height - (box[3] - box[1])
        if max(map(abs, off)) <= 2e-4:
            # what is put at its corner is there to the tenth of a millimetre
            if about is None:
                shift = Affine.shift(bounds[0] - box[0], bounds[1] - box[1])
                change = replace(change, sketch=_placed(change.sketch, change.selection, shift))
            return change
        fx, fy = max(fx + off[0] / now[0], 1e-9), max(fy + off[1] / now[1], 1e-9)
    raise MapError("it cannot get that size: walls keep their width when width and height change apart")


def placed(sketch: Sketch, selection: Selection, x: float | None, y: float | None) -> Change:
    """Move what is selected so that its bounding box has its lower left corner there; None leaves it."""
    bounds = _bounds(sketch, selection)
    dx = 0.0 if x is None else x - bounds[0]
    dy = 0.0 if y is None else y - bounds[1]
    return moved(sketch, selection, dx, dy)


def mirrored(sketch: Sketch, selection: Selection, axis: str, at: float | None = None) -> Change:
    """Mirror what is selected: axis "x" swaps left and right about the vertical line x = at, "y" up and down.

    By default about the middle of its bounding box.
    """
    if axis not in ("x", "y"):
        raise MapError("an axis x or y was wanted")
    x, y = _middle(sketch, selection)
    if axis == "x":
        affine = Affine(xx=-1.0, x0=2.0 * (x if at is None else at))
    else:
        affine = Affine(yy=-1.0, y0=2.0 * (y if at is None else at))
    return _change(sketch, selection, affine, "mirrored")


def mirrored_across(sketch: Sketch, selection: Selection, a: Point, b: Point) -> Change:
    """Mirror what is selected across the line through two points."""
    if math.dist(a, b) < SMALLEST:
        raise MapError("the line to mirror across needs two points that are apart")
    return _change(sketch, selection, Affine.mirror(a, b), "mirrored")


def duplicated(sketch: Sketch, selection: Selection, dx: float = 0.0, dy: float = 0.0) -> Change:
    """Copy the selected obstacles and starts, the copies moved by (dx, dy) m; they are selected then."""
    whole = Selection(items=selection.items, starts=selection.starts)
    if not whole:
        raise MapError("select obstacles or starts to copy")
    after, copies = copied_by(sketch, whole, Affine.shift(dx, dy))
    return Change(after, copies, f"{whole.words(sketch)} duplicated")


def arrayed(sketch: Sketch, selection: Selection, columns: int, rows: int, dx: float, dy: float) -> Change:
    """Copy the selected obstacles into columns and rows, (dx, dy) m apart, the originals in a corner."""
    whole = Selection(items=selection.items)
    if not whole:
        raise MapError("select obstacles to copy")
    if columns < 1 or rows < 1 or columns * rows < 2:
        raise MapError("two columns or rows at least were wanted")
    if columns * rows * len(whole.items) > _MOST_COPIES:
        raise MapError(f"that makes more than {_MOST_COPIES} obstacles")
    after, everything = sketch, whole
    for row in range(rows):
        for column in range(columns):
            if row or column:
                after, copies = copied_by(after, whole, Affine.shift(column * dx, row * dy))
                everything = everything.plus(copies)
    words = f"{whole.words(sketch)} copied into {columns} × {rows}"
    return Change(after, everything, words)


def copied_by(sketch: Sketch, whole: Selection, affine: Affine) -> tuple[Sketch, Selection]:
    """Return the sketch with copies of whole obstacles and starts at other places, and what they are."""
    shapes = [(affine.shape(item.shape), item.note) for item in sketch.obstacles if item.key in whole.items]
    after, keys = sketch.added(shapes)
    names = []
    for name, spec in sketch.starts:
        if name in whole.starts:
            names.append(free_name(after, name))
            after = after.with_start(names[-1], affine.start(spec))
    return after, Selection.of(*keys, *names)


def box_of(sketch: Sketch, owner: Owner) -> tuple[float, float, float, float] | None:
    """Return smallest x, smallest y, largest x, largest y of something, m; None where it is nowhere."""
    if owner == BOUNDARY:
        points = np.array(sketch.boundary or (), dtype=float).reshape(-1, 2)
    elif isinstance(owner, str):
        spec = sketch.start(owner)
        if isinstance(spec, DiscStart):
            (x, y), r = spec.center, spec.radius
            return x - r, y - r, x + r, y + r
        positions = spec.positions if isinstance(spec, PointsStart) else ()
        points = np.array(positions, dtype=float).reshape(-1, 2)
    else:
        item = sketch.item(owner)
        if isinstance(item.shape, CircleObstacle):
            # a typed size is that of the circle, not of the polygon that stands for it
            (x, y), r = item.shape.center, item.shape.radius
            return x - r, y - r, x + r, y + r
        points = np.array(shapely.bounds(item.geometry)).reshape(2, 2)
    if not len(points) or not np.isfinite(points).all():
        return None
    (low_x, low_y), (high_x, high_y) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return low_x, low_y, high_x, high_y


def bounds_of(sketch: Sketch, selection: Selection) -> tuple[float, float, float, float] | None:
    """Return smallest x, smallest y, largest x, largest y of what is selected, m; None of nothing."""
    boxes = [box for owner in selection.owners if (box := box_of(sketch, owner)) is not None]
    for vertex in selection.vertices:
        x, y = place_of(sketch, vertex)
        boxes.append((x, y, x, y))
    if not boxes:
        return None
    low_x, low_y, high_x, high_y = zip(*boxes, strict=True)
    return min(low_x), min(low_y), max(high_x), max(high_y)


def each_moved(sketch: Sketch, by: Mapping[Owner, Point]) -> Sketch:
    """Return the sketch with things moved, each by its own (dx, dy) m."""
    for owner, (dx, dy) in by.items():
        if dx or dy:
            sketch = _placed(sketch, Selection.of(owner), Affine.shift(dx, dy))
    return sketch


def _change(sketch: Sketch, selection: Selection, affine: Affine, words: str) -> Change:
    if not selection:
        raise MapError("select something first")
    return Change(_placed(sketch, selection, affine), selection, f"{selection.words(sketch)} {words}")


def _placed(sketch: Sketch, selection: Selection, affine: Affine) -> Sketch:
    """Return the sketch with what is selected taken elsewhere."""
    owners = selection.owners
    places = {
        vertex: affine.point(place_of(sketch, vertex))
        for vertex in selection.vertices
        if vertex.of not in owners
    }
    sketch = sketch.with_shapes({key: affine.shape(sketch.item(key).shape) for key in selection.items})
    for name in selection.starts:
        sketch = sketch.with_start(name, affine.start(sketch.start(name)))
    if selection.boundary and sketch.boundary is not None:
        sketch = replace(sketch, boundary=affine.ring(sketch.boundary))
    return with_places(sketch, places) if places else sketch


def _bounds(sketch: Sketch, selection: Selection) -> tuple[float, float, float, float]:
    bounds = bounds_of(sketch, selection)
    if bounds is None:
        raise MapError("select something first")
    return bounds


def _middle(sketch: Sketch, selection: Selection) -> Point:
    bounds = _bounds(sketch, selection)
    return rounded(((bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2))
