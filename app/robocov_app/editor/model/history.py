"""Undo history of a sketch."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import NamedTuple

from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch


class State(NamedTuple):
    """A map and the selection in it."""

    sketch: Sketch
    selection: Selection


@dataclass
class _Step:
    """A step of the history: the states before and after a change."""

    before: State
    after: State
    description: str
    drag: Hashable | None


class UndoHistory:
    """A sketch with the steps that can be undone and redone.

    Parameters
    ----------
    sketch : Sketch
    is_saved : bool
        Whether the file contains this sketch.

    Attributes
    ----------
    sketch : Sketch
        Current state.
    selection : Selection
        Current selection, which the window may set.
    saved_sketch : Sketch or None
        The state that the file contains; None if it is none of the states.
    starts_new_step : bool
        Whether the next change becomes a new step even if it belongs to the same drag, for example because
        the mouse button was released.
    """

    def __init__(self, sketch: Sketch, *, is_saved: bool = True) -> None:
        self.sketch = sketch
        self.selection = Selection()
        self.saved_sketch: Sketch | None = None
        if is_saved:
            self.saved_sketch = sketch
        self.starts_new_step = False
        self._undoable: list[_Step] = []
        self._redoable: list[_Step] = []

    def apply(self, change: Change, *, drag: Hashable | None = None) -> bool:
        """Apply a change as a new step, or as part of the current drag.

        Parameters
        ----------
        change : Change
        drag : hashable, optional
            Identifies a drag of the mouse. Consecutive changes of the same drag become one step.

        Returns
        -------
        bool
            Whether anything other than the selection has changed.
        """
        before = State(self.sketch, self.selection)
        continues_drag = drag is not None and bool(self._undoable) and self._undoable[-1].drag == drag
        merges = continues_drag and not self.starts_new_step
        self.starts_new_step = False
        self.selection = change.selection
        if change.sketch == self.sketch:
            return False
        if merges:
            before = self._undoable.pop().before
        self.sketch = change.sketch
        self._redoable = []
        # A drag that has returned to its start leaves no step.
        if change.sketch != before.sketch:
            after = State(change.sketch, change.selection)
            self._undoable.append(_Step(before, after, change.description, drag))
        return True

    def undo(self) -> Change | None:
        """Undo the newest change.

        Returns
        -------
        Change or None
            State before the change, with its description; None if there is nothing to undo.
        """
        if not self._undoable:
            return None
        step = self._undoable.pop()
        self._redoable.append(step)
        return self._restore_state(step.before, step.description)

    def redo(self) -> Change | None:
        """Redo the most recently undone change.

        Returns
        -------
        Change or None
            State after the change; None if there is nothing to redo.
        """
        if not self._redoable:
            return None
        step = self._redoable.pop()
        self._undoable.append(step)
        return self._restore_state(step.after, step.description)

    def _restore_state(self, state: State, description: str) -> Change:
        self.sketch = state.sketch
        self.selection = state.selection
        self.starts_new_step = True
        return Change(state.sketch, state.selection, description)

    def rewrite_all(self, change: Callable[[Sketch], Sketch]) -> None:
        """Replace the sketches of the current state and of all steps, without adding a step.

        Parameters
        ----------
        change : callable
            Takes a sketch and returns the new one.
        """
        steps = [*self._undoable, *self._redoable]
        sketches = [self.sketch]
        for step in steps:
            sketches += [step.before.sketch, step.after.sketch]
        # Steps that share a sketch object still share one afterwards.
        changed_by_id = {id(sketch): change(sketch) for sketch in sketches}
        for step in steps:
            step.before = step.before._replace(sketch=changed_by_id[id(step.before.sketch)])
            step.after = step.after._replace(sketch=changed_by_id[id(step.after.sketch)])
        self.sketch = changed_by_id[id(self.sketch)]

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return bool(self._undoable)

    @property
    def can_redo(self) -> bool:
        """Whether there is a change to redo."""
        return bool(self._redoable)

    @property
    def undo_descriptions(self) -> tuple[str, ...]:
        """Descriptions of the changes that can be undone, the newest first."""
        return tuple(step.description for step in reversed(self._undoable))

    @property
    def redo_descriptions(self) -> tuple[str, ...]:
        """Descriptions of the changes that can be redone, the next first."""
        return tuple(step.description for step in reversed(self._redoable))

    def build_save_point(self) -> Callable[[], None]:
        """Return a function that restores the current state together with all steps."""
        state = dict(vars(self))
        undoable = [*self._undoable]
        redoable = [*self._redoable]

        def restore() -> None:
            vars(self).update(state)
            self._undoable = undoable
            self._redoable = redoable

        return restore

    def mark_saved(self) -> None:
        """Record that the file contains the current state."""
        self.saved_sketch = self.sketch
        self.starts_new_step = True

    @property
    def has_unsaved_changes(self) -> bool:
        """Whether the current state differs from the file; false again after undo to the saved state."""
        return self.saved_sketch is not self.sketch and self.saved_sketch != self.sketch
