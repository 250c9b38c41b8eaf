"""What a page shows over the window, such as a request for control, covers none of its controls."""

from types import SimpleNamespace

import pytest
from driven_browser import CHROMIUM, DRIVER, Browser
from served_window import serve_window

from robocov_app.toolkit.window.command_window import CommandWindow

pytest.importorskip("websockets")

from page_client import connect_page

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and its driver"),
    pytest.mark.xdist_group("web"),
]

SIZES = [(1280, 720, False), (600, 500, False), (390, 844, True), (844, 390, True), (768, 1024, True)]
"""Width and height, CSS px, and whether the page is touched."""
IS_FITTED = "return image.width === JSON.parse(sentSettings).width"
"""JavaScript that returns whether the window has adopted the size of the page."""
FIND_MAP = """
const {left, top, scale} = findWindow();
const [x, y, width, height] = mapBox;
return [left + x / scale, top + y / scale, left + (x + width) / scale, top + (y + height) / scale];
"""
"""JavaScript that returns left, top, right and bottom of the map in the page."""
FIND_BOX = """
const {left, top, right, bottom} = document.querySelector(arguments[0]).getBoundingClientRect();
return [left, top, right, bottom];
"""


def set_page(browser: Browser, width: int, height: int, *, is_touched: bool) -> None:
    """Set the size of the page, and whether it is touched."""
    browser.set_touch(is_enabled=is_touched)
    browser.resize(width, height)


def test_a_request_for_control_is_shown_over_the_map_and_covers_no_list(browser, tmp_path):
    set_page(browser, 1280, 720, is_touched=False)
    with serve_window("demo", "rooms", "--paused", "--folder", str(tmp_path)) as link:
        watch_link = link.process.stdout.readline().split()[-1]
        browser.driver.get(link)
        browser.wait_until(lambda: browser.run_script("return mapBox !== null"))
        with connect_page(watch_link) as pupil:
            pupil.send(kind="name", name="Anna")
            pupil.request_control()
            for width, height, is_touched in SIZES:
                set_page(browser, width, height, is_touched=is_touched)
                browser.driver.refresh()
                browser.wait_until(lambda: browser.run_script("return mapBox !== null && image !== null"))
                browser.wait_until(lambda: browser.find("#toast").is_displayed())
                browser.wait_until(lambda: browser.run_script(IS_FITTED))
                assert "Anna asks for control" in browser.find("#toast").text
                left, top, right, bottom = browser.run_script(FIND_BOX, "#toast")
                map_left, map_top, map_right, map_bottom = browser.run_script(FIND_MAP)
                assert map_left <= left < right <= map_right, (width, height)
                assert map_top <= top < bottom <= map_bottom, (width, height)
                assert browser.find("#here").is_displayed() != is_touched
                if not is_touched:
                    list_left, list_top, list_right, list_bottom = browser.run_script(FIND_BOX, "#here")
                    is_beside = list_right <= left or right <= list_left
                    assert is_beside or list_bottom <= top or bottom <= list_top, "it does not cover the list"
        assert browser.read_console() == []


def test_the_hint_of_the_status_line_is_not_where_a_page_shows_the_list():
    window = CommandWindow.__new__(CommandWindow)
    window.remote = SimpleNamespace()
    assert not window.has_status_hint
    window.remote = None
    assert window.has_status_hint
