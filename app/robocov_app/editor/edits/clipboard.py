"""Copy and paste as JSON text: parts of maps, whole maps, single obstacles, lists of obstacles or points."""

from dataclasses import replace
from typing import Any

from robocov.environment import Obstacle, Point, PolygonObstacle
from robocov.errors import MapError
from robocov.files.strictjson import parse_json
from robocov.mapfile import dump_document
from robocov.mapfile.models import HEADER
from robocov_app.editor.edits import create, transform
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import compute_center
from robocov_app.editor.model.parser import build_sketch
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch, to_document

FORMAT = "robocov-clipboard"  # "format" of copied text
SOURCE = "clipboard"  # name of the text in error messages


def copy_selection(sketch: Sketch, selection: Selection) -> str:
    """Return the selected objects as JSON text."""
    boundary = None
    if selection.boundary:
        boundary = sketch.boundary
    part = Sketch(
        sketch.name,
        boundary=boundary,
        obstacles=tuple(selection.list_items(sketch)),
        starts=tuple((name, start) for name, start in sketch.starts if name in selection.starts),
    )
    has_content = part.boundary is not None or part.obstacles or part.starts
    require(has_content, "select obstacles, starts or the boundary to copy")
    return dump_document({**to_document(part), "format": FORMAT})


def paste(sketch: Sketch, text: str, position: Point | None = None, grid: float | None = None) -> Change:
    """Paste copied text.

    Parameters
    ----------
    sketch : Sketch
        The map.
    text : str
        The copied text.
    position : Point, optional
        New center of the pasted objects, m; by default, they keep their positions.
    grid : float, optional
        Grid spacing, m: the objects are moved by multiples of it.

    Returns
    -------
    Change
        The map with the pasted objects, which are selected. A boundary is pasted only if the map has none.

    Raises
    ------
    MapError
        If the text is not a map, a part of a map, or a list of obstacles or points.
    """
    part = _parse(text)
    shapes: list[tuple[Obstacle, str]] = [(item.shape, item.note) for item in part.obstacles]
    has_boundary = part.boundary is not None
    sets_boundary = has_boundary and sketch.boundary is None
    is_boundary_alone = has_boundary and not shapes and not part.starts
    if part.boundary is not None and is_boundary_alone and not sets_boundary:
        # If the map has a boundary already, a copied boundary becomes an obstacle.
        shapes.append((PolygonObstacle(part.boundary), ""))
    pasted, added = create.add_objects(sketch, shapes, part.starts)
    selection = replace(added, boundary=sets_boundary)
    require(selection, f"there is nothing to paste in the {SOURCE}")
    if sets_boundary:
        pasted = replace(pasted, boundary=part.boundary)
    dx, dy = _compute_displacement(pasted, selection, position, grid)
    # Even if the displacement is 0, this rounds the coordinates and checks that they are in range.
    moved = transform.move(pasted, selection, dx, dy).sketch
    return Change(moved, selection, f"{selection.describe(moved)} pasted")


def _compute_displacement(
    sketch: Sketch, selection: Selection, position: Point | None, grid: float | None
) -> tuple[float, float]:
    """Return the displacement, m, that moves the center of a selection to a position, rounded to the grid."""
    bounds = transform.compute_bounds(sketch, selection)
    if position is None or bounds is None:
        return 0.0, 0.0
    x, y = compute_center(bounds)
    dx = position[0] - x
    dy = position[1] - y
    if grid:
        return grid * round(dx / grid), grid * round(dy / grid)
    return dx, dy


def _parse(text: str) -> Sketch:
    require(text.strip(), "there is nothing to paste")
    require(text.lstrip()[:1] in ("{", "["), f"the {SOURCE} contains no part of a map")
    try:
        return build_sketch(_build_document(parse_json(text, SOURCE)), SOURCE)
    except MapError as error:
        raise MapError(f"this cannot be pasted: {error}") from None


def _build_document(value: Any) -> Any:
    """Return a map document for parsed JSON.

    The JSON is a copied part of a map, a map, an obstacle, a list of obstacles, or the corners of a polygon.
    """
    if isinstance(value, dict) and "format" in value:
        if value["format"] == FORMAT:
            return {**value, "format": HEADER["format"]}
        return value
    obstacles = value
    if isinstance(value, dict):
        obstacles = [value]
    are_obstacles = obstacles and all(isinstance(obstacle, dict) for obstacle in obstacles)
    if not are_obstacles:
        require(len(obstacles) >= 3, "expected a map, obstacles or at least three points")
        obstacles = [{"kind": "polygon", "vertices": obstacles}]
    return {**HEADER, "obstacles": obstacles}
