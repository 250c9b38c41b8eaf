"""The history of a sketch: changes that can be undone and redone."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace

from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch


@dataclass
class _Step:
    """A change, and the state before it, which has the description of the change."""

    before: Change
    after: Change
    drag: Hashable | None


class UndoHistory:
    """A sketch, and all its earlier states.

    Parameters
    ----------
    sketch : Sketch
    saved : bool
        Whether the file has this content.

    Attributes
    ----------
    sketch : Sketch
        The present state.
    selection : Selection
        The present selection, which the window may set.
    saved : Sketch or None
        Content of the file; None if it is not one of these states.
    starts_new_step : bool
        Whether the next change is a step of its own, as after the mouse was released.
    """

    def __init__(self, sketch: Sketch, *, saved: bool = True) -> None:
        self.sketch = sketch
        self.selection = Selection()
        self.saved: Sketch | None = None
        if saved:
            self.saved = sketch
        self.starts_new_step = False
        self._undoable: list[_Step] = []
        self._redoable: list[_Step] = []

    def apply(self, change: Change, *, drag: Hashable | None = None) -> bool:
        """Apply a change.

        Parameters
        ----------
        change : Change
        drag : hashable, optional
            Identity of a movement of the mouse; consecutive changes of the same drag become one step.

        Returns
        -------
        bool
            Whether anything has changed, besides the selection.
        """
        before = Change(self.sketch, self.selection, change.description)
        continues_drag = drag is not None and bool(self._undoable) and self._undoable[-1].drag == drag
        merges = continues_drag and not self.starts_new_step
        self.starts_new_step = False
        self.selection = change.selection
        if change.sketch == self.sketch:
            return False
        if merges:
            before = replace(self._undoable.pop().before, description=change.description)
        self.sketch = change.sketch
        self._redoable = []
        # A drag that returns to where it started is no step.
        if change.sketch != before.sketch:
            self._undoable.append(_Step(before, change, drag))
        return True

    def undo(self) -> Change | None:
        """Undo the newest change.

        Returns
        -------
        Change or None
            The state before, with the description of the change; None if there is nothing to undo.
        """
        if not self._undoable:
            return None
        step = self._undoable.pop()
        self._redoable.append(step)
        return self._go_to(step.before)

    def redo(self) -> Change | None:
        """Redo the change that was undone last.

        Returns
        -------
        Change or None
            The state after it; None if there is nothing to redo.
        """
        if not self._redoable:
            return None
        step = self._redoable.pop()
        self._undoable.append(step)
        return self._go_to(step.after)

    def _go_to(self, state: Change) -> Change:
        self.sketch = state.sketch
        self.selection = state.selection
        self.starts_new_step = True
        return state

    def rewrite_all(self, change: Callable[[Sketch], Sketch]) -> None:
        """Change the present state and all others, without a step of its own.

        Parameters
        ----------
        change : callable
            Called once for each different state.
        """
        steps = [*self._undoable, *self._redoable]
        sketches = [self.sketch]
        for step in steps:
            sketches += [step.before.sketch, step.after.sketch]
        # Steps that share a sketch still share it afterwards.
        changed_by_id = {id(sketch): change(sketch) for sketch in sketches}
        for step in steps:
            step.before = replace(step.before, sketch=changed_by_id[id(step.before.sketch)])
            step.after = replace(step.after, sketch=changed_by_id[id(step.after.sketch)])
        self.sketch = changed_by_id[id(self.sketch)]

    @property
    def undo_descriptions(self) -> tuple[str, ...]:
        """Descriptions of the changes that can be undone, the newest first."""
        return tuple(step.after.description for step in reversed(self._undoable))

    @property
    def redo_descriptions(self) -> tuple[str, ...]:
        """Descriptions of the changes that can be redone, the next first."""
        return tuple(step.after.description for step in reversed(self._redoable))

    def build_save_point(self) -> Callable[[], None]:
        """Return a function that restores the present state, with its steps."""
        state = dict(vars(self))
        undoable = [*self._undoable]
        redoable = [*self._redoable]

        def restore() -> None:
            vars(self).update(state)
            self._undoable = undoable
            self._redoable = redoable

        return restore

    def mark_saved(self) -> None:
        """Note that the file has the present content."""
        self.saved = self.sketch
        self.starts_new_step = True

    @property
    def has_unsaved_changes(self) -> bool:
        """Whether changes would be lost; false again after undoing back to the saved state."""
        return self.saved is not self.sketch and self.saved != self.sketch
