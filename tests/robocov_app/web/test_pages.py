"""Pages that show a window, and the files that they are offered, without a browser."""

import os
import re
from importlib.resources import files
from itertools import count
from types import SimpleNamespace

from robocov_app.web.files import list_saved
from robocov_app.web.pages import Pages

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


def test_uploaded_files_are_not_offered_as_saved_until_they_are_saved(tmp_path):
    uploaded = tmp_path / "broken.json"
    uploaded.write_text("{")
    uploads = {uploaded.name: uploaded.stat().st_mtime}
    (tmp_path / "run.png").write_bytes(b"")
    assert list_saved(tmp_path, 0.0, uploads) == ("run.png",)
    uploaded.write_text("{}")
    os.utime(uploaded, (1e9, 1e9))
    assert set(list_saved(tmp_path, 0.0, uploads)) == {"run.png", "broken.json"}


def test_the_page_says_who_asks_for_what_and_nothing_covers_its_messages():
    page = files("robocov_app.web").joinpath("page.html").read_text("utf-8")
    assert "${asking[0].name} asks for control" in page
    assert "${asking.length} ask for control" in page
    assert re.search(r"#note, #notices \{ z-index: 1; \}", page)
