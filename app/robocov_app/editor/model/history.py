"""Undo and redo of a sketch, without a limit: what it was is kept, not what was done."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace

from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch


@dataclass
class _Step:
    before: Sketch
    selected_before: Selection
    after: Change
    drag: Hashable | None


class History:
    """A sketch as it is now, and all that it was; a window that selects something sets `selection`."""

    def __init__(self, sketch: Sketch, *, saved: bool = True) -> None:
        self.sketch = sketch
        self.selection = Selection()
        self._done: list[_Step] = []
        self._undone: list[_Step] = []
        self._saved = sketch if saved else None
        self._broken = False

    def do(self, change: Change, *, drag: Hashable | None = None) -> bool:
        """Take a change; return whether it changed anything.

        Changes one after another with the same `drag` become one, as of one drag or one typed field.
        """
        before, selected = self.sketch, self.selection
        last = self._done[-1] if self._done else None
        merges = drag is not None and not self._broken and last is not None and last.drag == drag
        self._broken = False
        self.selection = change.selection
        if change.sketch == before:
            return False
        if merges and last is not None:
            self._done.pop()
            before, selected = last.before, last.selected_before
        self.sketch = change.sketch
        self._undone = []
        if change.sketch != before:
            self._done.append(_Step(before, selected, change, drag))
        return True

    def undo(self) -> Change | None:
        """Take the newest change back; return what was there before, in the words of what was taken back."""
        if not self._done:
            return None
        step = self._done.pop()
        self._undone.append(step)
        return self._now(Change(step.before, step.selected_before, step.after.words))

    def redo(self) -> Change | None:
        """Do again what was undone last; None if there is nothing."""
        if not self._undone:
            return None
        step = self._undone.pop()
        self._done.append(step)
        return self._now(step.after)

    def replace_all(self, change: Callable[[Sketch], Sketch]) -> None:
        """Change the sketch as it is and at every step, without a step of its own."""
        steps = [*self._done, *self._undone]
        sketches = [self.sketch, *(step.before for step in steps), *(step.after.sketch for step in steps)]
        # the same sketch stays the same in all steps
        new = {id(sketch): change(sketch) for sketch in {id(each): each for each in sketches}.values()}
        for step in steps:
            step.before = new[id(step.before)]
            step.after = replace(step.after, sketch=new[id(step.after.sketch)])
        self.sketch = new[id(self.sketch)]

    @property
    def past(self) -> tuple[str, ...]:
        """What can be taken back, in words, the newest first."""
        return tuple(step.after.words for step in reversed(self._done))

    @property
    def future(self) -> tuple[str, ...]:
        """What can be done again, in words, the next first."""
        return tuple(step.after.words for step in reversed(self._undone))

    def break_drag(self) -> None:
        """Let the next change stand alone, as when the mouse is released."""
        self._broken = True

    def mark_saved(self) -> None:
        """Remember that a file holds what is there now."""
        self._saved = self.sketch
        self._broken = True

    def mark_unsaved(self) -> None:
        """Remember that no file holds any of it, as when the file has changed or gone."""
        self._saved = None

    @property
    def unsaved(self) -> bool:
        """Whether something would be lost; undoing back to what was saved makes it false again."""
        return self._saved is not self.sketch and self._saved != self.sketch

    def _now(self, change: Change) -> Change:
        self.sketch, self.selection = change.sketch, change.selection
        self._broken = True
        return change
