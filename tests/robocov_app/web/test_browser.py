"""Served windows in a real browser: input, passing of control, phones, and saved files."""

import io
import json
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pygame
import pytest
from driven_browser import CHROMIUM, DRIVER
from served_window import serve_window
from sub_path_proxy import PREFIX, SubPathProxy

pytest.importorskip("websockets")

from page_client import connect_page

MAPS = Path(__file__).parents[3] / "maps"
ENTER = "\ue007"
DOWNLOADS_HEIGHT = 32
"""Height of the bar of saved files on pages without touch, CSS px."""
STRIP_PX = 4
"""Width of the strips next to a covered part of the page in which nothing of it may show."""
MAX_NOISE = 6
"""Maximum difference of the colors of an empty area, which the compression of pictures causes."""
MAX_EDITS = 10
"""Maximum number of edits that a test of the editor undoes at its end."""
EMPTY_MAP = json.dumps(
    {
        "format": "robocov-map",
        "version": 1,
        "boundary": [[0, 0], [10, 0], [10, 10], [0, 10]],
        "obstacles": [],
    }
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and its driver"),
    pytest.mark.xdist_group("web"),
]


@pytest.fixture(autouse=True)
def _close_previous_page(browser):
    """Leave the page of the previous test, which would try to reconnect."""
    browser.driver.get("about:blank")
    browser.read_console()


def get_canvas_size(browser):
    return browser.run_script("const it = document.querySelector('canvas'); return [it.width, it.height]")


def get_classes(browser):
    """Return the classes that describe the role of the page."""
    return set(browser.run_script("return document.body.className").split())


def read_picture(browser):
    return browser.run_script("return document.querySelector('canvas').toDataURL()")


def wait_for_unchanged_picture(browser):
    """Wait until the picture does not change any more, and return it."""
    pictures = [""]

    def is_unchanged():
        pictures.append(read_picture(browser))
        return pictures[-1] == pictures[-2] and browser.run_script("return pendingFrames.then(() => true)")

    browser.wait_until(is_unchanged)
    return pictures[-1]


@pytest.fixture(scope="module")
def shared_rooms(tmp_path_factory):
    """Serve a window of the map Rooms for several tests, and yield its link."""
    folder = tmp_path_factory.mktemp("rooms")
    with serve_window("demo", "rooms", "--paused", "--folder", str(folder)) as link:
        yield link


def open_page(browser, link):
    """Show a window on a page of 1280 x 720 px."""
    browser.resize(1280, 720)
    browser.driver.get(link)
    browser.wait_until(lambda: get_canvas_size(browser) == [1280, 720])
    wait_for_unchanged_picture(browser)


@pytest.fixture
def rooms(browser, tmp_path):
    """Yield the link of a new window of the map Rooms, which a page of 1280 x 720 px shows."""
    with serve_window("demo", "rooms", "--paused", "--folder", str(tmp_path)) as link:
        open_page(browser, link)
        yield link


@pytest.fixture
def unchanged_rooms(browser, shared_rooms):
    """Show a window of the map Rooms whose session and files no test changes."""
    open_page(browser, shared_rooms)


@pytest.mark.usefixtures("unchanged_rooms")
def test_a_drag_moves_the_map_and_f_shows_all_of_it(browser):
    first = read_picture(browser)
    browser.drag((60, 240), (160, 240))
    browser.wait_until(lambda: read_picture(browser) != first)
    panned = wait_for_unchanged_picture(browser)
    browser.press_keys("f")
    browser.wait_until(lambda: read_picture(browser) != panned)
    assert not browser.read_console()


def test_a_command_is_typed_in_the_palette(browser, rooms):
    browser.press_keys("/")
    browser.press_keys("seed 7")
    typed = wait_for_unchanged_picture(browser)
    browser.press_keys(ENTER)
    browser.wait_until(lambda: read_picture(browser) != typed)


@pytest.mark.usefixtures("unchanged_rooms")
def test_the_window_has_the_size_of_the_page(browser):
    browser.resize(390, 844, 3.0)
    browser.wait_until(lambda: get_canvas_size(browser) == [1170, 2532])


@pytest.mark.usefixtures("unchanged_rooms")
def test_the_window_follows_the_color_scheme(browser):
    browser.set_preferences(color_scheme="light")
    light = wait_for_unchanged_picture(browser)
    browser.set_preferences(color_scheme="dark")
    browser.wait_until(lambda: read_picture(browser) != light)
    browser.set_preferences(color_scheme="light")


@pytest.mark.usefixtures("unchanged_rooms")
def test_a_page_is_reloaded_by_its_cookie(browser):
    assert "token" not in browser.driver.current_url
    browser.driver.refresh()
    browser.wait_until(lambda: get_canvas_size(browser) == [1280, 720])
    assert browser.run_script("return controls")


