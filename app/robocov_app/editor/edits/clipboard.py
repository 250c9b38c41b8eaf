"""Copy and paste as JSON text: also of whole maps, obstacles, and lists of obstacles or of points."""

from dataclasses import replace
from typing import Any

from robocov.environment import Obstacle, Point, PolygonObstacle
from robocov.errors import MapError
from robocov.files.strictjson import parse
from robocov.mapfile import dump_document
from robocov.mapfile.models import FORMAT as MAP_FORMAT
from robocov.mapfile.models import VERSION
from robocov_app.editor.edits.create import free_name
from robocov_app.editor.edits.transform import bounds_of, moved
from robocov_app.editor.model.parser import sketch_of
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch, draft_document

FORMAT = "robocov-clipboard"  # what the copied text says that it is


def copied(sketch: Sketch, selection: Selection) -> str:
    part = Sketch(
        name=sketch.name,
        boundary=sketch.boundary if selection.boundary else None,
        obstacles=tuple(item for item in sketch.obstacles if item.key in selection.items),
        starts=tuple((name, spec) for name, spec in sketch.starts if name in selection.starts),
    )
    if part.boundary is None and not part.obstacles and not part.starts:
        raise MapError("select obstacles, starts or the boundary to copy")
    return dump_document({**draft_document(part), "format": FORMAT})


def pasted(sketch: Sketch, text: str, at: Point | None = None, grid: float | None = None) -> Change:
    """Paste copied text, its middle at a place, m (None: as it was); a boundary only where there is none."""
    part = _part(text)
    shapes: list[tuple[Obstacle, str]] = [(item.shape, item.note) for item in part.obstacles]
    new_boundary = part.boundary is not None and sketch.boundary is None
    if part.boundary is not None and not (new_boundary or shapes or part.starts):
        shapes.append((PolygonObstacle(part.boundary), ""))
    after, keys = sketch.added(shapes)
    if new_boundary:
        after = replace(after, boundary=part.boundary)
    names = []
    for name, spec in part.starts:
        names.append(free_name(after, name or "start"))
        after = after.with_start(names[-1], spec)
    selection = replace(Selection.of(*keys, *names), boundary=new_boundary)
    if not selection:
        raise MapError("there is nothing to paste in what was copied")
    bounds = bounds_of(after, selection)
    by = (0.0, 0.0)
    if at is not None and bounds is not None:
        by = at[0] - (bounds[0] + bounds[2]) / 2, at[1] - (bounds[1] + bounds[3]) / 2
        by = (grid * round(by[0] / grid), grid * round(by[1] / grid)) if grid else by
    # by nothing too: what is pasted lies on tenths of millimetres, as far as maps reach
    after = moved(after, selection, *by).sketch
    return Change(after, selection, f"{selection.words(after)} pasted")


def _part(text: str) -> Sketch:
    if not text.strip():
        raise MapError("there is nothing to paste")
    if text.lstrip()[:1] not in ("{", "["):
        raise MapError("what was copied is no part of a map")
    try:
        return sketch_of(_map_of(parse(text, "what was copied")), "what was copied")
    except MapError as error:
        raise MapError(f"this cannot be pasted: {error}") from None


def _map_of(value: Any) -> dict[str, Any]:
    empty = {"format": MAP_FORMAT, "version": VERSION}
    if isinstance(value, dict):
        if value.get("format") == FORMAT:
            return {**value, "format": MAP_FORMAT}
        return value if "format" in value else {**empty, "obstacles": [value]}
    if isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
        return {**empty, "obstacles": value}
    if not isinstance(value, list) or len(value) < 3:
        raise MapError("three points at least, obstacles or a map were wanted")
    return {**empty, "obstacles": [{"kind": "polygon", "vertices": value}]}
