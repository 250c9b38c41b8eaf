"""Pages that show a window, and the files that they are offered, without a browser."""

import os
import re
from importlib.resources import files
from itertools import count
from types import SimpleNamespace

import pytest

from robocov_app.web.events import PageChanged
from robocov_app.web.files import list_saved
from robocov_app.web.pages import MAX_MAP_PIXELS, MAX_MAP_SIZES, Pages

IDENTITIES = count()


def open_page(pages: Pages, *, may_control: bool):
    """Add a page with an identity that no page has had before, as after each loading."""
    return pages.open(SimpleNamespace(), may_control=may_control, page_id=f"page-{next(IDENTITIES)}")


def test_a_teacher_who_reloads_the_page_stays_the_first():
    pages = Pages(lambda previous, page: None)
    teacher = open_page(pages, may_control=True)
    viewers = [open_page(pages, may_control=False) for _ in range(2)]
    pages.close(teacher)
    teacher = open_page(pages, may_control=True)
    assert (teacher.number, teacher.name) == (1, "Teacher 1")
    assert pages.controlling is teacher
    assert [viewer.number for viewer in viewers] == [2, 3]
    assert open_page(pages, may_control=False).name == "Viewer 4"


def report_size(page, width: int, height: int, ratio: float = 1.0) -> None:
    page.settings = PageChanged(kind="page", width=width, height=height, ratio=ratio, dark=False)


def test_a_phone_in_control_does_not_shrink_the_projector():
    pages = Pages(lambda previous, page: None)
    projector = open_page(pages, may_control=True)
    report_size(projector, 1920, 1080)
    phone = open_page(pages, may_control=False)
    report_size(phone, 780, 1600, ratio=2.0)
    pages.give_control(phone)
    assert pages.display_settings is projector.settings
    notebook = open_page(pages, may_control=False)
    report_size(notebook, 1280, 720)
    pages.give_control(notebook)
    assert pages.display_settings is notebook.settings, "a wide page has a window of its size"
    pages.give_control(phone)
    pages.close(projector)
    assert pages.display_settings is notebook.settings
    pages.close(notebook)
    assert pages.display_settings is phone.settings


def test_a_phone_alone_has_a_window_of_its_size():
    pages = Pages(lambda previous, page: None)
    phone = open_page(pages, may_control=True)
    report_size(phone, 390, 800)
    assert pages.display_settings is phone.settings


def test_phones_show_the_map_while_the_window_is_wide():
    pages = Pages(lambda previous, page: None)
    projector = open_page(pages, may_control=True)
    report_size(projector, 1920, 1080)
    phones = [open_page(pages, may_control=False) for _ in range(2)]
    for phone in phones:
        report_size(phone, 780, 1600, ratio=2.0)
    pages.update_map_sizes()
    assert projector.map_size is None
    size = phones[0].map_size
    assert size == phones[1].map_size
    assert size.width * size.height <= MAX_MAP_PIXELS + 2000
    assert size.width / size.height == pytest.approx(780 / 1600, abs=0.001)
    assert size.scale / 2.0 == pytest.approx(size.width / 780, abs=0.001), "texts have the size of the page's"
    pages.close(projector)
    pages.give_control(phones[0])
    pages.update_map_sizes()
    assert [phone.map_size for phone in phones] == [None, None], "the window has the size of a phone"


@pytest.mark.parametrize(
    ("size", "has_own_picture"),
    [
        ((1920, 1080), False),
        ((1600, 900), False),
        ((1366, 768), False),
        ((2560, 1440), False),
        ((1024, 768), True),
        ((768, 1024), True),
        ((2560, 1080), True),
        ((960, 540), True),
    ],
)
def test_a_viewer_whose_screen_has_another_shape_gets_a_picture_of_its_own(size, has_own_picture):
    pages = Pages(lambda previous, page: None)
    teacher = open_page(pages, may_control=True)
    report_size(teacher, 1920, 1080)
    viewer = open_page(pages, may_control=False)
    report_size(viewer, *size)
    pages.update_map_sizes()
    assert teacher.map_size is None
    assert (viewer.map_size is not None) == has_own_picture
    if viewer.map_size is not None:
        assert viewer.map_size.width / viewer.map_size.height == pytest.approx(size[0] / size[1], abs=0.01)


def test_viewers_with_sharp_screens_are_compared_by_the_size_of_texts():
    pages = Pages(lambda previous, page: None)
    report_size(open_page(pages, may_control=True), 1280, 720)
    sharp = open_page(pages, may_control=False)
    report_size(sharp, 2560, 1440, ratio=2.0)
    tiny = open_page(pages, may_control=False)
    report_size(tiny, 1280, 720, ratio=2.0)
    pages.update_map_sizes()
    assert sharp.map_size is None
    assert tiny.map_size is not None


def test_a_phone_on_its_side_does_not_shrink_the_projector():
    pages = Pages(lambda previous, page: None)
    projector = open_page(pages, may_control=True)
    report_size(projector, 1280, 720)
    phone = open_page(pages, may_control=False)
    report_size(phone, 1688, 676, ratio=2.0)
    pages.give_control(phone)
    pages.update_map_sizes()
    assert pages.display_settings is projector.settings
    assert phone.map_size is not None


def test_only_small_screens_with_touch_have_the_buttons_of_the_window():
    def is_compact(width, height, ratio=1.0, *, touch=True):
        settings = PageChanged(kind="page", width=width, height=height, ratio=ratio, dark=False, touch=touch)
        return settings.is_compact

    assert is_compact(780, 1584, 2.0)
    assert is_compact(1688, 676, 2.0)
    assert not is_compact(768, 972)
    assert not is_compact(1536, 1944, 2.0)
    assert not is_compact(390, 800, touch=False)


def test_the_number_of_sizes_of_the_map_is_limited():
    pages = Pages(lambda previous, page: None)
    report_size(open_page(pages, may_control=True), 1920, 1080)
    phones = [open_page(pages, may_control=False) for _ in range(MAX_MAP_SIZES + 3)]
    for number, phone in enumerate(phones):
        report_size(phone, 390, 600 + 20 * number)
    pages.update_map_sizes()
    assert len({phone.map_size for phone in phones}) == MAX_MAP_SIZES
    assert phones[-1].map_size == phones[MAX_MAP_SIZES - 1].map_size, "the most similar one"


def test_uploaded_files_are_not_offered_as_saved_until_they_are_saved(tmp_path):
    uploaded = tmp_path / "broken.json"
    uploaded.write_text("{")
    uploads = {uploaded.name: uploaded.stat().st_mtime}
    (tmp_path / "run.png").write_bytes(b"")
    assert list_saved(tmp_path, 0.0, uploads) == ("run.png",)
    uploaded.write_text("{}")
    os.utime(uploaded, (1e9, 1e9))
    assert set(list_saved(tmp_path, 0.0, uploads)) == {"run.png", "broken.json"}


def test_a_broken_link_does_not_hide_saved_files(tmp_path):
    (tmp_path / "run.png").write_bytes(b"")
    (tmp_path / "broken.json").symlink_to(tmp_path / "missing.json")
    assert list_saved(tmp_path, 0.0) == ("run.png",)


def test_the_page_says_who_asks_for_what_and_nothing_covers_its_messages():
    page = files("robocov_app.web").joinpath("page.html").read_text("utf-8")
    assert "${asking[0].name} asks for control" in page
    assert "${asking.length} ask for control" in page
    assert "${first.name} asks for control" in page
    assert re.search(r"#note, #notices \{ z-index: 1; \}", page)
