"""Undoing and redoing edits, and unsaved changes."""

from drawn_sketches import changes, drafts, renumber, valid_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov_app.editor.edits import create, properties, transform
from robocov_app.editor.model.geometry import DECIMALS
from robocov_app.editor.model.history import UndoHistory
from robocov_app.editor.model.parser import build_sketch
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch, to_document

HALL = ((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0))


@settings(max_examples=count_examples(120))
@given(st.data())
def test_undo_is_the_exact_inverse_of_any_change(data):
    history = UndoHistory(data.draw(st.one_of(valid_sketches(min_size=2), drafts())))
    was = [(history.sketch, history.selection)]
    for _ in range(data.draw(st.integers(1, 6))):
        change = data.draw(changes(history.sketch))
        if change is not None and history.apply(change):
            was.append((history.sketch, history.selection))
            # The result of any edit can be saved and read.
            assert build_sketch(to_document(change.sketch)) == renumber(change.sketch)
            assert change.selection == change.selection.restrict_to(change.sketch)
            assert len(change.sketch.index_by_key) == len(change.sketch.obstacles)
            assert change.description
    words = history.undo_descriptions
    for sketch, _ in reversed(was[:-1]):
        assert history.undo() is not None
        assert history.sketch == sketch
    assert not history.undo_descriptions
    assert history.undo() is None
    assert history.redo_descriptions == tuple(reversed(words))
    for sketch, selection in was[1:]:
        assert history.redo() is not None
        assert (history.sketch, history.selection) == (sketch, selection)
    assert not history.redo_descriptions
    assert history.undo_descriptions == words


@settings(max_examples=count_examples(100))
@given(st.data())
def test_coordinates_are_rounded_to_a_tenth_of_a_millimeter(data):
    sketch = data.draw(valid_sketches(min_size=1))
    change = data.draw(changes(sketch))
    document = to_document(change.sketch) if change is not None else {}

    def walk(value):
        if isinstance(value, list | tuple):
            for each in value:
                walk(each)
        elif isinstance(value, dict):
            for each in value.values():
                walk(each)
        elif isinstance(value, float):
            assert value == round(value, DECIMALS)
            assert len(f"{abs(value):.9f}".rstrip("0").partition(".")[2]) <= DECIMALS

    walk([document.get("boundary", []), document.get("obstacles", []), document.get("starts", {})])


def draw_circles(count: int) -> UndoHistory:
    history = UndoHistory(Sketch(boundary=HALL))
    for k in range(count):
        history.apply(create.add_circle(history.sketch, (k % 12 + 0.5, k % 7 + 0.5), 0.3))
    return history


def test_a_drag_is_one_step():
    history = draw_circles(1)
    selection = Selection.of(0)
    before = history.sketch
    for k in range(1, 30):
        assert history.apply(transform.move(before, selection, 0.1 * k, 0.0), drag="drag 1")
    assert history.undo_descriptions == ("circle moved", "circle drawn")
    history.starts_new_step = True
    history.apply(transform.move(history.sketch, selection, 1.0, 0.0), drag="drag 1")
    assert len(history.undo_descriptions) == 3
    history.undo()
    history.undo()
    assert history.sketch == before
    # After undoing, the same drag starts a new step.
    history.apply(transform.move(before, selection, 0.1, 0.0), drag="drag 1")
    assert history.undo_descriptions == ("circle moved", "circle drawn")


def test_a_drag_that_returns_is_not_a_step():
    history = draw_circles(1)
    before = history.sketch
    history.mark_saved()
    history.apply(transform.move(before, Selection.of(0), 1.0, 0.0), drag=1)
    assert history.has_unsaved_changes
    history.apply(transform.move(before, Selection.of(0), 0.0, 0.0), drag=1)
    assert history.undo_descriptions == ("circle drawn",)
    assert history.sketch == before
    assert not history.has_unsaved_changes


def test_an_edit_without_effect_is_not_a_step_and_preserves_redo():
    history = draw_circles(2)
    history.undo()
    assert not history.apply(Change(history.sketch, Selection.of(0), "nothing"))
    assert history.redo_descriptions
    assert history.selection == Selection.of(0)
    history.apply(create.add_circle(history.sketch, (5.0, 5.0), 1.0))
    assert not history.redo_descriptions


def test_undo_has_no_limit():
    history = draw_circles(3000)
    first = history.sketch
    count = 0
    while history.undo():
        count += 1
    assert count == 3000
    assert history.sketch == Sketch(boundary=HALL)
    while history.redo():
        count -= 1
    assert count == 0
    assert history.sketch == first


def test_unsaved_changes_are_relative_to_the_saved_state():
    history = draw_circles(3)
    assert history.has_unsaved_changes
    history.mark_saved()
    assert not history.has_unsaved_changes
    history.undo()
    assert history.has_unsaved_changes
    history.redo()
    assert not history.has_unsaved_changes
    history.saved_sketch = None
    assert history.has_unsaved_changes
    assert UndoHistory(Sketch(), is_saved=False).has_unsaved_changes
    assert not UndoHistory(Sketch()).has_unsaved_changes


def test_undoing_restores_the_selection():
    history = draw_circles(2)
    history.selection = Selection.of(0)
    history.apply(properties.delete(history.sketch, Selection.of(0)))
    assert history.selection == Selection()
    undone = history.undo()
    assert undone is not None
    assert undone.description == "circle deleted"
    assert undone.selection == history.selection == Selection.of(0)
