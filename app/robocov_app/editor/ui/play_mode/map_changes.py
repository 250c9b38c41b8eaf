"""Transfers obstacles edited in play mode to the edited map."""

from dataclasses import replace

from robocov.environment import Environment
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Item, Sketch


def build_play_change(sketch: Sketch, before: Environment, after: Environment) -> Change | None:
    """Combine all obstacle edits made in the viewer into one change.

    Parameters
    ----------
    sketch : Sketch
        The map in the editor.
    before, after : Environment
        The map when play mode started, and the current one of the viewer.

    Returns
    -------
    Change or None
        None if no obstacle has changed, or if the viewer shows a map with another boundary. Unchanged
        obstacles keep their keys and marks.
    """
    # The viewer cannot edit the boundary. With another one, it shows another map, such as that of a lesson.
    if after is before or after.obstacles == before.obstacles or after.boundary != before.boundary:
        return None
    remaining = list(sketch.obstacles)
    items: list[Item] = []
    key = sketch.next_key
    for shape in after.obstacles:
        # Shapes in the viewer have no keys, so unchanged obstacles are found by equality.
        same = next((item for item in remaining if item.shape == shape), None)
        if same is not None:
            remaining.remove(same)
            items.append(same)
        else:
            items.append(Item(key, shape))
            key += 1
    new = frozenset(item.key for item in items if item.key not in sketch.index_by_key)
    description = "changes made in play mode"
    return Change(replace(sketch, obstacles=tuple(items)), Selection(items=new), description)
