"""Pages that watch and control a window: passing of control, the clipboard, and limits on pages."""

from contextlib import ExitStack

import pygame
import pytest

pytest.importorskip("websockets")

from page_client import connect_page, find_controller

from robocov_app.web.events import PointerMoved

TRY_AGAIN_LATER = 1013
REPLACED = 4001


def take_pointer_columns(display):
    """Return the x coordinates of all pointer movements that the window has received since the last call."""
    messages = display.shared.window_input._messages
    columns = []
    while messages:
        message = messages.popleft()
        if isinstance(message, PointerMoved):
            columns.append(message.x)
    return columns


def find_name(state, number):
    for participant in state["participants"]:
        if participant["number"] == number:
            return participant["name"]
    return None


def test_a_teacher_who_joins_after_a_viewer_controls_the_window(viewer, teacher):
    viewer.receive_message()
    state = teacher.receive_message()
    assert find_controller(state) == state["you"]


def test_a_viewer_requests_control_but_cannot_take_it(display, viewer, teacher):
    viewer_number = viewer.receive_message()["you"]
    teacher.receive_message()
    viewer.receive_message()
    viewer.send(kind="move", x=1, y=1)
    viewer.pass_control(viewer_number)
    viewer.request_control()
    state = teacher.receive_message()
    assert [participant["requests_control"] for participant in state["participants"]] == [True, False]
    assert find_controller(state) == state["you"]
    assert take_pointer_columns(display) == []


def test_a_teacher_passes_control_to_a_viewer_and_takes_it_back(display, viewer, teacher):
    viewer_number = viewer.receive_message()["you"]
    teacher_number = teacher.receive_message()["you"]
    teacher.send(kind="move", x=2, y=1)
    teacher.pass_control(viewer_number)
    assert find_controller(teacher.receive_message()) == viewer_number
    assert take_pointer_columns(display) == [2]
    teacher.send(kind="move", x=3, y=1)
    teacher.pass_control(teacher_number)
    assert find_controller(teacher.receive_message()) == teacher_number
    assert take_pointer_columns(display) == []


def test_no_page_controls_after_the_teacher_has_left(display, viewer):
    with connect_page(display.link) as teacher:
        teacher.receive_message()
        viewer.receive_message_until(lambda state: find_controller(state) is not None)
    viewer.receive_message_until(lambda state: find_controller(state) is None)


def test_a_page_that_reconnects_keeps_its_number_name_and_control(display):
    with (
        connect_page(display.link) as other,
        connect_page(display.link, page_id="a") as page,
    ):
        other.receive_message()
        number = page.receive_message()["you"]
        other.pass_control(number)
        page.send(kind="name", name="Ada")
        # The server has not noticed that the first connection is lost.
        with connect_page(display.link, page_id="a") as reconnected:
            state = reconnected.receive_message_until(
                lambda state: len(state["participants"]) == 2 and find_name(state, number) == "Ada"
            )
            assert state["you"] == number
            assert find_controller(state) == number


def test_only_the_controlling_page_sees_the_clipboard(display, teacher, viewer):
    display.clipboard.put("a secret")
    display.send(pygame.Surface((20, 20), 0, 32))
    state = teacher.receive_message_until(lambda state: "copied" in state)
    assert state["copied"] == "a secret"
    viewer.send(kind="name", name="Ada\n")
    while True:
        state = viewer.receive_message()
        assert "copied" not in state
        if find_name(state, state["you"]) == "Ada":
            break


def test_viewers_do_not_take_the_places_of_teachers(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.pages.MAX_VIEWERS", 3)
    with ExitStack() as stack:
        viewers = [stack.enter_context(connect_page(display.watch_link)) for _ in range(3)]
        with connect_page(display.watch_link) as rejected_viewer:
            code, reason = rejected_viewer.wait_for_close()
        assert code == TRY_AGAIN_LATER
        assert reason.startswith("All 3 places for viewers are taken")
        for _ in range(5):  # reloads
            with connect_page(display.link) as teacher:
                state = teacher.receive_message()
                assert find_controller(state) == state["you"]
        viewers[0].socket.close()
        with connect_page(display.watch_link) as next_viewer:
            assert next_viewer.receive_message()["participants"]


def test_a_viewer_who_reconnects_keeps_the_place_when_all_are_taken(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.pages.MAX_VIEWERS", 1)
    with connect_page(display.watch_link, page_id="a") as viewer:
        viewer.receive_message()
        with connect_page(display.watch_link, page_id="a") as reconnected:
            assert reconnected.receive_message()["you"] == 1


def test_a_further_teacher_replaces_the_oldest_one_who_does_not_control(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.pages.MAX_CONTROL_PAGES", 2)
    with (
        connect_page(display.link) as controlling,
        connect_page(display.link) as replaced,
    ):
        controlling.receive_message()
        with connect_page(display.link) as newest:
            code, _ = replaced.wait_for_close()
            assert code == REPLACED
            newest.receive_message_until(lambda state: len(state["participants"]) == 2)
            controlling.socket.ping().wait(5)