def press_with_control(browser, key, command=""):
    """Press a key with Ctrl; the browser also executes its own command, such as ``copy``."""
    event = {"key": key, "modifiers": 2, "commands": [command] if command else []}
    for kind in ("rawKeyDown", "keyUp"):
        browser.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, **event})


def read_status(browser):
    """Return the message of the window."""
    return browser.find("#status").get_property("textContent")


def read_summary(browser):
    """Return the heading of the list of people."""
    return browser.find("summary").get_property("textContent")


def test_a_dropped_file_is_opened_and_not_offered_as_a_saved_one(browser, rooms):
    first = read_picture(browser)
    drop_file = (
        "const box = new DataTransfer(); box.items.add(new File([arguments[0]], 'corner.json'));"
        "dispatchEvent(new DragEvent('drop', {dataTransfer: box, bubbles: true, cancelable: true}))"
    )
    browser.run_script(drop_file, (MAPS / "trap.json").read_text())
    browser.wait_until(lambda: read_picture(browser) != first)
    assert not browser.find_all("#downloads a")


def test_a_saved_session_is_downloaded(browser, rooms, tmp_path):
    downloads = tmp_path / "downloads"
    downloads.mkdir()
    behavior = {"behavior": "allow", "downloadPath": str(downloads)}
    browser.driver.execute_cdp_cmd("Browser.setDownloadBehavior", behavior)
    press_with_control(browser, "s")
    browser.wait_until(lambda: browser.find_all("#downloads a"))
    assert "saved" in read_status(browser)
    assert str(tmp_path) not in read_status(browser)
    browser.wait_until(lambda: get_canvas_size(browser) == [1280, 720 - DOWNLOADS_HEIGHT])
    browser.find("#downloads a").click()
    browser.wait_until(lambda: list(downloads.glob("*.robocov")))


@contextmanager
def open_second_page(browser, link):
    """Open a second page of the teacher, which watches, and yield the handle of the first one."""
    teacher = browser.driver.current_window_handle
    browser.driver.switch_to.new_window("tab")
    browser.resize(1280, 720)
    browser.driver.get(link)
    browser.wait_until(lambda: "Teacher 1 controls" in read_summary(browser))
    browser.wait_until(lambda: get_classes(browser) == {"watching"})
    try:
        yield teacher
    finally:
        if len(browser.driver.window_handles) > 1:
            browser.driver.close()
            browser.driver.switch_to.window(teacher)


@pytest.fixture
def second_page(browser, shared_rooms, unchanged_rooms):
    """Open a second page of the shared window, and yield the handle of the first one."""
    with open_second_page(browser, shared_rooms) as teacher:
        yield teacher


def test_a_page_of_another_shape_shows_the_map_of_the_window(browser, second_page):
    browser.resize(1024, 900)
    browser.wait_until(lambda: get_classes(browser) == {"map", "phone", "watching"})
    browser.wait_until(lambda: get_canvas_size(browser) == [1024, 900])


def test_a_person_enters_a_name(browser, rooms):
    with open_second_page(browser, rooms):
        browser.find("summary").click()
        browser.run_script("prompt = () => 'Ada'")
        push_button(browser, "#here button", "Rename")
        browser.wait_until(lambda: "Ada (you)" in browser.find("#here ul").text)


def test_a_teacher_takes_control_in_a_second_page_until_it_is_closed(browser, second_page):
    browser.find("summary").click()
    push_button(browser, "#here button", "Take control")
    browser.wait_until(lambda: get_classes(browser) == set())
    browser.driver.close()
    browser.driver.switch_to.window(second_page)
    browser.wait_until(lambda: get_classes(browser) == set())
    assert not browser.read_console()


def test_the_invitation_shows_a_link_and_a_qr_code(browser, tmp_path):
    with serve_window("demo", "square", "--host", "0.0.0.0", cwd=tmp_path) as link:
        browser.resize(1280, 720)
        browser.driver.get(link)
        browser.wait_until(lambda: browser.find("summary").is_displayed())
        browser.find("summary").click()
        browser.find_all("#here button")[-1].click()
        invitation = browser.find("#invitation")
        assert invitation.is_displayed()
        assert browser.find("#invitation img").get_attribute("src").startswith("data:image/svg+xml")
        watch_link = browser.find("#invitation p").text
        assert watch_link.startswith("http://")
        assert watch_link != link
        browser.find("#close-invitation").click()
        assert not invitation.is_displayed()


def record_messages(browser):
    """Record the messages that the page sends; return a function that returns the new ones."""
    browser.run_script(
        "window.recorded = []; const sendToServer = send;"
        "send = (message) => { recorded.push(message); sendToServer(message); }"
    )

    def take_messages():
        messages = browser.run_script("return recorded.splice(0)")
        return [message for message in messages if message["kind"] != "shown"]

    return take_messages


