"""What applies to what is under the cursor: the names of the actions of the menu there. Knows no pygame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov.environment import PolygonObstacle, WallObstacle
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.ui.deeds import whole

if TYPE_CHECKING:
    from robocov_app.editor.ui.desk import Desk

_SEPARATE = ""


def offered(desk: Desk) -> list[str]:
    """Return the names of the actions that apply to what is selected, with an empty one between groups."""
    selection = desk.selection
    if not selection:
        return [
            *("paste", "select:all", _SEPARATE),
            *(
                "tool:polygon",
                "tool:rectangle",
                "tool:circle",
                "tool:wall",
                "tool:boundary",
                "tool:disc",
                _SEPARATE,
            ),
            *("fit", "background", "try"),
        ]
    if selection.vertices:
        return _of_vertices(desk)
    shapes = [desk.sketch.item(key).shape for key in selection.items if key in desk.sketch.places]
    names = ["cut", "copy", "duplicate", "delete", _SEPARATE]
    if len(selection.owners) == 1 and not selection.boundary:
        names += ["name", "fit:selection", _SEPARATE]
    names += ["rotate:left", "rotate:right", "mirror:x", "mirror:y", _SEPARATE]
    if len(shapes) > 1:
        names += ["unite", "subtract", "intersect", "divide", _SEPARATE]
        names += ["align:left", "align:bottom"]
        names += ["distribute:x", "distribute:y"] if len(shapes) > 2 else []
        names.append(_SEPARATE)
    if shapes:
        names += ["group"] if len(shapes) > 1 else []
        names += ["lock", "hide", _SEPARATE]
    walls = [shape for shape in shapes if isinstance(shape, WallObstacle)]
    if len(walls) > 1 and len(walls) == len(shapes):
        names.append("join")
    if any(not isinstance(shape, PolygonObstacle) for shape in shapes):
        names.append("polygons")
    if any(isinstance(shape, PolygonObstacle) for shape in shapes) or selection.boundary:
        names += ["simplify", "straighten"]
    if len(shapes) == 1 and isinstance(shapes[0], PolygonObstacle) and len(selection.owners) == 1:
        names.append("boundary:of")
    if any(problem.of in selection.owners and problem.grave for problem in desk.problems):
        names.append("repair")
    if selection.boundary and not shapes:
        names = ["fit", "simplify", "straighten", "repair", _SEPARATE, "tool:boundary"]
    if selection.starts and not shapes:
        names = ["copy", "duplicate", "delete", _SEPARATE, "name", "show:robots", "fit:selection"]
    return _tidy(names)


def _of_vertices(desk: Desk) -> list[str]:
    selection = desk.selection
    names = ["delete", "bevel", "round"]
    if len(selection.vertices) == 1:
        (vertex,) = selection.vertices
        shape = desk.sketch.item(vertex.of).shape if isinstance(vertex.of, int) and vertex.of >= 0 else None
        if isinstance(shape, WallObstacle):
            names.append("extend" if vertex.index in (0, len(shape.points) - 1) else "split")
        if vertex.ring:
            names.append("fill")
    else:
        names += [_SEPARATE, "align:left", "align:bottom"]
    names += [_SEPARATE, "straighten", "simplify"]
    if BOUNDARY not in whole(selection).owners:
        names += [_SEPARATE, "copy", "duplicate"]
    return _tidy(names)


def _tidy(names: list[str]) -> list[str]:
    """Return the names without separators at the ends, or two in a row."""
    tidy: list[str] = []
    for name in names:
        if name or (tidy and tidy[-1]):
            tidy.append(name)
    return tidy[:-1] if tidy and not tidy[-1] else tidy
