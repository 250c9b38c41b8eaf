from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.viewer.session.undo import Edit, Undo


class Page:
    """Words that are written and taken back."""

    def __init__(self, undo: Undo) -> None:
        self.undo, self.words = undo, []

    def write(self, word: str) -> None:
        self.words.append(word)
        self.undo.add(Edit(word, self.words.pop, lambda: self.words.append(word)))


def test_there_and_back():
    undo = Undo()
    page = Page(undo)
    assert (undo.can_undo, undo.can_redo) == (False, False)
    assert undo.undo() is None
    assert undo.redo() is None
    page.write("one")
    page.write("two")
    assert undo.undo() == "two"
    assert page.words == ["one"]
    assert (undo.can_undo, undo.can_redo) == (True, True)
    assert undo.redo() == "two"
    assert page.words == ["one", "two"]
    assert undo.undo() == "two"
    assert undo.undo() == "one"
    assert undo.undo() is None
    assert page.words == []


def test_who_does_something_else_cannot_do_the_former_again():
    undo = Undo()
    page = Page(undo)
    page.write("one")
    undo.undo()
    page.write("two")
    assert not undo.can_redo
    assert undo.undo() == "two"


@given(st.lists(st.sampled_from(["write", "undo", "redo"]), max_size=40))
def test_it_is_a_stack_with_a_place_in_it(actions):
    undo = Undo()
    page, done, place = Page(undo), [], 0
    for k, action in enumerate(actions):
        if action == "write":
            page.write(str(k))
            done, place = [*done[:place], str(k)], place + 1
        elif action == "undo":
            assert undo.undo() == (done[place - 1] if place else None)
            place = max(place - 1, 0)
        else:
            assert undo.redo() == (done[place] if place < len(done) else None)
            place = min(place + 1, len(done))
        assert page.words == done[:place]
        assert undo.can_undo == (place > 0)
        assert undo.can_redo == (place < len(done))


def test_what_is_done_while_undoing_is_not_noted():
    undo = Undo()
    page = Page(undo)
    undo.add(Edit("much", lambda: page.write("a"), lambda: page.write("b")))
    undo.undo()
    assert page.words == ["a"]
    assert not undo.can_undo
    undo.redo()
    assert page.words == ["a", "b"]
    undo.hold(lambda: page.write("c"))
    assert undo.undo() == "much"


@pytest.mark.parametrize("way", ["back", "again"])
def test_what_cannot_be_taken_back_now_stays(way):
    undo = Undo()
    blocked = [True]

    def turn():
        if blocked:
            raise ValueError("blocked")

    undo.add(Edit("one", (lambda: None) if way == "again" else turn, turn))
    if way == "again":
        undo.undo()
    go = undo.redo if way == "again" else undo.undo
    for _ in range(2):
        with pytest.raises(ValueError, match="blocked"):
            go()
    # and is noted again afterwards
    blocked.clear()
    assert go() == "one"
    undo.add(Edit("two", lambda: None, lambda: None))
    assert undo.undo() == "two"


def test_what_comes_first_comes_first():
    calls = []
    undo = Undo(lambda: calls.append("ready"))
    undo.undo()
    assert calls == []
    undo.add(Edit("one", lambda: calls.append("back"), lambda: calls.append("again")))
    undo.undo()
    undo.redo()
    assert calls == ["ready", "back", "ready", "again"]


def test_all_is_forgotten():
    undo = Undo()
    page = Page(undo)
    page.write("one")
    page.write("two")
    undo.undo()
    undo.clear()
    assert (undo.undo(), undo.redo()) == (None, None)
    assert page.words == ["one"]