@pytest.fixture
def projector(browser, shared_rooms):
    """Open a window on a projector, and also on a phone, which watches; yield the handle of the first page.

    The driver is at the page of the phone.
    """
    browser.resize(1280, 720)
    browser.driver.get(shared_rooms)
    browser.wait_until(lambda: get_canvas_size(browser) == [1280, 720])
    projector = browser.driver.current_window_handle
    browser.driver.switch_to.new_window("tab")
    phone = browser.driver.current_window_handle
    browser.resize(390, 844, 2.0)
    browser.set_touch(is_enabled=True)
    browser.driver.get(shared_rooms)
    browser.wait_until(lambda: "Teacher 1 controls" in browser.find("summary").get_property("textContent"))
    browser.wait_until(lambda: get_classes(browser) == {"map", "phone", "watching"})
    yield projector
    assert not browser.read_console()
    browser.driver.switch_to.window(phone)
    browser.driver.close()
    browser.driver.switch_to.window(projector)


def request_control(browser, projector):
    """Request control on the phone, and wait until the page of the projector shows this."""
    browser.run_script("send({kind: 'control', to: 0})")
    browser.driver.switch_to.window(projector)
    browser.wait_until(lambda: browser.find("#toast").is_displayed())


def hand_over_control(browser, projector):
    """Request control on the phone, hand it over on the projector, and return to the phone."""
    phone = browser.driver.current_window_handle
    request_control(browser, projector)
    push_button(browser, "#toast button", "Hand over")
    browser.wait_until(lambda: get_classes(browser) == {"watching"})
    browser.driver.switch_to.window(phone)
    browser.wait_until(lambda: get_classes(browser) == {"map", "phone"})


def test_a_phone_that_watches_shows_the_map_and_the_people(browser, projector):
    assert browser.find("#line").text.startswith("You are watching Teacher 1")
    assert list_bar_buttons(browser) == ["2 here"]
    browser.wait_until(lambda: get_canvas_size(browser)[0] < get_canvas_size(browser)[1])


def test_a_request_for_control_is_answered_on_the_projector(browser, projector):
    request_control(browser, projector)
    assert "asks for control" in browser.find("#toast").text
    assert [button.text for button in browser.find_all("#toast button")] == ["Hand over", "Later"]
    push_button(browser, "#toast button", "Hand over")
    browser.wait_until(lambda: get_classes(browser) == {"watching"})
    assert not browser.find("#toast").is_displayed()


def test_a_phone_in_control_chooses_a_tool(browser, projector):
    hand_over_control(browser, projector)
    assert browser.run_script("return canvas.getBoundingClientRect().width") <= 390
    browser.find("#to-tools").click()
    push_button(browser, "#tools button", "Wall")
    browser.wait_until(lambda: "Wall" in browser.find("#status").get_property("textContent"))
    assert not browser.find("#tools").is_displayed()


def test_the_projector_keeps_its_size_while_a_phone_is_in_control(browser, projector):
    hand_over_control(browser, projector)
    browser.driver.switch_to.window(projector)
    assert get_canvas_size(browser) == [1280, 720]


def list_bar_buttons(browser):
    """Return the labels of the visible buttons in the bar of a phone."""
    return [button.text for button in browser.find_all("#touch button") if button.is_displayed()]


def push_button(browser, selector, label):
    """Click the first button with a label among those that match a selector."""
    next(button for button in browser.find_all(selector) if button.text == label).click()


def test_the_list_of_people_is_a_sheet_on_a_phone(browser, tmp_path):
    with (
        browser.emulate_touch(),
        serve_window("demo", "rooms", "--paused", "--folder", str(tmp_path)) as link,
        connect_page(link) as teacher,
    ):
        teacher.report_page(1280, 720)
        browser.resize(390, 844, 2.0)
        browser.driver.get(read_watch_link(link))
        browser.wait_until(lambda: list_bar_buttons(browser) == ["2 here"])
        assert find_covering_elements(browser) == []
        browser.find("#to-people").click()
        assert find_covering_elements(browser) == ["#people"]
        assert browser.find("#people").size["height"] < 844 / 2
        push_button(browser, "#people button", "Ask for control")
        teacher.receive_message_until(has_request)
        teacher.pass_control(2)
        browser.wait_until(lambda: "watching" not in get_classes(browser))
        assert not browser.find("#people").is_displayed()
        assert browser.read_console() == []


def read_watch_link(link):
    """Return the link for viewers, which is printed after that of the teacher."""
    return link.process.stdout.readline().split()[-1]


def has_request(message):
    """Return whether a message reports that someone requests control."""
    return any(person["requests_control"] for person in message.get("participants", ()))


