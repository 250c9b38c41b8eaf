"""Copy and paste as JSON text: also of whole maps, obstacles, and lists of obstacles or of points."""

from dataclasses import replace

from robocov.environment import Obstacle, Point, PolygonObstacle
from robocov.errors import MapError
from robocov.files.strictjson import parse_json
from robocov.mapfile import dump_document
from robocov.mapfile.models import HEADER
from robocov_app.editor.edits import create, transform
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import compute_centre
from robocov_app.editor.model.parser import build_sketch
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch, to_document

FORMAT = "robocov-clipboard"  # what the copied text says that it is


def copy_selection(sketch: Sketch, selection: Selection) -> str:
    starts = tuple((name, spec) for name, spec in sketch.starts if name in selection.starts)
    part = Sketch(sketch.name, obstacles=tuple(selection.list_items(sketch)), starts=starts)
    part = replace(part, boundary=sketch.boundary) if selection.boundary else part
    anything = part.boundary is not None or part.obstacles or part.starts
    require(anything, "select obstacles, starts or the boundary to copy")
    return dump_document({**to_document(part), "format": FORMAT})


def paste(sketch: Sketch, text: str, at: Point | None = None, grid: float | None = None) -> Change:
    """Paste copied text, its middle at a place, m (None: as it was); a boundary only where there is none."""
    part = _part(text)
    shapes: list[tuple[Obstacle, str]] = [(item.shape, item.note) for item in part.obstacles]
    new_boundary = part.boundary is not None and sketch.boundary is None
    if part.boundary is not None and not (new_boundary or shapes or part.starts):
        shapes.append((PolygonObstacle(part.boundary), ""))
    after, new = create.add_objects(sketch, shapes, part.starts)
    selection = require(replace(new, boundary=new_boundary), "there is nothing to paste in what was copied")
    after = replace(after, boundary=part.boundary) if new_boundary else after
    bounds = transform.compute_bounds(after, selection)
    by = [0.0, 0.0]
    if at is not None and bounds is not None:
        by = [to - middle for to, middle in zip(at, compute_centre(bounds), strict=True)]
        by = [grid * round(each / grid) for each in by] if grid else by
    # by nothing too: what is pasted lies on tenths of millimetres, as far as maps reach
    after = transform.move(after, selection, by[0], by[1]).sketch
    return Change(after, selection, f"{selection.describe(after)} pasted")


def _part(text: str) -> Sketch:
    require(text.strip(), "there is nothing to paste")
    require(text.lstrip()[:1] in ("{", "["), "what was copied is no part of a map")
    try:
        value = parse_json(text, "what was copied")
        if isinstance(value, dict) and "format" in value:
            ours = value["format"] == FORMAT
            return build_sketch({**value, "format": HEADER["format"]} if ours else value, "what was copied")
        obstacles = [value] if isinstance(value, dict) else value
        if not obstacles or not all(isinstance(each, dict) for each in obstacles):
            require(len(obstacles) >= 3, "expected at least three points, obstacles or a map")
            obstacles = [{"kind": "polygon", "vertices": obstacles}]
        return build_sketch({**HEADER, "obstacles": obstacles}, "what was copied")
    except MapError as error:
        raise MapError(f"this cannot be pasted: {error}") from None