def open_lesson(browser, link):
    """Open a page that watches a lesson."""
    browser.driver.get(read_watch_link(link))
    browser.wait_until(lambda: browser.find("#spectator").text == "Teacher 1 leads the lesson")


def show_question(browser, teacher):
    """Show the first question of a lesson, and return the element with its answers."""
    answers = browser.find("#answers")
    for _ in range(2):  # The third chapter asks a question.
        teacher.press_key("ArrowRight")
    browser.wait_until(answers.is_displayed)
    return answers


def test_pages_that_watch_a_lesson_have_no_buttons_and_answers_are_plain_text(browser, tmp_path):
    browser.resize(1280, 720)
    with (
        serve_window("demo", "--tour", "--folder", str(tmp_path)) as link,
        connect_page(link) as teacher,
    ):
        teacher.report_page(1280, 720)
        open_lesson(browser, link)
        left, top, width, height = browser.measure("#spectator")
        assert left > 900
        assert top > 600
        assert left + width == 1280
        assert top + height == 720
        answers = show_question(browser, teacher)
        assert len(browser.find_all("#answers li")) > 1
        assert answers.text
        left, _, width, height = browser.measure("#answers")
        assert left > 900
        assert left + width < 1280
        assert height == browser.run_script("return arguments[0].scrollHeight", answers), "all is visible"
        teacher.pass_control(2)
        browser.wait_until(lambda: not answers.is_displayed())
        browser.wait_until(lambda: not browser.find("#spectator").is_displayed())


def test_nothing_of_the_answers_shows_on_pages_that_watch_in_other_sizes(browser, tmp_path):
    with (
        serve_window("demo", "--tour", "--folder", str(tmp_path)) as link,
        connect_page(link) as teacher,
    ):
        teacher.report_page(1280, 720)
        browser.resize(1000, 640)
        open_lesson(browser, link)
        answers = show_question(browser, teacher)
        for size in ((1000, 640), (1137, 701), (1700, 1000)):
            browser.resize(*size)
            wait_for_unchanged_picture(browser)
            assert measure_contrast_around_answers(browser) <= MAX_NOISE, size
            browser.run_script("arguments[0].style.visibility = 'hidden'", answers)
            contrast = measure_contrast_around_answers(browser, inset=8)
            assert contrast > MAX_NOISE, "the picture has frames there"
            browser.run_script("arguments[0].style.visibility = ''", answers)


def measure_contrast_around_answers(browser, inset=0):
    """Return the maximum difference of colors in narrow strips to the left, to the right and below answers.

    With an inset, the strips are that many pixels further inside.
    """
    left, top, width, height = map(round, browser.measure("#answers"))
    screenshot = pygame.image.load(io.BytesIO(browser.driver.get_screenshot_as_png()))
    inner = pygame.Rect(left, top, width, height).inflate(-2 * inset, -2 * inset)
    strips = (
        pygame.Rect(inner.left - STRIP_PX, inner.top, STRIP_PX, inner.height),
        pygame.Rect(inner.right, inner.top, STRIP_PX, inner.height),
        pygame.Rect(inner.left, inner.bottom, inner.width, STRIP_PX),
    )
    contrasts = []
    for strip in strips:
        pixels = pygame.surfarray.array3d(screenshot.subsurface(strip)).astype(int)
        contrasts.append(int(np.ptp(pixels.reshape(-1, 3), axis=0).max()))
    return max(contrasts)


def test_a_request_for_control_is_visible_above_the_invitation(browser, tmp_path):
    browser.resize(1280, 720)
    with serve_window("demo", "rooms", "--paused", "--host", "0.0.0.0", "--folder", str(tmp_path)) as link:
        browser.driver.get(link)
        browser.wait_until(lambda: browser.find("#here").is_displayed())
        with connect_page(read_watch_link(link)) as student:
            student.report_page(1280, 720)
            browser.find("#here summary").click()
            push_button(browser, "#here button", "Invite others")
            assert browser.find("#invitation").is_displayed()
            student.request_control()
            browser.wait_until(lambda: browser.find("#toast").is_displayed())
            _, toast_top, _, toast_height = browser.measure("#toast")
            _, code_top, _, code_height = browser.measure("#invitation img")
            assert toast_top + toast_height <= code_top, "phones can still read the code"
            assert code_top + code_height < 720
            push_button(browser, "#toast button", "Hand over")
            browser.wait_until(lambda: "watching" in get_classes(browser))
        browser.find("#close-invitation").click()


def test_everyone_can_invite_others_to_windows_of_their_own(browser, tmp_path):
    browser.resize(1280, 720)
    with serve_window("demo", "square", "--each", "--host", "0.0.0.0", "--folder", str(tmp_path)) as link:
        browser.driver.get(link)
        browser.wait_until(lambda: browser.find("#invite").is_displayed())
        browser.find("#invite").click()
        assert browser.find("#invitation h1").text == "Open a window of your own"
        assert browser.find("#invitation img").get_attribute("src").startswith("data:image/svg+xml")
        assert browser.find("#invitation p").text == link
        browser.find("#close-invitation").click()
        browser.run_script("send({kind: 'command', name: 'share:link'})")
        browser.wait_until(
            lambda: "a window of their own" in browser.find("#status").get_property("textContent")
        )


def test_the_page_works_behind_a_proxy_that_fails_or_is_slow(browser, tmp_path):
    browser.resize(900, 600)
    with (
        serve_window("demo", "rooms", "--folder", str(tmp_path)) as link,
        SubPathProxy(urlsplit(link).port) as proxy,
    ):
        browser.driver.get(proxy.build_link(link))
        browser.wait_until(lambda: get_canvas_size(browser) == [900, 600])
        assert urlsplit(browser.driver.current_url).path == PREFIX + "/"
        proxy.close_connections()
        browser.wait_until(lambda: "Connection lost" in browser.find("#note").text)
        browser.wait_until(lambda: browser.find("#note").text == "")
        assert browser.run_script("return controls")
        browser.driver.refresh()
        browser.wait_until(lambda: get_canvas_size(browser) == [900, 600])
        # On a slow connection, the page misses frames but no input.
        browser.run_script(
            "window.frameCount = 0; const showFrame = drawFrame;"
            "drawFrame = (...values) => { frameCount++; return showFrame(...values); }"
        )
        proxy.bytes_per_s = 20_000.0
        time.sleep(1.0)
        count_before = browser.run_script("return frameCount")
        time.sleep(2.0)
        assert browser.run_script("return frameCount") - count_before < 30
        browser.press_keys(" " * 9)  # The last key pauses.
        time.sleep(1.0)
        proxy.bytes_per_s = 0.0
        paused = wait_for_unchanged_picture(browser)
        browser.press_keys(" ")
        browser.wait_until(lambda: read_picture(browser) != paused)


@pytest.fixture
def name_field(browser, tmp_path):
    """Show an editor, whose field of the map's name has the focus; the page may use the clipboard."""
    browser.resize(1280, 720)
    with serve_window("edit", "--folder", str(tmp_path)) as link:
        allowed = {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]}
        origin = link.partition("/?")[0]
        browser.driver.execute_cdp_cmd("Browser.grantPermissions", {"origin": origin, **allowed})
        browser.driver.get(link)
        browser.wait_until(lambda: get_canvas_size(browser) == [1280, 720])
        wait_for_unchanged_picture(browser)
        browser.drag((1150, 99))
        press_with_control(browser, "a")
        yield browser


def paste_text(browser, text):
    """Put a text on the clipboard, and paste it."""
    browser.driver.execute_async_script(
        "navigator.clipboard.writeText(arguments[0]).then(arguments[1])", text
    )
    press_with_control(browser, "v", "paste")
    wait_for_unchanged_picture(browser)


def test_text_is_pasted_once(name_field, tmp_path):
    paste_text(name_field, "Große Halle")
    name_field.press_keys(ENTER)
    wait_for_unchanged_picture(name_field)
    press_with_control(name_field, "s")
    wait_for_unchanged_picture(name_field)
    name_field.press_keys(ENTER)
    name_field.wait_until(lambda: list(tmp_path.glob("*.json")))
    assert json.loads(next(tmp_path.glob("*.json")).read_text())["name"] == "Große Halle"


def test_text_is_copied(name_field):
    paste_text(name_field, "Große Halle")
    name_field.press_keys("!")
    press_with_control(name_field, "a")
    press_with_control(name_field, "c", "copy")
    read_clipboard = "navigator.clipboard.readText().then(arguments[0])"
    name_field.wait_until(lambda: name_field.driver.execute_async_script(read_clipboard) == "Große Halle!")


def wait_for_message(browser, text):
    """Wait until the message of the window contains a text."""
    browser.wait_until(lambda: text in read_status(browser))


def test_drags_with_modifiers_copy_and_select_obstacles(browser, rooms):
    alt = 1
    browser.drag((738, 160), (729, 190), (719, 215), modifiers=alt)  # the round table
    wait_for_message(browser, "copied")
    shift = 8
    browser.drag((639, 90), (739, 200), (824, 248), modifiers=shift)  # from the floor of a room
    wait_for_message(browser, "selected")
    assert browser.read_console() == []


@contextmanager
def show_on_phone(browser, link):
    """Show a window on a phone held upright."""
    with browser.emulate_touch():
        browser.resize(390, 844, 2.0)
        browser.driver.get(link)
        browser.wait_until(lambda: get_classes(browser) == {"phone"})
        wait_for_unchanged_picture(browser)
        yield browser
        assert browser.read_console() == []


@pytest.fixture(scope="module")
def rooms_for_buttons(tmp_path_factory):
    """Serve a window of the map Rooms for the tests of buttons, and yield its link."""
    folder = tmp_path_factory.mktemp("rooms")
    with serve_window("demo", "rooms", "--paused", "--folder", str(folder)) as link:
        yield link


@pytest.fixture
def separate_phone(browser, tmp_path):
    """Show a new window of the map Rooms on a phone."""
    with (
        serve_window("demo", "rooms", "--paused", "--folder", str(tmp_path)) as link,
        show_on_phone(browser, link) as phone,
    ):
        yield phone


@pytest.fixture
def phone(browser, rooms_for_buttons):
    """Show a window of the map Rooms on a phone. Each test undoes what it has changed."""
    with show_on_phone(browser, rooms_for_buttons) as phone:
        yield phone


@pytest.fixture(scope="module")
def rooms_for_fingers(tmp_path_factory):
    """Serve a window of the map Rooms for the tests of fingers, and yield its link."""
    folder = tmp_path_factory.mktemp("rooms")
    with serve_window("demo", "rooms", "--paused", "--folder", str(folder)) as link:
        yield link


@pytest.fixture
def shared_phone(browser, rooms_for_fingers):
    """Show a window of the map Rooms on a phone. Other tests may have moved its map and opened its panel."""
    with show_on_phone(browser, rooms_for_fingers) as phone:
        yield phone


def are_large(buttons):
    """Return whether all visible buttons can be touched easily."""
    return all(min(button.size.values()) >= 48 for button in buttons if button.is_displayed())


def test_a_phone_held_upright_has_the_bar_below_the_window(shared_phone):
    assert shared_phone.measure("canvas") == (0, 0, 390, 792)
    assert shared_phone.measure("#touch")[1] == 792


@pytest.fixture
def touch(shared_phone):
    """Return a function that moves fingers through steps, and returns the messages that the page sends.

    Each message is reduced to its kind, the number of its button, and its horizontal position in the page.
    The panel of the window is open.
    """
    if not shared_phone.run_script("return scrollBox"):
        shared_phone.find("#panel").click()
        shared_phone.wait_until(lambda: shared_phone.run_script("return scrollBox"))
    take_messages = record_messages(shared_phone)

    def move_fingers(*steps):
        shared_phone.touch(*steps)
        messages = [message for message in take_messages() if message["kind"] in ("button", "wheel")]
        return [(message["kind"], message.get("button"), round(message["x"] / 2)) for message in messages]

    return move_fingers


def test_a_phone_shows_no_buttons_of_the_window_before_it_opens(shared_phone):
    """They did nothing yet, and their labels were clipped."""
    script = """
        const listShown = () => [...document.querySelectorAll("#touch .window")].filter(b => b.offsetParent);
        document.body.className = "";
        const onTablet = listShown().length;
        document.body.className = "blank";
        const before = listShown().length;
        document.body.className = "phone";
        return [onTablet, before];
    """
    assert shared_phone.run_script(script) == [4, 0]


def test_a_finger_drags_with_the_left_button(touch):
    dragged = touch(*([(40 + 10 * k, 300)] for k in range(5)))
    assert dragged == [("button", 1, 40), ("button", 1, 80)]


def test_an_unsteady_long_press_is_a_right_click(touch):
    pressed = touch(*([(60 + k % 2, 300)] for k in range(15)))
    assert pressed == [("button", 3, 60)] * 2


def test_two_fingers_pan_and_zoom(touch):
    pinch = touch(*([(50 - 4 * k, 300), (70 + 4 * k, 300)] for k in range(8)))
    assert pinch[0] == pinch[-1] == ("button", 3, 60)
    assert {"wheel"} == {kind for kind, *_ in pinch[1:-1]}


def test_a_finger_that_moves_up_scrolls_the_panel(touch):
    scrolled = touch(*([(60, 700 - 20 * k)] for k in range(6)))
    assert {kind for kind, *_ in scrolled} == {"wheel"}


def test_a_finger_that_moves_to_the_side_moves_a_slider_of_the_panel(touch):
    moved = touch(*([(60 + 10 * k, 700)] for k in range(6)))
    assert {kind for kind, *_ in moved} == {"button"}


def test_the_buttons_of_a_phone_are_large(shared_phone):
    assert list_bar_buttons(shared_phone) == ["Play", "Undo", "Tools", "Settings", "Lesson", "More", "1 here"]
    assert are_large(shared_phone.find_all("#touch button"))
    shared_phone.find("#to-more").click()
    assert are_large(shared_phone.find_all("#more button"))


def test_the_bar_of_a_phone_plays_and_pauses(phone):
    phone.find("#play").click()
    phone.wait_until(lambda: phone.find("#play").text == "Pause")
    phone.find("#play").click()
    phone.wait_until(lambda: phone.find("#play").text == "Play")


def list_lit_buttons(browser):
    """Return the labels of the buttons in the bar of a phone that are highlighted."""
    return [button.text for button in browser.find_all("#touch button.lit")]


def choose_tool(browser, name, label):
    """Choose a tool on a phone, and wait until the button of the tools has a label."""
    browser.find("#to-tools").click()
    browser.find(f"[data-command='tool:{name}']").click()
    button = browser.find("#to-tools")
    browser.wait_until(lambda: button.get_attribute("aria-label") == label)


def test_the_bar_of_a_phone_shows_the_chosen_tool_and_lights_one_button(phone):
    assert list_lit_buttons(phone) == []
    choose_tool(phone, "failure", "Tools: Fail robot")
    assert phone.find("#to-tools").text == "Tools", "users find it again"
    phone.wait_until(lambda: list_lit_buttons(phone) == ["Tools"])
    phone.find("#panel").click()
    phone.wait_until(lambda: list_lit_buttons(phone) == ["Settings"])
    phone.find("#to-more").click()
    assert list_lit_buttons(phone) == ["More"]
    phone.find("#to-more").click()
    assert list_lit_buttons(phone) == ["Settings"]
    phone.find("#panel").click()
    phone.wait_until(lambda: list_lit_buttons(phone) == ["Tools"])
    choose_tool(phone, "hand", "Tools")


def locate_bar_buttons(browser):
    """Return the left edge of each visible button in the bar of a phone, CSS px, by its label."""
    buttons = browser.find_all("#touch button")
    return {button.text: button.rect["x"] for button in buttons if button.is_displayed()}


def test_buttons_of_a_phone_stay_in_place_when_there_are_files_to_download(separate_phone):
    before = locate_bar_buttons(separate_phone)
    separate_phone.find("#to-more").click()
    sheet = {
        button.text: button.rect
        for button in separate_phone.find_all("#more button")
        if button.is_displayed()
    }
    push_button(separate_phone, "#more button", "Save")
    separate_phone.wait_until(lambda: "saved" in get_classes(separate_phone))
    assert locate_bar_buttons(separate_phone) == before
    separate_phone.find("#to-more").click()
    for button in separate_phone.find_all("#more button"):
        assert button.text == "Download" or button.rect == sheet[button.text]
    push_button(separate_phone, "#more button", "Download")
    assert separate_phone.find("#saved a").text == "rooms-1.robocov"


def test_the_bar_of_a_phone_undoes_an_edit(phone):
    assert not phone.find("#undo").is_enabled()
    phone.find("#to-more").click()
    phone.find("[data-command='pane:add']").click()
    wait_for_unchanged_picture(phone)
    phone.press_keys(ENTER)
    phone.wait_until(lambda: phone.find("#undo").is_enabled())
    phone.find("#undo").click()
    phone.wait_until(lambda: not phone.find("#undo").is_enabled())


def test_the_bar_of_a_phone_opens_the_lesson_in_place_of_the_panel(phone):
    phone.find("#lesson").click()
    phone.wait_until(lambda: phone.find("#lesson").get_attribute("aria-pressed") == "true")
    assert not phone.find("#panel").is_enabled()
    phone.find("#lesson").click()
    phone.wait_until(lambda: phone.find("#panel").is_enabled())


class PhoneEditor:
    """An editor on a phone, which is used by touch alone.

    Attributes
    ----------
    browser : Browser
    path : Path
        File of the map, whose content is compared with what was drawn.
    """

    def __init__(self, browser, path):
        self.browser = browser
        self.path = path

    def touch(self, *points):
        """Move a finger through points; the next touch is no double tap."""
        self.browser.touch(*([point] for point in points))
        time.sleep(0.6)

    def choose_tool(self, name, label):
        """Choose a tool, which the button of the tools then shows."""
        self.browser.find("#to-tools").click()
        self.browser.find(f"[data-command='tool:{name}']").click()
        button = self.browser.find("#to-tools")
        self.browser.wait_until(lambda: button.get_attribute("aria-label") == label)

    def draw_wall(self):
        """Draw a wall across the screen."""
        self.choose_tool("wall", "Tools: Wall")
        self.touch((110, 400))
        self.touch((250, 400))
        self.browser.wait_until(lambda: self.browser.find("#try").text == "Finish")
        self.browser.find("#try").click()
        self.browser.wait_until(lambda: self.browser.find("#try").text == "Try it")

    def drag_wall(self):
        """Drag the wall down, which also selects it."""
        self.choose_tool("select", "Tools")
        self.touch(*((180, 400 + 10 * k) for k in range(8)))
        self.browser.wait_until(lambda: self.browser.find("#delete").is_enabled())

    def save_until(self, condition):
        """Save the map, and wait until its obstacles fulfil a condition."""
        self.browser.find("#save").click()
        self.browser.wait_until(lambda: condition(json.loads(self.path.read_text())["obstacles"]))

    def undo_all(self):
        """Undo all edits, so that the next test starts with an empty map."""
        undo = self.browser.find("#undo")
        for _ in range(MAX_EDITS):
            if not undo.is_enabled():
                return
            undo.click()
            wait_for_unchanged_picture(self.browser)


@pytest.fixture(scope="module")
def shared_editor(tmp_path_factory):
    """Serve an editor of an empty map for several tests, and yield its link and the file of the map."""
    path = tmp_path_factory.mktemp("editor") / "plan.json"
    path.write_text(EMPTY_MAP)
    with serve_window("edit", str(path), "--folder", str(path.parent)) as link:
        yield link, path


@pytest.fixture
def phone_editor(browser, shared_editor):
    """Show an editor with an empty map on a phone."""
    link, path = shared_editor
    with browser.emulate_touch():
        browser.resize(390, 844, 2.0)
        browser.driver.get(link)
        browser.wait_until(lambda: "phone" in get_classes(browser))
        browser.wait_until(lambda: browser.find("#try").is_displayed())
        wait_for_unchanged_picture(browser)
        editor = PhoneEditor(browser, path)
        yield editor
        editor.undo_all()
        assert browser.read_console() == []


def test_the_bar_of_the_editor_on_a_phone_has_large_buttons(phone_editor):
    labels = list_bar_buttons(phone_editor.browser)
    # Another button follows after a test that has saved the map.
    assert labels[:6] == ["Try it", "Undo", "Tools", "Delete", "Save", "More"]
    assert are_large(phone_editor.browser.find_all("#touch button"))


def test_a_wall_is_drawn_and_saved_by_touch(phone_editor):
    phone_editor.draw_wall()
    phone_editor.save_until(lambda obstacles: len(obstacles) == 1)


def test_a_finger_drags_an_obstacle_of_the_editor(phone_editor):
    phone_editor.draw_wall()
    phone_editor.save_until(lambda obstacles: len(obstacles) == 1)
    drawn = json.loads(phone_editor.path.read_text())["obstacles"]
    phone_editor.drag_wall()
    phone_editor.save_until(lambda obstacles: len(obstacles) == 1 and obstacles != drawn)


def test_a_button_of_the_editor_deletes_the_selected_obstacle(phone_editor):
    phone_editor.draw_wall()
    phone_editor.drag_wall()
    phone_editor.save_until(lambda obstacles: len(obstacles) == 1)
    delete = phone_editor.browser.find("#delete")
    delete.click()
    phone_editor.browser.wait_until(lambda: not delete.is_enabled())
    phone_editor.save_until(lambda obstacles: not obstacles)


def find_covering_elements(browser):
    """Return the selectors of the bars and sheets that overlap the window."""
    script = (
        "const window = canvas.getBoundingClientRect();"
        "const covers = (box) => box.height > 0 && box.top < window.bottom;"
        "return ['#saved', '#people', '#downloads', '#touch'].filter("
        "(selector) => covers(document.querySelector(selector).getBoundingClientRect()))"
    )
    return browser.run_script(script)


def check_saved_files(browser, *, has_touch):
    """Check that the saved files cover the window only after a tap on their button."""
    wait_for_unchanged_picture(browser)
    assert find_covering_elements(browser) == []
    assert browser.find("#downloads").is_displayed() != has_touch
    if not has_touch:
        return
    more = browser.find("#to-more")
    more.click()
    push_button(browser, "#more button", "Download")
    assert browser.find("#saved a").text == "rooms-1.robocov"
    assert find_covering_elements(browser) == ["#saved"]
    more.click()
    more.click()
    assert find_covering_elements(browser) == []
    more.click()
    push_button(browser, "#more button", "Download")
    browser.find("#to-tools").click()
    assert find_covering_elements(browser) == [], "another sheet replaces it"


def test_saved_files_cover_the_window_only_when_the_user_opens_them(browser, tmp_path):
    browser.resize(1280, 720)
    with serve_window("demo", "rooms", "--paused", "--folder", str(tmp_path)) as link:
        browser.driver.get(link)
        browser.wait_until(lambda: "blank" not in get_classes(browser))
        browser.run_script("send({kind: 'command', name: 'save:session'})")
        browser.wait_until(lambda: "saved" in get_classes(browser))
        check_saved_files(browser, has_touch=False)
        with browser.emulate_touch():
            for width, height in ((390, 844), (844, 390)):
                browser.resize(width, height)
                browser.driver.refresh()
                browser.wait_until(lambda: {"phone", "saved"} <= get_classes(browser))
                check_saved_files(browser, has_touch=True)
        assert browser.read_console() == []
